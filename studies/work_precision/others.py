"""Other solvers: those that are installed, each as its documentation says it is fast.

Posing the problem (the state after a sudden load) and reading off the answer are not timed, except for the quadrature.
"""

import importlib.util
import math
from collections.abc import Callable, Iterator
from functools import cache

import forms
import numba as nb
import numpy as np
from forms import Form
from plain import numpy_quadrature, posed, scipy_solver
from scenes import Cases
from solvers import TOLERANCES, Go, Read, Solver

STEPS = 20_000
NODES = (4, 6, 8, 10, 12, 16, 20, 24, 32, 40, 48, 64)
BATCHES = (16, 32)
FEW, SOME = 16, 256
SPARSE = TOLERANCES[::2]


@cache
def _taylor(form: Form, sizes: tuple[int, int], tolerance: float, batch: int) -> object:
    import heyoka as hy

    hy.set_logger_level_critical()
    count, given = sizes
    names = [f"y{state}" for state in range(count)]
    states = [hy.make_vars(names[0])] if count == 1 else list(hy.make_vars(*names))
    constants = [hy.par[number] for number in range(given)]
    system = list(zip(states, form.make(hy.exp)(hy.time, states, constants), strict=True))
    if form is forms.RATE:
        event = hy.t_event(forms.distance(states[1], constants[0]) - states[0], direction=hy.event_direction.negative)
        return hy.taylor_adaptive(system, state=np.ones(count), pars=np.zeros(given), tol=tolerance, t_events=[event])
    zeros = np.zeros((count, batch)), np.zeros((given, batch)), np.zeros(batch)
    return hy.taylor_adaptive_batch(system, state=zeros[0], pars=zeros[1], time=zeros[2], tol=tolerance)


def _heyoka(form: Form, batch: int) -> Callable[[Cases, float], tuple[Go, Read]]:
    def prepare(cases: Cases, accuracy: float) -> tuple[Go, Read]:
        problem, states, times, read = posed(form, cases)
        sizes = (problem.states.shape[0], problem.constants.shape[0])
        lanes = min(batch, problem.end.size)
        solver = _taylor(form, sizes, accuracy, lanes)
        state, pars = solver.state, solver.pars
        begin, end, first, constants = problem.begin, problem.end, problem.states, problem.constants

        def in_batches() -> None:
            for start in range(0, end.size, lanes):
                part = slice(start, start + lanes)
                solver.set_time(begin[part])
                state[:] = first[:, part]
                pars[:] = constants[:, part]
                solver.propagate_until(end[part], max_steps=STEPS)
                states[:, part] = state
                times[part] = solver.time
            states[:, np.abs(times - end) > 1e-14 * (1.0 + np.abs(end))] = np.nan

        def one_by_one() -> None:
            states[:] = np.nan
            for case in range(end.size):
                solver.reset_cooldowns()
                solver.time = 0.0
                state[:] = first[:, case]
                pars[:] = constants[:, case]
                outcome = solver.propagate_until(end[case], max_steps=STEPS)[0]
                if int(outcome.value) == -1:  # the first event ended it
                    states[:, case], times[case] = state, solver.time

        return (one_by_one if form is forms.RATE else in_batches), read

    return prepare


def _cyrk(form: Form, method: str) -> Callable[[Cases, float], tuple[Go, Read]]:
    from CyRK import nbsolve2_ivp
    from CyRK.nb.numba_solver import cyjit_sig

    compiled = nb.njit(form.make(math.exp), error_model="numpy")

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

    def prepare(cases: Cases, accuracy: float) -> tuple[Go, Read]:
        problem, states, _, read = posed(form, cases)
        kept = callback  # as long as the solver is in use

        def go() -> None:
            if kept.address:
                solve(problem.begin, problem.end, problem.states, problem.constants, accuracy, states)

        return go, read

    return prepare


def _cyrk_event(method: str) -> Callable[[Cases, float], tuple[Go, Read]]:
    from CyRK import pysolve_ivp

    compiled = nb.njit(forms.RATE.make(math.exp), error_model="numpy")

    def rhs(dy: np.ndarray, t: float, y: np.ndarray, a: np.ndarray) -> None:
        dy[0], dy[1] = compiled(t, y, a)

    def event(t: float, y: np.ndarray, a: np.ndarray) -> float:
        return float(forms.distance(y[1], a[0]) - y[0])

    event.terminal, event.direction = True, -1

    def prepare(cases: Cases, accuracy: float) -> tuple[Go, Read]:
        problem, states, times, read = posed(forms.RATE, cases)

        def go() -> None:
            for case in range(times.size):
                found = pysolve_ivp(
                    rhs, (0.0, problem.end[case]), problem.states[:, case].copy(), method, events=(event,),
                    args=(problem.constants[:, case].copy(),), rtol=accuracy, atol=accuracy, pass_dy_as_arg=True,
                    max_num_steps=STEPS,
                )  # fmt: skip
                met = found.success and len(found.t_events[0]) > 0
                if met:
                    states[:, case], times[case] = found.y_events[0][:, 0], found.t_events[0][0]

        return go, read

    return prepare


