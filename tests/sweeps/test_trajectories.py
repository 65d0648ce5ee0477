"""Trajectories: the contract of their data set, and an integration of their own to compare with."""

import mpmath
import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import dea_maps as dm

LOAD = 0.75 * 4.0 ** (-1.0 / 3.0)  # at E = Ec


def stretch_at(field, xi, ratio):
    """Root of (23) on the physical branch."""
    a, b = 1 + (ratio - 1) * xi**-2, 1 + (ratio - 1) * xi**4
    critical = 2 ** (1 / 3) * (b / a) ** (1 / 6)
    return brentq(lambda x: a * x**-2 - b * x**-8 - LOAD * field**2, 0.5, critical, xtol=1e-15, rtol=1e-14)


def by_scipy(field_at, ratio, times):
    """Stretch and internal stretch by (26) in time, the stretch from (23) in every evaluation."""

    def flow(time, state):
        xi = state[0]
        x = stretch_at(field_at(time), xi, ratio)
        return [x**2 * xi**-3 - x**-4 * xi**3]

    xi = solve_ivp(flow, (0.0, times[-1]), [1.0], t_eval=times, rtol=1e-11, atol=1e-13, method="DOP853").y[0]
    return np.array([stretch_at(field_at(t), y, ratio) for t, y in zip(times, xi, strict=True)]), xi


@pytest.mark.parametrize(
    ("program", "parameters", "field_at", "times"),
    [
        (dm.Step(), {"field": 1.2}, lambda t: 1.2, np.linspace(0.0, 2.3, 12)),
        (dm.Step(), {"field": 0.9}, lambda t: 0.9, np.linspace(0.0, 12.0, 7)),
        (dm.Ramp(), {"rate": 0.5}, lambda t: 0.5 * t, np.linspace(0.0, 2.6, 9)),
        (dm.RampHold(), {"field": 1.2, "rate": 2.0}, lambda t: min(2.0 * t, 1.2), np.linspace(0.0, 2.0, 11)),
    ],
    ids=["step fails", "step survives", "ramp", "ramp and hold"],
)
def test_states_agree_with_an_integration_in_time(program, parameters, field_at, times):
    ds = dm.trajectory(program, time=times, modulus_ratio=4.0, rtol=1e-9, **parameters)
    stretch, xi = by_scipy(field_at, 4.0, times)
    np.testing.assert_allclose(ds.stretch, stretch, rtol=1e-8)
    np.testing.assert_allclose(ds.internal_stretch, xi, rtol=1e-8)
    np.testing.assert_allclose(ds.applied_field, [field_at(t) for t in times], rtol=1e-15)
    largest = LOAD * ((1 + 3 * xi**-2) ** 4 / (1 + 3 * xi**4)) ** (1 / 3)
    np.testing.assert_allclose(ds.margin, 1 - LOAD * np.square(ds.applied_field) / largest, rtol=1e-7, atol=1e-9)


def test_time_comes_last_and_in_the_order_given():
    times = [2.0, 0.0, 1.0]
    ds = dm.trajectory(dm.Step(), time=times, field=[0.5, 0.9], modulus_ratio=[2.0, 4.0])
    assert ds.stretch.dims == ("field", "modulus_ratio", "time")
    np.testing.assert_array_equal(ds.time, times)
    again = dm.trajectory(dm.Step(), time=sorted(times), field=[0.5, 0.9], modulus_ratio=[2.0, 4.0])
    xr.testing.assert_allclose(ds.stretch.sortby("time"), again.stretch)
    assert (ds.stretch.sel(time=2.0) > ds.stretch.sel(time=0.0)).all()


def test_holds_the_variables_of_the_sweep():
    ds = dm.trajectory(dm.Step(), time=1.0, field=[0.9, 1.2, 2.5], modulus_ratio=4.0)
    swept = dm.sweep(dm.Step(), field=[0.9, 1.2, 2.5], modulus_ratio=4.0)
    for name in swept.data_vars:
        xr.testing.assert_identical(ds[name], swept[name])
    for name in ds.variables:
        assert ds[name].attrs["units"] == "1"
        assert ds[name].attrs["long_name"]


def test_nan_after_failure_and_a_margin_that_vanishes_there():
    failure = 2.443625636  # theory: step at 1.2, m = 4
    ds = dm.trajectory(dm.Step(), time=[failure - 1e-6, failure + 1e-6], field=1.2, modulus_ratio=4.0, rtol=1e-10)
    for name in ("stretch", "internal_stretch", "applied_field", "margin"):
        before, after = ds[name].values
        assert np.isfinite(before)
        assert np.isnan(after)
    # Near failure, 1 - e/e_c falls linearly and the stretch like a square root.
    assert 0.0 < ds.margin[0] < 1e-5
    assert ds.stretch[0] == pytest.approx(1.659354969, abs=2e-2)
    assert ds.stretch[0] < 1.659354969


def test_nothing_to_follow_where_the_film_fails_at_once():
    ds = dm.trajectory(dm.Step(), time=[0.0, 1.0], field=2.5, modulus_ratio=4.0)
    assert np.isnan(ds.stretch).all()
    assert ds.outcome == 2


def test_a_survivor_tends_to_its_final_stretch():
    ds = dm.trajectory(dm.RampHold(), time=[200.0], field=0.9, rate=1.0, modulus_ratio=4.0, rtol=1e-8)
    np.testing.assert_allclose(ds.stretch[..., 0], ds.final_stretch, rtol=1e-7)
    np.testing.assert_allclose(ds.internal_stretch[..., 0], ds.final_stretch, rtol=1e-7)


