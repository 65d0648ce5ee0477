"""Charts of the atlas: maps of verdicts, and the drift off equation (23)."""

from io import BytesIO
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import drift
import numpy as np
import xarray as xr
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray
from PIL import Image
from scenes import SCENES
from verdicts import NOT_SERVED, WORDS

# Face, hatch and its colour, by verdict: told apart in grey by lightness and hatch together.
LOOKS = {
    "accurate": ("#d6e8f5", "", "#d6e8f5"),
    "inaccurate": ("#f2c14e", "...", "#6b4e00"),
    "event_missed": ("#d55e00", "////", "#5c2300"),
    "wrong_branch": ("#762a83", "xxx", "#e8c9ee"),
    "not_finite": ("#000000", "", "#000000"),
    "step_collapsed": ("#3b7dbd", "\\\\\\\\", "#dcecf9"),
    "budget_spent": ("#a8a8a8", "", "#a8a8a8"),
}
LIMITS = {
    "stable": ("-", r"longest stable step, $|R(hJ)| = 1$"),
    "spent": ("--", "a life takes the whole budget (bottleneck: $T \\propto (field-1)^{-1/2}$)"),
    "life": ("-.", "one step is a whole life"),
    "fold": (":", r"fold's law: a step costs the stretch $c\sqrt{h}$ = 1 %"),
    "collapse": (":", r"fold's law: the shortest step costs $c\sqrt{2.2 \cdot 10^{-16}\,T}$"),
    "margin": ("-.", "bottleneck: the tolerance is the margin, 2 (field - 1)"),
    "explicit": ("-", "as many stable steps as the budget allows"),
}
FALLING_WORDS = {"event_missed": "survives, which is wrong", "step_collapsed": "unresolved"}
DRIFT_COLOURS = {"rk4": "#e69f00", "dopri5": "#0072b2", "dop853": "#111111"}


def _edges(centres: NDArray[np.float64]) -> NDArray[np.float64]:
    """Edges of cells on a logarithmic axis."""
    logs = np.log(centres)
    middle = 0.5 * (logs[1:] + logs[:-1])
    return np.exp(np.concatenate([[2.0 * logs[0] - middle[0]], middle, [2.0 * logs[-1] - middle[-1]]]))


def _paint(ax: Axes, x: NDArray, y: NDArray, kinds: NDArray) -> None:
    """Fill the cells of a map, one collection of rectangles a verdict, neighbours in a row joined."""
    x_edges, y_edges = _edges(x), _edges(y)
    for code, word in enumerate(WORDS):
        face, hatch, ink = LOOKS[word]
        corners = []
        for row, line in enumerate(kinds == code):
            change = np.flatnonzero(np.diff(np.concatenate([[0], line.astype(int), [0]])))
            low, high = y_edges[row], y_edges[row + 1]
            for left, right in x_edges[change].reshape(-1, 2):
                corners.append([(left, low), (right, low), (right, high), (left, high)])
        ax.add_collection(PolyCollection(corners, facecolor=face, edgecolor="none", antialiased=False))
        if hatch:
            ax.add_collection(PolyCollection(corners, facecolor="none", edgecolor=ink, hatch=hatch, lw=0))
    ax.set(xscale="log", yscale="log", xlim=x_edges[[0, -1]], ylim=y_edges[[0, -1]])


def _save(figure: Figure, path: Path, dpi: int) -> None:
    """Write a PNG of few colours, a fraction of the size."""
    page = BytesIO()
    figure.savefig(page, dpi=dpi)
    plt.close(figure)
    Image.open(page).convert("RGB").quantize(160, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE).save(
        path, optimize=True
    )


