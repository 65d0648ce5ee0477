"""Charts of maps: which one suits a data set, its layout, and its file."""

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .chart_curves import draw_curves, draw_points
from .chart_layout import add_colour_bar, add_legend, figure_of, panels
from .chart_plane import draw_plane, evenly, plane_of, time_span
from .nomenclature import NOMENCLATURE, PARAMETERS, axis_label
from .storage import PathLike, check_writable, replacing

SUFFIXES = (".png", ".svg", ".pdf")
"""Kinds of files that a chart can be written as."""

_MOST_PANELS = 4
_DOTS_PER_INCH = 200


def phase_diagram(ds: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw a map over two parameters.

    Time to failure is shown in colour and by isochrones; the regions where the film survives, fails at once
    or is unresolved are named in place.

    Parameters
    ----------
    ds : Dataset
        From a sweep, with two dimensions longer than 1.
    ax : Axes, optional
        Where to draw, in its final place on its figure; by default on a new figure, ``ax.figure``.

    Returns
    -------
    Axes

    Raises
    ------
    ValueError
        If the data set is not a map over two parameters, or lacks ``time_to_failure`` or ``outcome``.

    Examples
    --------
    >>> import dea_maps as dm, numpy as np
    >>> ds = dm.sweep(dm.Step(), field=np.linspace(0.9, 2.1, 25), modulus_ratio=np.linspace(2, 5, 19))
    >>> phase_diagram(ds).get_xlabel()
    'field $E/E_c$'
    """
    ds = _drawable(ds)
    along = _parameters_along(ds)
    if along is None or len(along) != 2:
        raise ValueError(
            f"a phase diagram needs two dimensions, each along one parameter; got {_in_words(ds)}: "
            "select values with ds.sel or ds.isel"
        )
    if ax is None:
        ax = panels(1, 1, 4.6, 3.6)[0]
    x, y = along.items()
    plane = plane_of(ds, x, y)
    span = time_span(plane.time)
    add_colour_bar([ax], span, plane.time)
    ax.set_title(_title(ds), loc="left", fontsize=10)
    add_legend(ax, draw_plane(ax, plane, span))
    return ax


def plot(ds: xr.Dataset, path: PathLike) -> None:
    """Draw the chart that suits a map and write it to a file.

    One parameter gives curves, two a phase diagram, three up to four phase diagrams side by side, and
    scattered samples give points over the first two parameters that vary.

    Parameters
    ----------
    ds : Dataset
        From a sweep.
    path : str or path-like
        The file to write or replace, a PNG, SVG or PDF by its suffix.

    Raises
    ------
    ValueError
        If the suffix is another one, or there is no chart for the data set.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import dea_maps as dm, os, tempfile
    >>> ds = dm.sweep(dm.Ramp(), rate=[0.1, 1.0, 10.0], modulus_ratio=4.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     plot(ds, os.path.join(folder, "chart.svg"))
    ...     os.listdir(folder)
    ['chart.svg']
    """
    check_chart_path(path)
    save(draw(ds), path)


def check_chart_path(path: PathLike) -> None:
    """Check that a chart can be written to a file, before anything is drawn.

    Parameters
    ----------
    path : str or path-like
        The file.

    Raises
    ------
    ValueError
        If its suffix is none of `SUFFIXES`.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> check_chart_path("chart.docx")
    Traceback (most recent call last):
    ...
    ValueError: a chart must be a file ending in .png, .svg, .pdf; got chart.docx
    """
    if Path(path).suffix.lower() not in SUFFIXES:
        raise ValueError(f"a chart must be a file ending in {', '.join(SUFFIXES)}; got {path}")
    check_writable(path)


def save(figure: Figure, path: PathLike) -> None:
    """Write a figure to a file, replacing an old one only by the complete new one.

    Parameters
    ----------
    figure : Figure
        From `draw`.
    path : str or path-like
        The file, with one of `SUFFIXES`.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=_DOTS_PER_INCH)


def draw(ds: xr.Dataset) -> Figure:
    """Draw the chart that suits a map, see `plot`.

    Parameters
    ----------
    ds : Dataset
        From a sweep.

    Returns
    -------
    Figure

    Raises
    ------
    ValueError
        If there is no chart for the data set.

    Examples
    --------
    >>> import dea_maps as dm
    >>> ds = dm.sweep(dm.Ramp(), rate=[0.1, 1.0, 10.0], modulus_ratio=4.0)
    >>> len(draw(ds).axes)
    2
    """
    ds = _drawable(ds)
    along = _parameters_along(ds)
    if along is None:
        return _points(ds)
    if len(along) == 1:
        return _curves(ds, next(iter(along.values())))
    if len(along) == 2:
        figure = phase_diagram(ds).figure
        assert isinstance(figure, Figure)
        return figure
    if len(along) == 3:
        return _diagrams(ds, along)
    raise ValueError(
        f"a chart needs one to three dimensions longer than 1; got {_in_words(ds)}: "
        "select values with ds.sel or ds.isel"
    )


def _curves(ds: xr.Dataset, name: str) -> Figure:
    if "critical_stretch" not in ds:
        raise ValueError("a chart over one parameter needs the variable critical_stretch; the map lacks it")
    axes = panels(2, 1, 4.6, 2.2)
    axes[0].set_title(_title(ds), loc="left", fontsize=10)
    add_legend(axes[0], draw_curves(axes, ds, name))
    axes[0].label_outer()
    return figure_of(axes[0])


def _points(ds: xr.Dataset) -> Figure:
    varying = [name for name in PARAMETERS if name in ds.coords and float(ds[name].min()) < float(ds[name].max())]
    if len(varying) < 2:
        raise ValueError(f"a chart of samples needs two parameters that vary; got {', '.join(varying) or 'none'}")
    (ax,) = panels(1, 1, 4.6, 3.6)
    span = time_span(ds["time_to_failure"].values)
    add_colour_bar([ax], span, ds["time_to_failure"].values)
    ax.set_title(_title(ds), loc="left", fontsize=10)
    add_legend(ax, draw_points(ax, ds, varying[0], varying[1], span))
    return figure_of(ax)


def _diagrams(ds: xr.Dataset, along: dict[str, str]) -> Figure:
    """Draw phase diagrams for some values of the shortest dimension, or of the last of equally short ones."""
    dims = list(along)
    across = min(reversed(dims), key=lambda dim: ds.sizes[dim])
    x, y = ((dim, along[dim]) for dim in dims if dim != across)
    chosen = np.argsort(ds[along[across]].values)[evenly(ds.sizes[across], _MOST_PANELS)]
    slices = [ds.isel({across: index}) for index in chosen]
    planes = [plane_of(part, x, y) for part in slices]
    times = np.concatenate([plane.time.ravel() for plane in planes])
    span = time_span(times)
    rows = 2 if len(planes) == 4 else 1
    axes = panels(rows, len(planes) // rows, 2.9, 2.7, top=0.6)
    add_colour_bar(axes, span, times)
    unnamed: dict[str, Artist] = {}
    for ax, part, plane in zip(axes, slices, planes, strict=True):
        name = along[across]
        ax.set_title(f"{axis_label(name)} = {float(part[name]):.4g}", fontsize=10)
        unnamed.update({str(patch.get_label()): patch for patch in draw_plane(ax, plane, span)})
        ax.label_outer()
    figure = figure_of(axes[0])
    figure.suptitle(_title(ds), x=0.02, ha="left", fontsize=10)
    if unnamed:
        figure.legend(handles=list(unnamed.values()), loc="upper right", ncols=3, frameon=False, fontsize=9)
    return figure


def _drawable(ds: xr.Dataset) -> xr.Dataset:
    """Return a map without its dimensions of length 1, after checking that it can be drawn."""
    for name in ("time_to_failure", "outcome"):
        if name not in ds:
            raise ValueError(f"a chart needs the variable {name}; the map lacks it")
    if ds["outcome"].size < 2:
        raise ValueError(f"a chart needs two cells or more; got {ds['outcome'].size}")
    return ds.squeeze()


def _parameters_along(ds: xr.Dataset) -> dict[str, str] | None:
    """Return which parameter varies along which dimension; None unless it is one along each."""
    along: dict[str, str] = {}
    for name in PARAMETERS:
        if name in ds.coords and ds[name].size > 1 and float(ds[name].min()) < float(ds[name].max()):
            dims = ds[name].dims
            if len(dims) > 1 or dims[0] in along:
                return None
            along[str(dims[0])] = name
    return along if along.keys() == set(ds["outcome"].dims) else None


def _title(ds: xr.Dataset) -> str:
    """Return the loading program and the parameters that are the same in every cell."""
    fixed = [f"{NOMENCLATURE[name].symbol} = {float(ds[name]):.4g}" for name in PARAMETERS if _is_fixed(ds, name)]
    return ", ".join([str(ds.attrs["program"]).replace("_", " "), *fixed])


def _is_fixed(ds: xr.Dataset, name: str) -> bool:
    return name in ds.coords and ds[name].size == 1


def _in_words(ds: xr.Dataset) -> str:
    return ", ".join(f"{dim} {size}" for dim, size in ds["outcome"].sizes.items()) or "none"
