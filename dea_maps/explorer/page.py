"""The page to explore a map, made with Bokeh: figures, values and curves; explore.js has what follows on an input."""

import re
from importlib.resources import files
from typing import Any

import numpy as np
import numpy.typing as npt
from bokeh.document import Document
from bokeh.embed import file_html
from bokeh.events import DocumentReady
from bokeh.models import ColumnDataSource, CustomJS
from bokeh.resources import INLINE

from ..charts.plane import BREAKS_DOWN
from ..charts.regions import words_for
from ..outcomes import Outcome
from .cells import Cells, columns, edges, fixed_parameters, plain_label
from .curves import Curves
from .figures import CHOSEN, THEME, draw_map, draw_program, draw_trajectory, legend, sources
from .text import facts, heading, notes, reading, sentences


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
    outcomes = np.unique(cells.ds["outcome"].values).tolist()
    told = {outcome: facts(cells, outcome) for outcome in outcomes}
    kept = {"outcome", *cells.times_shown.values(), *(name for names in told.values() for name in names)}
    slices = _slices(cells, curves, kept)
    shown = ColumnDataSource({**_places(cells), **slices[0].data}, name="cells")
    films = sources()
    field_low, field_high = (bound * (cells.volts or 1.0) for bound in (curves.field.low, curves.field.high))
    trajectory, limits = draw_trajectory(cells, films)
    program = draw_program(cells, films, (field_low, field_high))
    program.x_range = trajectory.x_range
    figures = {"map": draw_map(cells, shown, films), "program": program, "trajectory": trajectory}
    sliders = [
        {"label": plain_label(axis.shown), "most": axis.number - 1, "middle": axis.number // 2} for axis in cells.across
    ]
    show = CustomJS(
        args={
            "figures": figures,
            "films": [films[name]._asdict() for name in CHOSEN],
            "limits": limits,
            "slices": slices,
            "cells": shown,
            "axes": [_axis(axis.shown, axis.values[axis.shown]) for axis in (cells.x, cells.y) if axis is not None],
            "across": [_axis(axis.shown, axis.values[axis.shown]) for axis in cells.across],
            "seconds": cells.seconds or 1.0,
            "bounds": {
                "stretch": [curves.stretch.low, curves.stretch.high],
                "field": [field_low, field_high],
            },
            "prestretch": fixed_parameters(cells).get("prestretch", 1.0),
            "labels": {name: plain_label(name) for name in ("stretch", "area_strain")},
            "outcomes": {str(outcome): words_for(outcome) for outcome in outcomes},
            "facts": {str(outcome): [[plain_label(name), name] for name in names] for outcome, names in told.items()},
            "sentences": sentences(cells),
            "ENDS": [Outcome.FAILS_LATER, BREAKS_DOWN],
        },
        code=_text("explore.js"),
    )
    document = Document(theme=THEME)
    for root in figures.values():
        document.add_root(root)
    document.js_on_event(DocumentReady, show)
    words = {"heading": heading(cells), "reading": reading(cells), "notes": notes(cells, made_from)}
    variables = {**words, "legend": legend(cells), "sliders": sliders}
    html = file_html(document, INLINE, heading(cells), template=_text("explore.html"), template_variables=variables)
    return _renumbered(html)


def _text(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


def _axis(name: str, values: npt.NDArray[np.float64]) -> dict[str, Any]:
    """Return name, label and values, the shortest by which they can be told apart."""
    digits = next(n for n in range(4, 18) if len({f"{value:.{n}g}" for value in values}) == len(values))
    return {"name": name, "label": plain_label(name), "values": [float(f"{value:.{digits}g}") for value in values]}


def _slices(cells: Cells, curves: Curves, kept: set[str]) -> list[ColumnDataSource]:
    """Return what there is to show at each position of the sliders: values and curves."""
    count, rows, number = cells.shape
    sources = []
    for index in range(count):
        here = slice(index * rows * number, (index + 1) * rows * number)
        data = {
            **{name: values for name, values in columns(cells, index).items() if name in kept},
            "curve_span": curves.span[here],
            "curve_ends": curves.ends[here],
            "curve_time": curves.time.shares[here],
            "curve_stretch": curves.stretch.shares[here],
            "curve_field": curves.field.shares[here],
        }
        sources.append(ColumnDataSource(data))
    return sources


def _places(cells: Cells) -> dict[str, npt.NDArray[np.float32]]:
    """Return the edges of the cells of a slice, and the values of the parameters, along x and y."""
    _, rows, number = cells.shape
    places = {"left": edges(cells.x)[0][:-1], "right": edges(cells.x)[0][1:], **cells.x.values}
    found = {name: np.tile(values, rows) for name, values in places.items()}
    if cells.y is not None:
        places = {"bottom": edges(cells.y)[0][:-1], "top": edges(cells.y)[0][1:], **cells.y.values}
        found |= {name: np.repeat(values, number) for name, values in places.items()}
    for axis in cells.across:
        found[axis.shown] = np.full(rows * number, axis.values[axis.shown][0])
    return {name: values.astype(np.float32) for name, values in found.items()}


def _renumbered(html: str) -> str:
    """Return the page with identifiers that do not differ from one making to the next."""
    names: dict[str, str] = {}
    model, element = r'(?<=")p\d{4,}(?=")', r"[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}"
    return re.sub(f"{model}|{element}", lambda found: names.setdefault(found[0], f"m{len(names)}"), html)
