"""A ramp-and-hold cube of a billion cells, streamed to one compressed file: how long, how much memory, how large.

    python studies/billion/run.py [--quick] [--output FOLDER] [--map FILE]

runs ``dea-maps sweep`` on ramp_hold.toml beside this file, and on the same cube with fewer values of each parameter, as
a product grid and cell by cell. It watches them, and writes, in out/billion unless told where, billion.png and
billion.nc.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

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
VALUES = 1000  # of a parameter, in ramp_hold.toml
EVERY = 0.2  # seconds between looks
# What "auto" picks where cells share nothing, see studies/tolerance; asked for by name, it computes every cell alone.
SINGLY = 'method = "dop853"\nformulation = "area"\n'
# Values of a parameter in the smaller cubes; of those computed cell by cell the largest would take long.
SHARED_VALUES, SINGLE_VALUES = (22, 46, 100, 215, 464), (22, 46, 100, 215)
PATTERNS = ("*.npz", "whole.nc")  # files of parts, and the map that is put together


class Run(NamedTuple):
    """A run that has ended: wall clock and processor time in s, and what was seen of it."""

    seconds: float
    processor: float
    looks: list[tuple[float, float, float, float]]


def main() -> int:
    """Check the room, run, draw, write, print."""
    parser = study_parser(__file__, __doc__, quick="a thousand cells")
    parser.add_argument("--map", type=Path, metavar="FILE", help="where to keep the map; default: it is removed")
    options = parser.parse_args()
    values, shared, single = (10, (), (10,)) if options.quick else (VALUES, SHARED_VALUES, SINGLE_VALUES)
    with tempfile.TemporaryDirectory(dir=options.output) as folder:
        target = (options.map or Path(folder, "map.nc")).resolve()
        needed, free = CELL_BYTES * values**3, shutil.disk_usage(target.parent).free
        if free < needed:
            missing = (needed - free) / 1e9
            print(f"{target.parent} has {free / 1e9:.1f} GB free: {missing:.1f} GB may be missing")
            return 1
        large = watch(values, "", target)
        with xr.open_dataset(target) as ds:
            middle = {dim: size // 2 for dim, size in ds.sizes.items()}
            print(f"the cell in the middle: {ds.isel(middle).time_to_failure.item():.6g} tau")
        found = as_dataset(large, values**3, target.stat().st_size)
        other = Path(folder, "other.nc")
        runs = {
            "product": ((*shared, values), [*(watch(number, "", other) for number in shared), large]),
            "single": (single, [watch(number, SINGLY, other) for number in single]),
        }
    for (name, (numbers, ended)), label in zip(runs.items(), ("as a product grid", "cell by cell"), strict=True):
        cells = np.array(numbers) ** 3
        found.coords[f"{name}_cells"] = (f"{name}_cells", cells, {"long_name": f"cells {label}", "units": "1"})
        for key, long_name, at in (("wall", "wall clock", 0), ("processor", "processor time", 1)):
            described = {"long_name": f"{long_name} {label}, start included", "units": "s"}
            found[f"{name}_{key}"] = (f"{name}_cells", [run[at] for run in ended], described)
    found.to_netcdf(options.output / "billion.nc")
    draw(found, options.output / "billion.png")
    report(found)
    return 0


def watch(values: int, accuracy: str, target: Path) -> Run:
    """Run a sweep to its end, looking at its memory and its files now and then."""
    text = (HERE / "ramp_hold.toml").read_text(encoding="utf-8")
    specification = target.with_name(f"{target.stem}.toml")
    specification.write_text(text.replace(f"num = {VALUES}", f"num = {values}") + accuracy, encoding="utf-8")
    command = [sys.executable, "-m", "dea_maps", "sweep", str(specification), "-o", str(target)]
    command += ["--variables", ",".join(VARIABLES), "--dtype", "float32"]
    begin, before, looks = time.perf_counter(), os.times(), []
    parts = target.with_name(f"{target.name}.parts")
    process = subprocess.Popen(command)
    while process.poll() is None:
        time.sleep(EVERY)
        looks.append((time.perf_counter() - begin, memory(process.pid), *(folder_bytes(parts, p) for p in PATTERNS)))
    seconds, after = time.perf_counter() - begin, os.times()
    specification.unlink()
    if process.returncode:
        raise SystemExit(process.returncode)
    looks.append((seconds, 0.0, 0.0, float(target.stat().st_size)))
    processor = sum(after[2:4]) - sum(before[2:4])  # user and system, of children that have ended
    return Run(seconds, processor, looks)


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


def as_dataset(run: Run, cells: int, file_bytes: int) -> xr.Dataset:
    """Return what was seen of the largest run."""
    columns = np.array(run.looks).T
    described = (
        ("memory", "resident memory of the process", "MiB", columns[1] / 2**20),
        ("parts", "files of finished parts", "GB", columns[2] / 1e9),
        ("file", "map that is put together", "GB", columns[3] / 1e9),
    )
    maps = {name: ("time", values, {"long_name": label, "units": units}) for name, label, units, values in described}
    attributes = {"title": "Sweeps of many cells, watched", "cells": cells, "file_bytes": file_bytes}
    times = ("time", columns[0], {"long_name": "time since the start", "units": "s"})
    return xr.Dataset(maps, {"time": times}, attributes)


def draw(found: xr.Dataset, path: Path) -> None:
    """Draw disk and memory against time, and the time of a cell against the size of the grid."""
    figure, (disk, used, cost) = plt.subplots(3, 1, figsize=(7.0, 7.5), layout="constrained")
    disk.sharex(used)
    held = found.parts + found.file
    disk.plot(found.time, held.where(held > 0), color="#08306b", label="parts and map")
    disk.plot(found.time, found.parts.where(found.parts > 0), color="#d55e00", ls="--", label="of which files of parts")
    disk.set(ylabel="on the disk (GB)", ylim=(0, None))
    used.plot(found.time, found.memory.where(found.memory > 0), color="black")
    used.set(xlabel="time since the start (s)", ylabel="resident memory (MiB)", ylim=(0, None))
    for name, label, color in (("single", "cell by cell", "#d55e00"), ("product", "product grid", "#08306b")):
        cells = found[f"{name}_cells"]
        cost.loglog(cells, found[f"{name}_processor"] / cells * 1e9, "o-", color=color, label=label)
    cost.set(xlabel="cells of the grid", ylabel="processor time of a cell,\nall included (ns)")
    disk.legend(frameon=False, loc="upper left")
    cost.legend(frameon=False)
    for ax in (disk, used, cost):
        ax.grid(color="0.85", lw=0.5)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def report(found: xr.Dataset) -> None:
    """Print the figures, the machine and the versions."""
    cells, size = found.attrs["cells"], found.attrs["file_bytes"]
    print(f"largest resident memory {float(found.memory.max()):.0f} MiB")
    most = float((found.parts + found.file).max()) * 1e9
    print(
        f"file {size / 1e9:.3g} GB for {cells * CELL_BYTES / 1e9:.3g} GB of values; most on the disk {most / size:.3f}"
    )
    for name in ("product", "single"):
        columns = (found[f"{name}_{key}"].values for key in ("cells", "wall", "processor"))
        for count, wall, processor in zip(*columns, strict=True):
            each = f"{processor / count * 1e9:.0f} ns a cell"
            print(f"{name:8}{count:14,} cells {wall:8.1f} s, processor {processor:8.1f} s, {each}")
    both = [int(count) for count in found.single_cells.values if count in found.product_cells.values]
    if both:
        ratio = found.single_processor.sel(single_cells=both[-1]) / found.product_processor.sel(product_cells=both[-1])
        print(f"cell by cell over product grid at {both[-1]:,} cells: {float(ratio):.1f}")
    print(describe_machine("NumPy", "Numba", "h5py", "isal", "dea_maps"))


if __name__ == "__main__":
    sys.exit(main())
