"""Any legal input ends in an outcome that is true; what is not legal is refused before computing."""

import itertools
import math
from fractions import Fraction

import hypothesis.strategies as st
import numba
import numpy as np
import pytest
import xarray as xr
from hypothesis import example, given, settings

import dea_maps as dm
from dea_maps.kernels import build as kernel_build
from dea_maps.kernels import solvers, sweep
from dea_maps.kernels.lane_state import BUDGET_SPENT, FAILED, RUNNING
from dea_maps.kernels.rising import control
from dea_maps.kernels.rising.explicit import make_explicit
from dea_maps.kernels.runge_kutta.tableaus import TABLEAUS
from dea_maps.runs import maps as sweeping
from dea_maps.sweeps import solve

PROGRAMS = {"step": dm.Step(), "ramp": dm.Ramp(), "ramp_hold": dm.RampHold()}
SURVIVES, FAILS_LATER, FAILS_AT_ONCE, UNRESOLVED = range(4)
LARGEST, SMALLEST = 1.7e308, 5e-324
LEAST_STRETCH = 2 ** (1 / 3)
EXAMPLES = 15 if numba.config.DISABLE_JIT else 150

pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")  # without the compiler, idle lanes warn


def beside(value):
    """Doubles within a few units of rounding of a double."""

    def shifted(count):
        found = value
        for _ in range(abs(count)):
            found = math.nextafter(found, math.copysign(math.inf, count))
        return found

    return st.integers(-3, 3).map(shifted)


def powers_of_ten(low, high):
    return st.floats(low, high).map(lambda exponent: 10.0**exponent)


any_rtol = st.sampled_from([1e-3, 1e-6, 1e-9, 1e-12]) | powers_of_ten(-12, -3).map(lambda x: min(max(x, 1e-12), 1e-3))
any_ratio = (
    st.sampled_from([1.0, math.nextafter(1, 2), 1 + 1e-15, 4.0, LARGEST])
    | st.floats(1, LARGEST)
    | powers_of_ten(0, 308)
    | powers_of_ten(-16, 0).map(lambda x: 1 + x)
)
any_rate = st.sampled_from([SMALLEST, 1e-300, 1.0, LARGEST]) | st.floats(SMALLEST, LARGEST) | powers_of_ten(-320, 308)
promised_ratio = (
    st.sampled_from([1.0, math.nextafter(1, 2), 4.0, 1000.0])
    | powers_of_ten(0, 3).map(lambda x: min(x, 1000.0))
    | powers_of_ten(-16, 0).map(lambda x: 1 + x)
)
promised_rate = powers_of_ten(-6, 5).map(lambda x: min(max(x, 1e-6), 1e5))


def field_for(m, wide):
    """Fields for a film: beside both limits, between them, anywhere."""
    top = math.sqrt(m)
    between = st.floats(0, 1).map(lambda share: 1 + share * (top - 1))
    close = powers_of_ten(-16, 0).map(lambda gap: 1 + gap * (top - 1)) | powers_of_ten(-16, 0).map(
        lambda gap: top * (1 - gap)
    )
    choice = beside(1.0) | beside(top) | between | close | st.floats(0, 1.5 * top)
    if wide:
        return choice | st.floats(0, LARGEST) | powers_of_ten(-320, 308)
    return choice.map(lambda field: min(field, 1.5 * top))


def cells(wide):
    """Lists of (modulus_ratio, field, rate)."""
    ratio, rate = (any_ratio, any_rate) if wide else (promised_ratio, promised_rate)
    one = ratio.flatmap(lambda m: st.tuples(st.just(m), field_for(m, wide), rate))
    return st.lists(one, min_size=1, max_size=24)


def solved(program, scenes_, rtol, **choice):
    """Sweep scattered cells; a list of the variables of each."""
    names = ("modulus_ratio", *PROGRAMS[program].parameters)
    columns = dict(zip(("modulus_ratio", "field", "rate"), np.array(scenes_, float).T, strict=True))
    ds = dm.sweep(
        PROGRAMS[program], **{name: xr.DataArray(columns[name], dims="sample") for name in names}, rtol=rtol, **choice
    )
    columns = {str(name): ds[name].values.tolist() for name in ds.data_vars}
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def exact_outcome(program, m, field):
    """What becomes of a film, by the rules of the model, in exact arithmetic."""
    if program == "ramp":
        return FAILS_LATER
    m, field = Fraction(m), Fraction(field)
    if program == "step" and field**2 >= m:
        return FAILS_AT_ONCE
    return SURVIVES if field < 1 or (field == 1 and m > 1) else FAILS_LATER


