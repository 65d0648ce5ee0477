"""Product grids under a ramp and a hold: tables first, then any part of the grid from them.

All that a cell is made of depends on its own parameters and on rtol: the same bits whatever part of the grid is asked
for, in whatever order of the dimensions, and on however many threads.
"""

import itertools
import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._jit import Kernel
from ..build import sweep_for
from ..lane_state import RUNNING
from ..sweep import LANES, RESULTS
from . import holds, series
from .cells import make_cells, make_pack
from .chebyshev import MOST_TERMS, NODES, TO_SERIES

# Series computed at a time.
CHUNK = 4096
# Relative errors from which on series are used; rounding fills their last terms below.
SMALLEST_RTOL = 1e-10
# Fields from which on a series for them all costs less than their cells one by one (studies/throughput).
FEWEST_FIELDS = 16

# Values of a dimension in a tile, where the others have more.
FEW = 64

# Terms of a series for each digit of the results, seldom exceeded.
TERMS_OF_DIGIT = 4.5

Work = Callable[[int], int]
Each = Callable[[Work, range], object]
Floats = NDArray[np.float64]


def pays(fields: int, rtol: float) -> bool:
    """Whether a grid that is a product with so many fields is better computed by series over the field.

    Parameters
    ----------
    fields : int
        Number of fields of the whole grid that reach Ec, or more.
    rtol : float
        Relative error of the results.
    """
    return fields >= FEWEST_FIELDS and rtol >= SMALLEST_RTOL


class _Table(NamedTuple):
    """Blocks of lanes, or of one, one behind the other; see `cells.make_cells`."""

    data: Floats
    offset: NDArray[np.int64]
    terms: NDArray[np.int64]
    width: int


