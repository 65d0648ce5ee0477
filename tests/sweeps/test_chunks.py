"""Cuts of a grid: every cell in one part, in order, and the parts of one cut whole ones of a finer cut."""

import math

import hypothesis.strategies as st
import numpy as np
from hypothesis import given

from dea_maps.sweeps.chunks import blocks, cut

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


@given(SHAPES.filter(math.prod), st.integers(1, 20), st.integers(1, 60), st.none() | st.integers(0, 3))
def test_parts_are_whole_chunks_and_hold_every_cell_once(shape, few, more, wide):
    numbers = np.arange(math.prod(shape)).reshape(shape)
    chunks = cut(shape, few)
    parts = blocks(chunks, max(few, more), wide)
    seen = []
    for number in range(parts.count):
        cells = numbers[parts.index(number)].ravel()
        assert cells.size == parts.cells(number) <= max(few, more)
        for chunk, place in zip(*parts.chunks_of(number), strict=True):
            assert np.array_equal(cells[place], numbers[chunks.index(chunk)].ravel())
            seen.append(chunk)
        if wide is None:
            assert np.array_equal(cells, np.arange(cells[0], cells[-1] + 1))
    assert sorted(seen) == list(range(chunks.count))


def test_parts_have_much_of_the_dimension_that_is_wide():
    chunks = cut((1000, 1000, 1000), 65_536)
    assert chunks.part_shape == (1, 63, 1000)
    assert blocks(chunks, 750_000, wide=0).sizes == (11, 1)
    assert blocks(chunks, 750_000, wide=2).sizes == blocks(chunks, 750_000).sizes == (1, 8)


@given(SHAPES, st.integers(1, 60))
def test_no_part_is_larger_than_its_shape(shape, most):
    parts = cut(shape, most)
    largest = max((parts.cells(i).stop - parts.cells(i).start for i in range(parts.count)), default=0)
    assert largest == min(math.prod(parts.part_shape), math.prod(shape))


def test_long_dimensions_are_cut_evenly():
    assert cut((2, 4097), 4096).rows == 2049
