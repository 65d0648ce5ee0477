"""A NetCDF-4 map written part by part: what ``Dataset.to_netcdf`` would write, without all of it in memory."""

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..netcdf_lock import NETCDF_LOCK
from ..sweeps.chunks import Cut, Index


class MapFile:
    """A file that has its dimensions, coordinates and attributes, and takes the values of its variables.

    All calls of one file must come from one thread.

    Parameters
    ----------
    path : Path
        The file to write; an old one is replaced.
    template : Dataset
        The map without its values: its variables may be views of a single number.
    chunks : Cut
        How the variables are cut into chunks within the file.

    Raises
    ------
    OSError
        If it cannot be written.
    """

    def __init__(self, path: Path, template: xr.Dataset, chunks: Cut) -> None:
        self.path = path
        path.unlink(missing_ok=True)
        names = list(map(str, template.data_vars))
        # xarray writes the coordinates, and shows on a map of one cell how it would write the variables.
        one_cell = path.with_name(f"{path.name}.cell")
        try:
            with NETCDF_LOCK:
                template.drop_vars(names).to_netcdf(path, engine="netcdf4", format="NETCDF4")
                template.isel({dim: slice(0, 1) for dim in template.dims}).to_netcdf(one_cell, engine="netcdf4")
                self._file = netCDF4.Dataset(path, "a")
                with self._closed_on_errors(), netCDF4.Dataset(one_cell) as pattern:
                    self._describe(template, pattern, chunks)
        except RuntimeError as error:
            raise OSError(f"cannot write {path}: {error}") from error
        finally:
            one_cell.unlink(missing_ok=True)

    @contextmanager
    def _closed_on_errors(self) -> Iterator[None]:
        """Close the file if it cannot be made: the garbage collector would do so without the lock."""
        try:
            yield
        except BaseException:
            self._file.close()
            raise

    def _describe(self, template: xr.Dataset, pattern: netCDF4.Dataset, chunks: Cut) -> None:
        """Make the dimensions and the variables."""
        self._file.set_auto_maskandscale(False)
        if "coordinates" in self._file.ncattrs() and "coordinates" not in pattern.ncattrs():
            self._file.delncattr("coordinates")
        for dim, size in template.sizes.items():
            if dim not in self._file.dimensions:
                self._file.createDimension(str(dim), size)
        for name in map(str, template.data_vars):
            self._define(pattern[name], chunks)

    def _define(self, pattern: "netCDF4.Variable[Any]", chunks: Cut) -> None:
        """Make a variable like that of the map of one cell."""
        attributes = {key: pattern.getncattr(key) for key in pattern.ncattrs()}
        kinds = ("zlib", "shuffle", "fletcher32") if pattern.ndim else ()
        filters: dict[str, Any] = dict(pattern.filters() or {})
        storage = {kind: filters[kind] for kind in kinds}
        variable = self._file.createVariable(
            pattern.name,
            pattern.dtype,
            pattern.dimensions,
            **storage,
            complevel=1,
            chunksizes=chunks.part_shape if pattern.ndim else None,
            # Room for one chunk: parts bring whole ones, which are then compressed at once and not all at the end.
            chunk_cache=math.prod(chunks.part_shape) * pattern.dtype.itemsize,
            fill_value=attributes.pop("_FillValue", False),
        )
        variable.set_auto_maskandscale(False)
        variable.setncatts(attributes)

    def write(self, index: Index, arrays: Mapping[str, NDArray[np.generic]]) -> None:
        """Write the values of a part: where it is in the grid, and one array a variable, in the order of the cells."""
        try:
            with NETCDF_LOCK:
                for name, values in arrays.items():
                    variable = self._file[name]
                    variable[index if index else ...] = values.reshape(np.shape(_template(variable.shape)[index]))
        except RuntimeError as error:  # how netCDF4 reports what HDF5 could not do, such as filling a full disk
            raise OSError(f"cannot write {self.path}: {error}") from error

    def close(self) -> None:
        """Write what is still in memory."""
        try:
            with NETCDF_LOCK:
                self._file.close()
        except RuntimeError as error:
            raise OSError(f"cannot write {self.path}: {error}") from error


def _template(shape: tuple[int, ...]) -> NDArray[np.generic]:
    return np.broadcast_to(np.int8(0), shape)