def check(program, cell, found, rtol):
    """Hold one cell of a sweep to the rules."""
    m, field, rate = cell
    outcome = found.pop("outcome")
    finite = {name for name, value in found.items() if math.isfinite(value)}
    assert all(math.isnan(value) for name, value in found.items() if name not in finite)
    failure = set(found) - {"final_stretch"}
    if outcome == UNRESOLVED:
        assert not finite
        assert exact_outcome(program, m, field) == FAILS_LATER
        return
    assert outcome == exact_outcome(program, m, field)
    assert finite == ({"final_stretch"} if outcome == SURVIVES else failure)
    if outcome == SURVIVES:
        assert 1 <= found["final_stretch"] <= LEAST_STRETCH * (1 + 1e-15)
        return
    time, stretch, internal, at = (
        found[name] for name in ("time_to_failure", "critical_stretch", "critical_internal_stretch", "critical_field")
    )
    if outcome == FAILS_AT_ONCE:
        assert (time, internal) == (0.0, 1.0)
        assert stretch == pytest.approx(LEAST_STRETCH, rel=1e-15)
        assert at == pytest.approx(math.sqrt(m), rel=1e-15)
        return
    assert time > 0
    slack = 1 + rtol + 1e-14
    assert LEAST_STRETCH / slack <= stretch
    assert 1 / slack <= internal <= stretch * slack
    assert 1 / slack <= at <= math.sqrt(m) * slack
    if program != "ramp":
        assert at <= field * slack
    if program != "step":
        assert time * rate >= at / slack


@pytest.mark.parametrize("program", PROGRAMS)
@settings(max_examples=EXAMPLES, deadline=None)
@given(scattered=cells(True), rtol=any_rtol)
@example(scattered=[(1e300, 1e149, 1e-300), (1e300, 1e-300, 1e300), (1 + 1e-15, 1.0, 1e300)], rtol=1e-12)
@example(scattered=[(4.0, 1.2, 1e-153), (4.0, 1e-100, 5e-324)], rtol=1e-3)
@example(scattered=[(4.0, math.nextafter(2, 0), 1.0), (1000.0, math.nextafter(1, 2), 1e-6)], rtol=1e-12)
def test_any_legal_input_has_its_outcome(program, scattered, rtol):
    for cell, found in zip(scattered, solved(program, scattered, rtol), strict=True):
        check(program, cell, found, rtol)


@pytest.mark.parametrize("program", PROGRAMS)
@settings(max_examples=EXAMPLES, deadline=None)
@given(scattered=cells(False), rtol=any_rtol)
@example(scattered=[(4.0, 1 + 1e-12, 1e-6), (1000.0, math.sqrt(1000.0) * (1 - 1e-12), 1e5)], rtol=1e-12)
def test_no_cell_of_the_guaranteed_region_is_unresolved(program, scattered, rtol):
    for cell, found in zip(scattered, solved(program, scattered, rtol), strict=True):
        assert found["outcome"] != UNRESOLVED, cell
        check(program, cell, found, rtol)


@settings(max_examples=EXAMPLES, deadline=None)
@given(m=promised_ratio.filter(lambda m: m > 1), data=st.data(), rtol=any_rtol)
def test_a_higher_field_kills_sooner(m, data, rtol):
    fields = sorted(data.draw(st.lists(field_for(m, False), min_size=2, max_size=24)))
    found = solved("step", [(m, field, 1.0) for field in fields], rtol)
    failing = [(field, one) for field, one in zip(fields, found, strict=True) if one["outcome"] == FAILS_LATER]
    for (low, before), (high, after) in itertools.pairwise(failing):
        # beside instant failure the time is a small difference, of which rounding leaves less and less
        rounding = sum(4e-15 * m / float(Fraction(m) - Fraction(field) ** 2) for field in (low, high))
        assert after["time_to_failure"] <= before["time_to_failure"] * (1 + 2 * rtol + rounding), (m, low, high)
        assert after["critical_stretch"] <= before["critical_stretch"] * (1 + 2 * rtol + 1e-14), (m, low, high)


