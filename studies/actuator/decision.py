"""The decision: which voltage holds an area strain for a time, how far it is from the limit, and how sure that is."""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import xarray as xr
from common.flags import flag, word

import dea_maps as dm

STRAIN, READY, HOLD = 0.20, 600.0, 3600.0  # the area strain asked for, when it must be there, until when held, in s
ERROR = 0.05
NUMBERS = ("unrelaxed_modulus", "relaxed_modulus", "relaxation_time", "relative_permittivity")
_HALVINGS = 34


def allowable(material: dm.Material, seconds: np.ndarray | float) -> np.ndarray:
    """Return the largest nominal fields in V/m that a film sustains for some times."""
    life = np.asarray(seconds) / material.relaxation_time
    found = dm.allowable_field(life, material.modulus_ratio, strength=_strength(material))
    return found.allowable_field.values * material.critical_field


def needed(materials: Sequence[dm.Material], area_strain: np.ndarray, seconds: np.ndarray | float) -> np.ndarray:
    """Return the smallest nominal fields in V/m that bring films to area strains within times, by bisection.

    Parameters
    ----------
    materials : sequence of Material
        Of n films.
    area_strain, seconds : (k,) ndarray, or a number
        Side by side.

    Returns
    -------
    (n, k) ndarray
        Whether the films fail or break down is not asked.
    """
    strains, times = np.broadcast_arrays(np.atleast_1d(area_strain), seconds)
    stretch = np.tile(np.sqrt(1.0 + strains), len(materials))
    m, tau, Ec = (
        np.repeat([getattr(material, name) for material in materials], strains.size)
        for name in ("modulus_ratio", "relaxation_time", "critical_field")
    )
    ratio, time = _cases(m), _cases(np.tile(times, len(materials)) / tau)
    low, high = np.zeros_like(stretch), np.sqrt(m)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        reached = dm.reachable_stretch(_cases(middle), time, ratio, rtol=1e-8).reachable_stretch.values
        enough = ~(reached < stretch)  # a film that has failed by then was there before
        low, high = np.where(enough, low, middle), np.where(enough, middle, high)
    return (high * Ec).reshape(len(materials), strains.size)


def strain(material: dm.Material, field: np.ndarray | float, seconds: np.ndarray | float) -> np.ndarray:
    """Return area strains under nominal fields (V/m) held for times (s), side by side; NaN where a film is lost."""
    over, time = np.broadcast_arrays(
        np.atleast_1d(field) / material.critical_field, np.atleast_1d(seconds) / material.relaxation_time
    )
    found = dm.reachable_stretch(_cases(over), _cases(time), material.modulus_ratio, strength=_strength(material))
    return found.reachable_stretch.values**2 - 1.0


def lifetime(material: dm.Material, field: np.ndarray) -> np.ndarray:
    """Return the times in s after which films under nominal fields (V/m) fail or break down, by forward sweeps."""
    ratio = material.modulus_ratio
    ds = dm.sweep(dm.Step(), field=_cases(field / material.critical_field), modulus_ratio=ratio)
    if material.breakdown_strength is not None:
        ds = dm.breakdown(ds, material.strength)
        lost = ds.first_limit == flag(ds.first_limit, "breakdown")
        ds["time_to_failure"] = ds.time_to_breakdown.where(lost, ds.time_to_failure)
    return ds.time_to_failure.fillna(np.inf).values * material.relaxation_time


def crossover(material: dm.Material, shortest: float, longest: float) -> float:
    """Return the time in s up to which breakdown and not instability limits the voltage, by bisection."""
    for _ in range(_HALVINGS):
        middle = np.sqrt(shortest * longest)
        time = middle / material.relaxation_time
        limit = dm.allowable_field(time, material.modulus_ratio, strength=material.strength).limit
        shortest, longest = (middle, longest) if word(limit) == "breakdown" else (shortest, middle)
    return float(shortest)


def changed(material: dm.Material, **signs: int) -> dm.Material:
    """Return a material with some of its numbers larger or smaller by the error."""
    return replace(material, **{name: getattr(material, name) * (1.0 + ERROR * sign) for name, sign in signs.items()})


def stronger(material: dm.Material, sign: int) -> dm.Material:
    """Return a material with a breakdown strength larger or smaller by the error."""
    return replace(
        material,
        breakdown_strength=lambda stretch: (1.0 + ERROR * sign) * material.strength(stretch) * material.critical_field,
    )


def corners(material: dm.Material) -> list[dm.Material]:
    """Return the material with each of its numbers larger or smaller by the error, in every combination."""
    return [
        changed(material, **dict(zip(NUMBERS, signs, strict=True)))
        for signs in itertools.product((-1, 1), repeat=len(NUMBERS))
    ]


def windows(material: dm.Material, area_strain: np.ndarray) -> xr.Dataset:
    """Return the nominal fields (V/m) that area strains need and that are allowable, as known and at worst."""
    uncertain = corners(material)
    need, most = needed([material], area_strain, READY)[0], needed(uncertain, area_strain, READY).max(axis=0)
    nominal, least = allowable(material, HOLD), min(allowable(corner, HOLD) for corner in uncertain)
    ends = strain(material, need, HOLD)
    units = {"units": "V m-1"}
    return xr.Dataset(
        {
            "needed": ("area_strain", need, {"long_name": "nominal field that the area strain needs", **units}),
            "needed_at_most": ("area_strain", most, {"long_name": "the same, largest within the errors", **units}),
            "allowable": ((), nominal, {"long_name": "largest nominal field for the holding time", **units}),
            "allowable_at_least": ((), least, {"long_name": "the same, smallest within the errors", **units}),
            "strain_in_the_end": ("area_strain", ends, {"long_name": "area strain", "units": "1"}),
        },
        {"area_strain": ("area_strain", area_strain, {"long_name": "area strain asked for", "units": "1"})},
        {"ready_in_s": READY, "held_for_s": HOLD, "relative_error": ERROR, "critical_field": material.critical_field},
    )


def decided(material: dm.Material) -> float:
    """Return the nominal field in V/m that serves even at worst: the middle of its window."""
    window = windows(material, np.array([STRAIN]))
    return float(np.sqrt(window.needed_at_most[0] * window.allowable_at_least))


def _cases(values: np.ndarray) -> xr.DataArray:
    return xr.DataArray(values, dims="case")


def _strength(material: dm.Material):
    return None if material.breakdown_strength is None else material.strength
