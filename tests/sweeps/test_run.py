"""Sweeps in memory and to a file."""

import os

import numpy as np
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.files import engines
from dea_maps.runs import maps as sweeping

STEP = {"field": [0.9, 1.2, 1.5, 2.5], "modulus_ratio": 4.0}


def no_solving(*_, **__):
    raise AssertionError("solved although the input is bad")


def test_step_against_the_table():
    ds = dm.sweep(dm.Step(), **STEP, rtol=1e-9)
    assert ds.outcome.values.tolist() == [0, 1, 1, 2]
    np.testing.assert_allclose(ds.time_to_failure, [np.nan, 2.443625636, 0.5463781327, 0.0], rtol=2e-9)
    np.testing.assert_allclose(ds.critical_stretch, [np.nan, 1.659354969, 1.464347835, 2 ** (1 / 3)], rtol=2e-9)
    np.testing.assert_allclose(ds.critical_field, [np.nan, 1.2, 1.5, 2.0], rtol=1e-15)
    assert ds.final_stretch.notnull().values.tolist() == [True, False, False, False]
    assert ds.attrs["rtol"] == 1e-9
    assert ds.attrs["program"] == "step"


def test_dimensions_and_coordinates():
    ds = dm.sweep(dm.RampHold(), field=[1.1, 1.3], rate=1.0, modulus_ratio=[2, 3, 4])
    assert ds.outcome.dims == ("field", "modulus_ratio")
    assert ds.rate.values == 1.0
    assert ds.sel(modulus_ratio=3, field=1.3).time_to_failure.values.shape == ()


def test_scattered_samples_are_cells_of_the_grid():
    field, rate, ratio = np.array([1.1, 1.4, 0.9]), np.array([0.1, 10.0, 1.0]), np.array([2.0, 4.0, 6.0])
    grid = dm.sweep(dm.RampHold(), field=field, rate=rate, modulus_ratio=ratio)
    sample = {
        name: xr.DataArray(values, dims="sample")
        for name, values in {"field": field, "rate": rate, "modulus_ratio": ratio}.items()
    }
    scattered = dm.sweep(dm.RampHold(), **sample)
    assert scattered.outcome.dims == ("sample",)
    for name in scattered.data_vars:
        diagonal = [grid[name].values[i, i, i] for i in range(3)]
        np.testing.assert_array_equal(scattered[name].values, diagonal)


def test_parameters_on_dask_are_computed_and_said_to_be(tmp_path):
    array = pytest.importorskip("dask.array")
    lazy = array.from_array(np.array(STEP["field"]), chunks=2)
    given = xr.DataArray(lazy, dims="sample")
    with pytest.warns(UserWarning, match=r"^field on dask: .* now, in memory; dm\.sweep_to_netcdf") as caught:
        scattered = dm.sweep(dm.Step(), field=given, modulus_ratio=4.0)
    assert [warning.filename for warning in caught] == [__file__]
    with pytest.warns(UserWarning, match=r"^field on dask"):
        ds = dm.sweep(dm.Step(), field=lazy, modulus_ratio=4.0)
    assert ds.identical(dm.sweep(dm.Step(), **STEP))
    assert scattered.chunks == {}
    np.testing.assert_array_equal(scattered.time_to_failure, ds.time_to_failure)
    dm.sweep_to_netcdf(tmp_path / "map.nc", dm.Step(), field=given, modulus_ratio=4.0)
    with xr.open_dataset(tmp_path / "map.nc") as stored:
        assert stored.identical(scattered)


def test_no_cells_give_an_empty_data_set():
    assert dm.sweep(dm.Step(), field=[], modulus_ratio=[2, 3]).time_to_failure.shape == (0, 2)


def test_fixed_step_method_records_its_step():
    ds = dm.sweep(dm.Ramp(), rate=1.0, modulus_ratio=4.0, method="rk4", step=1e-3)
    assert ds.attrs["method"] == "rk4"
    assert ds.attrs["step"] == 1e-3
    assert "rtol" not in ds.attrs


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"modulus_ratio": 0.5}, ValueError, "modulus_ratio must be finite and at least 1; got 0.5"),
        ({"rate": 1.0}, ValueError, "rate = 1.0 is not a parameter of the program 'step'"),
        ({"field": None}, ValueError, "field is missing"),
        ({"rtol": 0.1}, ValueError, "rtol.*0.1"),
        ({"method": "euler"}, ValueError, "method.*'euler'"),
        ({"formulation": "rats"}, ValueError, "formulation.*'rats'"),
    ],
)
def test_bad_input_is_refused_before_solving(arguments, error, message, monkeypatch, tmp_path):
    monkeypatch.setattr(sweeping, "solve", no_solving)
    monkeypatch.setattr(engines, "solve", no_solving)
    for call in (dm.sweep, lambda *args, **kwargs: dm.sweep_to_netcdf(tmp_path / "map.nc", *args, **kwargs)):
        with pytest.raises(error, match=message) as caught:
            call(dm.Step(), **{**STEP, **arguments})
        assert "\n" not in str(caught.value)
    assert os.listdir(tmp_path) == []


def test_a_result_beyond_memory_is_refused_in_one_line(monkeypatch):
    monkeypatch.setattr(sweeping, "solve", no_solving)
    many = np.linspace(1, 2, 200_000)
    with pytest.raises(MemoryError) as caught:
        dm.sweep(dm.RampHold(), field=many, rate=many, modulus_ratio=4)
    assert str(caught.value) == ("the result of 40,000,000,000 cells needs 1,527.4 GiB of memory: more than there is")


def test_memory_that_runs_out_is_reported_in_one_line(monkeypatch):
    def run_out(*_, **__):
        raise MemoryError("Unable to allocate")

    monkeypatch.setattr(sweeping, "solve", run_out)
    for progress in (False, True):
        with pytest.raises(MemoryError, match=r"the result of 4 cells needs 0\.0 GiB of memory: more than there is"):
            dm.sweep(dm.Step(), **STEP, progress=progress)


def test_progress_counts_finished_cells_on_standard_error(capsys):
    quiet = dm.sweep(dm.Step(), **STEP)
    assert capsys.readouterr().err == ""
    shown = dm.sweep(dm.Step(), **STEP, progress=True)
    captured = capsys.readouterr()
    assert "100%" in captured.err
    assert "4.00/4.00" in captured.err
    assert "cells/s" in captured.err
    assert captured.out == ""
    xr.testing.assert_identical(shown, quiet)
