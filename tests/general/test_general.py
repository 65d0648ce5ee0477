"""The general model: its law against derivatives of its energy, its films against independent ones, the first law."""

import sys
from pathlib import Path

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import dea_maps as dm
from dea_maps.cli.main import main
from dea_maps.general import free_energy as law
from dea_maps.general.load_history import LoadHistory

sys.path.insert(0, str(Path(__file__).parents[1] / "reference"))
import scalar

STATE = law.State(1.7, 1.2, 0.9, 1.3, 1.1)
P = 3.0


def mp_energy(l1, l2, d, x1, x2):
    """Return (17) as the paper prints it."""
    v = l1**-2 * l2**-2
    return (
        (l1**2 + l2**2 + v - 3) / 2 + P * ((l1 / x1) ** 2 + (l2 / x2) ** 2 + v * x1**2 * x2**2 - 3) / 2 + d**2 * v / 2
    )


def derivative(*orders):
    with mpmath.workdps(40):
        return float(mpmath.diff(mp_energy, tuple(map(mpmath.mpf, STATE)), orders))


def test_law_is_that_of_the_energy():
    assert law.free_energy(STATE, P) == pytest.approx(float(mp_energy(*STATE)), rel=1e-14)
    first = [derivative(*row) for row in np.eye(5, dtype=int).tolist()]
    np.testing.assert_allclose(law.equations_of_state(STATE, P), first[:3], rtol=1e-13)
    np.testing.assert_allclose(np.multiply(law.flow(STATE), -P), first[3:], rtol=1e-13)  # (10), eta = p
    pairs = {"h11": (2, 0, 0), "h22": (0, 2, 0), "h33": (0, 0, 2), "h12": (1, 1, 0), "h13": (1, 0, 1), "h23": (0, 1, 1)}
    h = law.hessian(STATE, P)
    for name, orders in pairs.items():
        assert getattr(h, name) == pytest.approx(derivative(*orders, 0, 0), rel=1e-12)
    mixed = [derivative(i, 1 - i, 0, j, 1 - j) for i in (1, 0) for j in (1, 0)]
    np.testing.assert_allclose(law.coupling(STATE, P), mixed, rtol=1e-12)
    matrix = [[h.h11, h.h12, h.h13], [h.h12, h.h22, h.h23], [h.h13, h.h23, h.h33]]
    assert law.det_hessian(STATE, P) == pytest.approx(np.linalg.det(matrix), rel=1e-12)
    # (11): what the flow takes out of the energy.
    assert law.dissipation_rate(STATE, P) == pytest.approx(-np.dot(first[3:], law.flow(STATE)), rel=1e-12)


CASES = [
    ({"field": 1.001}, dm.Step(), {"field": 1.001}),  # long after the last change of a load
    ({"field": 1.01}, dm.Step(), {"field": 1.01}),
    ({"field": 1.2}, dm.Step(), {"field": 1.2}),
    ({"field": 1.9}, dm.Step(), {"field": 1.9}),
    ({"field": LoadHistory((0.0, 300.0), (0.0, 3.0))}, dm.Ramp(), {"rate": 0.01}),
    ({"field": LoadHistory((0.0, 3.0), (0.0, 3.0))}, dm.Ramp(), {"rate": 1.0}),
    ({"field": LoadHistory((0.0, 0.6), (0.0, 1.2))}, dm.RampHold(), {"rate": 2.0, "field": 1.2}),
]


@pytest.mark.parametrize(("loads", "program", "parameters"), CASES)
def test_agrees_with_the_equibiaxial_film(loads, program, parameters):
    tight = dm.sweep(program, modulus_ratio=4.0, rtol=1e-12, **parameters)
    for rtol in (1e-4, 1e-8, 1e-12):
        full = dm.general_trajectory(time=0.0, modulus_ratio=4.0, rtol=rtol, **loads)
        assert full.outcome == tight.outcome == 1
        for name in full.data_vars:
            if name.startswith(("time_to_failure", "critical")):
                np.testing.assert_allclose(full[name], tight[name.removesuffix("_1").removesuffix("_2")], rtol=rtol)


