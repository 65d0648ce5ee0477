"""Opening a map with a check of all that is in it."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..atomic import PathLike
from ..checks import brief
from ..materials.scales import scales_of
from ..nomenclature import BREAKDOWN, FLAGGED, GENERAL, KINDS, VARIABLES, cf_attributes
from ..outcomes import Limit, Outcome, words_of
from ..program_text import kinds_in, program_of
from ..programs import PROGRAMS
from ..sweeps.chunks import cut
from ..sweeps.methods import methods
from ..sweeps.parameters import check_values
from .netcdf import open_map

_BLOCK = 2**22  # cells read at once
_EARLIER = {("dop853", "length")}
"""Method and formulation as older files name what is now `area`, of films under a dead load."""
_FLAGS = {"outcome": words_of(Outcome), "first_limit": words_of(Limit)}
_OTHER_KINDS = {"allowable_voltage", *GENERAL}
_AT_LEAST_ONE = {name for name in (*VARIABLES, "breakdown_stretch") if "stretch" in name}


def open(path: PathLike) -> xr.Dataset:
    """Open a map written by a sweep, and check that all of it is there and as it was written.

    Names, dimensions, types, flags and attributes are checked, every value is read once, which verifies its checksum,
    and held against the outcome of its cell.

    Parameters
    ----------
    path : str or path-like
        The file.

    Returns
    -------
    Dataset
        Its values are read as they are used; to be closed by the caller, as by a ``with`` block.

    Raises
    ------
    OSError
        If there is no such file, or it cannot be read.
    ValueError
        If it is not a map of this package, or is damaged.

    Examples
    --------
    >>> import dea_maps as dm, os, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = os.path.join(folder, "map.nc")
    ...     dm.sweep_to_netcdf(path, dm.Step(), field=[0.9, 1.2], modulus_ratio=4.0)
    ...     with dm.open(path) as ds:
    ...         ds.outcome.values.tolist()
    [0, 1]
    """
    try:
        ds = open_map(path)
    except (FileNotFoundError, IsADirectoryError, PermissionError):
        raise
    except Exception as error:
        raise _refusal(path, error) from None
    return _checked(ds, path, _check)


def open_any(path: PathLike, *others: str) -> xr.Dataset:
    """Open a map, or trajectories, or what has other variables of this package, checked as `open` does.

    Parameters
    ----------
    path : str or path-like
        The file.
    *others : str
        Variables that the file may have instead of those of a map.

    Returns
    -------
    Dataset
        To be closed by the caller.

    Raises
    ------
    OSError, ValueError
        As `open`.
    """
    return _checked(open_map(path, *others), path, _check_any)


def _checked(ds: xr.Dataset, path: PathLike, check: Callable[[xr.Dataset], None]) -> xr.Dataset:
    """Return a data set once it is checked; closed, if it is refused."""
    try:
        check(ds)
    except Exception as error:
        ds.close()
        raise _refusal(path, error) from None
    return ds


def _refusal(path: PathLike, error: Exception) -> ValueError:
    words = f"it lacks {error.args[0]!r}" if isinstance(error, KeyError) and error.args else str(error)
    return ValueError(f"{path} is not a map, or is damaged: {' '.join(words.split())}")


def _check_any(ds: xr.Dataset) -> None:
    """Check a map as one; of others, that all can be read."""
    if "program" in ds.attrs or not ds.keys() & _OTHER_KINDS:
        _check(ds)
        return
    for name in map(str, ds.variables):
        for _ in _blocks({name: ds[name]}):
            pass


def _check(ds: xr.Dataset) -> None:
    """Raise an error that says what is wrong."""
    for name in ("program", "method", "formulation", "dea_maps_version"):
        if not isinstance(ds.attrs[name], str):
            raise ValueError(f"its attribute {name} must be a string; got {brief(ds.attrs[name])}")
    named = PROGRAMS.get(ds.attrs["program"])
    if named is None:
        raise ValueError(f"its program is {brief(ds.attrs['program'])}")
    needed = getattr(named, "kinds", None) or program_of(ds.attrs).kinds
    for name in (*needed, "modulus_ratio"):
        if name not in ds.coords:
            raise ValueError(f"it lacks {name!r}")
    kinds = kinds_in(ds.coords, ds.attrs)
    chosen = {(method.name, form) for method in methods() for form in method.formulations} | _EARLIER
    if (ds.attrs["method"], ds.attrs["formulation"]) not in chosen:
        raise ValueError(f"its method is {brief(ds.attrs['method'])} on {brief(ds.attrs['formulation'])}")
    scales_of(ds)  # raises where the film is not described as it should be
    accuracy = [float(ds.attrs[name]) for name in ("rtol", "step") if name in ds.attrs]
    if len(accuracy) != 1 or not accuracy[0] > 0.0:
        raise ValueError("it does not say how accurate it is")
    for name, kind in kinds.items():
        if ds[name].dtype != np.float64 or ds[name].attrs.get("units") != "1":  # its long_name may be the user's own
            raise ValueError(f"{name} is of type {ds[name].dtype} with units {brief(ds[name].attrs.get('units'))}")
        check_values(name, np.asarray(ds[name].values), KINDS[kind])
    maps = {name: ds[name] for name in (*VARIABLES, *BREAKDOWN) if name in ds}
    dims = next(iter(maps.values())).dims
    for name, array in maps.items():
        _check_described(array, name, ("int8",) if name in FLAGGED else ("float32", "float64"))
        if array.dims != dims:
            raise ValueError(f"{name} has the dimensions {array.dims}, others have {dims}")
    for name, words in _FLAGS.items():
        if name in maps:
            flags = np.asarray(maps[name].attrs["flag_values"]).tolist()
            if flags != list(range(len(words))) or maps[name].attrs["flag_meanings"] != " ".join(words):
                raise ValueError(f"the flags of {name} are not those of this package")
    for blocks in _blocks(maps):
        _check_values(blocks)
    for other in sorted(map(str, ds.variables.keys() - maps.keys())):
        for _ in _blocks({other: ds[other]}):  # to be read is enough: that verifies the checksum
            pass


def _check_described(array: xr.DataArray, name: str, kinds: tuple[str, ...]) -> None:
    described = {key: array.attrs.get(key) for key in ("long_name", "units")}
    if array.dtype.name not in kinds or described != cf_attributes(name):
        raise ValueError(f"{name} is of type {array.dtype} with {described}")


def _blocks(maps: dict[str, xr.DataArray]) -> Iterator[dict[str, npt.NDArray[Any]]]:
    parts = cut(next(iter(maps.values())).shape, _BLOCK)
    for number in range(parts.count):
        yield {name: array[parts.index(number)].values for name, array in maps.items()}


def _check_values(block: dict[str, npt.NDArray[Any]]) -> None:
    """Hold the values of some cells against their outcomes: what there is, and what there cannot be."""
    for name, words in _FLAGS.items():
        if name in block and block[name].size and not (block[name].min() >= 0 and block[name].max() < len(words)):
            raise ValueError(f"{'an outcome' if name == 'outcome' else name} is none of the flags")
    for name, values in block.items():
        by = "first_limit" if name in BREAKDOWN else "outcome"
        if name in FLAGGED or by not in block:
            continue
        if by == "outcome":
            survives, ends = block[by] == Outcome.SURVIVES, "steady_stretch_max" not in block
            has_value = {
                "final_stretch": survives & ends,
                "largest_stretch": survives | _fails(block[by]),
                "cycles_to_failure": block[by] == Outcome.FAILS_LATER,
                "steady_stretch_max": survives,
                "steady_stretch_min": survives,
            }.get(name, _fails(block[by]))
        else:
            has_value = block[by] == Limit.BREAKDOWN
        if not np.array_equal(np.isfinite(values), has_value) or not np.array_equal(np.isnan(values), ~has_value):
            raise ValueError(f"{name} has values where the {by.replace('_', ' ')} has none, or none where it has")
        if np.any(values[has_value] < (0.999 if name in _AT_LEAST_ONE else 0.0)):
            raise ValueError(f"{name} has values that are too small")


def _fails(outcome: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    return np.isin(outcome, (Outcome.FAILS_LATER, Outcome.FAILS_AT_ONCE))
