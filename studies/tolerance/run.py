"""Delivered against requested relative error, for every adaptive method, held to the certified reference tables.

    python studies/tolerance/run.py [--quick] [--output FOLDER]

writes, in out/tolerance unless told where, tolerance, loading, cost and random as .nc, tolerance.png, regimes.png,
loading.png and cost.png, and prints the tables of README.md.
"""

import sys
from pathlib import Path

sys.path.insert(1, str(Path(__file__).resolve().parents[1]))

import charts
import cost
import general
import measure
import numpy as np
import scatter
import xarray as xr
from common.machine import describe_machine
from common.options import study_parser
from common.programs import PROGRAMS

DECADES = range(3, 13)
QUICK_DECADES = (3, 6, 9, 12)
QUICK_STRIDE = 6
RANDOM_CELLS, QUICK_RANDOM_CELLS = 1_000_000, 2_000
LISTED = 5


def main() -> None:
    """Measure, draw, write, print."""
    options = study_parser(__file__, __doc__, quick="few points, methods on their first formulation only").parse_args()

    rtols = [float(f"1e-{decade}") for decade in (QUICK_DECADES if options.quick else DECADES)]
    tables = {name: measure.load(name, QUICK_STRIDE if options.quick else 1) for name in PROGRAMS}
    data = measure.measure(tables, rtols, every_formulation=not options.quick)
    encoding = {name: {"zlib": True, "complevel": 6} for name in data.data_vars if data[name].dtype.kind in "fi"}
    for name in ("error", "of_allowed", "final_error"):
        encoding[name] |= {"significant_digits": 2, "quantize_mode": "GranularBitRound"}
    data.to_netcdf(options.output / "tolerance.nc", encoding=encoding)
    charts.by_method(data, options.output / "tolerance.png")
    charts.by_regime(data, options.output / "regimes.png")
    print_methods(data)
    print_regimes(data)

    found = general.measure([rtol for rtol in rtols if rtol > 0.9e-10], QUICK_STRIDE if options.quick else 1)
    found.to_netcdf(
        options.output / "loading.nc",
        encoding={"error": {"zlib": True}},
    )
    charts.general(found, options.output / "loading.png")
    print_general(found)

    costs = cost.by_regime(tables)
    costs.to_netcdf(options.output / "cost.nc")
    charts.costs(costs, options.output / "cost.png")
    print_costs(costs, [] if options.quick else cost.by_method(tables))

    cells, silent = scatter.measure(QUICK_RANDOM_CELLS if options.quick else RANDOM_CELLS, rtols)
    cells.to_netcdf(options.output / "random.nc")
    print_random(cells, silent)
    print(describe_machine("NumPy", "SciPy", "Numba", "dea_maps"))


def print_methods(data: xr.Dataset) -> None:
    """Print the worst error over what was asked for, method by method, as a Markdown table."""
    rtols = [rtol for rtol in data.rtol.values if f"{rtol:.0e}"[-2:] in ("03", "06", "09", "12")]
    print("Worst delivered error / rtol where double precision allows a tenth of it (share without an answer)\n")
    print("| method | program | points |", " | ".join(f"{rtol:.0e}" for rtol in rtols), "|")
    print("|---|---|---|" + "---|" * len(rtols))
    ratio = measure.counted(data) / data.rtol
    for case in data.case.values:
        for program in PROGRAMS:
            for where, chosen in measure.portions(data, case, program):
                part = data.sel(case=case).isel(point=chosen)
                if not chosen.any() or not part.served.any():
                    continue
                cells = []
                for rtol in rtols:
                    counted = ratio.sel(case=case, rtol=rtol).values[chosen]
                    silent = float(part.unresolved.sel(rtol=rtol).mean())
                    worst = f"{np.nanmax(counted):.1e}" if np.isfinite(counted).any() else "-"
                    cells.append(worst + (f" ({silent:.0%})" if silent else ""))
                print(f"| {case}{where} | {program} | {chosen.sum()} |", " | ".join(cells), "|")
    auto = data.sel(case="auto")
    print(f"\nauto: wrong outcomes {int(auto.wrong_outcome.sum())}, unresolved {int(auto.unresolved.sum())},", end=" ")
    print(f"worst error of final_stretch over rtol {float((auto.final_error / data.rtol).max()):.1e},", end=" ")
    print(f"worst error at any point over rtol plus double precision's allowance {float(auto.of_allowed.max()):.2f}\n")


