"""Maps over one parameter as curves, and scattered samples as points."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..outcomes import Outcome
from .boundaries import Outcomes, boundary_of
from .data import drawable, on_log_axis, varying
from .isochrones import bar_ticks, time_span
from .layout import add_colour_bar, add_heading, figure_of, line_width, new_axes, text_size
from .plane import BREAKS_DOWN, regions_of, set_axis
from .regions import COLOURS, LOOKS, name_regions, patches, words_for
from .style import DOTS, joined
from .units import shown, title_of, units_of

Floats = npt.NDArray[np.float64]

_FEW = 40
"""So many points or fewer are marked on a curve."""

_PLACES = 200
"""Places along each axis that are tried for the name of a region."""

_MARKERS = {Outcome.SURVIVES: "o", Outcome.FAILS_AT_ONCE: "X", Outcome.UNRESOLVED: "P", BREAKS_DOWN: "D"}

_BREAKDOWN = ("time_to_breakdown", "breakdown_stretch")


def failure_over(ds: xr.Dataset, name: str, size: str) -> Figure:
    """Draw time to failure and critical stretch over one parameter, one above the other; dotted those of breakdown.

    Parameters
    ----------
    ds : Dataset
        With ``time_to_failure``, ``critical_stretch`` and ``outcome`` over one dimension.
    name : str
        The parameter along it.
    size : {"column", "slide"}
        Of the figure.
    """
    ds = drawable(ds, "time_to_failure", "critical_stretch", what="a chart over one parameter").sortby(name).load()
    units = units_of(ds, None)
    parameter, time, stretch = (shown(ds, key, units) for key in (name, "time_to_failure", "critical_stretch"))
    upper, lower = new_axes(size, rows=2, tall=1.35)
    x = parameter.values.values
    regions = regions_of(ds)
    times = time.values.where(regions == Outcome.FAILS_LATER).values
    stretches = stretch.values.where(regions != BREAKS_DOWN).values
    broken = [shown(ds, key, units).values.values if key in ds else None for key in _BREAKDOWN]
    drawn = ((upper, times, broken[0], time.label), (lower, stretches, broken[1], stretch.label))
    for ax, fails, breaks_down, label in drawn:
        for y, style in ((fails, "-"), (breaks_down, ":")):
            if y is not None:
                ax.plot(x, y, color="black", linewidth=line_width(ax, 1.2), **points_of(ax, x, style))
        ax.set_ylabel(label)
    if np.nanmax(times, initial=0.0) > 10 * np.nanmin(times, initial=np.inf):
        upper.set_yscale("log")
    shade_regions(lower, ds, name, units)
    edges = shade_regions(upper, ds, name, units)
    upper.label_outer()
    head_over_regions(upper, title_of(ds, units), edges, regions)
    return figure_of(upper)


def points_of(ax: Axes, x: Floats, linestyle: str) -> dict[str, Any]:
    """Return the line of a curve and the points that mark its values if they are few."""
    style = linestyle if joined(len(x)) else DOTS
    return {"marker": "." if len(x) <= _FEW else "", "markersize": 0.6 * text_size(ax), "linestyle": style}


def shade_regions(ax: Axes, ds: xr.Dataset, name: str, units: str) -> Floats:
    """Set the axis of a parameter, and shade the outcomes along it.

    Parameters
    ----------
    ax : Axes
        With its curves.
    ds : Dataset
        The map.
    name : str
        The parameter, rising.
    units : {"tau", "si"}
        Of the chart.

    Returns
    -------
    (n + 1,) ndarray
        Where one value's part of the axis ends and the next one's begins.
    """
    parameter, regions = shown(ds, name, units), regions_of(ds)
    edges, x = set_axis(ax, "x", parameter), parameter.values.values
    boundary = boundary_of(ds, (name,))
    if boundary is not None:
        survived, at_once = (float(limit[0]) * parameter.per(ds[name]) for limit in boundary.limits[:2])
        edges[np.searchsorted(x, survived, "right")] = np.clip(survived, x[0], x[-1])
        edges[np.searchsorted(x, at_once, "left")] = np.clip(at_once, x[0], x[-1])
    ax.set_ylim(ax.get_ylim())  # in some releases of Matplotlib, the shades would widen it
    ends = np.repeat(edges, 2)[1:-1]
    for region, looks in LOOKS.items():
        quiet = {**looks, "edgecolor": looks["edgecolor"] if "hatch" in looks else "none"}
        where = np.repeat(regions == region, 2)
        ax.fill_between(ends, 0, 1, where=where, transform=ax.get_xaxis_transform(), zorder=0, **quiet)
    return edges


def head_over_regions(
    ax: Axes, title: Sequence[str], edges: Floats, regions: Outcomes, handles: Sequence[Artist] = ()
) -> None:
    """Write the title of curves, and the names of the outcomes along them: in place, or else in the legend.

    Parameters
    ----------
    ax : Axes
        With its curves and shades.
    title : sequence of str
        Parts of the title.
    edges : (n + 1,) ndarray
        From `shade_regions`.
    regions : (n,) ndarray of int8
        Outcome of the film at each.
    handles : sequence of Artist
        For the legend.
    """
    add_heading(ax, title, handles)
    curves = list(ax.lines)
    names, unnamed = name_regions(ax, *_beside(ax, curves, edges, regions))
    if unnamed:
        for name in names:
            name.remove()
        add_heading(ax, title, [*handles, *patches(unnamed)])
        x, y, places = _beside(ax, curves, edges, regions)
        name_regions(ax, x, y, {region: cells for region, cells in places.items() if region not in unnamed})


def _beside(
    ax: Axes, curves: Sequence[Line2D], edges: Floats, regions: Outcomes
) -> tuple[Floats, Floats, dict[int, npt.NDArray[np.bool_]]]:
    """Return places all over axes, and which lie in which region, off the curves."""
    frame, high = ax.get_window_extent(), text_size(ax) * figure_of(ax).dpi / 72.0
    across, up = np.linspace(frame.x0, frame.x1, _PLACES), np.linspace(frame.y0, frame.y1, _PLACES)
    x, y = ax.transData.inverted().transform(np.column_stack([across, up])).T
    free = np.ones((_PLACES, _PLACES), bool)
    for curve in curves:
        points = ax.transData.transform(np.column_stack([curve.get_xdata(), curve.get_ydata()]))
        points = points[np.isfinite(points).all(axis=1)]
        if len(points):
            there = np.interp(across, points[:, 0], points[:, 1], left=-np.inf, right=-np.inf)
            free &= np.abs(up[:, np.newaxis] - there) > 0.5 * high
    here = regions[np.clip(np.searchsorted(edges, x, "right") - 1, 0, len(regions) - 1)]
    return x, y, {region: free & (here == region) for region in LOOKS}


def sample_points(ds: xr.Dataset, size: str) -> Figure:
    """Draw scattered samples over two parameters: time to failure in colour, other outcomes by their markers.

    Parameters
    ----------
    ds : Dataset
        With ``time_to_failure`` and ``outcome``.
    size : {"column", "slide"}
        Of the figure.

    Raises
    ------
    ValueError
        If fewer than two parameters vary.
    """
    ds = drawable(ds, "time_to_failure")
    names = varying(ds)
    if len(names) < 2:
        raise ValueError(f"a chart of samples needs two parameters that vary; got {', '.join(names) or 'none'}")
    units, (ax,) = units_of(ds, None), new_axes(size)
    quantities = [shown(ds, name, units) for name in (*names[:2], "time_to_failure")]
    regions = ds["outcome"].copy(data=regions_of(ds))
    together = xr.broadcast(*(quantity.values for quantity in quantities), regions)
    x, y, time, outcome = (array.values.ravel() for array in together)
    for which, quantity, values in zip("xy", quantities[:2], (x, y), strict=True):
        scale = "log" if on_log_axis(np.unique(values)) else "linear"
        ax.set(**{f"{which}label": quantity.label, f"{which}scale": scale})
    edge: dict[str, Any] = {"edgecolor": "black", "linewidth": line_width(ax, 0.4), "s": 0.3 * text_size(ax) ** 2}
    later = outcome == Outcome.FAILS_LATER
    span = time_span(time[later])
    if span is not None:
        ax.scatter(x[later], y[later], c=time[later], norm=LogNorm(*span), cmap=COLOURS, **edge)
        add_colour_bar([ax], LogNorm(*span), COLOURS, quantities[2].label, time[later], bar_ticks(span))
    handles: list[Artist] = []
    for region, marker in _MARKERS.items():
        where = outcome == region
        if where.any():
            face = LOOKS[region]["facecolor"]
            points = ax.scatter(x[where], y[where], marker=marker, color=face, label=words_for(region), **edge)
            handles.append(points)
    add_heading(ax, title_of(ds, units), handles)
    return figure_of(ax)
