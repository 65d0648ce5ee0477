"""The cells of a product grid: of every one the sum of a series, or what its ramp or its field alone says."""

import math

import numpy as np

from .._jit import Kernel, device
from ..lane_state import FAILED, RUNNING, SURVIVES
from ..sweep import LANES
from . import holds, series
from .chebyshev import GROUP, MOST_TERMS

# Rows of a block of lanes: the head and the terms of the series, see `make_pack`; what the field says; what is found.
_TERMS = series.HEAD
_HOLD = _TERMS + MOST_TERMS
_X = _HOLD + holds.ROWS
_FACTOR = _X + 1  # s/w, NaN where the series is not to be used
_LATER = _X + 2  # the last two sums of Clenshaw's recurrence
_LAST = _X + 3
_TIME = _X + 4
_STRETCH = _X + 5
_INTERNAL = _X + 6
_FIELD = _X + 7
_STATUS = _X + 8
_ROWS = _X + 9


# Indices are unsigned where a loop over lanes adds to them: from others, which may count from the end, no vector
# instructions are made, and slices count references.


@device
def _load(w, first, rows, data, offset, width):
    """Copy rows of a table into the block: ``width`` lanes, or one for all."""
    lanes = w.shape[1]
    source, target = np.uint64(offset), np.uint64(first)
    if width == 1:
        for row in range(rows):
            value = data[source + np.uint64(row)]
            for i in range(lanes):
                w[target + np.uint64(row), i] = value
    else:
        for row in range(rows):
            for i in range(lanes):
                w[target + np.uint64(row), i] = data[source + np.uint64(row * lanes + i)]


@device
def _sum_series(w, terms):
    """Clenshaw's recurrence in every lane, a group of terms at a time; ``_LATER`` becomes the sum."""
    lanes = w.shape[1]
    for i in range(lanes):
        w[_LATER, i] = 0.0
        w[_LAST, i] = 0.0
    for first in range(GROUP, terms, GROUP):
        for i in range(lanes):
            twice = 2.0 * w[_X, i]
            b1, b2 = w[_LAST, i], w[_LATER, i]
            b2 = (w[_TERMS + first, i] - b2) + twice * b1
            b1 = (w[_TERMS + first + 1, i] - b1) + twice * b2
            b2 = (w[_TERMS + first + 2, i] - b2) + twice * b1
            b1 = (w[_TERMS + first + 3, i] - b1) + twice * b2
            w[_LAST, i] = b1
            w[_LATER, i] = b2
    for i in range(lanes):
        x = w[_X, i]
        twice = 2.0 * x
        b1, b2 = w[_LAST, i], w[_LATER, i]
        b2 = (w[_TERMS, i] - b2) + twice * b1
        b1 = (w[_TERMS + 1, i] - b1) + twice * b2
        b2 = (w[_TERMS + 2, i] - b2) + twice * b1
        w[_LATER, i] = (w[_TERMS + 3, i] - b1) + x * b2


@device
def _find(w, terms):
    """Results of every lane, NaN where it survives or is for the solver of a single cell."""
    lanes = w.shape[1]
    held = 0
    for i in range(lanes):
        E, root = w[_HOLD + holds.EXCESS, i], w[_HOLD + holds.ROOT, i]
        gap = w[series.EXCESS, i] - E
        s = np.sqrt(gap if gap > 0.0 else 0.0)
        bend = w[series.BEND, i]
        w[_X, i] = 2.0 * (1.0 + bend) * root / (w[series.ROOT, i] + s + bend * root) - 1.0
        usable = (gap >= 0.0) & (w[series.FROM, i] <= E)
        w[_FACTOR, i] = s * w[_HOLD + holds.INVERSE, i] if usable else math.nan
        held += 1 if usable else 0
    if held > 0:
        _sum_series(w, terms)
    for i in range(lanes):
        field = w[_HOLD + holds.FIELD, i]
        on_ramp = w[series.EXCESS, i] < w[_HOLD + holds.EXCESS, i]
        rest = w[_FACTOR, i] * w[_LATER, i]
        rest = 0.0 if rest < 0.0 else rest  # rounding, where a hold begins at its end
        time = w[series.TIME, i] if on_ramp else field / w[series.OF_RATE, i] + rest
        fails = time < math.inf
        w[_TIME, i] = time if fails else math.nan
        stretch = w[series.STRETCH, i] if on_ramp else w[_HOLD + holds.STRETCH, i]
        internal = w[series.INTERNAL, i] if on_ramp else w[_HOLD + holds.INTERNAL, i]
        w[_STRETCH, i] = stretch if fails else math.nan
        w[_INTERNAL, i] = internal if fails else math.nan
        w[_FIELD, i] = (w[series.AT_FIELD, i] if on_ramp else field) if fails else math.nan
        final = w[_HOLD + holds.FINAL, i]
        w[_STATUS, i] = FAILED if fails else (SURVIVES if final > 0.0 else RUNNING)


