"""Inverse questions of films under dead loads: exact limits, and answers that a sweep gives back."""

import dataclasses

import numpy as np
import pytest
import xarray as xr

import dea_maps as dm

STRETCHES = [1.0, 1.5, 2.0, 3.0, 4.0]
# Exact, of an elastic film: the relaxed threshold over that of the film without a dead load.
THRESHOLDS = [1.0, 0.4023, 0.2838, 0.1869, 0.1400]
# What a film of modulus ratio 4, relaxed at that stretch, carries at once, over the threshold.
AT_ONCE = [2.000, 2.146, 1.801, 1.410, 1.243]
FILMS = [{"prestretch": 1.5}, {"prestretch": 3.0}, {"stress": 1.0}, {"stress": 4.0}]


def test_the_ends_of_life_under_a_dead_load():
    ds = dm.allowable_field([np.inf, 0.0], 4.0, prestretch=STRETCHES)
    assert (ds.reason == 0).all()
    for_good, at_once = (ds.allowable_field.sel(lifetime=life) for life in (np.inf, 0.0))
    np.testing.assert_allclose(for_good, THRESHOLDS, atol=5.1e-5)
    np.testing.assert_allclose(at_once / for_good, AT_ONCE, atol=5.1e-4)
    again = dm.allowable_field(np.inf, [1.0, 30.0], stress=np.subtract(STRETCHES, np.power(STRETCHES, -5.0)))
    np.testing.assert_allclose(again.allowable_field[0], THRESHOLDS, atol=5.1e-5)  # does not depend on the ratio
    np.testing.assert_allclose(again.allowable_field[1], again.allowable_field[0], rtol=1e-14)


@pytest.mark.parametrize("load", FILMS)
@pytest.mark.parametrize("strength", [None, 0.9])
def test_a_film_lives_as_long_as_its_allowable_field_says(load, strength):
    lifetimes, ratios = np.geomspace(0.01, 30.0, 5), [1.5, 4.0, 50.0]
    rtol = 1e-6
    if strength is not None:  # over the true field at the relaxed threshold
        first = dm.allowable_field(np.inf, 4.0, **load).allowable_field.item()
        strength = (
            strength * first * dm.sweep(dm.Step(), field=0.999 * first, modulus_ratio=4.0, **load).final_stretch ** 2
        )
        strength = strength.item()
    answer = dm.allowable_field(lifetimes, ratios, rtol=rtol, strength=strength, **load)
    assert (answer.reason == 0).all()
    assert strength is None or 2 in answer.limit
    shorter, longer = (
        dm.sweep(
            dm.Step(), field=answer.allowable_field * (1.0 + sign * rtol), modulus_ratio=ratios, rtol=1e-11, **load
        )
        for sign in (1, -1)
    )
    ends = []
    for ds in (shorter, longer):
        end = ds.time_to_failure.fillna(np.inf)
        if strength is not None:
            end = np.fmin(end, dm.breakdown(ds, strength, rtol=1e-9).time_to_breakdown.fillna(np.inf))
        ends.append(end)
    wanted = xr.DataArray(lifetimes, dims="lifetime")
    assert (ends[0] <= wanted).all()
    assert (wanted <= ends[1]).all()


@pytest.mark.parametrize("load", FILMS)
def test_a_ramp_gets_as_far_as_asked(load):
    fails = dm.sweep(dm.Ramp(), rate=[1e-2, 10.0], modulus_ratio=4.0, **load).critical_stretch.values
    aim = np.array([0.9, 0.1]) @ fails
    answer = dm.allowable_rate([1.01, aim, 9.0], 4.0, **load)
    assert answer.reason.values.tolist() == [1, 0, 2]  # always, answered, never
    rate = answer.allowable_rate[1].item()
    slower, faster = (
        dm.sweep(dm.Ramp(), rate=rate * (1.0 + off), modulus_ratio=4.0, rtol=1e-11, **load).critical_stretch.item()
        for off in (-1e-6, 1e-6)
    )
    assert faster <= aim <= slower
    true_field = dm.sweep(dm.Ramp(), rate=rate, modulus_ratio=4.0, **load).pipe(lambda ds: ds.critical_field * aim**2)
    limited = dm.allowable_rate(aim, 4.0, strength=0.97 * true_field.item(), **load)
    assert (limited.limit.item(), limited.reason.item()) == (2, 0)  # breakdown
    ramp = dm.sweep(dm.Ramp(), rate=limited.allowable_rate.item(), modulus_ratio=4.0, rtol=1e-9, **load)
    assert dm.breakdown(ramp, 0.97 * true_field.item()).breakdown_stretch.item() == pytest.approx(aim, rel=1e-6)


