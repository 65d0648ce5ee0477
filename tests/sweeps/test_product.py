"""Product grids, whose cells share integrations: as accurate as one by one, the same bits in memory and in files."""

import numba
import numpy as np
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.files import stream
from dea_maps.files.to_netcdf import planned_file
from dea_maps.runs.request import Request
from dea_maps.sweeps import solve
from dea_maps.sweeps.product import Product

AXES = {
    "field": np.concatenate([np.linspace(0.8, 2.4, 21), [1.0, 1.0 + 1e-9]]),
    "rate": np.geomspace(1e-4, 1e4, 9),
    "modulus_ratio": np.array([1.0, 1.3, 2.0, 4.0, 9.0]),
}
RESULTS = ("time_to_failure", "critical_stretch", "critical_internal_stretch", "critical_field", "final_stretch")


def scattered(axes):
    """All cells of a product as points along one dimension."""
    mesh = np.meshgrid(*axes.values(), indexing="ij")
    return {name: xr.DataArray(values.ravel(), dims="cell") for name, values in zip(axes, mesh, strict=True)}


def choice_of(program=None, **given):
    how = {name: given.pop(name) for name in ("rtol", "method", "formulation", "step") if name in given}
    return Request(dm.RampHold() if program is None else program, given, **how).planned().choice


@pytest.fixture(scope="module")
def whole():
    return dm.sweep(dm.RampHold(), **AXES)


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9])
def test_cells_are_as_accurate_as_one_by_one(rtol):
    found = dm.sweep(dm.RampHold(), **AXES, rtol=rtol)
    points = dm.sweep(dm.RampHold(), **scattered(AXES), rtol=1e-12)
    assert found.attrs["sharing"] == "product grid"
    assert "sharing" not in points.attrs
    np.testing.assert_array_equal(found.outcome.values.ravel(), points.outcome)
    for name in RESULTS:
        np.testing.assert_allclose(found[name].values.ravel(), points[name], rtol=rtol, atol=0.0, err_msg=name)


@pytest.mark.parametrize(("threads", "chunk"), [(2, 64), (3, 7), (1, 1000)])
def test_the_same_bits_on_any_threads(whole, threads, chunk, monkeypatch):
    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", threads)
    monkeypatch.setattr(solve, "PRODUCT_CHUNK", chunk)
    xr.testing.assert_identical(dm.sweep(dm.RampHold(), **AXES), whole)


@pytest.mark.parametrize("cells", [10_000, 400, 45, 4])
@pytest.mark.parametrize("memory", [2**24, 2**30])
def test_a_file_holds_the_same_bits(whole, cells, memory, monkeypatch, tmp_path):
    monkeypatch.setattr(stream, "SHARING_PART_CELLS", cells)
    monkeypatch.setattr(stream, "CHUNK_CELLS", 1)
    dm.sweep_to_netcdf(tmp_path / "map.nc", dm.RampHold(), **AXES, memory=memory)
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "map.nc"), whole)


@pytest.mark.parametrize("cells", [400, 45, 4])
def test_a_file_whose_parts_are_grids_of_their_own_holds_the_same_bits(whole, cells, monkeypatch, tmp_path):
    monkeypatch.setattr(stream, "SHARING_PART_CELLS", cells)
    monkeypatch.setattr(stream, "CHUNK_CELLS", 1)
    monkeypatch.setattr(stream, "product_bytes", lambda product, rtol: 2**40)
    dm.sweep_to_netcdf(tmp_path / "map.nc", dm.RampHold(), **AXES)
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "map.nc"), whole)


@pytest.mark.parametrize(("memory", "divided"), [(2**24, True), (2**30, False)])
def test_parts_are_grids_of_their_own_where_memory_is_short(memory, divided, tmp_path):
    axes = {"field": AXES["field"], "rate": np.geomspace(1e-3, 1e3, 300), "modulus_ratio": np.linspace(1.5, 10.0, 400)}
    plan = planned_file(tmp_path / "map.nc", Request(dm.RampHold(), axes), memory=memory)
    assert plan.divided == divided
    assert plan.parts.count > 1
    product = plan.task(1).product
    assert (product.axes[1].size == 300) == (not divided)
    for name, axis, own, index in zip(axes, product.axes, product.part, plan.parts.index(1), strict=False):
        np.testing.assert_array_equal(axis[own], axes[name][index])