def print_regimes(data: xr.Dataset) -> None:
    """Print how auto does in each regime, as a Markdown table."""
    worst = measure.worst_by_regime(data)
    print("auto, worst delivered error / rtol in every regime, where double precision allows a tenth of it;", end=" ")
    print("! where more than two decades are wasted\n")
    print("| program | regime | points |", " | ".join(f"{rtol:.0e}" for rtol in worst.rtol.values), "|")
    print("|---|---|---|" + "---|" * worst.sizes["rtol"])
    for row, name in enumerate(worst.regime.values):
        ratios = worst.ratio.values[row]
        cells = ["-" if np.isnan(ratio) else f"{ratio:.1e}" + (" !" if ratio < 0.01 else "") for ratio in ratios]
        program, regime = name.split(": ")
        print(f"| {program} | {regime} | {worst['points'].values[row]} |", " | ".join(cells), "|")
    known = worst.ratio.values[np.isfinite(worst.ratio.values)]
    print(f"\nlargest {known.max():.2f}; above rtol in {np.count_nonzero(known > 1.0)},", end=" ")
    print(f"more than two decades below in {np.count_nonzero(known < 0.01)} of {known.size};", end=" ")
    print(f"smallest {known.min():.1e}\n")


def print_general(data: xr.Dataset) -> None:
    """Print the worst delivered error over rtol under every general program, as a Markdown table."""
    print("General programs: worst delivered error / rtol (without an answer, with a wrong outcome)\n")
    print("| method | program | films |", " | ".join(f"{rtol:.0e}" for rtol in data.rtol.values), "|")
    print("|---|---|---|" + "---|" * data.sizes["rtol"])
    for case in data.case.values:
        for program in dict.fromkeys(data.program.values):
            part = data.sel(case=case).isel(film=data.program.values == program)
            worst, _ = measure.summary((part.error / part.rtol).transpose("rtol", "film").values)
            silent, wrong = (part[name].sum("film").values for name in ("unresolved", "wrong_outcome"))
            cells = [
                f"{x:.1e} ({a}, {b})" if a or b else f"{x:.1e}" for x, a, b in zip(worst, silent, wrong, strict=True)
            ]
            print(f"| {case} | {program} | {part.sizes['film']} |", " | ".join(cells), "|")
    print()


def print_costs(costs: xr.Dataset, methods: list[tuple[str, str, str, list[float]]]) -> None:
    """Print the time per cell by regime and by method, as Markdown tables."""
    heads = " | ".join(f"{rtol:.0e}" for rtol in cost.RTOLS)
    print(f"Microseconds per cell of auto, one thread\n\n| regime | {heads} |")
    print("|---|" + "---|" * len(cost.RTOLS))
    micro = 1e6 * costs.seconds.values
    median = np.median(micro, axis=0)
    lines = {**dict(zip(costs.regime.values, micro, strict=True)), "median regime": median}
    for name, line in lines.items():
        print(f"| {name} |", " | ".join(f"{value:.2f}" for value in line), "|")
    print("| dearest / median |", " | ".join(f"{value:.1f}" for value in micro.max(axis=0) / median), "|")
    if methods:
        print("\nMicroseconds per cell of every method, down to the rtol that it promises\n")
        print(f"| method | program | films | {heads} |")
        print("|---|---|---|" + "---|" * len(cost.RTOLS))
    for method, program, where, seconds in methods:
        values = ["-" if np.isnan(value) else f"{1e6 * value:.2f}" for value in seconds]
        print(f"| {method} | {program} | {where} |", " | ".join(values), "|")
    print()


def print_random(data: xr.Dataset, silent: list[scatter.Silent]) -> None:
    """Print how many random cells met each outcome, as a Markdown table, and those without an answer."""
    print("Random cells; change: largest difference from the answer at 1e-12 over what is allowed\n")
    print("| modulus ratios | program | cells |", " | ".join(data.outcome.values), "| contradictions | change |")
    print("|---|---|---|" + "---|" * (data.sizes["outcome"] + 2))
    for draw in data.draw.values:
        for program in data.program.values:
            part = data.sel(draw=draw, program=program)
            counts = part.cells.sum("rtol").values
            contradictions, change = int(part.contradictions.sum()), float(part.change.max())
            line = [f"{count:,}" for count in (counts.sum(), *counts, contradictions)]
            print(f"| {draw} | {program} |", " | ".join(line), f"| {change:.2f} |")
    if silent:
        print(f"\nThe first without an answer, of {len(silent)}:")
    for cell in silent[:LISTED]:
        given = ", ".join(f"{key} {value!r}" for key, value in cell.given.items())
        print(f"- {cell.program} at rtol {cell.rtol:g}: {given}")
    print()


if __name__ == "__main__":
    main()
