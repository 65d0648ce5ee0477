"""Charts of allowable voltages, how films get there, and how sure the decision is."""

from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import films
import numpy as np
import xarray as xr
from common.flags import flag
from common.internals import UniaxialFit, draw_fit
from matplotlib import pyplot as plt

import dea_maps as dm

DARK, ORANGE, BLUE, BROWN = "#08306b", "#d55e00", "#4292c6", "#7a3b00"
DOTS_PER_INCH = 130
LONG = (500.0, 600.0, 700.0, 800.0, 820.0, 850.0, 900.0)  # V, over 50 um of the preset
SHORT = (900.0, 1000.0, 1100.0, 1200.0, 1300.0, 1350.0, 1380.0)


def save(figure: plt.Figure, path: Path) -> None:
    """Write a figure."""
    figure.savefig(path, dpi=DOTS_PER_INCH)
    plt.close(figure)


def fit(found: UniaxialFit, measured: bool, path: Path) -> None:
    """Draw tensile curves, measured or made up, and their fit."""
    figure = draw_fit(found)
    if not measured:
        words = f"no measurement: computed,\nwith a scatter of {100 * films.SCATTER:g} %"
        figure.axes[0].annotate(words, (0.97, 0.05), xycoords="axes fraction", ha="right", fontsize=8)
    figure.savefig(path, dpi=2 * DOTS_PER_INCH)


def design(borne: xr.Dataset, path: Path) -> None:
    """Draw the allowable voltage against the holding time."""
    figure, ax = plt.subplots(figsize=(8.0, 4.4), layout="constrained")
    dm.charts.design_chart(borne, ax)
    save(figure, path)


def map_in_volts(without: xr.Dataset, broken: xr.Dataset, path: Path) -> None:
    """Draw the phase diagram of ramps that hold, without and with breakdown."""
    figure, axes = plt.subplots(1, 2, figsize=(10.4, 4.4), layout="constrained")
    for ax, ds in zip(axes, (without, broken), strict=True):
        dm.charts.phase_diagram(ds, ax)
    save(figure, path)


def ramps(ds: xr.Dataset, path: Path) -> None:
    """Draw the voltage and the area strain to which a ramp leads, against its rate."""
    figure, axes = plt.subplots(1, 2, figsize=(10.0, 3.8), layout="constrained")
    lost = ds.first_limit == flag(ds.first_limit, "breakdown")
    voltage = ds.breakdown_voltage.where(lost, ds.critical_voltage)
    stretch = ds.breakdown_stretch.where(lost, ds.critical_stretch)
    panels = (
        ("voltage in the end (kV)", ds.critical_voltage / 1e3, voltage / 1e3),
        ("area strain in the end (%)", 100.0 * (ds.critical_stretch**2 - 1.0), 100.0 * (stretch**2 - 1.0)),
    )
    for ax, (label, free, first) in zip(axes, panels, strict=True):
        ax.plot(ds.voltage_rate, free, color=DARK, label="instability alone")
        ax.plot(ds.voltage_rate, first, color=ORANGE, ls="--", label="with electrical breakdown")
        ax.set(xscale="log", xlabel="ramp rate (V/s)", ylabel=label)
        ax.set_xlim(float(ds.voltage_rate[0]), float(ds.voltage_rate[-1]))
        ax.grid(color="0.9", lw=0.5)
    axes[0].set_title(f"ramps of {ds.attrs['material']}, 100 µm", loc="left", fontsize=10)
    axes[0].legend(frameon=False, loc="upper left")
    save(figure, path)


def held(material: dm.Material, decision: float, nodes: int, path: Path) -> tuple[xr.Dataset, xr.Dataset]:
    """Draw the stretch of the thin film against time, under voltages held long and short; return both.

    Parameters
    ----------
    material : Material
        With a breakdown strength.
    decision : float
        Voltage in V.
    nodes : int
        Number of times.
    path : Path
        Of the figure.
    """
    scale = material.critical_field / dm.VHB.critical_field
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.4, 4.6), layout="constrained")
    long = _held(material, np.sort([*np.array(LONG) * scale, decision]), np.linspace(0.0, 3600.0, nodes))
    dm.charts.trajectories(long, left)
    short = _held(material, np.array(SHORT) * scale, np.geomspace(1.0, 1000.0, nodes))
    dm.charts.trajectories(short, right)
    save(figure, path)
    return long, short


