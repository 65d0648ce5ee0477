"""Random cells over the whole region in which "auto" promises its rtol, and how many stay without an answer."""

from typing import NamedTuple

import numpy as np
import xarray as xr
from common.programs import PROGRAMS
from measure import ALLOWANCE, FAILS_LATER, RESULTS
from numpy.typing import NDArray

import dea_maps as dm

SEED = 20110607
OUTCOMES = ("survives", "fails_later", "fails_at_once", "unresolved")
UNRESOLVED = 3
# Modulus ratios uniform in their logarithm, or crowded towards 1: uniform in the logarithm of the ratio - 1.
DRAWS = ("spread", "nearly elastic")
CLOSEST = 1e-16
LARGEST_RATIO = 1000.0
SLOWEST, FASTEST = 1e-6, 1e5
LARGEST_FIELD = 1.5  # over sqrt(modulus_ratio)
TRUTH = 1e-12


class Silent(NamedTuple):
    """A cell without an answer."""

    program: str
    rtol: float
    given: dict[str, float]


def _log_uniform(random: np.random.Generator, low: float, high: float, count: int) -> NDArray[np.float64]:
    return np.exp(random.uniform(np.log(low), np.log(high), count))


def draw(random: np.random.Generator, kind: str, program: str, count: int) -> dict[str, NDArray[np.float64]]:
    """Return random parameters of a program.

    A third each of the fields is uniform, crowds towards 1 from both sides, and crowds towards the square root of the
    modulus ratio from both sides.
    """
    if kind == "spread":
        ratio = _log_uniform(random, 1.0, LARGEST_RATIO, count)
    else:
        ratio = 1.0 + _log_uniform(random, CLOSEST, LARGEST_RATIO - 1.0, count)
    ratio = np.clip(ratio, 1.0, LARGEST_RATIO)
    given = {"modulus_ratio": ratio}
    if program != "ramp":
        root = np.sqrt(ratio)
        away = random.choice([-1.0, 1.0], count) * _log_uniform(random, CLOSEST, 1.0, count)
        third = random.integers(3, size=count)
        anywhere = LARGEST_FIELD * root * random.random(count)
        field = np.select([third == 0, third == 1], [1.0 + away, root * (1.0 + away)], anywhere)
        given["field"] = np.clip(field, 0.0, LARGEST_FIELD * root)
    if program != "step":
        given["rate"] = _log_uniform(random, SLOWEST, FASTEST, count)
    return given


def condition(given: dict[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return how much, roughly, a result changes relative to itself per relative change of an input."""
    ratio = given["modulus_ratio"]
    with np.errstate(divide="ignore"):
        total = ratio / (ratio - 1.0)
        if "field" in given:
            field, root = given["field"], np.sqrt(ratio)
            total = total + field / np.abs(field - 1.0) + root / np.abs(root - field)
    return total


def measure(cells: int, rtols: list[float]) -> tuple[xr.Dataset, list[Silent]]:
    """Return numbers of cells and changes, and the cells without an answer.

    Returns
    -------
    Dataset
        ``cells`` (draw, program, rtol, outcome); ``change`` (draw, program, rtol), the largest relative difference from
        the answer at 1e-12, over what is allowed: rtol, and what double precision itself may cost; ``contradictions``,
        cells with another outcome than at 1e-12.
    list of Silent
    """
    random = np.random.default_rng(SEED)
    shape = (len(DRAWS), len(PROGRAMS), len(rtols))
    sizes = np.diff(np.linspace(0, cells, shape[1] * shape[2] + 1).astype(int)).reshape(shape[1:])
    counts = np.zeros((*shape, len(OUTCOMES)), np.int64)
    change, contradictions = np.full(shape, np.nan), np.zeros(shape, np.int64)
    silent = []
    for place in np.ndindex(shape):
        name, rtol = list(PROGRAMS)[place[1]], rtols[place[2]]
        given = draw(random, DRAWS[place[0]], name, int(sizes[place[1:]]))
        arrays = {key: xr.DataArray(values, dims="cell") for key, values in given.items()}
        ds = dm.sweep(PROGRAMS[name], rtol=rtol, **arrays)
        outcome = ds.outcome.values
        counts[place] = np.bincount(outcome, minlength=len(OUTCOMES))
        for cell in np.flatnonzero(outcome == UNRESOLVED):
            silent.append(Silent(name, rtol, {key: float(values[cell]) for key, values in given.items()}))
        if rtol <= TRUTH:
            continue
        best = dm.sweep(PROGRAMS[name], rtol=TRUTH, **arrays)
        both = (outcome != UNRESOLVED) & (best.outcome.values != UNRESOLVED)
        contradictions[place] = np.count_nonzero(both & (outcome != best.outcome.values))
        fails = both & (outcome == FAILS_LATER)
        found, known = (np.array([data[key].values[fails] for key in RESULTS]) for data in (ds, best))
        allowed = rtol + ALLOWANCE * (1.0 + condition(given)[fails])
        larger = np.maximum(found, known)
        larger[larger == 0.0] = 1.0  # a time, a few ulp below where the film fails at once
        change[place] = np.max(np.abs(found - known) / larger / allowed)
    axes = ("draw", "program", "rtol")
    data = xr.Dataset(
        {
            "cells": ((*axes, "outcome"), counts, {"long_name": "number of random cells"}),
            "change": (axes, change, {"long_name": "largest difference from the answer at 1e-12 over what is allowed"}),
            "contradictions": (axes, contradictions, {"long_name": "cells with another outcome than at 1e-12"}),
        },
        coords={"draw": list(DRAWS), "program": list(PROGRAMS), "rtol": rtols, "outcome": list(OUTCOMES)},
        attrs={"title": "Random cells over the promised region", "seed": SEED},
    )
    return data, silent
