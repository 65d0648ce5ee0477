"""Inverse questions, answered by root finding on the kernels: how hard may a film be driven, how far does it get.

Every answer is a data set with the answer itself and ``reason``, a flag that says whether there is one.
"""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy.optimize import elementwise

from .catalogue import LARGEST_RTOL, SMALLEST_RTOL
from .parameters import ParameterLike, brief
from .programs import Ramp, Step
from .sweeping import sweep
from .trajectories import trajectory

Array = npt.NDArray[np.float64]

REASONS = ("answered", "always", "never", "beyond_rates", "unresolved")
"""Words for the values 0, 1, 2, ... of ``reason``."""
_ANSWERED, _ALWAYS, _NEVER, _BEYOND, _UNRESOLVED = range(len(REASONS))
SLOWEST, FASTEST = 1e-6, 1e5
"""Ramp rates among which `allowable_rate` looks, in critical fields per relaxation time."""


def allowable_field(lifetime: ParameterLike, modulus_ratio: ParameterLike, rtol: float = 1e-6) -> xr.Dataset:
    """Find the largest constant field that a film outlasts for a given time.

    The time to failure under a constant field falls from infinity, just above the relaxed critical field, to zero at
    ``sqrt(modulus_ratio)``, (23) and (26) of Zhao, Koh and Suo (2011).

    Parameters
    ----------
    lifetime : number, 1-D array or DataArray
        In relaxation times, at least 0; may be infinite.
    modulus_ratio : number, 1-D array or DataArray
        As in `dea_maps.sweep`.
    rtol : float
        Relative error allowed in the field, from 1e-10 to 1e-3.

    Returns
    -------
    Dataset
        ``allowable_field`` over the relaxed critical field: the film fails after `lifetime`, and under any larger field
        sooner; ``reason``.

    Raises
    ------
    TypeError, ValueError
        If something is of the wrong kind or out of bounds.

    Examples
    --------
    >>> round(allowable_field(2.443625636, 4.0, rtol=1e-9).allowable_field.item(), 7)
    1.2
    """
    life, ratio = _broadcast(lifetime=(lifetime, 0.0, True), modulus_ratio=(modulus_ratio, 1.0, False))
    tight = _tight(rtol)
    m, wanted = np.maximum(ratio.values, 1.0), life.values
    top = np.sqrt(m)

    def field_of(s: Array, m: Array) -> Array:
        return 1.0 + (np.sqrt(m) - 1.0) * s * s  # the time to failure grows like 1/s

    def outlasts(s: Array, m: Array, wanted: Array) -> Array:
        time = _swept(Step(), tight, field=field_of(s, m), modulus_ratio=m).time_to_failure.values
        return np.where(np.isnan(time), 0.5, time / (time + wanted) - 0.5)

    inner = np.isfinite(wanted) & (wanted > 0.0) & (m > 1.0)
    found = np.where(np.isinf(wanted) | (m == 1.0), 1.0, top)
    s, reason = _roots(outlasts, np.zeros_like(m), np.ones_like(m), inner, (m, wanted), rtol)
    found = np.where(inner, field_of(s, m), found)
    return _answer("allowable_field", found, reason, life, "largest constant field that a film outlasts for lifetime")


def allowable_rate(stretch: ParameterLike, modulus_ratio: ParameterLike, rtol: float = 1e-6) -> xr.Dataset:
    """Find the fastest ramp under which a film gets to a given stretch before it fails.

    The stretch at failure falls with the ramp rate, to ``2**(1/3)``.

    Parameters
    ----------
    stretch : number, 1-D array or DataArray
        At least 1.
    modulus_ratio : number, 1-D array or DataArray
        As in `dea_maps.sweep`.
    rtol : float
        Relative error allowed in the rate, from 1e-10 to 1e-3; where the stretch hardly depends on it, in the stretch.

    Returns
    -------
    Dataset
        ``allowable_rate`` in relaxed critical fields per relaxation time; ``reason``: "always" where any rate will do,
        "never" where none, "beyond_rates" where the answer is not from 1e-6 to 1e5. NaN there.

    Raises
    ------
    TypeError, ValueError
        If something is of the wrong kind or out of bounds.

    Examples
    --------
    >>> round(allowable_rate(1.423228766, 4.0, rtol=1e-9).allowable_rate.item(), 6)
    1.0
    """
    aim, ratio = _broadcast(stretch=(stretch, 1.0, False), modulus_ratio=(modulus_ratio, 1.0, False))
    tight = _tight(rtol)
    m, wanted = ratio.values, aim.values

    def reaches(log_rate: Array, m: Array, wanted: Array) -> Array:
        ds = _swept(Ramp(), tight, rate=np.exp(log_rate), modulus_ratio=m)
        return np.asarray(ds.critical_stretch.values / wanted - 1.0)

    low, high = np.full_like(m, np.log(SLOWEST)), np.full_like(m, np.log(FASTEST))
    slow, fast = reaches(low, m, wanted), reaches(high, m, wanted)
    # Just above the relaxed critical field, a constant one lets the film get as far as the slowest ramp.
    farthest = _swept(Step(), tight, field=np.full_like(m, np.nextafter(1.0, 2.0)), modulus_ratio=m).critical_stretch
    always = wanted <= 2.0 ** (1.0 / 3.0)
    inner = (slow > 0.0) & (fast < 0.0) & ~always
    log_rate, reason = _roots(reaches, low, high, inner, (m, wanted), rtol)
    never = wanted >= np.where(m == 1.0, 2.0 ** (1.0 / 3.0), farthest.values)
    outside = np.where(always, _ALWAYS, np.where(never, _NEVER, _BEYOND))
    reason = np.where(inner, reason, outside).astype(np.int8)
    found = np.where(inner, np.exp(log_rate), np.nan)
    return _answer("allowable_rate", found, reason, aim, "fastest ramp under which a film gets to stretch")


