"""The first event of a film: found where it is, found once, and never made up when it is not found.

The stepped kernels run here as the plain Python that they are composed of, one film at a time.
"""

import math

import numpy as np
import pytest
from mpmath import mp, mpf

import dea_maps as dm
from dea_maps.kernels import build, lane_state, sweep
from dea_maps.kernels._jit import device
from dea_maps.kernels.forms import FORMULATIONS
from dea_maps.kernels.programs import PROGRAMS, RAMP, field_at
from dea_maps.kernels.runge_kutta.control import make_pi
from dea_maps.kernels.runge_kutta.driver import make_solve
from dea_maps.kernels.runge_kutta.tableaus import TABLEAUS

# Plain Python warns where compiled code follows IEEE 754 without a word.
pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")

HIGHEST = 2 ** (1 / 3)
UNRESOLVED = {lane_state.BUDGET_SPENT, lane_state.STEP_COLLAPSED, lane_state.NOT_FINITE}
# By two independent methods, m = 4: field, rate, time, stretch.
STEPS = [
    (1.05, 0.0, 9.028237529, 1.794411933),
    (1.2, 0.0, 2.443625636, 1.659354969),
    (1.9, 0.0, 0.04174466466, 1.292932009),
]
RAMPS = [
    (0.0, 0.1, 12.44370088, 1.625152786),
    (0.0, 1.0, 1.581172717, 1.423228766),
    (0.0, 100.0, 0.01987195524, 1.263978016),
]
HELD = [(1.3, 0.5), (1.2, 7.0), (3.0, 2.0)]  # fail in the hold, in the hold, on the way up


def run(program, form, method, cell, tolerance, attempts=20_000, step=0.0):
    """Status and result of one film: field, rate, modulus ratio."""
    kernel = build.sweep_for(program, form, method, lanes=1)
    status, result = np.empty(1, np.int8), np.empty((sweep.RESULTS, 1))
    columns = [np.array([value]) for value in cell]
    getattr(kernel, "py_func", kernel)(*columns, tolerance, step, attempts, status, result)
    return status[0], result[:, 0]


def critical_state(xi, ratio):
    """Stretch (25) and load (23) at the instability, in 30 digits."""
    with mp.workdps(30):
        p, xi = mpf(ratio) - 1, mpf(xi)
        stretch = mp.cbrt(2) * ((1 + p * xi**4) / (1 + p * xi**-2)) ** (mpf(1) / 6)
        load = stretch**-2 - stretch**-8 + p * (stretch**-2 * xi**-2 - stretch**-8 * xi**4)
        return float(stretch), float(load)


def load_of(field):
    return 0.75 * 4 ** (-1 / 3) * field**2


SCENES = (
    [("step", cell[:2]) for cell in STEPS]
    + [("ramp", cell[:2]) for cell in RAMPS]
    + [("ramp_hold", cell) for cell in HELD]
)


@pytest.mark.parametrize("method", ["rk4", "dopri5", "dop853"])
@pytest.mark.parametrize(("program", "cell"), SCENES, ids=str)
def test_regular_form_ends_on_the_instability(program, cell, method):
    field, rate = cell
    step = 0.01 / max(1.0, rate) if method == "rk4" else 0.0
    status, (time, stretch, xi, applied, _) = run(program, "fold", method, (*cell, 4.0), 1e-10, step=step)
    assert status == lane_state.FAILED
    critical, largest = critical_state(xi, 4.0)
    assert stretch == pytest.approx(critical, rel=1e-15)
    # nothing but the accuracy of the steps: the load is the program's, the largest one that of the state found
    assert load_of(applied) == pytest.approx(largest, rel=2e-5 if method == "rk4" else 1e-8)
    assert applied == (field if program == "step" else min(rate * time, field or math.inf))
    assert applied == field_at(program, field, rate, time)


@pytest.mark.parametrize(("program", "cell"), SCENES, ids=str)
def test_rate_form_ends_on_the_instability(program, cell):
    status, (_, stretch, xi, applied, _) = run(program, "rate", "dop853", (*cell, 4.0), 1e-6)
    assert status == lane_state.FAILED
    critical, largest = critical_state(xi, 4.0)
    assert stretch == pytest.approx(critical, abs=1.1e-9)  # the stretch itself is stepped, up to there
    assert load_of(applied) == pytest.approx(largest, rel=1e-4)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4])
