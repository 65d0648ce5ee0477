"""The trajectory of every cell of a page to explore: each on a time scale of its own, packed in few bytes."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..charts.plane import BREAKS_DOWN
from ..outcomes import Outcome
from ..program_text import kinds_in
from ..programs import Program
from ..runs.maps import sweep
from ..sweeps.chunks import evenly
from ..sweeps.loading import arrays_of, field_at, repetition_starts, table_of
from ..sweeps.solve import relaxation_rate, trace
from .cells import REPETITIONS, RTOL, Cells, Floats

MOST_TIME = 2e8
"""Relaxation times to follow, at most, over all cells together: a slow ramp takes steps without end."""

_FULL = np.iinfo(np.uint16).max
_LAST = 1e-3  # share of the way to the final stretch that is left where the curve of a film that survives ends
_LONGEST = 1e3  # relaxation times for that, at most: at a field of Ec it takes infinitely long
_FEWEST = 4  # points of a piece of the program, at least
_BESIDE = 1e-6  # of a piece: how far from its ends the curve is looked at, as fields jump there


class Packed(NamedTuple):
    """Values from `low` to `high` in two bytes each.

    Attributes
    ----------
    low, high : float
        The bounds.
    shares : ndarray of uint16
        ``(value - low)/(high - low)``, times 65535.
    """

    low: float
    high: float
    shares: npt.NDArray[np.uint16]

    @property
    def values(self) -> Floats:
        """The values, as exact as they are kept."""
        return self.low + self.shares / float(_FULL) * (self.high - self.low)


class Curves(NamedTuple):
    """Packed trajectories, one row a cell in the order of the cells.

    Attributes
    ----------
    span : (cells,) ndarray of float32
        When a curve ends, in relaxation times: at failure or breakdown, or nearly relaxed, or after `REPETITIONS`; 0
        where there is no curve.
    ends : (cells,) ndarray of int8
        Whether it ends with failure or breakdown.
    time : Packed of (cells, points)
        Times over the span.
    stretch, field : Packed of (cells, points)
        Stretches, and fields applied over the relaxed critical field.
    """

    span: npt.NDArray[np.float32]
    ends: npt.NDArray[np.int8]
    time: Packed
    stretch: Packed
    field: Packed


def curves_of(cells: Cells) -> Curves:
    """Compute the trajectories of cells.

    They end with failure or breakdown, where what survives is nearly relaxed, or after `REPETITIONS` of a program that
    is repeated more often.

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
    ds, program = cells.ds, cells.program
    parameters = {name: ds[name] for name in kinds_in(ds.coords, ds.attrs)}
    found = {name: array.values.ravel().astype(float) for name, array in _ends(cells, parameters).items()}
    arrays = [array.values.ravel() for array in xr.broadcast(ds["outcome"], *parameters.values())]
    outcome, values = arrays[0], dict(zip(parameters, arrays[1:], strict=True))
    broken = {name: _column(ds, name) for name in ("time_to_breakdown", "breakdown_stretch")}
    lifetime = np.where(outcome == Outcome.FAILS_LATER, _column(ds, "time_to_failure"), 0.0)
    lifetime = np.where(outcome == BREAKS_DOWN, np.nan_to_num(broken["time_to_breakdown"]), lifetime)
    repeats = REPETITIONS if program.repeats not in range(1, REPETITIONS + 1) else program.repeats
    loaded = repetition_starts(program, values, np.full(outcome.shape, float(repeats)))
    rate = np.maximum(np.nan_to_num(relaxation_rate(found["final_stretch"], values["modulus_ratio"])), 1e-9)
    span = np.where(outcome == Outcome.SURVIVES, loaded + np.minimum(_LONGEST, -np.log(_LAST) / rate), lifetime)
    if repeats != program.repeats:
        span = np.minimum(span, loaded)
    span[~_affordable(span)] = 0.0
    chosen = span > 0.0
    times = _times(program, values, span, repeats, cells.points)
    last = times >= (1.0 - 2.0 * RTOL) * span[:, np.newaxis]
    ends = chosen & (lifetime > 0.0) & (span >= lifetime)
    at_failure = last & (ends & (outcome == Outcome.FAILS_LATER))[:, np.newaxis]
    own = {name: array[chosen] for name, array in values.items()}
    stretch, field = np.ones(times.shape), np.zeros(times.shape)
    # The end is known; at this accuracy, a film might be sought there alive.
    stretch[chosen], _ = trace(program, own, np.where(at_failure, 2.0, 1.0)[chosen] * times[chosen], RTOL)
    field[chosen] = field_at(program, own, times[chosen])
    stretch = np.where(at_failure, found["critical_stretch"][:, np.newaxis], stretch)
    at_breakdown = (ends & (outcome == BREAKS_DOWN))[:, np.newaxis] & (times == span[:, np.newaxis])
    stretch = np.where(at_breakdown, broken["breakdown_stretch"][:, np.newaxis], stretch)
    span[~np.isfinite(stretch).all(axis=1)] = 0.0  # as accurate as asked could not be reached
    none = span == 0.0
    stretch[none], field[none] = 1.0, 0.0
    shares = np.divide(times, span[:, np.newaxis], out=np.zeros(times.shape), where=~none[:, np.newaxis])
    return Curves(
        span.astype(np.float32),
        (ends & ~none).astype(np.int8),
        _packed(shares, 0.0, 1.0),
        _packed(stretch, min(float(stretch.min()), 1.0), max(float(stretch.max()), 1.0 + 1e-3)),
        _packed(field, min(float(field.min()), 0.0), max(float(field.max()), 1e-3)),
    )


