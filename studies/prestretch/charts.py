"""Charts of films under dead loads."""

from io import BytesIO
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import numpy as np
import xarray as xr
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from PIL import Image

COLOURS = ("#08306b", "#d55e00", "#4292c6", "#7a3b00")
MARKS = ("o", "s", "^", "D")
DASHES = ("-", "--", "-.", ":")
FIELD = r"field at failure $E/E_c$"
PRESTRETCH = r"pre-stretch $\lambda_p$"
LEVELS = [0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.7, 0.9, 1.1, 1.4, 1.7]
RATE = r"ramp rate $k\,\tau/E_c$"


def _grid(ax: Axes) -> None:
    ax.grid(color="0.9", lw=0.5)
    ax.set_axisbelow(True)


def _save(figure: Figure, path: Path) -> None:
    """Write a PNG of few colours, a fraction of the size."""
    page = BytesIO()
    figure.savefig(page, dpi=120)
    plt.close(figure)
    Image.open(page).convert("RGB").quantize(160, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE).save(path)


def ramp_map(data: xr.Dataset, path: Path) -> None:
    """Draw the field at failure over pre-stretch and ramp rate, and sections at four rates."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.0, 4.2), layout="constrained")
    x, y, field = data.map_rate.values, data.map_prestretch.values, data.map_field.values
    image = left.pcolormesh(x, y, np.log10(field), cmap="cividis", shading="nearest", rasterized=True)
    left.set_xscale("log")
    lines = left.contour(x, y, field, levels=LEVELS, colors=["white"] * 5 + ["black"] * 6, linewidths=0.9)
    place = x.size // 2 + x.size // 4
    labelled = {level: float(np.interp(-level, -field[:, place], y)) for level in LEVELS if field[-1, place] < level}
    places = [(x[place], height) for height in labelled.values()]
    left.clabel(lines, levels=list(labelled), manual=places, fontsize=8, fmt="%g")
    left.set(xlabel=RATE, ylabel=PRESTRETCH)
    left.set_title(FIELD + " in a ramp", loc="left", fontsize=10)
    bar = figure.colorbar(image, ax=left)
    bar.set_ticks(np.log10([0.2, 0.5, 1.0, 2.0]), labels=["0.2", "0.5", "1", "2"])
    right.fill_between(y, data.map_relaxed, data.map_instant, color="0.9", lw=0, label="between both thresholds")
    for rate, colour, dash in zip((1e-3, 0.1, 1.0, 100.0), COLOURS, DASHES, strict=True):
        part = data.map_field.sel(map_rate=rate, method="nearest")
        right.plot(y, part, color=colour, ls=dash, lw=1.6, label=rf"$k\,\tau/E_c$ = {rate:g}")
    right.set(yscale="log", xlabel=PRESTRETCH, ylabel=FIELD)
    right.set_yticks([0.2, 0.5, 1.0, 2.0], labels=["0.2", "0.5", "1", "2"])
    right.set_yticks([], minor=True)
    right.legend(frameon=False, fontsize=9)
    _grid(right)
    _save(figure, path)


def relaxed_and_fresh(data: xr.Dataset, path: Path) -> None:
    """Draw what becomes of relaxed and of fresh films under the same load, in ramps and under held fields."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.0, 4.0), layout="constrained")
    looks = (("relaxed", "-", None), ("fresh", "--", "white"))
    for load, colour, mark in zip(data["load"].values, COLOURS, MARKS, strict=False):
        for start, dash, face in looks:
            part = data.sel(load=load, start=start)
            style = {"color": colour, "ls": dash, "marker": mark, "mfc": face or colour, "ms": 4, "lw": 1.4}
            left.plot(part.rate, part.start_field, markevery=8, **style)
            time = part.start_time.where(part.start_time > 0.0)
            right.plot(part.excess, time, markevery=8, **style)
    left.set(xscale="log", yscale="log", xlabel=RATE, ylabel=FIELD)
    left.set_yticks([0.2, 0.5, 1.0, 2.0], labels=["0.2", "0.5", "1", "2"])
    left.set_yticks([], minor=True)
    left.set_title("ramp", loc="left", fontsize=10)
    right.set(xscale="log", yscale="log", ylim=(1e-3, None))
    right.set(xlabel="held field over the relaxed threshold, less 1", ylabel=r"time to failure $t/\tau$")
    right.set_title("held field", loc="left", fontsize=10)
    handles = [
        Line2D([], [], color=colour, marker=mark, lw=1.4, ms=4, label=rf"load of $\lambda_p$ = {load:g}")
        for load, colour, mark in zip(data["load"].values, COLOURS, MARKS, strict=False)
    ]
    handles += [
        Line2D([], [], color="0.3", ls=dash, marker="o", mfc=face or "0.3", ms=4, label=label)
        for label, dash, face in (("relaxed before the field", *looks[0][1:]), ("loaded with the field", *looks[1][1:]))
    ]
    right.legend(handles=handles, frameon=False, fontsize=9)
    for ax in (left, right):
        _grid(ax)
    _save(figure, path)


