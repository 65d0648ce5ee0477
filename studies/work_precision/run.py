"""Work against precision: time per trajectory on one core at delivered error, for dea_maps and other solvers.

    python studies/work_precision/run.py [--quick] [--output FOLDER] [--scenes NAME ...]

writes, in out/work_precision unless told where, work_precision.nc, summary.png and one chart a scene, and prints the
tables of README.md. With --scenes these alone are measured and drawn; the others of the folder's work_precision.nc stay
in it and in the summary. Other solvers take part where they are installed: pip install -e '.[peers]'. SciPy and NumPy
are always there.
"""

import sys
from pathlib import Path

sys.path.insert(1, str(Path(__file__).resolve().parents[1]))

import charts
import forms
import measure
import numpy as np
import product
import xarray as xr
from common.machine import describe_machine
from common.options import study_parser
from pieces import Films
from scenes import SCENES, SIZES
from truth import against_reference, doubt

LIBRARIES = ("dea_maps", "numba", "numpy", "scipy", "heyoka", "CyRK", "diffrax", "jax")


def main() -> None:
    """Measure, draw, write, print."""
    parser = study_parser(__file__, __doc__, quick="three scenes, few cases, SciPy and NumPy alone")
    parser.add_argument("--scenes", nargs="+", choices=SCENES, metavar="NAME", help="measure these scenes alone")
    options = parser.parse_args()
    measure.one_core()

    names = options.scenes or list(measure.QUICK if options.quick else SCENES)
    data = measure.measure(names, options.quick)
    path = options.output / "work_precision.nc"
    together = with_known(data, path) if options.scenes and path.exists() else data
    encoding = {name: {"zlib": True} for name in ("seconds", "worst", "median", "unanswered", "cases")}
    together.to_netcdf(path, encoding=encoding)
    for name in names:
        charts.scene(data, name, options.output / f"{name}.png")
    charts.summary(together, options.output / "summary.png")
    for name in names:
        print_scene(data, name)
    print_posing(data)
    print_truth(data, SIZES[0] if options.quick else SIZES[1], options.quick)
    product.show(quick=options.quick)
    print(describe_machine(*LIBRARIES))


def with_known(data: xr.Dataset, path: Path) -> xr.Dataset:
    """Return scenes with those of a file that were not measured again."""
    with xr.open_dataset(path) as known:
        rest = known.load().drop_sel(scene=[name for name in data.scene.values if name in known.scene])
    solvers = list(dict.fromkeys([*rest.solver.values, *data.solver.values]))
    of_solvers = ["accuracy", "library", "rate_form"]
    joined = xr.concat([part.drop_vars(of_solvers) for part in (rest, data)], "scene", join="outer")
    joined = joined.sel(scene=[name for name in SCENES if name in joined.scene], solver=solvers)
    for name in of_solvers:
        known_or_new = data[name].astype(object).combine_first(rest[name].astype(object))
        joined[name] = known_or_new.sel(solver=solvers).astype(data[name].dtype)
    return joined


def print_scene(data: xr.Dataset, scene: str) -> None:
    """Print trajectories per second at a delivered accuracy, as a Markdown table."""
    groups = measure.groups(data)
    films = isinstance(SCENES[scene].cases(SIZES[0]), Films)
    last, words = ("untold", "told nothing") if films else ("rate", "paper's form")
    print(f"\n{scene}: {SCENES[scene].title}; trajectories per second and core, every case as accurate\n")
    print(f"| error | auto | fastest of dea_maps | fastest other | ratio | fastest other, {words} | ratio |")
    print("|---|---|---|---|---|---|---|")
    for accuracy in measure.ACCURACIES:
        found = {group: measure.fastest(data, scene, names, accuracy) for group, names in groups.items()}
        mine = found["auto"][1]
        cells = [f"{mine:.1e}"]
        for group in ("ours", "others", last):
            name, rate = found[group]
            cells.append(f"{rate:.1e} {name}" if name else "none")
            if group != "ours":
                cells.append(f"{mine / rate:.1f}" if name else "-")
        print(f"| {accuracy:.0e} |", " | ".join(cells), "|")
    print("\n| solver | least error of the worst case | settings without an answer in some case |\n|---|---|---|")
    for name in data.solver.values:
        part = data.sel(scene=scene, solver=name)
        count = int(part.seconds.notnull().sum())
        if count:
            silent = int((part.unanswered > 0.0).sum())
            print(f"| {name} | {float(part.worst.min()):.1e} | {silent} of {count} |")


def print_posing(data: xr.Dataset) -> None:
    """Print what posing the best forms takes, which is not timed, but for the quadrature."""
    print("\nNot timed for other solvers, but a part of every time of dea_maps: posing a case, in NumPy:", end=" ")
    for name in data.scene.values:
        if SCENES[name].program in forms.BEST and not isinstance(SCENES[name].cases(SIZES[0]), Films):
            cases, form = SCENES[name].cases(SIZES[-1]), forms.BEST[SCENES[name].program][0]
            seconds = min(measure.seconds_of(lambda form=form, cases=cases: form.pose(cases)) for _ in range(5))
            print(f"{name} {1e6 * seconds / SIZES[-1]:.2f} µs,", end=" ")
    print()


def print_truth(data: xr.Dataset, number: int, quick: bool) -> None:
    """Print how sure the truth is."""
    print(
        "\n| scene | truth: change with finer steps | against the references of the tests, on a sample |\n|---|---|---|"
    )
    for name in data.scene.values:
        skipped = quick and isinstance(SCENES[name].cases(number), Films)  # heyoka would compile for seconds
        sample = None if skipped else against_reference(SCENES[name], number)
        print(f"| {name} | {doubt(SCENES[name], number):.1e} |", "-" if sample is None else f"{sample:.1e}", "|")
    print()


if __name__ == "__main__":
    np.seterr(all="ignore")
    main()
