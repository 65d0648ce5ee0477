"""Other solvers: those that are installed, on the forms that are best for them and on the paper's own.

Posing the problem (the state after a sudden load) and reading off the answer are not timed, except for the quadrature.
"""

import importlib.util
import math
from collections.abc import Callable, Iterator

import engines
import events
import forms
import numba as nb
import numpy as np
from engines import STEPS, single
from plain import numpy_quadrature, posed, scipy_solver
from scenes import Cases
from solvers import TOLERANCES, Go, Read, Solver
from stages import staged

NODES = (4, 6, 8, 10, 12, 16, 20, 24, 32, 40, 48, 64)
BATCHES = (16, 32)
FEW, SOME = 16, 256
SPARSE = TOLERANCES[::2]


def _heyoka_event(cases: Cases, accuracy: float) -> tuple[Go, Read]:
    problem, states, times, read = posed(forms.RATE, cases)
    solver = engines.taylor(forms.RATE.make, (problem.states.shape[0], problem.constants.shape[0]), accuracy, 1)
    state, pars = solver.state, solver.pars

    def go() -> None:
        states[:] = np.nan
        for case in range(times.size):
            solver.reset_cooldowns()
            solver.time = 0.0
            state[:] = problem.states[:, case]
            pars[:] = problem.constants[:, case]
            outcome = solver.propagate_until(problem.end[case], max_steps=STEPS)[0]
            if int(outcome.value) == -1:  # the first event ended it
                states[:, case], times[case] = state, solver.time

    return go, read


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


def _diffrax_event(cases: Cases, accuracy: float) -> tuple[Go, Read]:
    problem, states, times, read = posed(forms.RATE, cases)
    solve = engines.diffrax_solve(forms.RATE.make, "Tsit5")

    def go() -> None:
        time, state, well = solve(problem.begin, problem.end, problem.states, problem.constants, accuracy)
        states[:] = np.where(np.asarray(well), np.asarray(state), np.nan)
        times[:] = np.asarray(time)

    return go, read


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
                yield Solver(name, "heyoka", False, TOLERANCES, single(form, engines.heyoka(batch)))
        yield Solver("heyoka, rate", "heyoka", True, TOLERANCES, _heyoka_event, SOME)
    if importlib.util.find_spec("CyRK"):
        for form in best:
            for method in ("DOP853", "RK45", "RADAU") if form is margin else ("DOP853", "RK45"):
                yield Solver(
                    f"CyRK {method}, {form.name}", "CyRK", False, TOLERANCES, single(form, engines.cyrk(method)), SOME
                )
        yield Solver("CyRK DOP853, rate", "CyRK", True, TOLERANCES, _cyrk_event("DOP853"), FEW)
    if importlib.util.find_spec("diffrax"):
        for form in best:
            for method in ("Tsit5", "Dopri8") if form is margin else ("Dopri8",):
                name = f"diffrax {method}, {form.name}"
                yield Solver(name, "diffrax", False, TOLERANCES, single(form, engines.diffrax(method)), SOME)
        if not step:
            yield Solver(
                "diffrax Kvaerno5, margin", "diffrax", False, SPARSE, single(margin, engines.diffrax("Kvaerno5")), SOME
            )
        yield Solver("diffrax Tsit5, rate", "diffrax", True, SPARSE, _diffrax_event, SOME)


def others_on_films(program: str, quick: bool) -> Iterator[Solver]:
    """Yield the solvers of films under several pieces or a dead load; quick: SciPy alone, a few settings.

    Under a step there is one piece, in which every film fails, so that there is nothing to be told.
    """
    word = "D" if program == "step" else "told"
    rough = (1e-4, 1e-8) if quick else TOLERANCES[::3]
    yield Solver("SciPy DOP853, events", "SciPy", False, rough, events.untold(events.scipy("DOP853")), FEW)
    yield Solver(f"SciPy DOP853, {word}", "SciPy", False, rough, staged(engines.scipy("DOP853")), FEW)
    if quick:
        return
    if importlib.util.find_spec("heyoka"):
        by_events = events.untold(events.heyoka(BATCHES[0]))
        yield Solver(f"heyoka {BATCHES[0]} lanes, events", "heyoka", False, TOLERANCES, by_events, SOME)
        for batch in BATCHES:
            way = staged(engines.heyoka(batch))
            yield Solver(f"heyoka {batch} lanes, {word}", "heyoka", False, TOLERANCES, way)
    if importlib.util.find_spec("CyRK"):
        for method in ("DOP853", "RK45"):
            yield Solver(f"CyRK {method}, {word}", "CyRK", False, TOLERANCES, staged(engines.cyrk(method)), SOME)
    if importlib.util.find_spec("diffrax"):
        way = staged(engines.diffrax("Dopri8"))
        yield Solver(f"diffrax Dopri8, {word}", "diffrax", False, SPARSE, way, SOME)
