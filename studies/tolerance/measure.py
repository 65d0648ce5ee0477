"""Errors of every adaptive method at every point of the reference tables."""

import sys
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import xarray as xr
from common.internals import lane_state, sweep_for
from common.programs import PROGRAMS
from numpy.typing import NDArray

import dea_maps as dm

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests" / "reference"))
import table

RESULTS = ("time_to_failure", "critical_stretch", "critical_field")
CONDITIONS = ("condition_time", "condition_stretch", "condition_field")
# What double precision itself may cost: this many times one and the condition number.
ALLOWANCE = 4e-15
# Attempted steps of a cell and piece of its program; dm.sweep allows fifty times as many.
ATTEMPTS = 20_000
FAILS_LATER = 1


def load(program: str, stride: int) -> dict[str, NDArray]:
    """Return a reference table, every ``stride``-th of its points."""
    return {name: column[::stride] for name, column in table.load(program).items()}


def cases(every_formulation: bool) -> list[tuple[str, str]]:
    """Return ("auto", "auto") and every adaptive method with its formulations, or with the first that serves."""
    found = [("auto", "auto")]
    for method in dm.methods():
        if method.kind.endswith("fixed step"):
            continue
        # "time" is measured under the general programs, see general.py.
        formulations = [form for form in method.formulations if form != "time"] if every_formulation else ["auto"]
        found += [(method.name, formulation) for formulation in formulations]
    return found


def serving(program: str, method: str, formulation: str) -> str | None:
    """Return the formulation on which a method serves a program, None where it does not."""
    if method == "auto":
        return "auto"
    (entry,) = (entry for entry in dm.methods() if entry.name == method)
    names = [name for name, programs in entry.serves.items() if program in programs]
    if formulation == "auto":
        return names[0] if names else None
    return formulation if formulation in names else None


def answers(
    program: str, points: dict[str, NDArray], method: str, formulation: str, rtol: float
) -> tuple[NDArray, NDArray, NDArray]:
    """Return (outcome, (3, points) results, final stretch) of one method; "auto" through `dm.sweep`."""
    given = {name: points[name] for name in table.INPUTS if name in points}
    if method == "auto":
        arrays = {name: xr.DataArray(values, dims="point") for name, values in given.items()}
        ds = dm.sweep(PROGRAMS[program], rtol=rtol, **arrays)
        return ds.outcome.values, np.array([ds[name].values for name in RESULTS]), ds.final_stretch.values
    count = points["outcome"].size
    columns = [np.ascontiguousarray(given.get(name, np.zeros(count))) for name in ("field", "rate", "modulus_ratio")]
    status, result = np.empty(count, np.int8), np.empty((5, count))
    sweep_for(program, formulation, method)(*columns, rtol, 0.0, ATTEMPTS, status, result)
    words = {lane_state.SURVIVES: 0, lane_state.FAILED: 1, lane_state.FAILS_AT_ONCE: 2}
    outcome = np.array([words.get(int(code), 3) for code in status])
    return outcome, result[[0, 1, 3]], result[4]


