"""What each verb of the command line does with its arguments."""

import argparse
import os
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..atomic import check_writable
from .streams import say

MAP_SUFFIX = ".nc"


class InputError(Exception):
    """Input that was refused before any computing."""


@contextmanager
def _checking_input() -> Iterator[None]:
    """Take errors for refusals of what the user gave; warnings of it are shown if it is not refused."""
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", UserWarning)
            yield
    except (OSError, TypeError, ValueError) as error:
        raise InputError(str(error)) from error
    for warning in caught:
        warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)


def sweep(arguments: argparse.Namespace) -> None:
    """Solve a specification into a file, or into one for every film."""
    from ..files.netcdf import open_map
    from ..files.to_netcdf import planned_file, write
    from ..materials.scales import scales_of
    from .specification import read_specifications
    from .summary import describe_plan, one_line

    options = ("dtype", "digits", "engine", "scheduler", "memory")
    storing: dict[str, Any] = {key: getattr(arguments, key) for key in options}
    with _checking_input():
        specs = read_specifications(arguments.specification)
        if arguments.variables is not None:
            storing["variables"] = arguments.variables.split(",")
        _check_other(arguments.output, arguments.specification, "the specification")
        if Path(arguments.output).suffix.lower() != MAP_SUFFIX:
            raise ValueError(f"a map must be a file ending in {MAP_SUFFIX}; got {arguments.output}")
        paths = _numbered(arguments.output, len(specs))
        requests = [spec.request(arguments.quick) for spec in specs]
        plans = [planned_file(path, request, **storing) for path, request in zip(paths, requests, strict=True)]
    if arguments.dry_run:
        say("\n\n".join(describe_plan(plan, arguments.fresh) for plan in plans))
        return
    for path, plan in zip(paths, plans, strict=True):
        if plan.film is not None and not arguments.quiet:
            say(str(scales_of(plan.template())))
        write(plan, arguments.fresh, progress=sys.stderr.isatty() and not arguments.quiet)
        if not arguments.quiet:
            with open_map(path) as ds:
                say(f"{path}: {one_line(ds)}")


def _numbered(output: str, number: int) -> list[str]:
    """Return the files of several films, ``map_1.nc`` and so on; of one, the file itself."""
    if number == 1:
        return [output]
    stem, suffix = os.path.splitext(output)
    return [f"{stem}_{film}{suffix}" for film in range(1, number + 1)]


def _check_other(output: str, read: str, what: str) -> None:
    """Check that a file that is to be written is not the one that is read."""
    if os.path.exists(output) and os.path.samefile(output, read):
        raise ValueError(f"cannot write {output}: it is {what} itself")


def plot(arguments: argparse.Namespace) -> None:
    """Draw what a file holds."""
    from ..charts.select import check_chart_path, draw, save
    from ..files.verify import open_any

    with _checking_input():
        check_chart_path(arguments.output)
        with open_any(arguments.map, "allowable_voltage") as ds:
            figure = draw(ds, arguments.chart, arguments.size)
    save(figure, arguments.output)


def explore(arguments: argparse.Namespace) -> None:
    """Make an interactive HTML page of a map."""
    from ..explorer.export import check_page_path, draw, save
    from ..files.verify import open_any

    with _checking_input():
        check_page_path(arguments.output)
        with open_any(arguments.map) as ds:
            page = draw(ds)
    save(page, arguments.output)


def design(arguments: argparse.Namespace) -> None:
    """Print the allowable voltages of films, and draw them."""
    from ..charts.select import check_chart_path, draw, save
    from ..limits.voltages import describe_design, read_design

    with _checking_input():
        if arguments.output is not None:
            check_chart_path(arguments.output)
        answers = read_design(arguments.specification)
    say(describe_design(answers))
    if arguments.output is not None:
        with _checking_input():
            figure = draw(answers, "design_chart", arguments.size)
        save(figure, arguments.output)


def ask(arguments: argparse.Namespace) -> None:
    """Answer a question about one film."""
    from .ask import answer, in_words, question_of

    with _checking_input():
        found = answer(question_of(arguments))
    say(_json(found) if arguments.json else in_words(found))


def trajectory(arguments: argparse.Namespace) -> None:
    """Follow the films of a specification in time, into a file or a chart."""
    from ..charts.select import SUFFIXES, draw, save
    from ..files.netcdf import check_netcdf_name, write_dataset
    from .specification import read_specification
    from .time_series import TABLE_SUFFIX, times_of, trajectories_of, write_table

    suffix = Path(arguments.output).suffix.lower()
    with _checking_input():
        if suffix not in (MAP_SUFFIX, TABLE_SUFFIX, *SUFFIXES):
            known = ", ".join((MAP_SUFFIX, TABLE_SUFFIX, *SUFFIXES))
            raise ValueError(f"trajectories must be a file ending in {known}; got {arguments.output}")
        _check_other(arguments.output, arguments.specification, "the specification")
        check_writable(arguments.output)
        check_netcdf_name(arguments.output)
        spec = read_specification(arguments.specification)
        ds = trajectories_of(spec, times_of(arguments.until, arguments.points))
        figure = draw(ds, "auto", arguments.size) if suffix in SUFFIXES else None
    if figure is not None:
        save(figure, arguments.output)
    elif suffix == MAP_SUFFIX:
        write_dataset(ds, arguments.output)
    else:
        write_table(ds, arguments.output)


def _json(found: dict[str, Any]) -> str:
    """Return numbers and words as JSON, in which there is no infinity."""
    import json

    return json.dumps(found, indent=2, ensure_ascii=False, allow_nan=False)


def info(arguments: argparse.Namespace) -> None:
    """Print what a file holds."""
    from ..files.verify import open_any
    from .summary import as_json, describe

    with _checking_input():
        ds = open_any(arguments.map)
    with ds:
        say(_json(as_json(ds)) if arguments.json else describe(ds))


def fit(arguments: argparse.Namespace) -> None:
    """Fit a material, say how well it is known, give the table of a specification, and draw the fit."""
    from ..atomic import replacing
    from ..charts.fit import draw_fit
    from ..charts.select import check_chart_path, save
    from ..materials.fit import fit_uniaxial
    from ..materials.tension_data import read_curves
    from ..materials.toml import table_of

    with _checking_input():
        curves = read_curves(arguments.data)
        if arguments.output is not None:
            check_chart_path(arguments.output)
        if arguments.material is not None:
            _check_other(arguments.material, arguments.data, "the data")
            check_writable(arguments.material)
    file = Path(os.fsencode(arguments.data).decode(errors="replace"))
    fit = fit_uniaxial(curves, noise=arguments.noise, name=file.stem, source=f"fit to tension, {file.name}")
    table = table_of(fit.material, [name for name, known in fit.determined.items() if not known])
    if arguments.material is None:  # a specification, as a whole
        say("\n".join([*(f"# {line}" for line in fit.summary().splitlines()), "", table]))
    else:
        with replacing(arguments.material) as temporary:
            temporary.write_text(f"{table}\n", encoding="utf-8")
        say(fit.summary())
    if arguments.output is not None:
        save(draw_fit(fit), arguments.output)
