"""Time per trajectory and errors of every solver in every scene, on one core."""

import os
import time
from collections.abc import Iterator

import numpy as np
import xarray as xr
from others import others, others_on_films
from pieces import Films
from scenes import SCENES, SIZES, Scene
from solvers import Go, Solver, of_package
from truth import truth

ACCURACIES = (1e-4, 1e-6, 1e-8, 1e-10)
LONG = 0.1  # seconds that one measurement may take
SETTINGS = 12
REPEATS = 3


def one_core() -> None:
    """Keep this process, and all its threads, on one core, where the system can."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def seconds_of(go: Go) -> float:
    """Processor time of one run."""
    before = time.process_time()
    go()
    return max(time.process_time() - before, 1e-9)


def _errors(solver: Solver, scene: Scene, number: int, accuracy: float) -> tuple[Go, float, np.ndarray]:
    """Return what was run, the time that the second run of it took, and the error of every case; inf: no answer."""
    go, read = solver.prepare(scene.cases(number), accuracy)
    try:
        first = seconds_of(go)
        if first < 30.0 * LONG or solver.library != "SciPy":  # the first run may have compiled
            first = seconds_of(go)
    except Exception as error:
        if solver.library == "dea_maps":
            raise
        print(f"{scene.name}: {solver.name} at {accuracy:.0e}: {type(error).__name__}: {error}"[:120], flush=True)
        return go, np.inf, np.full(number, np.inf)
    with np.errstate(all="ignore"):
        parts = [np.abs(mine / true - 1.0) for mine, true in zip(read(), truth(scene.name, number), strict=True)]
    error = np.maximum(*parts)
    return go, first, np.where(np.isfinite(error), error, np.inf)


def _measure(solver: Solver, scene: Scene, accuracy: float, largest: int) -> tuple[float, float, float, float, int]:
    """Return seconds per case, worst and median error, share without an answer, number of cases."""
    sizes = [size for size in SIZES if size <= min(largest, solver.largest)]
    if isinstance(scene.cases(SIZES[0]), Films):  # of which fewer would not fill the lanes of a batch to the end
        sizes = [size for size in sizes if size >= SIZES[1]] or sizes
    for number in sizes:
        go, seconds, error = _errors(solver, scene, number, accuracy)
        if seconds * 16.0 > LONG:
            break
    for _ in range(REPEATS if seconds < LONG else 0):
        seconds = min(seconds, seconds_of(go))
    seconds = seconds if np.isfinite(seconds) else np.nan
    return seconds / number, float(error.max()), float(np.median(error)), float(np.mean(np.isinf(error))), number


def solvers(scene: Scene, quick: bool) -> Iterator[Solver]:
    """Yield the solvers of a scene: those of dea_maps, then, for the programs that others were given, the others."""
    yield from of_package(scene, quick)
    if isinstance(scene.cases(SIZES[0]), Films):
        yield from others_on_films(scene.program, quick)
    elif scene.program != "ramp_hold":
        yield from others(scene.program, quick)


QUICK = {"S1": SIZES[1], "S2": SIZES[1], "OD": SIZES[0]}
"""Scenes of a quick run, and the numbers of cases in it at most."""


def measure(names: list[str], quick: bool) -> xr.Dataset:
    """Return time per trajectory and errors (scene, solver, setting) in scenes by name."""
    entries = {(scene, solver.name): solver for scene in names for solver in solvers(SCENES[scene], quick)}
    named = {solver.name: solver for solver in entries.values()}
    solved = list(named)
    shape = (len(names), len(solved), SETTINGS)
    found = np.full((5, *shape), np.nan)
    accuracies = np.full(shape[1:], np.nan)
    for (scene, name), solver in entries.items():
        place = names.index(scene), solved.index(name)
        some = solver.accuracies[::3] if quick else solver.accuracies
        accuracies[place[1], : len(some)] = some
        for setting, accuracy in enumerate(some):
            row = _measure(solver, SCENES[scene], accuracy, QUICK[scene] if quick else max(SIZES))
            found[(slice(None), *place, setting)] = row
        best = np.nanmin(found[(1, *place)])
        print(f"{scene}: {name}: least error {best:.1e}", flush=True)
    axes = ("scene", "solver", "setting")
    words = (
        ("seconds", "processor time per trajectory, one core", "s"),
        ("worst", "largest relative error of any case in time to failure or stretch; inf: a case without answer", "1"),
        ("median", "median of the same", "1"),
        ("unanswered", "share of the cases without an answer", "1"),
        ("cases", "number of cases", "1"),
    )
    variables = {
        name: (axes, values, {"long_name": text, "units": units})
        for (name, text, units), values in zip(words, found, strict=True)
    }
    text = "tolerance, step or number of nodes"
    variables["accuracy"] = (axes[1:], accuracies, {"long_name": text})
    variables["library"] = ("solver", [solver.library for solver in named.values()])
    variables["rate_form"] = ("solver", np.array([solver.own_form for solver in named.values()], np.int8))
    return xr.Dataset(variables, coords={"scene": names, "solver": solved}, attrs={"title": "Work against precision"})


def fastest(data: xr.Dataset, scene: str, names: list[str], accuracy: float) -> tuple[str, float]:
    """Return the solver with most trajectories per second among those whose every case is as accurate; none: ""."""
    if not names:
        return "", np.nan
    part = data.sel(scene=scene, solver=names)
    rates = (1.0 / part.seconds).where(part.worst <= accuracy, 0.0).fillna(0.0).max("setting").values
    best = int(rates.argmax())
    if rates[best] == 0.0:
        return "", np.nan
    return names[best], float(rates[best])


def groups(data: xr.Dataset) -> dict[str, list[str]]:
    """Return the names of all solvers of `dea_maps`, and of others: all, on the paper's own form, told nothing."""
    names = np.asarray(data.solver.values)
    mine, rate = data.library.values == "dea_maps", data.rate_form.values == 1
    told = np.array([name.endswith(", told") for name in names])
    chosen = {"ours": mine, "others": ~mine, "rate": ~mine & rate, "untold": ~mine & ~told}
    return {"auto": ["auto"]} | {group: list(names[which]) for group, which in chosen.items()}
