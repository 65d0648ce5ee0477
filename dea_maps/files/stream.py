"""A sweep to a file, part by part: what is finished survives whatever ends the run."""

import hashlib
import math
import os
import pickle
import secrets
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import netCDF4
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..atomic import move_into_place, naming
from ..limits.breakdown import rtol_of, solve_with_limits, with_limits
from ..materials.si_units import Film, in_si
from ..materials.strength import StrengthOf
from ..materials.toml import PowerLaw
from ..nomenclature import BREAKDOWN, FLAGGED
from ..programs import shape_of
from ..sweeps.chunks import Blocks, Cut, blocks, cut
from ..sweeps.dataset import LIMIT_BYTES, cell_bytes, make_dataset, provenance_of, reduced
from ..sweeps.grid import Grid
from ..sweeps.methods import Choice
from ..sweeps.product import product_of
from ..sweeps.solve import KERNELS, Solution, default_threads, product_bytes, solve
from .checkpoints import WHOLE, Chunks, Parts, folder_of, locked_parts
from .digits import described
from .engines import Arrays, Dask, Pending, Task, Threads, task_of
from .filters import restored
from .writer import MapFile

# Cells of a part: at a million a second it takes less than a second, so an interrupt or a crash costs little; and it is
# large enough for the disk. Five results of each are below 32 MiB, so that the next part has their memory again. Cells
# of a product grid are computed a hundred times as fast, each result in memory of its own; more of them share more.
PART_CELLS, SHARING_PART_CELLS = 750_000, 2_000_000
# Cells of a chunk within the file: half a megabyte of float64.
CHUNK_CELLS = 65_536
# Cells solved to estimate how long a sweep takes; of films that may break down, whose root finding takes longest.
SAMPLE, SAMPLE_LIMITED = 2000, 100
# Rates and modulus ratios of a product grid; of fields as many as of cells.
SAMPLE_SHARING = 10
# Parts in memory at once: being computed, converted, compressed, written, and waiting for that.
PARTS_IN_MEMORY = 8
# Parts that may wait to be compressed and written before the computing does.
WAITING = 4


