"""Other solvers on a right-hand side from a known place to a known place, each as its documentation says it is fast."""

import math
from collections.abc import Callable
from functools import cache
from typing import Any

import forms
import numba as nb
import numpy as np
from numpy.typing import NDArray
from plain import posed
from scenes import Cases
from solvers import Go, Read

STEPS = 20_000

Array = NDArray[np.float64]
Make = Callable[[Any], Callable[..., tuple[Any, ...]]]
Advance = Callable[[Array, Array, Array, Array], Array]
"""Takes begin, end, states and constants, a column a case; returns the states at the end, NaN without an answer."""
Engine = Callable[[Make, float], Advance]
"""Takes the maker of a right-hand side, see `forms.Form`, and a tolerance."""


def single(form: forms.Form, engine: Engine) -> Callable[[Cases, float], tuple[Go, Read]]:
    """Make a solver of cases that are one integration each."""

    def prepare(cases: Cases, accuracy: float) -> tuple[Go, Read]:
        problem, states, _, read = posed(form, cases)
        advance = engine(form.make, accuracy)

        def go() -> None:
            states[:] = advance(problem.begin, problem.end, problem.states, problem.constants)

        return go, read

    return prepare


@cache
def taylor(make: Make, sizes: tuple[int, int], tolerance: float, batch: int) -> Any:
    """Return an integrator of heyoka, for numbers of states and constants; on the paper's form, with the event."""
    import heyoka as hy

    hy.set_logger_level_critical()
    count, given = sizes
    names = [f"y{state}" for state in range(count)]
    states = [hy.make_vars(names[0])] if count == 1 else list(hy.make_vars(*names))
    constants = [hy.par[number] for number in range(given)]
    system = list(zip(states, make(hy.exp)(hy.time, states, constants), strict=True))
    if make is forms.RATE.make:
        event = hy.t_event(forms.distance(states[1], constants[0]) - states[0], direction=hy.event_direction.negative)
        return hy.taylor_adaptive(system, state=np.ones(count), pars=np.zeros(given), tol=tolerance, t_events=[event])
    zeros = np.zeros((count, batch)), np.zeros((given, batch)), np.zeros(batch)
    return hy.taylor_adaptive_batch(system, state=zeros[0], pars=zeros[1], time=zeros[2], tol=tolerance)


def heyoka(batch: int) -> Engine:
    """Return heyoka in batches of lanes."""

    def engine(make: Make, accuracy: float) -> Advance:
        def advance(begin: Array, end: Array, first: Array, constants: Array) -> Array:
            solver = taylor(make, (first.shape[0], constants.shape[0]), accuracy, batch)
            state, pars = solver.state, solver.pars
            states, times = np.empty_like(first), np.empty_like(end)
            for start in range(0, end.size, batch):
                part = slice(start, start + batch)
                size = end[part].size
                if size < batch:  # the last lane again, to fill the batch
                    part = np.minimum(np.arange(start, start + batch), end.size - 1)
                solver.set_time(begin[part])
                state[:] = first[:, part]
                pars[:] = constants[:, part]
                solver.propagate_until(end[part], max_steps=STEPS)
                states[:, start : start + size] = state[:, :size]
                times[start : start + size] = solver.time[:size]
            states[:, np.abs(times - end) > 1e-14 * (1.0 + np.abs(end))] = np.nan
            return states

        return advance

    return engine


@cache
def _compiled(make: Make, method: str) -> tuple[object, Callable[..., None]]:
    """Return a right-hand side, to be kept as long as the solver of CyRK for it, and that solver."""
    from CyRK import nbsolve2_ivp
    from CyRK.nb.numba_solver import cyjit_sig

    compiled = nb.njit(make(math.exp), error_model="numpy")

    def rhs(dy, t, y, a):  # type: ignore[no-untyped-def]
        out = compiled(t, y, a)
        for state in range(len(out)):
            dy[state] = out[state]

    callback = nb.cfunc(cyjit_sig)(rhs)
    address = callback.address

    @nb.njit
    def solve(begin, end, first, constants, tolerance, states):  # type: ignore[no-untyped-def]
        for case in range(begin.size):
            found = nbsolve2_ivp(
                address, (begin[case], end[case]), first[:, case].copy(), method, None, False,
                constants[:, case].copy(), tolerance, tolerance, max_num_steps=STEPS,
            )  # fmt: skip
            if found.success:
                y = found.y
                states[:, case] = y[:, y.shape[1] - 1]
            else:
                states[:, case] = np.nan
            found.free()

    return callback, solve