def test_trajectory_agrees_with_the_equibiaxial_one():
    times = [2.0, 0.0, 0.3, 2.4, 2.5]
    full = dm.general_trajectory(time=times, modulus_ratio=4.0, field=1.2, rtol=1e-11)
    one = dm.trajectory(dm.Step(), time=times, modulus_ratio=4.0, field=1.2, rtol=1e-11)
    for name in ("stretch", "internal_stretch"):
        for direction in ("_1", "_2"):
            np.testing.assert_allclose(full[name + direction], one[name], rtol=1e-9)
    np.testing.assert_allclose(full.applied_field, one.applied_field, rtol=1e-11)
    np.testing.assert_allclose(full.stress_1[:4], 0.0, atol=1e-10)
    p, internal = 3.0, one.internal_stretch
    rate = one.stretch**2 * internal**-3 - one.stretch**-4 * internal**3
    np.testing.assert_allclose(full.dissipation_rate, 2 * p * rate**2, rtol=1e-7)  # (11), equibiaxial
    assert np.isnan(full.isel(time=4).det_hessian)
    assert (full.isel(time=slice(4)).det_hessian > 0).all()


def test_survivors_and_failures_at_once():
    rests = dm.general_trajectory(time=1e6, modulus_ratio=4.0, field=0.9, rtol=1e-10)
    final = dm.sweep(dm.Step(), modulus_ratio=4.0, field=0.9, rtol=1e-12).final_stretch
    assert rests.outcome == 0
    assert np.isnan(rests.time_to_failure)
    for name in ("final_stretch_1", "final_stretch_2"):
        np.testing.assert_allclose(rests[name], final, rtol=1e-13)
    np.testing.assert_allclose(rests.stretch_1[0], final, rtol=1e-13)
    fails = dm.general_trajectory(time=[0.0, 1.0], modulus_ratio=4.0, field=2.1)
    assert fails.outcome == 2
    assert fails.time_to_failure == 0.0
    np.testing.assert_allclose(fails.critical_field, 2.0, rtol=1e-8)
    np.testing.assert_allclose(fails.critical_stretch_1, 2 ** (1 / 3), rtol=1e-8)
    assert np.isnan(fails.stretch_1).all()


def test_slow_films_and_slow_ramps():
    """What takes thousands of relaxation times: a large modulus ratio on its way to rest, and a slow ramp."""
    slow = dm.general_trajectory(time=0.0, modulus_ratio=1000.0, field=0.99, rtol=1e-6)
    final = dm.sweep(dm.Step(), modulus_ratio=1000.0, field=0.99, rtol=1e-12).final_stretch
    np.testing.assert_allclose(slow.final_stretch_1, final, rtol=1e-12)
    ramp = dm.general_trajectory(time=0.0, modulus_ratio=4.0, field=LoadHistory((0.0, 1e4), (0.0, 2.0)), rtol=1e-9)
    fails = dm.sweep(dm.Ramp(), modulus_ratio=4.0, rate=2e-4, rtol=1e-12)
    np.testing.assert_allclose(ramp.time_to_failure, fails.time_to_failure, rtol=1e-9)
    np.testing.assert_allclose(ramp.critical_stretch_2, fails.critical_stretch, rtol=1e-9)


def test_a_large_pull_comes_to_rest():
    ds = dm.general_trajectory(time=[0.0, 1e6], modulus_ratio=4.0, stress_1=20.0)
    assert ds.outcome == 0
    np.testing.assert_allclose(ds.stress_1, 20.0, rtol=1e-8)
    np.testing.assert_allclose(ds.final_stretch_1 - ds.final_stretch_1**-2.0, 20.0, rtol=1e-12)


def test_nothing_happens_without_loads():
    ds = dm.general_trajectory(time=[0.0, 5.0], modulus_ratio=4.0)
    assert ds.outcome == 0
    assert (ds.stretch_1 == 1.0).all()


