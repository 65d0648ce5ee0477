"""Films under a dead load whose field jumps or rises and is held: references, exact numbers, limits and orderings."""

import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import dea_maps as dm
from dea_maps.kernels.dead_load import doubled, film
from dea_maps.sweeps.dead_load import largest_field, load_of, relaxed_threshold
from dea_maps.sweeps.methods import choose
from dea_maps.sweeps.solve import solve, solve_auto

PROGRAMS = {"step": dm.Step(), "ramp": dm.Ramp(), "ramp_hold": dm.RampHold()}
NAMES = ("time_to_failure", "critical_stretch", "critical_internal_stretch", "critical_field", "final_stretch")


@pytest.fixture(scope="module")
def reference():
    """Import the module of the certified table, which is in no package."""
    folder = Path(__file__).parents[1] / "reference"
    sys.path.insert(0, str(folder))
    import dead_load

    yield dead_load
    sys.path.remove(str(folder))


def found(program, rtol=1e-10, **parameters):
    columns = np.broadcast_arrays(*(np.asarray(value, float) for value in parameters.values()))
    given_ = {name: np.ascontiguousarray(np.atleast_1d(c)) for name, c in zip(parameters, columns, strict=True)}
    return solve_auto(PROGRAMS[program], given_, rtol)


# --- certified references


def test_table_is_complete(reference):
    rows = reference.read()
    for program in PROGRAMS:
        mine = [row for row in rows if row["program"] == program]
        assert len(mine) >= 60
        assert sum(bool(row["prestretch"]) for row in mine) >= 15 <= sum(bool(row["stress"]) for row in mine)
        kinds = {row["kind"] for row in mine}
        assert kinds >= {"apart"} | ({"beside_relaxed"} if program != "ramp" else set())
    assert all(float(row["agreement"]) <= reference.REQUIRED for row in rows)


def test_a_row_is_computed_again(reference):
    steps = [row for row in reference.read() if row["program"] == "step" and row["outcome"] == "1"]
    assert reference.confirmed(steps[7])


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-10, 1e-12])
@pytest.mark.parametrize("program", PROGRAMS)
def test_certified_table(reference, program, rtol):
    """Outcomes exact, results within rtol, nothing unresolved where rtol is promised."""
    rows = [row for row in reference.read() if row["program"] == program]
    for load in ("prestretch", "stress"):
        mine = [row for row in rows if row[load]]
        given_ = {
            name: np.array([float(row[name]) for row in mine])
            for name in (*PROGRAMS[program].parameters, "modulus_ratio", load)
        }
        result = solve_auto(PROGRAMS[program], given_, rtol)
        for cell, row in enumerate(mine):
            assert result.outcome[cell] == int(row["outcome"]), row
            for name in NAMES:
                value = getattr(result, name)[cell]
                if row[name]:
                    assert value == pytest.approx(float(row[name]), rel=rtol + 4 * reference.REQUIRED, abs=0), (
                        name,
                        row,
                    )
                else:
                    assert np.isnan(value)


# --- exact numbers


@pytest.mark.parametrize(
    ("prestretch", "load", "stretch", "field"),
    [
        (1.25, 0.9223, 1.6813, 0.5521),
        (1.5, 1.3683, 2.1413, 0.4023),
        (2.0, 1.9688, 2.9704, 0.2838),
        (3.0, 2.9959, 4.4960, 0.1869),
        (4.0, 3.9990, 5.9991, 0.1400),
    ],
)
@pytest.mark.parametrize("program", PROGRAMS)
def test_elastic_film(program, prestretch, load, stretch, field):
    """It fails where the largest load of the relaxed film is met, however the field got there."""
    assert load_of(prestretch) == pytest.approx(load, abs=5.1e-5)
    at = {"field": 3.0, "rate": 0.7}
    at = {name: at[name] for name in PROGRAMS[program].parameters}
    result = found(program, **at, modulus_ratio=1.0, prestretch=prestretch)
    assert result.critical_stretch == pytest.approx(stretch, abs=5.1e-5)
    assert result.critical_field == pytest.approx(field, abs=5.1e-5)
    assert result.time_to_failure == pytest.approx(0.0 if program == "step" else result.critical_field / 0.7)


