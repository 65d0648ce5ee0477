"""The grid of a sweep: parameters broadcast against each other by the names of their dimensions."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..checks import brief
from ..nomenclature import cf_attributes
from ..programs import PROGRAMS, Program
from .parameters import ParameterLike, as_data_array


@dataclass(frozen=True, eq=False)
class Grid:
    """The cells of a sweep.

    Attributes
    ----------
    program : Program
        The loading program.
    dims : tuple of str
        Names of the dimensions, in order.
    shape : tuple of int
        Their lengths.
    parameters : dict of str to ndarray of float64, each of `shape`
        The parameters of the program and ``modulus_ratio``, dimensionless: read-only views, no copy per cell.
    coords : dict of str to xarray.Variable
        The parameters along their own dimensions and the further coordinates that came with them.
    """

    program: Program
    dims: tuple[str, ...]
    shape: tuple[int, ...]
    parameters: dict[str, npt.NDArray[np.float64]]
    coords: dict[str, xr.Variable]

    @property
    def cells(self) -> int:
        """Number of cells; 1 for a grid without dimensions."""
        return math.prod(self.shape)


def make_grid(
    program: Program,
    *,
    modulus_ratio: ParameterLike | None,
    field: ParameterLike | None = None,
    rate: ParameterLike | None = None,
) -> Grid:
    """Check the parameters of a sweep and broadcast them against each other.

    A number has no dimension, a 1-D array a dimension of its own name, a DataArray its own dimensions.
    Dimensions come in the order in which they first appear over `field`, `rate`, `modulus_ratio`.

    Parameters
    ----------
    program : Program
        The loading program.
    modulus_ratio, field, rate : number, 1-D array or DataArray
        What the program takes; dimensionless, see `dea_maps.nomenclature`. An empty array makes no cells.

    Returns
    -------
    Grid

    Raises
    ------
    TypeError
        If `program` is not a loading program, or a parameter is not made of real numbers.
    ValueError
        If a parameter is missing, not taken by the program or refused by
        `dea_maps.sweeps.parameters.as_data_array`; if parameters that share a dimension differ in its length or its
        coordinate; if a coordinate has attributes that a file would not give back.
    MemoryError
        If there are more cells than an array can index.

    Examples
    --------
    >>> from dea_maps.programs import RampHold
    >>> grid = make_grid(RampHold(), field=[1.1, 1.2, 1.3], rate=1.0, modulus_ratio=[3.85, 4.0])
    >>> grid.dims, grid.shape
    (('field', 'modulus_ratio'), (3, 2))
    """
    if not isinstance(program, Program):
        known = ", ".join(f"{cls.__name__}()" for cls in PROGRAMS.values())
        raise TypeError(f"program must be a loading program, one of {known}; got {brief(program)}")
    given = {"field": field, "rate": rate, "modulus_ratio": modulus_ratio}
    taken = (*program.parameters, "modulus_ratio")
    takes = f"{program.name!r}, which takes {' and '.join(taken)}"
    for name, value in given.items():
        if value is None and name in taken:
            raise ValueError(f"{name} is missing for the program {takes}")
        if value is not None and name not in taken:
            raise ValueError(f"{name} = {brief(value)} is not a parameter of the program {takes}")
    arrays = {name: as_data_array(name, value) for name, value in given.items() if value is not None}
    sizes = _common_sizes(arrays)
    dims, shape = tuple(sizes), tuple(sizes.values())
    cells = math.prod(shape)
    if cells > np.iinfo(np.intp).max // np.dtype(np.float64).itemsize:
        product = " x ".join(map(str, shape))
        raise MemoryError(f"{product} = {cells:.3g} cells are more than an array can index: take fewer")
    parameters = {name: _broadcast(array.variable, dims, shape) for name, array in arrays.items()}
    return Grid(program, dims, shape, parameters, _common_coordinates(arrays))


def _common_sizes(arrays: dict[str, xr.DataArray]) -> dict[str, int]:
    """Return the length of every dimension, after checking that the parameters along it agree."""
    sizes: dict[str, int] = {}
    owners: dict[str, str] = {}
    indexes: dict[str, xr.Variable] = {}
    for name, array in arrays.items():
        for dim, size in zip(map(str, array.dims), array.shape, strict=True):
            owner = owners.setdefault(dim, name)
            if sizes.setdefault(dim, size) != size:
                raise ValueError(
                    f"{owner} and {name} must have the same length along their common dimension {dim!r}; "
                    f"got {sizes[dim]} and {size}"
                )
            if dim in arrays and dim not in arrays[dim].dims:
                raise ValueError(f"{name} has a dimension {dim!r}, along which {dim} itself must then be given")
            if dim in array.coords:
                index = array.coords[dim].variable
                if not _same(indexes.setdefault(dim, index), index):
                    raise ValueError(
                        f"{owner} and {name} must have the same coordinate along their common dimension "
                        f"{dim!r}; got {brief(indexes[dim].values)} and {brief(index.values)}"
                    )
    return sizes


def _broadcast(variable: xr.Variable, dims: tuple[str, ...], shape: tuple[int, ...]) -> npt.NDArray[np.float64]:
    """Return a read-only view of `shape`, with stride zero along the dimensions that the variable lacks."""
    ordered = variable.transpose(*(dim for dim in dims if dim in variable.dims)).values
    return np.broadcast_to(ordered[tuple(slice(None) if dim in variable.dims else np.newaxis for dim in dims)], shape)


def _common_coordinates(arrays: dict[str, xr.DataArray]) -> dict[str, xr.Variable]:
    """Return the parameters and their further coordinates, less the conflicting ones, as xarray does."""
    coords = {name: array.variable.to_base_variable() for name, array in arrays.items()}
    further: dict[str, xr.Variable] = {}
    conflicting = set()
    for array in arrays.values():
        for key, coord in array.coords.items():
            name, variable = str(key), coord.variable.to_base_variable()
            if name not in arrays and not _same(further.setdefault(name, variable), variable):
                conflicting.add(name)
    for name, variable in further.items():
        if name not in conflicting:
            coords[name] = _described(name, variable)
    for name, variable in coords.items():
        if not (name in arrays and variable.attrs == cf_attributes(name) and set(variable.dims) <= {name}):
            from .storable import check_storable

            check_storable(name, variable)
    return coords


def _same(one: xr.Variable, other: xr.Variable) -> bool:
    return xr.DataArray(one).equals(xr.DataArray(other))


def _described(name: str, variable: xr.Variable) -> xr.Variable:
    """Return a coordinate with attributes; xarray itself writes the units of dates and the like."""
    units = {"units": "1"} if variable.dtype.kind in "biufcUS" else {}
    return xr.Variable(variable.dims, variable.data, {"long_name": name, **units, **variable.attrs})
