"""Looks of several curves on one chart, told apart in colour and in grey."""

from typing import Any

from matplotlib import colormaps
from matplotlib.axes import Axes

from .layout import line_width, text_size

DOTS = (0, (1.0, 3.0))
"""Line that joins points to guide the eye, where no curve was computed."""

MARKERS = "osD^vPX*"
"""As many curves as a chart may have."""

_BRIGHTEST = 0.82
"""The lighter end of the colours would not be seen on white."""

_MARKER_GAP = 0.15
"""Between the markers of a curve, in diagonals of the axes; those of other curves lie elsewhere."""


_FEW, _MANY = 12, 40
"""So many computed values or fewer are points and no curve; more than so many are a curve with some markers on it."""


def curve_style(ax: Axes, index: int, count: int, points: int) -> dict[str, Any]:
    """Return the look of one of several curves: the later, the lighter, each with a marker of its own.

    Few computed values are points that a dotted line joins to guide the eye; up to 40 are marked on their curve.

    Parameters
    ----------
    ax : Axes
        Of the curve.
    index, count : int
        Which curve, and of how many; at most as many as `MARKERS`.
    points : int
        How many values were computed.
    """
    few = points <= _FEW
    style: dict[str, Any] = {
        "color": colormaps["viridis"](_BRIGHTEST * index / max(count - 1, 1)) if count > 1 else "black",
        "linewidth": line_width(ax, 0.7 if few else 1.4),
        "linestyle": DOTS if few else "-",
    }
    if count > 1 or points <= _MANY:
        style |= {"marker": MARKERS[index], "markersize": (0.5 if few or count > 1 else 0.35) * text_size(ax)}
    if points > _MANY and count > 1:
        style["markevery"] = (_MARKER_GAP * (index + 0.5) / count, _MARKER_GAP)
    return style


def joined(points: int) -> bool:
    """Return whether so many computed values are drawn as a curve."""
    return points > _FEW
