"""Volts, seconds and volts per metre of maps and trajectories."""

import math

import numpy as np
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.cli.summary import describe
from dea_maps.files import stream
from dea_maps.sweeps.dataset import reduced

THICKNESS = 50e-6
# Ec = sqrt(0.75 * 4**(-1/3) * mu_R/eps), from the numbers of the material, not from the package
EC = math.sqrt(0.75 * 4 ** (-1 / 3) * 22.8e3 / (4.7 * 8.8541878128e-12))


def test_a_map_gets_volts_and_seconds_and_loses_nothing(tmp_path):
    ds = dm.sweep(dm.RampHold(), field=[0.9, 1.2, 2.5], rate=[0.1, 10.0], modulus_ratio=3.85)
    film = dm.physical(ds, dm.VHB, THICKNESS)
    np.testing.assert_allclose(film.voltage, ds.field * EC * 50e-6, rtol=1e-14)
    np.testing.assert_allclose(film.voltage_rate, ds.rate * EC * 50e-6 / 200, rtol=1e-14)
    np.testing.assert_allclose(film.seconds_to_failure, ds.time_to_failure * 200, rtol=1e-14)
    np.testing.assert_allclose(film.critical_voltage, ds.critical_field * EC * 50e-6, rtol=1e-14)
    np.testing.assert_allclose(film.critical_true_field, ds.critical_field * EC * ds.critical_stretch**2, rtol=1e-14)
    units = {name: film[name].units for name in set(film.variables) - set(ds.variables)}
    assert units == {
        "voltage": "V",
        "voltage_rate": "V s-1",
        "seconds_to_failure": "s",
        "critical_voltage": "V",
        "critical_true_field": "V m-1",
        "critical_area_strain": "1",
        "final_area_strain": "1",
    }
    for name in ("critical", "final"):
        np.testing.assert_allclose(film[f"{name}_area_strain"], ds[f"{name}_stretch"] ** 2 - 1, rtol=1e-12)
    assert {"voltage", "voltage_rate"} <= set(film.coords)
    assert set(ds.attrs.items()) <= set(film.attrs.items())
    for name in ds.variables:
        assert film[name].variable.identical(ds[name].variable)
    film.to_netcdf(tmp_path / "film.nc")
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "film.nc"), film)


def test_a_trajectory_gets_them_too():
    ds = dm.trajectory(dm.Ramp(), time=[0.0, 0.5, 1.0], rate=1.0, modulus_ratio=3.85)
    film = dm.physical(ds, dm.VHB, THICKNESS)
    np.testing.assert_allclose(film.seconds, [0, 100, 200])
    np.testing.assert_allclose(film.applied_voltage, ds.applied_field * EC * 50e-6, rtol=1e-14)
    np.testing.assert_allclose(film.true_field, ds.applied_field * EC * ds.stretch**2, rtol=1e-14)


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_a_file_in_volts_is_that_of_a_map_in_volts(tmp_path, dtype):
    given = {"field": np.linspace(0.8, 2.2, 15), "rate": [0.1, 10.0], "modulus_ratio": 3.85}
    dm.sweep_to_netcdf(tmp_path / "a.nc", dm.RampHold(), **given, dtype=dtype, material=dm.VHB, thickness=THICKNESS)
    whole = reduced(dm.sweep(dm.RampHold(), **given), list(dm.RampHold().results), dtype)
    dm.physical(whole, dm.VHB, THICKNESS).to_netcdf(tmp_path / "b.nc")
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "a.nc"), xr.load_dataset(tmp_path / "b.nc"))
    with dm.open(tmp_path / "a.nc") as ds:
        assert ds.seconds_to_failure.dtype == dtype
        assert "film                       VHB, 50 um thick" in describe(ds)


def test_a_file_in_volts_goes_on_from_parts_without(tmp_path, monkeypatch):
    given = {"field": np.linspace(0.8, 2.2, 40), "modulus_ratio": np.linspace(2, 5, 50), "memory": 2**24}
    monkeypatch.setattr(stream, "PART_CELLS", 500)
    monkeypatch.setattr(stream, "CHUNK_CELLS", 100)
    monkeypatch.setattr(stream.MapFile, "close", lambda self: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        dm.sweep_to_netcdf(tmp_path / "a.nc", dm.Step(), **given)
    monkeypatch.undo()
    monkeypatch.setattr(stream, "PART_CELLS", 500)
    monkeypatch.setattr(stream, "CHUNK_CELLS", 100)
    monkeypatch.setattr("dea_maps.files.engines.solve", None)  # all parts are there
    dm.sweep_to_netcdf(tmp_path / "a.nc", dm.Step(), **given, material=dm.VHB, thickness=THICKNESS)
    found = xr.load_dataset(tmp_path / "a.nc")
    assert "seconds_to_failure" in found
    monkeypatch.undo()
    dm.sweep_to_netcdf(tmp_path / "b.nc", dm.Step(), **given, material=dm.VHB, thickness=THICKNESS)
    xr.testing.assert_identical(found, xr.load_dataset(tmp_path / "b.nc"))


@pytest.mark.parametrize(
    ("film", "error", "message"),
    [
        ({"material": dm.VHB}, TypeError, "material and thickness must be given together; got no thickness"),
        ({"thickness": 1e-4}, TypeError, "material and thickness must be given together; got no material"),
        ({"material": dm.VHB, "thickness": -1.0}, ValueError, "thickness must be finite and above 0, in m; got -1.0"),
    ],
)
def test_half_a_film_is_refused(tmp_path, film, error, message):
    with pytest.raises(error, match=message):
        dm.sweep_to_netcdf(tmp_path / "a.nc", dm.Step(), field=1.2, modulus_ratio=4.0, **film)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ((3, dm.VHB, 1e-4), TypeError, "ds must be a data set; got 3"),
        ((xr.Dataset(), "VHB", 1e-4), TypeError, "material must be a Material; got 'VHB'"),
        ((xr.Dataset(), dm.VHB, "thin"), TypeError, "thickness must be a number; got 'thin'"),
        ((xr.Dataset(), dm.VHB, 0.0), ValueError, "thickness must be finite and above 0, in m; got 0.0"),
        ((xr.Dataset(), dm.Material(2e4, 1e4, 1.0), 1e-4), ValueError, "relative_permittivity must be known"),
    ],
)
def test_bad_input_is_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        dm.physical(*arguments)
