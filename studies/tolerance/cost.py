"""Time per cell, in one thread: of auto in every regime, and of every method that promises its rtol."""

import re
import time

import numpy as np
import xarray as xr
from common.internals import choose, sweep_for
from common.programs import PROGRAMS
from measure import ATTEMPTS, FAILS_LATER, in_fold_region, serving
from numpy.typing import NDArray
from table import INPUTS

import dea_maps as dm

RTOLS = (1e-3, 1e-6, 1e-9, 1e-12)
CELLS = 768  # a multiple of the lanes of a block
REPEATS = 7


def seconds_per_cell(program: str, points: dict[str, NDArray], form: str, method: str, rtol: float) -> float:
    """Return the processor time per cell of one thread, the shortest of several runs."""
    count = points["outcome"].size
    cells = np.resize(np.arange(count), max(CELLS, -(-count // 16) * 16))
    columns = [
        points[name][cells] if name in points else np.zeros(cells.size) for name in ("field", "rate", "modulus_ratio")
    ]
    kernel = sweep_for(program, form, method)
    status, result = np.empty(cells.size, np.int8), np.empty((5, cells.size))
    shortest = np.inf
    for _ in range(REPEATS):
        before = time.thread_time()
        kernel(*columns, rtol, 0.0, ATTEMPTS, status, result)
        shortest = min(shortest, time.thread_time() - before)
    return shortest / cells.size


def chosen(points: dict[str, NDArray], mask: NDArray) -> dict[str, NDArray]:
    """Return some of the points."""
    return {name: column[mask] for name, column in points.items() if name in (*INPUTS, "outcome")}


def by_regime(tables: dict[str, dict[str, NDArray]]) -> xr.Dataset:
    """Return ``seconds`` (regime, rtol) per cell of what "auto" picks, on the films of a regime that fail later."""
    names, rows = [], []
    for program, points in tables.items():
        regime = np.array([name.split("/")[0] for name in points["regime"]])
        fails = points["outcome"] == FAILS_LATER
        for name in dict.fromkeys(regime[fails]):
            part = chosen(points, fails & (regime == name))
            picks = [choose(PROGRAMS[program], "auto", "auto", rtol, None) for rtol in RTOLS]
            rows.append([seconds_per_cell(program, part, p.formulation, p.method, p.rtol) for p in picks])
            names.append(f"{program}: {name}")
    return xr.Dataset(
        {"seconds": (("regime", "rtol"), rows, {"long_name": "processor time per cell, one thread", "units": "s"})},
        coords={"regime": names, "rtol": list(RTOLS)},
        attrs={"title": "Cost of auto by regime"},
    )


def smallest_rtol(method: str) -> float:
    """Return the rtol down to which a method promises it over the whole region, from the words of `dm.methods`."""
    (entry,) = (entry for entry in dm.methods() if entry.name == method)
    found = re.search(r"every rtol; beyond[^;]*; rtol from ([0-9.e-]+)", entry.region.replace("'fold'", ";"))
    return float(found[1]) if found else 1e-12


def by_method(tables: dict[str, dict[str, NDArray]]) -> list[tuple[str, str, str, list[float]]]:
    """Return (method on formulation, program, where, seconds per cell by rtol), NaN where rtol is not promised.

    On all films that fail later, and on those in the region that the form "fold" claims.
    """
    rivals = [entry for entry in dm.methods() if not entry.kind.endswith("fixed step")]
    rows = []
    for program, points in tables.items():
        fails = points["outcome"] == FAILS_LATER
        for where, mask in (("everywhere", fails), ("in the region of fold", fails & in_fold_region(points))):
            part = chosen(points, mask)
            for entry in rivals:
                for form in entry.formulations:
                    fold = form == "fold"
                    if (
                        form in ("rate", "time")
                        or (fold and where == "everywhere")
                        or not serving(program, entry.name, form)
                    ):
                        continue
                    least = 1e-10 if fold else smallest_rtol(entry.name)
                    costs = [
                        seconds_per_cell(program, part, form, entry.name, rtol) if rtol >= 0.99 * least else np.nan
                        for rtol in RTOLS
                    ]
                    rows.append((f"{entry.name} on {form}", program, where, costs))
    return rows
