"""The one door to the kernels: a grid of parameters and a choice of method in, arrays of results out."""

import threading
from collections.abc import Callable, Collection, Mapping
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from ..kernels import build, lane_state, programs
from ..kernels import sweep as kernel_rows
from ..kernels._jit import FINGERPRINT, Kernel
from ..kernels.dead_load import build as dead_load
from ..kernels.loading import build as loading
from ..kernels.loading import results as loading_rows
from ..kernels.product import grid as product_grid
from ..nomenclature import VARIABLES
from ..notices import notice
from ..pieces import Argument
from ..programs import Program, shape_of
from .chunks import cut
from .dead_load import film_of, has_dead_load
from .loading import SINE, arrays_of, table_of
from .methods import TIME, Choice, choose
from .product import Product, product_of

SURVIVES, FAILS_LATER, FAILS_AT_ONCE, UNRESOLVED = 0, 1, 2, 3

KERNELS = FINGERPRINT
"""Hash of the sources of the kernels: another one may be another result."""

# Cells per call of a kernel, at most: long enough to hide the call, short enough for progress, Ctrl-C and balance.
CHUNK = 4096
# The same of a product grid, of which a cell takes some tens of nanoseconds.
PRODUCT_CHUNK = 65_536
# Bound on the attempted steps of a cell in one piece of its program; reaching it gives `unresolved`.
ATTEMPTS = 1_000_000
# The same of a trajectory between two times: an explicit method takes a step or so a relaxation time.
TRACE_ATTEMPTS = 100_000_000
# Relaxation times of its own after which a film that survives differs from its end by less than rounding.
RELAXATIONS = 45.0
# Shares of the tolerance to trace with, until all is found: at the limit of its stability, where a slow ramp keeps it,
# an explicit method takes a step now and then whose error it does not see, and that leads nowhere.
RETRACED = (1.0, 0.7, 0.5, 0.3, 0.2)

# Seconds to compile a sweep, by method, and trajectories: on one core of a processor of 2024, for the slowest program.
COMPILE_SECONDS = {"quadrature": 5, "rk4": 7, "dopri5": 8, "dop853": 20, "radau5": 20}
COMPILE_SECONDS_OF_TRAJECTORIES = 20
COMPILE_SECONDS_OF_PRODUCTS = 40

_OUTCOMES = np.full(16, UNRESOLVED, np.int8)
_OUTCOMES[lane_state.SURVIVES] = SURVIVES
_OUTCOMES[lane_state.FAILED] = FAILS_LATER
_OUTCOMES[lane_state.FAILS_AT_ONCE] = FAILS_AT_ONCE


Parameters = Mapping[str, NDArray[np.float64]]
"""Parameters of cells by name, all of one shape."""
Arguments = Callable[[Parameters], tuple[Any, ...]]
"""What a kernel takes for some cells."""


class Solution(NamedTuple):
    """Results of a sweep, each of the grid's shape; see the data set's variables for their meaning.

    The last four are None where the program has no such result.
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


def solve(
    program: Program,
    parameters: Parameters,
    choice: Choice,
    *,
    product: Product | None = None,
    on_cells: Callable[[int], object] | None = None,
    threads: int | None = None,
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

    Returns
    -------
    Solution
        Arrays of the shape of ``parameters``.
    """
    shape = parameters["modulus_ratio"].shape
    cells = parameters["modulus_ratio"].size
    outcome = np.empty(cells, np.int8)
    rows, kernel, arguments = _kernel(program, choice)
    result = np.empty((rows, cells))
    own = (product or product_of(program, parameters)) if choice.shared else None
    if own is not None:
        _prepare(_product_kernels(kernel), program.name, COMPILE_SECONDS_OF_PRODUCTS)
        _solve_product(own, choice, product is not None, outcome, result, on_cells, threads)
    else:
        # The kernels of films under a dead load are as long as those of the longest method.
        seconds = max(COMPILE_SECONDS.values()) if choice.dead_load else COMPILE_SECONDS[choice.method]
        _prepare((kernel,), program.name, seconds)
        parts = cut(shape, CHUNK)

        def compute(number: int) -> int:
            part = parts.cells(number)
            given = {name: np.atleast_1d(values[parts.index(number)]).flatten() for name, values in parameters.items()}
            status = np.empty(part.stop - part.start, np.int8)
            kernel(*arguments(given), status, result[:, part])
            outcome[part] = _OUTCOMES[status]
            return status.size

        _in_threads(compute, range(parts.count), on_cells, threads)
    found = Solution(outcome.reshape(shape), *(row.reshape(shape) for row in result))
    if found.largest_stretch is None:  # under a field that only rises, the largest stretch is the last one
        found = found._replace(
            largest_stretch=np.where(found.outcome == SURVIVES, found.final_stretch, found.critical_stretch)
        )
    absent: dict[str, Any] = dict.fromkeys(name for name in VARIABLES if name not in program.results)
    return found._replace(**absent)