def _column(ds: xr.Dataset, name: str) -> Floats:
    """Return the values of all cells, NaN where the map is without them."""
    values = ds[name] if name in ds else xr.full_like(ds["outcome"], np.nan, np.float64)
    return np.asarray(values.values.ravel(), dtype=np.float64)


def _ends(cells: Cells, parameters: dict[str, xr.DataArray]) -> dict[str, xr.DataArray]:
    """Return the stretches at failure and after full relaxation, computed again where the map is without them."""
    ds = cells.ds
    if "critical_stretch" not in ds or "final_stretch" not in ds:
        plain: dict[str, Any] = {name: array.reset_coords(drop=True) for name, array in parameters.items()}
        again = sweep(cells.program, **plain, rtol=RTOL)
        ds = ds.merge(again[["critical_stretch", "final_stretch"]], compat="override")
    dims = cells.ds["outcome"].dims
    return {name: ds[name].transpose(*dims) for name in ("critical_stretch", "final_stretch")}


def _affordable(span: Floats) -> npt.NDArray[np.bool_]:
    """Tell which cells to follow: all but those that take longest, where there are too many of these."""
    order = np.argsort(span, kind="stable")
    affordable = np.empty(span.size, np.bool_)
    affordable[order] = np.cumsum(span[order]) <= MOST_TIME
    return affordable & np.isfinite(span)


def _times(program: Program, values: dict[str, Floats], span: Floats, repeats: int, points: int) -> Floats:
    """Return the times of every cell, ascending from 0 to its span, as many in each piece of the program.

    Where one piece ends and the next one begins there are two times beside each other.
    """
    table = table_of(program)
    columns = arrays_of(table, values)[3]
    times = np.zeros((span.size, points))
    for cell in np.flatnonzero(span > 0.0):
        durations = np.tile(table.scale[:, 2] * columns[table.source[:, 2], cell], repeats)
        breaks = np.cumsum(durations)
        inner = np.unique(breaks[(breaks > 0.0) & (breaks < span[cell])])
        corners = np.array([0.0, *inner[evenly(inner.size, points // _FEWEST - 1)], span[cell]])
        for part, begin, end in zip(
            np.array_split(np.arange(points), corners.size - 1), corners, corners[1:], strict=False
        ):
            shares = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, part.size))
            shares[0] += _BESIDE * (begin > 0.0)
            shares[-1] -= _BESIDE * (end < span[cell])
            times[cell, part] = begin + shares * (end - begin)
        times[cell, -1] = span[cell]
    return times


def _packed(values: Floats, low: float, high: float) -> Packed:
    shares = np.round(np.clip((values - low) / (high - low), 0.0, 1.0) * _FULL).astype(np.uint16)
    return Packed(low, high, shares)