def by_scipy(stress_1, stress_2, field, ratio, times):
    """Internal stretches by (21), (22) in time; the stretches by nested roots of (18), (19) in every evaluation."""
    p, square = ratio - 1.0, 0.75 * 4.0 ** (-1.0 / 3.0) * field**2

    def gap(x, other, xi, xi_other, stress):  # (18) with D~ = E/v put in
        v = (x * other) ** -2
        return x * (1 + p / xi**2) - (v * (1 + p * (xi * xi_other) ** 2) + square / v) / x - stress

    def stretches(x1, x2):
        def second(l1):
            return brentq(lambda l2: gap(l2, l1, x2, x1, stress_2), 0.3, 2.5, xtol=1e-15, rtol=1e-14)

        l1 = brentq(lambda l1: gap(l1, second(l1), x1, x2, stress_1), 0.7, 2.0, xtol=1e-15, rtol=1e-14)
        return l1, second(l1)

    def rates(_, xi):
        x1, x2 = xi
        l1, l2 = stretches(x1, x2)
        v = (l1 * l2) ** -2
        return [l1**2 / x1**3 - v * x1 * x2**2, l2**2 / x2**3 - v * x2 * x1**2]

    xi = solve_ivp(rates, (0.0, times[-1]), [1.0, 1.0], t_eval=times, rtol=1e-10, atol=1e-12, method="DOP853").y
    return np.array([stretches(*pair) for pair in xi.T]), xi.T


def test_unequal_dead_loads_agree_with_an_integration_in_time():
    times = np.linspace(0.0, 0.9, 4)
    stretches, internal = by_scipy(0.5, 0.1, 0.7, 4.0, times)
    ds = dm.general_trajectory(time=times, modulus_ratio=4.0, field=0.7, stress_1=0.5, stress_2=0.1, rtol=1e-11)
    np.testing.assert_allclose(np.stack([ds.stretch_1, ds.stretch_2], axis=1), stretches, rtol=1e-8)
    np.testing.assert_allclose(np.stack([ds.internal_stretch_1, ds.internal_stretch_2], axis=1), internal, rtol=1e-8)
    np.testing.assert_allclose(ds.stress_1, 0.5, rtol=1e-9)
    np.testing.assert_allclose(ds.stress_2, 0.1, rtol=1e-9)


SCENES = {
    "tension": {"stretch_1": LoadHistory((0.0, 10.0), (1.0, 4.0))},
    "relaxation": {"stretch_1": 2.0},
    "biaxial relaxation": {"stretch_1": 2.0, "stretch_2": 1.5},
    "voltage": {"field": 1.2},
    "ramp": {"field": LoadHistory((0.0, 20.0), (0.0, 2.0))},
    "voltage on a pre-stressed film": {"field": LoadHistory((0.0, 4.0, 4.0), (0.0, 0.0, 0.9)), "stress_1": 1.0},
    "loads that fall": {"stress_1": LoadHistory((0.0, 1.0, 3.0), (0.0, 2.0, 0.2)), "stress_2": 0.3, "field": 0.4},
    "compression": {"stress_1": -0.5, "field": 0.7},
}


@pytest.mark.parametrize("loads", SCENES.values(), ids=SCENES)
@pytest.mark.parametrize("ratio", [2.0, 4.0])
def test_first_law_holds(loads, ratio):
    """Work is stored or dissipated; the integral of (11) is the dissipation."""
    rtol = 1e-9
    ds = dm.general_trajectory(time=np.linspace(0.0, 12.0, 25), modulus_ratio=ratio, rtol=rtol, **loads)
    work = ds.work.dropna("time")
    residual = (ds.work - ds.stored_energy - ds.dissipated_energy).dropna("time")
    assert residual.size == work.size
    assert np.abs(residual).max() <= rtol * max(1.0, np.abs(work).max())
    assert (np.diff(ds.dissipated_energy.dropna("time")) >= -1e-12).all()


def test_an_elastic_film_stores_all_work():
    ds = dm.general_trajectory(time=[1.0, 3.0], modulus_ratio=1.0, stretch_1=LoadHistory((0.0, 3.0), (1.0, 4.0)))
    np.testing.assert_allclose(ds.work, ds.stored_energy, rtol=1e-8)
    assert (ds.dissipation_rate == 0.0).all()
    assert (ds.dissipated_energy == 0.0).all()
    assert ds.outcome == 0


def test_relaxation_from_the_unrelaxed_to_the_relaxed_stress():
    ds = dm.general_trajectory(time=[0.0, 1e3], modulus_ratio=4.0, stretch_1=2.0, rtol=1e-11)
    relaxed = 2.0 - 2.0**-2  # neo-Hookean, uniaxial
    np.testing.assert_allclose(ds.stress_1, [4.0 * relaxed, relaxed], rtol=1e-10)
    np.testing.assert_allclose(ds.stretch_2, 2.0**-0.5, rtol=1e-10)
    np.testing.assert_allclose(ds.stress_2, 0.0, atol=1e-10)
    assert ds.outcome == 0


