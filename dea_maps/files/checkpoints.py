"""Finished parts of a sweep, kept beside its file until the file is complete."""

import os
import re
import secrets
import warnings
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np
from filelock import FileLock, Timeout
from isal import isal_zlib
from numpy.typing import NDArray

from ..atomic import naming, sync

Chunks = Sequence[bytes]

WITHIN = -1
"""Offset of a chunk that is in the file of its part."""

_LOCK = "lock"
# An empty file that says whose the folder is: nothing is removed from one that does not have it.
_MARK = "parts-of-dea_maps"
WHOLE = "whole.nc"
"""Name of the map while it is put together."""
# What reading a damaged archive may end in.
_DAMAGE = (OSError, ValueError, EOFError, KeyError, NotImplementedError, RuntimeError, zipfile.BadZipFile)
_OWN = re.compile(rf"{_LOCK}|{_MARK}|\d{{6,}}\.npz|unfinished\.[0-9a-f]+|{re.escape(WHOLE)}(\.cell)?")


class _Record(NamedTuple):
    """What the file of a part says.

    Attributes
    ----------
    identity : str
        Of the sweep.
    number : int
        Of the part.
    sizes, checksums : ndarray
        Of the chunks.
    offsets : ndarray
        Where in the map the chunks are; `WITHIN`, if they are in this file.
    within : ndarray
        The chunks that are, one after the other.
    """

    identity: str
    number: int
    sizes: NDArray[np.int64]
    checksums: NDArray[np.uint32]
    offsets: NDArray[np.int64]
    within: NDArray[np.uint8]

    @property
    def placed(self) -> bool:
        """Whether some chunks are in the map."""
        return bool(np.any(self.offsets != WITHIN))

    def chunks(self, whole: BinaryIO | None) -> Chunks | None:
        """Return the chunks, those in the map read from it; None if one is not what it was."""
        found, start = [], 0
        for size, checksum, offset in zip(self.sizes, self.checksums, self.offsets, strict=True):
            if offset == WITHIN:
                found.append(self.within[start : start + size].tobytes())
                start += int(size)
            elif whole is None:
                return None
            else:
                whole.seek(offset)
                found.append(whole.read(size))
            if len(found[-1]) != size or isal_zlib.crc32(found[-1]) != checksum:
                return None
        return found


