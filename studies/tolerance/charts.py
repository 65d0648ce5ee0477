"""Charts of delivered against requested relative error, and of what it costs."""

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
from matplotlib.lines import Line2D
from PIL import Image

# Dark blue, orange, light blue: three steps of lightness, told apart in grey, and a marker each.
STYLES = {"step": ("#08306b", "o"), "ramp": ("#d55e00", "s"), "ramp_hold": ("#7fb8dd", "^")}
FLOOR = 1e-17


def _words(regime: str) -> str:
    """Program and regime for a label."""
    program, _, load = regime.partition(": ")
    return f"{program}: {load.replace('_', ' ')}"


def _diagonal(ax: Axes) -> None:
    rtols = np.array([3e-3, 3e-13])
    ax.fill_between(rtols, 0.01 * rtols, rtols, color="0.9", lw=0, label="two decades below rtol")
    ax.plot(rtols, rtols, color="black", lw=1.0, label="rtol")
    ax.set(xscale="log", yscale="log", xlim=rtols)
    ax.grid(color="0.85", lw=0.4)
    ax.set_axisbelow(True)


def _save(figure: Figure, path: Path) -> None:
    """Write a PNG of few colours, a fraction of the size."""
    page = BytesIO()
    figure.savefig(page, dpi=110)
    plt.close(figure)
    Image.open(page).convert("RGB").quantize(160, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE).save(path)


