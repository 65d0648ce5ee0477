"""The figures of the study: each says by itself what it shows, in grey too."""

from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl

mpl.use("Agg")
import design
import numpy as np
import xarray as xr
from matplotlib import pyplot as plt

if TYPE_CHECKING:
    from common.internals import UniaxialFit

DARK, BLUE, ORANGE, GREY = "#08306b", "#4292c6", "#d55e00", "0.35"
COLOURS, MARKERS = (DARK, ORANGE, BLUE, GREY), "os^D"
DOTS_PER_INCH = 130


def _save(figure: plt.Figure, path: Path) -> None:
    figure.savefig(path, dpi=DOTS_PER_INCH)
    plt.close(figure)


def fit(found: "UniaxialFit", computed: bool, path: Path) -> None:
    """Draw tensile curves and their fit."""
    figure, ax = plt.subplots(figsize=(7.0, 4.2), layout="constrained")
    curves = found.curves
    for number, rate in enumerate(np.unique(curves.stretch_rate.values)):
        one = curves.isel(point=np.flatnonzero(curves.stretch_rate.values == rate))
        one = one.isel(point=np.argsort(one.stretch.values))
        style = {"color": COLOURS[number % 4]}
        ax.plot(one.stretch, one.fitted_stress / 1e3, lw=1.2, ls=("-", "--", "-.", ":")[number % 4], **style)
        marker = {"marker": MARKERS[number % 4], "mfc": "white", "ls": "none", "ms": 5}
        ax.plot(one.stretch, one.nominal_stress / 1e3, label=f"{rate:g} per s", **marker, **style)
    m, ends = found.material, found.intervals
    words = "\n".join(
        f"{label} = {getattr(m, name) * scale:.1f} {unit} ({ends[name][0] * scale:.1f} to {ends[name][1] * scale:.1f})"
        for label, name, scale, unit in (
            (r"$\mu_U$", "unrelaxed_modulus", 1e-3, "kPa"),
            (r"$\mu_R$", "relaxed_modulus", 1e-3, "kPa"),
            (r"$\tau$", "relaxation_time", 1.0, "s"),
        )
    )
    ax.annotate(f"fit, 95 % interval:\n{words}", (0.98, 0.04), xycoords="axes fraction", ha="right", fontsize=9)
    ax.set(xlabel="stretch", ylabel="nominal stress (kPa)")
    ax.legend(frameon=False, title="stretch rate", loc="upper left")
    kind = "curves computed with a scatter of 3 %, no measurement" if computed else "measured"
    ax.set_title(f"uniaxial tension, points and fit; {kind}", loc="left", fontsize=10)
    ax.set_ylim(0.0, 1.25 * float(curves.nominal_stress.max()) / 1e3)
    _finish(ax)
    _save(figure, path)


def candidates(among: xr.Dataset, decision: tuple[float, float, float], stroke: float, path: Path) -> None:
    """Draw the allowable duty and the stroke against voltage, a curve for each pre-stretch."""
    voltage, duty, _ = decision
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.6, 4.8), layout="constrained")
    for number, value in enumerate(among.prestretch.values):
        one = among.sel(prestretch=value)
        kilovolts = one.voltage.where(one.duty.notnull()) / 1e3
        style = {"color": COLOURS[number % 4], "lw": 1.3}
        marked = {"marker": MARKERS[number % 4], "mfc": "white", "ms": 5, "markevery": 2}
        left.plot(kilovolts, 100.0 * one.duty, label=f"pre-stretch {value:g}", **style, **marked)
        left.plot(kilovolts, 100.0 * one.duty_at_worst, ls="--", **style)
        right.plot(kilovolts, 100.0 * (one.strain_most - one.strain_least), **style, **marked)
    left.plot([], [], color="black", ls="--", label="all constants 5 % off, at worst")
    left.plot(voltage / 1e3, 100.0 * duty, marker="*", ms=15, color="black", ls="none", label="the decision")
    left.set(xlabel="voltage of the pulses (kV)", ylabel="allowable duty (%)", ylim=(0.0, 100.0))
    right.set(xlabel="voltage of the pulses (kV)", ylabel="stroke: area strain, largest less smallest (%)")
    right.set_ylim(bottom=0.0)
    right.axhline(100.0 * design.STROKE, color="0.5", lw=1.0, ls=":")
    right.annotate("asked for", (0.01, 100.0 * design.STROKE), (0, 3), xycoords=("axes fraction", "data"),
                   textcoords="offset points", ha="left", fontsize=9, color="0.35")  # fmt: skip
    for ax in (left, right):
        ax.axvline(design.SUPPLY / 1e3, color="0.5", lw=1.0, ls=":")
        _finish(ax)
    right.annotate("supply", (design.SUPPLY / 1e3, 1.0), (4, 4), textcoords="offset points", fontsize=9, color="0.35")
    right.plot(voltage / 1e3, 100.0 * stroke, marker="*", ms=15, color="black", ls="none")
    figure.legend(frameon=False, loc="outside lower center", ncols=3, fontsize=9)
    left.set_title(f"film of {design.THICKNESS * 1e6:g} µm, pulses every {design.PERIOD:g} s", loc="left", fontsize=10)
    right.set_title(f"at {100 * design.RESERVE:g} % of the allowable duty at worst", loc="left", fontsize=10)
    _save(figure, path)


