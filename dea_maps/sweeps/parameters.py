"""One parameter of a sweep: what it may be, and its values on named dimensions."""

import numpy as np
import numpy.typing as npt
import xarray as xr
from xarray.indexes import PandasMultiIndex

from ..checks import brief
from ..nomenclature import KINDS, RESULTS, Kind, parameter

ParameterLike = npt.ArrayLike | xr.DataArray
"""A number, a 1-D array, or a DataArray that broadcasts by its dimensions."""


_KINDS = "a real number, a 1-D array of real numbers or an xarray.DataArray of them"


def check_values(name: str, values: npt.NDArray[np.float64], kind: Kind) -> None:
    """Check that every value of a parameter is finite and within the bounds of its kind.

    Parameters
    ----------
    name : str
        What it is called in the message.
    values : ndarray of float64, any shape
        Its values.
    kind : Kind
        One of `dea_maps.nomenclature.KINDS`.

    Raises
    ------
    ValueError
        With the first value that is not allowed.

    Examples
    --------
    >>> check_values("rate", np.array([1.0, 0.0]), KINDS["rate"])
    Traceback (most recent call last):
    ...
    ValueError: rate must be finite and above 0; got 0.0
    """
    allowed = kind.allows(values)
    if not allowed.all():
        raise ValueError(f"{name} must be {kind.limits}; got {values[~allowed].flat[0]}")


def as_data_array(name: str, value: ParameterLike | xr.Variable, kind: str, units: str = "1") -> xr.DataArray:
    """Check a parameter and put it on named dimensions.

    Parameters
    ----------
    name : str
        Its name.
    value : number, 1-D array or DataArray
        What the caller gave. A 1-D array gets a dimension of the parameter's own name.
    kind : str
        A key of `dea_maps.nomenclature.KINDS`.
    units : str
        What it is in: units of its own must be these.

    Returns
    -------
    DataArray of float64
        A copy, with the caller's coordinates and attributes, and ``long_name`` and ``units``.

    Raises
    ------
    TypeError
        If it is not made of real numbers, or a dimension is not named by a string.
    ValueError
        If a value is out of bounds or masked; if it has units other than `units`; if an array of several
        dimensions does not name them; if a dimension or coordinate has a name that the result needs.

    Examples
    --------
    >>> as_data_array("field", [1, 2], "field").dims
    ('field',)
    """
    given = value if isinstance(value, xr.DataArray | xr.Variable) else _as_array(name, value)
    raw = given if isinstance(given, np.ndarray) else given.values
    if raw.dtype.kind not in "iuf":
        raise TypeError(f"{name} must be {_KINDS}; got {brief(value)} of type {raw.dtype}")
    values = np.array(raw, dtype=np.float64)
    check_values(name, values, KINDS[kind])
    described = {"long_name": parameter(name, kind).long_name, "units": units}
    if given is raw:
        return xr.DataArray(values, dims=(name,) * raw.ndim, attrs=described)
    named = xr.DataArray(given)
    _check_coordinates(name, named, values)
    own = named.attrs.get("units", units)
    if own not in ({"", "1", "dimensionless"} if units == "1" else {units, units.replace(" s-1", "/s")}):
        wanted = "dimensionless, with units '1'" if units == "1" else f"in {units}"
        raise ValueError(f"{name} must be {wanted}; got units {own!r}")
    array = named.copy(data=values)
    array.attrs = {**described, **named.attrs, "units": units}
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
        raise ValueError(f"{name} must have no masked values; got a masked array")
    return array


def _check_coordinates(name: str, array: xr.DataArray, values: npt.NDArray[np.float64]) -> None:
    """Check the names of dimensions and coordinates that came with a parameter."""
    for key in (*array.dims, *array.coords):
        if not isinstance(key, str):
            raise TypeError(f"{name} must name its dimensions and coordinates by strings; got {key!r}")
        if key in RESULTS:
            raise ValueError(f"{name} has a dimension or coordinate {key!r}, a name that the result itself needs")
    if name in array.dims:
        if array.dims != (name,):
            raise ValueError(f"{name} can have the dimension {name!r} only alone; got dimensions {array.dims}")
        if name in array.coords and not np.array_equal(array.coords[name].values, values):
            raise ValueError(f"{name} differs from its coordinate {name!r}: give the dimension another name")
    if any(isinstance(index, PandasMultiIndex) for index in array.xindexes.values()):
        raise ValueError(f"{name} has a multi-index, which no file can hold: call its reset_index first")


def checked_times(time: npt.ArrayLike | xr.DataArray) -> xr.Variable:
    """Check the times, and put them on the dimension ``time``."""
    values = np.atleast_1d(np.asarray(time))
    if values.ndim != 1:
        raise ValueError(f"time must be a number or have one dimension; got an array of shape {values.shape}")
    if values.dtype.kind not in "iuf":
        raise TypeError(f"time must be made of real numbers; got {brief(time)}")
    allowed = np.isfinite(values) & (values >= 0.0)
    if not allowed.all():
        raise ValueError(f"time must be finite and at least 0; got {values[~allowed].flat[0]}")
    return xr.Variable("time", values.astype(np.float64))