@dataclass(frozen=True, eq=False)
class Plan:
    """All that a sweep to a file is.

    Attributes
    ----------
    path : Path
        The file.
    grid : Grid
        The cells.
    choice : Choice
        How they are solved.
    variables : tuple of str
        What is kept.
    dtype : str
        What the maps are stored as.
    chunks, parts : Cut
        Of the grid: within the file, and for computing.
    film : Film or None
        The film whose volts and seconds are added.
    engine, scheduler : str
        What computes, as in `dea_maps.sweep_to_netcdf`.
    divided : bool
        Whether each part of a product grid is computed as a grid of its own: with the same results, but what it has in
        common with other parts is computed again.
    digits : {"auto"} or None
        As in `dea_maps.sweep_to_netcdf`.
    """

    path: Path
    grid: Grid
    choice: Choice
    variables: tuple[str, ...]
    dtype: str
    chunks: Cut
    parts: Blocks
    film: Film | None
    engine: str = "threads"
    scheduler: str | None = None
    divided: bool = False
    digits: str | None = None

    @property
    def strength(self) -> StrengthOf | None:
        """The true field at which the film breaks down, normalised by the relaxed critical field, if it is known."""
        return self.film.material.strength if self.film is not None and self.film.limited else None

    def template(self) -> xr.Dataset:
        """Return the file without the values of its maps: views of single numbers."""
        whole = self.maps()
        return whole if self.digits is None or self.choice.rtol is None else described(whole, self.choice.rtol)

    def maps(self) -> xr.Dataset:
        """Return the maps without their values: views of single numbers."""
        none = {
            name: np.broadcast_to(np.zeros((), kind), self.grid.shape)
            for name, kind in _kinds((*self.grid.program.results, *BREAKDOWN), self.dtype).items()
        }
        solution = Solution(**{name: none[name] for name in self.grid.program.results})
        whole = make_dataset(self.grid, solution, provenance_of(self.choice))
        if self.strength is not None:
            limits = {name: none[name] for name in BREAKDOWN}
            whole = with_limits(whole, self.grid.dims, limits, rtol_of(self.choice))
        kept = reduced(whole, list(self.variables), self.dtype)
        if self.film is None:
            return kept
        made = in_si(kept.drop_vars(self.variables), *self.film)
        pattern = in_si(kept.isel({dim: slice(0, 1) for dim in kept.dims}), *self.film)
        made.attrs = pattern.attrs
        for name, array in pattern.data_vars.items():
            values = np.broadcast_to(np.zeros((), array.dtype), self.grid.shape)
            made[name] = (self.grid.dims, values, array.attrs)
            made[name].encoding = array.encoding
        return made

    def stored(self, number: int, arrays: Arrays) -> Arrays:
        """Return what the file stores of the values of a part: also in SI units, if there is a film."""
        if self.film is None:
            return arrays
        part = xr.Dataset({name: ("cell", values) for name, values in arrays.items()})
        if "prestretch" in self.grid.parameters:  # from which strains count
            prestretch = self.grid.parameters["prestretch"][self.parts.index(number)]
            part = part.assign_coords(prestretch=("cell", prestretch.ravel()))
        part = in_si(part, *self.film)
        return {str(name): array.values for name, array in part.data_vars.items()}

    def task(self, number: int) -> Task:
        """Return a part as something to be computed."""
        task = task_of(self.grid, self.parts.index(number), self.choice, self.variables, self.dtype)
        if self.divided and task.product is not None:
            task = task._replace(product=task.product.alone())
        return task if self.strength is None else task._replace(strength=self.strength)

    def identities(self) -> tuple[str, str | None]:
        """Return the hash of the parts, and that of parts without SI units from whose values these follow."""
        follows = self.film is not None and not self.film.limited and self.digits is None
        return self.identity(), replace(self, film=None).identity() if follows else None

    def identity(self) -> str:
        """Return a hash of everything that the parts depend on: what is asked, and the code that answers."""
        digest = hashlib.sha256()
        digest.update(pickle.dumps(self.grid.program))  # of a long waveform, repr would show some samples
        known = (self.grid.dims, self.grid.shape, self.choice, self.variables, self.dtype, self.digits)
        stored = (self.parts, self.chunks, netCDF4.__netcdf4libversion__, self._film())
        digest.update(repr((*known, *stored, KERNELS, *self._limit())).encode())
        for name, array in self.grid.parameters.items():
            own = array[tuple(slice(0, 1) if stride == 0 else slice(None) for stride in array.strides)]
            digest.update(repr((name, own.shape)).encode() + np.ascontiguousarray(own).tobytes())
        return digest.hexdigest()

    def _film(self) -> Film | None:
        """Return what the SI units depend on."""
        if self.film is None:
            return None
        numbers = replace(self.film.material, name="", source="", breakdown_strength=None)
        return self.film._replace(material=numbers)

    def _limit(self) -> tuple[object, ...]:
        """Return what the breakdown depends on; a function has no name that says what it returns, today and later."""
        if self.film is None or not self.film.limited:
            return ()
        known = self.film.material.breakdown_strength
        same = not callable(known) or isinstance(known, PowerLaw)
        return (known if same else secrets.token_hex(16), self.film.material.critical_field)


