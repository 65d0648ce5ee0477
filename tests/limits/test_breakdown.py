"""Electrical breakdown before the instability, against an integration of equations (23) and (26) of its own."""

import math

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import dea_maps as dm

FACTOR = 0.75 * 4.0 ** (-1.0 / 3.0)
NONE, INSTABILITY, BREAKDOWN, UNRESOLVED = range(4)
STRENGTHS = {
    "constant": lambda stretch: 2.9 + 0.0 * stretch,
    "grows": lambda stretch: 1.9 * stretch**1.13,
    "saturates": lambda stretch: 2.2 + np.tanh(stretch - 1.0),
}


def stretch_of(field, xi, ratio):
    """Solve (23) for the stretch on the branch that begins at 1."""
    a, b = 1.0 + (ratio - 1.0) / xi**2, 1.0 + (ratio - 1.0) * xi**4
    fold = 2.0 ** (1.0 / 3.0) * (b / a) ** (1.0 / 6.0)
    load = FACTOR * field**2

    def lacks(stretch):
        return a * stretch**-2 - b * stretch**-8 - load

    return brentq(lacks, (b / a) ** (1.0 / 6.0), fold, xtol=1e-15) if lacks(fold) > 0.0 else math.nan


def broken_at(program, parameters, strength, end):
    """Return time, stretch and field at which an integration in time meets the strength."""
    ratio = parameters["modulus_ratio"]

    def field_at(time):
        return min(parameters.get("rate", math.inf) * time if time else 0.0, parameters.get("field", math.inf))

    if program == dm.Step():
        field_at = lambda time: parameters["field"]  # noqa: E731

    def flow(time, state):
        stretch, xi = stretch_of(field_at(time), state[0], ratio), state[0]
        return [stretch**2 * xi**-3 - stretch**-4 * xi**3]

    def meets(time, state):
        stretch = stretch_of(field_at(time), state[0], ratio)
        return field_at(time) * stretch**2 - strength(stretch)

    meets.terminal = True
    corner = parameters["field"] / parameters["rate"] if program == dm.RampHold() else math.inf
    start, state = 0.0, [1.0]
    for stop in sorted({min(corner, end), end}):
        run = solve_ivp(flow, (start, stop), state, "DOP853", rtol=1e-11, atol=1e-13, events=meets)
        start, state = stop, run.y[:, -1]
        if run.t_events[0].size:
            break
    (time,), ((xi,),) = run.t_events[0], run.y_events[0]
    return time, stretch_of(field_at(time), xi, ratio), field_at(time)


@pytest.mark.parametrize("strength", STRENGTHS.values(), ids=STRENGTHS)
@pytest.mark.parametrize(
    ("program", "parameters"),
    [
        (dm.Step(), {"field": 1.3, "modulus_ratio": 4.0}),
        (dm.Step(), {"field": 1.02, "modulus_ratio": 10.0}),
        (dm.Ramp(), {"rate": 0.03, "modulus_ratio": 4.0}),
        (dm.Ramp(), {"rate": 3.0, "modulus_ratio": 20.0}),
        (dm.RampHold(), {"field": 1.5, "rate": 0.7, "modulus_ratio": 4.0}),
        (dm.RampHold(), {"field": 1.2, "rate": 20.0, "modulus_ratio": 6.0}),
    ],
    ids=lambda value: getattr(value, "name", None),
)
def test_breaks_down_when_another_integration_does(program, parameters, strength):
    ds = dm.breakdown(dm.sweep(program, **parameters, rtol=1e-10), strength, rtol=1e-9)
    true_field = float(ds.critical_field * ds.critical_stretch**2)
    comes_first = true_field > strength(ds.critical_stretch.item())
    assert ds.first_limit.item() == (BREAKDOWN if comes_first else INSTABILITY)
    found = [ds[name].item() for name in ("time_to_breakdown", "breakdown_stretch", "breakdown_field")]
    if comes_first:
        end = ds.time_to_failure.item() * (1.0 - 1e-9)
        np.testing.assert_allclose(found, broken_at(program, parameters, strength, end), rtol=2e-8)
    else:
        assert np.isnan(found).all()


def test_a_film_that_survives_may_break_down():
    ds = dm.breakdown(dm.sweep(dm.Step(), field=[0.7, 0.9], modulus_ratio=3.0), 1.1)
    assert ds.outcome.values.tolist() == [0, 0]
    assert ds.first_limit.values.tolist() == [NONE, BREAKDOWN]
    parameters = {"field": 0.9, "modulus_ratio": 3.0}
    expected = broken_at(dm.Step(), parameters, lambda stretch: 1.1 + 0.0 * stretch, 100.0)
    found = [ds[name].values[1] for name in ("time_to_breakdown", "breakdown_stretch", "breakdown_field")]
    np.testing.assert_allclose(found, expected, rtol=1e-6)


