"""Throughput: trajectories per second by size, threads and rtol; memory; starts; share of the measured limit.

    python studies/throughput/run.py [--quick] [--huge] [--output FOLDER]

writes, in out/throughput unless told where, throughput.nc, sizes.png, limits.png and starts.png, and prints the tables
of README.md.
"""

import sys
from pathlib import Path

sys.path.insert(1, str(Path(__file__).resolve().parents[1]))

import charts
import grids
import measure
import xarray as xr
from common.machine import describe_machine
from common.options import study_parser
from common.programs import PROGRAMS

QUICK_RTOLS = (1e-3, 1e-6, 1e-12)


def main() -> None:
    """Measure, draw, write, print."""
    parser = study_parser(__file__, __doc__, quick="small grids, one program, no start that compiles")
    parser.add_argument("--huge", action="store_true", help="up to 1e8 cells, which takes 4 GB of memory or more")
    options = parser.parse_args()
    quick = options.quick

    rtols = QUICK_RTOLS if quick else measure.RTOLS
    programs = ("step",) if quick else tuple(PROGRAMS)
    maps = ("step",) if quick else tuple(grids.GRIDS)
    powers = range(4, 5) if quick else range(2, 9 if options.huge else 8)
    parts = [
        measure.limits(*((2_000, 20, 2_000) if quick else (100_000, 200, 100_000)), rtols),
        measure.sizes(maps, powers, (1, 2)),
        measure.accuracies(maps, 10_000 if quick else 1_000_000, rtols),
        measure.starts(programs, ("warm",) if quick else ("cold", "warm")),
    ]
    data = xr.merge(parts).sortby("rtol", ascending=False)
    data.attrs["title"] = "Throughput of dea_maps"
    data.to_netcdf(options.output / "throughput.nc")
    charts.sizes(data, options.output / "sizes.png")
    charts.limits(data, options.output / "limits.png")
    charts.starts(data, options.output / "starts.png")
    print_sizes(data)
    print_limits(data)
    print(describe_machine("NumPy", "SciPy", "Numba", "dea_maps"))


def print_sizes(data: xr.Dataset) -> None:
    """Print trajectories per second and memory by size, and the times of a start, as Markdown tables."""
    heads = " | ".join(f"{size:.0e}" for size in data["size"].values)
    print(f"\nTrajectories per second of dm.sweep at rtol 1e-6, by size\n\n| program | threads | {heads} |")
    print("|---|---|" + "---|" * data.sizes["size"])
    for program in data.program.values:
        for threads in data.threads.values:
            rates = data.rate.sel(program=program, threads=threads).values
            print(f"| {program} | {threads} |", " | ".join(f"{rate:.1e}" for rate in rates), "|")
        ends = data.rate.sel(program=program, threads=[data.threads.values.min(), data.threads.values.max()])
        print(f"| {program} | ratio |", " | ".join(f"{ratio:.2f}" for ratio in ends[1].values / ends[0].values), "|")
    if grids.SCATTERED in data.program.values:
        ratios = data.rate.sel(program="ramp_hold") / data.rate.sel(program=grids.SCATTERED)
        for threads in data.threads.values:
            over = ratios.sel(threads=threads).values
            print(f"| ramp_hold over scattered | {threads} |", " | ".join(f"{ratio:.1f}" for ratio in over), "|")
    print(f"\nPeak memory above that of the process before the sweep, MB\n\n| program | threads | {heads} |")
    print("|---|---|" + "---|" * data.sizes["size"])
    for program in data.program.values:
        for threads in data.threads.values:
            memory = data.memory.sel(program=program, threads=threads).values
            print(f"| {program} | {threads} |", " | ".join(f"{value:.0f}" for value in memory), "|")
    print(f"\nunresolved cells: {int(data.unresolved.sum())}")
    print("\n| process that sweeps 100 cells |", " | ".join(f"{state}, s" for state in data.state.values), "|")
    print("|---|" + "---|" * data.sizes["state"])
    for program in data.started.values:
        seconds = data.start.sel(started=program).values
        print(f"| {program} |", " | ".join(f"{value:.1f}" for value in seconds), "|")


def print_limits(data: xr.Dataset) -> None:
    """Print trajectories per second by rtol, and the share of the measured limit, as Markdown tables."""
    heads = " | ".join(f"{rtol:.0e}" for rtol in data.rtol.values)
    print(f"\nOne thread, by rtol\n\n| | {heads} |\n|---|" + "---|" * data.sizes["rtol"])
    for program in data.program.values:
        rates = data.rate_by_rtol.sel(program=program).values
        print(f"| {program}: dm.sweep, trajectories/s |", " | ".join(f"{rate:.1e}" for rate in rates), "|")
    for program in data.limited.values:
        part = data.sel(limited=program)
        share = part.kernel_rate * part.evaluations / part.evaluations_alone
        print(f"| {program}: kernel, trajectories/s |", " | ".join(f"{x:.1e}" for x in part.kernel_rate.values), "|")
        print(f"| {program}: evaluations a trajectory |", " | ".join(f"{x:.0f}" for x in part.evaluations.values), "|")
        print(f"| {program}: share of the limit |", " | ".join(f"{x:.2f}" for x in share.values), "|")
    for program in data.limited.values:
        print(f"\n{program}: {float(data.evaluations_alone.sel(limited=program)):.2e} evaluations/s alone", end="")
    print("\n")


if __name__ == "__main__":
    main()