def test_long_steps_do_not_step_over_the_event(tolerance):
    for program, rows in (("step", STEPS), ("ramp", RAMPS)):
        for field, rate, time, stretch in rows:
            for method in ("dopri5", "dop853"):
                status, result = run(program, "fold", method, (field, rate, 4.0), tolerance)
                assert status == lane_state.FAILED
                assert result[:2] == pytest.approx((time, stretch), rel=3 * tolerance)


FAILURE = 1.581172717  # field and time of a ramp at rate 1, m = 4


def beside(field):
    """Fields from 1e-2 below to 1e-2 above, by way of the neighbours and the field itself."""
    shares = 10.0 ** -np.arange(2, 16, 1.0)
    around = (math.nextafter(field, 0), field, math.nextafter(field, 9))
    return np.unique([*field * (1 - shares), *around, *field * (1 + shares)])


@pytest.mark.parametrize("method", ["auto", "dop853-fold"])
def test_corner_beside_the_failure_of_the_ramp(method):
    """Whether the ramp or its corner comes first, by a hair or by none, the film fails at nearly the same time."""
    if method == "auto":
        top = float(dm.sweep(dm.Ramp(), rate=1.0, modulus_ratio=4.0, rtol=1e-11).critical_field)
        fields = beside(top)
        ds = dm.sweep(dm.RampHold(), field=fields, rate=1.0, modulus_ratio=4.0, rtol=1e-11)
        assert (ds.outcome == 1).all()
        times, applied = ds.time_to_failure.values, ds.critical_field.values
    else:
        top = run("ramp", "fold", "dop853", (0.0, 1.0, 4.0), 1e-12)[1][sweep.CRITICAL_FIELD]
        fields = beside(top)
        found = [run("ramp_hold", "fold", "dop853", (field, 1.0, 4.0), 1e-12) for field in fields]
        assert {status for status, _ in found} == {lane_state.FAILED}
        times, _, _, applied, _ = np.transpose([result for _, result in found])
    assert top == pytest.approx(FAILURE, rel=4e-10)
    np.testing.assert_allclose(applied, np.minimum(fields, top), rtol=3e-10)
    below = np.maximum(top - fields, 0)
    late = times - top
    # what is missing, the relaxing film loses of its strength in a time proportional to it
    assert (late >= 0.4 * below - 1e-9).all()
    assert (late <= below + 1e-9).all()
    assert (np.diff(times) <= 1e-9).all()


@pytest.mark.parametrize("rate", [1 / 3, 1.0, 70.0])
@pytest.mark.parametrize("method", ["rk4", "dopri5", "dop853"])
def test_elastic_film_fails_at_the_field_it_can_carry(method, rate):
    """At m = 1 the load of a hold at exactly 1 is the largest one: both events of the ramp come at once."""
    step = 0.01 / max(1.0, rate) if method == "rk4" else 0.0
    for program, field in (("ramp", 0.0), ("ramp_hold", 1.0), ("ramp_hold", 1.5), ("ramp_hold", math.nextafter(1, 2))):
        status, result = run(program, "fold", method, (field, rate, 1.0), 1e-12, step=step)
        assert status == lane_state.FAILED
        time, stretch, _, applied, _ = result
        assert (time * rate, stretch, applied) == pytest.approx((1.0, HIGHEST, 1.0), rel=1e-8)


def test_elastic_film_survives_less():
    for field in (0.0, 0.5, math.nextafter(1, 0)):
        status, result = run("ramp_hold", "fold", "dop853", (field, 1.0, 1.0), 1e-10)
        assert status == lane_state.SURVIVES
        assert np.isnan(result[: sweep.FINAL_STRETCH]).all()


def test_failure_on_the_way_up_is_the_last_event():
    """The hold that would have followed changes nothing, not a bit."""
    for rate in (0.1, 1.0, 20.0):
        _, ramp = run("ramp", "fold", "dopri5", (0.0, rate, 4.0), 1e-8)
        for field in (2.0, 1e3):
            status, held = run("ramp_hold", "fold", "dopri5", (field, rate, 4.0), 1e-8)
            assert status == lane_state.FAILED
            np.testing.assert_array_equal(held, ramp)


