"""Inverse questions: their answers, put into a sweep, give back what was asked."""

import numpy as np
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.outcomes import Reason, words_of

REASONS = words_of(Reason)

RATIOS = np.array([1.0 + 1e-6, 1.5, 4.0, 100.0, 900.0])


def cells(ds, name):
    """An answer and its coordinates as scattered cells."""
    stacked = ds.stack(cell=ds[name].dims)
    return {key: xr.DataArray(stacked[key].values, dims="cell") for key in (name, *ds[name].dims)}


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9])
def test_the_time_to_failure_under_the_allowable_field_is_the_lifetime(rtol):
    lifetimes = np.geomspace(1e-4, 1e6, 11)
    answer = dm.allowable_field(lifetimes, RATIOS, rtol=rtol)
    assert (answer.reason == 0).all()
    assert answer.allowable_field.dims == ("lifetime", "modulus_ratio")
    found = cells(answer, "allowable_field")
    top = np.sqrt(found["modulus_ratio"])
    ends = []
    for sign in (-1, 1):  # within rtol of the answer lies one that lives exactly as long
        field = (found["allowable_field"] * (1 + sign * rtol)).clip(1.0, top)
        ds = dm.sweep(dm.Step(), field=field, modulus_ratio=found["modulus_ratio"], rtol=1e-12)
        ends.append(ds.time_to_failure.where(ds.outcome != 0, np.inf))
    assert ((ends[1] <= found["lifetime"]) & (found["lifetime"] <= ends[0])).all()


def test_the_ends_of_life():
    answer = dm.allowable_field([0.0, np.inf], [1.0, 4.0])
    assert answer.allowable_field.values.tolist() == [[1.0, 2.0], [1.0, 1.0]]
    assert (answer.reason == 0).all()


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9])
def test_a_ramp_gets_as_far_as_asked(rtol):
    answer = dm.allowable_rate([1.27, 1.5, 1.8, 2.3], RATIOS, rtol=rtol)
    found = cells(answer.where(answer.reason == 0), "allowable_rate")
    good = np.isfinite(found["allowable_rate"])
    assert good.sum() > 8
    rate, ratio, aim = (found[name][good] for name in ("allowable_rate", "modulus_ratio", "stretch"))
    slower, faster = (
        dm.sweep(dm.Ramp(), rate=rate * (1 + sign * rtol), modulus_ratio=ratio, rtol=1e-12).critical_stretch
        for sign in (-1, 1)
    )
    assert ((faster * (1 - 1e-11) <= aim) & (aim <= slower * (1 + 1e-11))).all()


def test_stretches_that_all_or_no_ramps_reach():
    slowest = dm.sweep(dm.Ramp(), rate=1e-6, modulus_ratio=4.0).critical_stretch.item()
    limit = dm.sweep(dm.Step(), field=np.nextafter(1.0, 2.0), modulus_ratio=4.0).critical_stretch.item()
    answer = dm.allowable_rate([1.1, 1.3, 0.5 * (slowest + limit), 3.0], [1.0, 4.0])
    words = [[REASONS[reason] for reason in row] for row in answer.reason.values]
    assert words == [
        ["always", "always"],
        ["never", "answered"],
        ["never", "beyond_rates"],
        ["never", "never"],
    ]
    assert np.isnan(answer.allowable_rate.values[answer.reason.values != 0]).all()


def test_how_far_a_film_gets():
    answer = dm.reachable_stretch([0.5, 1.2, 1.9, 2.5], 1.0, 4.0)
    assert answer.reachable_stretch.values[1] == pytest.approx(1.177045, rel=1e-6)
    assert [REASONS[reason] for reason in answer.reason.values] == ["answered", "answered", "never", "never"]
    assert np.isnan(answer.reachable_stretch.values).tolist() == [False, False, True, True]


def test_how_far_a_film_gets_in_many_times():
    answer = dm.reachable_stretch([0.5, 1.2], [0.0, 1.0, np.inf], 4.0)
    assert answer.reachable_stretch.dims == ("field", "time")
    relaxed = dm.sweep(dm.Step(), field=0.5, modulus_ratio=4.0).final_stretch.item()
    assert answer.reachable_stretch.values[0, 2] == pytest.approx(relaxed, rel=1e-12)
    assert [REASONS[reason] for reason in answer.reason.values[1]] == ["answered", "answered", "never"]
    film = dm.trajectory(dm.Step(), time=[0.0, 1.0], field=[0.5, 1.2], modulus_ratio=4.0, rtol=1e-10)
    np.testing.assert_allclose(answer.reachable_stretch.values[:, :2], film.stretch, rtol=1e-6)


STRENGTH = {"constant": 2.9, "grows": lambda stretch: 1.9 * stretch**1.13}


