"""How duty, period and shape of a repeated load decide whether a film survives, and for how many cycles if not.

    python studies/cycling/run.py [--quick] [--output FOLDER]

writes, in out/cycling unless told where, peaks.png, losses.png, lifetimes.png and cycling.nc, and prints the tables of
README.md.
"""

import sys
from pathlib import Path

sys.path.insert(1, str(Path(__file__).resolve().parents[1]))

import charts
import cycles
import numpy as np
import xarray as xr
from common.machine import describe_machine
from common.options import study_parser

MODULUS_RATIO = 4.0
PERIODS, QUICK_PERIODS = np.logspace(-1.0, 2.0, 13), [1.0, 10.0]
ABOVE, QUICK_ABOVE = np.logspace(-1.0, -5.0, 9), [1e-1, 1e-2]
SIZE, QUICK_SIZE = 80, 8
RTOL, QUICK_RTOL = 1e-7, 1e-4


def main() -> None:
    """Compute, draw, write, print."""
    options = study_parser(__file__, __doc__, quick="few periods, amplitudes and cells, to a larger rtol").parse_args()
    quick, folder = options.quick, options.output
    rtol = QUICK_RTOL if quick else RTOL
    peaks = cycles.allowable_peaks(QUICK_PERIODS if quick else PERIODS, MODULUS_RATIO, rtol)
    losses = cycles.losses(QUICK_ABOVE if quick else ABOVE, rtol)
    found, boundary = cycles.lifetimes(QUICK_SIZE if quick else SIZE, MODULUS_RATIO, 1e-4)
    charts.peaks(peaks, folder / "peaks.png")
    charts.losses(losses, folder / "losses.png")
    charts.lifetimes(found, boundary, folder / "lifetimes.png")
    whole = xr.merge([peaks, losses])
    whole.attrs = {"title": "Films under repeated loads: limits, and cycles to failure above them"}
    whole.to_netcdf(folder / "cycling.nc")
    print_peaks(peaks)
    print_losses(losses)
    counts = {
        word: int((found.outcome == k).sum()) for k, word in enumerate(found.outcome.attrs["flag_meanings"].split())
    }
    print("Map over duty and field:", ", ".join(f"{count} {word}" for word, count in counts.items()))
    print(describe_machine("NumPy", "SciPy", "Numba", "dea_maps"))


def print_peaks(data: xr.Dataset) -> None:
    """Print the allowable peaks of some periods as a Markdown table."""
    shown = data.period.values[:: max(1, data.sizes["period"] // 4)]
    print("Allowable peak over Ec\n\n| shape | limit of short periods |", " | ".join(f"{one:g}" for one in shown), "|")
    print("|---|---|" + "---|" * shown.size)
    for shape in data["shape"].values:
        part = data.sel(shape=shape)
        cells = [f"{float(part.allowable_peak.sel(period=one)):.5f}" for one in shown]
        print(f"| {shape} | {float(part.fast_limit):.5f} |", " | ".join(cells), "|")
    print()


def print_losses(data: xr.Dataset) -> None:
    """Print the cycles to failure above the limits as a Markdown table."""
    print("Cycles to failure at a peak above the limit\n\n| case | limit |", end=" ")
    print(" | ".join(f"{one:.1e}" for one in data.above.values), "|")
    print("|---|---|" + "---|" * data.sizes["above"])
    for case in data.case.values:
        part = data.sel(case=case)
        print(f"| {case} | {float(part.limit):.7f} |", " | ".join(f"{one:.0f}" for one in part.cycles.values), "|")
    print()


if __name__ == "__main__":
    main()
