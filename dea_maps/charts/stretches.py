"""The largest stretch of a film: before it fails, or as t -> infinity where it survives."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.ticker import MaxNLocator

from ..outcomes import Outcome
from .curves import head_over_regions, points_of, shade_regions
from .data import drawable, parameters_along, sizes_in_words
from .isochrones import draw_isolines
from .layout import add_colour_bar, add_heading, axes_for, line_width
from .plane import BREAKS_DOWN, plane_of, regions_of, set_axes
from .regions import COLOURS, LOOKS, name_regions, paint_regions, paint_values, patches
from .units import shown, title_of, units_of

_GROUPS = ((Outcome.FAILS_LATER, Outcome.FAILS_AT_ONCE), (Outcome.SURVIVES,), (BREAKS_DOWN,))
"""Outcomes within which the stretch does not jump."""

_ENDS = ("at failure", "fully relaxed", "at breakdown")
_LABEL = r"largest stretch $\lambda$"


def stretch_chart(ds: xr.Dataset, ax: Axes | None = None, *, units: str | None = None, size: str = "column") -> Axes:
    r"""Draw the largest stretch of a film: at failure, or after full relaxation where it survives.

    Over two parameters it is a map with lines of equal stretch, over one a curve. From the largest field that a film
    survives to the next larger one, the stretch jumps.

    Parameters
    ----------
    ds : Dataset
        From `dea_maps.sweep` or `dea_maps.physical`, with one or two dimensions longer than 1.
    ax, units, size
        As in `dea_maps.charts.phase_diagram`.

    Returns
    -------
    Axes

    Raises
    ------
    TypeError, ValueError
        If the data set is not a map over one or two parameters, or lacks ``critical_stretch``, ``final_stretch`` or
        ``outcome``; if an option is not one of those allowed.

    Examples
    --------
    >>> import dea_maps as dm, numpy as np
    >>> ds = dm.sweep(dm.Step(), field=np.linspace(0.5, 2.1, 25), modulus_ratio=np.linspace(2, 5, 19))
    >>> stretch_chart(ds).get_ylabel()
    'modulus ratio $\\mu_U/\\mu_R$'
    """
    ds = drawable(ds, "critical_stretch", "final_stretch", what="a stretch chart")
    along = parameters_along(ds)
    if along is None or len(along) not in (1, 2):
        raise ValueError(
            f"a stretch chart needs one or two dimensions, each along one parameter; got {sizes_in_words(ds)}: "
            "select values with ds.sel or ds.isel"
        )
    units = units_of(ds, units)
    ax = axes_for(ax, size)
    if len(along) == 1:
        _curve(ax, ds, next(iter(along.values())), units)
    else:
        _map(ax, ds, along, units)
    return ax


def _curve(ax: Axes, ds: xr.Dataset, name: str, units: str) -> None:
    ds = ds.sortby(name)
    x = shown(ds, name, units).values.values
    for words, style, stretch in zip(_ENDS, ("-", "--", ":"), _stretches(ds), strict=True):
        if stretch.notnull().any():
            line = {"color": "black", "linewidth": line_width(ax, 1.2), **points_of(ax, x, style)}
            ax.plot(x, stretch.values, label=words, **line)
    ax.set(ylabel=_LABEL)
    edges = shade_regions(ax, ds, name, units)
    head_over_regions(ax, title_of(ds, units), edges, regions_of(ds), list(ax.lines))


def _stretches(ds: xr.Dataset) -> tuple[xr.DataArray, ...]:
    """Return the largest stretch of films that fail, survive or break down, each NaN elsewhere."""
    broken = xr.DataArray(regions_of(ds) == BREAKS_DOWN, dims=ds["outcome"].dims)
    at_breakdown = (
        ds["breakdown_stretch"] if "breakdown_stretch" in ds else xr.full_like(ds["critical_stretch"], np.nan)
    )
    survives = (ds["outcome"] == Outcome.SURVIVES) & ~broken
    return ds["critical_stretch"].where(~broken), ds["final_stretch"].where(survives), at_breakdown.where(broken)


def _map(ax: Axes, ds: xr.Dataset, along: dict[str, str], units: str) -> None:
    x, y = along.items()
    at_failure, relaxed, at_breakdown = _stretches(ds)
    stretch = at_failure.fillna(relaxed).fillna(at_breakdown)
    plane = plane_of(ds, x, y, stretch, units)
    x_edges, y_edges = set_axes(ax, plane)
    shown_regions = [region for group in _GROUPS for region in group if plane.only(region).count()]
    known = plane.only(*shown_regions).compressed()
    groups = []
    if known.size:
        norm = Normalize(known.min(), known.max())
        groups = [paint_values(ax, plane, group, x_edges, y_edges, norm) for group in _GROUPS]
        add_colour_bar([ax], norm, COLOURS, _LABEL, known)
    borders = paint_regions(ax, plane, x_edges, y_edges, shown_regions)
    add_heading(ax, title_of(ds, units))
    fine_x, fine_y, regions = plane.fine()
    places = {region: regions == region for region in LOOKS}
    names, unnamed = name_regions(ax, fine_x, fine_y, places)
    if unnamed:
        for name in names:
            name.remove()
        add_heading(ax, title_of(ds, units), patches(unnamed))
        names, _ = name_regions(ax, fine_x, fine_y, {key: places[key] for key in places if key not in unnamed})
    taken = [name.get_window_extent() for name in names]
    levels = MaxNLocator(8, steps=[1, 2, 2.5, 5, 10]).tick_values(known.min(), known.max()) if known.size else []
    for values in groups:
        lines = [(float(level), f"{level:.4g}") for level in levels]
        draw_isolines(ax, plane.x.values.values, plane.y.values.values, values, lines, taken, borders)
