"""Regions of a map: their looks, their borders, their names in place."""

from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Colormap, ListedColormap, Normalize
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.text import Text
from scipy import ndimage

from ..outcomes import Outcome
from .boundaries import Outcomes
from .layout import line_width, text_size
from .placement import place_inside
from .plane import BREAKS_DOWN, Curves, Plane

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
Masked: TypeAlias = "np.ma.MaskedArray[Any, Any]"

COLOURS: Colormap = ListedColormap(colormaps["viridis"](np.linspace(0.25, 1.0, 256)), name="time to failure")
"""Luminance rises all along, and nowhere is so dark that a black line is not seen."""

LOOKS: Mapping[int, dict[str, Any]] = {
    Outcome.SURVIVES: {"facecolor": "0.94", "edgecolor": "black"},
    Outcome.FAILS_AT_ONCE: {"facecolor": "0.75", "edgecolor": "0.45", "hatch": "////"},
    Outcome.UNRESOLVED: {"facecolor": "black", "edgecolor": "black"},
    BREAKS_DOWN: {"facecolor": "white", "edgecolor": "0.4", "hatch": "xxx"},
}

_VALUES, _CURVES, _CELLS = 0.5, 0.6, 0.7
"""What lies upon what; lines lie just above what they border."""


def words_for(region: int) -> str:
    """Return the name of a region."""
    return "breaks down first" if region == BREAKS_DOWN else Outcome(region).name.lower().replace("_", " ")


def paint_values(
    ax: Axes, plane: Plane, regions: Iterable[int], x_edges: Floats, y_edges: Floats, norm: Normalize
) -> Masked:
    """Paint the values of some regions in colours.

    Where curves bound regions, colours reach up to them, and no steps are seen.

    Parameters
    ----------
    ax : Axes
        With its final scales and limits.
    plane : Plane
        The map.
    regions : iterable of int
        Whose values.
    x_edges, y_edges : ndarray
        Of the cells.
    norm : Normalize
        From values to colours.

    Returns
    -------
    (ny, nx) masked array
        The values.
    """
    regions = tuple(regions)
    values = shown = plane.only(*regions)
    # Where electrical breakdown comes first, the boundaries of the instability are not seen.
    order = _CELLS if BREAKS_DOWN in regions else _VALUES
    known = ~np.ma.getmaskarray(values)
    bounded = plane.curves is not None and BREAKS_DOWN not in regions and known.any()
    if bounded:
        nearest = ndimage.distance_transform_edt(~known, return_distances=False, return_indices=True)
        shown = np.ma.masked_where(plane.regions >= Outcome.UNRESOLVED, plane.values[tuple(nearest)])
    mesh = ax.pcolormesh(x_edges, y_edges, shown, norm=norm, cmap=COLOURS, rasterized=True, zorder=order)
    if bounded and plane.curves is not None:
        mesh.set_clip_path(_side(ax, plane.curves, Outcome.SURVIVES in regions))
    return values


def paint_regions(ax: Axes, plane: Plane, x_edges: Floats, y_edges: Floats, skipped: Iterable[int]) -> Floats:
    """Paint regions over the values of a map, and draw their borders.

    Where curves bound regions, these are drawn, and cells are not seen.

    Parameters
    ----------
    ax : Axes
        With its final scales and limits.
    plane : Plane
        The map.
    x_edges, y_edges : ndarray
        Of the cells.
    skipped : iterable of int
        Regions that are not painted, as their values are shown; their borders are drawn.

    Returns
    -------
    (n, 2) ndarray
        Points on the borders, in data coordinates.
    """
    skipped, by_cells = set(skipped), plane.regions
    lines = [] if plane.curves is None else plane.curves.points()
    if plane.curves is not None:
        _paint_sides(ax, plane.curves, skipped)
        by_cells = np.where(by_cells >= Outcome.UNRESOLVED, by_cells, Outcome.FAILS_LATER).astype(np.int8)
        skipped.add(Outcome.FAILS_LATER)
    for region in LOOKS.keys() - skipped:
        cells = _cells(x_edges, y_edges, by_cells == region)
        if len(cells):
            looks = LOOKS[region]
            ax.add_collection(
                PolyCollection(list(cells), **looks, linewidth=0.0, antialiased=False, rasterized=True, zorder=_CELLS),
                autolim=False,
            )
    edges = _borders(x_edges, y_edges, by_cells)
    width = line_width(ax, 1.2)
    ax.add_collection(
        LineCollection(list(edges), colors="black", linewidths=width, capstyle="projecting", zorder=_CELLS + 0.05),
        autolim=False,
    )
    return np.concatenate([edges.reshape(-1, 2), *lines])