def table_bytes(dims: Sequence[str], shape: Sequence[int], rtol: float) -> int:
    """Estimate the memory of the tables of a product grid, ``dims`` of lengths ``shape``, at an accuracy."""
    last = dims[max(range(3), key=lambda k: (shape[k] > 1, k))]
    sizes = dict(zip(dims, shape, strict=True))
    sizes[last] = -(-sizes[last] // LANES) * LANES
    terms = series.HEAD + TERMS_OF_DIGIT * -np.log10(rtol)
    return int(8 * sizes["modulus_ratio"] * (sizes["rate"] * terms + sizes["field"] * holds.ROWS))


class Kernels(NamedTuple):
    """What product grids are computed by."""

    find_series: Kernel
    pack: Kernel
    holds: Kernel
    cells: Kernel


@cache
def kernels() -> Kernels:
    """Return the kernels of product grids."""
    return Kernels(series.make_series(), make_pack(), holds.make_holds(), make_cells())


def _in_turn(work: Work, numbers: range) -> None:
    for number in numbers:
        work(number)


def _make_series_table(rate: Floats, modulus_ratio: Floats, width: int, rtol: float, each: Each) -> _Table:
    """Series of pairs (outer, inner), packed into blocks along the inner dimension."""
    own = kernels()
    outer, inner = rate.shape
    rows = max(CHUNK // inner, 1)
    starts = range(0, outer, rows)
    blocks = -(-inner // width)
    pieces = [np.empty(0)] * len(starts)
    terms = np.empty((outer, blocks), np.int64)

    def work(number: int) -> int:
        part = slice(starts[number], starts[number] + rows)
        rates, ratios = rate[part].ravel(), modulus_ratio[part].ravel()
        head = np.empty((rates.size, series.HEAD))
        found = np.empty((rates.size, MOST_TERMS))
        count = np.empty(rates.size, np.int64)
        own.find_series(rates, ratios, rtol, NODES, TO_SERIES, head, found, count)
        table = np.empty(terms[part].size * (series.HEAD + MOST_TERMS) * width)
        size = own.pack(head, found, count, inner, width, terms[part], table)
        pieces[number] = table[:size].copy()
        return int(rates.size)

    each(work, range(len(starts)))
    sizes = (series.HEAD + terms.ravel()) * width
    offset = np.cumsum(sizes) - sizes
    table = np.empty(sizes.sum())
    end = 0
    for number, piece in enumerate(pieces):  # one after the other is freed: never two tables in memory
        table[end : end + piece.size] = piece
        end += piece.size
        pieces[number] = np.empty(0)
    return _Table(table, offset.reshape(outer, blocks), terms, width)


def _make_hold_table(field: Floats, modulus_ratio: Floats, width: int) -> Floats:
    table = np.empty(field.shape[0] * -(-field.shape[1] // width) * width * holds.ROWS)
    kernels().holds(field, modulus_ratio, width, table)
    return table


class ProductGrid:
    """A grid field x rate x modulus_ratio, ready to be evaluated part by part.

    Parameters
    ----------
    dims : sequence of str
        "field", "rate", "modulus_ratio" in the order of the result's dimensions.
    axes : sequence of (n,) ndarray
        Their values, valid, in the same order.
    rtol : float
        Relative error of the results, at least `SMALLEST_RTOL`.
    attempts : int
        Bound on the attempted steps of a cell that its series leaves out.
    each : callable, optional
        ``each(work, numbers)`` calls ``work`` with every number, in any order, on any number of threads.
    prepare : callable, optional
        Compiles the solver of a single cell. That takes as long as all else that a product grid needs, and few grids
        have a cell that is left to it: it is called when the first one is met.
    """

    def __init__(
        self,
        dims: Sequence[str],
        axes: Sequence[Floats],
        rtol: float,
        attempts: int,
        each: Each = _in_turn,
        prepare: Callable[[Kernel], object] = Kernel.prepare,
    ) -> None:
        self._prepare = prepare
        self.dims, self.rtol, self.attempts = tuple(dims), rtol, attempts
        self.shape = tuple(axis.size for axis in axes)
        # Dimensions of a single value go first: lanes are along the last one.
        self._order = sorted(range(3), key=lambda k: (self.shape[k] > 1, k))
        self._dims = [dims[k] for k in self._order]
        self._axes = [np.ascontiguousarray(axes[k], dtype=np.float64) for k in self._order]
        last = self._dims[-1]
        values = dict(zip(self._dims, self._axes, strict=True))
        outer = {
            name: [other for other in pair if other != last]
            for name, pair in (("series", ("rate", "modulus_ratio")), ("hold", ("field", "modulus_ratio")))
        }
        self._outer = {name: sorted(pair, key=self._dims.index) for name, pair in outer.items()}
        own = {name: self._spread(names, values, last) for name, names in self._outer.items()}
        width = {"series": 1 if last == "field" else LANES, "hold": 1 if last == "rate" else LANES}
        self._series = _make_series_table(
            own["series"]["rate"], own["series"]["modulus_ratio"], width["series"], rtol, each
        )
        self._hold = _make_hold_table(own["hold"]["field"], own["hold"]["modulus_ratio"], width["hold"])
        self._hold_width = width["hold"]
        self._hold_blocks = 1 if width["hold"] == 1 else -(-self._axes[-1].size // LANES)

    @staticmethod
    def _spread(names: list[str], values: dict[str, Floats], last: str) -> dict[str, Floats]:
        """Values of the parameters of a table, each (outer, inner); inner is the last dimension, if it has it."""
        has_last = len(names) < 2
        every = [*names, last] if has_last else names
        mesh = np.meshgrid(*(values[name] for name in every), indexing="ij")
        columns = values[last].size if has_last else 1
        return {name: np.ascontiguousarray(array.reshape(-1, columns)) for name, array in zip(every, mesh, strict=True)}

    def _number(self, names: list[str], ranges: dict[str, NDArray[np.int64]]) -> NDArray[np.int64]:
        """Outer numbers in a table of the cells of the first two dimensions."""
        sizes = dict(zip(self._dims, (axis.size for axis in self._axes), strict=True))
        number = np.zeros((1, 1), np.int64)
        for name in names:
            axis = self._dims.index(name)
            number = number * sizes[name] + np.expand_dims(ranges[name], 1 - axis)
        shape = tuple(ranges[name].size for name in self._dims[:2])
        return np.array(np.broadcast_to(number, shape), order="C")

    def tiles(self, shape: Sequence[int], most: int) -> list[tuple[slice, ...]]:
        """Cut a part of the grid, of some shape, into tiles of at most so many cells that read little from memory.

        In a tile about as many fields share a series as pairs of the others share what a field says.
        """
        of_dim = dict(zip(self._dims, (shape[k] for k in self._order), strict=True))
        last, size = self._dims[-1], dict.fromkeys(self._dims, 1)
        few = ((last, most if last == "field" else FEW), ("field", FEW))
        for name, longest in (*few, *((name, most) for name in reversed(self._dims))):
            room = most // (math.prod(size.values()) // size[name])
            size[name] = max(size[name], min(of_dim[name], longest, room))
        cuts = (
            [slice(first, min(first + size[name], of_dim[name])) for first in range(0, of_dim[name], size[name])]
            for name in self.dims
        )
        return list(itertools.product(*cuts))

    def evaluate(self, part: Sequence[slice], status: NDArray[np.int8], results: Sequence[Floats]) -> int:
        """Compute a part of the grid.

        Parameters
        ----------
        part : sequence of slice
            Of every dimension, in the order of the result, with start and stop.
        status : ndarray of int8
            Of the shape of the part, contiguous: outcomes as in `lane_state.py`.
        results : sequence of ndarray of float64
            Rows of the result of a sweep, as in `sweep.py`, contiguous, of the shape of the part.

        Returns
        -------
        int
            How many cells took the solver of a single cell.
        """
        bounds = [slice(*part[k].indices(self.shape[k])) for k in self._order]
        ranges = {name: np.arange(own.start, own.stop) for name, own in zip(self._dims, bounds, strict=True)}
        shape = tuple(own.stop - own.start for own in bounds)
        views = [result.reshape(shape) for result in results]
        verdicts = status.reshape(shape)
        left = kernels().cells(
            self._series.data, self._series.offset, self._series.terms, self._number(self._outer["series"], ranges),
            self._hold, self._number(self._outer["hold"], ranges), self._hold_blocks, self._hold_width,
            self._series.width, bounds[-1].start, bounds[-1].stop, verdicts, *views,
        )  # fmt: skip
        if left:
            self._solve_singly(verdicts, views, bounds)
        return int(left)

    def _solve_singly(self, status: NDArray[np.int8], results: list[Floats], bounds: list[slice]) -> None:
        """Solve the cells that are left, each on its own."""
        where = np.nonzero(status == RUNNING)
        columns = {
            name: axis[own][index] for name, axis, own, index in zip(self._dims, self._axes, bounds, where, strict=True)
        }
        found = np.empty((RESULTS, where[0].size))
        verdict = np.empty(where[0].size, np.int8)
        solve = sweep_for("ramp_hold", "area", "dop853")
        self._prepare(solve)
        given = (columns["field"], columns["rate"], columns["modulus_ratio"])
        solve(*given, self.rtol, 0.0, self.attempts, verdict, found)
        status[where] = verdict
        for result, row in zip(results, found, strict=True):
            result[where] = row
