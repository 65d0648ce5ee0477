"""Parameters in volts, seconds and pascals, by name, for a film: the same results as from ratios, and volts besides."""

import numpy as np
import pint
import pytest
import xarray as xr

import dea_maps as dm

FILM = {"material": dm.VHB, "thickness": 100e-6}
# Of VHB, 100 um: from the numbers of the material, not from the package
EC = np.sqrt(0.75 * 4 ** (-1 / 3) * 22.8e3 / (4.7 * 8.8541878128e-12))
VOLT, SECOND = EC * 100e-6, 200.0
CYCLE = dm.Sequence(
    [dm.Linear("peak", time="rise_time"), dm.Hold("hold_time"), dm.Jump(0.0), dm.Hold("rest")], repeat=True
)
WAVE = dm.Waveform([0.0, 1.0, 3.0], [0.0, 1.0, 0.5], repeat=True)

# By program: parameters in SI units, and what 1 of each is
CASES = {
    "step": (dm.Step(), {"voltage": [1500.0, 2000.0], "nominal_stress": [0.0, 5e3]}),
    "ramp": (dm.Ramp(), {"voltage_rate": [1.0, 50.0]}),
    "ramp_hold": (dm.RampHold(), {"voltage": [1500.0, 2200.0], "voltage_rate": 50.0, "prestretch": 1.1}),
    "sine": (dm.BiasedSine(), {"bias_voltage": 900.0, "amplitude_voltage": [300.0, 1600.0], "period_seconds": 60.0}),
    "trapezoid": (
        dm.Trapezoid(),
        {"voltage": 2200.0, "voltage_rate": 500.0, "hold_time_seconds": [1.0, 300.0], "fall_voltage_rate": 800.0},
    ),
    "sequence": (
        CYCLE,
        {"peak_voltage": [1900.0, 2500.0], "rise_time_seconds": 2.0, "hold_time_seconds": 60.0, "rest_seconds": 60.0},
    ),
    "waveform": (WAVE, {"voltage": [1500.0, 2600.0]}),
}
ONE = {"voltage": VOLT, "voltage_rate": VOLT / SECOND, "seconds": SECOND, "nominal_stress": 22.8e3, "prestretch": 1.0}


def plain(name):
    """Return the name of the ratio, and what 1 of it is: the rule of the names, written out."""
    if name in ("voltage", "nominal_stress"):
        return {"voltage": "field", "nominal_stress": "stress"}[name], ONE[name]
    if name.endswith("voltage_rate"):
        return name.replace("voltage_rate", "rate"), ONE["voltage_rate"]
    for suffix in ("voltage", "seconds"):
        if name.endswith(f"_{suffix}"):
            return name.removesuffix(f"_{suffix}"), ONE[suffix]
    return name, 1.0


def ratios(given):
    found = {}
    for name, values in given.items():
        ratio, one = plain(name)
        found[ratio] = np.asarray(values) / one if one != 1.0 else values
    return found


@pytest.mark.parametrize("case", CASES)
def test_a_sweep_in_volts_is_that_of_ratios_with_volts_added(case):
    program, given = CASES[case]
    found = dm.sweep(program, **FILM, **given)
    same = dm.sweep(program, modulus_ratio=dm.VHB.modulus_ratio, **{n: found[n] for n in ratios(given)})
    xr.testing.assert_identical(found, dm.physical(same, dm.VHB, 100e-6))
    for name, values in given.items():
        np.testing.assert_allclose(found[name], values, rtol=1e-14)
    for name, values in ratios(given).items():
        np.testing.assert_allclose(found[name], values, rtol=1e-14)


@pytest.mark.parametrize("case", ["step", "ramp_hold", "sequence"])
def test_a_file_in_volts_is_the_sweep(case, tmp_path):
    program, given = CASES[case]
    dm.sweep_to_netcdf(tmp_path / "map.nc", program, **FILM, **given)
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "map.nc"), dm.sweep(program, **FILM, **given))