def lifetimes(data: xr.Dataset, path: Path) -> None:
    """Draw time and stretch at failure against the held field over the relaxed threshold."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.0, 4.0), layout="constrained")
    for prestretch, colour, mark, dash in zip(data.prestretch.values, COLOURS, MARKS, DASHES, strict=True):
        part = data.sel(prestretch=prestretch)
        style = {"color": colour, "ls": dash, "marker": mark, "mfc": "white", "ms": 5, "markevery": 10, "lw": 1.4}
        left.plot(part.life_excess, part.life_time, label=rf"$\lambda_p$ = {prestretch:g}", **style)
        fails_later = part.life_time.notnull()
        right.plot(part.life_excess, (part.life_stretch / prestretch).where(fails_later), **style)
    for ax in (left, right):
        ax.set(xscale="log", xlabel="held field over the relaxed threshold, less 1")
        _grid(ax)
    left.set(yscale="log", ylabel=r"time to failure $t/\tau$", ylim=(1e-2, None))
    left.legend(frameon=False)
    right.set(ylabel=r"stretch at failure over pre-stretch $\lambda/\lambda_p$")
    _save(figure, path)


def unequal(data: xr.Dataset, path: Path) -> None:
    """Draw what the equibiaxial film says too much, against the difference of the stresses."""
    figure, axes = plt.subplots(1, 3, figsize=(10.5, 3.8), sharey=True, layout="constrained")
    panels = {"field_error": "field, ramp", "stretch_error": "stretch, ramp", "time_error": "time, held at 1.05"}
    for ax, (name, title) in zip(axes, panels.items(), strict=True):
        for mean, colour, mark in zip(data["mean"].values, COLOURS, MARKS, strict=True):
            error = data[name].sel(mean=mean)
            style = {"color": colour, "marker": mark, "ms": 6, "lw": 1.0, "ls": "-"}
            ax.plot(data.share, np.abs(error), mfc="none", label=rf"$\lambda_p$ = {mean:g}", **style)
            ax.plot(data.share, error.where(error > 0.0), **{**style, "ls": ""})
        ax.axvline(1.0, color="0.4", lw=1.0, ls=":")
        ax.axhline(0.01, color="0.4", lw=1.0, ls="--")
        ax.set(xscale="log", yscale="log", ylim=(1e-7, 10.0), xlabel=r"$(s_1-s_2)/(s_1+s_2)$")
        ax.set_title(title, loc="left", fontsize=10)
        _grid(ax)
    axes[0].set_ylabel("equibiaxial over general model, less 1")
    axes[0].legend(frameon=False, fontsize=9)
    handles = [
        Line2D([], [], color="0.3", ls="", marker="o", ms=6, mfc=face, label=label)
        for label, face in (("too large", "0.3"), ("too small", "none"))
    ]
    axes[2].legend(handles=handles, frameon=False, fontsize=9, title="equibiaxial", loc="lower right")
    _save(figure, path)


def stiffening(data: xr.Dataset, path: Path) -> None:
    """Draw the instability of films that stiffen, and until which pre-stretch there is one."""
    figure, axes = plt.subplots(1, 3, figsize=(10.5, 3.8), layout="constrained")
    x = data.gent_prestretch
    for limit, colour, dash in zip(data.limit.values, COLOURS, DASHES, strict=True):
        label = rf"$J$ = {limit:g}" if np.isfinite(limit) else "neo-Hookean"
        part = data.sel(limit=limit)
        for ax, y in zip(axes, (part.gent_field, part.gent_stretch), strict=False):
            ax.plot(x, y, color=colour, ls=dash, lw=1.5, label=label)
            last = np.flatnonzero(np.isfinite(y.values))[-1]
            if np.isfinite(limit):
                ax.plot(x[last], y[last], "x", color=colour, ms=8, mew=1.8)
    axes[0].plot(
        x, data.frame_field.where(x > 1.0), color="0.4", lw=2.6, ls="-", alpha=0.6, label="tension lost in a frame"
    )
    axes[0].set(xlabel=PRESTRETCH, ylabel=r"field $E/E_c$", ylim=(0.0, 1.05))
    axes[1].set(xlabel=PRESTRETCH, ylabel="stretch at the instability")
    axes[0].legend(frameon=False, fontsize=8)
    axes[0].set_title("x: no instability beyond", loc="left", fontsize=10)
    known = data.last_prestretch.notnull().values
    limits, last = data.gent_limit.values[known], data.last_prestretch.values[known]
    axes[2].plot(limits, last, color=COLOURS[0], lw=1.6)
    axes[2].fill_between(limits, 1.0, last, color="0.88", lw=0)
    axes[2].annotate("unstable at some field", (0.45, 0.12), xycoords="axes fraction", fontsize=9)
    axes[2].annotate("no instability", (0.08, 0.7), xycoords="axes fraction", fontsize=9)
    axes[2].set(xscale="log", xlabel=r"$J$ of Gent's network", ylabel=PRESTRETCH, xlim=(10.0, 1000.0), ylim=(1.0, None))
    for ax in axes:
        _grid(ax)
    _save(figure, path)