def sharing_pays(product: Product, rtol: float) -> bool:
    """Return whether a grid has so many fields, at this accuracy, that series over the field cost less than cells."""
    return product_grid.pays(product.fields, rtol)


def product_bytes(product: Product, rtol: float) -> int:
    """Return about how much memory takes what the cells of a whole product grid have in common."""
    return product_grid.table_bytes(product.dims, [axis.size for axis in product.axes], rtol)


def _product_kernels(single: Kernel) -> tuple[Kernel, ...]:
    return single, *product_grid.kernels()


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
    result: NDArray[np.float64],
    on_cells: Callable[[int], object] | None,
    threads: int | None,
) -> None:
    """Fill in outcomes and results of a part of a product grid, (cells,) and (rows, cells)."""
    rtol = choice.rtol
    assert rtol is not None  # a method of fixed step is never shared

    def make() -> product_grid.ProductGrid:
        def each(work: Callable[[int], int], numbers: range) -> None:
            _in_threads(work, numbers, threads=threads)

        return product_grid.ProductGrid(product.dims, product.axes, rtol, ATTEMPTS, each)

    key = (product.dims, rtol, *(axis.tobytes() for axis in product.axes))
    grid = _LAST.get(key, make) if keep else make()
    parts = cut(product.shape, PRODUCT_CHUNK)

    def compute(number: int) -> int:
        cells, index = parts.cells(number), parts.index(number)
        part = []
        for k, own in enumerate(product.part):
            inner = index[k] if k < len(index) else slice(0, own.stop - own.start)
            first, end = (inner.start, inner.stop) if isinstance(inner, slice) else (inner, inner + 1)
            part.append(slice(own.start + first, own.start + end))
        shape = tuple(own.stop - own.start for own in part)
        status = np.empty(shape, np.int8)
        grid.evaluate(part, status, [row[cells].reshape(shape) for row in result])
        outcome[cells] = _OUTCOMES[status.ravel()]
        return status.size

    _in_threads(compute, range(parts.count), on_cells, threads)


def _kernel(program: Program, choice: Choice) -> tuple[int, Kernel, Arguments]:
    """Return how many rows of results a kernel has, the kernel, and its arguments before status and results."""
    if choice.formulation != TIME:
        shape = shape_of(program)
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

    return loading_rows.RESULTS, loading.sweep(bool((table.kind == SINE).any()), choice.dead_load), pieces


def _column(argument: Argument | None, given: Parameters) -> NDArray[np.float64]:
    """Return the values of a number, or of a parameter, in every cell."""
    if isinstance(argument, str):
        return given[argument]
    return np.full(given["modulus_ratio"].shape, 0.0 if argument is None else float(argument))


def compiles(program: Program, choice: Choice) -> bool:
    """Return whether the next sweep of a program would first compile: its machine code is not there yet."""
    _, kernel, _ = _kernel(program, choice)
    kernels = _product_kernels(kernel) if choice.shared else (kernel,)
    return any(kernel.needs_compiling() for kernel in kernels)