def name_regions(
    ax: Axes, x: Floats, y: Floats, regions: Mapping[int, npt.NDArray[np.bool_]]
) -> tuple[list[Text], list[int]]:
    """Write the names of regions where they lie.

    Parameters
    ----------
    ax : Axes
        With its final scales, limits and position.
    x : (nx,) ndarray
    y : (ny,) ndarray
        Rising centres of the cells.
    regions : mapping of int to (ny, nx) ndarray of bool
        The cells of each region.

    Returns
    -------
    names : list of Text
        What was written.
    unnamed : list of int
        The regions that are there, but too small for a name.
    """
    names: list[Text] = []
    unnamed: list[int] = []
    for region, cells in regions.items():
        if not cells.any():
            continue
        ink = "white" if region == Outcome.UNRESOLVED else "black"
        name = ax.text(
            x[0], y[0], words_for(region), color=ink, ha="center", va="center", fontsize=0.95 * text_size(ax)
        )
        name.set_bbox({"facecolor": LOOKS[region]["facecolor"], "edgecolor": "none", "pad": 1.5})
        if place_inside(ax, name, x, y, cells):
            names.append(name)
        else:
            name.remove()
            unnamed.append(region)
    return names, unnamed


def patches(regions: Iterable[int]) -> list[Patch]:
    """Return what a legend shows for regions."""
    return [Patch(label=words_for(region), **LOOKS[region]) for region in regions]


def _paint_sides(ax: Axes, curves: Curves, skipped: Iterable[int]) -> None:
    """Paint what lies below the first curve and beyond the second, and the curves."""
    limits = ax.get_xlim() if curves.axis == "x" else ax.get_ylim()
    fill = ax.fill_betweenx if curves.axis == "x" else ax.fill_between
    for curve, region, frame in zip(
        (curves.survived, curves.at_once), (Outcome.SURVIVES, Outcome.FAILS_AT_ONCE), limits, strict=True
    ):
        inside = np.clip(curve, *limits)
        if region not in skipped and (inside != frame).any():
            fill(curves.places, inside, frame, **LOOKS[region], linewidth=0.0, zorder=_CURVES)
    for line in curves.points():
        look: dict[str, Any] = {"color": "black", "linewidth": line_width(ax, 1.2), "zorder": _CURVES + 0.05}
        ax.plot(*line.T, scalex=False, scaley=False, **look)


def _side(ax: Axes, curves: Curves, below: bool) -> PathPatch:
    """Return the part of axes on one side of the largest values that are survived."""
    limits = ax.get_xlim() if curves.axis == "x" else ax.get_ylim()
    inside, places = np.clip(curves.survived, *limits), curves.places
    frame = limits[0] if below else limits[1]
    corners = [[*inside, frame, frame], [*places, places[-1], places[0]]]
    return PathPatch(Path(np.transpose(corners if curves.axis == "x" else corners[::-1])), transform=ax.transData)


def _cells(x_edges: Floats, y_edges: Floats, region: npt.NDArray[np.bool_]) -> Floats:
    """Return (n, 4, 2) corners of the rectangles that cells side by side make."""
    steps = np.diff(np.pad(region, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, first = np.nonzero(steps == 1)
    return _corners(x_edges, y_edges, row, first, np.nonzero(steps == -1)[1])


def _corners(x_edges: Floats, y_edges: Floats, row: Indices, first: Indices, last: Indices) -> Floats:
    """Return (n, 4, 2) corners of rectangles in rows, from an edge to an edge."""
    left, right, low, high = x_edges[first], x_edges[last], y_edges[row], y_edges[row + 1]
    corners = [[left, low], [right, low], [right, high], [left, high]]
    return np.asarray(corners).transpose(2, 0, 1)


def _borders(x_edges: Floats, y_edges: Floats, regions: Outcomes) -> Floats:
    """Return (n, 2, 2) end points of the edges between cells of different regions."""
    row, column = np.nonzero(regions[:, 1:] != regions[:, :-1])
    x = x_edges[column + 1]
    upright = np.stack([[x, y_edges[row]], [x, y_edges[row + 1]]])
    row, column = np.nonzero(regions[1:] != regions[:-1])
    y = y_edges[row + 1]
    level = np.stack([[x_edges[column], y], [x_edges[column + 1], y]])
    return np.concatenate([upright, level], axis=2).transpose(2, 0, 1)
