"""Charts of allowable peaks against the period, of cycles above the limit, and of lifetimes over duty and field."""

from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import numpy as np
import xarray as xr
from matplotlib import pyplot as plt
from matplotlib.colors import LogNorm

LINES = {
    "square, duty 0.25": ("#4292c6", "o", "-"),
    "square, duty 0.5": ("#2171b5", "s", "-"),
    "square, duty 0.75": ("#08306b", "D", "-"),
    "sine": ("#d55e00", "^", "--"),
    "triangle": ("#7a3b00", "v", ":"),
}
DOTS_PER_INCH = 120


def peaks(data: xr.Dataset, path: Path) -> None:
    """Draw the allowable peak against the period, with its limit for short periods at the left edge."""
    figure, ax = plt.subplots(figsize=(6.6, 4.2), layout="constrained")
    first = float(data.period[0])
    for shape, (colour, marker, dash) in LINES.items():
        part = data.sel(shape=shape)
        style = {"color": colour, "marker": marker, "mfc": "white", "ms": 5, "lw": 1.2, "ls": dash}
        ax.plot(part.period, part.allowable_peak, label=shape, **style)
        ax.plot([0.25 * first, 0.7 * first], [float(part.fast_limit)] * 2, color=colour, lw=2.5)
    ax.axhline(1.0, color="0.5", lw=0.8)
    ax.annotate(
        r"field held, $E_c$", (float(data.period[-1]), 1.0), (0, -4), textcoords="offset points", ha="right", va="top"
    )
    ax.set(xscale="log", xlabel=r"period $/\tau$", ylabel=r"allowable peak of the field, $E/E_c$")
    ax.set_ylim(bottom=0.93)
    ax.set_title("Largest peak that is survived indefinitely (bars: limit of short periods)", loc="left", fontsize=10)
    ax.grid(color="0.9", lw=0.5)
    ax.legend(frameon=False, fontsize=9)
    figure.savefig(path, dpi=DOTS_PER_INCH)
    plt.close(figure)


def losses(data: xr.Dataset, path: Path) -> None:
    """Draw the cycles to failure against the distance above the limit, log-log and with a linear ordinate."""
    figure, axes = plt.subplots(1, 2, figsize=(9.0, 3.8), layout="constrained")
    for ax, case, marker in zip(axes, data.case.values, "os", strict=True):
        part = data.sel(case=case)
        ax.plot(part.above, part.cycles, color="#08306b", marker=marker, mfc="white", ms=5, lw=1.0)
        ax.set(xscale="log", xlabel="peak above the limit, relative", ylabel="cycles to failure")
        ax.set_title(str(case), loc="left", fontsize=10)
        ax.grid(color="0.9", lw=0.5)
    tangent = data.isel(case=0)
    axes[0].set_yscale("log")
    guide = float(tangent.cycles[-1]) * np.sqrt(float(tangent.above[-1]) / tangent.above)
    axes[0].plot(tangent.above, guide, color="0.5", lw=1.0, ls="--", label="slope -1/2: tangent")
    axes[0].legend(frameon=False, fontsize=9)
    axes[1].text(0.95, 0.92, "straight: border", transform=axes[1].transAxes, ha="right", va="top", fontsize=9)
    figure.savefig(path, dpi=DOTS_PER_INCH)
    plt.close(figure)


def lifetimes(data: xr.Dataset, boundary: xr.Dataset, path: Path) -> None:
    """Draw the cycles to failure over duty and field, and the boundary of survival."""
    figure, ax = plt.subplots(figsize=(6.2, 4.4), layout="constrained")
    cycles = (data.cycles_to_failure + 1.0).transpose("duty", "field")
    mesh = ax.pcolormesh(data.field, data.duty, cycles, norm=LogNorm(1.0, 100.0), cmap="cividis", shading="nearest")
    bar = figure.colorbar(mesh, ax=ax, extend="max")
    bar.set_label("cycle in which the film fails")
    ax.plot(boundary.field, boundary.allowable, color="black", lw=1.5)
    ax.annotate("survives indefinitely", (0.03, 0.04), xycoords="axes fraction")
    ax.set(xlabel=r"field during a pulse, $E/E_c$", ylabel="duty", ylim=(float(data.duty[0]), float(data.duty[-1])))
    ax.set_title(r"Pulse train, period 1 $\tau$, modulus ratio 4", loc="left", fontsize=10)
    figure.savefig(path, dpi=DOTS_PER_INCH)
    plt.close(figure)
