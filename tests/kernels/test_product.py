"""Product grids: every cell against the solver of a single cell at the tightest tolerance, and known values."""

import itertools

import numpy as np
import pytest

from dea_maps.kernels import build, lane_state, sweep
from dea_maps.kernels.product.chebyshev import FIRST_ENTRY, FIRST_NODE, LADDER, NODES, TO_SERIES, needed_terms
from dea_maps.kernels.product.grid import SMALLEST_RTOL, ProductGrid, pays

DIMS = ("field", "rate", "modulus_ratio")
ATTEMPTS = 1_000_000
GRIDS = {
    "usual": (np.linspace(0.8, 2.4, 24), np.geomspace(1e-3, 1e3, 13), np.linspace(1.5, 10.0, 18)),
    "next to Ec": (1.0 + np.geomspace(1e-12, 1e-2, 21), np.geomspace(1e-6, 1e5, 12), np.array([1.2, 4.0, 20.0])),
    "near-instant": (
        np.concatenate([2.0 - np.geomspace(1e-12, 0.2, 20), [2.0, 2.0 + 1e-9, 2.1]]),
        np.geomspace(1.0, 1e5, 14),
        np.array([4.0]),
    ),
    "elastic": (
        np.array([0.5, 1.0, 1.0 + 1e-10, 1.0 + 1e-7, 1.0001, 1.01, 1.2]),
        np.geomspace(1e-6, 1e5, 12),
        np.array([1.0, 1.0 + 1e-9, 1.0 + 1e-4, 1.01, 1.1]),
    ),
    "large modulus ratio": (
        np.concatenate([np.linspace(1.0, 2.0, 9), np.linspace(3.0, 40.0, 14)]),
        np.geomspace(1e-6, 1e5, 12),
        np.array([30.0, 200.0, 1000.0]),
    ),
}


def evaluate(dims, axes, rtol, part=None, **options):
    grid = ProductGrid(dims, axes, rtol, ATTEMPTS, **options)
    part = [slice(0, size) for size in grid.shape] if part is None else part
    shape = tuple(own.stop - own.start for own in part)
    status = np.full(shape, 99, np.int8)
    results = [np.full(shape, -1.0) for _ in range(sweep.RESULTS)]
    left = grid.evaluate(part, status, results)
    return status, np.array(results), left


def singly(axes, rtol):
    field, rate, ratio = (array.ravel() for array in np.meshgrid(*axes, indexing="ij"))
    status = np.empty(field.size, np.int8)
    results = np.empty((sweep.RESULTS, field.size))
    build.sweep_for("ramp_hold", "area", "dop853")(field, rate, ratio, rtol, 0.0, ATTEMPTS, status, results)
    shape = tuple(axis.size for axis in axes)
    return status.reshape(shape), results.reshape(-1, *shape)


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-8, 1e-10])
@pytest.mark.parametrize("name", GRIDS)
def test_every_cell_is_as_accurate_as_asked(name, rtol):
    status, results, left = evaluate(DIMS, GRIDS[name], rtol)
    expected_status, expected = singly(GRIDS[name], 1e-12)
    np.testing.assert_array_equal(status, expected_status)
    np.testing.assert_allclose(results, expected, rtol=rtol, atol=0.0)
    assert left < (0.5 if name in {"next to Ec", "elastic"} else 0.1) * status.size


def test_a_fast_ramp_is_the_step_and_a_short_one_the_ramp():
    # theory.md: step, m = 4; ramp, m = 4
    step = {1.05: (9.028237529, 1.794411933), 1.2: (2.443625636, 1.659354969), 1.5: (0.5463781327, 1.464347835)}
    fields = np.array([*step, 1.99, 1.0])
    status, results, _ = evaluate(DIMS, (fields, np.array([1.0, 1e8]), np.array([4.0])), 1e-10)
    for cell, (time, stretch) in enumerate(step.values()):
        np.testing.assert_allclose(results[:2, cell, 1, 0], [time, stretch], rtol=1e-7)
    np.testing.assert_allclose(results[[0, 1, 3], 3, 0, 0], [1.581172717, 1.423228766, 1.581172717], rtol=1e-9)
    assert list(status[4, :, 0]) == [lane_state.SURVIVES, lane_state.SURVIVES]


