"""The atlas: where each method and formulation fails, and how.

    python studies/stability/run.py [--quick] [--output FOLDER]

writes, in out/stability unless told where, fixed_step, adaptive, scipy, drift and falling, each as .png and .nc, and
prints how often each verdict fell.
"""

import sys
from collections.abc import Callable
from pathlib import Path

sys.path.insert(1, str(Path(__file__).resolve().parents[1]))

import charts
import drift
import falling
import laws
import limits
import numpy as np
import package_maps
import scipy_maps
import xarray as xr
from common.internals import TABLEAUS
from common.machine import describe_machine
from common.options import study_parser
from numpy.typing import NDArray
from scenes import SCENES, Scene
from verdicts import NOT_SERVED, WORDS

QUICK_CASES = ("dop853 on area", "quadrature on stretch")
Measure = Callable[[Scene, NDArray, NDArray], tuple[NDArray, NDArray]]


def main() -> None:
    """Measure, draw, write, print."""
    options = study_parser(__file__, __doc__, quick="coarse maps of a few methods").parse_args()
    quick = options.quick

    steps, tolerances = np.geomspace(1e-5, 10.0, 3 if quick else 30), np.geomspace(1e-12, 1e-3, 2 if quick else 28)
    across, few, coarse = (3, 2, 2) if quick else (44, 23, 13)
    tableaus = dict(TABLEAUS)
    theory = {scene.name: limits.lines(scene, scene.values(few), tableaus, package_maps.BUDGET) for scene in SCENES}

    cases = [case for case in package_maps.fixed_cases() if not quick or case.method == "rk4"]
    fixed = atlas(cases, across, steps, lambda case: lambda *axes: package_maps.fixed_map(case, *axes))
    save(fixed, "fixed_step", options.output)
    charts.maps(fixed, fixed_limits(cases, theory), "step (tau, or s)", options.output / "fixed_step.png")

    cases = [case for case in package_maps.adaptive_cases() if not quick or case.label in QUICK_CASES]
    adaptive = atlas(cases, across, tolerances, lambda case: lambda *axes: package_maps.adaptive_map(case, *axes))
    save(adaptive, "adaptive", options.output)
    charts.maps(adaptive, adaptive_limits(cases, theory), "tolerance", options.output / "adaptive.png")

    methods = scipy_maps.METHODS[: 1 if quick else None]
    cases = [package_maps.Case(method, "rate", ("step", "ramp")) for method in methods]
    tolerances = np.geomspace(1e-12, 1e-3, 2 if quick else 10)
    foreign = atlas(cases, coarse, tolerances, lambda case: lambda *axes: scipy_maps.map_of(case.method, *axes))
    save(foreign, "scipy", options.output)
    charts.maps(foreign, adaptive_limits(cases, theory), "rtol = atol", options.output / "scipy.png")

    drifted = drift.measure(*(10.0, 20) if quick else (3e3, 200))
    save(drifted, "drift", options.output)
    charts.drifts(drifted, options.output / "drift.png")

    fallen = falling.measure(*(2, 2) if quick else (30, 19))
    save(fallen, "falling", options.output)
    charts.falls(fallen, [label for label, _, _ in falling.SCENES.values()], options.output / "falling.png")

    for data in (fixed, adaptive, foreign, fallen):
        print_shares(data)
    laws.print_fold(fixed, theory)
    for data in (adaptive, foreign):
        laws.print_silence(data, theory)
    print_drift(drifted)
    print(describe_machine("NumPy", "SciPy", "Numba", "dea_maps"))


def atlas(
    cases: list[package_maps.Case], across: int, accuracies: NDArray, measure: Callable[[package_maps.Case], Measure]
) -> xr.Dataset:
    """Return ``verdict`` and ``error`` (case, scene, accuracy, place) of all cases."""
    places = np.array([scene.values(across) for scene in SCENES])
    shape = (len(cases), len(SCENES), accuracies.size, across)
    kinds, sizes = np.empty(shape, np.int8), np.empty(shape, np.float32)
    programs = np.empty(shape[:2], object)
    for i, case in enumerate(cases):
        for j, scene in enumerate(SCENES):
            kinds[i, j], sizes[i, j] = measure(case)(scene, places[j], accuracies)
            programs[i, j] = scene.program(case.programs) or ""
            print(f"{case.label}, {scene.label}: done", flush=True)
    axes = ("case", "scene", "accuracy", "place")
    flags = {"flag_values": np.arange(len(WORDS), dtype=np.int8), "flag_meanings": " ".join(WORDS)}
    return xr.Dataset(
        {
            "verdict": (axes, kinds, {"long_name": "what happened; -1: method serves no such program", **flags}),
            "error": (axes, sizes, {"long_name": "largest relative error of time, stretch and field", "units": "1"}),
            "place_value": (("scene", "place"), places, {"long_name": "place along the axis of the scene"}),
            "program": (("case", "scene"), programs, {"long_name": "loading program"}),
        },
        coords={
            "case": [case.label for case in cases],
            "scene": [scene.name for scene in SCENES],
            "accuracy": ("accuracy", accuracies, {"long_name": "step or tolerance", "units": "1"}),
        },
    )


