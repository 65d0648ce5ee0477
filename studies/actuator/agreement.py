"""Answers of the inverse questions held against forward sweeps and trajectories, in units of the accuracy asked for."""

from collections.abc import Callable

import numpy as np
import xarray as xr
from common.flags import flag

import dea_maps as dm

RTOLS = (1e-3, 1e-4, 1e-6, 1e-8, 1e-10)
RATIOS = (1.5, 2.0, dm.VHB.modulus_ratio, 10.0)
TIGHT = 1e-12
_LOOKED, _HALVINGS = 8.0, 24  # how far from an answer to look for the true one, in units of rtol, and how closely
_ELASTIC = 2.0 ** (1.0 / 3.0)
Strength = Callable[[np.ndarray], np.ndarray]


def measure(strength: Strength, count: int, rtols: tuple[float, ...]) -> xr.Dataset:
    """Return how far answers are from what forward computations say, at worst over a grid.

    Parameters
    ----------
    strength : callable
        Breakdown strength, normalised by the relaxed critical field.
    count : int
        Of lifetimes, stretches and the like, for each modulus ratio.
    rtols : tuple of float
        Accuracies to ask for.
    """
    asked = {
        "allowable field": lambda rtol: _fields(count, rtol, None),
        "allowable field, breakdown": lambda rtol: _fields(count, rtol, strength),
        "allowable rate": lambda rtol: _rates(count, rtol, None),
        "allowable rate, breakdown": lambda rtol: _rates(count, rtol, strength),
        "reachable stretch": lambda rtol: _stretches(count, rtol),
        "time to breakdown": lambda rtol: _breakdowns(count, rtol, strength),
    }
    distances = {name: [of(rtol) for rtol in rtols] for name, of in asked.items()}
    worst = [[np.max(found) for found in row] for row in distances.values()]
    cells = [row[0].size for row in distances.values()]
    about = {"long_name": "largest distance from forward computations over rtol", "units": "1"}
    return xr.Dataset(
        {
            "worst": (("answer", "rtol"), worst, about),
            "cells": ("answer", cells, {"long_name": "answers compared", "units": "1"}),
        },
        {"answer": list(asked), "rtol": ("rtol", list(rtols), {"long_name": "accuracy asked for", "units": "1"})},
    )


