"""Grids cut into parts of consecutive cells, for threads, for files on disk, for chunks within a file; and thinned."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Index = tuple[int | np.integer | slice, ...]


@dataclass(frozen=True)
class Cut:
    """A cut of a grid: each part is some of one dimension and all of those behind it.

    Attributes
    ----------
    shape : tuple of int
        Of the grid.
    axis : int
        The dimension that is cut, -1 where the grid is one part.
    rows : int
        How much of that dimension a part has; the last one may have less.

    Examples
    --------
    >>> parts = cut((3, 10), 4)
    >>> parts.count, parts.index(4), parts.cells(4)
    (9, (1, slice(4, 8, None)), slice(14, 18, None))
    """

    shape: tuple[int, ...]
    axis: int
    rows: int

    @property
    def count(self) -> int:
        """Number of parts."""
        return math.prod(self.shape[: self.axis]) * self._pieces if self.axis >= 0 else 1

    @property
    def _pieces(self) -> int:
        return -(-self.shape[self.axis] // self.rows)

    @property
    def part_shape(self) -> tuple[int, ...]:
        """Shape of a part, with every dimension of the grid; the last part may have less."""
        if self.axis < 0:
            return self.shape
        return (*(1 for _ in self.shape[: self.axis]), self.rows, *self.shape[self.axis + 1 :])

    def index(self, number: int) -> Index:
        """Where a part is in the grid."""
        if self.axis < 0:
            return ()
        lead, piece = divmod(number, self._pieces)
        end = min((piece + 1) * self.rows, self.shape[self.axis])
        return (*map(int, np.unravel_index(lead, self.shape[: self.axis])), slice(piece * self.rows, end))

    def cells(self, number: int) -> slice:
        """Where a part is in the flat order of the cells."""
        inner = math.prod(self.shape[self.axis + 1 :])
        if self.axis < 0:
            return slice(0, inner)
        lead, piece = divmod(number, self._pieces)
        first = lead * self.shape[self.axis]
        end = min((piece + 1) * self.rows, self.shape[self.axis])
        return slice((first + piece * self.rows) * inner, (first + end) * inner)

    @property
    def counts(self) -> tuple[int, ...]:
        """Number of parts along each dimension up to the one that is cut."""
        return (*self.shape[: self.axis], self._pieces) if self.axis >= 0 else ()


def cut(shape: tuple[int, ...], most: int) -> Cut:
    """Cut a grid into parts of at most so many cells, nearly equal ones.

    Parameters
    ----------
    shape : tuple of int
        Of the grid.
    most : int
        Cells of a part; at least 1.

    Returns
    -------
    Cut

    Examples
    --------
    >>> cut((3, 10), 4)
    Cut(shape=(3, 10), axis=1, rows=4)
    >>> cut((3, 10), 20).part_shape
    (2, 10)
    >>> cut((3, 10), 30)
    Cut(shape=(3, 10), axis=-1, rows=1)
    """
    axis, inner = len(shape) - 1, 1
    while axis >= 0 and shape[axis] * inner <= most:
        inner *= shape[axis]
        axis -= 1
    if axis < 0:
        return Cut(shape, -1, 1)
    return Cut(shape, axis, _evened(shape[axis], most // inner))


def _evened(number: int, most: int) -> int:
    """Return into how many each the fewest groups of at most so many take, of nearly equal size."""
    return -(-number // -(-number // most))


@dataclass(frozen=True)
class Blocks:
    """A cut of a grid into parts of whole chunks: each is some of every dimension that the chunks cut.

    Attributes
    ----------
    chunks : Cut
        The grid cut into chunks.
    sizes : tuple of int
        How many chunks a part has along each dimension of `Cut.counts`; the last ones may have less.

    Examples
    --------
    >>> parts = blocks(cut((4, 10), 3), 9, wide=0)
    >>> parts.sizes, parts.count
    ((2, 1), 8)
    >>> parts.index(1), parts.chunks_of(1)
    ((slice(0, 2, None), slice(3, 6, None)), ([1, 5], [slice(0, 3, None), slice(3, 6, None)]))
    """

    chunks: Cut
    sizes: tuple[int, ...]

    @property
    def _counts(self) -> tuple[int, ...]:
        return tuple(-(-number // size) for number, size in zip(self.chunks.counts, self.sizes, strict=True))

    @property
    def count(self) -> int:
        """Number of parts."""
        return math.prod(self._counts)

    def _ranges(self, number: int) -> list[range]:
        """Return which chunks of every dimension a part has."""
        at = map(int, np.unravel_index(number, self._counts))
        columns = zip(at, self.sizes, self.chunks.counts, strict=True)
        return [range(k * size, min((k + 1) * size, count)) for k, size, count in columns]

    def index(self, number: int) -> tuple[slice, ...]:
        """Where a part is in the grid."""
        columns = zip(self._ranges(number), self.chunks.part_shape, self.chunks.shape, strict=False)
        return tuple(slice(own.start * rows, min(own.stop * rows, length)) for own, rows, length in columns)

    def cells(self, number: int) -> int:
        """Return the number of cells of a part."""
        cut_dims = [own.stop - own.start for own in self.index(number)]
        return math.prod((*cut_dims, *self.chunks.shape[len(cut_dims) :]))

    def chunks_of(self, number: int) -> tuple[list[int], list[slice]]:
        """Return the numbers of the chunks of a part, and where they are among its cells."""
        ranges = self._ranges(number)
        if not ranges:
            return [0], [slice(0, self.cells(number))]
        numbers = np.ravel_multi_index(np.ix_(*ranges), self.chunks.counts).ravel()
        sizes = [own.stop - own.start for own in map(self.chunks.cells, map(int, numbers))]
        ends = np.cumsum(sizes)
        return numbers.tolist(), [slice(int(end) - size, int(end)) for end, size in zip(ends, sizes, strict=True)]


def blocks(chunks: Cut, most: int, wide: int | None = None) -> Blocks:
    """Cut a grid into parts of whole chunks, of at most so many cells where a chunk has no more.

    Parameters
    ----------
    chunks : Cut
        The grid cut into chunks.
    most : int
        Cells of a part.
    wide : int, optional
        A dimension of which parts have as much as they can; by default cells of a part are consecutive.

    Returns
    -------
    Blocks
    """
    room = max(1, most // max(1, math.prod(chunks.part_shape)))
    sizes = [1] * len(chunks.counts)
    first = [wide] if wide is not None and wide < len(sizes) else []
    for dim in (*first, *(dim for dim in reversed(range(len(sizes))) if dim not in first)):
        sizes[dim] = _evened(chunks.counts[dim], room)
        room //= sizes[dim]
    return Blocks(chunks, tuple(sizes))


def evenly(number: int, most: int) -> npt.NDArray[np.intp]:
    """Return at most so many indices below a number, evenly spread from the first to the last."""
    return np.linspace(0, number - 1, min(number, most)).round().astype(np.intp)
