"""Isochrones: lines of equal time to failure on a map, with the times written on them."""

from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke
from matplotlib.ticker import Locator, LogLocator, MaxNLocator
from matplotlib.transforms import Bbox

from .chart_placement import place_on_line

Floats = npt.NDArray[np.float64]
Span = tuple[float, float]
"""Shortest and longest time of the colours."""

_SIZE_OF_WORDS = 8


def draw_isochrones(
    ax: Axes,
    x: Floats,
    y: Floats,
    time: "np.ma.MaskedArray[Any, Any]",
    span: Span,
    taken: list[Bbox],
    borders: Floats,
) -> None:
    """Draw lines of equal time to failure and write the times on them, where there is room.

    Parameters
    ----------
    ax : Axes
        With its final scales, limits and position.
    x : (nx,) ndarray
    y : (ny,) ndarray
        Rising centres of the cells.
    time : (ny, nx) masked array
        Times to failure, above 0, masked where the film does not fail later.
    span : tuple of float
        Shortest and longest time of the colours.
    taken : list of Bbox
        Where there are words already, in pixels.
    borders : (n, 2) ndarray
        Points of other lines on the map, in data coordinates.
    """
    times = time.compressed()
    levels = isochrone_levels(span)
    levels = levels[(levels > times.min(initial=np.inf)) & (levels < times.max(initial=0.0))]
    if not levels.size:
        return
    taken = list(taken)
    logs = np.log10(levels)
    contours = ax.contour(x, y, np.ma.log10(time), levels=logs, colors="black", linestyles="solid", linewidths=0.8)
    lines = [[np.asarray(piece) for piece in path.to_polygons(closed_only=False)] for path in contours.get_paths()]
    for number, level in enumerate(levels):
        words = _time_in_words(level)
        trial = ax.text(x[0], y[0], words, fontsize=_SIZE_OF_WORDS)
        box = trial.get_window_extent()
        trial.remove()
        pieces = [piece for other, line in enumerate(lines) if other != number for piece in line]
        others = ax.transData.transform(np.concatenate([*pieces, borders]))
        place = place_on_line(ax, lines[number], (box.width, box.height), taken, others)
        if place is not None:
            label = ax.clabel(contours, [logs[number]], manual=[place], fmt=words, fontsize=_SIZE_OF_WORDS)[-1]
            label.set_path_effects([withStroke(linewidth=2.0, foreground="white")])
            taken.append(label.get_window_extent())


def isochrone_levels(span: Span) -> Floats:
    """Return round times within a scale: powers of ten, or also twice and five times them, or even steps.

    Examples
    --------
    >>> isochrone_levels((0.02, 5000.0)).tolist()
    [0.1, 1.0, 10.0, 100.0, 1000.0]
    """
    least, greatest = span
    decades = np.log10(greatest / least)
    locator: Locator
    if decades >= 3:
        locator = LogLocator(numticks=9)
    elif decades >= 1:
        locator = LogLocator(subs=(1, 2, 5))
    else:
        locator = MaxNLocator(5, steps=[1, 2, 5, 10])
    ticks = np.asarray(locator.tick_values(least, greatest))
    return ticks[(ticks >= least) & (ticks <= greatest)]


def _time_in_words(time: float) -> str:
    return f"{time:g}" if 1e-3 <= time < 1e5 else f"$10^{{{np.log10(time):.0f}}}$"
