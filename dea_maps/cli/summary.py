"""What a map holds, in words for a terminal."""

from collections.abc import Hashable, Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..files.stream import Plan, estimated_seconds, finished_parts
from ..materials.scales import scales_of
from ..nomenclature import BREAKDOWN, FLAGGED, NOMENCLATURE, VARIABLES
from ..outcomes import Limit, Outcome, words_of
from ..program_text import kinds_in
from ..sweeps.chunks import cut
from ..sweeps.solve import compiles

_WIDTH = 26
_BLOCK = 2**22  # cells read at once


def outcome_counts(ds: xr.Dataset) -> dict[str, int]:
    """Count the cells of every outcome.

    Parameters
    ----------
    ds : Dataset
        With the variable ``outcome``.

    Returns
    -------
    dict of str to int
        By the words of `dea_maps.outcomes.Outcome`.

    Examples
    --------
    >>> import dea_maps as dm
    >>> outcome_counts(dm.sweep(dm.Step(), field=[0.9, 1.1, 1.2], modulus_ratio=4.0))
    {'survives': 1, 'fails_later': 2, 'fails_at_once': 0, 'unresolved': 0}
    """
    return _counts(ds["outcome"], words_of(Outcome))


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
    cells = ds["outcome"].size
    line = f"{cells:,} {'cell' if cells == 1 else 'cells'}: {_in_words(outcome_counts(ds))}"
    return (
        f"{line}; first limit: {_in_words(_counts(ds['first_limit'], words_of(Limit)))}"
        if "first_limit" in ds
        else line
    )


def as_json(ds: xr.Dataset) -> dict[str, Any]:
    """Return what a file holds as numbers and words: attributes, dimensions, outcomes, and ranges with units.

    Examples
    --------
    >>> import dea_maps as dm
    >>> found = as_json(dm.sweep(dm.Step(), field=[0.9, 1.2], modulus_ratio=4.0))
    >>> found["dimensions"], found["outcomes"]["survives"], found["parameters"]["field"]["most"]
    ({'field': 2}, 1, 1.2)
    """
    attributes = {str(key): value.tolist() if hasattr(value, "tolist") else value for key, value in ds.attrs.items()}
    found: dict[str, Any] = {"attributes": attributes, "dimensions": {str(dim): n for dim, n in ds.sizes.items()}}
    if "outcome" in ds:
        found["outcomes"] = outcome_counts(ds)
    if "first_limit" in ds:
        found["first_limits"] = _counts(ds["first_limit"], tuple(ds["first_limit"].attrs["flag_meanings"].split()))
    for kind, among in (("parameters", ds.coords), ("variables", ds.data_vars)):
        found[kind] = {
            str(name): _range_as_json(array)
            for name, array in among.items()
            if name not in FLAGGED and array.dtype.kind in "iuf"
        }
    return found


def _range_as_json(array: xr.DataArray) -> dict[str, Any]:
    ends = _ends(array)
    least, most = ends if ends is not None else (None, None)
    return {"least": least, "most": most, "units": str(array.attrs.get("units", "1"))}


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
    accuracy = [f"{key} {float(ds.attrs[key]):g}" for key in ("rtol", "step") if key in ds.attrs]
    versions = [f"{key.removesuffix('_version')} {ds.attrs[key]}" for key in ds.attrs if key.endswith("_version")]
    maps = [name for name in (*VARIABLES, *BREAKDOWN) if name in ds]
    first = ds[maps[0]]
    lines = [
        str(ds.attrs.get("title", "a map without a title")),
        *_how(ds, accuracy),
        _row("made with", ", ".join(versions)),
        *_film(ds),
        _row("dimensions", _lengths(first.sizes)),
        _row("cells", f"{first.size:,}"),
        *_parameters(ds),
    ]
    if "outcome" in ds:
        lines += ["", "outcomes, in cells"]
        lines += [_row(_words(outcome), f"{count:,}") for outcome, count in outcome_counts(ds).items()]
    if "first_limit" in ds:
        lines += ["", "what ends the loading first, in cells"]
        lines += [_row(word, f"{count:,}") for word, count in _counts(ds["first_limit"], words_of(Limit)).items()]
    lines += ["", "variables, from least to greatest"]
    among = NOMENCLATURE if _is_general(ds) else maps
    names = [name for name in among if name in ds.data_vars and name not in FLAGGED]
    lines += [_row(name, _range(ds[name])) for name in [*names, *_in_si(ds, coordinates=False)]]
    return "\n".join(lines)


