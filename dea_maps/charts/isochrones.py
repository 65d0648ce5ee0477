"""Isolines on a map, as those of equal time to failure, with their values written on them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from matplotlib.ticker import Locator, LogLocator, MaxNLocator
from matplotlib.transforms import Bbox

from .layout import figure_of, line_width, text_size
from .placement import place_on_line

Floats = npt.NDArray[np.float64]
_SHORT = 0.5
"""Of the longest piece of a line: shorter ones, which have no label, are left out."""

Span = tuple[float, float]
"""Shortest and longest time of the colours."""


def draw_isolines(
    ax: Axes,
    x: Floats,
    y: Floats,
    values: "np.ma.MaskedArray[Any, Any]",
    lines: Sequence[tuple[float, str]],
    taken: list[Bbox],
    borders: Floats,
) -> None:
    """Draw lines of equal value with words on them; a line that has no room for its words is left out.

    Parameters
    ----------
    ax : Axes
        With its final scales, limits and position.
    x : (nx,) ndarray
    y : (ny,) ndarray
        Rising centres of the cells.
    values : (ny, nx) masked array
        Between the centres they are taken to be linear.
    lines : sequence of tuple
        Rising values, each with its words.
    taken : list of Bbox
        Where there are words already, in pixels; those written are added.
    borders : (n, 2) ndarray
        Points of other lines on the map, in data coordinates.
    """
    known = values.compressed()
    lines = [line for line in lines if known.size and known.min() < line[0] < known.max()]
    if not lines:
        return
    width, size = line_width(ax, 0.9), 0.85 * text_size(ax)
    look: dict[str, Any] = {"colors": "black", "linestyles": "solid", "linewidths": width}
    # One set for each line: among several, releases of Matplotlib differ in how a label finds its own.
    contours = [ax.contour(x, y, values, levels=[level], **look) for level, _ in lines]
    paths = []
    for contour in contours:
        # At a border, where values change much from cell to cell, there are short pieces of lines that say nothing.
        paths.append(_long_pieces(ax, contour.get_paths()[0]))
        contour.set_paths([Path.make_compound_path(*map(Path, paths[-1]))])
    for number, (contour, (_, words)) in enumerate(zip(contours, lines, strict=True)):
        trial = ax.text(x[0], y[0], words, fontsize=size)
        box = trial.get_window_extent()
        trial.remove()
        pieces = [piece for other, path in enumerate(paths) if other != number for piece in path]
        others = ax.transData.transform(np.concatenate([*pieces, borders]))
        place = place_on_line(ax, paths[number], (box.width, box.height), taken, others)
        if place is not None:
            label = ax.clabel(contour, manual=[place], fmt=words, fontsize=size)[-1]
            label.set_path_effects([withStroke(linewidth=0.25 * size, foreground="white")])
            taken.append(label.get_window_extent())
        else:
            contour.remove()
            paths[number] = []


def _long_pieces(ax: Axes, path: Path) -> list[Floats]:
    """Return the pieces of a line that are longer than a word is, and no much shorter than the longest."""
    path.should_simplify = False  # it would be as if the data were pixels
    pieces = [np.asarray(piece) for piece in path.to_polygons(closed_only=False)]
    lengths = [np.hypot(*np.diff(ax.transData.transform(piece), axis=0).T).sum() for piece in pieces]
    least = max(2.0 * text_size(ax) * figure_of(ax).dpi / 72.0, _SHORT * max(lengths, default=0.0))
    return [piece for piece, length in zip(pieces, lengths, strict=True) if length > least]


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
    if decades >= 2:
        locator = LogLocator(numticks=9)
    elif decades >= 1:
        locator = LogLocator(subs=(1, 2, 5))
    else:
        locator = MaxNLocator(5, steps=[1, 2, 5, 10])
    ticks = np.asarray(locator.tick_values(least, greatest))
    return ticks[(ticks >= least) & (ticks <= greatest)]


def bar_ticks(span: Span) -> list[float]:
    """Return the times to name beside colours: few decades have few powers of ten."""
    return isochrone_levels(span).tolist() if span[1] < 100.0 * span[0] else []


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