@pytest.mark.parametrize("load", FILMS)
def test_how_far_a_film_gets_is_where_it_breaks_down(load):
    threshold = dm.allowable_field(np.inf, 4.0, **load).allowable_field.item()
    times = [0.1, 1.0, np.inf]
    answer = dm.reachable_stretch(0.9 * threshold, times, 4.0, rtol=1e-8, **load)
    assert (answer.reason == 0).all()
    ds = dm.sweep(dm.Step(), field=0.9 * threshold, modulus_ratio=4.0, rtol=1e-10, **load)
    for time, stretch in zip(times[:2], answer.reachable_stretch.values[:2], strict=True):
        broken = dm.breakdown(ds, 0.9 * threshold * stretch**2, rtol=1e-8)
        assert broken.time_to_breakdown.item() == pytest.approx(time, rel=1e-6)
    assert answer.reachable_stretch[2].item() == pytest.approx(ds.final_stretch.item(), rel=1e-8)
    assert dm.reachable_stretch(2.0 * threshold, 1e3, 4.0, **load).reason.item() == 2  # never


def test_designs_of_films_under_dead_loads(tmp_path):
    times = [1.0, 3600.0, np.inf]
    film = dataclasses.replace(dm.VHB, name="film")
    ds = dm.design(film, 50e-6, times, prestretch=2.0)
    free = dm.design(film, 50e-6, times)
    assert (ds.allowable_voltage < 0.5 * free.allowable_voltage).all()
    field = ds.allowable_field.values[0] / film.critical_field
    assert field[2] == pytest.approx(0.2838, abs=5e-5)
    swept = dm.sweep(dm.Step(), field=field[:2], modulus_ratio=film.modulus_ratio, prestretch=2.0)
    np.testing.assert_allclose(swept.time_to_failure * film.relaxation_time, times[:2], rtol=1e-4)
    np.testing.assert_allclose(ds.stretch.values[0, :2], swept.critical_stretch, rtol=1e-6)
    assert ds.stretch.values[0, 2] == pytest.approx(2.9704, abs=5e-5)
    np.testing.assert_allclose(ds.area_strain, (ds.stretch / 2.0) ** 2 - 1.0)
    stress = (2.0 - 2.0**-5) * film.relaxed_modulus
    other = dm.design(film, 50e-6, np.inf, nominal_stress=stress)
    assert other.allowable_voltage.item() == pytest.approx(ds.allowable_voltage.values[0, 2], rel=1e-12)
    np.testing.assert_allclose(other.area_strain, other.stretch**2 - 1.0)
    path = tmp_path / "design.toml"
    path.write_text(
        '[material]\npreset = "VHB"\nname = "film"\nthickness = 50e-6\n'
        "[design]\nholding_time = [1.0, 3600.0, inf]\nprestretch = 2.0"
    )
    xr.testing.assert_identical(dm.read_design(path).allowable_voltage, ds.allowable_voltage)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: dm.allowable_field(1.0, 4.0, prestretch=2.0, stress=1.0), "prestretch and stress must not both be"),
        (lambda: dm.allowable_field(1.0, 4.0, prestretch=0.9), "prestretch must be finite and at least 1; got 0.9"),
        (lambda: dm.allowable_rate(1.5, 4.0, stress=-1.0), "stress must be finite and at least 0; got -1.0"),
        (lambda: dm.reachable_stretch(0.2, 1.0, 4.0, stress=np.nan), "stress must be finite and at least 0; got nan"),
        (lambda: dm.design(dm.VHB, 5e-5, 1.0, prestretch=0.5), "prestretch must be finite and at least 1; got 0.5"),
        (
            lambda: dm.design(dm.VHB, 5e-5, 1.0, nominal_stress=-2.0),
            "nominal_stress must be finite and at least 0; got",
        ),
        (
            lambda: dm.design(dm.VHB, 5e-5, 1.0, nominal_stress=2.0, prestretch=2.0),
            "prestretch and nominal_stress must not both be given",
        ),
    ],
)
def test_bad_loads_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
