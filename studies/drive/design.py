"""The film, its uncertain constants, and the duty cycles that it is allowed."""

import itertools
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import xarray as xr

import dea_maps as dm

if TYPE_CHECKING:
    from common.internals import UniaxialFit

THICKNESS, PERIOD, SUPPLY = 100e-6, 60.0, 1500.0  # m, s, V
PERMITTIVITY = 4.7
STRENGTH, EXPONENT = 30.6e6, 1.13  # V/m, ascribed to Koh (2011): an assumption
STROKE = 0.20  # area strain between the ends of the limit cycle that is asked for
ERROR, RESERVE = 0.05, 0.9  # of every constant; of the allowable duty at worst, what is used
RTOL = 1e-4
# What makes a film fail sooner: the sign of the error of each constant. That it is so, all combinations show.
WEAKENS = {
    "unrelaxed_modulus": -1,
    "relaxed_modulus": -1,
    "relaxation_time": -1,
    "relative_permittivity": 1,
    "breakdown_strength": -1,
}
PULSES = dm.PulseTrain()


def fitted(curves: Path) -> "UniaxialFit":
    """Return the fit to tensile curves in a table with the columns stretch_rate, stretch and nominal_stress."""
    return dm.fit_uniaxial(xr.Dataset.from_dataframe(pd.read_csv(curves)), noise="proportional")


def film(material: dm.Material, **factors: float) -> dm.Material:
    """Return a fitted material with permittivity and strength, some of its constants multiplied by factors."""
    strength = STRENGTH * factors.pop("breakdown_strength", 1.0)
    whole = replace(material, relative_permittivity=PERMITTIVITY)
    changed = {name: getattr(whole, name) * factor for name, factor in factors.items()}
    return replace(whole, **changed, breakdown_strength=lambda stretch: strength * stretch**EXPONENT)


def off(**signs: int) -> dict[str, float]:
    """Return the factors of constants that are off by the error."""
    return {name: 1.0 + ERROR * sign for name, sign in signs.items()}


def corners(quick: bool) -> list[dict[str, float]]:
    """Return the factors of all constants off, in every combination; if quick, the weakest and the strongest."""
    if quick:
        return [off(**{name: side * sign for name, sign in WEAKENS.items()}) for side in (1, -1)]
    return [off(**dict(zip(WEAKENS, signs, strict=True))) for signs in itertools.product((-1, 1), repeat=len(WEAKENS))]


def ends_of(fit: "UniaxialFit") -> list[dm.Material]:
    """Return the films at the ends of the fit's 95 % intervals, in every combination."""
    names = ("unrelaxed_modulus", "relaxed_modulus", "relaxation_time")
    ends = itertools.product(*(fit.intervals[name] for name in names))
    return [film(replace(fit.material, **dict(zip(names, values, strict=True)))) for values in ends]


def allowable_duty(material: dm.Material, voltage: np.ndarray | float, prestretch: float) -> xr.Dataset:
    """Return the largest duty that a film survives without end; NaN where it survives none."""
    volts = xr.DataArray(voltage, dims=("case",) * np.ndim(voltage))
    return dm.allowable(PULSES, "duty", voltage=volts, **_common(material, prestretch))


def allowable_voltage(material: dm.Material, duty: float, prestretch: float) -> float:
    """Return the largest voltage that a film survives without end at a duty."""
    return float(dm.allowable(PULSES, "voltage", duty=duty, **_common(material, prestretch)).allowable_voltage)


def swept(material: dm.Material, voltage: np.ndarray, duty: np.ndarray, prestretch: float) -> xr.Dataset:
    """Return what becomes of films under pulses, voltages and duties side by side."""
    volts, duties = (xr.DataArray(values, dims="case") for values in np.broadcast_arrays(voltage, duty))
    return dm.sweep(PULSES, voltage=volts, duty=duties, **_common(material, prestretch))


def followed(material: dm.Material, voltage: float, duty: float, prestretch: float, seconds: np.ndarray) -> xr.Dataset:
    """Return a film in time."""
    return dm.trajectory(PULSES, time_seconds=seconds, voltage=voltage, duty=duty, **_common(material, prestretch))


