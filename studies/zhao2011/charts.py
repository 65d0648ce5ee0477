"""The figures of Zhao, Koh and Suo (2011), drawn anew from computed data."""

from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import numpy as np
import xarray as xr
from matplotlib import pyplot as plt

SHADES = ("#08306b", "#d55e00", "#4292c6", "#7a3b00")
DASHES = ("-", "--", "-.", ":")
DOTS_PER_INCH = 130


def mechanics(data: xr.Dataset, path: Path) -> None:
    """Draw Fig. 2, relaxation, and Fig. 4, tension."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.6), layout="constrained")
    for index, stretch in enumerate(data.held_stretch.values):
        curve = data.relaxation_stress.sel(held_stretch=stretch)
        style = {"color": SHADES[index], "ls": DASHES[index]}
        left.plot(data.relaxation_time, curve, label=rf"$\lambda_1$ = {stretch:g}", **style)
    left.set(xlabel=r"time $t/\tau$", ylabel=r"stress $s_1/\mu_R$", xlim=(0, 5), ylim=(0, None))
    left.set_title(r"Fig. 2: a stretch that is held, $\mu_U/\mu_R$ = 4", loc="left", fontsize=10)
    left.legend(frameon=False, title="stretch held")
    for index, rate in enumerate(data.stretch_rate.values[::-1]):
        style = {"color": SHADES[index], "ls": DASHES[index]}
        right.plot(data.tension_stretch, data.tension_stress.sel(stretch_rate=rate), label=f"{rate:g} per s", **style)
    right.set(xlabel=r"stretch $\lambda_1$", ylabel="nominal stress (kPa)", xlim=(1, 6), ylim=(0, None))
    right.set_title("Fig. 4: uniaxial tension of VHB, model", loc="left", fontsize=10)
    right.legend(frameon=False, title="stretch rate")
    for ax in (left, right):
        ax.grid(color="0.9", lw=0.5)
    figure.savefig(path, dpi=DOTS_PER_INCH)
    plt.close(figure)


def constant_field(data: xr.Dataset, path: Path) -> None:
    """Draw Fig. 5(b): stretch against time, a cross at each failure."""
    figure, ax = plt.subplots(figsize=(6.6, 4.2), layout="constrained")
    end = float(data.time.max())
    for field in data.field.values:
        film = data.sel(field=field)
        fails = bool(film.outcome == 1) and float(film.time_to_failure) <= end
        times, stretches = film.time.values, film.stretch.values
        if fails:
            times = np.append(times, film.time_to_failure)
            stretches = np.append(stretches, film.critical_stretch)
            kept = np.isfinite(stretches)
            times, stretches = times[kept], stretches[kept]
            ax.plot(times[-1], stretches[-1], "x", color="black", ms=8, mew=1.6)
            ax.annotate(f"{field:g}", (times[-1], stretches[-1]), (-2, 9), textcoords="offset points", fontsize=9)
        else:
            below = -11 if field == 1.0 else 4
            ax.annotate(
                f"{field:g}", (end, stretches[-1]), (-4, below), textcoords="offset points", fontsize=9, ha="right"
            )
        ax.plot(times, stretches, color="#08306b" if fails else "#4292c6", lw=1.4, ls="-" if fails else "--")
    ax.set(xlabel=r"time $t/\tau$", ylabel=r"stretch $\lambda$", xlim=(0, end), ylim=(1.0, 1.95))
    title = r"Fig. 5(b): a field held, numbers are $E/E_c$; x: failure; dashed: no failure so far, $\mu_U/\mu_R$ = 4"
    ax.set_title(title, loc="left", fontsize=9)
    ax.grid(color="0.9", lw=0.5)
    figure.savefig(path, dpi=DOTS_PER_INCH)
    plt.close(figure)


def ramps(data: xr.Dataset, path: Path) -> None:
    """Draw Fig. 6(b) to (d): what a film does at failure, against the ramp rate, with the limits."""
    figure, axes = plt.subplots(1, 3, figsize=(10.0, 3.2), layout="constrained")
    panels = (
        ("ramp_critical_field", r"field at failure $E/E_c$", "Fig. 6(b)", {r"$\sqrt{\mu_U/\mu_R}$": 2.0, "1": 1.0}),
        ("ramp_time_to_failure", r"time to failure $t/\tau$", "Fig. 6(c)", {}),
        (
            "ramp_critical_stretch",
            r"stretch at failure $\lambda$",
            "Fig. 6(d)",
            {"1.848": 1.8477, r"$2^{1/3}$": 2 ** (1 / 3)},
        ),
    )
    for ax, (name, label, title, limits) in zip(axes, panels, strict=True):
        ax.plot(data.rate, data[name], color="#08306b", lw=1.6)
        ax.set(xscale="log", xlabel=r"ramp rate $k\,\tau/E_c$", ylabel=label)
        ax.set_title(title, loc="left", fontsize=10)
        for words, value in limits.items():
            ax.axhline(value, color="#d55e00", ls="--", lw=1.0)
            at_end = value > data[name].mean()
            ax.annotate(words, (2e-3, value) if at_end else (1.0, value), (0, 3), textcoords="offset points",
                        fontsize=9, color="#a04000", va="bottom")  # fmt: skip
        if not limits:
            ax.set_yscale("log")
        ax.margins(y=0.14)
        ax.grid(color="0.9", lw=0.5)
    figure.savefig(path, dpi=DOTS_PER_INCH)
    plt.close(figure)
