"""Finished parts of a sweep, kept beside its file until the file is complete."""

import os
import re
import secrets
import warnings
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock, Timeout
from numpy.typing import NDArray

from ..atomic import naming, sync

Arrays = Mapping[str, NDArray[np.generic]]

_LOCK = "lock"
# An empty file that says whose the folder is: nothing is removed from one that does not have it.
_MARK = "parts-of-dea_maps"
WHOLE = "whole.nc"
"""Name of the map while it is put together."""
_OWN = re.compile(rf"{_LOCK}|{_MARK}|\d{{6,}}\.npz|unfinished\.[0-9a-f]+|{re.escape(WHOLE)}(\.cell)?")


class Parts:
    """The folder ``<path>.parts`` of a sweep: one file a part, with the sweep's hash, its number and checksums.

    A part is a NumPy archive, whose checksums NumPy verifies as it reads. It is written beside and renamed into place,
    on the disk before its name is.

    Parameters
    ----------
    folder : Path
        Where they are.
    identity : str
        Hash of everything that the results of the sweep depend on.
    """

    def __init__(self, folder: Path, identity: str) -> None:
        self.folder = folder
        self.identity = identity

    def _path(self, number: int) -> Path:
        return self.folder / f"{number:06d}.npz"

    def save(self, number: int, arrays: Arrays) -> None:
        """Write a finished part.

        Raises
        ------
        OSError
            If it cannot be written; what was there before stays.
        """
        temporary = self.folder / f"unfinished.{secrets.token_hex(4)}"
        try:
            with naming(self._path(number)):
                with temporary.open("wb") as stream:
                    content: dict[str, Any] = {**arrays, "identity": self.identity, "number": np.int64(number)}
                    np.savez(stream, **content)
                    stream.flush()
                    os.fsync(stream.fileno())
                os.replace(temporary, self._path(number))
                sync(self.folder)
        finally:
            temporary.unlink(missing_ok=True)

    def load(self, number: int, expected: Mapping[str, tuple[np.dtype[np.generic], int]]) -> Arrays | None:
        """Read a part that an earlier run finished.

        Parameters
        ----------
        number : int
            Which.
        expected : mapping of str to (dtype, int)
            Type and number of cells of every variable.

        Returns
        -------
        mapping of str to ndarray, or None
            None where there is none, and, with a warning that names the file, where it is not what it should be.
        """
        path = self._path(number)
        if not path.exists():
            return None
        try:
            with path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
                arrays = {name: archive[name] for name in archive.files}
            fault = self._fault(number, arrays, expected)
        except (OSError, ValueError, EOFError, KeyError, NotImplementedError, RuntimeError, zipfile.BadZipFile):
            fault = "damaged"
        if fault is None:
            return {name: arrays[name] for name in expected}
        warnings.warn(f"the part {path} is {fault}: it is computed again", stacklevel=2)
        return None

    def _fault(
        self, number: int, arrays: Arrays, expected: Mapping[str, tuple[np.dtype[np.generic], int]]
    ) -> str | None:
        """Say what is wrong with the content of a part."""
        if str(arrays.get("identity")) != self.identity:
            return "of another sweep"
        shapes = {name: (array.dtype, array.size) for name, array in arrays.items()}
        wanted = {**expected, "identity": shapes["identity"], "number": (np.dtype(np.int64), 1)}
        return None if shapes == wanted and int(arrays["number"]) == number else "damaged"

    def finished(self) -> list[int]:
        """Return the numbers of the parts of this sweep that are there; whether they are sound shows on loading."""
        numbers = []
        for path in sorted(self.folder.glob("*.npz")):
            with suppress(OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile), np.load(path) as archive:
                if str(archive["identity"]) == self.identity:
                    numbers.append(int(archive["number"]))
        return numbers

    def count(self) -> int:
        """Return the number of parts that are there."""
        return len(list(self.folder.glob("*.npz")))

    def clear(self) -> None:
        """Remove all parts, and whatever an interrupted run left."""
        for path in self.folder.iterdir():
            if _OWN.fullmatch(path.name) and path.name not in {_LOCK, _MARK}:
                path.unlink()


def folder_of(path: Path) -> Path:
    """Return the folder of the parts of a file."""
    return path.with_name(f"{path.name}.parts")


def check_parts(path: Path) -> int:
    """Check that the folder of the parts of a file is the package's own, or not there.

    Parameters
    ----------
    path : Path
        The file that is to be written.

    Returns
    -------
    int
        Bytes of what is in it.

    Raises
    ------
    OSError
        If it is a link or no folder, or holds anything that no sweep has put there.
    """
    folder = folder_of(path)
    refused = f"cannot write {path}: {folder}, the place of its parts,"
    if folder.is_symlink():
        raise FileExistsError(f"{refused} is a link")
    try:
        with os.scandir(folder) as found:
            entries = sorted(found, key=lambda entry: entry.name)
    except FileNotFoundError:
        return 0
    except NotADirectoryError:
        raise NotADirectoryError(f"{refused} is not a folder") from None
    except OSError as error:
        raise type(error)(f"{refused} cannot be read: {error.strerror}") from None
    own = {entry.name for entry in entries} <= {_LOCK} or any(entry.name == _MARK for entry in entries)
    size = 0
    for entry in entries:
        if not (own and _OWN.fullmatch(entry.name)):
            raise FileExistsError(f"{refused} holds {entry.name!r}, which no sweep has put there")
        try:
            if not entry.is_file(follow_symlinks=False):
                raise FileExistsError(f"{refused} holds {entry.name!r}, which is not a file")
            size += entry.stat(follow_symlinks=False).st_size
        except FileNotFoundError:  # another sweep, which has just finished
            pass
    return size


@contextmanager
def locked_parts(path: Path, identity: str) -> Iterator[Parts]:
    """Open the parts of a file for this sweep alone; removed at the end, if all went well or none is there.

    Parameters
    ----------
    path : Path
        The file that is to be written.
    identity : str
        As in `Parts`.

    Yields
    ------
    Parts

    Raises
    ------
    OSError
        If another process, or another thread, is writing the same file, or the folder cannot be made or is not the
        package's own.
    """
    lock = _locked(path)
    parts = Parts(folder_of(path), identity)
    try:
        (parts.folder / _MARK).touch()
        yield parts
        parts.clear()
    finally:
        if parts.count() == 0:
            _remove(parts, lock)
        lock.release()


def _locked(path: Path) -> FileLock:
    """Lock the folder, made if need be; the end of the process unlocks it too."""
    check_parts(path)
    folder = folder_of(path)
    while True:
        folder.mkdir(exist_ok=True)
        lock = FileLock(folder / _LOCK, thread_local=False)
        try:
            lock.acquire(timeout=0)
            return lock
        except FileNotFoundError:  # another sweep has just finished, and removed the folder
            continue
        except Timeout:
            if (folder / _LOCK).exists():
                raise BlockingIOError(f"cannot write {path}: another sweep is writing it") from None


def _remove(parts: Parts, lock: FileLock) -> None:
    """Remove the folder; a file that is not the package's own keeps it."""
    parts.clear()
    (parts.folder / _MARK).unlink(missing_ok=True)
    try:
        # While it is locked: whoever holds the old file then knows that it is gone.
        (parts.folder / _LOCK).unlink()
    except PermissionError:  # a file that is open cannot be removed on every system
        lock.release()
        with suppress(OSError):
            (parts.folder / _LOCK).unlink()
    with suppress(OSError):
        parts.folder.rmdir()
