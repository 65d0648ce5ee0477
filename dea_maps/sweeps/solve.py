"""Interface to the kernels: a grid of parameters and a choice of method in, arrays of results out."""

import threading
from collections.abc import Callable, Collection, Mapping
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import DTypeLike, NDArray

from ..kernels import build, checksum, lane_state
from ..kernels import sweep as kernel_rows
from ..kernels._jit import FINGERPRINT, Kernel
from ..kernels.dead_load import build as dead_load
from ..kernels.loading import build as loading
from ..kernels.loading import record as recorded
from ..kernels.loading import results as loading_rows
from ..kernels.loading import rows as passage_rows
from ..kernels.loading.cells import SHARE
from ..kernels.product import grid as product_grid
from ..notices import notice
from ..outcomes import Outcome
from ..pieces import Argument
from ..programs import Program, shape_of
from .chunks import cut
from .dead_load import film_of, has_dead_load
from .loading import SINE, arrays_of, field_at, order_to_share, repetition_starts, table_of
from .methods import RATE, TIME, Choice, choose
from .product import Product, product_of

KERNELS = FINGERPRINT
"""Hash of the sources of the kernels: another one may be another result."""

# Cells per call of a kernel, at most: long enough to hide the call, short enough for progress, Ctrl-C and balance.
CHUNK = 4096
# The same of a product grid, of which a cell takes some nanoseconds: their results have to stay in the cache.
PRODUCT_CHUNK = 65_536
# The same of films that are followed in time.
TRACE_CHUNK = 16
# Bound on the attempted steps of a cell in one piece of its program; reaching it gives `unresolved`. With the methods
# that serve every program for comparison it is the bound on those of a cell in all.
ATTEMPTS = 1_000_000

# Seconds to compile a sweep, by method, and trajectories: on one core of a processor of 2024, for the slowest program.
COMPILE_SECONDS = {"quadrature": 5, "rk4": 7, "dopri5": 8, "dop853": 20, "radau5": 20}
COMPILE_SECONDS_OF_TRAJECTORIES = 20
COMPILE_SECONDS_OF_PRODUCTS = 12

# Held by the thread that says what is compiled, and compiles it: another one finds the machine code.
_PREPARING = threading.Lock()

_OUTCOMES = np.full(16, Outcome.UNRESOLVED, np.int8)
_OUTCOMES[lane_state.SURVIVES] = Outcome.SURVIVES
_OUTCOMES[lane_state.FAILED] = Outcome.FAILS_LATER
_OUTCOMES[lane_state.FAILS_AT_ONCE] = Outcome.FAILS_AT_ONCE


STEPS: Any = recorded
"""The numbers of the rows of recorded steps, see `Passages`, by name."""
fletcher_sums = checksum.sums
"""What sums the words of a checksum."""

Parameters = Mapping[str, NDArray[np.float64]]
"""Parameters of cells by name, all of one shape."""
Arguments = Callable[[Parameters], tuple[Any, ...]]
"""What a kernel takes for some cells."""


class Solution(NamedTuple):
    """Results of a sweep, each of the grid's shape; see the data set's variables for their meaning.

    Those that the program does not have, or that were not asked for, are None.
    """

    outcome: NDArray[np.int8]
    time_to_failure: NDArray[np.float64]
    critical_stretch: NDArray[np.float64]
    critical_internal_stretch: NDArray[np.float64]
    critical_field: NDArray[np.float64]
    final_stretch: NDArray[np.float64]
    largest_stretch: NDArray[np.float64] | None = None
    cycles_to_failure: NDArray[np.float64] | None = None
    steady_stretch_max: NDArray[np.float64] | None = None
    steady_stretch_min: NDArray[np.float64] | None = None

    def by_name(self) -> dict[str, NDArray[Any]]:
        """Return the results that there are."""
        return {name: values for name, values in self._asdict().items() if values is not None}


_PRODUCT_ROWS = Solution._fields[1 : kernel_rows.RESULTS + 1]


