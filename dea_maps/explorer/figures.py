"""The figures of a page to explore: the map, and program and stretch of chosen films against time.

Their colours are those of the page, which follow the reader's setting: see explore.js.
"""

from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from bokeh.models import (
    CDSView,
    ColumnDataSource,
    CustomJSHover,
    GroupFilter,
    HoverTool,
    Line,
    LogColorMapper,
    NoOverlap,
    PrintfTickFormatter,
    Quad,
    Range1d,
    Scatter,
)
from bokeh.models.annotations import ColorBar, Span
from bokeh.plotting import figure
from bokeh.themes import Theme
from matplotlib.colors import to_hex

from ..charts.isochrones import time_span
from ..charts.plane import BREAKS_DOWN
from ..charts.regions import COLOURS, LOOKS, words_for
from ..outcomes import Outcome
from .cells import Cells, edges, plain_label
from .text import facts

if TYPE_CHECKING:
    from bokeh.models.renderers import GlyphRenderer

_AXIS = {
    "axis_label_text_font_size": "15px",
    "axis_label_text_font_style": "normal",
    "major_label_text_font_size": "13px",
}
_BAR = {"title_text_font_size": "15px", "title_text_font_style": "normal", "major_label_text_font_size": "13px"}
THEME = Theme(json={"attrs": {"Axis": _AXIS, "ColorBar": _BAR}})
"""Sizes of words, the same in all figures."""

_FIGURE: dict[str, Any] = {"sizing_mode": "stretch_width", "active_drag": None, "min_border": 0}

CHOSEN = ("chosen", "kept")
"""The films whose curves are drawn: the chosen one, and one kept beside it."""


class Drawn(NamedTuple):
    """The curves of a film, and what is filled in.

    Attributes
    ----------
    curve : ColumnDataSource
        ``time``, ``field`` and ``y``, which is the stretch or the area strain.
    end : ColumnDataSource
        ``time`` and ``y`` of failure or breakdown; empty without it.
    frame : ColumnDataSource
        ``left``, ``right``, ``bottom`` and ``top`` of its cell in the map; empty where it is in another slice.
    """

    curve: ColumnDataSource
    end: ColumnDataSource
    frame: ColumnDataSource


def sources() -> dict[str, Drawn]:
    """Return what is filled in for every one of `CHOSEN`."""
    # Not empty: a figure of nothing, which is also hidden at once, would complain that it has no ranges.
    return {
        name: Drawn(
            ColumnDataSource({"time": [0, 1], "field": [0, 1], "y": [1, 1]}, name=f"{name} curve"),
            ColumnDataSource({"time": [], "y": []}, name=f"{name} end"),
            ColumnDataSource({"left": [], "right": [], "bottom": [], "top": []}, name=f"{name} frame"),
        )
        for name in CHOSEN
    }


def draw_map(cells: Cells, source: ColumnDataSource, films: dict[str, Drawn]) -> figure:
    """Draw one slice: time to failure in colour, or as a curve over one parameter, and other outcomes in their looks.

    Where electrical breakdown comes first, the colour is the time to it, and the cell is hatched.

    Parameters
    ----------
    cells : Cells
        Of all slices.
    source : ColumnDataSource
        The cells of the slice, where they are and their values.
    films : dict of str to Drawn
        From `sources`.

    Returns
    -------
    figure
    """
    x_edges, x_log = edges(cells.x)
    span = time_span(np.concatenate([cells.ds[name].values.ravel() for name in cells.times_shown.values()]))
    if cells.y is None:
        low, high = span or (0.1, 10.0)
        y_range, y_log, y_label = (low / 1.2, high * 1.2), True, plain_label(cells.times_shown[Outcome.FAILS_LATER])
    else:
        y_edges, y_log = edges(cells.y)
        y_range, y_label = (y_edges[0], y_edges[-1]), plain_label(cells.y.shown)
    plot = figure(
        name="map",
        height=480,
        x_axis_type="log" if x_log else "linear",
        y_axis_type="log" if y_log else "linear",
        x_axis_label=plain_label(cells.x.shown),
        y_axis_label=y_label,
        x_range=Range1d(start=x_edges[0], end=x_edges[-1]),
        y_range=Range1d(start=y_range[0], end=y_range[1]),
        tools="tap,box_zoom,wheel_zoom,pan,reset,save",
        toolbar_location="below",
        **_FIGURE,
    )
    _tidy(plot)
    plot.grid.visible = cells.y is None
    upright = {"bottom": "bottom", "top": "top"} if cells.y is not None else {"bottom": y_range[0], "top": y_range[1]}
    colours = [to_hex(colour) for colour in COLOURS(np.arange(COLOURS.N))]
    times = None
    if span and cells.y is not None:
        times = LogColorMapper(palette=colours, low=span[0], high=span[1], nan_color=colours[0])
    for outcome in np.unique(cells.ds["outcome"].values).tolist():
        cell = Quad(left="left", right="right", **upright, **_looks(cells, outcome, times))
        view = CDSView(filter=GroupFilter(column_name="outcome", group=outcome))
        drawn = plot.add_glyph(
            source, cell, selection_glyph=cell, nonselection_glyph=cell, view=view, name=f"outcome {outcome}"
        )
        plot.add_tools(_pointer(cells, outcome, drawn))
    if times is not None:
        title = plain_label(cells.times_shown[Outcome.FAILS_LATER])
        if BREAKS_DOWN in cells.times_shown:
            title = title.replace("failure", "failure or breakdown")
        plot.add_layout(ColorBar(color_mapper=times, title=title, height=12, padding=4, name="bar"), "above")
    if cells.y is None:
        for name, dash in zip(cells.times_shown.values(), ("solid", "dashed"), strict=False):
            line = Line(x=cells.x.shown, y=name, line_width=1.5, line_dash=dash)
            for glyph in (line, Scatter(x=cells.x.shown, y=name, size=5)):
                plot.add_glyph(source, glyph, selection_glyph=glyph, nonselection_glyph=glyph, name="ink")
    for name, film in films.items():
        # Dark on light: one of them is seen on any cell.
        for colour, width in (("black", 6), ("white", 3)):
            dash = "solid" if name == "chosen" or colour == "black" else "dashed"
            plot.quad(
                "left", "right", "top", "bottom", source=film.frame, fill_alpha=0,
                line_color=colour, line_width=width, line_dash=dash,
            )  # fmt: skip
    return plot


