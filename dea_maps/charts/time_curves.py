"""Films followed in time, up to their failure or electrical breakdown."""

import itertools
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from ..sweeps.chunks import evenly
from .choices import check_choice
from .data import check_variables, flagged, on_log_axis, varying
from .layout import add_heading, axes_for, line_width, text_size
from .style import MARKERS, curve_style
from .units import Shown, shown, title_of, units_of

_AT_FAILURE = {
    "stretch": "critical_stretch",
    "internal_stretch": "critical_internal_stretch",
    "applied_field": "critical_field",
    "true_field": "critical_true_field",
    "applied_voltage": "critical_voltage",
    **{f"{name}_{axis}": f"critical_{name}_{axis}" for name in ("stretch", "internal_stretch") for axis in (1, 2)},
}
"""Where a data set has the value of a variable at failure."""

_AT_BREAKDOWN = {
    "stretch": "breakdown_stretch",
    "applied_field": "breakdown_field",
    "true_field": "breakdown_true_field",
    "applied_voltage": "breakdown_voltage",
}
"""Likewise, at breakdown."""

_ENDS = {"failure": "x", "electrical breakdown": "*"}
"""How a curve may end, and the marker for that."""

_LONG_TIMES = ((3e5, 86400.0, "days"), (1e4, 3600.0, "h"), (600.0, 60.0, "min"))
"""Seconds from which a linear axis is in larger units."""


def trajectories(
    ds: xr.Dataset,
    ax: Axes | None = None,
    *,
    variable: str | None = None,
    units: str | None = None,
    size: str = "column",
) -> Axes:
    r"""Draw films against time, a curve for each of up to eight, a cross where one fails, a star where it breaks down.

    Parameters
    ----------
    ds : Dataset
        From `dea_maps.trajectory`, perhaps with `dea_maps.breakdown` and `dea_maps.physical`, or from
        `dea_maps.general_trajectory`; with two times or more.
    ax, units, size
        As in `dea_maps.charts.phase_diagram`.
    variable : str
        What to draw: a variable along ``time``, for example ``margin`` or ``true_field``; by default ``stretch``, in
        the general model ``stretch_1``.

    Returns
    -------
    Axes

    Raises
    ------
    TypeError, ValueError
        If the data set lacks `variable`, or it is not along ``time``; if an option is not one of those allowed.

    Examples
    --------
    >>> import dea_maps as dm, numpy as np
    >>> ds = dm.trajectory(dm.Step(), time=np.linspace(0, 5, 51), field=[0.9, 1.2, 1.5], modulus_ratio=4.0)
    >>> trajectories(ds).get_ylabel()
    'stretch $\\lambda$'
    """
    check_variables(ds, "time", what="a chart of trajectories")
    along_time = [str(name) for name, values in ds.data_vars.items() if "time" in values.dims]
    if variable is None:
        variable = "stretch_1" if "stretch_1" in along_time else "stretch"
    check_choice("variable", variable, along_time)
    if ds.sizes["time"] < 2:
        raise ValueError(f"a chart of trajectories needs two times or more; got {ds.sizes['time']}")
    units = units_of(ds, units)
    ax = axes_for(ax, size)
    ds = ds.sortby("time")
    parameters = [shown(ds, name, units) for name in varying(ds)]
    y, time = shown(ds, variable, units), _set_time(ax, shown(ds, "time", units))
    ax.set_ylabel(y.label)
    films = _films(ds, variable)
    handles, ended = [], set()
    for number, film in enumerate(films):
        curve, x = y.values.isel(film).values, time.values.values
        how, when, value = _end(ds.isel(film), variable)
        when, value = when * time.per(ds["time"]), value * y.per(ds[variable])
        alive = np.isfinite(curve) & (x < when)
        x, curve = x[alive], curve[alive]
        if np.isfinite(value) and when <= float(time.values[-1]):
            x, curve = np.append(x, when), np.append(curve, value)
            ax.plot(max(when, ax.get_xlim()[0]), value, **_mark(ax, how))
            ended.add(how)
        values = [float(parameter.values.isel(film, missing_dims="ignore")) for parameter in parameters]
        label = ", ".join(f"{value:.4g}" for value in values)
        (line,) = ax.plot(x, curve, label=label, **curve_style(ax, number, len(films), ds.sizes["time"]))
        if len(films) > 1:
            handles.append(line)
    handles += [Line2D([], [], label=how, **_mark(ax, how)) for how in _ENDS if how in ended]
    add_heading(ax, title_of(ds, units), handles, ", ".join(parameter.label for parameter in parameters))
    return ax


def _mark(ax: Axes, how: str) -> dict[str, Any]:
    """Return the look of an end of a curve."""
    size = text_size(ax)
    return {
        "color": "black",
        "linestyle": "",
        "marker": _ENDS[how],
        "markersize": 0.9 * size,
        "markeredgewidth": line_width(ax, 1.8 if _ENDS[how] == "x" else 0.6),
        "zorder": 3,
        "clip_on": False,
    }


def _end(film: xr.Dataset, variable: str) -> tuple[str, float, float]:
    """Return how and when the curve of a film ends, and the variable then; infinite and NaN where that is not known."""
    if {"first_limit", "time_to_breakdown"} <= film.keys() and flagged(film["first_limit"], "breakdown"):
        when, value = float(film["time_to_breakdown"]), np.nan
        if _AT_BREAKDOWN.get(variable) in film:
            value = float(film[_AT_BREAKDOWN[variable]])
        elif when > 0.0:  # at once is while the field is switched on, which is before the first of the times
            value = float(np.interp(when, film["time"], film[variable], left=np.nan))
        return "electrical breakdown", when, value
    if "time_to_failure" not in film or not np.isfinite(film["time_to_failure"]):
        return "", np.inf, np.nan
    value = 0.0 if variable == "margin" else float(film.get(_AT_FAILURE.get(variable, ""), np.nan))
    return "failure", float(film["time_to_failure"]), value


def _set_time(ax: Axes, time: Shown) -> Shown:
    """Set the axis of time, and return the times as it has them."""
    values = time.values.values
    positive = np.unique(values[values > 0.0])
    if on_log_axis(positive):
        ax.set_xscale("log")
        ax.set_xlim(positive[0], positive[-1])
    else:
        long = [scale for scale in _LONG_TIMES if time.unit == "s" and values[-1] >= scale[0]]
        if long:
            _, seconds, unit = long[0]
            time = Shown(time.values / seconds, f"time ({unit})", time.symbol, unit)
        ax.set_xlim(float(time.values[0]), float(time.values[-1]))
    ax.set_xlabel(time.label)
    return time


def _films(ds: xr.Dataset, variable: str) -> list[dict[str, int]]:
    """Return where at most so many films are as there are markers."""
    sizes = {str(dim): size for dim, size in ds[variable].sizes.items() if dim != "time"}
    every = list(itertools.product(*(range(size) for size in sizes.values())))
    return [dict(zip(sizes, every[index], strict=True)) for index in evenly(len(every), len(MARKERS))]