def _held(material: dm.Material, voltages: np.ndarray, seconds: np.ndarray) -> xr.Dataset:
    """Return the thin film under voltages held, and when it fails or breaks down."""
    field = voltages / (material.critical_field * films.THIN)
    time = seconds / material.relaxation_time
    ds = dm.trajectory(dm.Step(), time=time, field=field, modulus_ratio=material.modulus_ratio)
    return dm.physical(dm.breakdown(ds, material.strength), material, films.THIN)


def windows(ds: xr.Dataset, path: Path) -> None:
    """Draw voltages that area strains need and those that are allowable for the thin film, as known and at worst."""
    figure, ax = plt.subplots(figsize=(7.0, 4.2), layout="constrained")
    kilovolts = films.THIN / 1e3
    x = 100.0 * ds.area_strain
    ax.plot(x, ds.needed * kilovolts, color=DARK, label="needed")
    ax.plot(x, ds.needed_at_most * kilovolts, color=DARK, ls="--", label="needed, at worst")
    ax.axhline(ds.allowable * kilovolts, color=ORANGE, label="allowable")
    ax.axhline(ds.allowable_at_least * kilovolts, color=ORANGE, ls="--", label="allowable, at worst")
    least, most = ds.allowable_at_least * kilovolts, ds.needed_at_most * kilovolts
    ax.fill_between(x, most, least, where=most < least, color="0.85", lw=0, label="serves even at worst")
    ax.set(xlabel="area strain asked for (%)", ylabel="voltage over 50 µm (kV)", xlim=(float(x[0]), float(x[-1])))
    ax.secondary_yaxis("right", functions=(_double, _half)).set_ylabel("voltage over 100 µm (kV)")
    words = f"reached within {ds.ready_in_s / 60:g} min, held until {ds.held_for_s / 3600:g} h"
    ax.set_title(f"{words}; at worst: each number {100 * ds.relative_error:g} % off", loc="left", fontsize=10)
    ax.legend(frameon=False)
    ax.grid(color="0.9", lw=0.5)
    save(figure, path)


def _double(voltage: np.ndarray) -> np.ndarray:
    return voltage * (films.THICK / films.THIN)


def _half(voltage: np.ndarray) -> np.ndarray:
    return voltage * (films.THIN / films.THICK)


def agreement(ds: xr.Dataset, path: Path) -> None:
    """Draw the distance of answers from forward computations, in units of the accuracy asked for."""
    figure, ax = plt.subplots(figsize=(7.6, 4.0), layout="constrained")
    colours, markers = (DARK, BLUE, ORANGE, BROWN, "0.3", "black"), "oo^^sD"
    for answer, colour, marker in zip(ds.answer.values, colours, markers, strict=True):
        dashed = "--" if "breakdown" in str(answer) else "-"
        style = {"color": colour, "marker": marker, "ls": dashed, "mfc": "white", "ms": 6, "lw": 1.2}
        ax.plot(ds.rtol, ds.worst.sel(answer=answer), label=str(answer), **style)
    ax.axhline(1.0, color="black", lw=1.0)
    ax.annotate("rtol", (ds.rtol.max(), 1.0), (0, 4), textcoords="offset points", ha="left", fontsize=9)
    ax.set(xscale="log", yscale="log", xlabel="rtol asked for", ylabel="worst distance / rtol", ylim=(1e-7, 6.0))
    ax.invert_xaxis()
    ax.grid(color="0.9", lw=0.5)
    ax.legend(frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=9)
    ax.set_title("inverse answers against forward sweeps and trajectories", loc="left", fontsize=10)
    save(figure, path)
