"""What computes the parts of a sweep: threads of this process, or the workers of a Dask cluster."""

import asyncio
import logging
import os
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from .. import __version__
from ..checks import brief
from ..limits.breakdown import solve_with_limits
from ..materials.strength import StrengthOf
from ..nomenclature import FLAGGED
from ..programs import Program
from ..sweeps.chunks import Index
from ..sweeps.grid import Grid
from ..sweeps.methods import Choice
from ..sweeps.product import Product, product_of
from ..sweeps.solve import KERNELS, forget_product, solve

Arrays = Mapping[str, NDArray[np.generic]]

ENGINES = ("threads", "dask")
# How often Dask tries a part again whose computing raised an error; where a worker ends unexpectedly, three times.
RETRIES = 2
# Seconds that a scheduler has to answer, and that a cluster without workers has to get one.
ANSWER = 5.0
ARRIVAL = 8.0
# Seconds that a finished part, of some 20 MB, may take to arrive.
TRANSFER = 60.0
CODE = f"dea_maps {__version__} with the kernels {KERNELS}"
"""What computes in this process."""


class Task(NamedTuple):
    """A part to be computed, small enough to be sent to another machine.

    Attributes
    ----------
    program : Program
        The loading program.
    parameters : dict of str to ndarray
        Of the part; of length 1 along the dimensions on which they do not depend.
    shape : tuple of int
        Of the part.
    choice : Choice
        How it is solved.
    variables : tuple of str
        What is kept.
    dtype : str
        What the maps are rounded to in the end.
    code : str
        `CODE` of the process that asks: its provenance is that of the results.
    product : Product or None
        What the part is of a product grid, if `choice` is shared.
    strength : callable or None
        The true field at which the film breaks down, normalised by the relaxed critical field; None where it is
        unknown.
    """

    program: Program
    parameters: dict[str, NDArray[np.float64]]
    shape: tuple[int, ...]
    choice: Choice
    variables: tuple[str, ...]
    dtype: str
    code: str
    product: Product | None = None
    strength: StrengthOf | None = None


def task_of(grid: Grid, index: Index, choice: Choice, variables: tuple[str, ...], dtype: str) -> Task:
    """Return the task of a part, ``index`` being where it is in the grid."""
    views = {name: array[index] for name, array in grid.parameters.items()}
    shape = views["modulus_ratio"].shape
    compact = {
        name: view[tuple(slice(0, 1) if stride == 0 else slice(None) for stride in view.strides)]
        for name, view in views.items()
    }
    product = product_of(grid.program, grid.parameters, index) if choice.shared else None
    return Task(grid.program, compact, shape, choice, variables, dtype, CODE, product)


def compute(task: Task, on_cells: Callable[[int], object] | None = None, threads: int | None = None) -> Arrays:
    """Compute a part: one array a variable, in the order of the cells; for a process that runs the same code."""
    _check_code(CODE, task.code)
    parameters = {name: np.broadcast_to(array, task.shape) for name, array in task.parameters.items()}
    use: dict[str, Any] = {"on_cells": on_cells, "threads": threads}
    found: dict[str, NDArray[Any]]
    if task.strength is None:
        found = solve(
            task.program, parameters, task.choice, product=task.product, wanted=task.variables, dtype=task.dtype, **use
        ).by_name()
    else:
        found = solve_with_limits(task.program, parameters, task.choice, task.strength, **use)
    kinds = {name: np.int8 if name in FLAGGED else np.dtype(task.dtype) for name in task.variables}
    return {name: found[name].ravel().astype(kind, copy=False) for name, kind in kinds.items()}


def _check_code(of_worker: str, own: str) -> None:
    if of_worker != own:
        raise OSError(f"a Dask worker has {of_worker}, this process {own}: both must be the same")


def check_dask(scheduler: str | None) -> None:
    """Check that Dask is installed, and the form of the address of a scheduler.

    Raises
    ------
    TypeError, ValueError
        If not.
    """
    try:
        import distributed.comm.addressing
    except ImportError:
        raise ValueError("engine 'dask' needs Dask, which comes with: pip install 'dea-maps[distributed]'") from None
    if scheduler is None:
        return
    refusal = f"scheduler must be the address of a Dask scheduler, as 'tcp://host:8786'; got {brief(scheduler)}"
    if not isinstance(scheduler, str):
        raise TypeError(refusal)
    try:
        host, port = distributed.comm.addressing.get_address_host_port(scheduler)
    except ValueError:
        raise ValueError(refusal) from None
    if not host or host.split() != [host] or not 0 < port < 2**16:
        raise ValueError(refusal)


class Pending(Protocol):
    """A part that is being computed, or will be when it is asked for."""

    def result(self) -> Arrays:
        """Return the part when it is finished."""


class Later(NamedTuple):
    """A part that is computed when it is asked for."""

    call: Callable[[], Arrays]

    def result(self) -> Arrays:
        """Compute it."""
        return self.call()


