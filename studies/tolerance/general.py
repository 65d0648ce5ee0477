"""Errors of "auto" and of the paper's own form at the certified films under general loading programs."""

import sys
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

import dea_maps as dm

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests" / "reference"))
import loading

RESULTS = ("time_to_failure", "critical_stretch", "critical_field")
FAILS_LATER, UNRESOLVED = 1, 3
CASES = {"auto": {}, "dop853 on rate": {"method": "dop853", "formulation": "rate"}}
CASES["dopri5 on rate"] = {"method": "dopri5", "formulation": "rate"}

# The programs of the table, with its parameters a to d; its waveform has samples of its own for every film.
PROGRAMS = {
    "pulse": dm.Sequence([dm.Jump("a"), dm.Hold("b"), dm.Jump(0.0)]),
    "trapezoid": dm.Sequence([dm.Linear("a", time="b"), dm.Hold("c"), dm.Linear(0.0, time="d")]),
    "overdrive": dm.Sequence([dm.Jump("a"), dm.Hold("b"), dm.Jump("c")]),
    "pulse_train": dm.Sequence([dm.Jump("a"), dm.Hold("b"), dm.Jump(0.0), dm.Hold("c")], repeat=True),
    "triangle_train": dm.Sequence([dm.Linear("a", time="b"), dm.Linear(0.0, time="b")], repeat=True),
    "biased_sine": dm.Sequence([dm.Jump("a"), dm.Sine("b", "c")], repeat=True),
    "waveform": None,
    "ratchet": dm.Sequence([dm.Linear("a", time="b"), dm.Hold("c"), dm.Linear("low", time="d")], repeat=True),
}
LOW = 0.6  # of its field: to which that of a ratchet falls


def answers(program: str, rows: list[dict[str, str]], **asked: object) -> tuple[NDArray, NDArray]:
    """Return outcomes and (3, films) results of films under one program, all with a dead load or all without."""
    loaded = [] if float(rows[0]["prestretch"]) == 1.0 else ["prestretch"]
    if PROGRAMS[program] is None:
        parts = [_one_waveform(row, loaded, asked) for row in rows]
    else:
        names = ["modulus_ratio", *loaded, *PROGRAMS[program].parameters]
        given = {name: xr.DataArray([_value(row, name) for row in rows], dims="film") for name in names}
        parts = [dm.sweep(PROGRAMS[program], **given, **asked)]
    outcome = np.concatenate([np.atleast_1d(ds.outcome) for ds in parts])
    return outcome, np.array([np.concatenate([np.atleast_1d(ds[name]) for ds in parts]) for name in RESULTS])


def _value(row: dict[str, str], name: str) -> float:
    return LOW * float(row["a"]) if name == "low" else float(row[name])


def _one_waveform(row: dict[str, str], loaded: list[str], asked: dict[str, object]) -> xr.Dataset:
    field, a, b, c = (float(row[name]) for name in "abcd")
    wave = dm.Waveform(np.cumsum([0.0, a, b, c, a]), [0.0, 1.0, -0.5, -1.0, 0.8])
    film = {name: float(row[name]) for name in ("modulus_ratio", *loaded)}
    return dm.sweep(wave, field=field, **film, **asked)


def measure(rtols: list[float], stride: int) -> xr.Dataset:
    """Return the errors at every ``stride``-th film.

    Returns
    -------
    Dataset
        ``error`` (case, rtol, film): the largest relative error of time, stretch and field, NaN where the film does not
        fail later or nothing was answered; ``unresolved`` and ``wrong_outcome``; ``program`` (film).
    """
    table = loading.read()[::stride]
    groups: dict[tuple[str, bool], list[int]] = {}
    for number, row in enumerate(table):
        groups.setdefault((row["program"], float(row["prestretch"]) > 1.0), []).append(number)
    true_outcome = np.array([int(row["outcome"]) for row in table])
    truth = np.array([[float(row[name] or "nan") for row in table] for name in RESULTS])
    shape = (len(CASES), len(rtols), len(table))
    error = np.full(shape, np.nan, np.float32)
    unresolved, wrong = np.zeros(shape, np.int8), np.zeros(shape, np.int8)
    for (i, asked), (j, rtol) in ((x, y) for x in enumerate(CASES.values()) for y in enumerate(rtols)):
        for (program, _), films in groups.items():
            outcome, found = answers(program, [table[film] for film in films], **asked, rtol=rtol)
            both = (outcome == FAILS_LATER) & (true_outcome[films] == FAILS_LATER)
            failed = np.array(films)[both]
            error[i, j, failed] = np.abs(found[:, both] / truth[:, failed] - 1.0).max(axis=0)
            unresolved[i, j, films] = outcome == UNRESOLVED
            wrong[i, j, films] = (outcome != true_outcome[films]) & (outcome != UNRESOLVED)
    where = ("case", "rtol", "film")
    return xr.Dataset(
        {
            "error": (where, error, {"long_name": "largest relative error of time, stretch and field at failure"}),
            "unresolved": (where, unresolved, {"long_name": "1 where there is no answer"}),
            "wrong_outcome": (where, wrong, {"long_name": "1 where the outcome is another than the table's"}),
            "program": ("film", [row["program"] for row in table]),
        },
        coords={"case": list(CASES), "rtol": rtols},
        attrs={"title": "Delivered against requested relative error under general loading programs"},
    )