def margins(ds: xr.Dataset, path: Path) -> None:
    """Draw the range of the allowable duty for each error."""
    figure, ax = plt.subplots(figsize=(8.4, 3.8), layout="constrained")
    rows = np.arange(ds.sizes["error"])[::-1]
    least, most = (100.0 * ds.allowable_duty.sel(side=side).values for side in ("smallest", "largest"))
    ax.hlines(rows, least, most, color="0.45", lw=5.0, alpha=0.5)
    ax.plot(least, rows, "<", color=ORANGE, ms=8, label="smallest")
    ax.plot(most, rows, ">", color=DARK, mfc="white", ms=8, label="largest")
    ax.axvline(100.0 * float(ds.as_fitted), color="black", lw=1.0, ls="--", label="as fitted")
    ax.axvline(100.0 * ds.attrs["duty"], color="black", lw=2.0, label="duty in use")
    ax.set_yticks(rows, ds.error.values)
    ax.set(xlabel="allowable duty (%)", ylim=(-0.6, rows[0] + 0.6))
    words = f"{ds.attrs['voltage_in_V']:.0f} V every {design.PERIOD:g} s, pre-stretch {ds.attrs['prestretch']:g}"
    ax.set_title(words, loc="left", fontsize=10)
    ax.legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    _finish(ax)
    _save(figure, path)


def waveform(runs: dict[str, xr.Dataset], point: tuple[float, float, float], path: Path) -> None:
    """Draw the voltage and the area strain against time."""
    voltage, duty, prestretch = point
    figure, (top, bottom) = plt.subplots(
        2, 1, figsize=(8.4, 5.0), sharex=True, layout="constrained", height_ratios=(1, 2.6)
    )
    first = next(iter(runs.values()))
    minutes = first.seconds.values / 60.0
    top.plot(minutes, first.applied_voltage / 1e3, color="black", lw=1.2)
    top.set(ylabel="voltage (kV)", ylim=(0.0, 1.25 * voltage / 1e3))
    words = f"{voltage:.0f} V for {duty * design.PERIOD:.3g} s of every {design.PERIOD:g} s"
    top.set_title(f"{words}; {design.THICKNESS * 1e6:g} µm, pre-stretch {prestretch:g}", loc="left", fontsize=10)
    for (name, one), colour, style in zip(runs.items(), (ORANGE, "black", BLUE), ("--", "-", "-."), strict=True):
        bottom.plot(minutes, 100.0 * one.area_strain, color=colour, ls=style, lw=1.4, label=name)
        for bound in (one.steady_area_strain_max, one.steady_area_strain_min):
            bottom.plot([minutes[-1], 1.04 * minutes[-1]], [100.0 * float(bound)] * 2, color=colour, ls=style, lw=2.0)
    bottom.annotate(
        "limit\ncycle", (1.02 * minutes[-1], 0.0), (0, 3), textcoords="offset points", ha="center", fontsize=8
    )
    bottom.set(
        xlabel="time (min)", ylabel="area strain from the pre-stretched film (%)", xlim=(0.0, 1.05 * minutes[-1])
    )
    bottom.set_ylim(bottom=0.0)
    bottom.legend(frameon=False, loc="upper left", fontsize=9)
    for ax in (top, bottom):
        _finish(ax)
    _save(figure, path)


def _finish(ax: plt.Axes) -> None:
    ax.grid(color="0.9", lw=0.5)
    ax.set_axisbelow(True)