def by_method(data: xr.Dataset, path: Path) -> None:
    """Draw worst and median delivered error of every method against what was asked for."""
    labels = list(data.case.values)
    columns = 3
    rows = -(-len(labels) // columns)
    figure, axes = plt.subplots(
        rows, columns, figsize=(9.0, 2.6 * rows + 0.9), sharex=True, sharey=True, squeeze=False, layout="constrained"
    )
    for ax in axes.flat[len(labels) :]:
        ax.set_visible(False)
    for ax, label in zip(axes.flat, labels, strict=False):
        _diagonal(ax)
        ax.set_ylim(FLOOR, 1e4)
        silent = []
        for program, (colour, marker) in STYLES.items():
            chosen = (data.program.values == program) & (data.fails_later.values == 1)
            part = data.sel(case=[label]).isel(point=chosen)
            if not part.served.any():
                continue
            worst, median = measure.summary(measure.counted(part).values[0])
            ax.plot(data.rtol, np.maximum(worst, FLOOR), color=colour, marker=marker, ms=4.5, lw=1.2)
            ax.plot(
                data.rtol, np.maximum(median, FLOOR), color=colour, marker=marker, mfc="white", ms=3.5, lw=0.9, ls="--"
            )
            if part.unresolved.any():
                silent.append(f"{program} {float(part.unresolved.mean()):.0%}")
        ax.set_title(f"{label}\n" + (f"no answer: {', '.join(silent)}" if silent else ""), fontsize=7.5)
    for ax in axes[:, 0]:
        ax.set_ylabel("delivered error")
    for column in range(columns):
        shown = [ax for ax in axes[:, column] if ax.get_visible()]
        shown[-1].set_xlabel("requested rtol")
        shown[-1].tick_params(labelbottom=True)
    handles, names = axes[0, 0].get_legend_handles_labels()
    for program, (colour, marker) in STYLES.items():
        handles.append(Line2D([], [], color=colour, marker=marker, ms=4.5, lw=1.2))
        handles.append(Line2D([], [], color=colour, marker=marker, mfc="white", ms=3.5, lw=0.9, ls="--"))
        names += [f"{program}, worst", f"{program}, median"]
    figure.legend(handles, names, loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    _save(figure, path)


def by_regime(data: xr.Dataset, path: Path) -> None:
    """Draw the share of the promised error that auto uses, worst in every regime."""
    worst = measure.worst_by_regime(data)
    names = list(worst.regime.values)
    figure, ax = plt.subplots(figsize=(8.0, 0.24 * len(names) + 1.5), layout="constrained")
    shares = np.log10(np.maximum(worst.ratio.values, 1e-8))
    image = ax.pcolormesh(shares, cmap="cividis", vmin=-5, vmax=0, edgecolors="white", lw=0.5)
    for row, column in np.ndindex(shares.shape):
        share = shares[row, column]
        text = "–" if np.isnan(share) else f"{share:.1f}"
        colour = "white" if share < -2.5 else "black"
        weight = "bold" if share < -2.0 else "normal"
        ax.text(column + 0.5, row + 0.5, text, ha="center", va="center", fontsize=7, color=colour, weight=weight)
    labels = [f"{_words(name)} ({points})" for name, points in zip(names, worst["points"].values, strict=True)]
    ax.set_yticks(np.arange(len(names)) + 0.5, labels, fontsize=7)
    ax.set_xticks(np.arange(shares.shape[1]) + 0.5, [f"{rtol:.0e}" for rtol in worst.rtol.values], fontsize=8)
    ax.invert_yaxis()
    ax.set_xlabel("requested rtol")
    ax.set_ylabel("program: regime (points)")
    ax.set_title("auto: log10(worst delivered error / rtol); bold: more than two decades wasted", fontsize=8.5)
    figure.colorbar(image, ax=ax, label="0: all of rtol used", extend="min")
    _save(figure, path)


def costs(data: xr.Dataset, path: Path) -> None:
    """Draw the time per cell of auto in every regime, with the median and ten times the median."""
    names = list(data.regime.values)
    figure, ax = plt.subplots(figsize=(8.0, 0.24 * len(names) + 1.7), layout="constrained")
    rows = np.arange(len(names))
    looks = ((1e-6, "#d55e00", "s", "--"), (1e-12, "#08306b", "o", "-"))
    for rtol, colour, marker, style in looks:
        micro = 1e6 * data.seconds.sel(rtol=rtol).values
        median = float(np.median(micro))
        ax.plot(micro, rows, color=colour, marker=marker, ms=5, ls="", label=f"rtol {rtol:.0e}")
        ax.axvline(median, color=colour, ls=style, lw=1.0, label=f"median at {rtol:.0e}")
        ax.axvline(10.0 * median, color=colour, ls=style, lw=2.4, label=f"ten times the median at {rtol:.0e}")
    ax.set_yticks(rows, [_words(name) for name in names], fontsize=7)
    ax.set(xscale="log", xlim=(0.1, 100.0), xlabel="time per cell, one thread (µs)", ylabel="program: regime")
    ax.invert_yaxis()
    ax.grid(color="0.88", lw=0.4)
    ax.set_axisbelow(True)
    figure.legend(loc="outside lower center", ncols=2, fontsize=8, frameon=False)
    _save(figure, path)


def general(data: xr.Dataset, path: Path) -> None:
    """Draw worst and median delivered error over rtol against rtol, program by program."""
    looks = dict(zip(data.case.values, (("#08306b", "o"), ("#d55e00", "s"), ("#7fb8dd", "^")), strict=True))
    names = list(dict.fromkeys(data.program.values))
    figure, axes = plt.subplots(2, 4, figsize=(9.0, 5.2), sharex=True, sharey=True, layout="constrained")
    for ax in axes.flat[len(names) :]:
        ax.set_visible(False)
    for ax, name in zip(axes.flat, names, strict=False):
        part = data.isel(film=data.program.values == name)
        ax.axhline(1.0, color="black", lw=1.0)
        for case, (colour, marker) in looks.items():
            worst, median = measure.summary((part.error / part.rtol).sel(case=case).transpose("rtol", "film").values)
            ax.plot(data.rtol, np.maximum(worst, 1e-7), color=colour, marker=marker, ms=4.5, lw=1.2)
            ax.plot(
                data.rtol, np.maximum(median, 1e-7), color=colour, marker=marker, mfc="white", ms=3.5, lw=0.9, ls="--"
            )
        silent, wrong = (part[key].sum(("rtol", "film")) for key in ("unresolved", "wrong_outcome"))
        counts = ", ".join(f"{int(silent.sel(case=case))}/{int(wrong.sel(case=case))}" for case in looks)
        ax.set_title(f"{name.replace('_', ' ')}\nno answer/wrong: {counts}", fontsize=7.5)
        ax.set(xscale="log", yscale="log", ylim=(5e-8, 1e7))
        ax.tick_params(labelsize=7, labelbottom=True)
        ax.grid(color="0.85", lw=0.4)
    for ax in axes[-1]:
        ax.set_xlabel("requested rtol", fontsize=8)
    figure.supylabel("delivered error / rtol", fontsize=9)
    handles = [Line2D([], [], color=colour, marker=marker, lw=1.2, ms=4.5) for colour, marker in looks.values()]
    handles.append(Line2D([], [], color="0.3", marker="o", mfc="white", ms=3.5, lw=0.9, ls="--"))
    labels = [f"{case}, worst" for case in looks] + ["median"]
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    _save(figure, path)