def _diffrax(form: Form, method: str) -> Callable[[Cases, float], tuple[Go, Read]]:
    import diffrax as dx
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    rhs = form.make(jnp.exp)
    term = dx.ODETerm(lambda t, y, a: jnp.stack(rhs(t, y, a)))
    solver = getattr(dx, method)()
    event = dx.Event(lambda t, y, args, **_: forms.distance(y[1], args[0]) - y[0]) if form is forms.RATE else None
    good = dx.RESULTS.event_occurred if event else dx.RESULTS.successful

    def one(begin, end, first, constants, tolerance):  # type: ignore[no-untyped-def]
        solution = dx.diffeqsolve(
            term, solver, begin, end, None, first, args=constants, event=event, throw=False, max_steps=4096,
            stepsize_controller=dx.PIDController(rtol=tolerance, atol=tolerance), saveat=dx.SaveAt(t1=True),
            adjoint=dx.ForwardMode(),
        )  # fmt: skip
        return solution.ts[-1], solution.ys[-1], solution.result == good

    solve = jax.jit(jax.vmap(one, in_axes=(0, 0, 1, 1, None), out_axes=(0, 1, 0)))

    def prepare(cases: Cases, accuracy: float) -> tuple[Go, Read]:
        problem, states, times, read = posed(form, cases)
        given = [jnp.asarray(part) for part in (problem.begin, problem.end, problem.states, problem.constants)]

        def go() -> None:
            time, state, well = solve(*given, accuracy)
            states[:] = np.where(np.asarray(well), np.asarray(state), np.nan)
            times[:] = np.asarray(time)

        return go, read

    return prepare


def others(program: str, quick: bool) -> Iterator[Solver]:
    """Yield the solvers that serve a program and whose library is installed; quick: SciPy alone, a few settings."""
    (margin, *_) = forms.BEST[program]
    step = program == "step"
    if step:
        yield Solver("NumPy quadrature, sinh", "NumPy", False, NODES, numpy_quadrature)
    tolerances = (1e-4, 1e-8) if quick else SPARSE
    for method in ("DOP853",) if quick else ("DOP853", "Radau"):
        yield Solver(f"SciPy {method}, margin", "SciPy", False, tolerances, scipy_solver(margin, method), FEW)
    for method in ("LSODA",) if quick else ("DOP853", "Radau", "LSODA"):
        yield Solver(f"SciPy {method}, rate", "SciPy", True, tolerances, scipy_solver(forms.RATE, method), FEW)
    if quick:
        return
    best = forms.BEST[program]
    if importlib.util.find_spec("heyoka"):
        for form in best:
            for batch in BATCHES:
                name = f"heyoka, {form.name}, {batch} lanes"
                yield Solver(name, "heyoka", False, TOLERANCES, _heyoka(form, batch))
        yield Solver("heyoka, rate", "heyoka", True, TOLERANCES, _heyoka(forms.RATE, 1), SOME)
    if importlib.util.find_spec("CyRK"):
        for form in best:
            for method in ("DOP853", "RK45", "RADAU") if form is margin else ("DOP853", "RK45"):
                yield Solver(f"CyRK {method}, {form.name}", "CyRK", False, TOLERANCES, _cyrk(form, method), SOME)
        yield Solver("CyRK DOP853, rate", "CyRK", True, TOLERANCES, _cyrk_event("DOP853"), FEW)
    if importlib.util.find_spec("diffrax"):
        for form in best:
            for method in ("Tsit5", "Dopri8") if form is margin else ("Dopri8",):
                name = f"diffrax {method}, {form.name}"
                yield Solver(name, "diffrax", False, TOLERANCES, _diffrax(form, method), SOME)
        if not step:
            yield Solver("diffrax Kvaerno5, margin", "diffrax", False, SPARSE, _diffrax(margin, "Kvaerno5"), SOME)
        yield Solver("diffrax Tsit5, rate", "diffrax", True, SPARSE, _diffrax(forms.RATE, "Tsit5"), SOME)