def test_elastic_pre_stressed_film():
    """At m = 1 failure is that of Zhao and Suo (2007): (18) to (20) and det H = 0, found here by scanning."""
    s = 0.5
    stretch = np.linspace(1.0, 3.0, 400_001)
    square = stretch**-2 - stretch**-8 - s * stretch**-3  # eps E^2/mu_R at equal stretches
    largest = np.sqrt(square.max() / (0.75 * 4.0 ** (-1.0 / 3.0)))
    ds = dm.general_trajectory(
        time=0.0, modulus_ratio=1.0, stress_1=s, stress_2=s, field=LoadHistory((0.0, 1.0), (0.0, 1.0))
    )
    np.testing.assert_allclose(ds.critical_field, largest, rtol=1e-8)
    np.testing.assert_allclose(ds.critical_stretch_1, stretch[square.argmax()], rtol=1e-5)


def test_directions_are_alike():
    ramp = LoadHistory((0.0, 4.0), (0.0, 4.0))
    equal, unequal = (
        dm.general_trajectory(time=0.0, modulus_ratio=4.0, field=ramp, stress_1=s, stress_2=1.0 - s) for s in (0.5, 0.9)
    )
    assert equal.critical_stretch_1 == pytest.approx(float(equal.critical_stretch_2), rel=1e-10)
    assert unequal.critical_stretch_1 > unequal.critical_stretch_2
    swapped = dm.general_trajectory(time=0.0, modulus_ratio=4.0, field=ramp, stress_1=1.0 - 0.9, stress_2=0.9)
    assert swapped.critical_stretch_2 == pytest.approx(float(unequal.critical_stretch_1), rel=1e-7)


def test_data_set_describes_itself_and_is_stored(tmp_path):
    ds = dm.general_trajectory(time=[0.0, 1.0], modulus_ratio=4, field=1.2, stress_1=0.1)
    for name in ds.variables:
        assert ds[name].attrs["units"] == "1"
        assert ds[name].attrs["long_name"]
    assert ds.attrs["prescribed_stress_1"] == "LoadHistory(times=(0.0,), values=(0.1,))"
    ds.to_netcdf(tmp_path / "film.nc")


@pytest.mark.parametrize(
    ("changes", "error", "words"),
    [
        ({"modulus_ratio": 0.5}, ValueError, "modulus_ratio must be finite and at least 1; got 0.5"),
        ({"modulus_ratio": [4.0]}, TypeError, "modulus_ratio must be a real number"),
        ({"field": -1.0}, ValueError, "field must be at least 0; got -1.0"),
        ({"field": float("nan")}, ValueError, "field must be finite; got nan"),
        ({"field": "1"}, TypeError, "field must be a real number or a LoadHistory; got '1'"),
        ({"field": True}, TypeError, "field must be a real number or a LoadHistory; got True"),
        ({"stretch_1": 0.0}, ValueError, "stretch_1 must be above 0; got 0.0"),
        ({"stretch_2": 2.0, "stress_2": 1.0}, ValueError, "stress_2 must not be given with stretch_2"),
        ({"rtol": 1e-2}, ValueError, "rtol must be from 1e-12 to 0.001; got 0.01"),
        ({"time": -1.0}, ValueError, "time must be finite and at least 0; got -1.0"),
    ],
)
def test_bad_input_is_refused_before_computing(changes, error, words, monkeypatch):
    monkeypatch.setattr("dea_maps.general.run.integrated", lambda *args: pytest.fail("computed"))
    with pytest.raises(error, match=words):
        dm.general_trajectory(**{"time": 1.0, "modulus_ratio": 4.0, **changes})