def _is_general(ds: xr.Dataset) -> bool:
    """Tell whether a data set is a trajectory of the general model."""
    return "stretch_1" in ds


def _how(ds: xr.Dataset, accuracy: list[str]) -> list[str]:
    """Return the lines on what was prescribed and how it was computed."""
    if not _is_general(ds):
        method = [str(ds.attrs["method"]), f"formulation {ds.attrs['formulation']}"] if "method" in ds.attrs else []
        program = [_row("program", ds.attrs["program"])] if "program" in ds.attrs else []
        return [*program, _row("method", ", ".join([*method, *accuracy]))]
    loads = [name for name in map(str, ds.attrs) if name.startswith("prescribed_")]
    rows = [_row(name.replace("_", " "), str(ds.attrs[name])) for name in loads]
    limit = ds["first_limit"].attrs["flag_meanings"].split()[int(ds["first_limit"])]
    return [*rows, _row("accuracy", ", ".join(accuracy)), _row("first limit", _words(limit))]


def _parameters(ds: xr.Dataset) -> list[str]:
    """Return the lines on the parameters of a map, and on what they are in volts and seconds."""
    names = [name for name in (*kinds_in(ds.coords, ds.attrs), *_in_si(ds, coordinates=True)) if name in ds.coords]
    return ["", "parameters, from least to greatest", *(_row(name, _range(ds[name])) for name in names)]


def _film(ds: xr.Dataset) -> list[str]:
    """Return the lines on the film of a map in volts and seconds."""
    scales = scales_of(ds)
    if scales is None:
        return []
    name = ds.attrs.get("material") or "a material without a name"
    lines = [_row("film", f"{name}, {1e6 * ds.attrs['thickness_in_m']:.6g} um thick"), _row("scales", scales)]
    if "first_limit" in ds:
        lines.append(_row("breakdown strength", _strength(ds.attrs)))
    return lines


def _strength(attributes: Mapping[str, Any]) -> str:
    """Return a breakdown strength in words."""
    if "breakdown_strength_in_V_per_m" not in attributes:
        return "a function of the stretch"
    words = f"{1e-6 * attributes['breakdown_strength_in_V_per_m']:.4g} MV/m"
    exponent = attributes.get("breakdown_strength_exponent")
    return words if exponent is None else f"{words} * stretch^{exponent:.4g}"


def _in_si(ds: xr.Dataset, coordinates: bool) -> list[str]:
    """Return the names of what a map holds in SI units."""
    among = ds.coords if coordinates else ds.data_vars
    return [str(name) for name, array in among.items() if array.attrs.get("units", "1") != "1"]


def describe_plan(plan: Plan, fresh: bool = False) -> str:
    """Return what a sweep to a file would do, how large it would be and how long it would take, on several lines.

    Parameters
    ----------
    plan : Plan
        From `dea_maps.files.to_netcdf.planned_file`.
    fresh : bool
        Whether finished parts will not be used.

    Examples
    --------
    >>> from dea_maps.files.to_netcdf import planned_file
    >>> from dea_maps.programs import Step
    >>> from dea_maps.runs.request import Request
    >>> request = Request(Step(), {"field": [0.9, 1.2], "modulus_ratio": 4.0})
    >>> print(describe_plan(planned_file("map.nc", request)).splitlines()[2])
    cells                      2
    """
    grid, choice = plan.grid, plan.choice
    template = plan.template()
    size = grid.cells * sum(array.dtype.itemsize for array in template.data_vars.values())
    accuracy = f"rtol {choice.rtol:g}" if choice.step is None else f"step {choice.step:g}"
    finished = [] if fresh else finished_parts(plan)
    left = 1.0 - sum(map(plan.parts.cells, finished)) / max(1, grid.cells)
    compiling = compiles(grid.program, choice)  # before the estimate, which compiles
    computing, start = estimated_seconds(plan) if grid.cells else (0.0, 0.0)
    done, rest = (f", of which {len(finished):,} are finished", ", for the rest") if finished else ("", "")
    return "\n".join(
        [
            _row("program", grid.program.name),
            _row("dimensions", _lengths(dict(zip(grid.dims, grid.shape, strict=True)))),
            _row("cells", f"{grid.cells:,}"),
            _row("size", f"{_bytes_in_words(size)}; less in the file, which is compressed"),
            _row("parts", f"{plan.parts.count:,}{done}"),
            *_film(template),
            _row("method", f"{choice.method}, formulation {choice.formulation}, {accuracy}"),
            _row("estimated time", f"{_time_in_words(left * computing)} on this machine{rest}"),
            _row("start", _start_in_words(start, compiling)),
            *_parameters(template),
        ]
    )


