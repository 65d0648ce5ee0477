"""Charts of cost against error by amount of model, of unequal loads, and of cycles replaced by their average."""

from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import xarray as xr
from matplotlib import pyplot as plt
from matplotlib.lines import Line2D

STYLES = {
    "five states": ("#08306b", "o"),
    "equibiaxial, same integrator": ("#4292c6", "s"),
    "equibiaxial, rate form": ("#8a8a8a", "v"),
    "scalar, regular form": ("#d55e00", "^"),
    "quadrature": ("#000000", "D"),
    "closed form": ("#7a3b00", "*"),
}
DOTS_PER_INCH = 120


def costs(data: xr.Dataset, path: Path) -> None:
    """Draw time per film against error at failure, a panel for each scene."""
    styles = {amount: STYLES[amount] for amount in data.amount.values}
    figure, axes = plt.subplots(2, 4, figsize=(11.0, 5.6), sharex=True, sharey=True, layout="constrained")
    for ax, scene in zip(axes.flat, data.scene.values, strict=False):
        for amount, (colour, marker) in styles.items():
            part = data.sel(scene=scene, amount=amount)
            if part.error.isnull().all():
                continue
            style = {"color": colour, "marker": marker, "mfc": "white", "ms": 5, "lw": 1.0}
            single = amount == "closed form"
            points = part.isel(rtol=slice(0, 1)) if single else part
            ax.plot(points.error.where(points.error > 0.0), points.seconds, **style)
        ax.set(xscale="log", yscale="log", xlim=(1e-15, 1e3), ylim=(1e-8, 10.0))
        ax.set_title(str(scene), loc="left", fontsize=10)
        ax.grid(color="0.9", lw=0.5)
    for ax in axes[:, 0]:
        ax.set_ylabel("time per film (s)")
    for ax in axes.flat[3:7]:
        ax.set_xlabel("relative error at failure")
        ax.tick_params(labelbottom=True)
    axes.flat[-1].set_axis_off()
    handles = [
        Line2D([], [], color=colour, marker=marker, mfc="white", ms=5, lw=1.0, label=amount)
        for amount, (colour, marker) in styles.items()
    ]
    axes.flat[-1].legend(handles=handles, loc="center", frameon=False, title="amount of model", fontsize=9)
    figure.savefig(path, dpi=DOTS_PER_INCH)
    plt.close(figure)


def unequal(data: xr.Dataset, path: Path) -> None:
    """Draw what the equibiaxial reduction is wrong by against the difference of the stresses."""
    figure, axes = plt.subplots(1, data.sizes["case"], figsize=(10.5, 3.8), sharey=True, layout="constrained")
    lines = {
        "apart": ("stretches apart, " + r"$\lambda_1/\lambda_2-1$", "#08306b", "o"),
        "error_stretch": ("error of the stretch", "#d55e00", "s"),
        "error_time": ("error of the time", "#4292c6", "^"),
    }
    for ax, case in zip(axes, data.case.values, strict=True):
        part = data.sel(case=case)
        for name, (label, colour, marker) in lines.items():
            ax.plot(part.difference, part[name], color=colour, marker=marker, mfc="white", ms=5, lw=1.0, label=label)
        ax.set(xscale="log", yscale="log", xlabel=r"half the difference $(s_1-s_2)/2\mu_R$")
        ax.set_title(str(case), loc="left", fontsize=10)
        ax.grid(color="0.9", lw=0.5)
    axes[0].set_ylabel("relative to equal stresses, at failure")
    axes[0].legend(frameon=False, fontsize=9)
    figure.savefig(path, dpi=DOTS_PER_INCH)
    plt.close(figure)


def average(data: xr.Dataset, path: Path) -> None:
    """Draw the errors of the flow averaged over a cycle against the period, a panel for each shape."""
    figure, axes = plt.subplots(1, data.sizes["shape"], figsize=(9.0, 3.8), sharey=True, layout="constrained")
    for ax, shape in zip(axes, data["shape"].values, strict=True):
        part = data.sel(shape=shape)
        style = {"mfc": "white", "ms": 5, "lw": 1.0}
        ax.plot(part.period, part.error_peak, color="#08306b", marker="o", label="allowable peak", **style)
        for above, colour, marker in zip(data.above.values, ("#d55e00", "#7a3b00"), "s^", strict=True):
            label = f"lifetime, peak {above:.0%} above the limit"
            ax.plot(
                part.period, part.error_lifetime.sel(above=above), color=colour, marker=marker, label=label, **style
            )
        ax.set(xscale="log", yscale="log", xlabel=r"period $/\tau$")
        ax.set_title(str(shape), loc="left", fontsize=10)
        ax.grid(color="0.9", lw=0.5)
    axes[0].set_ylabel("relative error of the averaged flow")
    axes[0].legend(frameon=False, fontsize=9)
    figure.savefig(path, dpi=DOTS_PER_INCH)
    plt.close(figure)
