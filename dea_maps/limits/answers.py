"""What the inverse questions share: broadcasting, root finding, and answers that say whether there is one."""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..checks import brief
from ..outcomes import Limit, Reason, flag_attributes
from ..sweeps.methods import LARGEST_RTOL
from ..sweeps.methods import SMALLEST_RTOL as _SMALLEST_OF_SWEEPS
from ..sweeps.parameters import ParameterLike

SMALLEST_RTOL = 1e-10
"""Of answers, which rest on sweeps and trajectories that are more accurate still."""

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.int8]
Cells = npt.NDArray[np.bool_]


def tight_rtol(rtol: float) -> float:
    """Return the accuracy of sweeps and trajectories that answer to ``rtol``, after checking it.

    Examples
    --------
    >>> tight_rtol(1e-6)
    1e-08
    """
    if isinstance(rtol, bool) or not isinstance(rtol, int | float):
        raise TypeError(f"rtol must be a number; got {brief(rtol)}")
    if not SMALLEST_RTOL <= rtol <= LARGEST_RTOL:
        raise ValueError(f"rtol must be from {SMALLEST_RTOL} to {LARGEST_RTOL}; got {brief(rtol)}")
    return max(0.01 * rtol, _SMALLEST_OF_SWEEPS)


def broadcast(**given: tuple[ParameterLike, float, bool]) -> tuple[xr.DataArray, ...]:
    """Check quantities, and broadcast them by the names of their dimensions.

    Parameters
    ----------
    **given : tuple
        By name: what was given, the lowest value allowed, and whether it may be infinite.

    Raises
    ------
    TypeError, ValueError
        If one is not made of numbers, or out of bounds.
    """
    arrays = []
    for name, (value, lowest, may_be_infinite) in given.items():
        if not isinstance(value, xr.DataArray) and np.ndim(value) > 1:
            raise ValueError(f"{name} must be a number, a 1-D array or a DataArray; got {brief(value)}")
        array = value if isinstance(value, xr.DataArray) else xr.DataArray(value, dims=[name] * np.ndim(value))
        if array.dtype.kind not in "iuf":
            raise TypeError(f"{name} must be made of real numbers; got {brief(value)}")
        array = array.astype(np.float64)
        good = (array >= lowest) & (np.isfinite(array) | may_be_infinite)
        if not good.all():
            what = "a number" if may_be_infinite else "finite and"
            raise ValueError(f"{name} must be {what} at least {lowest:g}; got {array.values[~good.values].flat[0]}")
        if value is not array and array.ndim == 1 and array.dims == (name,):
            array = array.assign_coords({name: array.values})
        arrays.append(array.rename(name))
    return xr.broadcast(*arrays)


def roots(
    function: Callable[..., Array],
    low: Array,
    high: Array,
    inner: Cells,
    arguments: tuple[Array, ...],
    **tolerance: float,
) -> tuple[Array, Flags]:
    """Find the roots of a function where there is one, by Chandrupatla's method, all cells side by side.

    Parameters
    ----------
    function : callable
        Of points and arguments.
    low, high : (n,) ndarray
        Where its values have opposite signs.
    inner : (n,) ndarray of bool
        Where a root is looked for.
    arguments : tuple of (n,) ndarray
        What else it takes.
    **tolerance : float
        ``xatol`` or ``xrtol``, of the points.

    Returns
    -------
    found : (n,) ndarray
        NaN where none was looked for.
    reason : (n,) ndarray of int8
        Of `Reason`: answered or unresolved.

    Examples
    --------
    >>> one = np.ones(1)
    >>> roots(lambda x, a: x * x - a, 0 * one, 2 * one, one > 0, (2 * one,), xrtol=1e-12)[0].round(6).tolist()
    [1.414214]
    """
    found, reason = np.full(inner.shape, np.nan), np.zeros(inner.shape, np.int8)
    if inner.any():
        from scipy.optimize import elementwise  # here: a first small sweep needs no roots

        tolerances: dict[str, Any] = {"xatol": 0.0, "xrtol": 0.0, "fatol": 0.0, "frtol": 0.0, **tolerance}
        own = tuple(argument[inner] for argument in arguments)
        result = elementwise.find_root(function, (low[inner], high[inner]), args=own, tolerances=tolerances)
        found[inner] = result.x
        reason[inner] = np.where(result.success, Reason.ANSWERED, Reason.UNRESOLVED)
    return found, reason


def answer(
    name: str, values: Array, reason: Flags, like: xr.DataArray, long_name: str, limit: Flags | None = None
) -> xr.Dataset:
    """Wrap an answer as a data set.

    Parameters
    ----------
    name : str
        Of the answer.
    values, reason, limit : (n,) ndarray
        The answer, whether there is one, and what limits it; no limit where breakdown was not asked about.
    like : DataArray
        Of n values, whose dimensions and coordinates it gets.
    long_name : str
        What the answer is.
    """
    found = np.where(reason == Reason.ANSWERED, values, np.nan)
    about = {"long_name": f"whether there is an answer for {name}", "units": "1"}
    ds = xr.Dataset(
        {
            name: (like.dims, found.reshape(like.shape), {"long_name": long_name, "units": "1"}),
            "reason": (like.dims, reason.reshape(like.shape), {**about, **flag_attributes(Reason)}),
        },
        dict(like.coords),
    )
    if limit is not None:
        about = {"long_name": f"what limits {name}", "units": "1"}
        ds["limit"] = (like.dims, limit.reshape(like.shape), {**about, **flag_attributes(Limit)})
    return ds