@pytest.mark.parametrize("field", [1.5, 2.0, 7.0])
def test_a_film_breaks_down_at_once_while_the_field_is_switched_on(field):
    ds = dm.breakdown(dm.sweep(dm.Step(), field=field, modulus_ratio=4.0), 1.4, rtol=1e-9)
    assert ds.first_limit.item() == BREAKDOWN
    assert ds.time_to_breakdown.item() == 0.0
    at = brentq(lambda field: field * stretch_of(field, 1.0, 4.0) ** 2 - 1.4, 0.1, 1.4, xtol=1e-14)
    assert ds.breakdown_field.item() == pytest.approx(at, rel=1e-9)
    assert ds.breakdown_stretch.item() == pytest.approx(stretch_of(at, 1.0, 4.0), rel=1e-9)


def test_a_strength_just_above_or_below_the_failure_decides():
    ds = dm.sweep(dm.Ramp(), rate=[0.01, 1.0, 100.0], modulus_ratio=5.0, rtol=1e-11)
    for index in range(3):
        cell = ds.isel(rate=index)
        true_field = float(cell.critical_field * cell.critical_stretch**2)
        limits = [dm.breakdown(cell, true_field * (1.0 + off), rtol=1e-9) for off in (-1e-8, 1e-8)]
        assert [limit.first_limit.item() for limit in limits] == [BREAKDOWN, INSTABILITY]
        assert limits[0].time_to_breakdown.item() == pytest.approx(cell.time_to_failure.item(), rel=1e-6)


def time_to_stretch(field, ratio, end):
    """Return when a film under a constant field gets to a stretch, as an integral over the stretch."""
    load = FACTOR * field**2

    def per_stretch(stretch):
        def lacks(xi):
            a, b = 1.0 + (ratio - 1.0) / xi**2, 1.0 + (ratio - 1.0) * xi**4
            return a * stretch**-2 - b * stretch**-8 - load

        xi = brentq(lacks, 0.9, 1.5 * stretch, xtol=1e-15, rtol=1e-15)
        a, b = 1.0 + (ratio - 1.0) / xi**2, 1.0 + (ratio - 1.0) * xi**4
        by_stretch = -2.0 * a * stretch**-3 + 8.0 * b * stretch**-9
        by_xi = -2.0 * (ratio - 1.0) * (xi**-3 * stretch**-2 + 2.0 * xi**3 * stretch**-8)
        return -by_stretch / by_xi / (stretch**2 * xi**-3 - stretch**-4 * xi**3)

    return quad(per_stretch, stretch_of(field, 1.0, ratio), end, epsabs=0.0, epsrel=1e-12, limit=200)[0]


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize(("field", "ratio"), [(1.2, 4.0), (1.02, 10.0), (1.9, 4.0), (1.001, 3.85)])
def test_no_film_breaks_down_after_it_failed(field, ratio, rtol):
    exact = dm.sweep(dm.Step(), field=field, modulus_ratio=ratio, rtol=1e-12)
    ds = dm.sweep(dm.Step(), field=field, modulus_ratio=ratio, rtol=rtol)
    for off in (1e-4, 1e-5, 1e-6, 1e-7, 1e-8):
        strength = float(exact.critical_field * exact.critical_stretch**2) * (1.0 - off)
        found = dm.breakdown(ds, strength, rtol=rtol)
        assert found.first_limit.item() == BREAKDOWN
        assert found.time_to_breakdown.item() <= ds.time_to_failure.item()
        expected = time_to_stretch(field, ratio, math.sqrt(strength / field))
        assert found.time_to_breakdown.item() == pytest.approx(expected, rel=rtol)


