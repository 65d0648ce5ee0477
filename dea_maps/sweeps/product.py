"""Sweeps that are a product field x rate x modulus_ratio under a ramp and a hold: their axes, and parts of them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..programs import Program, shape_of
from .chunks import Index
from .dead_load import has_dead_load

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Product:
    """A part of a product grid.

    Attributes
    ----------
    dims : tuple of str
        "field", "rate" and "modulus_ratio" in the order of the grid's dimensions.
    axes : tuple of (n,) ndarray
        Their values along the whole grid, in the same order; one value where the grid has no such dimension.
    part : tuple of slice
        The part of every axis.
    """

    dims: tuple[str, ...]
    axes: tuple[Array, ...]
    part: tuple[slice, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the part."""
        return tuple(own.stop - own.start for own in self.part)

    @property
    def fields(self) -> int:
        """Number of fields of the whole grid under which a relaxed film fails."""
        return int(np.count_nonzero(self.axes[self.dims.index("field")] >= 1.0))

    def alone(self) -> "Product":
        """Return the part as a grid of its own."""
        axes = tuple(axis[own] for axis, own in zip(self.axes, self.part, strict=True))
        return Product(self.dims, axes, tuple(slice(0, axis.size) for axis in axes))


def product_of(program: Program, parameters: Mapping[str, Array], index: Index = ()) -> Product | None:
    """Return a part of a sweep as one of a product grid; None if the sweep is not one.

    It is one under a ramp and a hold whose field and rate are parameters, without a dead load, if each of these and of
    ``modulus_ratio`` varies along at most one dimension, which is its own.

    Parameters
    ----------
    program : Program
        The loading program.
    parameters : mapping of str to ndarray
        Of the whole sweep, of one shape with cells, with stride zero along dimensions on which they do not depend.
    index : tuple of int and slice, optional
        Where the part is; by default all.

    Examples
    --------
    >>> from dea_maps.programs import RampHold
    >>> from dea_maps.sweeps.grid import make_grid
    >>> grid = make_grid(RampHold(), field=[1.1, 1.2], rate=[1.0, 2.0, 5.0], modulus_ratio=4.0)
    >>> product = product_of(grid.program, grid.parameters, (1,))
    >>> product.dims, product.shape
    (('modulus_ratio', 'field', 'rate'), (1, 1, 3))
    """
    shape = shape_of(program)
    if shape is None or shape.name != "ramp_hold" or has_dead_load(parameters):
        return None
    if not (isinstance(shape.field, str) and isinstance(shape.rate, str)):
        return None
    along: dict[str, int] = {}
    axes: dict[str, Array] = {}
    for dim, name in (("field", shape.field), ("rate", shape.rate), ("modulus_ratio", "modulus_ratio")):
        array = parameters[name]
        own = [k for k in range(array.ndim) if array.shape[k] > 1 and array.strides[k] != 0]
        if len(own) > 1 or (own and own[0] in along.values()):
            return None
        along[dim] = own[0] if own else -1
        axes[dim] = np.array(array[tuple(slice(None) if k in own else 0 for k in range(array.ndim))], ndmin=1)
    dims = tuple(sorted(along, key=along.__getitem__))
    return Product(dims, tuple(axes[dim] for dim in dims), tuple(_part(index, along[d], axes[d].size) for d in dims))


def _part(index: Index, axis: int, size: int) -> slice:
    """Return the part of an axis, the dimension ``axis`` of the grid, -1 where it has none."""
    own = index[axis] if 0 <= axis < len(index) else slice(None)
    return slice(*own.indices(size)[:2]) if isinstance(own, slice) else slice(int(own), int(own) + 1)
