"""Cuts of a grid: every cell in one part, in order, and the parts of one cut whole ones of a finer cut."""

import math

import hypothesis.strategies as st
import numpy as np
from hypothesis import given

from dea_maps.sweeps.chunks import cut

SHAPES = st.lists(st.integers(0, 7), max_size=4).map(tuple)


@given(SHAPES, st.integers(1, 60))
def test_parts_are_the_cells_in_order(shape, most):
    numbers = np.arange(math.prod(shape)).reshape(shape)
    parts = cut(shape, most)
    found = [np.ravel(numbers[parts.index(i)]) for i in range(parts.count)]
    assert np.array_equal(np.concatenate(found) if found else [], numbers.ravel())
    for i, cells in enumerate(found):
        assert np.array_equal(numbers.ravel()[parts.cells(i)], cells)
        assert cells.size <= most


@given(SHAPES.filter(math.prod), st.integers(1, 20), st.integers(1, 60))
def test_parts_keep_the_borders_of_finer_ones(shape, few, more):
    finer = cut(shape, few)
    parts = cut(shape, max(few, more), finer)
    borders = {finer.cells(i).start for i in range(finer.count)}
    assert {parts.cells(i).start for i in range(parts.count)} <= borders


@given(SHAPES, st.integers(1, 60))
def test_no_part_is_larger_than_its_shape(shape, most):
    parts = cut(shape, most)
    largest = max((parts.cells(i).stop - parts.cells(i).start for i in range(parts.count)), default=0)
    assert largest == min(math.prod(parts.part_shape), math.prod(shape))


def test_long_dimensions_are_cut_evenly():
    assert cut((2, 4097), 4096).rows == 2049
