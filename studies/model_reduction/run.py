"""How little model each scene needs: errors and costs from five states to a closed form, and when five are needed.

    python studies/model_reduction/run.py [--quick] [--output FOLDER]

writes, in out/model_reduction unless told where, cost.png, unequal.png, average.png and model_reduction.nc and prints
every table behind README.md.
"""

import sys
from pathlib import Path

sys.path.insert(1, str(Path(__file__).resolve().parents[1]))

import amounts
import average
import charts
import modes
import numpy as np
import xarray as xr
from common.machine import describe_machine
from common.options import study_parser

RTOLS, QUICK_RTOLS = [1e-3, 1e-5, 1e-7, 1e-9, 1e-12], [1e-4, 1e-8]
QUICK_SCENES = ["step at 1.2", "ramp at 1"]
# The rate form alone takes kernels that nothing else needs: they compile for most of a quick run.
QUICK_AMOUNTS = [amount for amount in amounts.AMOUNTS if amount != "equibiaxial, rate form"]
STATES, QUICK_STATES = 100_000, 10_000
DIFFERENCES, QUICK_DIFFERENCES = [1e-4, 1e-3, 1e-2, 0.1, 0.3], [1e-2, 0.3]
PERIODS, QUICK_PERIODS = np.logspace(-2.0, 1.0, 13), [0.3, 3.0]
ABOVE = [0.01, 0.1]
SHOWN = 1e-7


def main() -> None:
    """Measure, draw, write, print."""
    words = "few tolerances, scenes, amounts, differences and states"
    options = study_parser(__file__, __doc__, quick=words).parse_args()

    scenes = QUICK_SCENES if options.quick else list(amounts.SCENES)
    taken = QUICK_AMOUNTS if options.quick else amounts.AMOUNTS
    data = amounts.measure(QUICK_RTOLS if options.quick else RTOLS, scenes, taken)
    unequal = modes.unequal_loads(QUICK_DIFFERENCES if options.quick else DIFFERENCES, rtol=1e-11)
    charts.costs(data, options.output / "cost.png")
    charts.unequal(unequal, options.output / "unequal.png")
    fast = average.fast_cycles(QUICK_PERIODS if options.quick else PERIODS, ABOVE, rtol=1e-6)
    charts.average(fast, options.output / "average.png")
    whole = xr.merge([data, unequal, fast])
    whole.attrs = {"title": "Cost and error of more and less model of a dielectric-elastomer film"}
    whole.to_netcdf(options.output / "model_reduction.nc")

    print_amounts(data)
    print_modes(QUICK_STATES if options.quick else STATES)
    print_unequal(unequal)
    print_average(fast)
    print(describe_machine("NumPy", "SciPy", "Numba", "dea_maps"))


def print_amounts(data: xr.Dataset) -> None:
    """Print cost at one rtol, and the smallest error of each amount, as Markdown tables."""
    rtol = float(data.rtol.sel(rtol=SHOWN, method="nearest"))
    tables = {
        f"Microseconds per film at rtol {rtol:g}": 1e6 * data.seconds.sel(rtol=rtol),
        "Error at failure at the tightest rtol": data.error.isel(rtol=-1),
    }
    for title, table in tables.items():
        print(f"{title}\n\n| scene |", " | ".join(data.amount.values), "|")
        print("|---|" + "---|" * data.sizes["amount"])
        for scene in data.scene.values:
            values = table.sel(scene=scene).values
            cells = ["-" if np.isnan(value) else f"{value:.2g}" for value in values]
            print(f"| {scene} |", " | ".join(cells), "|")
        print()
    seconds = data.seconds.sel(rtol=rtol)
    ratio = seconds.sel(amount="five states") / seconds.sel(amount=["quadrature", "scalar, regular form"]).min("amount")
    python = seconds.sel(amount="five states") / seconds.sel(amount="equibiaxial, same integrator")
    print(f"five states over the least model: {float(ratio.min()):,.0f} to {float(ratio.max()):,.0f} times the cost;")
    print(
        f"over the equibiaxial one with the same integrator: {float(python.min()):.0f} to {float(python.max()):.0f}\n"
    )


def print_modes(states: int) -> None:
    """Print what random states say of the antisymmetric mode."""
    for dead_loads in (False, True):
        found = modes.random_modes(states, dead_loads=dead_loads)
        words = "with equal dead loads" if dead_loads else "without loads but the field"
        print(
            f"{found.states:,} random states {words}, and as many on the border: antisymmetric mode critical first at "
            f"{found.first}; its stiffness over W11 at least {found.smallest:.4f}; on the border another than the "
            f"symmetric mode is soft at {found.eigen}; |det H| there at most {found.border:.0e} of the diagonal"
        )
    print()


def print_unequal(data: xr.Dataset) -> None:
    """Print the error of the reduction under unequal loads, as a Markdown table."""
    print("| scene | half the difference | stretches apart | error of stretch | error of time |")
    print("|---|---|---|---|---|")
    for case in data.case.values:
        for difference in data.difference.values:
            part = data.sel(case=case, difference=difference)
            cells = [f"{float(part[name]):.1e}" for name in ("apart", "error_stretch", "error_time")]
            print(f"| {case} | {difference:g} |", " | ".join(cells), "|")
    print()


def print_average(data: xr.Dataset) -> None:
    """Print the errors of the flow averaged over a cycle, as a Markdown table."""
    print("| shape | period | error of the allowable peak |", end="")
    print("".join(f" error of the lifetime, {above:.0%} above |" for above in data.above.values))
    print("|---|---|---|" + "---|" * data.sizes["above"])
    for shape in data["shape"].values:
        for period in data.period.values:
            part = data.sel(shape=shape, period=period)
            cells = [f"{float(part.error_peak):.1e}", *(f"{error:.1e}" for error in part.error_lifetime.values)]
            print(f"| {shape} | {period:.3g} |", " | ".join(cells), "|")
    print()


if __name__ == "__main__":
    main()