def draw_program(cells: Cells, films: dict[str, Drawn], bounds: tuple[float, float]) -> figure:
    """Make the figure for the field of films against time.

    Parameters
    ----------
    cells : Cells
        What is shown.
    films : dict of str to Drawn
        From `sources`.
    bounds : tuple of float
        Of the field, as it is shown.

    Returns
    -------
    figure
    """
    plot = _against_time(cells, films, "program", "field", plain_label("field" if cells.volts is None else "voltage"))
    margin = 0.06 * (bounds[1] - bounds[0])
    plot.y_range = Range1d(start=bounds[0] - margin, end=bounds[1] + margin)
    return plot


def draw_trajectory(cells: Cells, films: dict[str, Drawn]) -> tuple[figure, list[Span]]:
    """Make the figure for the stretch of films against time.

    Parameters
    ----------
    cells : Cells
        What is shown.
    films : dict of str to Drawn
        From `sources`.

    Returns
    -------
    figure
    limits : list of Span
        At the stretch, or both of them, that the chosen film has in the end.
    """
    plot = _against_time(cells, films, "trajectory", "y", plain_label("stretch"))
    for name, film in films.items():
        plot.scatter("time", "y", source=film.end, marker="x", size=14, line_width=3, name=f"{name} failure")
    limits = [Span(dimension="width", location=np.nan, line_dash="dashed", line_color="gray") for _ in range(2)]
    for limit in limits:
        plot.add_layout(limit)
    return plot, limits


def _against_time(cells: Cells, films: dict[str, Drawn], name: str, column: str, label: str) -> figure:
    below = name == "trajectory"
    plot = figure(
        name=name,
        height=330 if below else 150,
        x_axis_label=plain_label("time" if cells.seconds is None else "seconds") if below else None,
        y_axis_label=label,
        tools="box_zoom,wheel_zoom,pan,reset,save",
        toolbar_location="below" if below else None,
        min_border_left=76,
        **_FIGURE,
    )
    _tidy(plot)
    plot.axis.formatter = PrintfTickFormatter(format="%.4g")
    for which, film in films.items():
        dash = "solid" if which == "chosen" else "dashed"
        line = plot.line("time", column, source=film.curve, line_width=2, line_dash=dash, name=which)
        tooltips = [("time", "@time{%.4g}"), (label, f"@{column}{{%.4g}}")]
        plot.add_tools(
            HoverTool(renderers=[line], tooltips=tooltips, formatters=_formatted("time", column), visible=False)
        )
    return plot


def _tidy(plot: figure) -> None:
    plot.toolbar.logo = None
    plot.axis.major_label_policy = NoOverlap(min_distance=6)


def legend(cells: Cells) -> list[tuple[str, str]]:
    """Return the outcomes that have a look of their own: in words, and the name of the look in the page.

    Parameters
    ----------
    cells : Cells
        Of all slices.
    """
    met = np.unique(cells.ds["outcome"].values).tolist()
    return [(words_for(outcome), f"outcome-{outcome}") for outcome in met if outcome != Outcome.FAILS_LATER]


def _looks(cells: Cells, outcome: int, times: LogColorMapper | None) -> dict[str, Any]:
    """Return the looks of a cell; its line has the same colour, so that no gap shows between cells."""
    colour: Any = "white"
    if outcome in cells.times_shown and times is not None:
        colour = {"field": cells.times_shown[outcome], "transform": times}
    hatch = {"hatch_pattern": LOOKS[outcome]["hatch"][0]} if "hatch" in LOOKS.get(outcome, {}) else {}
    return {"fill_color": colour, "line_color": colour, **hatch}


def _pointer(cells: Cells, outcome: int, drawn: "GlyphRenderer[Any]") -> HoverTool:
    """Show what has a meaning for an outcome under the pointer."""
    names = [axis.shown for axis in cells.axes[::-1]] + facts(cells, outcome)
    return HoverTool(
        renderers=[drawn],
        tooltips=[("outcome", words_for(outcome)), *((plain_label(name), f"@{name}{{%.4g}}") for name in names)],
        formatters=_formatted(*names),
        visible=False,
    )


def _formatted(*names: str) -> dict[str, Literal["numeral", "datetime", "printf"] | CustomJSHover]:
    return {f"@{name}": "printf" for name in names}