class Parts:
    """The folder ``<path>.parts`` of a sweep: one file a part, with the sweep's hash, its number and checksums.

    The chunks of a part are in the map that is put together, and its file says where, so that the disk holds them once.
    A map that is not complete is no HDF5 file; but what is at these places was on the disk before the file of the part
    was. The next run takes it back before it begins a map of its own, see `regain`. The file of a part is a NumPy
    archive, whose checksums NumPy verifies as it reads. It is written beside and renamed into place, on the disk before
    its name is.

    Parameters
    ----------
    folder : Path
        Where they are.
    identity : str
        Hash of everything that the chunks depend on.
    plain : str, optional
        The same of a sweep from whose chunks those of this one follow: its parts are read as well, see `load`.
    """

    def __init__(self, folder: Path, identity: str, plain: str | None = None) -> None:
        self.folder = folder
        self.identity = identity
        self.plain = plain

    def _knows(self, record: _Record) -> bool:
        return record.identity in {self.identity, self.plain}

    def _path(self, number: int) -> Path:
        return self.folder / f"{number:06d}.npz"

    def save(self, number: int, chunks: Chunks, offsets: Sequence[int], identity: str | None = None) -> None:
        """Write a finished part.

        Parameters
        ----------
        number : int
            Which.
        chunks : sequence of bytes
            As the map stores them.
        offsets : sequence of int
            Where in the map, and on the disk, they are; `WITHIN` puts them into the file of the part.
        identity : str, optional
            Of the plain sweep, if they are its.

        Raises
        ------
        OSError
            If it cannot be written; what was there before stays.
        """
        within = b"".join(chunk for chunk, offset in zip(chunks, offsets, strict=True) if offset == WITHIN)
        record = _Record(
            identity or self.identity,
            number,
            np.array([len(chunk) for chunk in chunks], np.int64),
            np.array([isal_zlib.crc32(chunk) for chunk in chunks], np.uint32),
            np.array(offsets, np.int64),
            np.frombuffer(within, np.uint8),
        )
        temporary = self.folder / f"unfinished.{secrets.token_hex(4)}"
        try:
            with naming(self._path(number)):
                with temporary.open("wb") as stream:
                    np.savez(stream, **record._asdict())
                    stream.flush()
                    os.fsync(stream.fileno())
                os.replace(temporary, self._path(number))
                sync(self.folder)
        finally:
            temporary.unlink(missing_ok=True)

    def regain(self) -> None:
        """Take the chunks that an interrupted run has put into the map out of it, the last ones first: it shrinks.

        Raises
        ------
        OSError
            If a part cannot be written; what was there before stays.
        """
        records = []
        for path in self.folder.glob("*.npz"):
            with suppress(*_DAMAGE):
                record = _read(path)
                if self._knows(record) and record.placed and path == self._path(record.number):
                    records.append(record)
        try:
            whole = (self.folder / WHOLE).open("r+b")
        except FileNotFoundError:  # it was complete, and is in its place
            for record in records:
                self._path(record.number).unlink()
            return
        with whole:
            for record in sorted(records, key=lambda record: int(record.offsets.max()), reverse=True):
                chunks = record.chunks(whole)
                if chunks is not None:  # else `load` says so
                    self.save(record.number, chunks, [WITHIN] * len(chunks), record.identity)
                    whole.truncate(int(record.offsets[record.offsets != WITHIN].min()))

    def load(self, number: int, count: int, plain: int = 0) -> tuple[Chunks, bool] | None:
        """Read a part that an earlier run finished, after `regain`.

        Parameters
        ----------
        number : int
            Which.
        count, plain : int
            Number of its chunks, and of those of the plain sweep.

        Returns
        -------
        (sequence of bytes, bool) or None
            The chunks, and whether they are those of the plain sweep. None where there is no part, and, with a warning
            that names the file, where it is not what it should be.
        """
        path = self._path(number)
        if not path.exists():
            return None
        fault = "damaged"
        with suppress(*_DAMAGE):
            record = _read(path)
            chunks = record.chunks(None)
            is_plain = record.identity == self.plain
            if not self._knows(record):
                fault = "of another sweep"
            elif chunks is not None and len(chunks) == (plain if is_plain else count) and record.number == number:
                return chunks, is_plain
        warnings.warn(f"the part {path} is {fault}: it is computed again", stacklevel=2)
        return None

    def finished(self) -> list[int]:
        """Return the numbers of the parts of this sweep that are there; whether they are sound shows on loading."""
        numbers = []
        for path in sorted(self.folder.glob("*.npz")):
            with suppress(*_DAMAGE):
                record = _read(path)
                if self._knows(record):
                    numbers.append(record.number)
        return numbers

    def count(self) -> int:
        """Return the number of parts that are there."""
        return len(list(self.folder.glob("*.npz")))

    def clear(self) -> None:
        """Remove all parts, and whatever an interrupted run left."""
        for path in self.folder.iterdir():
            if _OWN.fullmatch(path.name) and path.name not in {_LOCK, _MARK}:
                path.unlink()


def _read(path: Path) -> _Record:
    """Read the file of a part; one of another version is of another sweep."""
    with path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
        others = [archive.get(name, np.empty(0, np.int64)) for name in _Record._fields[2:]]
        return _Record(str(archive["identity"]), int(archive["number"]), *others)


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
def locked_parts(path: Path, identity: str, plain: str | None = None) -> Iterator[Parts]:
    """Open the parts of a file for this sweep alone; removed at the end, if all went well or none is there.

    Parameters
    ----------
    path : Path
        The file that is to be written.
    identity, plain : str
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
    parts = Parts(folder_of(path), identity, plain)
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