@pytest.mark.parametrize(
    ("times", "values", "error", "words"),
    [
        ((0.0, 1.0), (1.0,), ValueError, "must be as many"),
        ((), (), ValueError, "at least one"),
        ((-1.0,), (1.0,), ValueError, "times of a LoadHistory must be at least 0; got -1.0"),
        ((1.0, 0.5), (1.0, 1.0), ValueError, "must not go back; got 0.5 after 1.0"),
        ((1.0, 1.0, 1.0), (1.0, 2.0, 3.0), ValueError, "more than twice; got 1.0"),
        ((0.0,), (float("inf"),), ValueError, "values of a LoadHistory must be finite; got inf"),
        (1.0, (1.0,), TypeError, "times of a LoadHistory must be a sequence of real numbers; got 1.0"),
        ("01", (1.0, 2.0), TypeError, "times of a LoadHistory must be a sequence of real numbers; got '01'"),
    ],
)
def test_bad_histories_are_refused(times, values, error, words):
    with pytest.raises(error, match=words):
        LoadHistory(times, values)


SHAPES = {
    "hold, then nothing": ((0.0, 0.546377, 0.546377), (1.5, 1.5, 0.0), 4.0),
    "hold, until just after failure": ((0.0, 0.546379, 0.546379), (1.5, 1.5, 0.0), 4.0),
    "hold, then more": ((0.0, 0.546377, 0.546377), (1.5, 1.5, 1.9), 4.0),
    "hold, then a faster rise": ((0.0, 0.546377, 0.6), (1.5, 1.5, 1.9), 4.0),
    "rise, then nothing": ((0.0, 1.58117, 1.58117), (0.0, 1.58117, 0.0), 4.0),
    "rise, until just after failure": ((0.0, 1.58118, 1.58118), (0.0, 1.58118, 0.0), 4.0),
    "rise, then a hold": ((0.0, 1.58117), (0.0, 1.58117), 4.0),
    "rise, then a fall": ((0.0, 1.58117, 3.0), (0.0, 1.58117, 0.5), 4.0),
    "overdrive to a field below the critical one": ((0.0, 0.52, 0.52), (1.5, 1.5, 0.95), 4.0),
    "overdrive that ends in time": ((0.0, 0.4, 0.4), (1.5, 1.5, 0.95), 4.0),
}


def judged(times, fields, ratio, rtol=1e-8):
    """Hold a film to the scalar equation of tests/reference; return when it fails there."""
    truth = scalar.follow(times, fields, ratio)
    ds = dm.general_trajectory(time=0.0, modulus_ratio=ratio, field=LoadHistory(times, fields), rtol=rtol)
    assert ds.outcome == (0 if np.isnan(truth.time) else 1)
    found = [ds.time_to_failure, ds.critical_stretch_1, ds.critical_field]
    np.testing.assert_allclose(found, truth, rtol=rtol)
    return truth.time


@pytest.mark.parametrize(("times", "fields", "ratio"), SHAPES.values(), ids=SHAPES)
def test_an_instability_counts_only_before_the_corner_of_the_load(times, fields, ratio):
    judged(times, fields, ratio)


@pytest.mark.parametrize(
    ("peak", "ratio", "fails"),
    [(1.375, 4.0, False), (1.3808, 4.0, False), (1.3815, 4.0, True), (1.39, 4.0, True), (1.45, 4.0, True)],
)
def test_failures_while_the_field_falls(peak, ratio, fails):
    time = judged((0.0, 1.5, 9.0), (0.0, peak, 0.0), ratio)
    assert (time > 1.5) == fails


def test_a_corner_that_cannot_be_told_from_the_instability():
    """What follows is unresolved if it decides the outcome, and not if it does not."""
    time = scalar.follow((0.0,), (1.5,), 4.0).time
    after = {0.0: 3, 1.5: 1, 1.9: 1}
    for field, outcome in after.items():
        load = LoadHistory((0.0, time, time), (1.5, 1.5, field))
        ds = dm.general_trajectory(time=0.0, modulus_ratio=4.0, field=load)
        assert ds.outcome == outcome
        if outcome == 1:
            np.testing.assert_allclose(ds.time_to_failure, time, rtol=1e-8)


def test_the_shortest_rise_is_a_sudden_one():
    for shortest in (5e-324, 1e-300, 1e-15):
        load = LoadHistory((0.0, shortest), (0.0, 1.2))
        ds = dm.general_trajectory(time=[0.0, 1.0], modulus_ratio=4.0, field=load)
        one = dm.trajectory(dm.Step(), time=1.0, modulus_ratio=4.0, field=1.2, rtol=1e-10)
        np.testing.assert_allclose(ds.stretch_1[1], one.stretch[0], rtol=1e-8)
        np.testing.assert_allclose(ds.time_to_failure, one.time_to_failure, rtol=1e-8)


