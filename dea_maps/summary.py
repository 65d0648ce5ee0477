"""What a map holds, in words for a terminal."""

from collections.abc import Hashable, Mapping

import numpy as np
import xarray as xr

from .catalogue import Choice
from .dataset import CELL_BYTES
from .grid import Grid
from .nomenclature import OUTCOMES, PARAMETERS, VARIABLES

_WIDTH = 27


def outcome_counts(ds: xr.Dataset) -> dict[str, int]:
    """Count the cells of every outcome.

    Parameters
    ----------
    ds : Dataset
        With the variable ``outcome``.

    Returns
    -------
    dict of str to int
        By the words of `dea_maps.nomenclature.OUTCOMES`.

    Examples
    --------
    >>> import dea_maps as dm
    >>> outcome_counts(dm.sweep(dm.Step(), field=[0.9, 1.1, 1.2], modulus_ratio=4.0))
    {'survives': 1, 'fails_later': 2, 'fails_at_once': 0, 'unresolved': 0}
    """
    counts = np.bincount(ds["outcome"].values.ravel(), minlength=len(OUTCOMES))
    return dict(zip(OUTCOMES, counts.tolist(), strict=True))


def one_line(ds: xr.Dataset) -> str:
    """Return the number of cells and of every outcome on one line.

    Parameters
    ----------
    ds : Dataset
        With the variable ``outcome``.

    Examples
    --------
    >>> import dea_maps as dm
    >>> one_line(dm.sweep(dm.Step(), field=[0.9, 1.1, 1.2], modulus_ratio=4.0))
    '3 cells: 1 survives, 2 fails later, 0 fails at once, 0 unresolved'
    """
    counts = ", ".join(f"{count:,} {_words(outcome)}" for outcome, count in outcome_counts(ds).items())
    return f"{ds['outcome'].size:,} cells: {counts}"


def describe(ds: xr.Dataset) -> str:
    """Return how a map was made, its grid, its outcomes and the range of its variables, on several lines.

    Parameters
    ----------
    ds : Dataset
        The data set of a sweep, perhaps with some of its variables only.

    Examples
    --------
    >>> import dea_maps as dm
    >>> print(describe(dm.sweep(dm.Step(), field=[0.9, 1.2], modulus_ratio=4.0)).splitlines()[1])
    program                    step
    """
    accuracy = next(f"{key} {ds.attrs[key]:g}" for key in ("rtol", "step") if key in ds.attrs)
    versions = ", ".join(f"{name} {ds.attrs[f'{name}_version']}" for name in ("dea_maps", "numba", "numpy"))
    first = ds[next(name for name in VARIABLES if name in ds)]
    lines = [
        ds.attrs["title"],
        _row("program", ds.attrs["program"]),
        _row("method", f"{ds.attrs['method']}, formulation {ds.attrs['formulation']}, {accuracy}"),
        _row("made with", versions),
        _row("dimensions", _lengths(first.sizes)),
        _row("cells", f"{first.size:,}"),
        "",
        "parameters, from least to greatest",
        *(_row(name, _range(ds[name])) for name in PARAMETERS if name in ds.coords),
    ]
    if "outcome" in ds:
        lines += ["", "outcomes, in cells"]
        lines += [_row(_words(outcome), f"{count:,}") for outcome, count in outcome_counts(ds).items()]
    lines += ["", "variables, from least to greatest"]
    lines += [_row(name, _range(ds[name])) for name in VARIABLES if name in ds and name != "outcome"]
    return "\n".join(lines)


def describe_plan(grid: Grid, choice: Choice) -> str:
    """Return what a sweep would do and how large its result would be, on several lines.

    Parameters
    ----------
    grid : Grid
        Its cells.
    choice : Choice
        How they would be solved.

    Examples
    --------
    >>> from dea_maps.programs import Step
    >>> from dea_maps.sweeping import planned
    >>> print(describe_plan(*planned(Step(), field=[0.9, 1.2], modulus_ratio=4.0)).splitlines()[2])
    cells                      2
    """
    size = grid.cells * CELL_BYTES
    accuracy = f"rtol {choice.rtol:g}" if choice.step is None else f"step {choice.step:g}"
    return "\n".join(
        [
            _row("program", grid.program.name),
            _row("dimensions", _lengths(dict(zip(grid.dims, grid.shape, strict=True)))),
            _row("cells", f"{grid.cells:,}"),
            _row(
                "bytes in memory",
                f"{size:,} ({size / 2**20:,.1f} MiB; fewer in the file, which is compressed)",
            ),
            _row("method", f"{choice.method}, formulation {choice.formulation}, {accuracy}"),
        ]
    )


def _lengths(sizes: Mapping[Hashable, int]) -> str:
    return ", ".join(f"{dim} {size:,}" for dim, size in sizes.items()) or "none"


def _range(array: xr.DataArray) -> str:
    least, greatest = float(array.min()), float(array.max())
    if np.isnan(least):
        return "no value in any cell"
    return f"{least:.6g}" if least == greatest else f"{least:.6g} to {greatest:.6g}"


def _row(name: str, value: str) -> str:
    return f"{name:{_WIDTH}}{value}"


def _words(outcome: str) -> str:
    return outcome.replace("_", " ")
