"""Names of curves beside their ends."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

from .layout import figure_of, line_width, settle, shrink, text_size

Floats = npt.NDArray[np.float64]

_SIZE = 0.9
"""Of the names, in that of the other words."""

_LARGEST_PART = 0.4
"""Of the width of axes that names may take."""


def fit_beside(ax: Axes, words: Sequence[str]) -> bool:
    """Tell whether words right of axes leave most of the width to the curves.

    Parameters
    ----------
    ax : Axes
        With its labels, before anything is written at its right.
    words : sequence of str
        One for each curve.
    """
    settle(ax)
    return _room(ax, words) <= _LARGEST_PART * ax.get_window_extent().width


def label_ends(ax: Axes, ends: Sequence[tuple[float, float]], words: Sequence[str]) -> None:
    """Write words beside the ends of curves, right of axes, as high as the ends where there is room.

    Parameters
    ----------
    ax : Axes
        With its final scales and limits.
    ends : sequence of tuple of float
        Where the curves end, in data coordinates.
    words : sequence of str
        One for each.
    """
    text, figure = _SIZE * text_size(ax), figure_of(ax)
    if figure.get_layout_engine() is None:
        shrink(ax, right=_room(ax, words))
    frame = ax.get_window_extent()
    wanted = ax.transData.transform(np.asarray(ends, float))[:, 1] - frame.y0
    heights = _spread(wanted, 1.3 * _gap(ax), frame.height)
    for line, end, high in zip(words, ends, heights, strict=True):
        ax.annotate(
            line,
            end,
            (1.0 + _gap(ax) / frame.width, high / frame.height),
            textcoords="axes fraction",
            fontsize=text,
            va="center",
            annotation_clip=False,
            arrowprops={
                "arrowstyle": "-",
                "color": "0.5",
                "lw": line_width(ax, 0.6),
                "shrinkA": 1,
                "shrinkB": 2,
                "relpos": (0.0, 0.5),
            },
        )
    settle(ax)


def _room(ax: Axes, words: Sequence[str]) -> float:
    """Return how wide the names are with the gap before them, in pixels."""
    text = _SIZE * text_size(ax)
    trials = [ax.text(1.0, 0.0, line, transform=ax.transAxes, fontsize=text) for line in words]
    room = max(trial.get_window_extent().width for trial in trials) + 2.0 * _gap(ax)
    for trial in trials:
        trial.remove()
    return float(room)


def _gap(ax: Axes) -> float:
    """Return how far from axes a name begins, in pixels."""
    return _SIZE * text_size(ax) * figure_of(ax).dpi / 72.0


def _spread(wanted: Floats, gap: float, top: float) -> Floats:
    """Return heights near those wanted, a gap apart, from 0 to a top if there is room."""
    order = np.argsort(wanted, kind="stable")
    places = wanted[order]
    for index in range(1, len(places)):
        places[index] = max(places[index], places[index - 1] + gap)
    places[-1:] = np.minimum(places[-1:], top)
    for index in range(len(places) - 2, -1, -1):
        places[index] = min(places[index], places[index + 1] - gap)
    found = np.empty_like(places)
    found[order] = places
    return found