@device
def _write(out, o1, o2, first, w, row, skip, count):
    """Write a row of the block; a whole block by a loop of known length, which is vector instructions alone."""
    lanes = w.shape[1]
    target, source = np.uint64(first), np.uint64(skip)
    if count == lanes:
        for i in range(lanes):
            out[o1, o2, target + np.uint64(i)] = w[row, i]
    else:
        for i in range(count):
            out[o1, o2, target + np.uint64(i)] = w[row, source + np.uint64(i)]


def make_pack() -> Kernel:
    """Make the compiled ``pack(head, series, count, inner, width, terms, table)``: series into blocks of lanes.

    The series are those of (outer, inner) pairs; ``terms`` (outer, blocks) and the flat ``table`` are filled in. A
    block has the rows of the head, the first group of terms with the constant last, and the others from the highest
    degree down, all as the recurrence takes them. Returns the size of the table.
    """

    def pack(head, series_, count, inner, width, terms, table):
        size = 0
        for o in range(terms.shape[0]):
            for b in range(terms.shape[1]):
                most = GROUP
                for i in range(width):
                    most = max(most, count[o * inner + min(b * width + i, inner - 1)])
                rows = -(-most // GROUP) * GROUP
                terms[o, b] = rows
                for i in range(width):
                    k = o * inner + min(b * width + i, inner - 1)  # the last column fills the last block up
                    for row in range(_TERMS):
                        table[size + row * width + i] = head[k, row]
                    for row in range(rows):
                        degree = GROUP - 1 - row if row < GROUP else rows + GROUP - 1 - row
                        table[size + (_TERMS + row) * width + i] = series_[k, degree]
                size += (_TERMS + rows) * width
        return size

    types = "float64[:, ::1], float64[:, ::1], int64[::1], int64, int64, int64[:, ::1], float64[::1]"
    return Kernel(pack, types)


def make_cells() -> Kernel:
    """Make the compiled ``cells(table, offset, terms, of_series, hold_table, of_hold, start, stop, status, ...)``.

    The two tables are flat; block b of the series numbered k begins at ``offset[k, b]`` and has ``terms[k, b]`` terms;
    the blocks of what the fields say all have the same size. ``of_series`` and ``of_hold`` (first, second) number them
    for the cells of the first two dimensions. Cells ``start`` to ``stop`` of the last dimension are written to
    ``status``, int8, and ``time, stretch, internal, field, final``, all (first, second, stop - start). Returns how many
    are left to the solver of a single cell: their status is RUNNING.
    """
    lanes = LANES

    def cells(
        table, offset, terms, of_series, hold_table, of_hold, hold_blocks, hold_width, series_width, start, stop,
        status, time, stretch, internal, field, final,
    ):  # fmt: skip
        w = np.zeros((_ROWS, lanes))
        left = 0
        # A series is longer than what a field says: the inner loop is along the dimension on which it does not depend.
        outer, inner = of_series.shape
        turned = of_series[0, 0] == of_series[outer - 1, 0]
        if turned:
            outer, inner = inner, outer
        for b in range(start // lanes, (stop - 1) // lanes + 1):
            begin, end = max(start, b * lanes), min(stop, (b + 1) * lanes)
            skip, first, count = begin - b * lanes, begin - start, end - begin
            series_block = b if series_width > 1 else 0
            hold_block = b if hold_width > 1 else 0
            loaded_series, loaded_hold = -1, -1
            for a in range(outer):
                for c in range(inner):
                    o1, o2 = (c, a) if turned else (a, c)
                    k, h = of_series[o1, o2], of_hold[o1, o2]
                    count_terms = terms[k, series_block]
                    if k != loaded_series:
                        _load(w, 0, series.HEAD + count_terms, table, offset[k, series_block], series_width)
                        loaded_series = k
                    if h != loaded_hold:
                        at = (h * hold_blocks + hold_block) * holds.ROWS * hold_width
                        _load(w, _HOLD, holds.ROWS, hold_table, at, hold_width)
                        loaded_hold = h
                    _find(w, count_terms)
                    for i in range(skip, skip + count):
                        left += w[_STATUS, i] == RUNNING
                    _write(status, o1, o2, first, w, _STATUS, skip, count)
                    _write(time, o1, o2, first, w, _TIME, skip, count)
                    _write(stretch, o1, o2, first, w, _STRETCH, skip, count)
                    _write(internal, o1, o2, first, w, _INTERNAL, skip, count)
                    _write(field, o1, o2, first, w, _FIELD, skip, count)
                    _write(final, o1, o2, first, w, _HOLD + holds.FINAL, skip, count)
        return left

    types = (
        "float64[::1], int64[:, ::1], int64[:, ::1], int64[:, ::1], float64[::1], int64[:, ::1], int64, int64, int64, "
        "int64, int64, int8[:, :, ::1]" + 5 * ", float64[:, :, ::1]"
    )
    return Kernel(cells, types)
