"""Phase diagrams: time to failure in colour and isochrones, and the regions named in place."""

import numpy as np
import numpy.typing as npt
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from ..outcomes import Outcome
from ..sweeps.chunks import evenly
from .data import drawable, parameters_along, sizes_in_words
from .isochrones import Span, bar_ticks, draw_isolines, isochrone_levels, time_span
from .layout import add_colour_bar, add_heading, axes_for, figure_of, new_axes, settle, text_size
from .plane import Plane, plane_of, set_axes
from .program import small_course
from .regions import COLOURS, LOOKS, name_regions, paint_regions, paint_values, patches
from .units import Shown, shown, time_in_words, title_of, units_of

Floats = npt.NDArray[np.float64]

_MOST_PANELS = 4


def phase_diagram(ds: xr.Dataset, ax: Axes | None = None, *, units: str | None = None, size: str = "column") -> Axes:
    """Draw a map over two parameters.

    Time to failure is shown in colour and by isochrones; the regions where the film survives, fails at once, breaks
    down first or is unresolved are named in place. A small picture beside the title is the loading program at the
    middle of the parameters. Where regions end is found by `dea_maps.allowable`, not read off
    the cells, if one of the parameters is a field, a share or a time.

    Parameters
    ----------
    ds : Dataset
        From `dea_maps.sweep` or `dea_maps.physical`, with two dimensions longer than 1.
    ax : Axes, optional
        Where to draw; the colour bar takes its room off it. By default on a new figure, ``ax.figure``.
    units : {"tau", "si"}, optional
        Ratios and relaxation times, or volts and seconds; by default the latter where `ds` has them.
    size : {"column", "slide"}
        Of a new figure.

    Returns
    -------
    Axes

    Raises
    ------
    TypeError, ValueError
        If the data set is not a map over two parameters, or lacks ``time_to_failure`` or ``outcome``; if an option is
        not one of those above.

    Examples
    --------
    >>> import dea_maps as dm, numpy as np
    >>> ds = dm.sweep(dm.Step(), field=np.linspace(0.9, 2.1, 25), modulus_ratio=np.linspace(2, 5, 19))
    >>> phase_diagram(ds).get_xlabel()
    'field $E/E_c$'
    >>> phase_diagram(dm.physical(ds, dm.VHB, 100e-6)).get_xlabel()
    'voltage (kV)'
    """
    ds = drawable(ds, "time_to_failure")
    along = parameters_along(ds)
    if along is None or len(along) != 2:
        raise ValueError(
            f"a phase diagram needs two dimensions, each along one parameter; got {sizes_in_words(ds)}: "
            "select values with ds.sel or ds.isel"
        )
    units = units_of(ds, units)
    ax = axes_for(ax, size)
    x, y = along.items()
    time = shown(ds, "time_to_failure", units)
    plane = plane_of(ds, x, y, time.values, units)
    span = time_span(plane.only(Outcome.FAILS_LATER).compressed())
    borders = _paint(ax, plane, span)
    _add_bar([ax], [plane], span, time)
    course = small_course(ds)
    add_heading(ax, title_of(ds, units), course=course)
    places_x, places_y, regions = plane.fine()
    places = {region: regions == region for region in LOOKS}
    names, unnamed = name_regions(ax, places_x, places_y, places)
    for name in names:  # a trial: a legend for the others takes room
        name.remove()
    if unnamed:
        add_heading(ax, title_of(ds, units), patches(unnamed), course=course)
    _write(ax, plane, span, time.unit, unnamed, borders)
    return ax


def phase_panels(ds: xr.Dataset, size: str) -> Figure:
    """Draw up to four phase diagrams of a map over three parameters.

    They are for some values of the shortest dimension, or of the last of equally short ones.

    Parameters
    ----------
    ds : Dataset
        With three dimensions, each along one parameter.
    size : {"column", "slide"}
        Of the figure.
    """
    ds = drawable(ds, "time_to_failure")
    along = parameters_along(ds)
    assert along is not None
    units = units_of(ds, None)
    dims = list(along)
    across = min(reversed(dims), key=lambda dim: ds.sizes[dim])
    x, y = ((dim, along[dim]) for dim in dims if dim != across)
    chosen = np.argsort(ds[along[across]].values)[evenly(ds.sizes[across], _MOST_PANELS)]
    time, value = shown(ds, "time_to_failure", units), shown(ds, along[across], units)
    planes = [plane_of(ds.isel({across: index}), x, y, time.values.isel({across: index}), units) for index in chosen]
    span = time_span(np.concatenate([plane.only(Outcome.FAILS_LATER).compressed() for plane in planes]))
    rows = 2 if len(planes) == 4 else 1
    axes = new_axes(size, rows, len(planes) // rows, tall=2.0 if rows == 2 else 1.0)
    figure, text = figure_of(axes[0]), text_size(axes[0])
    borders = []
    for ax, plane, index in zip(axes, planes, chosen, strict=True):
        ax.set_title(f"{value.label.removesuffix(f' ({value.unit})')} = "
                     f"{value.in_words(float(value.values[index]))}", fontsize=text)  # fmt: skip
        borders.append(_paint(ax, plane, span))
        ax.label_outer()
    _add_bar(axes, planes, span, time)
    figure.suptitle(", ".join(title_of(ds, units)), x=0.01, ha="left", fontsize=text)
    settle(axes[0])
    unnamed = []
    for ax, plane, lines in zip(axes, planes, borders, strict=True):
        unnamed.append(_write(ax, plane, span, time.unit, [], lines))
    missing = sorted(set().union(*unnamed))
    if missing:
        handles: list[Artist] = [*patches(missing)]
        figure.legend(handles=handles, loc="upper right", ncols=3, frameon=False, fontsize=text)
    return figure


def _paint(ax: Axes, plane: Plane, span: Span | None) -> Floats:
    """Draw colours and regions; return points on the borders."""
    x_edges, y_edges = set_axes(ax, plane)
    if span is not None:
        paint_values(ax, plane, [Outcome.FAILS_LATER], x_edges, y_edges, LogNorm(*span))
    return paint_regions(ax, plane, x_edges, y_edges, [Outcome.FAILS_LATER])


def _add_bar(axes: list[Axes], planes: list[Plane], span: Span | None, time: Shown) -> None:
    if span is not None:
        times = np.concatenate([plane.only(Outcome.FAILS_LATER).compressed() for plane in planes])
        add_colour_bar(axes, LogNorm(*span), COLOURS, time.label, times, bar_ticks(span))


def _write(ax: Axes, plane: Plane, span: Span | None, unit: str, unnamed: list[int], borders: Floats) -> list[int]:
    """Write names of regions, and isochrones with their times; return the regions without a name."""
    x, y, regions = plane.fine()
    places = {region: regions == region for region in LOOKS if region not in unnamed}
    names, more = name_regions(ax, x, y, places)
    if span is not None:
        times = [(np.log10(level), time_in_words(level, unit)) for level in isochrone_levels(span)]
        taken = [name.get_window_extent() for name in names]
        logs = np.ma.log10(plane.only(Outcome.FAILS_LATER))
        draw_isolines(ax, plane.x.values.values, plane.y.values.values, logs, times, taken, borders)
    return [*unnamed, *more]