def cyrk(method: str) -> Engine:
    """Return CyRK, case by case from compiled code."""

    def engine(make: Make, accuracy: float) -> Advance:
        kept, solve = _compiled(make, method)

        def advance(begin: Array, end: Array, first: Array, constants: Array) -> Array:
            states = np.full_like(first, np.nan)
            if kept.address:
                solve(begin, end, first, constants, accuracy, states)
            return states

        return advance

    return engine


@cache
def diffrax_solve(make: Make, method: str) -> Callable[..., tuple[Any, Any, Any]]:
    """Return a compiled solver of many cases; on the paper's form it ends at the instability."""
    import diffrax as dx
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    rhs = make(jnp.exp)
    term = dx.ODETerm(lambda t, y, a: jnp.stack(rhs(t, y, a)))
    solver = getattr(dx, method)()
    own = make is forms.RATE.make
    event = dx.Event(lambda t, y, args, **_: forms.distance(y[1], args[0]) - y[0]) if own else None
    good = dx.RESULTS.event_occurred if event else dx.RESULTS.successful

    def one(begin, end, first, constants, tolerance):  # type: ignore[no-untyped-def]
        solution = dx.diffeqsolve(
            term, solver, begin, end, None, first, args=constants, event=event, throw=False, max_steps=4096,
            stepsize_controller=dx.PIDController(rtol=tolerance, atol=tolerance), saveat=dx.SaveAt(t1=True),
            adjoint=dx.ForwardMode(),
        )  # fmt: skip
        return solution.ts[-1], solution.ys[-1], solution.result == good

    return jax.jit(jax.vmap(one, in_axes=(0, 0, 1, 1, None), out_axes=(0, 1, 0)))


def diffrax(method: str) -> Engine:
    """Return diffrax, all cases in one call; their number is filled up to a power of two, as each is compiled for."""

    def engine(make: Make, accuracy: float) -> Advance:
        solve = diffrax_solve(make, method)

        def advance(begin: Array, end: Array, first: Array, constants: Array) -> Array:
            every = np.minimum(np.arange(max(1 << (end.size - 1).bit_length(), 32)), end.size - 1)
            _, state, well = solve(begin[every], end[every], first[:, every], constants[:, every], accuracy)
            return np.where(np.asarray(well), np.asarray(state), np.nan)[:, : end.size]

        return advance

    return engine


def scipy(method: str) -> Engine:
    """Return ``solve_ivp``, case by case, on a compiled right-hand side."""
    from scipy.integrate import solve_ivp

    def engine(make: Make, accuracy: float) -> Advance:
        compiled = _for_scipy(make)

        def advance(begin: Array, end: Array, first: Array, constants: Array) -> Array:
            states = np.full_like(first, np.nan)
            for case in range(end.size):
                own = constants[:, case].copy()
                solution = solve_ivp(
                    lambda t, y, own=own: compiled(t, y, own), (begin[case], end[case]), first[:, case], method,
                    rtol=max(accuracy, 3e-14), atol=accuracy,
                )  # fmt: skip
                if solution.status == 0:
                    states[:, case] = solution.y[:, -1]
            return states

        return advance

    return engine


@cache
def _for_scipy(make: Make) -> Callable[..., tuple[float, ...]]:
    compiled: Callable[..., tuple[float, ...]] = nb.njit(make(math.exp), error_model="numpy")
    return compiled