def solve(
    program: Program,
    parameters: Parameters,
    choice: Choice,
    *,
    product: Product | None = None,
    on_cells: Callable[[int], object] | None = None,
    threads: int | None = None,
    wanted: Collection[str] | None = None,
    dtype: DTypeLike = np.float64,
) -> Solution:
    """Compute every cell of a grid.

    Parameters
    ----------
    program : Program
        The loading program.
    parameters : mapping of str to ndarray
        Its parameters and ``modulus_ratio``, valid, all of one shape; zero-stride views are not copied.
    choice : Choice
        Method, formulation and accuracy.
    product : Product, optional
        What the cells are of a product grid, if `choice` is shared; what they have in common is then kept for the next
        part of the same grid. By default the grid is taken for a whole one.
    on_cells : callable, optional
        Called, in the calling thread, with the number of cells finished since its last call.
    threads : int, optional
        How many to compute on; by default as many as Numba would use.
    wanted : collection of str, optional
        The results that will be used; by default all. Others are None.
    dtype : data type, optional
        What numbers are rounded to.

    Returns
    -------
    Solution
        Arrays of the shape of ``parameters``.
    """
    shape = parameters["modulus_ratio"].shape
    cells = parameters["modulus_ratio"].size
    outcome = np.empty(cells, np.int8)
    rows, kernel, arguments = _kernel(program, choice)
    of_kernel = Solution._fields[1 : rows + 1]
    results = set(program.results) if wanted is None else set(program.results) & set(wanted)
    # Under a field that only rises, the largest stretch is the last one.
    is_last = "largest_stretch" in results and "largest_stretch" not in of_kernel
    needed = [
        name for name in of_kernel if name in results or (is_last and name in {"final_stretch", "critical_stretch"})
    ]
    result: dict[str, NDArray[Any]]
    own = (product or product_of(program, parameters)) if choice.shared else None
    if own is not None:
        _prepare(product_grid.kernels(), program.name, COMPILE_SECONDS_OF_PRODUCTS)
        result = {name: np.empty(cells, dtype) for name in needed}
        _solve_product(own, choice, product is not None, outcome, result, on_cells, threads)
    else:
        # The kernels of films under a dead load are as long as those of the longest method.
        seconds = max(COMPILE_SECONDS.values()) if choice.dead_load else COMPILE_SECONDS[choice.method]
        _prepare((kernel,), program.name, seconds)
        order = order_to_share(program, parameters)
        natural = order == tuple(range(len(shape)))
        ordered = {name: values.transpose(order) for name, values in parameters.items()}
        outcomes = outcome.reshape(shape).transpose(order)
        every = np.empty((rows, cells))
        ordered_every = every.reshape(rows, *shape).transpose(0, *(1 + dim for dim in order))
        parts = cut(outcomes.shape, CHUNK)

        def compute(number: int) -> int:
            part, index = parts.cells(number), parts.index(number)
            given = {name: np.atleast_1d(values[index]).flatten() for name, values in ordered.items()}
            status = np.empty(part.stop - part.start, np.int8)
            found = every[:, part] if natural else np.empty((rows, status.size))
            kernel(*arguments(given), status, found)
            verdicts = outcomes[(*index, ...)]
            verdicts[...] = _OUTCOMES[status].reshape(verdicts.shape)
            if not natural:
                ordered_every[(slice(None), *index, ...)] = found.reshape(rows, *verdicts.shape)
            return status.size

        _in_threads(compute, range(parts.count), on_cells, threads)
        rows_found = zip(of_kernel, every, strict=True)
        result = {name: row.astype(dtype, copy=False) for name, row in rows_found if name in needed}
    if is_last:
        result["largest_stretch"] = np.where(
            outcome == Outcome.SURVIVES, result["final_stretch"], result["critical_stretch"]
        )
    kept: dict[str, Any] = {
        name: result[name].reshape(shape) if name in results else None for name in Solution._fields[1:]
    }
    return Solution(outcome.reshape(shape), **kept)


def sharing_pays(product: Product, rtol: float) -> bool:
    """Return whether a grid has so many fields, at this accuracy, that series over the field cost less than cells."""
    return product_grid.pays(product.fields, rtol)


def product_bytes(product: Product, rtol: float) -> int:
    """Return about how much memory takes what the cells of a whole product grid have in common."""
    return product_grid.table_bytes(product.dims, [axis.size for axis in product.axes], rtol)