def _grid(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    m, x = np.meshgrid(RATIOS, values, indexing="ij")
    return m.ravel(), x.ravel()


def _fields(count: int, rtol: float, strength: Strength | None) -> np.ndarray:
    """Return distances of allowable fields; with a strength, of those that breakdown limits."""
    m, life = _grid(np.geomspace(1e-2, 300.0, count))
    found = dm.allowable_field(_cases(life), _cases(m), rtol=rtol, strength=strength)
    field = found.allowable_field.values
    if strength is not None:
        chosen = (found.limit == flag(found.limit, "breakdown")).values
        m, life, field = m[chosen], life[chosen], field[chosen]

    def lost(E: np.ndarray) -> np.ndarray:
        parameters = {"field": _cases(E), "modulus_ratio": _cases(m)}
        if strength is None:
            return dm.sweep(dm.Step(), **parameters, rtol=TIGHT).time_to_failure.values <= life
        return ~(_excess(strength, E, _stretch_at(dm.Step(), life, **parameters)) <= 0.0)

    return _distance(lost, field, rtol)


def _rates(count: int, rtol: float, strength: Strength | None) -> np.ndarray:
    """Return distances of allowable rates, or of the stretches to which they lead, where they are the smaller ones.

    With a strength, of those that breakdown limits.
    """
    m, share = _grid(np.linspace(0.05, 0.95, count))
    barely = np.nextafter(1.0, 2.0)
    farthest = dm.sweep(dm.Step(), field=barely, modulus_ratio=_cases(m)).critical_stretch.values
    aim = _ELASTIC + share * (farthest - _ELASTIC)
    found = dm.allowable_rate(_cases(aim), _cases(m), rtol=rtol, strength=strength)
    chosen = np.isfinite(found.allowable_rate.values)
    if strength is not None:
        chosen &= (found.limit == flag(found.limit, "breakdown")).values
    m, aim, rate = m[chosen], aim[chosen], found.allowable_rate.values[chosen]

    def reached(k: np.ndarray) -> np.ndarray:
        parameters = {"rate": _cases(k), "modulus_ratio": _cases(m)}
        if strength is None:
            return dm.sweep(dm.Ramp(), **parameters, rtol=TIGHT).critical_stretch.values
        largest = strength(aim) / aim**2  # the nominal field at which a film breaks down at that stretch
        return _stretch_at(dm.Ramp(), largest / k, **parameters)

    return np.fmin(_distance(lambda k: reached(k) < aim, rate, rtol), np.abs(reached(rate) / aim - 1.0) / rtol)


def _stretches(count: int, rtol: float) -> np.ndarray:
    """Return distances of reachable stretches, up to shortly before failure."""
    m, share = _grid(np.linspace(0.05, 0.999, count))
    fields = 1.0 + (np.sqrt(m) - 1.0) * 0.5
    time = share * dm.sweep(dm.Step(), field=_cases(fields), modulus_ratio=_cases(m)).time_to_failure.values
    found = dm.reachable_stretch(_cases(fields), _cases(time), _cases(m), rtol=rtol).reachable_stretch.values
    forward = _stretch_at(dm.Step(), time, field=_cases(fields), modulus_ratio=_cases(m))
    return np.abs(found / forward - 1.0) / rtol


def _breakdowns(count: int, rtol: float, strength: Strength) -> np.ndarray:
    """Return distances of times to breakdown in ramps that hold, or of the true fields then, if they are smaller."""
    m, rate = _grid(np.geomspace(1e-2, 1e3, count))
    field = 1.0 + 0.9 * (np.sqrt(m) - 1.0)
    ds = dm.sweep(dm.RampHold(), field=_cases(field), rate=_cases(rate), modulus_ratio=_cases(m))
    found = dm.breakdown(ds, strength, rtol=rtol)
    found = found.isel(case=(found.first_limit == flag(found.first_limit, "breakdown")).values)
    parameters = {name: _cases(found[name].values) for name in ("field", "rate", "modulus_ratio")}
    time = found.time_to_breakdown.values

    def over(T: np.ndarray) -> np.ndarray:
        applied = np.minimum(parameters["field"].values, parameters["rate"].values * T)
        return _excess(strength, applied, _stretch_at(dm.RampHold(), T, **parameters))

    return np.fmin(_distance(lambda T: ~(over(T) <= 0.0), time, rtol), np.abs(over(time)) / rtol)


def _stretch_at(program: dm.Step | dm.Ramp | dm.RampHold, time: np.ndarray, **parameters: xr.DataArray) -> np.ndarray:
    """Return the stretch of each case at its own time."""
    ds = dm.trajectory(program, time=time, rtol=TIGHT, **parameters)
    return np.diagonal(ds.stretch.values).copy()


def _excess(strength: Strength, field: np.ndarray, stretch: np.ndarray) -> np.ndarray:
    """Return by how much the true field exceeds the strength; NaN for films that have failed."""
    return field * stretch**2 / strength(stretch) - 1.0


def _distance(lost: Callable[[np.ndarray], np.ndarray], answer: np.ndarray, rtol: float) -> np.ndarray:
    """Return the relative distances over rtol of answers from where the outcomes of sweeps change, by bisection.

    Infinite where they do not change from "not lost" to "lost" near the answer.
    """
    low, high = np.full_like(answer, -_LOOKED), np.full_like(answer, _LOOKED)
    changes = ~lost(answer * (1.0 + low * rtol)) & lost(answer * (1.0 + high * rtol))
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        beyond = lost(answer * (1.0 + middle * rtol))
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return np.where(changes, np.abs(0.5 * (low + high)), np.inf)


def _cases(values: np.ndarray) -> xr.DataArray:
    return xr.DataArray(values, dims="case")
