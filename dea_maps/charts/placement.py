"""Where words fit on a chart: places in pixels, so that nothing overlaps."""

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from scipy import ndimage
from scipy.spatial import KDTree

Floats = npt.NDArray[np.float64]

_GRAIN = 2
"""Pixels between places that are tried."""


def place_inside(ax: Axes, words: Text, x: Floats, y: Floats, region: npt.NDArray[np.bool_]) -> bool:
    """Move words to where a region of cells is widest; upright where they do not fit level.

    Parameters
    ----------
    ax : Axes
        With its final scales, limits and position.
    words : Text
        Of these axes, centred on their position.
    x : (nx,) ndarray
    y : (ny,) ndarray
        Rising centres of the cells.
    region : (ny, nx) ndarray of bool
        The cells of the region.

    Returns
    -------
    bool
        Whether they fit. If not, they stay where they were.
    """
    frame = ax.get_window_extent()
    across = np.arange(frame.x0, frame.x1, _GRAIN)
    up = np.arange(frame.y0, frame.y1, _GRAIN)
    columns = _cells(ax.transData.transform(np.column_stack([x, np.full_like(x, y[0])]))[:, 0], across)
    rows = _cells(ax.transData.transform(np.column_stack([np.full_like(y, x[0]), y]))[:, 1], up)
    inside = np.pad(region[np.ix_(rows, columns)], 1)
    room = ndimage.distance_transform_edt(inside)
    for rotation in (0, 90):
        words.set_rotation(rotation)
        box = words.get_window_extent()
        size = (round(box.height / _GRAIN) + 4, round(box.width / _GRAIN) + 4)
        fits = ndimage.minimum_filter(inside, size=size, mode="constant", cval=False)
        if fits.any():
            places = np.argwhere(fits & (room >= 0.95 * room[fits].max()))
            off_centre = np.hypot(*(places - places.mean(axis=0)).T)
            row, column = places[np.argmin(off_centre)]
            x_words, y_words = ax.transData.inverted().transform((across[column - 1], up[row - 1]))
            words.set_position((x_words, y_words))
            return True
    return False


def place_on_line(
    ax: Axes, pieces: list[Floats], size: tuple[float, float], taken: list[Bbox], lines: Floats
) -> tuple[float, float] | None:
    """Find the place on a line that is farthest from its ends, from words that are there and from the frame.

    Parameters
    ----------
    ax : Axes
        With its final scales, limits and position.
    pieces : list of (n, 2) ndarray
        The line, in data coordinates.
    size : tuple of float
        Width and height of the label, in pixels.
    taken : list of Bbox
        Where there are words already, in pixels.
    lines : (n, 2) ndarray
        Points of other lines, in pixels, to which the label must keep its height.

    Returns
    -------
    tuple of float or None
        In data coordinates; None where there is no room.
    """
    width, height = size
    frame = ax.get_window_extent()
    others = KDTree(lines) if len(lines) else None
    best, place = 0.6 * width, None
    for piece in pieces:
        corners = ax.transData.transform(piece)
        lengths = np.concatenate([[0.0], np.hypot(*np.diff(corners, axis=0).T).cumsum()])
        along = np.linspace(0.0, lengths[-1], int(lengths[-1] / _GRAIN) + 2)
        points = np.column_stack([np.interp(along, lengths, corners[:, axis]) for axis in (0, 1)])
        horizontal, vertical = points.T
        room = np.minimum.reduce(
            [
                along,
                along[::-1],
                horizontal - frame.x0,
                frame.x1 - horizontal,
                vertical - frame.y0,
                frame.y1 - vertical,
            ]
        )
        for box in taken:
            beside = np.maximum.reduce([box.x0 - horizontal, horizontal - box.x1, np.zeros_like(along)])
            above = np.maximum.reduce([box.y0 - vertical, vertical - box.y1, np.zeros_like(along)])
            room = np.minimum(room, np.hypot(beside, above))
        if others is not None:
            room = np.where(others.query(points)[0] < height, 0.0, room)
        most = int(np.argmax(room))
        if room[most] > best:
            best, place = room[most], points[most]
    if place is None:
        return None
    x, y = ax.transData.inverted().transform(place)
    return float(x), float(y)


def _cells(centres: Floats, places: Floats) -> npt.NDArray[np.intp]:
    """Return in which cell each place lies; cells meet half way between their centres. All in pixels."""
    return np.searchsorted(0.5 * (centres[1:] + centres[:-1]), places)