class Threads:
    """One part after the other, each on all threads."""

    ahead = 0

    def __init__(self, on_cells: Callable[[int], object]) -> None:
        self._on_cells = on_cells

    def submit(self, task: Task) -> Pending:
        """Plan a part."""
        return Later(partial(compute, task, self._on_cells))

    def close(self) -> None:
        """Free what parts had in common."""
        forget_product()


class Dask:
    """Parts side by side on the workers of a cluster, each on one thread.

    Parameters
    ----------
    scheduler : str or None
        Its address; None starts a cluster on this machine, a worker a core.
    on_cells : callable
        Told the number of cells of every finished part.

    Raises
    ------
    OSError
        If there is no scheduler at the address, or one without workers, or a worker that runs other code.

    Warns
    -----
    UserWarning
        While a worker is waited for.
    """

    def __init__(self, scheduler: str | None, on_cells: Callable[[int], object]) -> None:
        from distributed import Client, LocalCluster

        self._on_cells = on_cells
        # What its client would say on several lines when the scheduler is lost is said here on one.
        self._logger = logging.getLogger("distributed.client")
        self._level = self._logger.level
        self._logger.setLevel(logging.CRITICAL)
        self._client: Any = None
        self._cluster: Any = None
        self._name = "on this machine" if scheduler is None else f"at {scheduler}"
        try:
            if scheduler is None:
                # Processes, not threads: the death of one must not be that of the sweep.
                workers = os.cpu_count() or 1
                self._cluster = LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None)
            else:
                self._knock(scheduler)
            with self._in_touch("does not answer"):
                self._client = Client(self._cluster or scheduler, timeout=ANSWER)
            self._wait_for_worker()
            with self._in_touch("was lost"):
                codes = self._client.run(_code_of_worker())
            for code in codes.values():
                _check_code(code, CODE)
            self.ahead = 2 * max(1, sum(self._threads().values()))
        except BaseException:
            self.close()
            raise

    def _knock(self, scheduler: str) -> None:
        """Check that what answers at the address is Dask: a client would wait for anything else without end."""
        from distributed.comm.core import connect

        async def knock() -> None:
            comm = await asyncio.wait_for(connect(scheduler, timeout=ANSWER), ANSWER)
            comm.abort()

        # In a thread of its own: this one may have an event loop, as in a notebook.
        with self._in_touch("does not answer"), ThreadPoolExecutor(1) as thread:
            thread.submit(lambda: asyncio.run(knock())).result()

    @contextmanager
    def _in_touch(self, trouble: str) -> Iterator[None]:
        """Say in one line what is wrong with the scheduler."""
        try:
            yield
        except (Exception, asyncio.CancelledError) as error:
            # Bytes that are not of Dask end in any error, one of memory among them.
            raise OSError(f"the Dask scheduler {self._name} {trouble} ({type(error).__name__})") from error

    def _threads(self) -> dict[str, int]:
        """Return the threads of every worker."""
        with self._in_touch("was lost"):
            found: dict[str, int] = self._client.sync(self._client.scheduler.ncores, callback_timeout=ANSWER)
            return found

    def _wait_for_worker(self) -> None:
        """Wait until there is a worker, for a while."""
        end = time.monotonic() + ARRIVAL
        is_said = False
        while not self._threads():
            if not is_said:
                warnings.warn(f"the Dask scheduler {self._name} has no workers: waiting for one", stacklevel=2)
                is_said = True
            if time.monotonic() > end:
                raise OSError(f"the Dask scheduler {self._name} has no workers, after {ARRIVAL:g} s")
            time.sleep(0.1)

    def submit(self, task: Task) -> Pending:
        """Send a part to the cluster."""
        with self._in_touch("was lost"):
            future = self._client.submit(compute, task, threads=1, pure=False, retries=RETRIES)
        return Later(partial(self._finished, future))

    def _finished(self, future: Any) -> Arrays:
        from distributed import wait

        while future.status == "pending":
            try:
                with self._in_touch("was lost"):
                    wait(future, timeout=1.0)
            except OSError as error:
                if not isinstance(error.__cause__, TimeoutError):
                    raise
                self._wait_for_worker()  # not finished: there may be nobody to finish it
        if future.status == "error":
            raise future.exception()
        with self._in_touch("was lost"):
            arrays: Arrays = future.result(timeout=TRANSFER)
        self._on_cells(next(iter(arrays.values())).size)
        return arrays

    def close(self) -> None:
        """Leave the cluster; stop it, if it was started here."""
        if self._client is not None:
            with suppress(Exception):  # closing fails where the scheduler is lost
                self._client.close(timeout=1.0)
        if self._cluster is not None:
            self._cluster.close()
        self._logger.setLevel(self._level)


def _code_of_worker() -> Callable[[], str]:
    """Return a function that is sent whole, so that a worker without this package can say so."""

    def code() -> str:
        try:
            from dea_maps.files.engines import CODE
        except ImportError as error:
            return f"no dea_maps ({error})"
        return CODE

    return code