def reachable_stretch(
    field: ParameterLike, time: float, modulus_ratio: ParameterLike, rtol: float = 1e-6
) -> xr.Dataset:
    """Find how far a film gets under a constant field that is held for a given time.

    Parameters
    ----------
    field, modulus_ratio : number, 1-D array or DataArray
        As in `dea_maps.sweep`.
    time : float
        In relaxation times, at least 0.
    rtol : float
        Relative error allowed in the stretch, from 1e-10 to 1e-3.

    Returns
    -------
    Dataset
        ``reachable_stretch``; ``reason``: "never" where the film fails before that time. NaN there.

    Raises
    ------
    TypeError, ValueError
        If something is of the wrong kind or out of bounds.

    Examples
    --------
    >>> reachable_stretch(1.2, 1.0, 4.0).reachable_stretch.round(3).item()
    1.177
    """
    if np.ndim(time) != 0:
        raise ValueError(f"time must be one number; got {brief(time)}")
    ds = trajectory(Step(), time=time, field=field, modulus_ratio=modulus_ratio, rtol=_tight(rtol)).isel(time=0)
    ended = ds.time_to_failure.values <= float(time)
    reason = np.where(ds.outcome == 3, _UNRESOLVED, np.where(ended, _NEVER, _ANSWERED)).astype(np.int8)
    return _answer("reachable_stretch", ds.stretch.values, reason, ds.stretch, "stretch after the field was held")


def _tight(rtol: float) -> float:
    """Return the accuracy of a sweep that answers to ``rtol``."""
    if isinstance(rtol, bool) or not isinstance(rtol, int | float):
        raise TypeError(f"rtol must be a number; got {brief(rtol)}")
    if not 1e-10 <= rtol <= LARGEST_RTOL:
        raise ValueError(f"rtol must be from 1e-10 to {LARGEST_RTOL}; got {brief(rtol)}")
    return max(0.01 * rtol, SMALLEST_RTOL)


def _broadcast(**given: tuple[ParameterLike, float, bool]) -> tuple[xr.DataArray, ...]:
    """Check quantities against their lowest value, and broadcast them by the names of their dimensions."""
    arrays = []
    for name, (value, lowest, may_be_infinite) in given.items():
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


def _swept(program: Step | Ramp, rtol: float, **parameters: Array) -> xr.Dataset:
    """Sweep scattered cells."""
    flat = {name: xr.DataArray(values.ravel(), dims="cell") for name, values in parameters.items()}
    ds = sweep(program, **flat, rtol=rtol)  # type: ignore[arg-type]
    shape = parameters["modulus_ratio"].shape
    return xr.Dataset({name: (list(map(str, range(len(shape)))), ds[name].values.reshape(shape)) for name in ds})


def _roots(
    function: Callable[..., Array],
    low: Array,
    high: Array,
    inner: npt.NDArray[np.bool_],
    arguments: tuple[Array, ...],
    rtol: float,
) -> tuple[Array, npt.NDArray[np.int8]]:
    """Find the roots where there is one: Chandrupatla's method, all cells side by side."""
    found, reason = np.full(inner.shape, np.nan), np.zeros(inner.shape, np.int8)
    if inner.any():
        result = elementwise.find_root(
            function,
            (low[inner], high[inner]),
            args=tuple(argument[inner] for argument in arguments),
            tolerances={"xrtol": 0.1 * rtol, "xatol": 0.0, "fatol": 0.0, "frtol": 0.0},
        )
        found[inner] = result.x
        reason[inner] = np.where(result.success, _ANSWERED, _UNRESOLVED)
    return found, reason


def _answer(
    name: str, values: Array, reason: npt.NDArray[np.int8], like: xr.DataArray, long_name: str
) -> xr.Dataset:
    """Wrap an answer as a data set."""
    words = {"long_name": f"whether there is an answer for {name}", "units": "1"}
    flags = {"flag_values": np.arange(len(REASONS), dtype=np.int8), "flag_meanings": " ".join(REASONS)}
    found = np.where(reason == _ANSWERED, values, np.nan)
    return xr.Dataset(
        {
            name: (like.dims, found, {"long_name": long_name, "units": "1"}),
            "reason": (like.dims, reason, {**words, **flags}),
        },
        dict(like.coords),
    )
