"""The data set of a sweep: variables, attributes, storage."""

import netCDF4
import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import dea_maps as dm
from dea_maps.sweeps.dataset import cell_bytes, make_dataset, reduced
from dea_maps.sweeps.grid import make_grid
from dea_maps.sweeps.solve import Solution

PROVENANCE = {"method": "dop853", "formulation": "fold", "rtol": 1e-6}
MAPS = ("time_to_failure", "critical_stretch", "critical_internal_stretch", "critical_field", "final_stretch")


def solution(shape):
    """Return arrays of a shape with different numbers everywhere, and NaN in the first cell."""
    cells = int(np.prod(shape))
    maps = [np.arange(cells, dtype=float).reshape(shape) + 1000 * number for number in range(len(MAPS))]
    for values in maps:
        values[(0,) * len(shape)] = np.nan
    return Solution((np.arange(cells) % 4).astype(np.int8).reshape(shape), *maps)


@pytest.fixture
def grid():
    return make_grid(dm.RampHold(), field=[1.1, 1.2], rate=[0.1, 1, 10], modulus_ratio=4)


@pytest.fixture
def ds(grid):
    return make_dataset(grid, solution(grid.shape), PROVENANCE)


def test_variables_have_their_types_and_places(grid, ds):
    found = solution(grid.shape)
    assert list(ds.data_vars) == ["outcome", *MAPS]
    for name in ds.data_vars:
        assert ds[name].dims == ("field", "rate")
        assert ds[name].dtype == (np.int8 if name == "outcome" else np.float64)
        np.testing.assert_array_equal(ds[name].values, getattr(found, name))
    assert set(ds.coords) == {"field", "rate", "modulus_ratio"}


def test_arrays_are_wrapped_not_copied(grid):
    found = solution(grid.shape)
    ds = make_dataset(grid, found, PROVENANCE)
    for name, values in found.by_name().items():
        assert np.shares_memory(ds[name].values, values)


def test_cell_bytes_counts_what_a_cell_takes(grid):
    found = solution(grid.shape).by_name().values()
    assert sum(values.nbytes for values in found) == cell_bytes(grid.program) * grid.cells


def test_everything_has_a_name_and_units(ds):
    for variable in ds.variables.values():
        assert variable.attrs["long_name"]
        assert variable.attrs["units"] == "1"
        assert variable.attrs["long_name"].isascii()


def test_outcome_is_a_cf_flag(ds):
    attributes = ds.outcome.attrs
    assert attributes["standard_name"] == "status_flag"
    assert attributes["flag_values"].dtype == np.int8
    assert attributes["flag_values"].tolist() == [0, 1, 2, 3]
    assert attributes["flag_meanings"] == "survives fails_later fails_at_once unresolved"
    assert "ancillary_variables" not in attributes
    assert all(ds[name].attrs["ancillary_variables"] == "outcome" for name in MAPS)


def test_says_from_what_and_how_it_was_made(ds):
    attributes = ds.attrs
    assert attributes["Conventions"] == "CF-1.11, ACDD-1.3"
    assert {key: attributes[key] for key in PROVENANCE} == PROVENANCE
    assert attributes["program"] == "ramp_hold"
    assert attributes["dea_maps_version"] == dm.__version__
    assert attributes["numpy_version"] == np.__version__
    assert "numba_version" in attributes
    for words in (
        "ramp_hold",
        "field=2 values from 1.1 to 1.2",
        "modulus_ratio=4.0",
        "method=dop853",
        "rtol=1e-06",
    ):
        assert words in attributes["history"]
    for key in ("title", "summary", "source", "history", "references"):
        assert attributes[key]
        assert attributes[key].isascii()
        assert "\n" not in attributes[key]


def test_step_stands_where_rtol_would():
    grid = make_grid(dm.Ramp(), rate=1, modulus_ratio=[])
    found = Solution(np.empty(0, np.int8), *(np.empty(0) for _ in MAPS))
    ds = make_dataset(grid, found, {"method": "rk4", "formulation": "fold", "step": 0.01})
    assert ds.attrs["step"] == 0.01
    assert "rtol" not in ds.attrs
    assert "modulus_ratio=none" in ds.attrs["history"]


