"""The figures of a page to explore: the map, and the trajectory of the film that is clicked."""

from typing import Any, Literal, NamedTuple

import numpy as np
from bokeh.models import CDSView, ColumnDataSource, CustomJSHover, GroupFilter, HoverTool, LogColorMapper, Quad, Range1d
from bokeh.models.annotations import ColorBar, Span
from bokeh.models.renderers import GlyphRenderer
from bokeh.plotting import figure
from bokeh.themes import Theme
from matplotlib.colors import to_hex

from ..charts.boundaries import FAILS_AT_ONCE, FAILS_LATER, SURVIVES
from ..charts.isochrones import time_span
from ..charts.plane import BREAKS_DOWN
from ..charts.regions import COLOURS, LOOKS, words_for
from .cells import Cells, edges, plain_label

_MEANT = {
    SURVIVES: ("final_",),
    FAILS_LATER: ("time_to_failure", "seconds_to_failure", "critical_"),
    FAILS_AT_ONCE: ("critical_",),
    BREAKS_DOWN: ("time_to_breakdown", "seconds_to_breakdown", "breakdown_"),
}
"""With what the names of the variables begin that have a meaning for an outcome."""

_AXIS = {
    "axis_label_text_font_size": "15px",
    "axis_label_text_font_style": "normal",
    "major_label_text_font_size": "13px",
}
_BAR = {"title_text_font_size": "15px", "title_text_font_style": "normal", "major_label_text_font_size": "13px"}
THEME = Theme(json={"attrs": {"Axis": _AXIS, "ColorBar": _BAR}})
"""Sizes of words, the same in both figures."""

_FIGURE: dict[str, Any] = {"height": 450, "sizing_mode": "stretch_width", "active_drag": None}


_RED = "#c8102e"


class Trajectory(NamedTuple):
    """The figure of a trajectory, without a film, and what is filled in.

    Attributes
    ----------
    figure : figure
        To be shown.
    curve, failure : ColumnDataSource
        ``time`` and ``stretch`` of the curve, and of its end where that is failure.
    final : Span
        At the stretch of a film that survives, as t -> infinity.
    """

    figure: figure
    curve: ColumnDataSource
    failure: ColumnDataSource
    final: Span


def draw_map(cells: Cells, source: ColumnDataSource) -> figure:
    """Draw one slice: time to failure in colour, or as a curve over one parameter, and other outcomes in their looks.

    Parameters
    ----------
    cells : Cells
        Of all slices.
    source : ColumnDataSource
        The cells of the slice, where they are and their values.

    Returns
    -------
    figure
    """
    x_edges, x_log = edges(cells.x)
    span = time_span(cells.ds[cells.time_shown].values)
    if cells.y is None:
        low, high = span or (0.1, 10.0)
        y_range, y_log, y_label = (low / 1.2, high * 1.2), True, plain_label(cells.time_shown)
    else:
        y_edges, y_log = edges(cells.y)
        y_range, y_label = (y_edges[0], y_edges[-1]), plain_label(cells.y.shown)
    plot = figure(
        name="map",
        x_axis_type="log" if x_log else "linear",
        y_axis_type="log" if y_log else "linear",
        x_axis_label=plain_label(cells.x.shown),
        y_axis_label=y_label,
        x_range=Range1d(start=x_edges[0], end=x_edges[-1]),
        y_range=Range1d(start=y_range[0], end=y_range[1]),
        tools="tap,box_zoom,wheel_zoom,pan,reset,save",
        **_FIGURE,
    )
    plot.toolbar.logo = None
    plot.grid.visible = cells.y is None
    upright = {"bottom": "bottom", "top": "top"} if cells.y is not None else {"bottom": y_range[0], "top": y_range[1]}
    colours = [to_hex(colour) for colour in COLOURS(np.arange(COLOURS.N))]
    times = LogColorMapper(palette=colours, low=span[0], high=span[1]) if span and cells.y is not None else None
    for outcome in np.unique(cells.ds["outcome"].values).tolist():
        looks = _looks(outcome, cells.time_shown, times)
        cell = Quad(left="left", right="right", **upright, **looks)
        chosen = Quad(left="left", right="right", **upright, **{**looks, "line_color": "black", "line_width": 3})
        view = CDSView(filter=GroupFilter(column_name="outcome", group=outcome))
        drawn = plot.add_glyph(source, cell, selection_glyph=chosen, nonselection_glyph=cell, view=view)
        plot.add_tools(_pointer(cells, outcome, drawn))
    if times is not None:
        plot.add_layout(ColorBar(color_mapper=times, title=plain_label(cells.time_shown)), "right")
    if cells.y is None:
        plot.line(cells.x.shown, cells.time_shown, source=source, color="black", line_width=1.5, nonselection_alpha=1)
        plot.scatter(cells.x.shown, cells.time_shown, source=source, color="black", size=5, nonselection_alpha=1)
    return plot


