"""One map in one pair of axes: time to failure in colour, isochrones, and the regions named in place."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Colormap, ListedColormap, LogNorm
from matplotlib.patches import Patch
from matplotlib.transforms import Bbox

from .chart_isochrones import Span, draw_isochrones
from .chart_placement import place_inside
from .nomenclature import OUTCOMES, axis_label

Floats = npt.NDArray[np.float64]

COLOURS: Colormap = ListedColormap(colormaps["viridis"](np.linspace(0.25, 1.0, 256)), name="time to failure")
"""Luminance rises with time all along, and nowhere is so dark that a black line is lost."""

_MOST_CELLS = 800
"""Cells along an axis that a chart can still show; of more, some are left out."""

SURVIVES, FAILS_LATER, FAILS_AT_ONCE, UNRESOLVED = range(len(OUTCOMES))
LOOKS: Mapping[int, dict[str, Any]] = {
    SURVIVES: {"facecolor": "0.94", "edgecolor": "black"},
    FAILS_AT_ONCE: {"facecolor": "0.75", "edgecolor": "0.45", "hatch": "////"},
    UNRESOLVED: {"facecolor": "black", "edgecolor": "black"},
}


class Plane(NamedTuple):
    """The map over two parameters.

    Attributes
    ----------
    x_name, y_name : str
        The parameters.
    x : (nx,) ndarray
    y : (ny,) ndarray
        Their values, rising.
    time : (ny, nx) ndarray
        Time to failure.
    outcome : (ny, nx) ndarray of int8
    """

    x_name: str
    y_name: str
    x: Floats
    y: Floats
    time: Floats
    outcome: npt.NDArray[np.int8]


def plane_of(ds: xr.Dataset, x: tuple[str, str], y: tuple[str, str]) -> Plane:
    """Take the map over two dimensions out of a data set.

    Parameters
    ----------
    ds : Dataset
        With ``time_to_failure`` and ``outcome`` over the two dimensions.
    x, y : tuple of str
        A dimension, and the parameter along it.
    """
    chosen = {}
    for dim, name in (x, y):
        _, rising = np.unique(ds[name].values, return_index=True)
        chosen[dim] = rising[evenly(len(rising), _MOST_CELLS)]
    part = ds[["time_to_failure", "outcome"]].isel(chosen).transpose(y[0], x[0]).load()
    return Plane(
        x[1],
        y[1],
        part[x[1]].values,
        part[y[1]].values,
        part["time_to_failure"].values.astype(np.float64),
        part["outcome"].values,
    )


def evenly(number: int, most: int) -> npt.NDArray[np.intp]:
    """Return at most so many indices below a number, evenly spread from the first to the last."""
    return np.linspace(0, number - 1, min(number, most)).round().astype(np.intp)


def log_spaced(values: Floats) -> bool:
    """Tell whether the logarithms of rising values are more evenly spaced than the values."""
    if len(values) < 3 or values[0] <= 0:
        return False
    gaps, ratios = np.diff(values), np.diff(np.log(values))
    return bool(ratios.std() * gaps.mean() < gaps.std() * ratios.mean())


def time_span(times: Floats) -> Span | None:
    """Return the shortest and the longest time of the colours; None where nothing fails later.

    Parameters
    ----------
    times : ndarray, any shape
        Times; only those that are finite and above 0 count. A few that lie more than a decade beyond the
        others get the colours of the ends.
    """
    later = times[np.isfinite(times) & (times > 0)]
    if not later.size:
        return None
    low, high = np.quantile(later, [0.005, 0.995])
    least = later.min() if later.min() > low / 10 else low
    greatest = later.max() if later.max() < 10 * high else high
    if least == greatest:
        least, greatest = least / 2, greatest * 2
    return float(least), float(greatest)


def draw_plane(ax: Axes, plane: Plane, span: Span | None) -> list[Artist]:
    """Draw a map: colours, isochrones with their times, names of regions.

    Parameters
    ----------
    ax : Axes
        In its final place on the figure.
    plane : Plane
        The map.
    span : tuple of float, or None
        Shortest and longest time of the colours; None where nothing fails later.

    Returns
    -------
    list of Artist
        For a legend: the regions that are too small to be named in place.
    """
    x_edges = set_axis(ax, "x", plane.x_name, plane.x)
    y_edges = set_axis(ax, "y", plane.y_name, plane.y)
    # A mesh has no hatching: where the film fails at once, the background shows through.
    ax.patch.set(**LOOKS[FAILS_AT_ONCE])
    for outcome in (SURVIVES, UNRESOLVED):
        region = np.ma.masked_not_equal(plane.outcome, outcome)
        colour = ListedColormap([LOOKS[outcome]["facecolor"]])
        ax.pcolormesh(x_edges, y_edges, region, cmap=colour, rasterized=True)
    later = np.ma.masked_where((plane.outcome != FAILS_LATER) | ~(plane.time > 0), plane.time)
    if span is not None:
        ax.pcolormesh(x_edges, y_edges, later, norm=LogNorm(*span), cmap=COLOURS, rasterized=True)
    regions = {outcome: plane.outcome == outcome for outcome in LOOKS}
    borders = _borders(x_edges, y_edges, plane.outcome)
    ax.add_collection(LineCollection(list(borders), colors="black", linewidths=1.2, capstyle="projecting"))
    taken, unnamed = name_regions(ax, plane.x, plane.y, regions)
    if span is not None:
        draw_isochrones(ax, plane.x, plane.y, later, span, taken, borders.reshape(-1, 2))
    return unnamed


def name_regions(
    ax: Axes, x: Floats, y: Floats, regions: dict[int, npt.NDArray[np.bool_]]
) -> tuple[list[Bbox], list[Artist]]:
    """Write the names of outcomes where they occur.

    Parameters
    ----------
    ax : Axes
        With its final scales, limits and position.
    x : (nx,) ndarray
    y : (ny,) ndarray
        Rising centres of the cells.
    regions : dict of int to (ny, nx) ndarray of bool
        The cells of each outcome.

    Returns
    -------
    taken : list of Bbox
        Where names are now, in pixels.
    unnamed : list of Artist
        For a legend: the outcomes that occur, but in too small a region for a name.
    """
    taken: list[Bbox] = []
    unnamed: list[Artist] = []
    for outcome, region in regions.items():
        if not region.any():
            continue
        words = OUTCOMES[outcome].replace("_", " ")
        ink = "white" if outcome == UNRESOLVED else "black"
        name = ax.text(x[0], y[0], words, color=ink, ha="center", va="center", fontsize=9)
        name.set_bbox({"facecolor": LOOKS[outcome]["facecolor"], "edgecolor": "none", "pad": 1.5})
        if place_inside(ax, name, x, y, region):
            taken.append(name.get_window_extent())
        else:
            name.remove()
            unnamed.append(Patch(label=words, **LOOKS[outcome]))
    return taken, unnamed


def set_axis(ax: Axes, which: str, name: str, values: Floats) -> Floats:
    """Set label, scale and limits of an axis, and return the edges of its cells.

    Parameters
    ----------
    ax : Axes
        Changed.
    which : {"x", "y"}
        The axis.
    name : str
        The parameter along it.
    values : (n,) ndarray
        Its values, rising: the centres of the cells.

    Returns
    -------
    (n + 1,) ndarray
        Half way between the centres on the scale of the axis; the outer cells end at their centres.
    """
    log = log_spaced(values)
    ax.set(
        **{
            f"{which}label": axis_label(name),
            f"{which}scale": "log" if log else "linear",
            f"{which}lim": (values[0], values[-1]),
        }
    )
    scaled = np.log(values) if log else values
    edges = np.concatenate([scaled[:1], 0.5 * (scaled[1:] + scaled[:-1]), scaled[-1:]])
    return np.exp(edges) if log else edges


def _borders(x_edges: Floats, y_edges: Floats, outcome: npt.NDArray[np.int8]) -> Floats:
    """Return (n, 2, 2) end points of the edges between cells of different outcomes."""
    row, column = np.nonzero(outcome[:, 1:] != outcome[:, :-1])
    x = x_edges[column + 1]
    upright = np.stack([[x, y_edges[row]], [x, y_edges[row + 1]]])
    row, column = np.nonzero(outcome[1:] != outcome[:-1])
    y = y_edges[row + 1]
    level = np.stack([[x_edges[column], y], [x_edges[column + 1], y]])
    return np.concatenate([upright, level], axis=2).transpose(2, 0, 1)
