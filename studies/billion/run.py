"""A ramp-and-hold cube of a billion cells, streamed to one compressed file: how long, how much memory, how large.

    python studies/billion/run.py [--quick] [--output FOLDER] [--map FILE]

runs ``dea-maps sweep`` on ramp_hold.toml beside this file, watches it, and writes, in out/billion unless told where,
billion.png and billion.nc.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(1, str(Path(__file__).resolve().parents[1]))

import matplotlib as mpl

mpl.use("Agg")
import numpy as np
import xarray as xr
from common.machine import describe_machine
from common.options import study_parser
from matplotlib import pyplot as plt

HERE = Path(__file__).resolve().parent
VARIABLES = ("outcome", "time_to_failure", "critical_stretch")
CELL_BYTES = 1 + 4 + 4
CELLS = 1000**3
QUICK_CELLS = 1000  # --quick of the command line: 10 values a parameter
EVERY = 0.5  # seconds between looks


def main() -> int:
    """Check the room, run, draw, write, print."""
    parser = study_parser(__file__, __doc__, quick="a thousand cells")
    parser.add_argument("--map", type=Path, metavar="FILE", help="where to keep the map; default: it is removed")
    options = parser.parse_args()
    cells = QUICK_CELLS if options.quick else CELLS
    with tempfile.TemporaryDirectory(dir=options.output) as folder:
        target = (options.map or Path(folder, "map.nc")).resolve()
        needed, free = 2 * CELL_BYTES * cells, shutil.disk_usage(target.parent).free
        if free < needed:
            missing = (needed - free) / 1e9
            print(f"{target.parent} has {free / 1e9:.1f} GB free: {missing:.1f} GB are missing for parts and map")
            return 1
        command = [sys.executable, "-m", "dea_maps", "sweep", str(HERE / "ramp_hold.toml"), "-o", str(target)]
        command += ["--variables", ",".join(VARIABLES), "--dtype", "float32", *(["--quick"] if options.quick else [])]
        watched = watch(command, target)
        watched.attrs = {"title": "A sweep of many cells, watched", "cells": cells, "file_bytes": target.stat().st_size}
        with xr.open_dataset(target) as ds:
            middle = {dim: size // 2 for dim, size in ds.sizes.items()}
            print(f"the cell in the middle: {ds.isel(middle).time_to_failure.item():.6g} tau")
    watched.to_netcdf(options.output / "billion.nc")
    draw(watched, options.output / "billion.png")
    report(watched)
    return 0


def watch(command: list[str], target: Path) -> xr.Dataset:
    """Run a sweep to its end, looking at its memory and its files now and then."""
    begin, looks = time.perf_counter(), []
    parts = target.with_name(f"{target.name}.parts")
    process = subprocess.Popen(command)
    while process.poll() is None:
        time.sleep(EVERY)
        looks.append((time.perf_counter() - begin, memory(process.pid), folder_bytes(parts, "*.npz"), written(parts)))
    if process.returncode:
        raise SystemExit(process.returncode)
    seconds = time.perf_counter() - begin
    looks.append((seconds, 0.0, 0.0, float(target.stat().st_size)))
    columns = np.array(looks).T
    described = (
        ("memory", "resident memory of the process", "MiB", columns[1] / 2**20),
        ("parts", "finished parts on the disk", "GB", columns[2] / 1e9),
        ("file", "file that is put together", "GB", columns[3] / 1e9),
    )
    maps = {name: ("time", values, {"long_name": label, "units": units}) for name, label, units, values in described}
    return xr.Dataset(maps, {"time": ("time", columns[0], {"long_name": "time since the start", "units": "s"})})


def memory(pid: int) -> float:
    """Return the resident memory of a process in bytes, 0 where the system does not say."""
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, IndexError):
        return 0.0


def folder_bytes(folder: Path, pattern: str) -> float:
    """Return the bytes of some files in a folder that may disappear."""
    total = 0
    for path in folder.glob(pattern):
        try:
            total += path.stat().st_size
        except FileNotFoundError:
            return 0.0
    return float(total)


def written(parts: Path) -> float:
    """Return the bytes of the file that is put together."""
    return folder_bytes(parts, "whole.nc")


def draw(watched: xr.Dataset, path: Path) -> None:
    """Draw disk and memory against time."""
    figure, (upper, lower) = plt.subplots(2, 1, figsize=(7.0, 5.0), sharex=True, layout="constrained")
    last = int(np.argmax(watched.parts.values))  # then the map is there, and the parts are removed
    file = watched.file.where(watched.file > 0)
    upper.plot(watched.time[: last + 1], watched.parts[: last + 1], color="#08306b", label="finished parts")
    upper.plot(watched.time, file, color="#d55e00", ls="--", label="compressed file")
    upper.set_ylabel("on the disk (GB)")
    upper.legend(frameon=False, loc="upper left")
    lower.plot(watched.time, watched.memory.where(watched.memory > 0), color="black")
    lower.set(xlabel="time since the start (s)", ylabel="resident memory (MiB)", ylim=(0, None))
    for ax in (upper, lower):
        ax.grid(color="0.85", lw=0.5)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def report(watched: xr.Dataset) -> None:
    """Print the figures, the machine and the versions."""
    cells, seconds = watched.attrs["cells"], float(watched.time[-1])
    print(f"{cells:,} cells in {seconds:.1f} s: {cells / seconds:.3g} cells a second, on all cores")
    print(f"largest resident memory {float(watched.memory.max()):.0f} MiB")
    print(f"file {watched.attrs['file_bytes'] / 1e9:.3g} GB for {cells * CELL_BYTES / 1e9:.3g} GB of values")
    print(describe_machine("NumPy", "Numba", "dea_maps"))


if __name__ == "__main__":
    sys.exit(main())
