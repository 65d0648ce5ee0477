"""The one lock for the libraries of NetCDF."""

import threading


class _NetcdfLock:
    """A reentrant lock that is pickled by its name: a data set that reads its values later carries it along."""

    def __init__(self) -> None:
        self._lock = threading.RLock()

    def acquire(self, blocking: bool = True) -> bool:
        """Wait for the lock, or try to have it."""
        return self._lock.acquire(blocking)

    def release(self) -> None:
        """Let another thread have it."""
        self._lock.release()

    def __enter__(self) -> None:
        self.acquire()

    def __exit__(self, *_: object) -> None:
        self.release()

    def __reduce__(self) -> str:
        return "NETCDF_LOCK"


NETCDF_LOCK = _NetcdfLock()
"""Held for every call into netCDF4 and HDF5, which are not thread-safe, not even on different files."""
