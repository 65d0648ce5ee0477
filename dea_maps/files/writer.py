"""A NetCDF-4 map written part by part: what ``Dataset.to_netcdf`` would write, without all of it in memory."""

import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import h5py
import netCDF4
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..netcdf_lock import NETCDF_LOCK
from ..sweeps.chunks import Cut
from .checkpoints import WITHIN
from .digits import BITS, rounded
from .filters import filtered


class Storage(NamedTuple):
    """How the chunks of a variable are stored.

    Attributes
    ----------
    fill : scalar
        What the last chunk along a dimension is filled up with; its type is that of the variable.
    cells : int
        Of a chunk.
    filters : tuple of int
        As in `filtered`.
    bits : int or None
        As in `rounded`; None does not round.
    """

    fill: np.generic
    cells: int
    filters: tuple[int, ...]
    bits: int | None = None

    def chunks(self, values: NDArray[np.generic], places: Sequence[slice]) -> Sequence[bytes]:
        """Return what the file stores of values, chunk by chunk: in any thread."""
        return [self._chunk(values[place]) for place in places]

    def _chunk(self, values: NDArray[np.generic]) -> bytes:
        if self.bits is not None:
            values = rounded(values, self.bits)
        if values.size < self.cells:
            values = np.concatenate([values, np.full(self.cells - values.size, self.fill)])
        return filtered(values, self.filters)


class _Pattern(NamedTuple):
    """How a variable is written: what makes it, and its attributes."""

    options: dict[str, Any]
    attributes: dict[str, Any]


def _pattern(variable: "netCDF4.Variable[Any]") -> _Pattern:
    attributes = {key: variable.getncattr(key) for key in variable.ncattrs()}
    filters: dict[str, Any] = dict(variable.filters() or {})
    options = {kind: filters[kind] for kind in (("zlib", "shuffle", "fletcher32") if variable.ndim else ())}
    options |= {"varname": variable.name, "datatype": variable.dtype, "dimensions": variable.dimensions}
    return _Pattern({**options, "complevel": 1, "fill_value": attributes.pop("_FillValue", False)}, attributes)


class MapFile:
    """A file that has its dimensions, coordinates and attributes, and takes the chunks of its variables.

    netCDF4 makes it and closes it; h5py then puts the chunks into place as they are. All calls of one file must come
    from one thread.

    Parameters
    ----------
    path : Path
        The file to write; an old one is replaced.
    template : Dataset
        The map without its values: its variables may be views of a single number.
    names : sequence of str
        The variables whose values will come.
    chunks : Cut
        How these variables are cut into chunks within the file.

    Attributes
    ----------
    storage : dict of str to Storage
        Of these variables.

    Raises
    ------
    OSError
        If it cannot be written.
    """

    def __init__(self, path: Path, template: xr.Dataset, names: Sequence[str], chunks: Cut) -> None:
        self.path = path
        self._chunks = chunks
        path.unlink(missing_ok=True)
        with NETCDF_LOCK, self._named():
            patterns, own = self._patterns(template, names)
            template.drop_vars(names).to_netcdf(path, engine="netcdf4", format="NETCDF4")
            with netCDF4.Dataset(path, "a") as file:
                self._describe(file, template, patterns, own)
            self._file = h5py.File(path, "r+")
            self.storage = {name: _storage(self._file[name]) for name in names}
            self._stored = {name: self._file[name].id for name in names}

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Say in one line what the libraries could not do, such as filling a full disk."""
        try:
            yield
        except (OSError, RuntimeError) as error:
            number, text = getattr(error, "errno", None), " ".join(str(error).split())
            of_system = re.search("error message = '([^']+)'", text)  # as HDF5 quotes it
            words = os.strerror(number) if number and number > 0 else of_system[1] if of_system else text
            raise OSError(f"cannot write {self.path}: {words}") from error

    def _patterns(self, template: xr.Dataset, names: Sequence[str]) -> tuple[list[_Pattern], list[str]]:
        """Return how xarray writes the variables, and which attributes a file has, by a map of one cell."""
        one_cell = self.path.with_name(f"{self.path.name}.cell")
        try:
            template.isel({dim: slice(0, 1) for dim in template.dims}).to_netcdf(one_cell, engine="netcdf4")
            with netCDF4.Dataset(one_cell) as file:
                return [_pattern(file[name]) for name in names], file.ncattrs()
        finally:
            one_cell.unlink(missing_ok=True)

    def _describe(
        self, file: netCDF4.Dataset, template: xr.Dataset, patterns: list[_Pattern], attributes: list[str]
    ) -> None:
        """Make the dimensions and the variables."""
        file.set_auto_maskandscale(False)
        if "coordinates" in file.ncattrs() and "coordinates" not in attributes:
            file.delncattr("coordinates")
        for dim, size in template.sizes.items():
            if dim not in file.dimensions:
                file.createDimension(str(dim), size)
        for pattern in patterns:
            chunks = self._chunks.part_shape if pattern.options["dimensions"] else None
            file.createVariable(**pattern.options, chunksizes=chunks).setncatts(pattern.attributes)

    def write(self, numbers: Sequence[int], chunks: Mapping[str, Sequence[bytes]]) -> list[int]:
        """Write the chunks of a part.

        Parameters
        ----------
        numbers : sequence of int
            Which they are, of every variable.
        chunks : mapping of str to sequence of bytes
            What `storage` makes of the values.

        Returns
        -------
        list of int
            Where each is in the file, once the disk has it: not in the file's directory yet, which is written at the
            end. `WITHIN` where it cannot be said, as of chunks so small that HDF5 keeps room for several.
        """
        offsets = []
        with self._named(), self.path.open("r+b", buffering=0) as whole:
            for name, of_variable in chunks.items():
                for number, chunk in zip(numbers, of_variable, strict=True):
                    with NETCDF_LOCK:
                        self._put(self._stored[name], number, chunk)
                    offsets.append(_end(whole, chunk))
            os.fsync(whole.fileno())
        return offsets

    def _put(self, variable: h5py.h5d.DatasetID, number: int, chunk: bytes) -> None:
        dims = len(self._chunks.shape)
        if dims:
            start = [place.start if isinstance(place, slice) else int(place) for place in self._chunks.index(number)]
            variable.write_direct_chunk((*start, *[0] * (dims - len(start))), chunk)
        else:
            variable.write(h5py.h5s.ALL, h5py.h5s.ALL, np.frombuffer(chunk, variable.dtype))

    def close(self) -> None:
        """Write what is still in memory, the file's directory first of all."""
        with NETCDF_LOCK, self._named():
            self._file.close()


def _end(whole: BinaryIO, chunk: bytes) -> int:
    """Return the offset of a chunk that the file ends with."""
    offset = os.fstat(whole.fileno()).st_size - len(chunk)
    whole.seek(max(offset, 0))
    return offset if whole.read(len(chunk)) == chunk else WITHIN


def _storage(variable: h5py.Dataset) -> Storage:
    properties = variable.id.get_create_plist()
    filters = tuple(properties.get_filter(number)[0] for number in range(properties.get_nfilters()))
    bits = variable.attrs[BITS].item() if BITS in variable.attrs else None
    return Storage(variable.dtype.type(variable.fillvalue), math.prod(variable.chunks or ()), filters, bits)
