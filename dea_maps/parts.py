"""Finished parts of a sweep, kept beside its file until the file is complete."""

import os
import secrets
import warnings
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .storage import naming, sync

Arrays = Mapping[str, NDArray[np.generic]]

_LOCK = "lock"


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
                    content = {**arrays, "identity": np.array(self.identity), "number": np.array(number)}
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
            if path.name != _LOCK:
                path.unlink()


def folder_of(path: Path) -> Path:
    """Return the folder of the parts of a file."""
    return path.with_name(f"{path.name}.parts")


@contextmanager
def locked_parts(path: Path, identity: str) -> Iterator[Parts]:
    """Open the parts of a file for this process alone; removed at the end, if all went well or none is there.

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
        If another process, or another thread, is writing the same file, or the folder cannot be made.
    """
    folder = folder_of(path)
    lock = _lock(folder, path)
    parts = Parts(folder, identity)
    try:
        yield parts
        parts.clear()
    finally:
        if parts.count() == 0:
            (folder / _LOCK).unlink()
            folder.rmdir()
        os.close(lock)


def _lock(folder: Path, path: Path) -> int:
    """Lock the folder, made if need be; closing the descriptor unlocks it, and so does the end of the process."""
    import fcntl  # of POSIX only, like the file systems on which renaming replaces

    while True:
        folder.mkdir(exist_ok=True)
        try:
            descriptor = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT, 0o644)
        except FileNotFoundError:  # another process has just finished, and removed the folder
            continue
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(descriptor)
            raise BlockingIOError(f"cannot write {path}: another sweep is writing it") from None
        try:
            if os.path.samestat(os.stat(folder / _LOCK), os.fstat(descriptor)):
                return descriptor
        except FileNotFoundError:
            pass
        os.close(descriptor)
