"""Charts of trajectories per second, memory, starts, and of how close the kernels come to the measured limit."""

from io import BytesIO
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import numpy as np
import xarray as xr
from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from PIL import Image

# Dark blue, orange, light blue: three steps of lightness, told apart in grey, and a marker each.
STYLES = {
    "step": ("#08306b", "o"),
    "ramp": ("#d55e00", "s"),
    "ramp_hold": ("#7fb8dd", "^"),
    "ramp_hold scattered": ("#595959", "x"),
}


def _save(figure: Figure, path: Path) -> None:
    """Write a PNG of few colours, a fraction of the size."""
    page = BytesIO()
    figure.savefig(page, dpi=110)
    plt.close(figure)
    Image.open(page).convert("RGB").quantize(128, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE).save(path)


def sizes(data: xr.Dataset, path: Path) -> None:
    """Draw trajectories per second and memory against the number of cells, for every number of threads."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.5, 4.6), layout="constrained")
    most = data.threads.values.max()
    for program in data.program.values:
        colour, marker = STYLES[program]
        for threads in data.threads.values:
            part = data.sel(program=program, threads=threads)
            single = threads == data.threads.values.min()
            look = {"color": colour, "marker": marker, "ms": 5, "lw": 1.4, "ls": "--" if single else "-"}
            look["mfc"] = "white" if single else colour
            label = f"{program}, {threads} thread" + ("" if threads == 1 else "s")
            left.plot(part.cells, part.rate, label=label, **look)
            if threads == most:
                shown = part.memory.values > 1.0
                right.plot(part.cells.values[shown], part.memory.values[shown], **look)
    cells = np.array([1e4, data.cells.values.max()])
    right.plot(cells, 41.0 * cells / 1e6, color="black", lw=1.0, ls=":")
    left.set(xscale="log", yscale="log", xlabel="cells", ylabel="trajectories per second (rtol 1e-06)")
    right.set(xscale="log", yscale="log", xlabel="cells", ylabel="peak memory of the sweep (MB)")
    for ax in (left, right):
        ax.grid(color="0.87", lw=0.4)
        ax.set_axisbelow(True)
    handles, labels = left.get_legend_handles_labels()
    handles, labels = [*handles, right.lines[-1]], [*labels, "right: the results alone, 41 bytes a cell"]
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    _save(figure, path)


def limits(data: xr.Dataset, path: Path) -> None:
    """Draw trajectories per second against rtol, with the measured limit, and its share."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.5, 4.6), layout="constrained")
    for program in data.program.values:
        colour, marker = STYLES[program]
        look = {"color": colour, "marker": marker, "ms": 5, "lw": 1.4}
        left.plot(data.rtol, data.rate_by_rtol.sel(program=program), label=f"{program}, dm.sweep", **look)
        if program in data.limited.values:
            part = data.sel(limited=program)
            ceiling = part.evaluations_alone / part.evaluations
            hollow = look | {"mfc": "white", "ls": "--"}
            left.plot(data.rtol, part.kernel_rate, label=f"{program}, kernel alone", **hollow)
            left.plot(data.rtol, ceiling, color=colour, lw=1.2, ls=":", label=f"{program}, right-hand side alone")
            right.plot(data.rtol, part.kernel_rate / ceiling, label=program, **look)
    left.set(xscale="log", yscale="log", xlabel="rtol", ylabel="trajectories per second, one thread")
    right.set(xscale="log", ylim=(0.0, 1.0), xlabel="rtol", ylabel="kernel's share of the measured limit")
    for ax in (left, right):
        ax.invert_xaxis()
        ax.grid(color="0.87", lw=0.4)
        ax.set_axisbelow(True)
        ax.legend(fontsize=8, frameon=False)
    low, high = left.get_ylim()
    left.set_ylim(low, 8.0 * high)  # room for the legend
    _save(figure, path)


def starts(data: xr.Dataset, path: Path) -> None:
    """Draw how long a small sweep takes from the start of its process."""
    figure, ax = plt.subplots(figsize=(6.0, 2.9), layout="constrained")
    names = list(data.started.values)
    for number, state in enumerate(data.state.values):
        colour = {"cold": "#08306b", "warm": "#7fb8dd"}[state]
        seconds = data.start.sel(state=state).values
        where = np.arange(len(names)) + 0.38 * (number - 0.5)
        words = {"cold": "cold: nothing compiled yet", "warm": "warm: machine code on disk"}[state]
        bars = ax.barh(where, seconds, 0.36, color=colour, edgecolor="black", lw=0.5, label=words)
        ax.bar_label(bars, [f"{value:.1f}" for value in seconds], padding=3, fontsize=8)
    ax.set_yticks(range(len(names)), names)
    ax.set(xlabel="a process that sweeps 100 cells, start to end (s)", xlim=(0.0, 1.15 * float(data.start.max())))
    ax.invert_yaxis()
    figure.legend(loc="outside upper center", ncols=2, fontsize=8, frameon=False)
    _save(figure, path)
