"""Machine code on disk: in a cache folder of the user, found by later processes, never by other sources."""

import hashlib
import os
import pickle
import re
import shutil
import uuid
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache, cached_property
from pathlib import Path
from sys import implementation
from types import CodeType, FunctionType
from typing import Any

import numba
import platformdirs
from filelock import FileLock
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

# Versions of the sources whose machine code stays on disk: those used last. A process that finds its own gone compiles.
KEPT = 4

# Seconds that a process waits for another to compile the same kernel, which takes 5 to 20; then it compiles on its own.
LONGEST_WAIT = 120.0

_CHECKSUM = hashlib.sha256
_FOLDER_OF_A_VERSION = re.compile("[0-9a-f]{16}")


class MachineCode:
    """What Numba asks for the machine code of a kernel, in place of its own cache, whose two calls it answers.

    Numba's lies beside the sources, does not know what else a kernel was compiled from, and raises when a file cannot
    be read or written. Here a kernel has one file, with a checksum, in a folder of its version of the sources; without
    the right or the room to write there it is compiled in every process, with a warning.

    Parameters
    ----------
    function : callable
        What is compiled; what it closes over decides on the name of the file.
    fingerprint : str
        Of all sources that it may have been compiled from, 16 hexadecimal digits.
    """

    def __init__(self, function: Any, fingerprint: str) -> None:
        self._function = function
        chosen = numba.config.CACHE_DIR  # the environment variable NUMBA_CACHE_DIR
        versions = Path(chosen, "dea_maps") if chosen else platformdirs.user_cache_path("dea_maps", appauthor=False)
        self._folder = versions / fingerprint

    @cached_property
    def _identity(self) -> bytes:
        """What tells a kernel from others of the same sources: its code, and the functions that it was made from."""
        return repr(_content(self._function)).encode()

    def _path(self, signature: str, target: Any) -> Path:
        """File of the code for some types of arguments, a processor, and the versions of Python and Numba."""
        made_by = (signature, target.codegen().magic_tuple(), implementation.cache_tag, numba.__version__)
        digest = _CHECKSUM(repr(made_by).encode() + self._identity).hexdigest()
        return self._folder / f"{self._function.__name__}-{digest[:32]}.nbc"

    def holds(self, signature: str, target: Any) -> bool:
        """Return whether the code is there, and undamaged."""
        return _read(self._path(signature, target)) is not None

    @contextmanager
    def one_at_a_time(self, signature: str, target: Any) -> Iterator[None]:
        """Wait while another process compiles the kernel: it is then there to be loaded.

        Where no lock can be had every process compiles, as it does where nothing can be kept.
        """
        lock = None
        if not self.holds(signature, target):
            path = self._path(signature, target).with_suffix(".lock")
            with suppress(OSError, NotImplementedError):  # no right to write, no locks on that file system, a timeout
                self._folder.mkdir(parents=True, exist_ok=True)
                lock = FileLock(path)
                lock.acquire(timeout=LONGEST_WAIT)
        try:
            yield
        finally:
            if lock is not None and lock.is_locked:
                with suppress(OSError):  # an open file stays on Windows; those who wait for this one look again
                    path.unlink()
                lock.release()

    def load_overload(self, signature: str, target: Any) -> CompileResult | None:
        """Return the code, None if it is not there or damaged."""
        target.refresh()
        path = self._path(signature, target)
        content = _read(path)
        if content is None:
            if path.exists():
                _warn_once(f"unusable machine code in {self._folder}: compiled again")
            return None
        with suppress(OSError):  # a folder that others wrote can be read all the same
            os.utime(self._folder)
        return CompileResult._rebuild(target, *pickle.loads(content))

    def save_overload(self, signature: str, code: CompileResult) -> None:
        """Keep the code for later processes, if that is possible."""
        if code.library.has_dynamic_globals:  # addresses of this process
            return
        content = dumps(code._reduce())
        path = self._path(signature, code.target_context)
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            self._remove_old_versions()
            _write(path, _CHECKSUM(content).digest() + content)
        except OSError as error:
            reason = error.strerror or error
            _warn_once(f"machine code cannot be kept in {self._folder} ({reason}): every process compiles it again")

    def _remove_old_versions(self) -> None:
        """Remove the folders of other sources, but for those used last."""
        used = {}
        for folder in self._folder.parent.iterdir():
            if _FOLDER_OF_A_VERSION.fullmatch(folder.name) and folder != self._folder:
                with suppress(FileNotFoundError):  # another process removes them as well
                    used[folder] = folder.stat().st_mtime
        for folder in sorted(used, key=used.__getitem__, reverse=True)[KEPT - 1 :]:
            shutil.rmtree(folder, ignore_errors=True)


def _content(value: Any) -> Any:
    """Return what a function computes with, as nested tuples of plain values.

    Not its pickle, which depends on the folder of the sources, and on whether Python compiled them in this process or
    read them from its own cache: a second process would then compile the kernel again.
    """
    if isinstance(value, FunctionType):
        cells = [_content(cell.cell_contents) for cell in value.__closure__ or ()]
        return value.__module__, value.__qualname__, _content(value.__code__), cells, _content(value.__defaults__)
    if isinstance(value, CodeType):
        return value.co_code, value.co_names, [_content(constant) for constant in value.co_consts]
    if isinstance(value, tuple | list):
        return [_content(item) for item in value]
    return value if value is None or isinstance(value, bool | int | float | str | bytes) else dumps(value)


def _read(path: Path) -> bytes | None:
    """Return what `_write` was given without its checksum; None if that is not there."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    size = _CHECKSUM().digest_size
    return content[size:] if _CHECKSUM(content[size:]).digest() == content[:size] else None


def _write(path: Path, content: bytes) -> None:
    """Write a file that other processes see whole or not at all."""
    temporary = path.with_name(f"{path.name}.{uuid.uuid4().hex}")
    try:
        temporary.write_bytes(content)
        os.replace(temporary, path)
    except OSError:
        with suppress(OSError):
            temporary.unlink()
        raise


@cache
def _warn_once(message: str) -> None:
    warnings.warn(message, stacklevel=2)
