"""Files: written beside and moved into place whole, read back with a check that they are ours."""

import os
import secrets
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import xarray as xr

from .nomenclature import BREAKDOWN, VARIABLES

PathLike = str | os.PathLike[str]


def check_writable(path: PathLike) -> None:
    """Check that a file can be written, before anything is computed for it.

    Parameters
    ----------
    path : str or path-like
        The file; its folder must exist.

    Raises
    ------
    OSError
        If the folder is absent or no folder, if no file can be made in it, or if `path` is itself a folder.

    Examples
    --------
    >>> check_writable("nowhere/map.nc")
    Traceback (most recent call last):
    ...
    FileNotFoundError: cannot write nowhere/map.nc: there is no folder nowhere
    """
    target = Path(path)
    folder = target.parent
    if target.is_dir():
        raise IsADirectoryError(f"cannot write {target}: it is a folder")
    if not folder.exists():
        raise FileNotFoundError(f"cannot write {target}: there is no folder {folder}")
    if not folder.is_dir():
        raise NotADirectoryError(f"cannot write {target}: {folder} is not a folder")
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise type(error)(f"cannot write {target}: {error.strerror} in the folder {folder}") from None


@contextmanager
def naming(path: PathLike) -> Iterator[None]:
    """Name the file in what the system says on writing it, as where the disk is full."""
    try:
        yield
    except OSError as error:
        if error.errno is None or error.strerror is None:  # names it already
            raise
        raise type(error)(f"cannot write {os.fspath(path)}: {error.strerror}") from error


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


def existing(path: PathLike) -> Path:
    """Return a file that is to be read, once it is known to be there and no folder.

    Raises
    ------
    OSError
        If it is not.

    Examples
    --------
    >>> existing("nowhere.toml")
    Traceback (most recent call last):
    ...
    FileNotFoundError: there is no file nowhere.toml
    """
    file = Path(path)
    if not file.exists():
        raise FileNotFoundError(f"there is no file {file}")
    if file.is_dir():
        raise IsADirectoryError(f"{file} is not a file")
    return file


def read_text(path: PathLike, kind: str) -> str:
    """Return the text of a file in UTF-8, without the byte-order mark that some editors put before it.

    Parameters
    ----------
    path : str or path-like
        The file.
    kind : str
        What it should be, for the message if it is not even text.

    Raises
    ------
    OSError
        If it is absent, a folder or cannot be read.
    ValueError
        If it is not in UTF-8.
    """
    file = existing(path)
    try:
        return file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"{file} is not {kind}: it is not text in UTF-8") from None
    except OSError as error:
        raise type(error)(f"cannot read {file}: {error.strerror}") from None


@contextmanager
def replacing(path: PathLike) -> Iterator[Path]:
    """Hand out a temporary file in the same folder that takes the place of `path` if all goes well.

    The bytes are on the disk before the name changes, so that `path` is only ever absent, the old file or the
    complete new one. Whatever goes wrong, an interrupt too, the temporary file is removed and the old file
    stays.

    Parameters
    ----------
    path : str or path-like
        The file to replace; a symbolic link is followed.

    Yields
    ------
    Path
        Where to write, with the same suffix.

    Raises
    ------
    OSError
        If the file cannot be written or moved.

    Examples
    --------
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with replacing(Path(folder, "note.txt")) as temporary:
    ...         _ = temporary.write_text("whole")
    ...     Path(folder, "note.txt").read_text()
    'whole'
    """
    target = Path(os.path.realpath(path))
    temporary = target.with_name(f".{target.stem}.{secrets.token_hex(4)}{target.suffix}")
    try:
        with naming(target):
            yield temporary
            sync(temporary)
            os.replace(temporary, target)
            if os.name == "posix":  # a folder cannot be opened elsewhere
                sync(target.parent)
    finally:
        temporary.unlink(missing_ok=True)


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
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_dataset(xr.Dataset({"x": 1.0}), Path(folder, "x.nc"))
    ...     [file.name for file in Path(folder).iterdir()]
    ['x.nc']
    """
    check_writable(path)
    with replacing(path) as temporary:
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
        ds = xr.open_dataset(file, engine="netcdf4", cache=False)
    except OSError:
        raise ValueError(f"{file} is not a NetCDF file") from None
    except Exception as error:  # as many kinds as there are kinds of damage
        raise ValueError(f"{file} is damaged: {' '.join(str(error).split())}") from None
    if "dea_maps_version" not in ds.attrs or not ds.keys() & {*VARIABLES, *BREAKDOWN, *others}:
        ds.close()
        raise ValueError(f"{file} is not a map: it does not hold the variables and attributes of a sweep")
    return ds


def sync(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
