"""Cycles to failure of a repeated program against its amplitude, as S-N curves of fatigue show them."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator, NullLocator, ScalarFormatter

from ..outcomes import Outcome
from ..program_text import kinds_in
from ..sweeps.chunks import evenly
from .boundaries import boundary_of
from .choices import check_choice
from .data import drawable, on_log_axis, parameters_along, sizes_in_words
from .layout import add_heading, axes_for, line_width, text_size
from .style import curve_style
from .units import shown, title_of, units_of

_MOST_CURVES = 6


def cycles_chart(
    ds: xr.Dataset,
    ax: Axes | None = None,
    *,
    over: str | None = None,
    units: str | None = None,
    size: str = "column",
) -> Axes:
    r"""Draw an amplitude against the cycles to failure, both logarithmic, for up to six values of another parameter.

    Few computed values are points, joined by dotted lines only to guide the eye; many are curves. A triangle at the
    left edge is a film that fails in the first cycle. A dashed line is the largest amplitude that is survived
    indefinitely, from `dea_maps.allowable`: under a smaller one no number of cycles leads to failure.

    Parameters
    ----------
    ds : Dataset
        From `dea_maps.sweep` under a repeated program, with one or two dimensions longer than 1.
    ax, units, size
        As in `dea_maps.charts.phase_diagram`.
    over : str, optional
        The amplitude, a parameter that varies; by default the first field, else the first that varies.

    Returns
    -------
    Axes

    Raises
    ------
    TypeError, ValueError
        If the data set is not a map over one or two parameters, or lacks ``cycles_to_failure`` or ``outcome``; if no
        film fails; if an option is not one of those allowed.

    Examples
    --------
    >>> import dea_maps as dm, numpy as np
    >>> ds = dm.sweep(dm.PulseTrain(), field=np.linspace(1.2, 1.9, 15), period=1.0, duty=[0.25, 0.5], modulus_ratio=4.0)
    >>> cycles_chart(ds).get_xlabel()
    'cycles to failure $N$'
    """
    ds = drawable(ds, "cycles_to_failure", what="a chart of cycles to failure")
    along = parameters_along(ds)
    if along is None or len(along) not in (1, 2):
        raise ValueError(
            "a chart of cycles to failure needs one or two dimensions, each along one parameter; got "
            f"{sizes_in_words(ds)}: select values with ds.sel or ds.isel"
        )
    kinds, names = kinds_in(ds.coords, ds.attrs), list(along.values())
    if over is None:
        over = next((name for name in names if kinds[name] == "field"), names[0])
    check_choice("over", over, names)
    units = units_of(ds, units)
    failed = ds["outcome"].isin((Outcome.FAILS_LATER, Outcome.FAILS_AT_ONCE))
    if not bool(failed.any()):
        raise ValueError("a chart of cycles to failure needs films that fail; all of them survive or are unresolved")
    ax = axes_for(ax, size)
    ds = ds.sortby(over)
    dim = next(dim for dim, name in along.items() if name == over)
    y, cycles = shown(ds, over, units), shown(ds, "cycles_to_failure", units)
    values = cycles.values.where(failed, np.nan)
    last = max(10.0, 1.3 * float(values.max()))
    ax.set(xlabel=cycles.label, ylabel=y.label, xscale="log", yscale="log", xlim=(1.0, last))
    others = {each: name for each, name in along.items() if name != over}
    films: list[tuple[dict[str, int], str]] = [({}, "")]
    heading = ""
    for across, name in others.items():
        other = shown(ds, name, units)
        rising = np.unique(other.values, return_index=True)[1]
        chosen = rising[evenly(len(rising), _MOST_CURVES)]
        films = [({across: int(index)}, f"{float(other.values[index]):.4g}") for index in chosen]
        heading = other.label
    survived = _survived(ds, over, [name for name in others.values()], films)
    handles: list[Artist] = []
    first = False
    for number, (film, words) in enumerate(films):
        counted = values.isel(film).values
        style = curve_style(ax, number, len(films), ds.sizes[dim])
        beyond = counted >= 1.0
        (line,) = ax.plot(counted[beyond], y.values.values[beyond], label=words, **style)
        handles += [line] if words else []
        at_start = counted < 1.0
        if at_start.any():
            first = True
            mark = _mark(ax, style["color"])
            ax.plot(np.ones(at_start.sum()), y.values.values[at_start], **mark, clip_on=False, zorder=3)
        if np.isfinite(survived[number]) and survived[number] > 0.0:
            look: dict[str, Any] = {"color": style["color"], "linestyle": "--", "linewidth": line_width(ax, 1.0)}
            ax.axhline(survived[number] * y.per(ds[over]), zorder=1.0, **look)
    if np.isfinite(survived).any():
        handles.append(Line2D([], [], color="black", linestyle="--", label="largest survived"))
    if first:
        handles.append(Line2D([], [], label="in the first cycle", **_mark(ax, "black")))
    _plain_ticks(ax)
    add_heading(ax, title_of(ds, units), handles, heading)
    return ax


def _survived(ds: xr.Dataset, over: str, others: list[str], films: list[tuple[dict[str, int], str]]) -> list[float]:
    """Return the largest amplitude that each film survives, NaN where that is not known."""
    log = {name: on_log_axis(np.unique(ds[name].values)) for name in (over, *others)}
    boundary = boundary_of(ds, (over, *others), log)
    if boundary is None or boundary.parameter != over:
        return [np.nan] * len(films)
    places = np.array([float(ds[name].isel(film)) for film, _ in films for name in others] or [np.nan])
    survived, _ = boundary.at(places, bool(others) and log[others[0]])
    return [float(value) for value in survived]


def _mark(ax: Axes, colour: Any) -> dict[str, Any]:
    """Return the look of a film that fails in the first cycle."""
    return {"color": colour, "linestyle": "", "marker": "<", "markersize": 0.5 * text_size(ax)}


def _plain_ticks(ax: Axes) -> None:
    """Name round values on a logarithmic axis of less than a decade, where there may be no power of ten."""
    low, high = ax.get_ylim()
    if high < 10.0 * low:
        ax.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
        ax.yaxis.set_major_formatter(ScalarFormatter())
        ax.yaxis.set_minor_locator(NullLocator())