def measure(tables: dict[str, dict[str, NDArray]], rtols: list[float], every_formulation: bool) -> xr.Dataset:
    """Return the errors of all cases at all points.

    Returns
    -------
    Dataset
        ``error`` (case, rtol, point): the largest of the three relative errors, NaN where the film does not fail later
        or nothing was answered; ``of_allowed``: the largest of each error over rtol plus what double precision may cost
        it; ``unresolved`` and ``wrong_outcome``; ``allowance`` (point), what double precision may cost, and more.
    """
    names = cases(every_formulation)
    labels = [method if method == "auto" else f"{method} on {form}" for method, form in names]
    labels = [label.replace(" on auto", "") for label in labels]
    parts = []
    for program, points in tables.items():
        truth = np.array([points[name] for name in RESULTS])
        allowance = ALLOWANCE * (1.0 + np.array([points[name] for name in CONDITIONS]))
        fails = points["outcome"] == FAILS_LATER
        shape = (len(names), len(rtols), fails.size)
        largest, of_allowed, final = (np.full(shape, np.nan) for _ in range(3))
        wrong, unresolved = np.zeros(shape, np.int8), np.zeros(shape, np.int8)
        served = np.zeros((len(names), fails.size), np.int8)
        for i, (method, asked) in enumerate(names):
            formulation = serving(program, method, asked)
            if formulation is None:
                continue
            served[i] = 1
            for j, rtol in enumerate(rtols):
                outcome, found, final_stretch = answers(program, points, method, formulation, rtol)
                answered = fails & (outcome == FAILS_LATER)
                error = np.abs(found[:, answered] / truth[:, answered] - 1.0)
                largest[i, j, answered] = error.max(axis=0)
                of_allowed[i, j, answered] = (error / (rtol + allowance[:, answered])).max(axis=0)
                unresolved[i, j] = outcome == 3
                wrong[i, j] = (outcome != points["outcome"]) & (outcome != 3)
                final[i, j] = np.abs(final_stretch / points["final_stretch"] - 1.0)
        where = ("case", "rtol", "point")
        variables = {
            "error": (where, largest.astype(np.float32), {"long_name": "largest relative error of the results"}),
            "of_allowed": (
                where,
                of_allowed.astype(np.float32),
                {"long_name": "largest of each error over rtol plus what double precision may cost"},
            ),
            "final_error": (where, final.astype(np.float32), {"long_name": "relative error of final_stretch"}),
            "unresolved": (where, unresolved, {"long_name": "1 where the method gave no answer"}),
            "wrong_outcome": (where, wrong, {"long_name": "1 where the outcome is another than the table's"}),
            "served": (("case", "point"), served, {"long_name": "1 where the method serves the program"}),
            "allowance": ("point", np.nanmax(np.where(fails, allowance, 0.0), axis=0)),
            "fails_later": ("point", fails.astype(np.int8)),
            "claimed_by_fold": ("point", in_fold_region(points).astype(np.int8)),
            "program": ("point", np.full(fails.size, program)),
            "load_regime": ("point", [name.split("/")[0] for name in points["regime"]]),
        }
        parts.append(xr.Dataset(variables, coords={"case": labels, "rtol": rtols}))
    data = xr.concat(parts, "point", data_vars="minimal", coords="minimal", compat="override", join="override")
    data.attrs = {"title": "Delivered against requested relative error", "attempts": ATTEMPTS, "allowance": ALLOWANCE}
    return data


def in_fold_region(points: dict[str, NDArray]) -> NDArray:
    """Where the form "fold" promises its rtol, from 1e-10 on; see dm.methods()."""
    ratio = points["modulus_ratio"]
    inside = (ratio >= 1.0) & (ratio <= 10.0)
    if "field" in points:
        inside &= (points["field"] - 1.0 >= 1e-2) & (points["field"] <= 0.99 * np.sqrt(ratio))
    if "rate" in points:
        inside &= (points["rate"] >= 1e-2) & (points["rate"] <= 1e2)
    return inside


def portions(data: xr.Dataset, case: str, program: str) -> Iterator[tuple[str, NDArray]]:
    """Yield a label and the failing points of a program: all, and for "fold" those that it claims."""
    fails = (data.program.values == program) & (data.fails_later.values == 1)
    yield "", fails
    if case.endswith("fold"):
        yield ", in its region", fails & (data.claimed_by_fold.values == 1)


def summary(errors: NDArray) -> tuple[NDArray, NDArray]:
    """Return worst and median of (rtol, points) errors, NaN where there is none."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "All-NaN", RuntimeWarning)
        return np.nanmax(errors, axis=1), np.nanmedian(errors, axis=1)


def counted(data: xr.Dataset) -> xr.DataArray:
    """Return errors (case, rtol, point), NaN where double precision does not allow a tenth of the rtol.

    There it sets the error, and not the method.
    """
    return data.error.where(data.allowance < 0.1 * data.rtol).transpose(*data.error.dims)


def regimes(data: xr.Dataset) -> tuple[NDArray, list[str]]:
    """Return "program: regime of the load" of every point, and the list of those in which films fail later."""
    names = np.char.add(np.char.add(data.program.values.astype(str), ": "), data.load_regime.values.astype(str))
    found = list(dict.fromkeys(names[data.fails_later.values == 1]))
    return names, sorted(found, key=lambda name: list(PROGRAMS).index(name.split(":")[0]))


def worst_by_regime(data: xr.Dataset, case: str = "auto") -> xr.Dataset:
    """Return ``ratio`` (regime, rtol), the worst counted error over rtol, and the number of ``points``."""
    fails = data.fails_later.values == 1
    names, found = regimes(data)
    ratio = (counted(data.sel(case=[case])).isel(case=0) / data.rtol).values
    worst = [summary(ratio[:, fails & (names == name)])[0] for name in found]
    points = [int((fails & (names == name)).sum()) for name in found]
    return xr.Dataset(
        {"ratio": (("regime", "rtol"), worst), "points": ("regime", points)},
        coords={"regime": found, "rtol": data.rtol.values},
    )
