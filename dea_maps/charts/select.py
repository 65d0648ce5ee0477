"""The chart that suits a data set, and its file."""

from collections.abc import Callable, Mapping
from pathlib import Path

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..atomic import PathLike, check_writable, replacing
from ..outcomes import Outcome
from .choices import CHARTS, SIZES, check_choice
from .curves import failure_over, sample_points
from .cycles import cycles_chart
from .data import check_variables, drawable, parameters_along, sizes_in_words
from .design import design_chart
from .failures import failure_curves
from .hysteresis import hysteresis_loops
from .layout import figure_of
from .phase import phase_diagram, phase_panels
from .program import program_chart
from .stretches import stretch_chart
from .time_curves import trajectories

SUFFIXES = (".png", ".svg", ".pdf")
"""Kinds of files that a chart can be written as."""

_DOTS_PER_INCH = 300
_MOST_AS_CURVES = 3
"""So many values of a parameter or fewer are curves, not blocks of a map."""
_DRAWN: Mapping[str, Callable[..., Axes]] = {
    "failure_curves": failure_curves,
    "stretch_chart": stretch_chart,
    "cycles_chart": cycles_chart,
    "hysteresis_loops": hysteresis_loops,
    "program_chart": program_chart,
    "trajectories": trajectories,
    "design_chart": design_chart,
}


def plot(ds: xr.Dataset, path: PathLike, chart: str = "auto", size: str = "column") -> None:
    """Draw a chart and write it to a file.

    By itself it is the one that suits the data set: a design chart of the allowable voltages of films, curves over time
    of trajectories; of a map over one parameter curves, over two a phase diagram, or curves for two or three values of
    one of them, over three up to four phase diagrams side by side; of scattered samples points over the
    first two parameters that vary.

    Parameters
    ----------
    ds : Dataset
        From any function of this package that returns one.
    path : str or path-like
        The file to write or replace, a PNG, SVG or PDF by its suffix.
    chart : str
        One of `CHARTS`.
    size : {"column", "slide"}
        Of a column of a journal, or of a slide; several phase diagrams take two columns.

    Raises
    ------
    TypeError, ValueError
        If the suffix or an option is another one, or there is no such chart of the data set.
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
    save(draw(ds, chart, size), path)


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


def save(chart: Figure | Axes, path: PathLike) -> None:
    """Write a figure to a file, replacing an old one only by the complete new one.

    Parameters
    ----------
    chart : Figure or Axes
        From `draw` or another function of this module; of axes, the whole figure is written.
    path : str or path-like
        The file, with one of `SUFFIXES`.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    figure = figure_of(chart) if isinstance(chart, Axes) else chart
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=_DOTS_PER_INCH)


def draw(ds: xr.Dataset, chart: str = "auto", size: str = "column") -> Figure:
    """Draw a chart, by itself the one that suits the data set, see `plot`.

    Parameters
    ----------
    ds : Dataset
        From any function of this package that returns one.
    chart : str
        One of `CHARTS`.
    size : {"column", "slide"}
        As in `plot`.

    Returns
    -------
    Figure

    Raises
    ------
    TypeError, ValueError
        If an option is not one of those allowed, or there is no such chart of the data set.

    Examples
    --------
    >>> import dea_maps as dm
    >>> ds = dm.sweep(dm.Ramp(), rate=[0.1, 1.0, 10.0], modulus_ratio=4.0)
    >>> len(draw(ds).axes), len(draw(ds, chart="stretch_chart").axes)
    (2, 1)
    """
    check_choice("chart", chart, CHARTS)
    check_choice("size", size, SIZES)
    check_variables(ds)
    if chart == "auto" and "allowable_voltage" in ds:
        chart = "design_chart"
    elif chart == "auto" and "time" in ds.dims:
        chart = "trajectories"
    if chart in _DRAWN:
        return figure_of(_DRAWN[chart](ds, size=size))
    ds = drawable(ds, "time_to_failure")
    along = parameters_along(ds)
    if along is not None and len(along) == 3:
        return phase_panels(ds, size)
    if chart == "auto" and along is not None and len(along) == 2 and _is_narrow(ds, along):
        over = max(along, key=lambda dim: ds.sizes[dim])
        return figure_of(failure_curves(ds, over=along[over], size=size))
    if chart == "phase_diagram" or (along is not None and len(along) == 2):
        return figure_of(phase_diagram(ds, size=size))
    if along is None:
        return sample_points(ds, size)
    if len(along) == 1:
        return failure_over(ds, next(iter(along.values())), size)
    raise ValueError(
        f"a chart needs one to three dimensions longer than 1; got {sizes_in_words(ds)}: "
        "select values with ds.sel or ds.isel"
    )


def _is_narrow(ds: xr.Dataset, along: Mapping[str, str]) -> bool:
    """Tell whether a map has so few values of a parameter that they are curves, and films that fail later."""
    fewest = min(ds.sizes[dim] for dim in along)
    return fewest <= _MOST_AS_CURVES and bool((ds["outcome"] == Outcome.FAILS_LATER).any())
