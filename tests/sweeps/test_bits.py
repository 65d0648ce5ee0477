"""Results have the same bits for any number of threads, any cut of the grid, any order of the cells."""

import numba
import numpy as np
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.sweeps import solve

AXES = {
    "field": np.concatenate([np.linspace(0.7, 2.6, 9), [1.0, 1.0 + 1e-12, 2.0 * (1 - 1e-12)]]),
    "rate": np.geomspace(1e-5, 1e4, 11),
    "modulus_ratio": np.concatenate([np.geomspace(1.0, 900.0, 12), [4.0, 1.0 + 1e-13]]),
}
SCENES = [(dm.Step(), 1e-6), (dm.Ramp(), 1e-6), (dm.RampHold(), 1e-4), (dm.RampHold(), 1e-11)]


def grid_of(program):
    return {name: AXES[name] for name in (*program.parameters, "modulus_ratio")}


def assert_same_bits(found, expected):
    for name in expected.data_vars:
        assert found[name].values.tobytes() == expected[name].transpose(*found[name].dims).values.tobytes(), name


@pytest.fixture(params=SCENES, ids=lambda scene: f"{scene[0].name}-{scene[1]}")
def scene(request):
    program, rtol = request.param
    return program, rtol, dm.sweep(program, **grid_of(program), rtol=rtol)


@pytest.mark.parametrize(("threads", "chunk"), [(1, 4096), (2, 64), (5, 7), (3, 1)])
def test_threads_and_parts(scene, threads, chunk, monkeypatch):
    program, rtol, whole = scene
    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", threads)
    monkeypatch.setattr(solve, "CHUNK", chunk)
    assert_same_bits(dm.sweep(program, **grid_of(program), rtol=rtol), whole)


def test_slices_of_the_grid(scene):
    program, rtol, whole = scene
    for name, values in grid_of(program).items():
        pieces = [values[:1], values[1:4], values[4:]]
        found = [dm.sweep(program, **{**grid_of(program), name: piece}, rtol=rtol) for piece in pieces]
        assert_same_bits(xr.concat(found, name, data_vars="all"), whole)


def test_order_of_the_cells(scene):
    program, rtol, whole = scene
    cells = whole.stack(cell=whole.outcome.dims)
    order = np.random.default_rng(5).permutation(cells.sizes["cell"])
    shuffled = {name: xr.DataArray(cells[name].values[order], dims="cell") for name in grid_of(program)}
    found = dm.sweep(program, **shuffled, rtol=rtol)
    for name in found.data_vars:
        assert found[name].values.tobytes() == cells[name].values[order].tobytes(), name
