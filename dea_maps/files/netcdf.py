"""NetCDF files of the package: written whole, read back with a check that they are its own."""

import os

import xarray as xr

from ..atomic import PathLike, existing, replacing
from ..netcdf_lock import NETCDF_LOCK
from ..nomenclature import BREAKDOWN, VARIABLES


def check_netcdf_name(path: PathLike) -> None:
    """Check that NetCDF, which wants Unicode, can be told the name of a file.

    Raises
    ------
    ValueError
        If it is not UTF-8.
    """
    try:
        os.fsencode(path).decode()
    except UnicodeDecodeError:
        name = os.fsencode(path).decode(errors="backslashreplace")
        raise ValueError(f"the name of a NetCDF file must be UTF-8; got {name}") from None


def write_dataset(ds: xr.Dataset, path: PathLike) -> None:
    """Write a data set as NetCDF-4, replacing an old file only by the complete new one.

    Parameters
    ----------
    ds : Dataset
        What to write.
    path : str or path-like
        Where.

    Raises
    ------
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_dataset(xr.Dataset({"x": 1.0}), Path(folder, "x.nc"))
    ...     [file.name for file in Path(folder).iterdir()]
    ['x.nc']
    """
    with replacing(path) as temporary, NETCDF_LOCK:
        try:
            ds.to_netcdf(temporary, engine="netcdf4", format="NETCDF4")
        except RuntimeError as error:  # how netCDF4 reports what HDF5 could not do, such as filling a full disk
            raise OSError(f"cannot write {os.fspath(path)}: {error}") from error


def open_map(path: PathLike, *others: str) -> xr.Dataset:
    """Open the data set of a sweep, reading values only as they are used.

    Parameters
    ----------
    path : str or path-like
        A file written by a sweep, or of trajectories.
    *others : str
        Variables that the file may have instead of those of a map.

    Returns
    -------
    Dataset
        To be closed by the caller, as by a ``with`` block.

    Raises
    ------
    OSError
        If there is no such file, or it cannot be read.
    ValueError
        If it is not NetCDF, or not a map of this package.

    Examples
    --------
    >>> open_map("nowhere.nc")
    Traceback (most recent call last):
    ...
    FileNotFoundError: there is no file nowhere.nc
    """
    file = existing(path)
    if not file.is_file():
        raise OSError(f"{file} is not a file")
    check_netcdf_name(file)
    with file.open("rb") as stream:  # says so if it cannot be read, where netCDF would blame the format
        stream.read(1)
    try:
        with NETCDF_LOCK:
            ds = xr.open_dataset(file, engine="netcdf4", cache=False, lock=NETCDF_LOCK)
    except OSError:
        raise ValueError(f"{file} is not a NetCDF file") from None
    except Exception as error:  # as many kinds as there are kinds of damage
        raise ValueError(f"{file} is damaged: {' '.join(str(error).split())}") from None
    if "dea_maps_version" not in ds.attrs or not ds.keys() & {*VARIABLES, *BREAKDOWN, *others}:
        ds.close()
        raise ValueError(f"{file} is not a map: it does not hold the variables and attributes of a sweep")
    return ds