def candidates(nominal: dm.Material, weak: dm.Material, prestretches: Sequence[float], count: int) -> xr.Dataset:
    """Return allowable duties over pre-stretch and voltage, and the strains under the share of them that is used.

    Parameters
    ----------
    nominal, weak : Material
        The film as fitted and with all constants off.
    prestretches : sequence of float
    count : int
        Of voltages for each, from just above the largest that may be held without end to 1.7 times that.
    """
    shares = np.linspace(1.05, 1.7, count)
    shape = (len(prestretches), count)
    names = ("voltage", "duty", "duty_at_worst", "strain_most", "strain_least")
    found = {name: np.full(shape, np.nan) for name in names}
    for i, prestretch in enumerate(prestretches):
        film_held = {"material": nominal, "thickness": THICKNESS, "prestretch": prestretch}
        held = float(dm.allowable(dm.Step(), "voltage", **film_held).allowable_voltage)
        found["voltage"][i] = held * shares
        found["duty"][i] = allowable_duty(nominal, held * shares, prestretch).allowable
        found["duty_at_worst"][i] = allowable_duty(weak, held * shares, prestretch).allowable
        known = np.isfinite(found["duty_at_worst"][i])
        ds = swept(nominal, held * shares[known], RESERVE * found["duty_at_worst"][i, known], prestretch)
        found["strain_most"][i, known] = ds.steady_area_strain_max
        found["strain_least"][i, known] = ds.steady_area_strain_min
    words = {
        "voltage": ("voltage of the pulses", "V"),
        "duty": ("largest duty that is survived without end", "1"),
        "duty_at_worst": ("the same, all constants off", "1"),
        "strain_most": ("largest area strain of the limit cycle, from the pre-stretched film", "1"),
        "strain_least": ("smallest area strain of the limit cycle, from the pre-stretched film", "1"),
    }
    about = {name: {"long_name": text, "units": units} for name, (text, units) in words.items()}
    dims = ("prestretch", "share")
    coords = {
        "prestretch": ("prestretch", list(prestretches), {"long_name": "pre-stretch", "units": "1"}),
        "share": ("share", shares, {"long_name": "voltage over the largest held without end", "units": "1"}),
    }
    return xr.Dataset({name: (dims, values, about[name]) for name, values in found.items()}, coords)


def decided(among: xr.Dataset, nominal: dm.Material, weak: dm.Material) -> tuple[float, float, float]:
    """Return the voltage (V), the duty and the pre-stretch of the longest pulses that give the stroke.

    The voltage is rounded up to tens of volts until the stroke is reached, the duty down to whole per cents.
    """
    enough = (among.strain_most - among.strain_least >= STROKE) & (among.voltage <= SUPPLY)
    best = among.isel(among.duty_at_worst.where(enough).argmax(("prestretch", "share")))
    prestretch, voltage = float(best.prestretch), 10.0 * float(np.ceil(best.voltage / 10.0))
    while True:
        at_worst = float(allowable_duty(weak, voltage, prestretch).allowable)
        duty = float(np.floor(100.0 * RESERVE * at_worst)) / 100.0
        if stroke(nominal, voltage, duty, prestretch) >= STROKE:
            return voltage, duty, prestretch
        voltage += 10.0


def stroke(material: dm.Material, voltage: float, duty: float, prestretch: float) -> float:
    """Return the area strain between the ends of the limit cycle."""
    ds = swept(material, np.array([voltage]), np.array([duty]), prestretch).isel(case=0)
    return float(ds.steady_area_strain_max - ds.steady_area_strain_min)


def breakdown_share(material: dm.Material, ds: xr.Dataset, voltage: float) -> float:
    """Return the true field at the largest stretch of the limit cycle, over the strength there."""
    stretch = ds.steady_stretch_max.values
    return float(voltage / THICKNESS * stretch**2 / material.breakdown_strength(stretch))


def _common(material: dm.Material, prestretch: float) -> dict[str, object]:
    return {
        "material": material,
        "thickness": THICKNESS,
        "period_seconds": PERIOD,
        "prestretch": prestretch,
        "rtol": RTOL,
    }
