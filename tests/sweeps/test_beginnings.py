"""Cells that begin alike go through it once: the same bits as on their own, whatever the grid."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

import dea_maps as dm
from dea_maps.kernels.loading import held
from dea_maps.kernels.loading.cells import make_sweep
from dea_maps.kernels.loading.law import FREE
from dea_maps.kernels.loading.pieces import LINEAR_ONLY
from dea_maps.kernels.loading.results import RESULTS
from dea_maps.kernels.loading.together import find_shared
from dea_maps.sweeps import solve
from dea_maps.sweeps.grid import make_grid
from dea_maps.sweeps.loading import arrays_of, order_to_share, table_of

WAVE = dm.Sequence(
    [dm.Linear("peak", rate="rate"), dm.Sine("swing", "turn", cycles=2), dm.Hold("width"), dm.Jump("rest")]
)
TRAIN = dm.Sequence([dm.Linear("peak", rate="rate"), dm.Hold("width"), dm.Jump(0.0), dm.Hold("rest_time")], repeat=True)
RANGES = {
    "modulus_ratio": [1.0, 4.0, 2.0, 30.0],
    "field": [1.3, 0.8, 1.0, 1.9],
    "overdrive_field": [1.5, 1.05, 2.4, 1.2],
    "overdrive_time": [0.1, 0.0, 3.0, 0.5],
    "rate": [1.0, 0.02, 50.0, 1.0],
    "fall_rate": [2.0, 0.3, 20.0, 0.1],
    "hold_time": [0.3, 2.0, 0.01, 20.0],
    "width": [0.3, 2.0, 0.01, 20.0],
    "peak": [1.1, 0.9, 1.4, 1.25],
    "swing": [0.1, 0.3, 0.02, 0.2],
    "turn": [2.0, 0.2, 1.0, 0.7],
    "rest": [0.0, 1.1, 0.5, 1.0],
    "rest_time": [1.0, 0.1, 5.0, 0.0],
}


def assert_cells_are_those_of_scattered_films(program, rtol, **axes):
    """In an order in which hardly any film begins like the one before it."""
    whole = dm.sweep(program, **axes, rtol=rtol)
    cells = whole.stack(cell=whole.outcome.dims) if whole.outcome.ndim else whole.expand_dims("cell")
    order = np.random.default_rng(3).permutation(cells.sizes["cell"])
    grid = make_grid(program, **axes)
    scattered = {name: xr.DataArray(grid.parameters[name].ravel()[order], dims="cell") for name in axes}
    found = dm.sweep(program, **scattered, rtol=rtol)
    for name in found.data_vars:
        assert found[name].values.tobytes() == cells[name].values[order].tobytes(), name
    return whole


@settings(max_examples=40, deadline=None)
@given(st.data())
def test_a_cell_has_the_bits_that_it_has_on_its_own(data):
    """Any dimensions, some parameters along the same one, as films that are listed."""
    program = data.draw(st.sampled_from([dm.Overdrive(), dm.Trapezoid(), dm.Pulse(), TRAIN]))
    axes = {}
    for name in (*program.parameters, "modulus_ratio"):
        count = data.draw(st.integers(1, 4), label=name)
        listed = data.draw(st.sampled_from([False, False, True]))
        axes[name] = xr.DataArray(RANGES[name], dims="film") if listed else RANGES[name][:count]
    rtol = data.draw(st.sampled_from([1e-3, 1e-6, 1e-10]))
    assert_cells_are_those_of_scattered_films(program, rtol, **axes)


def test_films_that_fail_beside_a_threshold_and_sines():
    """Where errors are closest to what is allowed, and cells begin anew with shorter steps."""
    axes = {
        "peak": np.linspace(0.5, 1.3, 4),
        "rate": np.geomspace(0.1, 10.0, 4),
        "swing": np.linspace(0.05, 0.3, 4),
        "turn": [0.3, 2.0],
        "width": np.geomspace(0.1, 3.0, 4),
        "rest": np.linspace(0.2, 1.3, 5),
        "modulus_ratio": [1.0, 3.0, 10.0],
    }
    whole = assert_cells_are_those_of_scattered_films(WAVE, 1e-10, **axes)
    assert {0, 1} <= set(np.unique(whole.outcome))


def test_films_under_a_dead_load():
    assert_cells_are_those_of_scattered_films(
        dm.Trapezoid(),
        1e-6,
        **{name: RANGES[name][:3] for name in ("field", "rate", "hold_time", "fall_rate")},
        stress=[0.0, 0.5, 1.5],
        modulus_ratio=[2.0, 4.0],
    )


@pytest.mark.parametrize("chunk", [1, 7, 50])
def test_parts_and_threads(chunk, monkeypatch):
    axes = {name: RANGES[name] for name in (*dm.Trapezoid().parameters, "modulus_ratio")}
    whole = dm.sweep(dm.Trapezoid(), **axes)
    monkeypatch.setattr(solve, "CHUNK", chunk)
    monkeypatch.setattr(solve.numba.config, "NUMBA_NUM_THREADS", 3)
    found = dm.sweep(dm.Trapezoid(), **axes)
    for name in whole.data_vars:
        assert found[name].values.tobytes() == whole[name].values.tobytes(), name


def test_pieces_in_common_are_counted():
    """The film, then pieces of 1, 2 (of no duration), 3 and the last; the last one is never shared."""
    columns = np.array([[1.0] * 6, [5, 5, 5, 5, 5, 5], [6, 6, 7, 7, 7, 7], [8, 9, 9, 9, 9, 9], [0, 1, 2, 3, 3, 3]])
    scale = np.array([[1.0, 1.0, 2.0, 0.0], [1.0, 1.0, 0.0, 0.0], [1.0, 1.0, 1.0, 0.0], [1.0, 1.0, 1.0, 0.0]])
    source = np.array([[1, 1, 0, 0], [2, 2, 0, 0], [3, 3, 3, 0], [4, 4, 0, 0]])
    ratio = np.array([2.0, 2.0, 2.0, 2.0, 2.0, 3.0])
    shared, uses = np.empty(6, np.int64), np.empty(5, np.int64)
    find_shared(scale, source, columns, ratio, np.ones(6), np.zeros(6), 4, shared, uses)
    assert shared.tolist() == [0, 2, 1, 3, 3, 0]
    scale[0, 2] = 0.0  # nothing lasts before the third
    find_shared(scale, source, columns, ratio, np.ones(6), np.zeros(6), 4, shared, uses)
    assert shared.tolist() == [0, 0, 0, 3, 3, 0]
    find_shared(scale, source, columns, ratio, np.ones(6), np.zeros(6), 1, shared, uses)
    assert shared.tolist() == [0] * 6


def evaluations(monkeypatch, program, **axes):
    """How often dr/dT is evaluated in steps, the kernel run as plain Python."""
    count = 0

    def flow(*arguments):
        nonlocal count
        count += 1
        return FREE.flow(*arguments)

    counted = FREE._replace(flow=flow)
    monkeypatch.setitem(held._INTEGRALS, counted, held._INTEGRALS[FREE])
    grid = make_grid(program, **axes)
    order = order_to_share(program, grid.parameters)
    film = {name: values.transpose(order).flatten() for name, values in grid.parameters.items()}
    cells = film["modulus_ratio"].size
    table = arrays_of(table_of(program), film)
    status, result = np.empty(cells, np.int8), np.empty((RESULTS, cells))
    with np.errstate(all="ignore"):
        kernel = make_sweep(counted, LINEAR_ONLY, 1).py_func
        kernel(*table, film["modulus_ratio"], np.ones(cells), np.zeros(cells), 1e-6, status, result)
    return count


def test_what_is_in_common_is_computed_once(monkeypatch):
    """Of films that differ in the fall alone each takes, after the first, what the fall takes."""
    film = {"field": 1.2, "rate": 1.0, "hold_time": 0.3, "modulus_ratio": 4.0}
    falls = [0.5, 2.0]
    rising = dm.Sequence([dm.Linear("field", rate="rate"), dm.Hold("hold_time"), dm.Jump(0.0)])
    before = evaluations(monkeypatch, rising, **film)
    single = [evaluations(monkeypatch, dm.Trapezoid(), **film, fall_rate=fall) for fall in falls]
    both = evaluations(monkeypatch, dm.Trapezoid(), **film, fall_rate=falls)
    assert before > 50
    assert abs(sum(single) - both - before) <= 4  # not steps: the start of a piece