def maps(data: xr.Dataset, limits: dict[tuple[str, str], list], title: str, path: Path) -> None:
    """Draw a map for every case and scene.

    Parameters
    ----------
    data : Dataset
        ``verdict`` (case, scene, accuracy, place), ``place_value`` (scene, place), ``accuracy``.
    limits : dict
        By case and scene: (kind, x, y) of the lines to draw over its map.
    title : str
        Label of the vertical axes.
    path : Path
        Of the PNG.
    """
    names = list(data.case.values)
    size = (9.0, 1.9 * len(names) + 1.3)
    figure, axes = plt.subplots(
        len(names), len(SCENES), figsize=size, squeeze=False, sharex="col", layout="constrained"
    )
    shown = set()
    for row, name in enumerate(names):
        for column, scene in enumerate(SCENES):
            ax = axes[row, column]
            kinds = data.verdict.sel(case=name, scene=scene.name).values
            x, y = data.place_value.sel(scene=scene.name).values, data.accuracy.values
            _paint(ax, x, y, kinds)
            program = str(data.program.sel(case=name, scene=scene.name).values)
            ax.set_title(f"{name}: {program}" if program else str(name), fontsize=8.5)
            if np.all(kinds == NOT_SERVED):
                ax.text(0.5, 0.5, "does not serve ramps", transform=ax.transAxes, ha="center", fontsize=8)
            for kind, places, heights in limits.get((str(name), scene.name), []):
                shown.add(kind)
                ax.plot(places, heights, color="white", lw=2.6, ls="-", alpha=0.8)
                ax.plot(places, heights, color="black", lw=1.2, ls=LIMITS[kind][0])
            ax.tick_params(labelsize=7)
            if row == len(names) - 1:
                ax.set_xlabel(scene.label, fontsize=8)
        axes[row, 0].set_ylabel(title, fontsize=8)
    handles = [
        Patch(
            facecolor=LOOKS[word][0],
            hatch=2 * LOOKS[word][1],
            edgecolor=LOOKS[word][2],
            lw=0,
            label=word.replace("_", " "),
        )
        for word in WORDS
    ]
    handles += [
        Line2D([], [], color="black", ls=LIMITS[kind][0], label=LIMITS[kind][1]) for kind in LIMITS if kind in shown
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    _save(figure, path, 100)


def falls(data: xr.Dataset, labels: list[str], path: Path) -> None:
    """Draw the verdicts under a field that falls: a row a case, a column a scene, whose axes have these labels."""
    cases, scenes = data.case.values, data.scene.values
    size = (9.0, 1.6 * len(cases) + 1.1)
    figure, axes = plt.subplots(len(cases), len(scenes), figsize=size, sharex="col", layout="constrained")
    for (row, column), ax in np.ndenumerate(axes):
        case, scene = cases[row], scenes[column]
        height = "step" if case.startswith("rk4") else "tolerance"
        kinds = data.verdict.sel(case=case, scene=scene).values
        _paint(ax, data.place_value.sel(scene=scene).values, data[height].values, kinds)
        ax.set_title(case, fontsize=8.5)
        ax.tick_params(labelsize=7)
        if column == 0:
            ax.set_ylabel("step (tau)" if height == "step" else height, fontsize=8)
        if row == len(cases) - 1:
            ax.set_xlabel(labels[column], fontsize=8)
    handles = []
    for code in np.unique(data.verdict.values):
        face, hatch, ink = LOOKS[WORDS[code]]
        label = FALLING_WORDS.get(WORDS[code], WORDS[code])
        handles.append(Patch(facecolor=face, hatch=2 * hatch, edgecolor=ink, lw=0, label=label))
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    _save(figure, path, 100)


def drifts(data: xr.Dataset, path: Path) -> None:
    """Draw the residual of equation (23) against time, for both forms."""
    figure, axes = plt.subplots(1, data.sizes["field"], figsize=(9.0, 4.2), sharey=True, layout="constrained")
    for ax, field in zip(axes, data.field.values, strict=True):
        part = data.sel(field=field)
        for solver, colour in DRIFT_COLOURS.items():
            for form, style in (("rate", "-"), ("fold", "--")):
                off = part.residual.sel(solver=solver, formulation=form)
                ax.plot(data.time, np.maximum(off, 1e-16), color=colour, ls=style, lw=1.4)
                end = float(part.failure.sel(solver=solver, formulation=form))
                if np.isfinite(end):
                    ax.plot(end, off.values[np.isfinite(off.values)][-1], marker="x", color=colour, ms=7)
        ax.set(xscale="log", yscale="log", xlabel="time (tau)")
        ax.set_title(f"field {field:g} Ec", fontsize=10)
        ax.grid(color="0.88", lw=0.4)
        if field > 1.0:
            margin = 2.0 * (field - 1.0)
            ax.axhline(margin, color="0.4", lw=0.9, ls=":")
            ax.text(data.time.values[0], 1.2 * margin, "margin of the load over critical", fontsize=8, va="bottom")
            ax.set_ylim(top=10.0)
            ax.axvline(float(part.truth), color="0.4", lw=0.9, ls=":")
            ax.text(0.93 * float(part.truth), 0.66, "true failure", rotation=90, fontsize=8, ha="right",
                    transform=ax.get_xaxis_transform())  # fmt: skip
    axes[0].set_ylabel("residual of equation (23), relative to the load")
    handles = [Line2D([], [], color=c, label=f"{name}, {drift.SOLVERS[name]}") for name, c in DRIFT_COLOURS.items()]
    handles += [Line2D([], [], color="0.3", ls=s, label=f) for f, s in (("rate form", "-"), ("fold form", "--"))]
    handles += [Line2D([], [], color="0.3", ls="", marker="x", label="failure found")]
    figure.legend(handles=handles, loc="outside lower center", ncols=6, fontsize=8, frameon=False)
    _save(figure, path, 110)