class _Last:
    """The product grid of which a part was computed last."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._known: tuple[Any, product_grid.ProductGrid] | None = None

    def get(self, key: Any, make: Callable[[], product_grid.ProductGrid]) -> product_grid.ProductGrid:
        """Return the grid of a key, made once."""
        with self._lock:
            if self._known is None or self._known[0] != key:
                self._known = None
                self._known = key, make()
            return self._known[1]

    def forget(self) -> None:
        """Free its memory."""
        with self._lock:
            self._known = None


_LAST = _Last()
forget_product = _LAST.forget


def _solve_product(
    product: Product,
    choice: Choice,
    keep: bool,
    outcome: NDArray[np.int8],
    result: Mapping[str, NDArray[Any]],
    on_cells: Callable[[int], object] | None,
    threads: int | None,
) -> None:
    """Fill in outcomes, and those results of a part of a product grid that are wanted, each (cells,)."""
    rtol = choice.rtol
    assert rtol is not None  # a method of fixed step is never shared

    def make() -> product_grid.ProductGrid:
        def each(work: Callable[[int], int], numbers: range) -> None:
            _in_threads(work, numbers, threads=threads)

        def alone(single: Kernel) -> None:
            _prepare((single,), "single cells", COMPILE_SECONDS[choice.method])

        return product_grid.ProductGrid(product.dims, product.axes, rtol, ATTEMPTS, each, alone)

    key = (product.dims, rtol, *(axis.tobytes() for axis in product.axes))
    grid = _LAST.get(key, make) if keep else make()
    tiles = grid.tiles(product.shape, PRODUCT_CHUNK)
    outcomes = outcome.reshape(product.shape)
    wanted = {_PRODUCT_ROWS.index(name): values.reshape(product.shape) for name, values in result.items()}

    def compute(number: int) -> int:
        tile = tiles[number]
        shape = tuple(own.stop - own.start for own in tile)
        status, found = np.empty(shape, np.int8), np.empty((len(_PRODUCT_ROWS), *shape))
        part = [
            slice(whole.start + own.start, whole.start + own.stop)
            for whole, own in zip(product.part, tile, strict=True)
        ]
        grid.evaluate(part, status, list(found))
        outcomes[tile] = _OUTCOMES.take(status)
        for row, values in wanted.items():
            values[tile] = found[row]
        return status.size

    _in_threads(compute, range(len(tiles)), on_cells, threads)


def _kernel(program: Program, choice: Choice) -> tuple[int, Kernel, Arguments]:
    """Return how many rows of results a kernel has, the kernel, and its arguments before status and results."""
    shape = shape_of(program)
    only_rises = shape is not None and not choice.dead_load
    if choice.formulation != TIME and (choice.formulation != RATE or only_rises):
        assert shape is not None  # `methods.choose` lets no other program through

        def of_film(given: Parameters) -> tuple[Any, ...]:
            return _column(shape.field, given), _column(shape.rate, given), *film_of(given), choice.rtol

        if choice.dead_load:
            return kernel_rows.RESULTS, dead_load.sweep(shape.name), of_film
        accuracy = (choice.rtol or 0.0, choice.step or 0.0, ATTEMPTS)

        def columns(given: Parameters) -> tuple[Any, ...]:
            return _column(shape.field, given), _column(shape.rate, given), given["modulus_ratio"], *accuracy

        return kernel_rows.RESULTS, build.sweep_for(shape.name, choice.formulation, choice.method), columns
    table = table_of(program)

    def pieces(given: Parameters) -> tuple[Any, ...]:
        return *arrays_of(table, given), *film_of(given), choice.rtol

    def steps(given: Parameters) -> tuple[Any, ...]:
        return *arrays_of(table, given), *film_of(given), choice.rtol or 0.0, choice.step or 0.0, ATTEMPTS

    if choice.step is not None or choice.formulation == RATE:
        return loading_rows.RESULTS, loading.stepped(choice.formulation, choice.method), steps
    return loading_rows.RESULTS, loading.sweep(bool((table.kind == SINE).any()), choice.dead_load), pieces


def _column(argument: Argument | None, given: Parameters) -> NDArray[np.float64]:
    """Return the values of a number, or of a parameter, in every cell."""
    if isinstance(argument, str):
        return given[argument]
    return np.full(given["modulus_ratio"].shape, 0.0 if argument is None else float(argument))


def compiles(program: Program, choice: Choice) -> bool:
    """Return whether the next sweep of a program would first compile: its machine code is not there yet."""
    _, kernel, _ = _kernel(program, choice)
    kernels = product_grid.kernels() if choice.shared else (kernel,)
    return any(kernel.needs_compiling() for kernel in kernels)


def _prepare(kernels: Collection[Kernel], what: str, seconds: int) -> None:
    """Compile kernels if need be, and say so before; in the calling thread, where Ctrl-C ends it."""
    with _PREPARING:
        if any(kernel.needs_compiling() for kernel in kernels):
            notice(f"compiling for {what}, once, some {seconds} s")
        for kernel in kernels:
            kernel.prepare()


def solve_auto(program: Program, parameters: Parameters, rtol: float) -> Solution:
    """Compute every cell by what is fastest at this accuracy, see `solve`."""
    return solve(program, parameters, choose(program, "auto", "auto", rtol, None, has_dead_load(parameters)))


def trace(
    program: Program,
    parameters: Parameters,
    times: NDArray[np.float64],
    rtol: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stretch and internal stretch at given times.

    Parameters
    ----------
    program, parameters
        As in `solve`.
    times : (..., times) ndarray
        In relaxation times, ascending, not negative: the same for all cells, or a row for each, in the shape of
        ``parameters``.
    rtol : float
        Relative error allowed in the stretches.

    Returns
    -------
    stretch, internal_stretch : ndarray
        Of the shape of ``parameters`` and one dimension more, along ``times``; NaN after failure.
    """
    shape = parameters["modulus_ratio"].shape
    table = table_of(program)
    kernel = loading.trajectory(bool((table.kind == SINE).any()), has_dead_load(parameters))
    _prepare((kernel,), f"trajectories of {program.name}", COMPILE_SECONDS_OF_TRAJECTORIES)
    per_cell = np.broadcast_to(times, (*shape, times.shape[-1]))
    # A film that survives has no time to failure; one that fails at once is not followed.
    life = np.nan_to_num(solve_auto(program, parameters, rtol).time_to_failure, nan=np.inf)[..., np.newaxis]
    wanted = np.where(life > 0.0, per_cell <= life, False).sum(axis=-1).ravel()
    stretch, internal = np.empty((2, wanted.size, times.shape[-1]))
    parts = cut(shape, TRACE_CHUNK)

    def compute(number: int) -> int:
        part, index = parts.cells(number), parts.index(number)
        given = {name: np.atleast_1d(values[index]).flatten() for name, values in parameters.items()}
        own = np.array(per_cell[index], order="C").reshape(-1, times.shape[-1])
        film = (*arrays_of(table, given), *film_of(given))
        kernel(*film, rtol, own, wanted[part], stretch[part], internal[part])
        return own.shape[0]

    _in_threads(compute, range(parts.count))
    full = (*shape, times.shape[-1])
    return stretch.reshape(full), internal.reshape(full)