@pytest.mark.parametrize(
    "loads",
    [
        {"modulus_ratio": 4.0, "stretch_1": 1e-300},
        {"modulus_ratio": 4.0, "stretch_1": 1e-3},
        {"modulus_ratio": 4.0, "field": LoadHistory((0.0, 1e300), (0.0, 1.2))},
    ],
)
def test_work_is_bounded(loads, monkeypatch):
    monkeypatch.setattr("dea_maps.general.integrate._MOST_EVALUATIONS", 2000)
    assert dm.general_trajectory(time=0.0, **loads).outcome == 3


def limit_of(ds):
    return ds.first_limit.attrs["flag_meanings"].split()[int(ds.first_limit)]


def test_loss_of_tension():
    frame = dm.general_trajectory(time=1.0, modulus_ratio=4.0, stretch_1=0.2, stretch_2=0.2)
    assert (limit_of(frame), frame.time_to_tension_loss) == ("tension_loss", 0.0)
    pushed = dm.general_trajectory(time=1.0, modulus_ratio=4.0, stress_1=LoadHistory((0.0, 1.0, 2.0), (1.0, 2.0, -1.0)))
    assert limit_of(pushed) == "tension_loss"
    np.testing.assert_allclose(pushed.time_to_tension_loss, 5.0 / 3.0, rtol=1e-15)
    pull = LoadHistory((0.0, 1.0, 2.0), (1.0, 2.0, 1.0))
    released = dm.general_trajectory(time=1.0, modulus_ratio=4.0, stretch_1=pull)
    assert limit_of(released) == "tension_loss"

    def rates(time, xi):  # uniaxial: stretch_2 follows from no stress there
        (x1, x2), l1 = xi, pull.after(time)
        l2 = ((1 + P * (x1 * x2) ** 2) / (l1 * l1 * (1 + P / x2**2))) ** 0.25
        v = (l1 * l2) ** -2
        return [l1**2 / x1**3 - v * x1 * x2**2, l2**2 / x2**3 - v * x2 * x1**2]

    def stress(time, xi):
        (x1, x2), l1 = xi, pull.after(time)
        v = l1**-2 * ((1 + P * (x1 * x2) ** 2) / (l1 * l1 * (1 + P / x2**2))) ** -0.5
        return l1 * (1 + P / x1**2) - v * (1 + P * (x1 * x2) ** 2) / l1

    stress.terminal = True
    half = solve_ivp(rates, (0.0, 1.0), [1.0, 1.0], rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]
    loss = solve_ivp(rates, (1.0, 2.0), half, rtol=1e-12, atol=1e-13, method="DOP853", events=stress)
    np.testing.assert_allclose(released.time_to_tension_loss, loss.t_events[0], rtol=1e-8)


def test_a_film_in_tension_keeps_it():
    for loads, limit in (({"field": 0.9}, "none"), ({"field": 1.2, "stress_1": 0.1}, "instability")):
        ds = dm.general_trajectory(time=0.0, modulus_ratio=4.0, **loads)
        assert limit_of(ds) == limit
        assert np.isnan(ds.time_to_tension_loss)


def test_chart_and_summary_of_a_general_trajectory(tmp_path, capsys):
    ds = dm.general_trajectory(time=np.linspace(0.0, 3.0, 9), modulus_ratio=4.0, field=1.2)
    ds.to_netcdf(tmp_path / "film.nc")
    ax = dm.charts.trajectories(ds)
    assert ax.get_ylabel() == "stretch 1 $\\lambda_1$"
    np.testing.assert_allclose(ax.lines[-1].get_ydata()[-1], ds.critical_stretch_1)
    assert main(["plot", str(tmp_path / "film.nc"), "-o", str(tmp_path / "film.svg")]) == 0
    assert main(["info", str(tmp_path / "film.nc")]) == 0
    told = capsys.readouterr().out
    assert "prescribed field           LoadHistory(times=(0.0,), values=(1.2,))" in told
    assert "critical_stretch_1         1.65935" in told