@pytest.mark.parametrize("strength", STRENGTH.values(), ids=STRENGTH)
@pytest.mark.parametrize("rtol", [1e-4, 1e-8])
def test_a_film_neither_fails_nor_breaks_down_below_its_allowable_field(strength, rtol):
    lifetimes, ratios = [1e-2, 1.0, 30.0, 1e4], [1.5, 4.0, 20.0]
    answer = dm.allowable_field(lifetimes, ratios, rtol=rtol, strength=strength)
    assert (answer.reason == 0).all()
    assert set(answer.limit.values.flat) == {1, 2}
    found = cells(answer, "allowable_field")
    ends = []
    for sign in (-1, 1):
        field = found["allowable_field"] * (1 + sign * rtol)
        ds = dm.sweep(dm.Step(), field=field, modulus_ratio=found["modulus_ratio"], rtol=1e-12)
        ds = dm.breakdown(ds, strength, rtol=1e-10)
        fails = ds.time_to_failure.where(ds.first_limit == 1, np.inf)
        ends.append(np.fmin(ds.time_to_breakdown.fillna(np.inf), fails))
    assert ((ends[1] <= found["lifetime"]) & (found["lifetime"] <= ends[0])).all()


def test_a_film_held_for_good_may_break_down():
    answer = dm.allowable_field(np.inf, 4.0, strength=1.2)
    field = answer.allowable_field.item()
    assert answer.limit.item() == 2
    final = dm.sweep(dm.Step(), field=field, modulus_ratio=4.0).final_stretch.item()
    assert field * final**2 == pytest.approx(1.2, rel=1e-6)


@pytest.mark.parametrize("strength", STRENGTH.values(), ids=STRENGTH)
def test_a_ramp_gets_as_far_as_asked_without_breaking_down(strength):
    answer = dm.allowable_rate([1.2, 1.4, 1.6], [2.0, 4.0], rtol=1e-7, strength=strength)
    found = cells(answer.where((answer.reason == 0) & (answer.limit == 2)), "allowable_rate")
    good = np.isfinite(found["allowable_rate"])
    assert good.sum() >= 2
    rate, ratio, aim = (found[name][good] for name in ("allowable_rate", "modulus_ratio", "stretch"))
    slower, faster = (
        dm.breakdown(dm.sweep(dm.Ramp(), rate=rate * (1 + sign * 1e-5), modulus_ratio=ratio), strength, rtol=1e-9)
        for sign in (-1, 1)
    )
    assert (faster.breakdown_stretch < aim).all()
    assert ((slower.breakdown_stretch > aim) | (slower.first_limit == 1)).all()


def test_why_no_ramp_gets_there():
    answer = dm.allowable_rate([1.01, 1.25, 1.6], 4.0, strength=1.2)
    assert [REASONS[reason] for reason in answer.reason.values] == ["always", "never", "never"]
    assert answer.limit.values.tolist() == [0, 2, 2]


def test_a_film_that_breaks_down_does_not_get_there():
    answer = dm.reachable_stretch([1.2, 1.2, 1.9], [1.0, 2.4, 3.0], 4.0, strength=2.5)
    words = [[REASONS[reason] for reason in row] for row in answer.reason.values]
    assert words == [["answered", "breaks_down", "breaks_down"]] * 2 + [["breaks_down"] * 3]


def test_scattered_questions():
    life = xr.DataArray([1.0, 10.0], dims="film", coords={"film": ["thin", "thick"]})
    answer = dm.allowable_field(life, xr.DataArray([2.0, 4.0], dims="film"))
    assert answer.allowable_field.dims == ("film",)
    assert answer.film.values.tolist() == ["thin", "thick"]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: dm.allowable_field(-1.0, 4.0), "lifetime must be a number at least 0; got -1.0"),
        (lambda: dm.allowable_field(np.nan, 4.0), "lifetime must be a number at least 0; got nan"),
        (lambda: dm.allowable_field(1.0, 0.5), "modulus_ratio must be finite and at least 1; got 0.5"),
        (lambda: dm.allowable_rate(np.inf, 4.0), "stretch must be finite and at least 1; got inf"),
        (lambda: dm.allowable_rate(1.5, 4.0, rtol=1e-11), "rtol must be from 1e-10 to 0.001; got 1e-11"),
        (lambda: dm.reachable_stretch(1.2, -1.0, 4.0), "time must be a number at least 0; got -1.0"),
        (lambda: dm.reachable_stretch(1.2, [[1.0]], 4.0), r"time must be a number, a 1-D array or a DataArray; got"),
        (lambda: dm.allowable_field(1.0, 4.0, strength=0.0), "strength must be finite and above 0; got 0.0"),
    ],
)
def test_bad_questions_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