def test_stored_compressed_and_checked_without_fill_in_coordinates(ds, tmp_path):
    ds.to_netcdf(tmp_path / "map.nc")
    with netCDF4.Dataset(tmp_path / "map.nc") as file:
        for name in ("field", "outcome", "time_to_failure"):
            filters = file[name].filters()
            assert filters["zlib"]
            assert filters["complevel"] == 1
            assert filters["shuffle"]
            assert filters["fletcher32"]
        for name in ("field", "rate", "modulus_ratio", "outcome"):
            assert "_FillValue" not in file[name].ncattrs()
        assert np.isnan(file["time_to_failure"].getncattr("_FillValue"))


def test_encodings_of_what_was_given_are_left_behind(tmp_path):
    field = xr.DataArray([1.123456, 1.2], dims="sample", coords={"weight": ("sample", [0.123, 0.456])})
    field.encoding = field["weight"].encoding = {"dtype": "int16", "scale_factor": 0.1}
    grid = make_grid(dm.Step(), field=field, modulus_ratio=4)
    ds = make_dataset(grid, solution(grid.shape), PROVENANCE)
    ds.to_netcdf(tmp_path / "map.nc")
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "map.nc"), ds)
    assert ds.field.values.tolist() == [1.123456, 1.2]


def test_same_sweep_gives_same_bytes(grid, tmp_path):
    for name in ("one.nc", "other.nc"):
        make_dataset(grid, solution(grid.shape), PROVENANCE).to_netcdf(tmp_path / name)
    assert (tmp_path / "one.nc").read_bytes() == (tmp_path / "other.nc").read_bytes()


@st.composite
def datasets(draw):
    """Draw data sets of any grid, with any numbers in their maps."""
    fields = hnp.arrays(float, draw(st.integers(0, 4)), elements=st.floats(0, 1e300))
    field = draw(fields)
    if draw(st.booleans()):
        labels = draw(st.lists(st.text("ab c", max_size=3), min_size=len(field), max_size=len(field)))
        field = xr.DataArray(field, dims="sample", coords={"film": ("sample", np.array(labels, dtype="U3"))})
    ratio = draw(st.one_of(st.floats(1, 1e300), st.lists(st.floats(1, 1e300), max_size=3)))
    grid = make_grid(dm.Step(), field=field, modulus_ratio=ratio)
    maps = hnp.arrays(float, grid.shape, elements=st.floats(allow_nan=True, allow_infinity=True))
    outcomes = hnp.arrays(np.int8, grid.shape, elements=st.integers(0, 3))
    return make_dataset(grid, Solution(draw(outcomes), *(draw(maps) for _ in MAPS)), PROVENANCE)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(datasets())
def test_reads_back_identical(tmp_path, ds):
    ds.to_netcdf(tmp_path / "map.nc")
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "map.nc"), ds)


def test_reduced_keeps_what_is_asked_for(ds):
    kept = reduced(ds, ["outcome", "critical_stretch"], "float32")
    assert list(kept.data_vars) == ["outcome", "critical_stretch"]
    assert kept.outcome.dtype == np.int8
    assert kept.critical_stretch.dtype == np.float32
    assert kept.field.dtype == np.float64
    assert kept.critical_stretch.attrs == ds.critical_stretch.attrs
    assert kept.critical_stretch.encoding == ds.critical_stretch.encoding
    assert kept.attrs == ds.attrs


def test_reduced_without_outcome_does_not_point_to_it(ds, tmp_path):
    kept = reduced(ds, ["time_to_failure"], "float64")
    assert "ancillary_variables" not in kept.time_to_failure.attrs
    assert ds.time_to_failure.attrs["ancillary_variables"] == "outcome"
    assert np.shares_memory(kept.time_to_failure.values, ds.time_to_failure.values)
    kept.to_netcdf(tmp_path / "map.nc")
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "map.nc"), kept)