def test_a_film_that_may_break_down_is_asked_about_it_in_memory_and_in_files(tmp_path):
    film = dm.Material(87.8e3, 22.8e3, 200.0, 4.7, breakdown_strength=52.5e6)
    given = {"voltage": [1500.0, 1650.0, 2000.0], "material": film, "thickness": 100e-6}
    found = dm.sweep(dm.Step(), **given)
    dm.sweep_to_netcdf(tmp_path / "map.nc", dm.Step(), **given)
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "map.nc"), found)
    bare = dm.sweep(dm.Step(), field=found.field.values, modulus_ratio=film.modulus_ratio)
    broken = dm.breakdown(bare, film.strength, 1e-6)
    xr.testing.assert_identical(found, dm.physical(broken, film, 100e-6))
    assert found.first_limit.values.tolist() == [0, 2, 1]


def test_area_strain_of_every_stretch():
    ds = dm.sweep(CYCLE, **FILM, **CASES["sequence"][1])
    for name in ("critical", "largest", "steady"):
        ends = ("_max", "_min") if name == "steady" else ("",)
        for end in ends:
            np.testing.assert_allclose(ds[f"{name}_area_strain{end}"], ds[f"{name}_stretch{end}"] ** 2 - 1, rtol=1e-12)
    loaded = dm.sweep(dm.Step(), **FILM, voltage=300.0, prestretch=2.0)
    np.testing.assert_allclose(loaded.final_area_strain, (loaded.final_stretch / 2) ** 2 - 1, rtol=1e-12)


def test_trajectories_take_seconds():
    found = dm.trajectory(dm.Step(), time_seconds=[0.0, 60.0, 600.0], voltage=2000.0, **FILM)
    same = dm.trajectory(dm.Step(), time=[0.0, 0.3, 3.0], field=found.field, modulus_ratio=dm.VHB.modulus_ratio)
    xr.testing.assert_identical(found, dm.physical(same.drop_vars("voltage"), dm.VHB, 100e-6))
    assert found.seconds.values.tolist() == [0.0, 60.0, 600.0]
    np.testing.assert_allclose(found.area_strain[:2], found.stretch[:2] ** 2 - 1, rtol=1e-12)


def test_the_largest_voltage_is_asked_for_by_name():
    found = dm.allowable(dm.Step(), "voltage", lifetime_seconds=600.0, **FILM)
    same = dm.allowable(dm.Step(), "field", lifetime=3.0, modulus_ratio=dm.VHB.modulus_ratio)
    assert found.allowable.item() == same.allowable.item()
    np.testing.assert_allclose(found.allowable_voltage, same.allowable * VOLT, rtol=1e-14)
    ends = dm.sweep(dm.Step(), voltage=found.allowable_voltage.item(), **FILM)
    np.testing.assert_allclose(ends.seconds_to_failure, 600.0, rtol=1e-4)


def test_arrays_along_a_dimension_in_volts():
    volts = xr.DataArray([1500.0, 2000.0], dims="voltage", coords={"voltage": [1500.0, 2000.0]}, attrs={"units": "V"})
    ratio = xr.DataArray([3.0, 4.0], dims="voltage")
    found = dm.sweep(dm.Step(), voltage=volts, modulus_ratio=ratio, **FILM)
    assert found.voltage.dims == found.modulus_ratio.dims == ("field",)
    both = dm.sweep(dm.Step(), field=volts.values / VOLT, modulus_ratio=xr.DataArray([3.0, 4.0], dims="field"))
    np.testing.assert_allclose(found.time_to_failure, both.time_to_failure, rtol=1e-9)


def test_quantities_of_pint_are_converted():
    unit = pint.UnitRegistry()
    film = dm.Material(87.8 * unit.kPa, 22800.0, 200.0 * unit.s, 4.7, breakdown_strength=45 * unit.MV / unit.m)
    assert (film.unrelaxed_modulus, film.relaxation_time, film.breakdown_strength) == (87.8e3, 200.0, 45e6)
    plainly = dm.sweep(dm.RampHold(), **FILM, voltage=[1500.0, 2000.0], voltage_rate=50.0)
    kilovolts = [1.5, 2.0] * unit.kV
    for voltage in (kilovolts, list(kilovolts), xr.DataArray(kilovolts, dims="voltage")):
        rate = 3.0 * unit.kV / unit.min
        film = {"material": dm.VHB, "thickness": 0.1 * unit.mm}
        found = dm.sweep(dm.RampHold(), **film, voltage=voltage, voltage_rate=rate)
        np.testing.assert_allclose(found.seconds_to_failure, plainly.seconds_to_failure, rtol=1e-9)


