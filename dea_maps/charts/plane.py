"""A map over two parameters as a chart has it: its axes, its cells, where its regions lie."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr
from matplotlib.axes import Axes

from ..outcomes import Outcome
from ..sweeps.chunks import evenly
from .boundaries import UNRESOLVED, Outcomes, agrees, limits, outcome_in_theory
from .data import cell_edges, flagged, on_log_axis
from .units import Shown, shown

Floats = npt.NDArray[np.float64]

BREAKS_DOWN = len(Outcome)
"""The region where electrical breakdown comes before anything else, beside the outcomes."""

_MOST_CELLS = 800
"""Cells along an axis that a chart can still show; of more, some are left out."""

_FINE = 400
"""Places along an axis at which the theory is asked."""


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
    program : str
        The loading program if the theory bounds the regions, empty if the cells do.
    critical : float
        The relaxed critical field, as `x` is shown.
    ratio : (ny,) ndarray
        Modulus ratio of each row.
    """

    x: Shown
    y: Shown
    values: Floats
    regions: Outcomes
    program: str
    critical: float
    ratio: Floats

    def only(self, *regions: int) -> "np.ma.MaskedArray[Any, Any]":
        """Return the values, masked outside some regions."""
        return np.ma.masked_where(~np.isin(self.regions, regions) | ~np.isfinite(self.values), self.values)

    def fine(self) -> tuple[Floats, Floats, Outcomes]:
        """Return regions on a grid so fine that its cells are not seen, if the theory bounds them.

        Returns
        -------
        x : (nx,) ndarray
        y : (ny,) ndarray
            Rising centres of the cells.
        regions : (ny, nx) ndarray of int8
        """
        x, y = self.x.values.values, self.y.values.values
        if not self.program:
            return x, y, self.regions
        fine_x, fine_y = _fine(x), _fine(y)
        ratio = np.interp(fine_y, y, self.ratio)
        regions = outcome_in_theory(self.program, fine_x / self.critical, ratio[:, np.newaxis])
        here = self.regions[np.ix_(_nearest(y, fine_y), _nearest(x, fine_x))]
        return fine_x, fine_y, np.where(here >= UNRESOLVED, here, regions)

    def boundaries(self) -> list[Floats]:
        """Return (n, 2) points on each line of the theory between regions; none if the cells bound them."""
        if not self.program:
            return []
        y = _fine(self.y.values.values)
        ratio = np.interp(y, self.y.values.values, self.ratio)
        return [np.column_stack([limit * self.critical, y]) for limit in limits(self.program, ratio)]


def set_axes(ax: Axes, plane: Plane) -> tuple[Floats, Floats]:
    """Set both axes of a map, and return the edges of its cells along them."""
    x_edges, y_edges = set_axis(ax, "x", plane.x), set_axis(ax, "y", plane.y)
    if plane.program:
        move_edge(x_edges, plane.x.values.values, plane.critical)
    return x_edges, y_edges


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
    outcome, program = part["outcome"].values, str(ds.attrs.get("program", ""))
    field = part[x[1]].values.astype(np.float64)
    ratio = np.broadcast_to(part["modulus_ratio"].values.astype(np.float64), len(part[y[0]]))
    bounded = x[1] == "field" and agrees(program, field, ratio[:, np.newaxis], outcome)
    return Plane(
        across,
        up,
        part["values"].values.astype(np.float64),
        regions_of(part),
        program if bounded else "",
        across.per(part[x[1]]),
        ratio,
    )


def regions_of(ds: xr.Dataset) -> Outcomes:
    """Return the outcome in each cell, or `BREAKS_DOWN` where breakdown comes first."""
    regions: Outcomes = ds["outcome"].values.astype(np.int8)
    if "first_limit" in ds:
        first = ds["first_limit"].transpose(*ds["outcome"].dims)
        regions[flagged(first, "breakdown")] = BREAKS_DOWN
        regions[flagged(first, "unresolved")] = UNRESOLVED
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


def move_edge(edges: Floats, values: Floats, survived: float) -> None:
    """Move the edge between the cells on either side of the largest field that is survived to this field.

    Parameters
    ----------
    edges : (n + 1,) ndarray
        From `set_axis`; changed in place.
    values : (n,) ndarray
        Rising fields, as the axis has them.
    survived : float
        Likewise.
    """
    edges[np.searchsorted(values, survived, "right")] = np.clip(survived, values[0], values[-1])


def _fine(values: Floats) -> Floats:
    """Return many places between the first and the last of rising values, even on their scale."""
    spaced = np.geomspace if on_log_axis(values) else np.linspace
    return np.asarray(spaced(values[0], values[-1], _FINE))


def _nearest(values: Floats, places: Floats) -> npt.NDArray[np.intp]:
    """Return which of rising values is nearest to each place, on their scale."""
    middles = np.sqrt(values[1:] * values[:-1]) if on_log_axis(values) else 0.5 * (values[1:] + values[:-1])
    return np.searchsorted(middles, places)