@pytest.mark.parametrize(("rtol", "sizes"), [(1e-3, (20, 40, 5)), (1e-6, (40, 1, 64)), (1e-10, (30, 24, 16))])
def test_the_memory_of_what_is_shared_is_known_beforehand(rtol, sizes):
    axes = [np.linspace(1.05, 2.4, sizes[0]), np.geomspace(1e-3, 1e3, sizes[1]), np.linspace(1.5, 10.0, sizes[2])]
    dims = ("field", "rate", "modulus_ratio")
    product = Product(dims, tuple(axes), tuple(slice(0, size) for size in sizes))
    grid = solve.product_grid.ProductGrid(dims, axes, rtol, 1)
    needed = grid._series.data.nbytes + grid._hold.nbytes
    assert 0.5 * needed < solve.product_bytes(product, rtol) < 2.0 * needed


def test_parts_of_one_grid_are_computed_from_the_same_tables(monkeypatch, tmp_path):
    made = []
    real = solve.product_grid.ProductGrid

    def counted(*arguments):
        made.append(arguments)
        return real(*arguments)

    monkeypatch.setattr(stream, "SHARING_PART_CELLS", 45)
    monkeypatch.setattr(stream, "CHUNK_CELLS", 45)
    monkeypatch.setattr(solve.product_grid, "ProductGrid", counted)
    dm.sweep_to_netcdf(tmp_path / "map.nc", dm.RampHold(), **AXES)
    assert len(made) == 1


def test_a_film_that_may_break_down_has_the_same_bits(tmp_path):
    axes = {"field": np.linspace(0.8, 1.9, 20), "rate": np.array([0.1, 10.0]), "modulus_ratio": 4.0}
    film = dm.Material(87.8e3, 22.8e3, 200.0, 4.7, breakdown_strength=30e6)
    dm.sweep_to_netcdf(tmp_path / "map.nc", dm.RampHold(), **axes, material=film, thickness=1e-4)
    found = xr.load_dataset(tmp_path / "map.nc")
    expected = dm.sweep(dm.RampHold(), **axes)
    assert expected.attrs["sharing"] == found.attrs["sharing"] == "product grid"
    for name in expected.data_vars:
        assert found[name].values.tobytes() == expected[name].values.tobytes(), name


def test_a_named_method_or_few_fields_share_nothing():
    few = {**AXES, "field": np.linspace(1.1, 1.9, 4)}
    for axes, named in ((AXES, {"method": "dop853"}), (AXES, {"formulation": "area"}), (few, {})):
        found = dm.sweep(dm.RampHold(), **axes, **named)
        points = dm.sweep(dm.RampHold(), **scattered(axes))
        assert "sharing" not in found.attrs
        for name in found.data_vars:
            assert found[name].values.tobytes() == points[name].values.tobytes(), name


NOT_SHARED = {
    "another program": (dm.Step(), {"field": AXES["field"], "modulus_ratio": AXES["modulus_ratio"]}),
    "points": (dm.RampHold(), scattered(AXES)),
    "two on one dimension": (
        dm.RampHold(),
        {
            "field": AXES["field"],
            "rate": xr.DataArray(AXES["rate"], dims="film"),
            "modulus_ratio": xr.DataArray(np.linspace(2.0, 4.0, 9), dims="film"),
        },
    ),
    "two dimensions": (
        dm.RampHold(),
        {"field": xr.DataArray(np.linspace(1.1, 1.9, 40).reshape(20, 2), dims=("a", "b")), "rate": 1.0,
         "modulus_ratio": 4.0},
    ),
    "dead load": (dm.RampHold(), {**AXES, "prestretch": 1.2}),
    "too accurate": (dm.RampHold(), {**AXES, "rtol": 1e-11}),
    "fields too small": (dm.RampHold(), {**AXES, "field": np.linspace(0.1, 0.99, 50)}),
    "no cells": (dm.RampHold(), {**AXES, "rate": []}),
    "numbers": (dm.Sequence([dm.Linear("field", rate=0.5)]), {k: AXES[k] for k in ("field", "modulus_ratio")}),
}  # fmt: skip


@pytest.mark.parametrize("name", NOT_SHARED)
def test_what_is_no_product_of_many_fields_is_not_shared(name):
    program, given = NOT_SHARED[name]
    assert not choice_of(program, **given).shared


def test_single_values_and_other_names_of_dimensions_are_shared():
    assert choice_of(field=AXES["field"], rate=1.0, modulus_ratio=4.0).shared
    assert choice_of(field=AXES["field"], rate=AXES["rate"], modulus_ratio=xr.DataArray([4.0, 5.0], dims="film")).shared
    renamed = dm.Sequence([dm.Linear("peak", rate="speed")])
    given = {"peak": AXES["field"], "speed": AXES["rate"], "modulus_ratio": AXES["modulus_ratio"]}
    assert choice_of(renamed, **given).shared
    found, expected = dm.sweep(renamed, **given), dm.sweep(dm.RampHold(), **AXES)
    assert found.time_to_failure.values.tobytes() == expected.time_to_failure.values.tobytes()