@pytest.mark.parametrize(("prestretch", "ratio"), [(1.0, 2.0), (1.5, 2.146), (2.0, 1.801), (3.0, 1.410), (4.0, 1.243)])
def test_instant_over_relaxed_threshold(prestretch, ratio):
    at_once = found("step", field=9.0, modulus_ratio=4.0, prestretch=prestretch)
    assert at_once.outcome == 2
    threshold = relaxed_threshold(load_of(np.array(prestretch)))
    assert at_once.critical_field / threshold == pytest.approx(ratio, abs=5.1e-4)
    edge = at_once.critical_field[0]
    beside = np.array([edge * (1 - 1e-14), edge * (1 + 1e-14)])
    assert list(found("step", field=beside, modulus_ratio=4.0, prestretch=prestretch).outcome) == [1, 2]


@pytest.mark.parametrize("m", [1.5, 4.0, 300.0])
@pytest.mark.parametrize("program", ["step", "ramp_hold"])
def test_the_relaxed_threshold_does_not_depend_on_the_modulus_ratio(program, m):
    for load in ({"prestretch": 2.5}, {"stress": 2.0}):
        sigma = load.get("stress", load_of(np.array(load.get("prestretch", 1.0))))
        beside = float(relaxed_threshold(np.array(sigma))) * np.array([1 - 1e-14, 1 + 1e-14])
        at = {"field": beside, "rate": 0.3} if program == "ramp_hold" else {"field": beside}
        assert list(found(program, 1e-6, **at, modulus_ratio=m, **load).outcome) == [0, 1]


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-10])
def test_films_that_hardly_relax_are_resolved(rtol):
    """Whether they reach their field is decided within p = m - 1 of it; those that do not fail on the ramp."""
    random = np.random.default_rng(14)
    m = 1.0 + 10.0 ** random.uniform(-12.0, -4.0, 400)
    for load in ({"prestretch": random.uniform(1.0, 6.0, 400)}, {"stress": random.uniform(0.1, 6.0, 400)}):
        start = load.get("prestretch", np.ones(400))
        sigma = load_of(start) if "prestretch" in load else load["stress"]
        low, high = relaxed_threshold(sigma), largest_field(start, m, sigma)
        field, rate = low + random.uniform(0.0, 1.0, 400) * (high - low), 10.0 ** random.uniform(-4.0, 4.0, 400)
        result = found("ramp_hold", rtol, field=field, rate=rate, modulus_ratio=m, **load)
        assert set(result.outcome) <= {0, 1}
        failed = result.outcome == 1
        # The field falls short of the given one by no more than what relaxation leaves of it.
        assert np.all(result.critical_field[failed] >= low[failed] * (1.0 - rtol))
        assert np.all(result.critical_field[failed] <= field[failed] * (1.0 + rtol))


# --- limits


@pytest.mark.parametrize("program", PROGRAMS)
def test_without_a_load_it_is_the_free_film(program):
    m = np.array([1.0, 1.01, 2.0, 4.0, 40.0, 900.0])
    field = np.array([1.0, 1.0, 1.2, 1.0, 1.0 + 1e-8, 29.0])
    rate = np.array([0.3, 1e-4, 1e-2, 1.0, 30.0, 1e4])
    at = {"field": field, "rate": rate}
    at = {name: at[name] for name in PROGRAMS[program].parameters}
    free = found(program, 1e-10, **at, modulus_ratio=m)
    for load in ({"stress": 0.0}, {"prestretch": 1.0}):
        loaded = found(program, 1e-10, **at, modulus_ratio=m, **load)
        assert list(loaded.outcome) == list(free.outcome)
        for name in NAMES:
            np.testing.assert_allclose(getattr(loaded, name), getattr(free, name), rtol=3e-10, atol=0)


def test_a_fast_ramp_then_hold_is_a_step():
    at = {"field": 0.9, "modulus_ratio": 4.0, "stress": 1.0}
    step, held = found("step", **at), found("ramp_hold", rate=1e5, **at)
    assert held.time_to_failure == pytest.approx(step.time_to_failure, rel=1e-4)
    assert held.critical_stretch == pytest.approx(step.critical_stretch, rel=1e-4)


