"""Limits and lifetimes of films under repeated programs, from sweeps and questions to the library."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from common import fast_limit

import dea_maps as dm

# Program, the parameter that is the peak field, the other parameters but the period, the shape of a fast cycle.
SHAPES: dict[str, tuple[dm.PulseTrain | dm.BiasedSine | dm.TriangleTrain, str, dict[str, float], Any]] = {
    "square, duty 0.25": (dm.PulseTrain(), "field", {"duty": 0.25}, fast_limit.square(0.25)),
    "square, duty 0.5": (dm.PulseTrain(), "field", {"duty": 0.5}, fast_limit.square(0.5)),
    "square, duty 0.75": (dm.PulseTrain(), "field", {"duty": 0.75}, fast_limit.square(0.75)),
    "sine": (dm.BiasedSine(), "amplitude", {"bias": 0.0}, fast_limit.sine()),
    "triangle": (dm.TriangleTrain(), "field", {}, fast_limit.triangle()),
}
# How a limit cycle is lost: square pulses of half the period, and triangles on a film that creeps little.
LOSSES: dict[str, tuple[str, float, float]] = {
    "square, duty 0.5, modulus ratio 4, period 1": ("square, duty 0.5", 4.0, 1.0),
    "triangle, modulus ratio 2, period 0.1": ("triangle", 2.0, 0.1),
}


def allowable_peaks(periods: Sequence[float], modulus_ratio: float, rtol: float) -> xr.Dataset:
    """Return the largest peak field that is survived, by shape and period, and its limit for short periods.

    Parameters
    ----------
    periods : sequence of float
        In relaxation times.
    modulus_ratio : float
    rtol : float

    Returns
    -------
    Dataset
        ``allowable_peak`` (shape, period) and ``fast_limit`` (shape), in Ec.
    """
    peaks = [
        dm.allowable(
            program, asked, modulus_ratio=modulus_ratio, period=np.asarray(periods), rtol=rtol, **others
        ).allowable.values
        for program, asked, others, _ in SHAPES.values()
    ]
    limits = [fast_limit.critical_peak(modulus_ratio, shape) for *_, shape in SHAPES.values()]
    return xr.Dataset(
        {"allowable_peak": (("shape", "period"), peaks), "fast_limit": ("shape", limits)},
        coords={"shape": list(SHAPES), "period": list(periods)},
    )


def losses(above: Sequence[float], rtol: float) -> xr.Dataset:
    """Return the cycles to failure at peaks above the limit by shares of it.

    Parameters
    ----------
    above : sequence of float
        Peak over the limit, less 1.
    rtol : float

    Returns
    -------
    Dataset
        ``cycles`` (case, above) and ``limit`` (case), in Ec.
    """
    cycles, limits = [], []
    for shape, modulus_ratio, period in LOSSES.values():
        program, asked, others, _ = SHAPES[shape]
        given = {"modulus_ratio": modulus_ratio, "period": period, **others}
        limit = float(dm.allowable(program, asked, rtol=rtol, **given).allowable)
        peaks = {asked: limit * (1.0 + np.asarray(above))}
        cycles.append(dm.sweep(program, rtol=rtol, **peaks, **given).cycles_to_failure.values)
        limits.append(limit)
    return xr.Dataset(
        {"cycles": (("case", "above"), cycles), "limit": ("case", limits)},
        coords={"case": list(LOSSES), "above": list(above)},
    )


def lifetimes(size: int, modulus_ratio: float, rtol: float) -> tuple[xr.Dataset, xr.Dataset]:
    """Return a map of pulse trains over duty and field, and the allowable duty against the field.

    Parameters
    ----------
    size : int
        Values of each.
    modulus_ratio, rtol : float

    Returns
    -------
    map, boundary : Dataset
    """
    given = {"modulus_ratio": modulus_ratio, "period": 1.0, "rtol": rtol}
    duty = np.linspace(0.05, 0.95, size)
    field = np.linspace(1.0, float(np.sqrt(modulus_ratio)), size + 2)[1:-1]
    found = dm.sweep(dm.PulseTrain(), field=field, duty=duty, **given)
    boundary = dm.allowable(dm.PulseTrain(), "duty", field=field[::4], **given)
    return found, boundary