UNIT = pint.UnitRegistry()


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ({"voltage": 2e3}, ValueError, r"^voltage = 2000.0 is in V: material and thickness are missing$"),
        ({**FILM, "voltage": 2e3, "field": 1.0}, ValueError, "^field and voltage must not both be given: they are the"),
        (
            {"material": dm.VHB, "voltage": 2e3},
            TypeError,
            "^material and thickness must be given together; got no thick",
        ),
        (
            {"thickness": 1e-4, "voltage": 2e3},
            TypeError,
            "^material and thickness must be given together; got no mater",
        ),
        ({**FILM}, ValueError, "^field or voltage is missing for the program 'step'$"),
        ({**FILM, "voltage": -1.0}, ValueError, "^voltage must be finite and at least 0; got -1.0$"),
        ({**FILM, "voltage": "2 kV"}, TypeError, "^voltage must be a real number, .*; got '2 kV'"),
        ({**FILM, "voltage": [[1.0]]}, ValueError, "^voltage must be a number or a 1-D array; got an array of shape"),
        (
            {**FILM, "voltage": 2 * UNIT.m},
            ValueError,
            "^voltage must be in V, or in units that convert to it; got '2 m",
        ),
        ({**FILM, "field": 2 * UNIT.kV}, ValueError, "^field must be dimensionless; got '2 kilovolt'$"),
        ({**FILM, "voltage_rate": 2.0, "voltage": 1.0}, ValueError, "^voltage_rate = 2.0 is not a parameter of"),
        (
            {**FILM, "voltage": xr.DataArray([2.0], dims="voltage", attrs={"units": "kV"})},
            ValueError,
            "^voltage must be in V; got units 'kV'$",
        ),
        (
            {"material": dm.Material(2e4, 1e4, 1.0), "thickness": 1e-4, "voltage": 1.0},
            ValueError,
            "relative_permittivity",
        ),
    ],
)
@pytest.mark.parametrize("call", ["sweep", "trajectory", "sweep_to_netcdf"])
def test_what_is_wrong_is_said_in_one_line(call, given, error, message, tmp_path):
    first = [tmp_path / "map.nc"] if call == "sweep_to_netcdf" else []
    more = {"time": 1.0} if call == "trajectory" else {}
    with pytest.raises(error, match=message) as caught:
        getattr(dm, call)(*first, dm.Step(), **given, **more)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("parameter", "given", "message"),
    [
        ("voltag", FILM, "^parameter must be one of field, voltage for the program 'step'; got 'voltag'$"),
        ("voltage", {"modulus_ratio": 4.0}, "^parameter must be one of field for the program 'step'; got 'voltage'$"),
        ("field", {**FILM, "voltage": 1.0}, "^field = .* must be left out: it is asked for$"),
        ("voltage", {**FILM, "lifetime": 1.0, "lifetime_seconds": 2.0}, "^lifetime and lifetime_seconds must not both"),
        ("field", {"modulus_ratio": 4.0, "lifetime_seconds": 2.0}, "^lifetime_seconds = 2.0 is in s: material and"),
        (
            "voltage",
            {**FILM, "lifetime_seconds": "long"},
            "^lifetime_seconds must be a number of at least 0; got 'long'",
        ),
    ],
)
def test_what_is_wrong_with_a_question_is_said_in_one_line(parameter, given, message):
    with pytest.raises(ValueError, match=message):
        dm.allowable(dm.Step(), parameter, **given)


def test_a_trajectory_needs_one_kind_of_time():
    with pytest.raises(ValueError, match=r"^time and time_seconds must not both be given"):
        dm.trajectory(dm.Step(), time=1.0, time_seconds=1.0, voltage=1.0, **FILM)
    with pytest.raises(ValueError, match=r"^time is missing"):
        dm.trajectory(dm.Step(), voltage=1.0, **FILM)
