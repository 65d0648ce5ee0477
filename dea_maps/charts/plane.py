"""A map over two parameters as a chart has it: its axes, its cells, where its regions lie."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr
from matplotlib.axes import Axes

from ..outcomes import Outcome
from ..sweeps.chunks import evenly
from .boundaries import Outcomes, boundary_of
from .data import cell_edges, flagged, on_log_axis
from .units import Shown, shown

Floats = npt.NDArray[np.float64]

BREAKS_DOWN = len(Outcome)
"""The region where electrical breakdown comes before anything else, beside the outcomes."""

_MOST_CELLS = 800
"""Cells along an axis that a chart can still show; of more, some are left out."""

_FINE = 400
"""Places along an axis at which boundaries are drawn."""


class Curves(NamedTuple):
    """Boundaries of the regions of a map, as its axes show them.

    Attributes
    ----------
    axis : {"x", "y"}
        That of the parameter whose limits they are.
    places : (n,) ndarray
        Rising values along the other axis.
    survived, at_once : (n,) ndarray
        The largest value that is survived, and the least that fails at once, infinite where there is none.
    """

    axis: str
    places: Floats
    survived: Floats
    at_once: Floats

    def points(self) -> list[Floats]:
        """Return (n, 2) points on each curve that there is."""
        curves = [limit for limit in (self.survived, self.at_once) if np.isfinite(limit).any()]
        return [np.column_stack([limit, self.places][:: 1 if self.axis == "x" else -1]) for limit in curves]


class Plane(NamedTuple):
    """The map over two parameters.

    Attributes
    ----------
    x, y : Shown
        The parameters, rising.
    values : (ny, nx) ndarray
        What is mapped.
    regions : (ny, nx) ndarray of int8
        Outcomes, or `BREAKS_DOWN`.
    curves : Curves or None
        What bounds the regions; None if the cells do.
    """

    x: Shown
    y: Shown
    values: Floats
    regions: Outcomes
    curves: Curves | None

    def only(self, *regions: int) -> "np.ma.MaskedArray[Any, Any]":
        """Return the values, masked outside some regions."""
        return np.ma.masked_where(~np.isin(self.regions, regions) | ~np.isfinite(self.values), self.values)

    def fine(self) -> tuple[Floats, Floats, Outcomes]:
        """Return regions on a grid so fine that its cells are not seen, if curves bound them.

        Returns
        -------
        x : (nx,) ndarray
        y : (ny,) ndarray
            Rising centres of the cells.
        regions : (ny, nx) ndarray of int8
        """
        x, y = self.x.values.values, self.y.values.values
        if self.curves is None:
            return x, y, self.regions
        fine_x, fine_y = _fine(x), _fine(y)
        if self.curves.axis == "x":
            value, survived, at_once = fine_x, self.curves.survived[:, np.newaxis], self.curves.at_once[:, np.newaxis]
        else:
            value, survived, at_once = fine_y[:, np.newaxis], self.curves.survived, self.curves.at_once
        regions = np.select(
            [value >= at_once, value <= survived], [Outcome.FAILS_AT_ONCE, Outcome.SURVIVES], Outcome.FAILS_LATER
        )
        here = self.regions[np.ix_(_nearest(y, fine_y), _nearest(x, fine_x))]
        return fine_x, fine_y, np.where(here >= Outcome.UNRESOLVED, here, regions)


def set_axes(ax: Axes, plane: Plane) -> tuple[Floats, Floats]:
    """Set both axes of a map, and return the edges of its cells along them."""
    return set_axis(ax, "x", plane.x), set_axis(ax, "y", plane.y)


def plane_of(ds: xr.Dataset, x: tuple[str, str], y: tuple[str, str], values: xr.DataArray, units: str) -> Plane:
    """Take the map over two dimensions out of a data set.

    Parameters
    ----------
    ds : Dataset
        With ``outcome`` over the two dimensions.
    x, y : tuple of str
        A dimension, and the parameter along it.
    values : DataArray
        What to map, over the same dimensions.
    units : {"tau", "si"}
        Of the axes.
    """
    chosen = {}
    for dim, name in (x, y):
        _, rising = np.unique(ds[name].values, return_index=True)
        chosen[dim] = rising[evenly(len(rising), _MOST_CELLS)]
    part = ds.assign(values=values).isel(chosen).transpose(y[0], x[0], ...)
    across, up = shown(part, x[1], units), shown(part, y[1], units)
    curves = _curves(part, (x[1], y[1]), (across, up))
    return Plane(across, up, part["values"].values.astype(np.float64), regions_of(part), curves)


def _curves(part: xr.Dataset, names: tuple[str, str], axes: tuple[Shown, Shown]) -> Curves | None:
    """Return the boundaries on a map over two parameters, as its axes show them."""
    logs = {name: on_log_axis(axis.values.values) for name, axis in zip(names, axes, strict=True)}
    boundary = boundary_of(part, names, logs)
    if boundary is None:
        return None
    of_limit, of_places = axes if boundary.parameter == names[0] else axes[::-1]
    other = next(name for name in names if name != boundary.parameter)
    places = _fine(of_places.values.values)
    unit = of_limit.per(part[boundary.parameter])
    survived, at_once = boundary.at(places / of_places.per(part[other]), logs[other])
    return Curves("x" if boundary.parameter == names[0] else "y", places, unit * survived, unit * at_once)


def regions_of(ds: xr.Dataset) -> Outcomes:
    """Return the outcome in each cell, or `BREAKS_DOWN` where breakdown comes first."""
    regions: Outcomes = ds["outcome"].values.astype(np.int8)
    if "first_limit" in ds:
        first = ds["first_limit"].transpose(*ds["outcome"].dims)
        regions[flagged(first, "breakdown")] = BREAKS_DOWN
        regions[flagged(first, "unresolved")] = Outcome.UNRESOLVED
    return regions


def set_axis(ax: Axes, which: str, quantity: Shown) -> Floats:
    """Set label, scale and limits of an axis, and return the edges of its cells.

    Parameters
    ----------
    ax : Axes
        Changed.
    which : {"x", "y"}
        The axis.
    quantity : Shown
        The parameter along it, rising: the centres of the cells.

    Returns
    -------
    (n + 1,) ndarray
        From `cell_edges`, on the scale of the axis.
    """
    values = quantity.values.values
    log = on_log_axis(values)
    ax.set(
        **{
            f"{which}label": quantity.label,
            f"{which}scale": "log" if log else "linear",
            f"{which}lim": (values[0], values[-1]),
        }
    )
    return cell_edges(values, log)


def _fine(values: Floats) -> Floats:
    """Return many places between the first and the last of rising values, even on their scale."""
    spaced = np.geomspace if on_log_axis(values) else np.linspace
    return np.asarray(spaced(values[0], values[-1], _FINE))


def _nearest(values: Floats, places: Floats) -> npt.NDArray[np.intp]:
    """Return which of rising values is nearest to each place, on their scale."""
    middles = np.sqrt(values[1:] * values[:-1]) if on_log_axis(values) else 0.5 * (values[1:] + values[:-1])
    return np.searchsorted(middles, places)