@pytest.mark.parametrize(("program", "cell"), [("step", (1.2, 0.0)), ("ramp", (0.0, 1.0)), ("ramp_hold", (1.2, 0.7))])
def test_a_spent_budget_is_reported(program, cell):
    """Every budget gives the result or none, from none at all to more than enough."""
    status, enough = run(program, "fold", "dopri5", (*cell, 4.0), 1e-5)
    assert status == lane_state.FAILED
    resolved = []
    for attempts in range(200):
        status, result = run(program, "fold", "dopri5", (*cell, 4.0), 1e-5, attempts)
        resolved.append(status == lane_state.FAILED)
        if resolved[-1]:
            np.testing.assert_array_equal(result, enough)
            break
        assert status == lane_state.BUDGET_SPENT
        assert np.isnan(result).all()
    assert resolved[-1]
    assert len(resolved) > 10


@pytest.mark.parametrize("method", ["dopri5", "dop853"])
def test_rate_form_is_right_or_unresolved(method):
    """Its steps collapse at the singularity if they are to be accurate: that is not a failure of the film."""
    collapsed = 0
    for program, rows in (("step", STEPS), ("ramp", RAMPS[1:])):
        for field, rate, time, stretch in rows:
            for tolerance in (1e-4, 1e-6, 1e-8, 1e-10, 1e-12):
                status, result = run(program, "rate", method, (field, rate, 4.0), tolerance, 3000)
                if status == lane_state.FAILED:
                    assert result[:2] == pytest.approx((time, stretch), rel=200 * tolerance + 4e-10)
                else:
                    assert status in UNRESOLVED
                    assert np.isnan(result).all()
                    collapsed += status == lane_state.STEP_COLLAPSED
    assert collapsed > 0


def test_jump_over_the_instability_is_no_failure():
    """Fixed steps of the rate form may land behind the instability without passing it: nothing to be located."""
    seen = set()
    for field in (1.2, 1.3, 1.7):
        for step in (0.2, 0.15, 0.1, 0.05):
            status, (_, stretch, xi, *_) = run("step", "rate", "rk4", (field, 0.0, 4.0), 0.0, 3000, step)
            seen.add(status)
            if status == lane_state.FAILED:
                assert stretch == pytest.approx(critical_state(xi, 4.0)[0], abs=1.1e-9)
            else:
                assert status in UNRESOLVED
    assert {lane_state.FAILED, lane_state.STEP_COLLAPSED} <= seen


@device
def _two_ramps(index, field, rate):
    """Field at the start, its rate, duration: a ramp, cut where the field is given."""
    if index == 0:
        return 0.0, rate, field / rate
    return field, rate, math.inf


@pytest.mark.parametrize("form", ["fold", "rate"])
def test_ramp_in_two_pieces_is_the_ramp(form, monkeypatch):
    """Pieces take over time, stretch and field from the one before, whatever the program."""
    cut = RAMP._replace(name="cut", pieces=2, piece=_two_ramps)
    tableau = TABLEAUS["dop853"]
    solve = make_solve(cut, FORMULATIONS[form], tableau, make_pi(tableau))
    kernel = sweep.make_sweep(cut, sweep.in_blocks(solve, lane_state.rows(tableau.stages), 1))
    for field, rate, time, stretch in [(0.5, *RAMPS[1][1:]), (1.2, *RAMPS[0][1:])]:
        status, result = np.empty(1, np.int8), np.empty((sweep.RESULTS, 1))
        columns = [np.array([value]) for value in (field, rate, 4.0)]
        getattr(kernel, "py_func", kernel)(*columns, 1e-8, 0.0, 20_000, status, result)
        assert status[0] == lane_state.FAILED
        assert result[[0, 1, 3], 0] == pytest.approx((time, stretch, rate * time), rel=1e-6)
    monkeypatch.setitem(PROGRAMS, "cut", cut)
    assert [field_at("cut", 0.5, 2.0, time) for time in (0.0, 0.2, 0.25, 1.0)] == [0.0, 0.4, 0.5, 2.0]