@settings(max_examples=EXAMPLES, deadline=None)
@given(m=promised_ratio, rates=st.lists(promised_rate, min_size=2, max_size=24).map(sorted), rtol=any_rtol)
def test_a_faster_ramp_gets_higher_and_less_far(m, rates, rtol):
    found = solved("ramp", [(m, 0.0, rate) for rate in rates], rtol)
    for low, before, after in zip(rates, found, found[1:], strict=False):
        slack = 1 + 2 * rtol + 1e-14
        assert after["critical_field"] >= before["critical_field"] / slack, (m, low)
        assert after["critical_stretch"] <= before["critical_stretch"] * slack, (m, low)


@pytest.fixture
def nothing_solved(monkeypatch):
    """Fail if anything is computed."""

    def refuse(*_, **__):
        raise AssertionError("computed although the input is bad")

    monkeypatch.setattr(sweeping, "solve", refuse)
    monkeypatch.setattr(kernel_build, "sweep_for", refuse)


GOOD = {"modulus_ratio": 4.0, "field": 1.2, "rate": 1.0}


@pytest.mark.parametrize(
    ("name", "value"),
    [(name, value) for name in GOOD for value in (math.nan, math.inf, -math.inf, -1.0, -SMALLEST)]
    + [("modulus_ratio", 0.0), ("modulus_ratio", math.nextafter(1, 0)), ("rate", 0.0), ("rate", -0.0)],
)
@pytest.mark.parametrize("program", PROGRAMS)
def test_bad_parameters_are_refused(nothing_solved, program, name, value):
    taken = ("modulus_ratio", *PROGRAMS[program].parameters)
    if name not in taken:
        pytest.skip("not a parameter of this program")
    for bad in (value, [GOOD[name], value], xr.DataArray([GOOD[name], value], dims="sample")):
        with pytest.raises(ValueError, match=f"{name} must be finite and .* got {value}"):
            dm.sweep(PROGRAMS[program], **{one: GOOD[one] for one in taken} | {name: bad})


@pytest.mark.parametrize("rtol", [0.0, -1e-6, 9.99e-13, 1.01e-3, 1.0, math.nan, math.inf])
def test_bad_tolerances_are_refused(nothing_solved, rtol):
    with pytest.raises(ValueError, match=r"rtol must be from 1e-12 to 0\.001; got"):
        dm.sweep(dm.Step(), field=1.2, modulus_ratio=4.0, rtol=rtol)


def test_good_parameters_are_not_refused(nothing_solved):
    with pytest.raises(AssertionError, match="computed"):
        dm.sweep(dm.Step(), field=-0.0, modulus_ratio=1.0, rtol=1e-12)


def climb(m, rate, rtol):
    """Attempted steps of the automatic method up a ramp, outside compiled code, and the status that it ended in."""
    automatic = make_explicit(TABLEAUS["dop853"])
    count = 0

    def counted(w):
        nonlocal count
        count += 1
        automatic.attempt(w)

    cell = np.zeros(1), np.array([rate]), np.array([m])
    status, result = np.array([RUNNING]), np.empty((sweep.RESULTS, 1))
    with np.errstate(all="ignore"):
        solvers.make_solve_ramp(automatic._replace(attempt=counted), lanes=1)(*cell, rtol, 0.0, 1, status, result)
    return count, status[0]


@pytest.mark.parametrize("m", [1.0, math.nextafter(1, 2), 4.0, 1000.0])
def test_work_in_the_guaranteed_region(m):
    for rtol, most in ((1e-6, 60), (1e-12, 250)):
        for rate in (1e-6, 1e-4, 1e-2, 1.0, 1e5):
            attempts, status = climb(m, rate, rtol)
            assert status == FAILED
            assert attempts <= most, (rate, rtol)


@pytest.mark.parametrize("rate", [SMALLEST, LARGEST])
@pytest.mark.parametrize("m", [1.0, LARGEST])
def test_work_is_bounded(m, rate):
    attempts, status = climb(m, rate, 1e-12)
    assert attempts <= control.ATTEMPTS <= 10_000
    assert status in {FAILED, BUDGET_SPENT}


@pytest.mark.parametrize("program", PROGRAMS)
def test_a_spent_budget_is_unresolved(monkeypatch, program):
    monkeypatch.setattr(solve, "ATTEMPTS", 5)
    (found,) = solved(program, [(4.0, 1.2, 1e-3)], 1e-6, method="dop853", formulation="fold")
    assert found.pop("outcome") == UNRESOLVED
    assert all(math.isnan(value) for value in found.values())
