"""What is measured, each in fresh processes where threads, memory or the start count."""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import limit
import numpy as np
import xarray as xr

WORKER = Path(__file__).with_name("worker.py")
LIMITED = ("step", "ramp")
RTOLS = tuple(float(f"1e-{decade}") for decade in range(3, 13))


def run(program: str, cells: int, repeats: int, rtols: tuple[float, ...], **environment: str) -> dict[str, Any]:
    """Return what a fresh process says, and how long it took as a whole."""
    command = [sys.executable, str(WORKER), program, str(cells), str(repeats), *map(str, rtols)]
    before = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ | environment)
    if done.returncode:
        raise RuntimeError(done.stderr)
    answer: dict[str, Any] = json.loads(done.stdout)
    return answer | {"whole": time.perf_counter() - before}


def sizes(programs: tuple[str, ...], powers: range, threads: tuple[int, ...]) -> xr.Dataset:
    """Return trajectories per second and memory (program, threads, size)."""
    shape = (len(programs), len(threads), len(powers))
    rates, memory, counts, unresolved = (np.full(shape, np.nan) for _ in range(4))
    for i, program in enumerate(programs):
        for j, number in enumerate(threads):
            for k, power in enumerate(powers):
                repeats = 5 if power < 6 else 1 + (power == 6)
                found = run(program, 10**power, repeats, (1e-6,), NUMBA_NUM_THREADS=str(number))
                counts[i, j, k] = found["cells"]
                rates[i, j, k] = found["cells"] / found["seconds"][0]
                memory[i, j, k] = found["peak"] - found["before"]
                unresolved[i, j, k] = found["unresolved"]
                print(f"{program}, {number} threads, {found['cells']} cells: {rates[i, j, k]:.3g}/s", flush=True)
    axes = ("program", "threads", "size")
    return xr.Dataset(
        {
            "rate": (axes, rates, {"long_name": "trajectories per second of dm.sweep at rtol 1e-6", "units": "s-1"}),
            "memory": (axes, memory, {"long_name": "peak memory above that of the process before", "units": "MB"}),
            "cells": (axes, counts, {"long_name": "number of cells", "units": "1"}),
            "unresolved": (axes, unresolved, {"long_name": "number of unresolved cells", "units": "1"}),
        },
        coords={"program": list(programs), "threads": list(threads), "size": [10**power for power in powers]},
    )


def accuracies(programs: tuple[str, ...], cells: int, rtols: tuple[float, ...]) -> xr.Dataset:
    """Return trajectories per second (program, rtol) in one thread."""
    rates = []
    for program in programs:
        found = run(program, cells, 3, rtols, NUMBA_NUM_THREADS="1")
        rates.append(found["cells"] / np.array(found["seconds"]))
    words = {"long_name": "trajectories per second of dm.sweep, one thread", "units": "s-1"}
    return xr.Dataset({"rate_by_rtol": (("program", "rtol"), rates, words)}, coords={"rtol": list(rtols)})


def starts(programs: tuple[str, ...], states: tuple[str, ...]) -> xr.Dataset:
    """Return the time of a whole process that sweeps 100 cells (started, state).

    "cold" begins with an empty cache, which "warm" then finds filled; "warm" alone takes the user's cache as it is.
    """
    whole = np.full((len(programs), len(states)), np.nan)
    for i, program in enumerate(programs):
        with tempfile.TemporaryDirectory() as folder:
            cache = {"NUMBA_CACHE_DIR": folder} if "cold" in states else {}
            for j in range(len(states)):
                whole[i, j] = run(program, 100, 1, (1e-6,), **cache)["whole"]
        said = ", ".join(f"{seconds:.1f} s {state}" for seconds, state in zip(whole[i], states, strict=True))
        print(f"{program}: starts in {said}", flush=True)
    words = {"long_name": "time of a process that sweeps 100 cells twice, from start to end", "units": "s"}
    return xr.Dataset(
        {"start": (("started", "state"), whole, words)}, coords={"started": list(programs), "state": list(states)}
    )


def limits(cells: int, counted: int, blocks: int, rtols: tuple[float, ...]) -> xr.Dataset:
    """Return evaluations per second alone, evaluations per trajectory, trajectories per second (limited, rtol)."""
    alone = [limit.evaluations_per_second(program, blocks) for program in LIMITED]
    counts = [[limit.evaluations_per_trajectory(program, counted, rtol) for rtol in rtols] for program in LIMITED]
    rates = [[limit.trajectories_per_second(program, cells, rtol) for rtol in rtols] for program in LIMITED]
    axes = ("limited", "rtol")
    return xr.Dataset(
        {
            "evaluations_alone": ("limited", alone, {"long_name": "evaluations per second and core", "units": "s-1"}),
            "evaluations": (axes, counts, {"long_name": "evaluations per trajectory", "units": "1"}),
            "kernel_rate": (axes, rates, {"long_name": "trajectories per second of the kernel", "units": "s-1"}),
        },
        coords={"limited": list(LIMITED), "rtol": list(rtols)},
    )