def _start_in_words(seconds: float, compiling: bool) -> str:
    """Say how long it takes until the first cell is computed; this estimate has compiled what was not."""
    if compiling:
        return f"the kernels were compiled for this estimate, once, in {_time_in_words(seconds)}"
    return f"{_time_in_words(seconds)}, for loading the compiled kernels"


def _time_in_words(seconds: float) -> str:
    """Return an estimated time in whole units, of which there are two or more.

    Examples
    --------
    >>> [_time_in_words(seconds) for seconds in (0.3, 110.0, 530.0, 40000.0)]
    ['less than 1 s', '110 s', '9 min', '11 h']
    """
    if seconds < 1.0:
        return "less than 1 s"
    lengths = {"d": 86400.0, "h": 3600.0, "min": 60.0, "s": 1.0}
    unit = next((unit for unit, length in lengths.items() if seconds >= 2.0 * length), "s")
    return f"{seconds / lengths[unit]:.0f} {unit}"


def _bytes_in_words(size: int) -> str:
    """Return a size in the unit in which its number is short.

    Examples
    --------
    >>> [_bytes_in_words(size) for size in (492, 1_500_000, 41_000_000_000)]
    ['492 B', '1.4 MiB', '38 GiB']
    """
    units = ("B", "KiB", "MiB", "GiB", "TiB")
    power = next((power for power in range(len(units)) if size < 1000 * 1024**power), len(units) - 1)
    number = size / 1024**power
    return f"{number:.1f} {units[power]}" if power and number < 10.0 else f"{number:,.0f} {units[power]}"


def _lengths(sizes: Mapping[Hashable, int]) -> str:
    return ", ".join(f"{dim} {size:,}" for dim, size in sizes.items()) or "none"


def _range(array: xr.DataArray) -> str:
    units = array.attrs.get("units", "1")
    unit = "" if units == "1" else f" {units}"
    ends = _ends(array)
    if ends is None:
        return "no value in any cell"
    least, greatest = ends
    return (f"{least:.6g}" if least == greatest else f"{least:.6g} to {greatest:.6g}") + unit


def _ends(array: xr.DataArray) -> tuple[float, float] | None:
    """Return the least and the greatest value; None where there is no value."""
    ends = [(float(np.nanmin(block)), float(np.nanmax(block))) for block in _blocks(array) if not np.isnan(block).all()]
    return (min(low for low, _ in ends), max(high for _, high in ends)) if ends else None


def _blocks(array: xr.DataArray) -> Iterator[npt.NDArray[np.generic]]:
    """Yield the values of a map that may be larger than memory."""
    parts = cut(array.shape, _BLOCK)
    for number in range(parts.count):
        yield array[parts.index(number)].values


def _row(name: str, value: str) -> str:
    return f"{name:{_WIDTH}} {value}"


def _counts(flags: xr.DataArray, words: tuple[str, ...]) -> dict[str, int]:
    """Count the cells of every flag."""
    counts = dict.fromkeys(words, 0)
    for block in _blocks(flags):
        for flag, word in enumerate(words):
            counts[word] += int(np.count_nonzero(block == flag))
    return counts


def _in_words(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{count:,} {_words(word)}" for word, count in counts.items())


def _words(outcome: str) -> str:
    return outcome.replace("_", " ")
