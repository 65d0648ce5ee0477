"""The grid of a sweep: parameters broadcast against each other by the names of their dimensions."""

import math
import re
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..checks import brief
from ..nomenclature import PARAMETERS, parameter
from ..programs import PROGRAMS, Program
from .dead_load import load_of, relaxed_threshold
from .parameters import ParameterLike, as_data_array

_THRESHOLD = {
    "long_name": "largest field that the relaxed film sustains under its dead load, "
    "normalised by that of the film without one",
    "units": "1",
}
_PLAIN = re.compile(r"[a-zA-Z]\w{0,99}", re.ASCII)
"""Names of dimensions that every NetCDF file takes: others are tried, which takes as long as many a sweep."""

FILM = ("modulus_ratio", "prestretch", "stress")
"""Parameters of the film and its dead load: the first always, the others at most one."""


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


def make_grid(program: Program, **given: ParameterLike | None) -> Grid:
    """Check the parameters of a sweep and broadcast them against each other.

    A number has no dimension, a 1-D array a dimension of its own name, a DataArray its own dimensions.
    Dimensions come in the order in which they first appear over the parameters of the program and those of the film.

    Parameters
    ----------
    program : Program
        The loading program.
    **given : number, 1-D array or DataArray
        The parameters that the program takes, and those of the film, see `FILM`; None counts as left out. All are
        dimensionless, see `dea_maps.nomenclature`. An empty array makes no cells.

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
    kinds = kinds_taken(program)
    values = {name: value for name, value in given.items() if value is not None}
    takes = f"{program.name!r}, which takes {' and '.join((*program.parameters, 'modulus_ratio'))}"
    for name in (*program.parameters, "modulus_ratio"):
        if name not in values:
            raise ValueError(f"{name} is missing for the program {takes}")
    for name, value in values.items():
        if name not in kinds:
            raise ValueError(f"{name} = {brief(value)} is not a parameter of the program {takes}")
    if "prestretch" in values and "stress" in values:
        raise ValueError("prestretch and stress must not both be given: either stands for the dead load")
    arrays = {name: as_data_array(name, values[name], kind) for name, kind in kinds.items() if name in values}
    sizes = _common_sizes(arrays)
    dims, shape = tuple(sizes), tuple(sizes.values())
    cells = math.prod(shape)
    if cells > np.iinfo(np.intp).max // np.dtype(np.float64).itemsize:
        product = " x ".join(map(str, shape))
        raise MemoryError(f"{product} = {cells:.3g} cells are more than an array can index: take fewer")
    parameters = {name: _broadcast(array.variable, dims, shape) for name, array in arrays.items()}
    coords = _common_coordinates(arrays, kinds)
    for name in ("prestretch", "stress"):
        if name in arrays:
            own = arrays[name].variable
            stress = load_of(own.values) if name == "prestretch" else own.values
            coords["relaxed_threshold"] = xr.Variable(own.dims, relaxed_threshold(stress), _THRESHOLD)
    return Grid(program, dims, shape, parameters, coords)


def kinds_taken(program: Program) -> dict[str, str]:
    """Return all parameters that a sweep under a program can have, and the kind of each, in the order of dimensions.

    Raises
    ------
    TypeError
        If it is no loading program.

    Examples
    --------
    >>> from dea_maps.programs import Ramp
    >>> kinds_taken(Ramp())
    {'rate': 'rate', 'modulus_ratio': 'ratio', 'prestretch': 'ratio', 'stress': 'stress'}
    """
    if not isinstance(program, Program):
        known = ", ".join(f"{cls.__name__}()" for cls in PROGRAMS.values())
        raise TypeError(f"program must be a loading program, one of {known}; got {brief(program)}")
    return {**program.kinds, **{name: PARAMETERS[name].kind for name in FILM}}


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
    own = variable.dims
    ordered = (variable.transpose(*(dim for dim in dims if dim in own)) if len(own) > 1 else variable).values
    return np.broadcast_to(ordered[tuple(slice(None) if dim in own else np.newaxis for dim in dims)], shape)


def _common_coordinates(arrays: dict[str, xr.DataArray], kinds: dict[str, str]) -> dict[str, xr.Variable]:
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
        own = name in arrays and variable.attrs == _own_attributes(name, kinds[name])
        plain = all(dim == name or (isinstance(dim, str) and _PLAIN.fullmatch(dim)) for dim in variable.dims)
        if not (own and plain):
            from .storable import check_storable

            check_storable(name, variable)
    return coords


def _own_attributes(name: str, kind: str) -> dict[str, str]:
    quantity = parameter(name, kind)
    return {"long_name": quantity.long_name, "units": quantity.units}


def _same(one: xr.Variable, other: xr.Variable) -> bool:
    return xr.DataArray(one).equals(xr.DataArray(other))


def _described(name: str, variable: xr.Variable) -> xr.Variable:
    """Return a coordinate with attributes; xarray itself writes the units of dates and the like."""
    units = {"units": "1"} if variable.dtype.kind in "biufcUS" else {}
    return xr.Variable(variable.dims, variable.data, {"long_name": name, **units, **variable.attrs})