@pytest.mark.parametrize("off", [1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
def test_where_the_time_says_little_the_strength_of_that_time_is_met(off, rtol):
    start, rest = (dm.sweep(dm.Step(), field=field, modulus_ratio=4.0, rtol=1e-12) for field in (1.2, 0.9))
    first, last = 1.2 * stretch_of(1.2, 1.0, 4.0) ** 2 * (1.0 + off), 0.9 * rest.final_stretch.item() ** 2 * (1.0 - off)
    for ds, strength in ((start, first), (rest, last)):
        found = dm.breakdown(ds, strength, rtol=rtol)
        film = dm.trajectory(
            dm.Step(), time=found.time_to_breakdown.item(), field=ds.field, modulus_ratio=4.0, rtol=1e-12
        )
        assert (film.applied_field * film.stretch**2).item() == pytest.approx(strength, rel=rtol)


def test_no_cell_of_a_large_map_is_left_open():
    fields, ratios = np.linspace(0.2, 3.0, 57), np.geomspace(1.0, 100.0, 23)
    ds = dm.sweep(dm.RampHold(), field=fields, rate=[0.1, 10.0], modulus_ratio=ratios)
    ds = dm.breakdown(ds, lambda stretch: 1.6 * stretch**0.5)
    assert dict(ds.sizes) == {"field": 57, "rate": 2, "modulus_ratio": 23}
    assert set(np.unique(ds.first_limit)) == {NONE, INSTABILITY, BREAKDOWN}
    broken = ds.first_limit == BREAKDOWN
    for name in ("time_to_breakdown", "breakdown_stretch", "breakdown_field"):
        np.testing.assert_array_equal(np.isfinite(ds[name]), broken)
    over = ds.breakdown_field * ds.breakdown_stretch**2 / (1.6 * ds.breakdown_stretch**0.5)
    np.testing.assert_allclose(over.values[broken], 1.0, rtol=1e-12)
    fails = broken & (ds.outcome == 1)
    assert (ds.time_to_breakdown <= ds.time_to_failure).values[fails].all()


def test_trajectories_are_maps_as_well():
    parameters = {"field": [0.9, 1.5], "rate": [0.1, 10.0], "modulus_ratio": 4.0}
    films = dm.trajectory(dm.RampHold(), time=np.linspace(0.0, 9.0, 7), **parameters)
    found, expected = dm.breakdown(films, 1.8), dm.breakdown(dm.sweep(dm.RampHold(), **parameters), 1.8)
    assert found.sizes == {"field": 2, "rate": 2, "time": 7}
    assert BREAKDOWN in found.first_limit
    for name in ("first_limit", "time_to_breakdown", "breakdown_stretch", "breakdown_field"):
        xr.testing.assert_identical(found[name], expected[name])
    xr.testing.assert_identical(found.stretch, films.stretch)


def test_a_material_knows_its_strength(tmp_path):
    material = dm.Material(87.8e3, 22.8e3, 200.0, 4.7, breakdown_strength=lambda stretch: 25e6 * stretch)
    ds = dm.breakdown(dm.sweep(dm.Step(), field=1.3, modulus_ratio=material.modulus_ratio), material.strength)
    film = dm.physical(ds, material, 1e-4)
    assert film.breakdown_true_field.item() == pytest.approx(25e6 * ds.breakdown_stretch.item(), rel=1e-9)
    assert film.seconds_to_breakdown.item() == pytest.approx(200.0 * ds.time_to_breakdown.item())
    assert film.breakdown_voltage.item() == pytest.approx(1.3 * material.critical_field * 1e-4)
    assert (ds.first_limit.attrs["flag_meanings"]) == "none instability breakdown unresolved"
    film.to_netcdf(tmp_path / "film.nc")


MAP = dm.sweep(dm.Step(), field=[0.9, 1.2], modulus_ratio=4.0)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ((3, 2.0), TypeError, "ds must be a data set; got 3"),
        ((MAP.drop_attrs(), 2.0), ValueError, "ds must be a map of a loading program; got the program None"),
        ((MAP, "strong"), TypeError, "strength must be a number or a function of the stretch; got 'strong'"),
        ((MAP, -1.0), ValueError, "strength must be finite and above 0; got -1.0"),
        ((MAP, math.nan), ValueError, "strength must be finite and above 0; got nan"),
        ((MAP, lambda stretch: 2.0), TypeError, r"strength must return a number for each of 257 stretches; got .*\(\)"),
        ((MAP, lambda stretch: 1.3 - stretch), ValueError, "strength must be finite and above 0 at every stretch; got"),
        ((MAP, lambda stretch: stretch**2.5), ValueError, "must fall with the stretch from 1 to 1.659; it rises at 1"),
        ((MAP, 2.0, 1e-12), ValueError, "rtol must be from 1e-10 to 0.001; got 1e-12"),
        ((MAP, dm.VHB.strength), ValueError, "breakdown_strength must be known"),
    ],
)
def test_bad_input_is_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        dm.breakdown(*arguments)
