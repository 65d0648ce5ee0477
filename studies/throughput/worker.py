"""One fresh process: sweep a grid of a given size and say, as JSON, how long it took and how much memory.

Arguments: name of the grid, number of cells, number of repeats, and one rtol or more.
"""

import json
import os
import resource
import sys
import time
from pathlib import Path

sys.path.insert(1, str(Path(__file__).resolve().parents[1]))

import grids

import dea_maps as dm


def resident() -> float:
    """Memory of this process now, in megabytes; its peak where the system does not say."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return megabytes()
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def megabytes() -> float:
    """Peak memory of this process so far."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 1e6 if sys.platform == "darwin" else peak * 1.024e-3


def main() -> None:
    """Sweep little once, then what counts."""
    name, cells, repeats, *rtols = sys.argv[1:]
    program = grids.GRIDS[name]
    dm.sweep(program, **grids.parameters(name, 100))
    before = resident()
    given = grids.parameters(name, int(cells))
    seconds = []
    for rtol in rtols:
        shortest = float("inf")
        for _ in range(int(repeats)):
            start = time.perf_counter()
            ds = dm.sweep(program, rtol=float(rtol), **given)
            shortest = min(shortest, time.perf_counter() - start)
        seconds.append(shortest)
        unresolved = int((ds.outcome == 3).sum())
    answer = {"seconds": seconds, "before": before, "peak": megabytes()}
    print(json.dumps(answer | {"cells": int(ds.outcome.size), "unresolved": unresolved}))


if __name__ == "__main__":
    main()