def draw_trajectory(cells: Cells) -> Trajectory:
    """Make the figure for the trajectory of a film.

    Parameters
    ----------
    cells : Cells
        What is shown.

    Returns
    -------
    Trajectory
    """
    plot = figure(
        name="trajectory",
        x_axis_label=plain_label("time") if cells.seconds is None else "time (s)",
        y_axis_label=plain_label("stretch"),
        tools="box_zoom,wheel_zoom,pan,reset,save",
        **_FIGURE,
    )
    plot.toolbar.logo = None
    # Not empty: a figure of nothing, which is also hidden at once, would complain that it has no ranges.
    curve, failure = (ColumnDataSource({"time": [0, 1], "stretch": [1, 1]}, name=name) for name in ("curve", "failure"))
    line = plot.line("time", "stretch", source=curve, color="black", line_width=2)
    cross = plot.scatter("time", "stretch", source=failure, marker="x", color=_RED, size=14, line_width=3)
    relaxed = Span(dimension="width", location=np.nan, line_dash="dashed", line_color="gray", name="final")
    plot.add_layout(relaxed)
    tooltips = [("time", "@time{%.4g}"), ("stretch", "@stretch{%.4g}")]
    plot.add_tools(
        HoverTool(renderers=[line, cross], tooltips=tooltips, formatters=_formatted("time", "stretch"), visible=False)
    )
    return Trajectory(plot, curve, failure, relaxed)


def legend(cells: Cells) -> list[tuple[str, str]]:
    """Return the outcomes that have a look of their own, in words, and the look as a background in CSS.

    Parameters
    ----------
    cells : Cells
        Of all slices.
    """
    backgrounds = []
    for outcome in np.unique(cells.ds["outcome"].values).tolist():
        if outcome != FAILS_LATER:
            looks = _looks(outcome, "", None)
            stripes = f"{looks.get('hatch_color', looks['fill_color'])} 0 1px, {looks['fill_color']} 1px 5px"
            backgrounds.append((words_for(outcome), f"repeating-linear-gradient(120deg, {stripes})"))
    return backgrounds


def _looks(outcome: int, time: str, times: LogColorMapper | None) -> dict[str, Any]:
    """Return the looks of a cell; its line has the same colour, so that no gap shows between cells."""
    if outcome == FAILS_LATER:
        colour: Any = "white" if times is None else {"field": time, "transform": times}
        return {"fill_color": colour, "line_color": colour}
    looks = LOOKS[outcome]
    colour = to_hex(looks["facecolor"])
    hatch = {}
    if "hatch" in looks:
        hatch = {"hatch_pattern": looks["hatch"][0], "hatch_color": to_hex(looks["edgecolor"])}
    return {"fill_color": colour, "line_color": colour, **hatch}


def _pointer(cells: Cells, outcome: int, drawn: "GlyphRenderer[Any]") -> HoverTool:
    """Show what has a meaning for an outcome under the pointer."""
    parameters = [name for axis in cells.axes[::-1] for name in axis.values]
    variables = [str(name) for name in cells.ds.data_vars if str(name).startswith(_MEANT.get(outcome, ()))]
    shown = [(plain_label(name), f"@{name}{{%.4g}}") for name in (*parameters, *variables)]
    return HoverTool(
        renderers=[drawn],
        tooltips=[("outcome", words_for(outcome)), *shown],
        formatters=_formatted(*parameters, *variables),
        visible=False,
    )


def _formatted(*names: str) -> dict[str, Literal["numeral", "datetime", "printf"] | CustomJSHover]:
    return {f"@{name}": "printf" for name in names}
