"""Looks of several curves on one chart, told apart in colour and in grey."""

from typing import Any

from matplotlib import colormaps
from matplotlib.axes import Axes

from .layout import line_width, text_size

MARKERS = "osD^vPX*"
"""As many curves as a chart may have."""

_BRIGHTEST = 0.82
"""The lighter end of the colours would not be seen on white."""

_MARKER_GAP = 0.15
"""Between the markers of a curve, in diagonals of the axes; those of other curves lie elsewhere."""


def curve_style(ax: Axes, index: int, count: int) -> dict[str, Any]:
    """Return the look of one of several curves: the later, the lighter, each with a marker of its own.

    Parameters
    ----------
    ax : Axes
        Of the curve.
    index, count : int
        Which curve, and of how many; at most as many as `MARKERS`.
    """
    if count == 1:
        return {"color": "black", "linewidth": line_width(ax, 1.4)}
    return {
        "color": colormaps["viridis"](_BRIGHTEST * index / (count - 1)),
        "linewidth": line_width(ax, 1.4),
        "marker": MARKERS[index],
        "markersize": 0.5 * text_size(ax),
        "markevery": (_MARKER_GAP * (index + 0.5) / count, _MARKER_GAP),
    }
