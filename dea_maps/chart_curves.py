"""Maps over one parameter as curves, and scattered samples as points."""

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm

from .chart_isochrones import Span
from .chart_plane import (
    COLOURS,
    FAILS_AT_ONCE,
    FAILS_LATER,
    LOOKS,
    SURVIVES,
    UNRESOLVED,
    log_spaced,
    name_regions,
    set_axis,
)
from .nomenclature import OUTCOMES, axis_label

_FEW = 40
"""So many points or fewer are marked on a curve."""

_MARKERS = {SURVIVES: "o", FAILS_AT_ONCE: "X", UNRESOLVED: "P"}


def draw_curves(axes: Sequence[Axes], ds: xr.Dataset, name: str) -> list[Artist]:
    """Draw time to failure and critical stretch over one parameter, one above the other.

    Parameters
    ----------
    axes : two Axes
        In their final places on the figure.
    ds : Dataset
        With ``time_to_failure``, ``critical_stretch`` and ``outcome`` over one dimension.
    name : str
        The parameter along it.

    Returns
    -------
    list of Artist
        For a legend: the outcomes whose stretches of the parameter are too narrow to be named in place.
    """
    ds = ds.sortby(name).load()
    x, outcome = ds[name].values, ds["outcome"].values
    curves = {
        "time_to_failure": ds["time_to_failure"].where(ds["outcome"] == FAILS_LATER).values,
        "critical_stretch": ds["critical_stretch"].values,
    }
    regions = {region: outcome == region for region in LOOKS}
    for ax, (variable, y) in zip(axes, curves.items(), strict=True):
        sides = np.repeat(set_axis(ax, "x", name, x), 2)[1:-1]
        ax.plot(x, y, color="black", linewidth=1.2, marker="." if len(x) <= _FEW else "")
        known = y[np.isfinite(y)]
        if variable == "time_to_failure" and known.size and known.max() > 10 * known.min() > 0:
            ax.set_yscale("log")
        ax.set_ylabel(axis_label(variable))
        for region, looks in LOOKS.items():
            ax.fill_between(
                sides,
                0,
                1,
                where=np.repeat(regions[region], 2),
                transform=ax.get_xaxis_transform(),
                zorder=0,
                **{**looks, "edgecolor": looks["edgecolor"] if "hatch" in looks else "none"},
            )
    upper = axes[0]
    upper.set_ylim(upper.get_ylim())
    in_two_rows = {region: np.vstack([cells, cells]) for region, cells in regions.items()}
    _, unnamed = name_regions(upper, x, np.array(upper.get_ylim()), in_two_rows)
    return unnamed


def draw_points(ax: Axes, ds: xr.Dataset, x_name: str, y_name: str, span: Span | None) -> list[Artist]:
    """Draw scattered samples over two parameters: time to failure in colour, other outcomes by their markers.

    Parameters
    ----------
    ax : Axes
        To draw in.
    ds : Dataset
        With ``time_to_failure`` and ``outcome``.
    x_name, y_name : str
        The parameters.
    span : tuple of float, or None
        Shortest and longest time of the colours; None where nothing fails later.

    Returns
    -------
    list of Artist
        For a legend: the markers.
    """
    together = xr.broadcast(*(ds[name] for name in (x_name, y_name, "time_to_failure", "outcome")))
    x, y, time, outcome = (array.values.ravel() for array in together)
    for which, name, values in (("x", x_name, x), ("y", y_name, y)):
        scale = "log" if log_spaced(np.unique(values)) else "linear"
        ax.set(**{f"{which}label": axis_label(name), f"{which}scale": scale})
    later = outcome == FAILS_LATER
    if span is not None:
        ax.scatter(
            x[later],
            y[later],
            c=time[later],
            norm=LogNorm(*span),
            cmap=COLOURS,
            edgecolor="black",
            linewidth=0.4,
        )
    handles: list[Artist] = []
    for region, marker in _MARKERS.items():
        where = outcome == region
        if where.any():
            words = OUTCOMES[region].replace("_", " ")
            face = LOOKS[region]["facecolor"]
            handles.append(
                ax.scatter(
                    x[where],
                    y[where],
                    marker=marker,
                    color=face,
                    edgecolor="black",
                    linewidth=0.8,
                    label=words,
                )
            )
    return handles
