"""The trajectory of every cell of a page to explore: each on a time scale of its own, packed in few bytes."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..charts.boundaries import FAILS_LATER, SURVIVES
from ..charts.plane import BREAKS_DOWN
from ..program_text import kinds_in
from ..runs.maps import sweep
from ..sweeps.loading import loading_time
from ..sweeps.solve import relaxation_rate, trace
from .cells import POINTS, Cells, Floats

RTOL = 1e-4
"""Relative error allowed in the stretches of the curves: less than can be seen."""

MOST_TIME = 2e8
"""Relaxation times to follow, at most, over all cells together: a slow ramp takes steps without end."""

_FULL = np.iinfo(np.uint16).max
_LAST = 1e-3  # share of the way to the final stretch that is left where the curve of a film that survives ends
_LONGEST = 1e3  # relaxation times for that, at most: at a field of Ec it takes infinitely long


class Curves(NamedTuple):
    """Packed trajectories, one row a cell in the order of the cells.

    Attributes
    ----------
    span : (cells,) ndarray of float32
        When a curve ends, in relaxation times: at failure or breakdown, or nearly relaxed; 0 where there is no curve.
    time : (cells, POINTS) ndarray of uint16
        Times over the span, times 65535.
    stretch : (cells, POINTS) ndarray of uint16
        ``(stretch - 1)/(top - 1)``, times 65535.
    top : float
        The largest stretch of all.
    """

    span: npt.NDArray[np.float32]
    time: npt.NDArray[np.uint16]
    stretch: npt.NDArray[np.uint16]
    top: float


def curves_of(cells: Cells) -> Curves:
    """Compute the trajectories of cells, up to failure or breakdown, or until what survives is nearly relaxed.

    Parameters
    ----------
    cells : Cells
        What a page shows.

    Returns
    -------
    Curves

    Examples
    --------
    >>> import dea_maps as dm
    >>> from dea_maps.explorer.cells import cells_of
    >>> ds = dm.sweep(dm.Step(), field=[0.9, 1.2, 1.5], modulus_ratio=4.0)
    >>> curves = curves_of(cells_of(ds))
    >>> [f"{span:.2f}" for span in curves.span]
    ['10.82', '2.44', '0.55']
    """
    ds = cells.ds
    parameters = {name: ds[name] for name in kinds_in(ds.coords, ds.attrs)}
    found = {name: array.values.ravel().astype(float) for name, array in _ends(cells, parameters).items()}
    arrays = [array.values.ravel() for array in xr.broadcast(ds["outcome"], *parameters.values())]
    outcome, values = arrays[0], dict(zip(parameters, arrays[1:], strict=True))
    breaks_down = (outcome == BREAKS_DOWN)[:, np.newaxis]
    lifetime = np.where(outcome == FAILS_LATER, ds["time_to_failure"].values.ravel().astype(float), 0.0)
    broken = {name: _column(ds, name) for name in ("time_to_breakdown", "breakdown_stretch")}
    lifetime = np.where(outcome == BREAKS_DOWN, np.nan_to_num(broken["time_to_breakdown"]), lifetime)
    corner = loading_time(cells.program, values)
    rate = np.maximum(relaxation_rate(found["final_stretch"], values["modulus_ratio"]), 1e-9)
    relaxed = corner + np.minimum(_LONGEST, -np.log(_LAST) / rate)
    span = np.where(outcome == SURVIVES, relaxed, lifetime)
    span[~_affordable(span)] = 0.0
    times = _times(span, corner)
    chosen = span > 0.0
    fails = (outcome == FAILS_LATER)[:, np.newaxis]
    at_end = fails & (times >= (1.0 - 2.0 * RTOL) * span[:, np.newaxis])
    own = {name: array[chosen] for name, array in values.items()}
    stretch = np.ones(times.shape)
    # The end is known; at this accuracy, the film might not have failed yet there.
    stretch[chosen], _ = trace(cells.program, own, np.where(at_end, 2.0, 1.0)[chosen] * times[chosen], RTOL)
    stretch = np.where(at_end & chosen[:, np.newaxis], found["critical_stretch"][:, np.newaxis], stretch)
    at_breakdown = breaks_down & chosen[:, np.newaxis] & (times == span[:, np.newaxis])
    stretch = np.where(at_breakdown, broken["breakdown_stretch"][:, np.newaxis], stretch)
    span[~np.isfinite(stretch).all(axis=1)] = 0.0  # as accurate as asked could not be reached
    stretch[span == 0.0] = 1.0
    top = max(float(stretch.max()), 1.0 + 1e-3)
    shares = np.divide(times, span[:, np.newaxis], out=np.zeros(times.shape), where=span[:, np.newaxis] > 0.0)
    return Curves(span.astype(np.float32), _packed(shares), _packed((stretch - 1.0) / (top - 1.0)), top)


def _column(ds: xr.Dataset, name: str) -> Floats:
    """Return the values of all cells, NaN where the map is without them."""
    values = ds[name] if name in ds else xr.full_like(ds["outcome"], np.nan, np.float64)
    return np.asarray(values.values.ravel(), dtype=np.float64)


def _ends(cells: Cells, parameters: dict[str, xr.DataArray]) -> dict[str, xr.DataArray]:
    """Return the stretches at failure and after full relaxation, computed again where the map is without them."""
    ds = cells.ds
    if "critical_stretch" not in ds or "final_stretch" not in ds:
        plain: dict[str, Any] = {name: array.reset_coords(drop=True) for name, array in parameters.items()}
        again = sweep(
            cells.program,
            **plain,
            rtol=RTOL,
        )
        ds = ds.merge(again[["critical_stretch", "final_stretch"]], compat="override")
    dims = cells.ds["outcome"].dims
    return {name: ds[name].transpose(*dims) for name in ("critical_stretch", "final_stretch")}


def _affordable(span: Floats) -> npt.NDArray[np.bool_]:
    """Tell which cells to follow: all but those that take longest, where there are too many of these."""
    order = np.argsort(span, kind="stable")
    affordable = np.empty(span.size, np.bool_)
    affordable[order] = np.cumsum(span[order]) <= MOST_TIME
    return affordable & np.isfinite(span)


def _times(span: Floats, corner: Floats) -> Floats:
    """Return the times of every cell, ascending from 0 to its span; the end of its ramp is among them."""
    shares = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, POINTS - 1))
    times = np.outer(span, shares)
    extra = np.minimum(corner, span)[:, np.newaxis]
    return np.sort(np.concatenate([times, extra], axis=1), axis=1)


def _packed(shares: Floats) -> npt.NDArray[np.uint16]:
    packed: npt.NDArray[np.uint16] = np.round(np.clip(shares, 0.0, 1.0) * _FULL).astype(np.uint16)
    return packed