def test_the_same_bits_in_any_order_of_dimensions():
    axes = (np.linspace(0.9, 2.1, 19), np.geomspace(1e-2, 1e2, 18), np.array([1.0, 1.5, *np.linspace(2.0, 9.0, 16)]))
    status, results, _ = evaluate(DIMS, axes, 1e-6)
    for order in itertools.permutations(range(3)):
        other_status, other, _ = evaluate([DIMS[k] for k in order], [axes[k] for k in order], 1e-6)
        np.testing.assert_array_equal(other_status, status.transpose(order))
        np.testing.assert_array_equal(other, results.transpose(0, *(1 + k for k in order)))


@pytest.mark.parametrize(
    "part", [(3, 4, 0, 18, 0, 37), (0, 11, 5, 7, 15, 17), (2, 9, 17, 18, 3, 36), (10, 11, 0, 1, 36, 37)]
)
def test_the_same_bits_for_any_part(part):
    axes = (np.linspace(0.9, 2.1, 11), np.geomspace(1e-2, 1e2, 18), np.linspace(1.2, 9.0, 37))
    status, results, _ = evaluate(DIMS, axes, 1e-6)
    own = [slice(*bounds) for bounds in (part[:2], part[2:4], part[4:])]
    part_status, found, _ = evaluate(DIMS, axes, 1e-6, own)
    np.testing.assert_array_equal(part_status, status[*own])
    np.testing.assert_array_equal(found, results[:, *own])
    # and of a grid that has nothing else
    small = [axis[bounds] for axis, bounds in zip(axes, own, strict=True)]
    part_status, found, _ = evaluate(DIMS, small, 1e-6)
    np.testing.assert_array_equal(part_status, status[*own])
    np.testing.assert_array_equal(found, results[:, *own])


def test_the_same_bits_whatever_order_the_series_are_found_in():
    axes = (np.linspace(0.9, 2.1, 5), np.geomspace(1e-2, 1e2, 400), np.linspace(1.2, 9.0, 17))
    status, results, _ = evaluate(DIMS, axes, 1e-3)
    grid = ProductGrid(DIMS, axes, 1e-3, ATTEMPTS, lambda work, numbers: [work(number) for number in reversed(numbers)])
    other_status = np.empty_like(status)
    other = np.empty_like(results)
    grid.evaluate([slice(0, size) for size in grid.shape], other_status, list(other))
    np.testing.assert_array_equal(other_status, status)
    np.testing.assert_array_equal(other, results)


@pytest.mark.parametrize("rate", [1e-12, 1e12])
def test_rates_beyond_any_series_are_left_to_the_solver_of_a_single_cell(rate):
    axes = (np.array([0.9, 1.1, 3.0]), np.array([rate, 1.0]), np.array([4.0]))
    prepared = []
    status, results, left = evaluate(DIMS, axes, 1e-6, prepare=prepared.append)
    expected_status, expected = singly(axes, 1e-6)
    assert left == 2
    assert prepared == [build.sweep_for("ramp_hold", "area", "dop853")]
    np.testing.assert_array_equal(status, expected_status)
    np.testing.assert_array_equal(results[:, :, 0], expected[:, :, 0])


def test_the_solver_of_a_single_cell_is_not_compiled_for_nothing():
    prepared = []
    axes = (np.linspace(0.9, 2.1, 5), np.array([0.1, 1.0]), np.array([4.0]))
    *_, left = evaluate(DIMS, axes, 1e-6, prepare=prepared.append)
    assert (left, prepared) == (0, [])


def test_the_rule_counts_fields_and_asks_for_no_more_than_series_can_give():
    assert pays(1000, 1e-6)
    assert pays(1000, SMALLEST_RTOL)
    assert not pays(1000, SMALLEST_RTOL / 10.0)
    assert not pays(2, 1e-6)


@pytest.mark.parametrize("rung", range(len(LADDER)))
def test_series_interpolate_at_their_nodes(rung):
    count = LADDER[rung]
    nodes = NODES[FIRST_NODE[rung] : FIRST_NODE[rung + 1]]
    matrix = TO_SERIES[FIRST_ENTRY[rung] : FIRST_ENTRY[rung + 1]].reshape(count, count)
    values = np.exp(nodes) / (1.3 + nodes)
    np.testing.assert_allclose(np.polynomial.chebyshev.chebval(nodes, values @ matrix), values, rtol=1e-13)


def test_terms_are_left_out_from_the_last_as_far_as_their_sum_allows():
    series = np.array([1.0, 0.5, 0.25, 0.125, 0.0625])
    assert [needed_terms(series, 5, allowed) for allowed in (0.0, 0.0625, 0.1874, 0.1875, 10.0)] == [5, 4, 4, 3, 1]