def _prepare(kernels: Collection[Kernel], what: str, seconds: int) -> None:
    """Compile kernels if need be, and say so before; in the calling thread, where Ctrl-C ends it."""
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
    ratio = parameters["modulus_ratio"]
    cells, shape = ratio.size, (*ratio.shape, times.shape[-1])
    stretch, internal = np.empty((2, cells, shape[-1]))
    rising = shape_of(program)
    if rising is None or has_dead_load(parameters):
        _trace_general(program, parameters, times, rtol, stretch, internal)
        return stretch.reshape(shape), internal.reshape(shape)
    kernel = build.trajectory(rising.name)
    _prepare((kernel,), f"trajectories of {program.name}", COMPILE_SECONDS_OF_TRAJECTORIES)
    ends = solve_auto(program, parameters, rtol)
    lifetimes = np.nan_to_num(ends.time_to_failure)
    fields, rates = (_column(argument, parameters) for argument in (rising.field, rising.rate))
    corners = fields / rates if rising.name == "ramp_hold" else np.zeros_like(fields)
    per_cell = np.minimum(times, _relaxed_by(corners, ratio, ends.final_stretch)[..., np.newaxis])

    def compute(cell: int) -> int:
        index = np.unravel_index(cell, ratio.shape)
        columns = [np.atleast_1d(column[index]) for column in (fields, rates, ratio)]
        own = per_cell[index]
        # Where the film runs away after a long hold, the error counts of all that time.
        field, rate, _ = (float(column[0]) for column in columns)
        held = programs.time_held(rising.name, field, rate, float(lifetimes.flat[cell]))
        tight = max(rtol / (1.0 + 10.0 * held), 1e-14)
        alive = own < (lifetimes.flat[cell] or np.inf)
        for share in RETRACED:
            kernel(*columns, own, share * tight, TRACE_ATTEMPTS, stretch[cell : cell + 1], internal[cell : cell + 1])
            if np.isfinite(stretch[cell, alive]).all():
                break
        return 1

    _in_threads(compute, range(cells))
    return stretch.reshape(shape), internal.reshape(shape)


def relaxation_rate(final_stretch: NDArray[np.float64], modulus_ratio: NDArray[np.float64]) -> NDArray[np.float64]:
    """How fast films that survive near their final stretch, per relaxation time; NaN for others.

    The flow (26) under a held field, made linear about its end, where the dashpot has the stretch of the film.
    """
    u = final_stretch**-2
    stiffness = np.maximum(4.0 * u**3 - 1.0, 0.0)  # none at the relaxed critical field
    return np.asarray(6.0 * u * stiffness / np.maximum(stiffness + 3.0 * (modulus_ratio - 1.0) * u, 1e-300))


def _relaxed_by(
    corner: NDArray[np.float64], modulus_ratio: NDArray[np.float64], final_stretch: NDArray[np.float64]
) -> NDArray[np.float64]:
    """When films that survive have come to rest: an explicit method would step on for ever. Infinity for others."""
    rate = relaxation_rate(final_stretch, modulus_ratio)
    comes_to_rest = rate > 0.0
    return np.where(comes_to_rest, corner + RELAXATIONS / np.where(comes_to_rest, rate, 1.0), np.inf)


def _trace_general(
    program: Program,
    parameters: Parameters,
    times: NDArray[np.float64],
    rtol: float,
    stretch: NDArray[np.float64],
    internal: NDArray[np.float64],
) -> None:
    """Fill in the stretches of films under any program and dead load, (cells, times), as `trace` returns them."""
    table = table_of(program)
    kernel = loading.trajectory(bool((table.kind == SINE).any()), has_dead_load(parameters))
    _prepare((kernel,), f"trajectories of {program.name}", COMPILE_SECONDS_OF_TRAJECTORIES)
    shape = parameters["modulus_ratio"].shape
    per_cell = np.broadcast_to(times, (*shape, times.shape[-1]))

    def compute(cell: int) -> int:
        index = np.unravel_index(cell, shape)
        given = {name: np.atleast_1d(values[index]).flatten() for name, values in parameters.items()}
        own = np.array(per_cell[index])
        part = slice(cell, cell + 1)
        kernel(*arrays_of(table, given), *film_of(given), rtol, own, stretch[part], internal[part])
        return 1

    _in_threads(compute, range(stretch.shape[0]))


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
