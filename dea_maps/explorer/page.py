"""The page to explore a map, made with Bokeh: data, slider, and what follows when something is moved or clicked."""

import re
from importlib.resources import files

import numpy as np
import numpy.typing as npt
from bokeh.document import Document
from bokeh.embed import file_html
from bokeh.events import DocumentReady
from bokeh.models import ColumnDataSource, CustomJS
from bokeh.models.widgets import CategoricalSlider, Div
from bokeh.resources import INLINE

from ..charts.boundaries import FAILS_LATER
from ..charts.plane import BREAKS_DOWN
from .cells import Axis, Cells, columns, edges, plain_label
from .curves import Curves
from .figures import THEME, draw_map, draw_trajectory, legend
from .text import heading, notes, reading, sentences


def page(cells: Cells, curves: Curves, made_from: str) -> str:
    """Return the whole page.

    Parameters
    ----------
    cells : Cells
        What it shows.
    curves : Curves
        Their trajectories.
    made_from : str
        The name of the file of the map, or nothing.

    Returns
    -------
    str
        HTML that needs nothing else.
    """
    slices = _slices(cells, curves)
    middle = len(slices) // 2
    shown = ColumnDataSource({**_places(cells), **slices[middle].data}, name="cells")
    trajectory = draw_trajectory(cells)
    said = Div(name="said", sizing_mode="stretch_width", styles={"font-size": "15px"})
    slider = None if cells.across is None else _slider(cells.across, middle)
    show = CustomJS(
        args={
            "slider": slider,
            "slices": slices,
            "cells": shown,
            "plot": trajectory.figure,
            "curve": trajectory.curve,
            "failure": trajectory.failure,
            "final_line": trajectory.final,
            "said": said,
            "unit": cells.seconds or 1.0,
            "top_stretch": curves.top,
            "ENDS": [FAILS_LATER, BREAKS_DOWN],
            "words_of": sentences(cells),
            "parameters": [(plain_label(name), name) for axis in cells.axes[::-1] for name in axis.values],
        },
        code=_text("explore.js"),
    )
    shown.selected.js_on_change("indices", show)
    document = Document(theme=THEME)
    for root in (draw_map(cells, shown), trajectory.figure, said):
        document.add_root(root)
    if slider is not None:
        slider.js_on_change("value", show)
        document.add_root(slider)
    document.js_on_event(DocumentReady, show)
    words = {"heading": heading(cells), "reading": reading(cells), "notes": notes(cells, made_from)}
    variables = {**words, "legend": legend(cells), "has_slider": slider is not None}
    html = file_html(document, INLINE, heading(cells), template=_text("explore.html"), template_variables=variables)
    return _renumbered(html)


def _text(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


def _slider(across: Axis, position: int) -> CategoricalSlider:
    values = across.values[across.shown]
    digits = next(n for n in range(4, 18) if len({f"{value:.{n}g}" for value in values}) == len(values))
    categories = [f"{value:.{digits}g}" for value in values]
    return CategoricalSlider(
        categories=categories,
        value=categories[position],
        title=plain_label(across.shown),
        name="slider",
        sizing_mode="stretch_width",
        styles={"font-size": "15px"},
    )


def _slices(cells: Cells, curves: Curves) -> list[ColumnDataSource]:
    """Return what there is to show at each position of the slider: values and curves."""
    count, rows, number = cells.shape
    sources = []
    for index in range(count):
        here = slice(index * rows * number, (index + 1) * rows * number)
        data = {
            **columns(cells, index),
            "curve_span": curves.span[here],
            "curve_time": curves.time[here],
            "curve_stretch": curves.stretch[here],
        }
        if cells.across is not None:
            for name, values in cells.across.values.items():
                data[name] = np.full(rows * number, values[index], np.float32)
        sources.append(ColumnDataSource(data))
    return sources


def _places(cells: Cells) -> dict[str, npt.NDArray[np.float32]]:
    """Return the edges of the cells of a slice, and the values of the parameters along x and y."""
    _, rows, number = cells.shape
    places = {"left": edges(cells.x)[0][:-1], "right": edges(cells.x)[0][1:], **cells.x.values}
    found = {name: np.tile(values, rows) for name, values in places.items()}
    if cells.y is not None:
        places = {"bottom": edges(cells.y)[0][:-1], "top": edges(cells.y)[0][1:], **cells.y.values}
        found |= {name: np.repeat(values, number) for name, values in places.items()}
    return {name: values.astype(np.float32) for name, values in found.items()}


def _renumbered(html: str) -> str:
    """Return the page with identifiers that do not differ from one making to the next."""
    names: dict[str, str] = {}
    model, element = r'(?<=")p\d{4,}(?=")', r"[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}"
    return re.sub(f"{model}|{element}", lambda found: names.setdefault(found[0], f"m{len(names)}"), html)
