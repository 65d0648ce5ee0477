"""Allowable voltage against holding time, for films of several thicknesses or materials."""

from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from ..printable import chart_text
from .data import check_variables, flagged, on_log_axis
from .labels import fit_beside, label_ends
from .layout import add_heading, axes_for, figure_of, line_width, text_size
from .style import MARKERS, curve_style, joined
from .units import micrometres

Floats = npt.NDArray[np.float64]

_NEEDED = ("allowable_voltage", "film", "holding_time")
_LONG_TIMES = {"1 min": 60.0, "1 h": 3600.0, "1 day": 86400.0, "1 year": 3.156e7, "10 years": 3.156e8}
_WORD = 6.0
"""Room for one of them, in heights of its letters."""

_ROW = 1.3
"""Height of a row of a legend, in that of the words of the axes."""

_DASHES = (0, (3.0, 1.5))


def design_chart(ds: xr.Dataset, ax: Axes | None = None, *, size: str = "column") -> Axes:
    """Draw allowable voltages against the holding time, for up to eight films.

    Few holding times are points, many are curves. Where electrical breakdown and not electromechanical instability
    limits the voltage, a point is hollow and a line dashed. What a film
    sustains indefinitely, if the data set says it, is marked at the right edge. Where the names of the films would
    take much of the width, they are in the legend and not beside the lines.

    Parameters
    ----------
    ds : Dataset
        From `dea_maps.design`: ``allowable_voltage`` in V over ``film`` and ``holding_time`` in s, of which two
        or more are finite, and perhaps ``limit``, what limits it.
    ax : Axes, optional
        Where to draw; the names of the films take part of its width. By default on a new figure, ``ax.figure``.
    size : {"column", "slide"}
        Of a new figure.

    Returns
    -------
    Axes

    Raises
    ------
    TypeError, ValueError
        If the data set lacks something of the above; if an option is not one of those allowed.

    Examples
    --------
    >>> time, voltage = [1.0, 100.0, 10000.0], [[3100.0, 2200.0, 1700.0], [1550.0, 1100.0, 850.0]]
    >>> ds = xr.Dataset({"allowable_voltage": (("film", "holding_time"), voltage)},
    ...     {"film": ["VHB, 100 um", "VHB, 50 um"], "holding_time": time})
    >>> design_chart(ds).get_ylabel()
    'allowable voltage (kV)'
    """
    check_variables(ds, *_NEEDED, what="a design chart")
    if set(ds["allowable_voltage"].dims) != {"film", "holding_time"}:
        raise ValueError(
            "a design chart needs allowable_voltage over film and holding_time; "
            f"got {', '.join(map(str, ds['allowable_voltage'].dims)) or 'one number'}"
        )
    finite = int(np.isfinite(ds["holding_time"]).sum())
    if finite < 2:
        raise ValueError(f"a design chart needs two finite holding times or more; got {finite}")
    if not 1 <= ds.sizes["film"] <= len(MARKERS):
        raise ValueError(
            f"a design chart needs one to {len(MARKERS)} films; got {ds.sizes['film']}: select some with ds.isel"
        )
    may_grow = ax is None and size == "column"
    ax = axes_for(ax, size)
    ds = ds.sortby("holding_time").transpose("film", "holding_time", ...)
    time, voltages = ds["holding_time"].values.astype(np.float64), ds["allowable_voltage"].values / 1e3
    last = time[finite - 1]
    ax.set(xlabel="holding time (s)", ylabel="allowable voltage (kV)", xlim=(time[0], last))
    if on_log_axis(time[:finite]):
        ax.set_xscale("log")
        _name_times(ax)
    broken = _by_breakdown(ds)
    films = [micrometres(chart_text(name)) for name in ds["film"].values]
    points = finite
    curves, ends, silent = [], [], []
    for number, (name, voltage, breakdown) in enumerate(zip(films, voltages, broken, strict=True)):
        known = np.isfinite(voltage)
        if not known.any():
            silent.append(name)
            continue
        style = curve_style(ax, number, len(films), points)
        _draw_curve(ax, time[:finite], voltage[:finite], breakdown[:finite], style)
        curves.append(Line2D([], [], label=name, **style))
        ends.append((min(time[known][-1], last), voltage[known][-1]))
        if np.isinf(time[known][-1]):
            edge = ax.get_yaxis_transform()
            ax.plot(1.0, voltage[-1], transform=edge, clip_on=False, zorder=3, **_mark(ax, style["color"]))
    explained = _explained(ax, broken, silent, joined(points))
    if np.isfinite(voltages[:, finite:]).any():
        explained.append(Line2D([], [], label="indefinitely", **_mark(ax, "black")))
    names = [str(curve.get_label()) for curve in curves]
    beside = bool(names) and fit_beside(ax, names)
    if may_grow and not beside:
        figure = figure_of(ax)
        figure.set_figheight(figure.get_figheight() + len(curves) * _ROW * text_size(ax) / 72.0)
    add_heading(ax, ["allowable voltage for a holding time"], explained if beside else [*curves, *explained])
    if beside:
        label_ends(ax, ends, names)
    return ax


