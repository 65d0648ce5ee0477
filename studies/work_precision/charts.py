"""Charts of time per trajectory against delivered error, and of how much faster than others at equal accuracy."""

from io import BytesIO
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import measure
import numpy as np
import xarray as xr
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from pieces import Films
from PIL import Image
from scenes import SCENES, SIZES

# Dark to light, so that they differ in grey; markers tell the methods of a library apart.
COLOURS = {"dea_maps": "#000000", "heyoka": "#08306b", "CyRK": "#d55e00", "diffrax": "#3a9a5b", "NumPy": "#9467bd"}
COLOURS["SciPy"] = "#9ab6c8"
MARKERS = {"dea_maps": "osDv^P<>Xh", "heyoka": "osDv^", "CyRK": "PX<>*h", "diffrax": "pd8H^", "NumPy": "o"}
MARKERS["SciPy"] = "v^<>o"
LEAST, NOTHING = 1e-15, 10.0  # errors drawn at the edges: below, and where a case has no answer
TARGETS = {"S1": 15, "S2": 5, "S3s": 15, "S3r": 5, "S4s": 15, "S4r": 20, "OD": 10, "TZ": 10, "TT": 10, "PS": 5, "PR": 5}


def _save(figure: Figure, path: Path) -> None:
    """Write a PNG of few colours, a fraction of the size."""
    page = BytesIO()
    figure.savefig(page, dpi=105)
    plt.close(figure)
    Image.open(page).convert("RGB").quantize(128, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE).save(path)


def _curves(ax: Axes, part: xr.Dataset, names: list[str], what: str) -> None:
    """Draw one curve a solver; those on the paper's form dashed, with open markers."""
    count: dict[str, int] = {}
    for name in names:
        one = part.sel(solver=name)
        measured = np.isfinite(one.seconds.values)
        if not measured.any():
            continue
        library = str(one.library.values)
        number = count[library] = count.get(library, -1) + 1
        error = np.clip(one[what].values[measured], LEAST, None)
        micro = 1e6 * one.seconds.values[measured]
        lost = ~(error < 0.5 * NOTHING)
        rate = bool(one.rate_form.values)
        marker = MARKERS[library][number % len(MARKERS[library])]
        colour = COLOURS[library]
        if library == "dea_maps" and name != "auto":
            colour = plt.get_cmap("viridis")(min(0.12 * number, 0.9))
        ax.plot(np.full(lost.sum(), NOTHING), micro[lost], color=colour, marker=marker,
                ms=4.5, ls="", mfc="white" if rate else colour)  # fmt: skip
        ax.plot(
            np.where(lost, np.nan, error), micro, color=colour, marker=marker,
            ms=4.5 if name != "auto" else 6.0, lw=2.4 if name == "auto" else 1.0, ls="--" if rate else "-",
            mfc="white" if rate else colour, label=name if library != "dea_maps" else f"dea_maps: {name}",
        )  # fmt: skip


def scene(data: xr.Dataset, name: str, path: Path) -> None:
    """Draw the worst and the median error of every solver in a scene."""
    part = data.sel(scene=name)
    groups = measure.groups(data)
    left, right = groups["ours"], ["auto", *groups["others"]]
    columns = 2 if part.seconds.sel(solver=groups["others"]).notnull().any() else 1
    figure, axes = plt.subplots(
        2, columns, figsize=(5.0 * columns + 0.5, 8.4), sharex=True, sharey=True, squeeze=False, layout="constrained"
    )
    for row, what in enumerate(("worst", "median")):
        for column, names in enumerate((left, right)[:columns]):
            ax = axes[row, column]
            _curves(ax, part, names, what)
            ax.axvspan(0.5 * NOTHING, 4.0 * NOTHING, color="0.9", lw=0)
            ax.set(xscale="log", yscale="log", xlim=(4.0 * NOTHING, 0.4 * LEAST))
            ax.grid(color="0.88", lw=0.4)
            ax.set_axisbelow(True)
            whose = "methods of dea_maps" if column == 0 else "other solvers, and auto"
            ax.set_title(f"{what} error: {whose}", fontsize=9)
    for ax in axes[:, 0]:
        ax.set_ylabel("time per trajectory, one core (µs)")
    for column in range(columns):
        axes[-1, column].set_xlabel("relative error (grey: 5 or more, or no answer)")
    figure.suptitle(f"{name}: {SCENES[name].title}", fontsize=10)
    handles: dict[str, object] = {}
    for ax in axes[0]:
        handles |= {label: handle for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    figure.legend(
        handles.values(), handles.keys(), loc="outside lower center", ncols=2 * columns, fontsize=7, frameon=False
    )
    _save(figure, path)


def summary(data: xr.Dataset, path: Path) -> None:
    """Draw the ratio of auto's trajectories per second to those of the fastest other solver, by scene."""
    groups = measure.groups(data)
    scenes = [name for name in data.scene.values if name in TARGETS]
    figure, axes = plt.subplots(1, 2, figsize=(9.5, 4.4), sharey=True, layout="constrained")
    whose = {"others": "any formulation", "rate": "the paper's form; OD to PR told nothing"}
    shades = ("#08306b", "#3b7bb5", "#8fbcd9", "#d5e4ef")
    for ax, (group, words) in zip(axes, whose.items(), strict=True):
        for number, accuracy in enumerate(measure.ACCURACIES):
            for place, name in enumerate(scenes):
                _, mine = measure.fastest(data, name, groups["auto"], accuracy)
                films = group == "rate" and isinstance(SCENES[name].cases(SIZES[0]), Films)
                _, others = measure.fastest(data, name, groups["untold" if films else group], accuracy)
                x = place + 0.2 * (number - 1.5)
                if np.isfinite(mine / others):
                    ax.bar(x, mine / others, 0.18, color=shades[number], edgecolor="black", lw=0.5)
                else:
                    ax.text(x, 0.35, "none" if np.isnan(others) else "auto: none", rotation=90, ha="center", fontsize=7)
            ax.bar(np.nan, np.nan, color=shades[number], edgecolor="black", lw=0.5, label=f"error {accuracy:.0e}")
        if group == "others":
            for place, name in enumerate(scenes):
                ax.hlines(TARGETS[name], place - 0.42, place + 0.42, color="#d55e00", lw=2.0)
            ax.hlines(np.nan, 0.0, 1.0, color="#d55e00", lw=2.0, label="aim at 1e-06 and 1e-10")
        ax.set_xticks(range(len(scenes)), scenes)
        ax.axhline(1.0, color="black", lw=0.6)
        ax.set(yscale="log", xlabel="scene", xlim=(-0.6, len(scenes) - 0.4))
        ax.set_title(f"auto over the fastest other: {words}", fontsize=9)
        ax.grid(color="0.85", lw=0.4, axis="y")
        ax.set_axisbelow(True)
    axes[0].set_ylim(bottom=0.3)
    axes[0].set_ylabel("ratio of trajectories per second")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=5, fontsize=8, frameon=False)
    _save(figure, path)
