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

    def holding(self, cell: int) -> int:
        """Return the number of the part that holds a cell, counted in the flat order.

        Examples
        --------
        >>> [cut((3, 10), 4).holding(cell) for cell in (0, 3, 4, 10, 29)]
        [0, 0, 1, 3, 8]
        """
        if self.axis < 0:
            return 0
        inner = math.prod(self.shape[self.axis + 1 :])
        lead, rest = divmod(cell, self.shape[self.axis] * inner)
        return lead * self._pieces + rest // (self.rows * inner)


def cut(shape: tuple[int, ...], most: int, finer: Cut | None = None) -> Cut:
    """Cut a grid into parts of at most so many cells, nearly equal ones.

    Parameters
    ----------
    shape : tuple of int
        Of the grid.
    most : int
        Cells of a part; at least 1.
    finer : Cut, optional
        A cut into smaller parts, whose borders are to be kept; parts may then have more cells than `most`.

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
    length = shape[axis]
    rows = -(-length // -(-length // (most // inner)))
    if finer is not None and finer.axis == axis:
        rows = finer.rows * max(rows // finer.rows, 1)
    return Cut(shape, axis, rows)


def evenly(number: int, most: int) -> npt.NDArray[np.intp]:
    """Return at most so many indices below a number, evenly spread from the first to the last."""
    return np.linspace(0, number - 1, min(number, most)).round().astype(np.intp)
