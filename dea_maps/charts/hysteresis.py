"""Hysteresis loops: stretch against field in the first cycles of a repeated program, and in the last."""

from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from ..checks import brief
from ..outcomes import Outcome
from ..program_text import program_of
from ..sweeps.loading import repetition_starts, repetitions_before
from .data import check_variables
from .layout import add_heading, axes_for, line_width, text_size
from .units import shown, title_of, units_of

Floats = npt.NDArray[np.float64]

_NEEDED = ("time", "stretch", "applied_field", "outcome", "modulus_ratio")
_STYLES = ("--", "-.", ":", (0, (5.0, 1.0, 1.0, 1.0, 1.0, 1.0)))
"""Of the first cycles, so many at most."""

_BRIGHTEST = 0.75
_SAME = 1e-3
"""A cycle is the limit cycle if its extremes are those of the limit cycle within this share."""

_ROUNDING = 1e-9


def hysteresis_loops(
    ds: xr.Dataset,
    ax: Axes | None = None,
    *,
    cycles: int = 3,
    units: str | None = None,
    size: str = "column",
) -> Axes:
    r"""Draw stretch against field of one film: the first cycles of its loading program, and the last one.

    The last cycle is called the limit cycle where its extremes are ``steady_stretch_max`` and ``steady_stretch_min``
    within 0.1 %. A cross is failure. Of a program that is not repeated the whole course is drawn.

    Parameters
    ----------
    ds : Dataset
        From `dea_maps.trajectory`, of one film, perhaps with `dea_maps.physical`; with some tens of times in each cycle
        that is to be seen. Cycles without times are not drawn.
    ax, units, size
        As in `dea_maps.charts.phase_diagram`.
    cycles : int
        How many of the first cycles to draw, from 1 to 4.

    Returns
    -------
    Axes

    Raises
    ------
    TypeError, ValueError
        If the data set is no trajectory of one film, or does not name its program; if an option is not one of those
        allowed.

    Examples
    --------
    >>> import dea_maps as dm, numpy as np
    >>> times = np.concatenate([np.linspace(0, 3, 151), np.linspace(60, 61, 51)])
    >>> ds = dm.trajectory(dm.TriangleTrain(), time=times, field=1.3, period=1.0, modulus_ratio=4.0)
    >>> [line.get_label() for line in hysteresis_loops(ds, cycles=2).lines]
    ['cycle 1', 'cycle 2', 'limit cycle']
    """
    check_variables(ds, *_NEEDED, what="a chart of hysteresis loops")
    if isinstance(cycles, bool) or not isinstance(cycles, int) or not 1 <= cycles <= len(_STYLES):
        raise ValueError(f"cycles must be a whole number from 1 to {len(_STYLES)}; got {brief(cycles)}")
    ds = ds.squeeze([dim for dim, length in ds.sizes.items() if length == 1 and dim != "time"])
    if ds["stretch"].dims != ("time",):
        sizes = ", ".join(f"{dim} {ds.sizes[dim]}" for dim in ds["stretch"].dims if dim != "time") or "none"
        raise ValueError(f"a chart of hysteresis loops needs one film along time; got {sizes}: select one with ds.isel")
    units = units_of(ds, units)
    ax = axes_for(ax, size)
    ds = ds.sortby("time")
    x, y = shown(ds, "applied_field", units), shown(ds, "stretch", units)
    ax.set(xlabel=x.label, ylabel=y.label)
    parts = _cycles(ds)
    numbers = sorted(parts)
    chosen = [number for number in numbers if number < cycles]
    last = numbers[-1:] if numbers and numbers[-1] >= cycles else []
    failed = _failure(ds, x.per(ds["applied_field"]))
    handles: list[Artist] = []
    for number in [*chosen, *last]:
        where = parts[number]
        label = "limit cycle" if _is_limit(ds, where) else f"cycle {number + 1}"
        if len(numbers) == 1 and number == 0 and label != "limit cycle":
            label = "_course"
        final = number in last or len(numbers) == 1
        shade = colormaps["viridis"](_BRIGHTEST * number / max(cycles - 1, 1))
        field, stretch = x.values.values[where], y.values.values[where]
        if failed and number == numbers[-1]:
            field, stretch = np.append(field, failed[0][0]), np.append(stretch, failed[0][1])
        (line,) = ax.plot(
            field,
            stretch,
            color="black" if final else shade,
            linestyle="-" if final else _STYLES[number],
            linewidth=line_width(ax, 1.8 if final else 1.2),
            label=label,
        )
        handles += [] if label.startswith("_") else [line]
    for place in failed:
        look: dict[str, Any] = {"color": "black", "linestyle": "", "marker": "x", "markersize": 0.9 * text_size(ax)}
        look["markeredgewidth"] = line_width(ax, 1.8)
        ax.plot(*place, zorder=3, **look)
        handles.append(Line2D([], [], label="failure", **look))
    add_heading(ax, title_of(ds, units), handles)
    return ax


def _cycles(ds: xr.Dataset) -> dict[int, npt.NDArray[np.bool_]]:
    """Return which times are in which cycle, its ends included; a cycle has two times or more before failure."""
    program, time = program_of(ds.attrs), ds["time"].values.astype(np.float64)
    alive = np.isfinite(ds["stretch"].values)
    if program.repeats == 1:
        return {0: alive}
    names = (*program.parameters, "modulus_ratio")
    given = {name: np.array([float(ds[name])]) for name in names}
    found: dict[int, npt.NDArray[np.bool_]] = {}
    for number in np.unique(repetitions_before(program, given, time)).tolist():
        begin, end = repetition_starts(program, given, np.array([number, number + 1.0]))
        margin = _ROUNDING * (end - begin) + 4.0 * np.spacing(time)
        where = (time >= begin - margin) & (time <= end + margin) & alive
        if where.sum() > 1:
            found[int(number)] = where
    return found


def _is_limit(ds: xr.Dataset, where: npt.NDArray[np.bool_]) -> bool:
    """Tell whether a cycle has the extremes of the limit cycle."""
    if int(ds["outcome"]) != Outcome.SURVIVES or "steady_stretch_max" not in ds:
        return False
    stretch = ds["stretch"].values[where]
    extremes = np.array([float(ds["steady_stretch_max"]), float(ds["steady_stretch_min"])])
    return bool((np.abs(np.array([stretch.max(), stretch.min()]) - extremes) <= _SAME * extremes).all())


def _failure(ds: xr.Dataset, field: float) -> list[tuple[float, float]]:
    """Return field, in units of a chart, and stretch at failure, if that is within the times."""
    if int(ds["outcome"]) != Outcome.FAILS_LATER or not float(ds["time_to_failure"]) <= float(ds["time"].values[-1]):
        return []
    return [(field * float(ds["critical_field"]), float(ds["critical_stretch"]))]
