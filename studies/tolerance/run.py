"""Delivered against requested relative error, for every adaptive method, held to the certified reference tables.

    python studies/tolerance/run.py [--quick] [--output FOLDER]

writes tolerance.png, regimes.png and tolerance.nc, and prints the tables of README.md.
"""

import argparse
import os
import platform
from pathlib import Path

import charts
import measure
import numba
import numpy as np
import scipy
import xarray as xr

import dea_maps as dm

HERE = Path(__file__).resolve().parent
DECADES = range(3, 13)
QUICK_DECADES = (3, 6, 9, 12)
QUICK_STRIDE = 6


def main() -> None:
    """Measure, draw, write, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="few points, methods on their first formulation only")
    parser.add_argument("--output", type=Path, default=HERE, metavar="FOLDER", help="default: beside this file")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)

    rtols = [float(f"1e-{decade}") for decade in (QUICK_DECADES if options.quick else DECADES)]
    tables = {name: measure.load(name, QUICK_STRIDE if options.quick else 1) for name in measure.PROGRAMS}
    data = measure.measure(tables, rtols, every_formulation=not options.quick)
    encoding = {name: {"zlib": True, "complevel": 6} for name in data.data_vars if data[name].dtype.kind in "fi"}
    for name in ("raw", "delivered", "final_error"):
        encoding[name] |= {"significant_digits": 2, "quantize_mode": "GranularBitRound"}
    data.to_netcdf(options.output / "tolerance.nc", encoding=encoding)
    charts.by_method(data, options.output / "tolerance.png")
    charts.by_regime(data, options.output / "regimes.png")
    print_methods(data)
    print_regimes(data)
    print_machine()


def print_methods(data: xr.Dataset) -> None:
    """Print the worst error over what was asked for, method by method, as a Markdown table."""
    rtols = [rtol for rtol in data.rtol.values if f"{rtol:.0e}"[-2:] in ("03", "06", "09", "12")]
    print("Worst delivered error / rtol (share without an answer)\n")
    print("| method | program | points |", " | ".join(f"{rtol:.0e}" for rtol in rtols), "|")
    print("|---|---|---|" + "---|" * len(rtols))
    for case in data.case.values:
        for program in measure.PROGRAMS:
            for where, chosen in measure.portions(data, case, program):
                part = data.sel(case=case).isel(point=chosen)
                if not chosen.any() or not part.served.any():
                    continue
                cells = []
                for rtol in rtols:
                    ratio = part.delivered.sel(rtol=rtol).values / rtol
                    silent = np.isnan(ratio).mean()
                    worst = f"{np.nanmax(ratio):.1e}" if silent < 1 else "-"
                    cells.append(worst + (f" ({silent:.0%})" if silent else ""))
                print(f"| {case}{where} | {program} | {chosen.sum()} |", " | ".join(cells), "|")
    auto = data.sel(case="auto")
    print(f"\nauto: wrong outcomes {int(auto.wrong_outcome.sum())}, unresolved {int(auto.unresolved.sum())},", end=" ")
    print(f"worst error of final_stretch over rtol {float((auto.final_error / data.rtol).max()):.1e}")
    largest = float(auto.raw.max())
    allowed = float(data.allowance.max())
    print(f"largest error allowed by conditioning {allowed:.1e}; largest delivered error of auto {largest:.1e}\n")


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
    print()


def print_machine() -> None:
    """Print the processor, the number of cores and the versions."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    print(f"machine: {models[0] if models else platform.processor() or platform.machine()}, {os.cpu_count()} cores")
    versions = {"Python": platform.python_version(), "NumPy": np.__version__, "SciPy": scipy.__version__}
    versions |= {"Numba": numba.__version__, "dea_maps": dm.__version__}
    print("versions:", ", ".join(f"{name} {version}" for name, version in versions.items()))


if __name__ == "__main__":
    main()