class Passages:
    """Films taken through a loading program step by step, to look for something on the way.

    Parameters
    ----------
    program, parameters
        As in `solve`, of one dimension.
    rtol : float
        Relative error allowed in a passage through the program.
    closeness : float
        Distance in time to the instability, over the time in the piece of the program, at which a film has failed.
    square : ndarray, optional
        xi**2 at the start, where that is not the film's own.
    one_cycle : bool
        Whether to end with the first repetition, taken for one that follows on others.
    """

    READY, ENDED, JUMPED, NEAR, RESTS = (
        passage_rows.READY, passage_rows.ENDED, passage_rows.JUMPED, passage_rows.NEAR, recorded.RESTS,
    )  # fmt: skip

    def __init__(
        self,
        program: Program,
        parameters: Parameters,
        rtol: float,
        closeness: float,
        square: NDArray[np.float64] | None = None,
        one_cycle: bool = False,
    ) -> None:
        table = table_of(program)
        which = bool((table.kind == SINE).any()), has_dead_load(parameters)
        self._record, self._within = loading.record(*which), loading.within(*which)
        _prepare((self._record, self._within), f"passages through {program.name}", COMPILE_SECONDS_OF_TRAJECTORIES)
        *self._pieces, self._columns, self._repeats, self._once = arrays_of(table, parameters)
        self.ratio, start, self.load = film_of(parameters)
        self._power = -1.0 if which[1] else -0.5
        self._closeness, self._one_cycle = closeness, one_cycle
        size = self.ratio.size
        self.state, self._cycles = np.full(size, self.READY, np.int8), np.zeros(size)
        self._kept = np.zeros((passage_rows.KEPT, size))
        self._kept[passage_rows.T] = self._kept[passage_rows.HELD] = -1.0
        self._kept[passage_rows.BASE] = start**2 if square is None else square
        self._kept[passage_rows.UNTIL] = self._once or table.kind.size
        if one_cycle and self._once:  # one like all that follow
            self._kept[passage_rows.PIECE], self._kept[passage_rows.UNTIL] = self._once, table.kind.size
            end = np.nextafter(repetition_starts(program, parameters, np.ones(size)), 0.0)
            self._kept[passage_rows.X] = field_at(program, parameters, end[:, np.newaxis])[:, 0]
        self._kept[passage_rows.GAIN] = 1.0
        self._kept[passage_rows.TIGHTNESS] = 1.0 / (SHARE * rtol)
        self._kept[passage_rows.RESOLUTION] = self._kept[passage_rows.LEAST] = np.inf

    def keep(self, films: NDArray[np.bool_]) -> None:
        """Go on with some of the films alone."""
        self._columns, self._kept = (np.compress(films, rows, axis=1).copy() for rows in (self._columns, self._kept))
        self.ratio, self.load = self.ratio[films], self.load[films]
        self.state, self._cycles = self.state[films], self._cycles[films]

    def go_on(self, room: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Take every film that is READY so many steps further, or to its end.

        Returns
        -------
        count : (films,) ndarray
            Steps taken.
        steps : (rows, films, room) ndarray
            What they are, see `dea_maps.kernels.loading.record`.
        """
        count = np.zeros(self.state.size, np.int64)
        steps = np.empty((recorded.RECORDED, self.state.size, room))
        program = (*self._pieces, self._columns, self._repeats, self._once, self._one_cycle)
        self._record(
            *program, self.ratio, self.load, self._closeness, self.state, self._cycles, self._kept, count, steps
        )
        return count, steps

    def within(
        self, films: NDArray[np.int64], start: NDArray[np.float64], length: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return stretch and field a time after the start of recorded steps, (rows, steps), of films."""
        found = np.empty((2, length.size))
        inputs = (np.ascontiguousarray(array) for array in (films, self.ratio, self.load, start, length))
        self._within(*self._pieces, self._columns, *inputs, found)
        return found[0], found[1]

    @property
    def change(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """How much xi**2 has changed since the start of the repetition, and its derivative by that at the start."""
        return self._kept[passage_rows.Y], self._kept[passage_rows.GAIN]

    @property
    def time(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Repetitions completed, and the time since the start of the one under way."""
        return self._cycles, self._kept[passage_rows.OFFSET] + self._kept[passage_rows.T]

    @property
    def square(self) -> NDArray[np.float64]:
        """xi**2 of every film."""
        return np.asarray(self._kept[passage_rows.BASE] + self._kept[passage_rows.Y])

    @property
    def stretch(self) -> NDArray[np.float64]:
        """Stretch of every film."""
        return np.asarray(self._kept[passage_rows.X] ** self._power)


def relaxation_rate(final_stretch: NDArray[np.float64], modulus_ratio: NDArray[np.float64]) -> NDArray[np.float64]:
    """How fast films that survive near their final stretch, per relaxation time; NaN for others.

    The flow (26) under a held field, made linear about its end, where the dashpot has the stretch of the film.
    """
    u = final_stretch**-2
    stiffness = np.maximum(4.0 * u**3 - 1.0, 0.0)  # none at the relaxed critical field
    return np.asarray(6.0 * u * stiffness / np.maximum(stiffness + 3.0 * (modulus_ratio - 1.0) * u, 1e-300))


def default_threads() -> int:
    """Return as many threads as Numba would use: NUMBA_NUM_THREADS, or the number of cores."""
    return int(numba.config.NUMBA_NUM_THREADS)


def _in_threads(
    compute: Callable[[int], int],
    starts: range,
    on_cells: Callable[[int], object] | None = None,
    threads: int | None = None,
) -> None:
    """Call ``compute`` for every start on some threads, or all; an error or Ctrl-C stops them all."""
    if len(starts) == 1:  # starting a thread takes longer than few cells
        finished = compute(starts[0])
        if on_cells is not None:
            on_cells(finished)
        return
    remaining = iter(starts)
    finished = 0
    stop = threading.Event()

    def work() -> None:
        nonlocal finished
        for start in remaining:  # next() on a range is atomic: each start goes to one thread
            if stop.is_set():
                return
            count = compute(start)
            with lock:
                finished += count

    lock = threading.Lock()
    reported = 0
    threads = max(1, min(threads or default_threads(), len(starts)))
    with ThreadPoolExecutor(threads) as pool:
        try:
            pending = {pool.submit(work) for _ in range(threads)}
            while pending:
                done, pending = wait(pending, timeout=0.1, return_when=FIRST_EXCEPTION)
                for future in done:
                    future.result()
                if on_cells is not None and finished > reported:
                    on_cells(finished - reported)
                    reported = finished
        finally:
            stop.set()