# --- other formulations


@pytest.mark.parametrize(
    ("m", "stress", "field"), [(1.5, 0.5, 0.8), (4.0, 1.0, 0.7), (4.0, 3.0, 0.35), (20.0, 2.0, 0.6)]
)
def test_general_theory(m, stress, field):
    general = dm.general_trajectory(
        time=[0.0], modulus_ratio=m, field=field, stress_1=stress, stress_2=stress, rtol=1e-10
    )
    result = found("step", field=field, modulus_ratio=m, stress=stress)
    assert result.time_to_failure == pytest.approx(float(general.time_to_failure), rel=1e-9)
    assert result.critical_stretch == pytest.approx(float(general.critical_stretch_1), rel=1e-9)


@pytest.mark.parametrize("program", PROGRAMS)
def test_formulation_in_time(program):
    at = {"field": np.array([0.6, 0.9, 0.5]), "rate": np.array([0.2, 1.0, 20.0])}
    given_ = {name: at[name] for name in PROGRAMS[program].parameters}
    given_ |= {"modulus_ratio": np.array([4.0, 2.0, 15.0]), "prestretch": np.array([1.6, 1.2, 2.5])}
    own = solve_auto(PROGRAMS[program], given_, 1e-9)
    time = solve(PROGRAMS[program], given_, choose(PROGRAMS[program], "dop853", "time", 1e-9, None, True))
    assert list(own.outcome) == list(time.outcome)
    for name in NAMES:
        np.testing.assert_allclose(getattr(own, name), getattr(time, name), rtol=2e-9)


# --- orderings


@settings(max_examples=25, deadline=None)
@given(
    m=st.floats(1.001, 1000.0),
    stress=st.floats(0.0, 6.0),
    field=st.floats(0.05, 5.0),
    more=st.floats(1.0, 2.0),
    rate=st.floats(-4.0, 4.0),
    program=st.sampled_from(sorted(PROGRAMS)),
)
def test_a_larger_field_or_load_fails_no_later(m, stress, field, more, rate, program):
    """Theorem of order: with the load or the field pointwise larger, a fresh film stretches more at every time."""
    at = {"field": field, "rate": 10.0**rate}
    at = {name: at[name] for name in PROGRAMS[program].parameters}
    driven = "rate" if program == "ramp" else "field"
    first = found(program, 1e-6, **at, modulus_ratio=m, stress=stress)
    for other in (
        found(program, 1e-6, **{**at, driven: at[driven] * more}, modulus_ratio=m, stress=stress),
        found(program, 1e-6, **at, modulus_ratio=m, stress=min(stress * more, 6.0)),
    ):
        assert {first.outcome[0], other.outcome[0]} <= {0, 1, 2}
        if first.outcome[0] != 0:
            assert other.outcome[0] != 0
            assert other.time_to_failure[0] <= first.time_to_failure[0] * (1 + 3e-6)


# --- arithmetic


@settings(max_examples=100, deadline=None)
@given(a=st.floats(1e-3, 1e3), b=st.floats(1e-3, 1e3), c=st.floats(1e-3, 1e3), below=st.floats(-1e-17, 1e-17))
def test_sums_of_two_floats(a, b, c, below):
    exact = Fraction(a) * Fraction(b)
    assert sum(map(Fraction, map(float, doubled.product(a, b)))) == exact
    high, low = doubled.product(a, b)
    for pair, truth in (
        (doubled.add(high, low, c, below), exact + Fraction(c) + Fraction(below)),
        (doubled.multiply(high, low, c, below), exact * (Fraction(c) + Fraction(below))),
        (doubled.quotient(c, high, low), Fraction(c) / exact),
    ):
        assert abs(sum(map(Fraction, map(float, pair))) / truth - 1) < Fraction(1, 10**29)


def test_critical_load_to_twice_the_digits():
    total = Fraction(film.CRITICAL_LOAD) + Fraction(film._CRITICAL_LOAD_LOW)
    assert abs((total * Fraction(4, 3)) ** 3 * 4 - 1) < Fraction(1, 10**31)