def _draw_curve(
    ax: Axes, time: Floats, voltage: Floats, breakdown: npt.NDArray[np.bool_], style: dict[str, Any]
) -> None:
    """Draw the allowable voltage of one film."""
    if not joined(len(time)):
        ax.plot(time, voltage, **{**style, "marker": ""})
        for face, part in ((style["color"], ~breakdown), ("white", breakdown)):
            look = {"linestyle": "", "marker": "o", **style, "markerfacecolor": face}
            ax.plot(time, np.where(part, voltage, np.nan), **{**look, "linestyle": ""})
        return
    ax.plot(time, voltage, **{**style, "linestyle": ""})
    for linestyle, part in (("-", ~breakdown), (_DASHES, breakdown)):
        # A line between two points is of the kind of the later one.
        shown = part | np.append(part[1:], False)
        ax.plot(time, np.where(shown, voltage, np.nan), **{**style, "linestyle": linestyle, "marker": ""})


def _mark(ax: Axes, colour: Any) -> dict[str, Any]:
    """Return the look of a voltage that is sustained indefinitely."""
    return {"color": colour, "linestyle": "", "marker": ">", "markersize": 0.6 * text_size(ax)}


def _name_times(ax: Axes) -> None:
    """Write minutes, hours, days and years above a logarithmic axis in seconds."""
    start, end = ax.get_xlim()
    room = np.log(end / start) * _WORD * text_size(ax) / (72.0 * ax.get_window_extent().width / figure_of(ax).dpi)
    named: dict[float, str] = {}
    for words, seconds in _LONG_TIMES.items():
        if start <= seconds <= end and all(np.log(seconds / other) > room for other in named):
            named[seconds] = words
    if named:
        above = ax.secondary_xaxis("top")
        above.set_xticks(list(named), list(named.values()))
        above.xaxis.set_minor_locator(NullLocator())
        above.tick_params(labelsize=0.9 * text_size(ax))


def _by_breakdown(ds: xr.Dataset) -> npt.NDArray[np.bool_]:
    """Tell where electrical breakdown limits the voltage."""
    if "limit" not in ds:
        return np.zeros(ds["allowable_voltage"].shape, bool)
    return flagged(ds["limit"].transpose("film", "holding_time"), "breakdown")


def _explained(ax: Axes, broken: npt.NDArray[np.bool_], silent: list[str], curves: bool) -> list[Artist]:
    """Return what a legend has to say."""
    look: dict[str, Any] = {"color": "black", "linewidth": line_width(ax, 1.4)}
    looks: list[dict[str, Any]] = [{"linestyle": "-"}, {"linestyle": _DASHES}]
    if not curves:
        looks = [{"linestyle": "", "marker": "o", "markersize": 0.5 * text_size(ax), "markerfacecolor": face}
                 for face in ("black", "white")]  # fmt: skip
    handles: list[Artist] = []
    if broken.any():
        words = ("limited by instability", "by electrical breakdown")
        handles += [Line2D([], [], label=label, **look, **own) for label, own in zip(words, looks, strict=True)]
    handles += [Line2D([], [], linestyle="", label=f"{name}: no answer") for name in silent]
    return handles
