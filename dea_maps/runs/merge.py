"""One map from several that cover parts of a grid."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from .. import __version__
from ..checks import brief
from ..nomenclature import si_name
from ..program_text import kinds_in
from ..sweeps.dataset import with_storage

# What may differ between the maps: where they come from, and what does not change their results.
_JOINED = ("history", "numba_version", "numpy_version")
_DROPPED = ("sharing",)
_Array = npt.NDArray[Any]


def merge(maps: Iterable[xr.Dataset]) -> xr.Dataset:
    """Join maps that cover parts of a grid: maps along a parameter, or the blocks of a larger grid.

    Every cell of the grid that the values of the maps span must be in one of the maps. Unlike ``xr.merge`` this keeps
    the types, flags and history, and fills no cell with NaN.

    Parameters
    ----------
    maps : iterable of Dataset
        From `dea_maps.sweep`, `dea_maps.trajectory` or a file, with the same variables, made by the same program,
        method, accuracy, version and, in volts, film. Every dimension needs a coordinate; a parameter that is a
        number in each map and differs between them becomes a dimension, the last one.

    Returns
    -------
    Dataset
        In memory, with ascending coordinates and the dimensions in the order of the map that has most. Its ``history``
        is that of all maps, a line each, and that they were merged; different versions of Numba and NumPy are all
        named.

    Raises
    ------
    TypeError
        If `maps` is not made of data sets.
    ValueError
        If they are not maps of the same kind, if they leave a cell of the grid out, or if they differ in a cell that
        they share; named is the first that does.

    Examples
    --------
    >>> import dea_maps as dm
    >>> soft, stiff = (dm.sweep(dm.Step(), field=[0.9, 1.2], modulus_ratio=m) for m in ([2.0, 3.0], [4.0, 5.0]))
    >>> ds = dm.merge([soft, stiff])
    >>> ds.modulus_ratio.values.tolist(), ds.outcome.values.tolist(), ds.outcome.dtype.name
    ([2.0, 3.0, 4.0, 5.0], [[0, 0, 0, 0], [1, 1, 1, 1]], 'int8')
    """
    given = [maps] if isinstance(maps, xr.Dataset) else list(maps)
    for number, ds in enumerate(given):
        if not isinstance(ds, xr.Dataset):
            raise TypeError(f"maps must be data sets; got {brief(ds)} as number {number}")
        if "dea_maps_version" not in ds.attrs or "program" not in ds.attrs:
            raise ValueError(f"maps must be of a sweep or of trajectories; number {number} does not name its program")
    if not given:
        raise ValueError("maps must have at least one map; got none")
    attrs = _attributes(given)
    parts = _on_dimensions(given)
    dims = map(str, parts[0].dims)
    grid = {dim: np.unique(np.concatenate([ds[dim].values for ds in parts])) for dim in dims}
    arrays = {name: _joined(name, [ds.variables[name] for ds in parts], parts, grid) for name in parts[0].variables}
    coords = {name: arrays.pop(name) for name in parts[0].coords}
    return with_storage(xr.Dataset(arrays, coords, attrs))


def _attributes(maps: list[xr.Dataset]) -> dict[str, Any]:
    """Return the global attributes of all maps, which must agree."""
    first = maps[0].attrs
    for number, ds in enumerate(maps):
        for key in sorted((first.keys() | ds.attrs.keys()) - {*_JOINED, *_DROPPED}):
            _check_equal(f"the attribute {key}", first.get(key), ds.attrs.get(key), number)
    attrs = {key: value for key, value in first.items() if key not in _DROPPED}
    for key in _DROPPED:
        if key in first and all(ds.attrs.get(key) == first[key] for ds in maps):
            attrs[key] = first[key]
    for key in _JOINED:
        every = dict.fromkeys(str(ds.attrs[key]) for ds in maps if key in ds.attrs)
        if every:
            attrs[key] = ("\n" if key == "history" else ", ").join(every)
    attrs["history"] = f"{attrs.get('history', '')}\ndea_maps {__version__}: {len(maps)} maps merged".lstrip()
    return attrs


def _on_dimensions(maps: list[xr.Dataset]) -> list[xr.Dataset]:
    """Return maps with the same variables, on the same dimensions in the same order, each with a coordinate."""
    for number, ds in enumerate(maps):
        _check_equal("the variables", sorted(map(str, maps[0].variables)), sorted(map(str, ds.variables)), number)
        for dim in ds.dims:
            if dim not in ds.coords:
                raise ValueError(f"map {number} has the dimension {str(dim)!r} without a coordinate: assign it one")
    kinds: Mapping[str, str] = kinds_in(maps[0].coords, maps[0].attrs)
    numbers = [name for name in kinds if all(ds[name].ndim == 0 for ds in maps)]
    new = [name for name in numbers if not all(ds.variables[name].equals(maps[0].variables[name]) for ds in maps)]
    new += [name for name in kinds if name not in numbers and any(name in ds.dims for ds in maps)]
    spread = [_spread(ds, {name: si_name(name, kinds[name]) for name in new if ds[name].ndim == 0}) for ds in maps]
    dims = tuple(map(str, max(maps, key=lambda ds: len(ds.dims)).dims))
    dims += tuple(name for name in new if name not in dims)
    for number, ds in enumerate(spread):
        _check_equal("the dimensions", sorted(dims), sorted(map(str, ds.dims)), number)
    return [ds.transpose(*dims) for ds in spread]


def _spread(ds: xr.Dataset, numbers: Mapping[str, str | None]) -> xr.Dataset:
    """Return a map with further dimensions of one value, along which also lie their twins in SI units."""
    for name, twin in numbers.items():
        also = {twin: ds[twin].expand_dims(name)} if twin in ds.coords else {}
        ds = ds.expand_dims(name).assign_coords(also)
    return ds


def _joined(
    name: Any, variables: list[xr.Variable], parts: list[xr.Dataset], grid: Mapping[str, _Array]
) -> xr.Variable:
    """Return one variable on the whole grid."""
    first = variables[0]
    dims = tuple(map(str, first.dims))
    shape = tuple(grid[dim].size for dim in dims)
    values, known = np.zeros(shape, np.result_type(*(one.dtype for one in variables))), np.zeros(shape, np.bool_)
    for number, (one, ds) in enumerate(zip(variables, parts, strict=True)):
        _check_equal(f"the dimensions of {name}", dims, one.dims, number)
        if first.dtype.kind in "iuf":
            _check_equal(f"the type of {name}", first.dtype.name, one.dtype.name, number)
        for key in sorted(first.attrs.keys() | one.attrs.keys()):
            _check_equal(f"the attribute {key} of {name}", first.attrs.get(key), one.attrs.get(key), number)
        cells = np.ix_(*(np.searchsorted(grid[dim], ds[dim].values) for dim in dims)) if dims else ()
        found, before = np.asarray(one.values), values[cells]
        differ = known[cells] & (found != before)
        if found.dtype.kind == "f":
            differ &= ~(np.isnan(found) & np.isnan(before))
        if differ.any():
            where = {dim: ds[dim].values[at[0]] for dim, at in zip(dims, np.nonzero(differ), strict=True)}
            raise ValueError(f"the maps differ in {name}{_at(where)}, which map {number} shares with another one")
        values[cells], known[cells] = found, True
    if not known.all():
        where = {dim: grid[dim][at[0]] for dim, at in zip(dims, np.nonzero(~known), strict=True)}
        raise ValueError(
            f"the maps leave out {int((~known).sum()):,} of {known.size:,} cells of the grid that they span, "
            f"the first{_at(where)}: compute these too"
        )
    return xr.Variable(dims, values, dict(first.attrs))


def _at(where: Mapping[str, Any]) -> str:
    return f" at {', '.join(f'{name} = {value}' for name, value in where.items())}" if where else ""


def _check_equal(what: str, first: Any, other: Any, number: int) -> None:
    if not np.array_equal(np.asarray(first), np.asarray(other)):
        raise ValueError(f"maps must agree in {what}; got {brief(first)} in map 0 and {brief(other)} in map {number}")