@pytest.mark.parametrize(
    ("time", "error", "words"),
    [
        ([-1.0, 1.0], ValueError, "time must be finite and at least 0; got -1.0"),
        ([float("nan")], ValueError, "time must be finite and at least 0; got nan"),
        ([float("inf")], ValueError, "time must be finite and at least 0; got inf"),
        ([[1.0], [2.0]], ValueError, r"time must be a number or have one dimension; got an array of shape \(2, 1\)"),
        (["soon"], TypeError, "time must be made of real numbers"),
    ],
)
def test_bad_times_are_refused(time, error, words, monkeypatch):
    monkeypatch.setattr("dea_maps.runs.trajectories.computed", lambda *args, **kwargs: pytest.fail("computed"))
    with pytest.raises(error, match=words):
        dm.trajectory(dm.Step(), time=time, field=1.2, modulus_ratio=4.0)


def time_to_reach(stretch, field, m):
    """Time at which a film gets to a stretch under a constant field: an integral over u = lambda**-2, in 30 digits."""
    with mpmath.workdps(30):
        unit = mpmath.mpf(3) / 4 * mpmath.mpf(4) ** (-mpmath.mpf(1) / 3)
        m, field = mpmath.mpf(m), mpmath.mpf(field)
        p, e, critical = m - 1, unit * field**2, mpmath.mpf(4) ** (-mpmath.mpf(1) / 3)
        start = mpmath.findroot(lambda u: m * (u - u**4) - e, 0.99)
        end = 1 / mpmath.mpf(stretch) ** 2

        def integrand(u):
            h = (e - u + u**4) / (p * u * u)
            z = mpmath.mpf(1)
            for _ in range(9):
                z -= (z**3 + h * z - 1) / (3 * z * z + h)
            r = z / u
            stiffness = 4 * (1 + p * r * r) * u**3 - (1 + p / r)
            return stiffness / (2 * p * u * (1 / r**2 + 2 * r * u**3) * h)

        # the integrand peaks at u = 4**(-1/3), ever more sharply: pieces that halve towards it from both sides
        width = mpmath.sqrt((e - unit) / 6) / critical
        far = [critical + sign * width * mpmath.mpf(2) ** k for sign in (1, -1) for k in range(-2, 60)]
        inner = sorted({u for u in far if end < u < start} | {end, start})
        return float(mpmath.quad(integrand, inner, maxdegree=5))


@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
@pytest.mark.parametrize(("field", "m"), [(1.2, 4.0), (1 + 1e-4, 10.0), (1 + 1e-8, 4.0), (1 + 1e-10, 100.0)])
def test_slow_motion_near_the_instability_is_resolved(field, m, rtol):
    """In the bottleneck just above the critical field, and on the way out of it."""
    stretches = [1.2, 1.26, 1.3, 1.5]
    times = [time_to_reach(stretch, field, m) for stretch in stretches]
    ds = dm.trajectory(dm.Step(), time=times, field=field, modulus_ratio=m, rtol=rtol)
    allowed = rtol + 1e-13 * np.array(times)  # what rounding of the time before leaves
    assert (abs(ds.stretch / stretches - 1) <= allowed).all()


@pytest.mark.parametrize("ratio", [1.0, 4.0, 300.0])
@pytest.mark.parametrize("field", [0.0, 0.3, 0.999999])
def test_a_film_that_survives_comes_to_rest(field, ratio):
    ds = dm.trajectory(dm.Step(), time=[1e3, 1e12], field=field, modulus_ratio=ratio, rtol=1e-10)
    assert ds.stretch.values[1] == pytest.approx(ds.final_stretch.item(), rel=1e-10)
    assert ds.internal_stretch.values[1] == pytest.approx(ds.final_stretch.item(), rel=1e-10)


def test_a_ramp_that_holds_comes_to_rest_after_its_end():
    ds = dm.trajectory(dm.RampHold(), time=[50.0, 1e4, 1e9], field=0.8, rate=1e-3, modulus_ratio=5.0, rtol=1e-9)
    assert ds.stretch.values[0] < 1.01
    assert ds.stretch.values[1:] == pytest.approx(ds.final_stretch.item(), rel=1e-9)


def test_at_a_jump_the_state_after_it():
    given = {"field": 1.1, "period": 1.0, "duty": 0.5, "modulus_ratio": 4.0}
    times = np.array([0.0, 0.5, 1.0, 1.5, 2.0])
    train = dm.trajectory(dm.PulseTrain(), time=times, **given)
    np.testing.assert_array_equal(train.applied_field, [1.1, 0.0, 1.1, 0.0, 1.1])
    np.testing.assert_allclose(
        train.stretch, dm.trajectory(dm.PulseTrain(), time=times + 1e-9, **given).stretch, rtol=1e-6
    )
    overdrive = dm.trajectory(
        dm.Overdrive(), time=[0.25, 0.5, 0.75], overdrive_field=1.4, overdrive_time=0.5, field=0.5, modulus_ratio=4.0
    )
    np.testing.assert_array_equal(overdrive.applied_field, [1.4, 0.5, 0.5])
    jump = dm.Sequence([dm.Jump(1.0), dm.Hold(0.5), dm.Jump(3.0), dm.Hold(1.0)])
    failed = dm.trajectory(jump, time=[0.25, 0.5], modulus_ratio=4.0)
    assert failed.time_to_failure == 0.5
    assert np.isfinite(failed.stretch.values[0])
    assert np.isnan(failed.stretch.values[1])
    assert np.isnan(failed.margin.values[1])