def fixed_limits(cases: list[package_maps.Case], theory: dict[str, xr.Dataset]) -> dict[tuple[str, str], list]:
    """Lines over the maps of fixed steps."""
    lines = {}
    for case in cases:
        for scene, known in theory.items():
            form = known.sel(formulation=case.formulation)
            drawn = [("stable", known.value, form.stable.sel(solver=case.method)), ("spent", known.value, form.spent)]
            if case.formulation == "rate":
                drawn.append(("fold", known.value, known.fold))
                drawn.append(("life", known.value, form.spent * package_maps.BUDGET))
            lines[case.label, scene] = drawn
    return lines


def adaptive_limits(cases: list[package_maps.Case], theory: dict[str, xr.Dataset]) -> dict[tuple[str, str], list]:
    """Lines over the maps of tolerances.

    Where stability alone spends the budget, the bottleneck's margin, and on "rate" the tolerance at the fold that no
    step is short enough for.
    """
    lines: dict[tuple[str, str], list] = {}
    explicit = {"dopri5": ("dopri5", 1), "dop853": ("dop853", 1), "RK45": ("dopri5", 6), "DOP853": ("dop853", 12)}
    for case in cases:
        for scene, known in theory.items():
            drawn = lines.setdefault((case.label, scene), [])
            if case.formulation == "rate":
                drawn.append(("collapse", known.value, known.collapse))
            if case.formulation in ("rate", "fold") and scene == "field":
                drawn.append(("margin", np.array([1e-12, 1.0]), np.array([2e-12, 2.0])))
            if case.formulation in ("rate", "fold") and scene == "rate" and case.method in explicit:
                tableau, calls = explicit[case.method]
                form = known.sel(formulation=case.formulation)
                budget = scipy_maps.BUDGET / calls if calls > 1 else package_maps.BUDGET
                ratio = np.log(form.spent * package_maps.BUDGET / budget / form.stable.sel(solver=tableau)).values
                if ratio.min() < 0.0 < ratio.max():
                    rate = np.exp(np.interp(0.0, -ratio, np.log(known.value)))
                    drawn.append(("explicit", np.array([rate, rate]), np.array([1e-13, 1.0])))
    return lines


def save(data: xr.Dataset, name: str, folder: Path) -> None:
    """Write a compressed NetCDF file."""
    encoding = {key: {"zlib": True, "complevel": 4} for key in data.data_vars if data[key].dtype.kind in "fi"}
    data.attrs["title"] = f"Atlas of stability: {name}"
    data.to_netcdf(folder / f"{name}.nc", encoding=encoding)


def print_shares(data: xr.Dataset) -> None:
    """Print the share of cells with each verdict, as a Markdown table."""
    print("\n| method | axis |", " | ".join(word.replace("_", " ") for word in WORDS), "|")
    print("|---|---|" + "---|" * len(WORDS))
    for case in data.case.values:
        for scene in data.scene.values:
            kinds = data.verdict.sel(case=case, scene=scene).values
            if (kinds != NOT_SERVED).any():
                shares = [f"{(kinds == code).mean():.0%}" for code in range(len(WORDS))]
                print(f"| {case} | {scene} |", " | ".join(shares), "|")


def print_drift(data: xr.Dataset) -> None:
    """Print the residual at the end and the error of the time of failure, as a Markdown table."""
    print("\n| field | solver | formulation | largest residual | error of the time to failure |\n|---|---|---|---|---|")
    for field in data.field.values:
        for solver in data.solver.values:
            for form in data.formulation.values:
                part = data.sel(field=field, solver=solver, formulation=form)
                error = float(part.failure / part.truth - 1.0)
                print(f"| {field} | {solver} | {form} | {float(part.residual.max()):.1e} | {error:.1e} |")
    print()


if __name__ == "__main__":
    main()
