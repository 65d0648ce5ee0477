"""What each verb of the command line does with its arguments."""

import argparse
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any


class InputError(Exception):
    """Input that was refused before any computing."""


@contextmanager
def _checking_input() -> Iterator[None]:
    """Take errors for refusals of what the user gave."""
    try:
        yield
    except (OSError, TypeError, ValueError) as error:
        raise InputError(str(error)) from error


def sweep(arguments: argparse.Namespace) -> None:
    """Solve a specification into a file."""
    from .disk import planned_file, sweep_to_netcdf
    from .spec import read_specification, thinned
    from .storage import open_map
    from .summary import describe_plan, one_line

    storing: dict[str, Any] = {key: getattr(arguments, key) for key in ("dtype", "engine", "scheduler", "memory")}
    with _checking_input():
        spec = read_specification(arguments.specification)
        if arguments.variables is not None:
            storing["variables"] = arguments.variables.split(",")
        parameters = thinned(spec.parameters) if arguments.quick else spec.parameters
        film = {"material": spec.material, "thickness": spec.thickness}
        asked = {**parameters, **spec.accuracy, **storing, **film}
        plan = planned_file(arguments.output, spec.program, **asked)
        if os.path.exists(arguments.output) and os.path.samefile(arguments.output, arguments.specification):
            raise ValueError(f"cannot write {arguments.output}: it is the specification itself")
    if arguments.dry_run:
        print(describe_plan(plan))
        return
    progress = sys.stderr.isatty() and not arguments.quiet
    sweep_to_netcdf(arguments.output, spec.program, **asked, fresh=arguments.fresh, progress=progress)
    if not arguments.quiet:
        with open_map(arguments.output) as ds:
            print(f"{arguments.output}: {one_line(ds)}")


def plot(arguments: argparse.Namespace) -> None:
    """Draw what a file holds."""
    from .charts import check_chart_path, draw, save
    from .storage import open_map

    with _checking_input():
        check_chart_path(arguments.output)
        with open_map(arguments.map, "allowable_voltage") as ds:
            figure = draw(ds, arguments.chart, arguments.size)
    save(figure, arguments.output)


def explore(arguments: argparse.Namespace) -> None:
    """Make a page to look around in a map."""
    from .explorer import check_page_path, draw, save
    from .storage import open_map

    with _checking_input():
        check_page_path(arguments.output)
        with open_map(arguments.map) as ds:
            page = draw(ds)
    save(page, arguments.output)


def design(arguments: argparse.Namespace) -> None:
    """Print the largest voltages that films take, and draw them."""
    from .charts import check_chart_path, draw, save
    from .designing import describe_design, read_design

    with _checking_input():
        if arguments.output is not None:
            check_chart_path(arguments.output)
        answers = read_design(arguments.specification)
    print(describe_design(answers))
    if arguments.output is not None:
        with _checking_input():
            figure = draw(answers, "design_chart", arguments.size)
        save(figure, arguments.output)


def info(arguments: argparse.Namespace) -> None:
    """Print what a file holds."""
    from .storage import open_map
    from .summary import describe

    with _checking_input():
        ds = open_map(arguments.map)
    with ds:
        print(describe(ds))


def fit(arguments: argparse.Namespace) -> None:
    """Fit a material, print it, also as a table of a specification, and draw the fit."""
    from .charts import check_chart_path, save
    from .fit_chart import draw_fit
    from .fitting import fit_uniaxial
    from .material_table import table_of
    from .tension_curves import read_curves

    with _checking_input():
        curves = read_curves(arguments.data)
        if arguments.output is not None:
            check_chart_path(arguments.output)
    file = Path(os.fsencode(arguments.data).decode(errors="replace"))
    fit = fit_uniaxial(curves, noise=arguments.noise, name=file.stem, source=f"fit to tension, {file.name}")
    print(f"{fit.summary()}\n\n{table_of(fit.material)}")
    if arguments.output is not None:
        save(draw_fit(fit), arguments.output)
