"""One parameter of a sweep: what it may be, and its values on named dimensions."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr
from xarray.indexes import PandasMultiIndex

from ..checks import brief
from ..nomenclature import NOMENCLATURE, PARAMETERS, cf_attributes

ParameterLike = npt.ArrayLike | xr.DataArray
"""A number, a 1-D array, or a DataArray that broadcasts by its dimensions."""


class Bound(NamedTuple):
    """The smallest value of a parameter.

    Attributes
    ----------
    lowest : float
        The bound.
    included : bool
        Whether the bound itself is allowed.
    """

    lowest: float
    included: bool


BOUNDS: Mapping[str, Bound] = MappingProxyType(
    {
        "field": Bound(0.0, included=True),
        "rate": Bound(0.0, included=False),
        "modulus_ratio": Bound(1.0, included=True),
    }
)
"""What each parameter may be, beside finite."""

_RESERVED = NOMENCLATURE.keys() - PARAMETERS.keys()
_KINDS = "a real number, a 1-D array of real numbers or an xarray.DataArray of them"


def check_values(name: str, values: npt.NDArray[np.float64], bound: Bound | None = None) -> None:
    """Check that every value of a parameter is finite and within its bound.

    Parameters
    ----------
    name : str
        A key of `BOUNDS`, or another name and its bound.
    values : ndarray of float64, any shape
        Its values.
    bound : Bound, optional
        By default that of the parameter.

    Raises
    ------
    ValueError
        With the first value that is not allowed.

    Examples
    --------
    >>> check_values("rate", np.array([1.0, 0.0]))
    Traceback (most recent call last):
    ...
    ValueError: rate must be finite and above 0; got 0.0
    """
    lowest, included = bound or BOUNDS[name]
    allowed = np.isfinite(values) & (values >= lowest if included else values > lowest)
    if not allowed.all():
        limit = f"{'at least' if included else 'above'} {lowest:g}"
        raise ValueError(f"{name} must be finite and {limit}; got {values[~allowed].flat[0]}")


def as_data_array(name: str, value: ParameterLike | xr.Variable) -> xr.DataArray:
    """Check a parameter and put it on named dimensions.

    Parameters
    ----------
    name : str
        A key of `BOUNDS`.
    value : number, 1-D array or DataArray
        What the caller gave. A 1-D array gets a dimension of the parameter's own name.

    Returns
    -------
    DataArray of float64
        A copy, with the caller's coordinates and attributes, and ``long_name`` and ``units``.

    Raises
    ------
    TypeError
        If it is not made of real numbers, or a dimension is not named by a string.
    ValueError
        If a value is out of bounds or masked; if it has units other than "1"; if an array of several
        dimensions does not name them; if a dimension or coordinate has a name that the result needs.

    Examples
    --------
    >>> as_data_array("field", [1, 2]).dims
    ('field',)
    """
    given = value if isinstance(value, xr.DataArray | xr.Variable) else _as_array(name, value)
    raw = given if isinstance(given, np.ndarray) else given.values
    if raw.dtype.kind not in "iuf":
        raise TypeError(f"{name} must be {_KINDS}; got {brief(value)} of type {raw.dtype}")
    named = xr.DataArray(raw, dims=(name,) * raw.ndim) if given is raw else xr.DataArray(given)
    values = np.array(raw, dtype=np.float64)
    check_values(name, values)
    _check_coordinates(name, named, values)
    units = named.attrs.get("units", "1")
    if units not in {"", "1", "dimensionless"}:
        raise ValueError(f"{name} must be dimensionless, with units '1'; got units {units!r}")
    array = named.copy(data=values)
    array.attrs = {**cf_attributes(name), **named.attrs, "units": "1"}
    return array


def _as_array(name: str, value: npt.ArrayLike) -> npt.NDArray[np.generic]:
    try:
        array = np.asarray(value)
    except ValueError:  # a list with lists of unequal lengths
        raise TypeError(f"{name} must be {_KINDS}; got {brief(value)}") from None
    if isinstance(value, list | tuple):
        if any(isinstance(item, bool | np.bool_) for item in value):  # numpy takes True for 1.0 among numbers
            raise TypeError(f"{name} must be {_KINDS}; got {brief(value)} with a bool")
        if not value:
            array = array.astype(np.float64)
    if array.ndim > 1:
        raise ValueError(
            f"{name} must be a number or a 1-D array; got an array of shape {array.shape}, "
            "whose dimensions only an xarray.DataArray can name"
        )
    if np.ma.is_masked(value):
        raise ValueError(f"{name} must have a value at every place; got a masked array with gaps")
    return array


def _check_coordinates(name: str, array: xr.DataArray, values: npt.NDArray[np.float64]) -> None:
    """Check the names of dimensions and coordinates that came with a parameter."""
    for key in (*array.dims, *array.coords):
        if not isinstance(key, str):
            raise TypeError(f"{name} must name its dimensions and coordinates by strings; got {key!r}")
        if key in _RESERVED:
            raise ValueError(f"{name} has a dimension or coordinate {key!r}, a name that the result itself needs")
    if name in array.dims:
        if array.dims != (name,):
            raise ValueError(f"{name} can have the dimension {name!r} only alone; got dimensions {array.dims}")
        if name in array.coords and not np.array_equal(array.coords[name].values, values):
            raise ValueError(f"{name} differs from its coordinate {name!r}: give the dimension another name")
    if any(isinstance(index, PandasMultiIndex) for index in array.xindexes.values()):
        raise ValueError(f"{name} has a multi-index, which no file can hold: call its reset_index first")
