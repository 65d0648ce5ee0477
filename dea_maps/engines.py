"""What computes the parts of a sweep: threads of this process, or the workers of a Dask cluster."""

import os
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from .catalogue import Choice
from .cuts import Index
from .first_limit import solve_with_limits
from .grid import Grid
from .nomenclature import FLAGGED
from .parts import Arrays
from .programs import Program
from .solve import solve
from .strength import StrengthOf

ENGINES = ("threads", "dask")
# How often Dask tries a part again whose computing raised an error; a worker that dies counts apart, three times.
RETRIES = 2


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
    strength : callable or None
        The true field at which the film breaks down, over the relaxed critical field; None where it is not known.
    """

    program: Program
    parameters: dict[str, NDArray[np.float64]]
    shape: tuple[int, ...]
    choice: Choice
    variables: tuple[str, ...]
    dtype: str
    strength: StrengthOf | None = None


def task_of(grid: Grid, index: Index, choice: Choice, variables: tuple[str, ...], dtype: str) -> Task:
    """Return the task of a part, ``index`` being where it is in the grid."""
    views = {name: array[index] for name, array in grid.parameters.items()}
    shape = views["modulus_ratio"].shape
    compact = {
        name: view[tuple(slice(0, 1) if stride == 0 else slice(None) for stride in view.strides)]
        for name, view in views.items()
    }
    return Task(grid.program, compact, shape, choice, variables, dtype)


def compute(task: Task, on_cells: Callable[[int], object] | None = None, threads: int | None = None) -> Arrays:
    """Compute a part: one array a variable, in the order of the cells."""
    parameters = {name: np.broadcast_to(array, task.shape) for name, array in task.parameters.items()}
    use: dict[str, Any] = {"on_cells": on_cells, "threads": threads}
    found: dict[str, NDArray[Any]]
    if task.strength is None:
        found = solve(task.program, parameters, task.choice, **use)._asdict()
    else:
        found = solve_with_limits(task.program, parameters, task.choice, task.strength, **use)
    kinds = {name: np.int8 if name in FLAGGED else np.dtype(task.dtype) for name in task.variables}
    return {name: found[name].ravel().astype(kind, copy=False) for name, kind in kinds.items()}


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
        """Nothing is left to be closed."""


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
    ValueError
        If Dask is not installed.
    OSError
        If there is no scheduler at the address.
    """

    def __init__(self, scheduler: str | None, on_cells: Callable[[int], object]) -> None:
        try:
            from distributed import Client, LocalCluster
        except ImportError:
            raise ValueError(
                "engine 'dask' needs Dask, which comes with: pip install 'dea-maps[distributed]'"
            ) from None
        self._cluster: Any = None
        if scheduler is None:
            # Processes, not threads: the death of one must not be that of the sweep.
            self._cluster = LocalCluster(n_workers=os.cpu_count() or 1, threads_per_worker=1, dashboard_address=None)
        self._client = Client(self._cluster if scheduler is None else scheduler, timeout=10)
        self._on_cells = on_cells
        self.ahead = 2 * max(1, sum(self._client.nthreads().values()))

    def submit(self, task: Task) -> Pending:
        """Send a part to the cluster."""
        future = self._client.submit(compute, task, threads=1, pure=False, retries=RETRIES)
        return Later(partial(self._finished, future))

    def _finished(self, future: Any) -> Arrays:
        arrays: Arrays = future.result()
        self._on_cells(next(iter(arrays.values())).size)
        return arrays

    def close(self) -> None:
        """Leave the cluster; stop it, if it was started here."""
        self._client.close()
        if self._cluster is not None:
            self._cluster.close()