def make_plan(
    path: Path,
    grid: Grid,
    choice: Choice,
    variables: tuple[str, ...],
    dtype: str,
    memory: int,
    film: Film | None = None,
    engine: str = "threads",
    scheduler: str | None = None,
    digits: str | None = None,
) -> Plan:
    """Cut a sweep to a file into parts that fit in memory, and the file into chunks that fit the parts."""
    limited = film is not None and film.limited
    bytes_of_cell = cell_bytes(grid.program) * (1 if film is None else 2) + (3 * LIMIT_BYTES if limited else 0)
    most = max(1, memory // (PARTS_IN_MEMORY * bytes_of_cell))
    chunks = cut(grid.shape, min(CHUNK_CELLS, most))
    # A film that breaks down takes a thousand times as long as others: a part is a chunk, half a minute's work.
    product = product_of(grid.program, grid.parameters) if choice.shared else None
    part_cells = PART_CELLS if product is None else SHARING_PART_CELLS
    part_cells = min(part_cells, math.prod(chunks.part_shape)) if limited else part_cells
    divided = product is not None and product_bytes(product, choice.rtol or 0.0) > memory // 2
    # The series of a product grid are those of pairs of rate and modulus ratio: a part has many fields for each.
    wide = None if product is None else _dimension_of_field(grid)
    parts = blocks(chunks, min(part_cells, most), wide)
    return Plan(path, grid, choice, variables, dtype, chunks, parts, film, engine, scheduler, divided, digits)


def _dimension_of_field(grid: Grid) -> int | None:
    """Return the dimension of a product grid along which the field varies."""
    shape = shape_of(grid.program)
    assert shape is not None  # of a ramp and a hold
    strides = grid.parameters[str(shape.field)].strides
    return next((dim for dim, stride in enumerate(strides) if stride), None)


def finished_parts(plan: Plan) -> list[int]:
    """Return the numbers of the parts that an interrupted run of the same sweep finished."""
    return Parts(folder_of(Path(os.path.realpath(plan.path))), *plan.identities()).finished()


def estimated_seconds(plan: Plan) -> tuple[float, float]:
    """Return how long this machine computes all cells, and how long it takes to start, from cells of the grid."""
    sample = _sample(plan)
    number = sample["modulus_ratio"].size
    seconds = []
    for _ in range(2):  # the first time also compiles, or reads the machine code
        start = time.perf_counter()
        if plan.strength is None:
            solve(plan.grid.program, sample, plan.choice, threads=1)
        else:
            solve_with_limits(plan.grid.program, sample, plan.choice, plan.strength)
        seconds.append(time.perf_counter() - start)
    threads = default_threads() if plan.strength is None else 1  # the breakdown is found on all of them already
    return min(seconds) / number * plan.grid.cells / threads, seconds[0] - min(seconds)


def _sample(plan: Plan) -> dict[str, NDArray[np.float64]]:
    """Return some cells of the grid; of a product grid, the product of some values."""
    parameters = plan.grid.parameters
    if plan.choice.shared and plan.strength is None:
        of_field = _dimension_of_field(plan.grid)
        most = [SAMPLE if dim == of_field else SAMPLE_SHARING for dim in range(len(plan.grid.shape))]
        thin = tuple(slice(None, None, -(-size // few)) for size, few in zip(plan.grid.shape, most, strict=True))
        return {name: array[thin] for name, array in parameters.items()}
    number = SAMPLE if plan.strength is None else SAMPLE_LIMITED
    some = np.random.default_rng(0).integers(plan.grid.cells, size=number)
    index = np.unravel_index(some, plan.grid.shape) if plan.grid.shape else ()
    return {name: np.array(array[index], ndmin=1) for name, array in parameters.items()}


def stream(plan: Plan, *, fresh: bool, on_cells: Callable[[int], object]) -> None:
    """Compute what is not there yet of a sweep, and put the whole into its file.

    Parameters
    ----------
    plan : Plan
        What to compute.
    fresh
        As in `dea_maps.sweep_to_netcdf`.
    on_cells : callable
        Called with the number of cells that were found finished, or finished since.

    Raises
    ------
    OSError
        If something cannot be written, or another sweep is writing the same file; finished parts stay.
    KeyboardInterrupt
        With a note of what is kept.
    """
    target = Path(os.path.realpath(plan.path))
    with locked_parts(target, *plan.identities()) as parts:
        if fresh:
            parts.clear()
        temporary = parts.folder / WHOLE
        computing = Threads(on_cells) if plan.engine == "threads" else Dask(plan.scheduler, on_cells)
        try:
            parts.regain()
            _write(plan, parts, computing, temporary, on_cells)
            with naming(target):
                move_into_place(temporary, target)
        except KeyboardInterrupt:
            kept = parts.count()
            note = [f"{kept} of {plan.parts.count} parts are kept in {parts.folder}"] if kept else []
            raise KeyboardInterrupt(*note) from None
        finally:
            computing.close()


def _write(
    plan: Plan, parts: Parts, engine: Threads | Dask, temporary: Path, on_cells: Callable[[int], object]
) -> None:
    """Write all parts into a file, in order, while the next ones are computed."""
    template, names = plan.template(), [str(name) for name in plan.maps().data_vars]
    # Libraries of NetCDF are called from one thread of its own; compression and the disk let the others compute.
    with ThreadPoolExecutor(1) as disk, ThreadPoolExecutor(default_threads()) as compressing:
        file = disk.submit(MapFile, temporary, template, names, plan.chunks).result()
        writes: deque[Future[None]] = deque()
        try:
            filters = file.storage[names[0]].filters
            for number, arrays, old in _finished(plan, parts, engine, len(names), filters, on_cells):
                while len(writes) >= WAITING:
                    writes.popleft().result()
                numbers, places = plan.parts.chunks_of(number)
                if old is None:
                    values = plan.stored(number, arrays)
                    chunks = [compressing.submit(file.storage[name].chunks, values[name], places) for name in names]
                else:
                    count = len(places)
                    chunks = [_ready(old[at * count : (at + 1) * count]) for at in range(len(names))]
                writes.append(disk.submit(_place, parts, file, number, numbers, dict(zip(names, chunks, strict=True))))
            for future in writes:
                future.result()
        finally:
            disk.submit(file.close).result()


def _place(parts: Parts, file: MapFile, number: int, numbers: list[int], chunks: Mapping[str, Future[Chunks]]) -> None:
    """Put a part into the file when it is compressed; then it is finished."""
    found = {name: of_variable.result() for name, of_variable in chunks.items()}
    offsets = file.write(numbers, found)
    parts.save(number, [chunk for of_variable in found.values() for chunk in of_variable], offsets)


def _finished(
    plan: Plan,
    parts: Parts,
    engine: Threads | Dask,
    variables: int,
    filters: tuple[int, ...],
    on_cells: Callable[[int], object],
) -> Iterator[tuple[int, Arrays, Chunks | None]]:
    """Yield number and values, or chunks that are there, of all parts in order; some are begun ahead of the others."""
    window: deque[tuple[int, tuple[Chunks, bool] | None, Pending | None]] = deque()
    for number in range(plan.parts.count + engine.ahead):
        if number < plan.parts.count:
            count = len(plan.parts.chunks_of(number)[1])
            old = parts.load(number, variables * count, len(plan.variables) * count)
            window.append((number, old, engine.submit(plan.task(number)) if old is None else None))
        if window and (len(window) > engine.ahead or number >= plan.parts.count):
            first, found, pending = window.popleft()
            if pending is not None:
                yield first, _result(first, plan, pending), None
            elif found is not None:
                chunks, plain = found
                on_cells(plan.parts.cells(first))
                yield (first, _values(plan, first, chunks, filters), None) if plain else (first, {}, chunks)


def _values(plan: Plan, number: int, chunks: Chunks, filters: tuple[int, ...]) -> Arrays:
    """Return the values of a part from its chunks without SI units."""
    places = plan.parts.chunks_of(number)[1]
    values = {}
    for at, (name, kind) in enumerate(_kinds(plan.variables, plan.dtype).items()):
        of_variable = chunks[at * len(places) : (at + 1) * len(places)]
        whole = [restored(chunk, filters, kind) for chunk in of_variable]
        cut_off = [part[: place.stop - place.start] for part, place in zip(whole, places, strict=True)]
        values[name] = np.concatenate(cut_off)
    return values


def _ready(chunks: Chunks) -> Future[Chunks]:
    """Return chunks as what is compressed already."""
    future: Future[Chunks] = Future()
    future.set_result(chunks)
    return future


def _kinds(variables: tuple[str, ...], dtype: str) -> dict[str, np.dtype[np.generic]]:
    """Return what variables are stored as."""
    return {name: np.dtype(np.int8 if name in FLAGGED else dtype) for name in variables}


def _result(number: int, plan: Plan, pending: Pending) -> Arrays:
    """Return a part when it is finished; what cannot be finished is named."""
    try:
        return pending.result()
    except (MemoryError, OSError):
        raise
    except Exception as error:
        numbers, _ = plan.parts.chunks_of(number)
        first, stop = plan.chunks.cells(numbers[0]).start, plan.chunks.cells(numbers[-1]).stop
        some = "cells" if stop - first == plan.parts.cells(number) else "some of the cells"
        raise OSError(
            f"{some} {first:,} to {stop - 1:,} could not be computed: {type(error).__name__}: {error}"
        ) from error
