"""Solvers of NumPy and SciPy, on right-hand sides that Numba compiles; and how a problem is posed to any solver."""

import math
import warnings
from collections.abc import Callable

import forms
import numba as nb
import numpy as np
from forms import Form
from scenes import Cases
from solvers import Answer, Go, Read

EVALUATIONS = 60_000


def posed(form: Form, cases: Cases) -> tuple[forms.Problem, np.ndarray, np.ndarray, Read]:
    """Pose a problem, with room for the ends (NaN so far) and their times."""
    problem = form.pose(cases)
    states, times = np.full(problem.states.shape, np.nan), problem.end.copy()

    def read() -> Answer:
        with np.errstate(invalid="ignore"):
            return form.read(cases, problem, times, states)

    return problem, states, times, read


def numpy_quadrature(cases: Cases, accuracy: float) -> tuple[Go, Read]:
    """Sum the integral over the sinh map."""
    nodes, weights = np.polynomial.legendre.leggauss(int(accuracy))
    rhs = forms.SINH.make(np.exp)
    found = np.empty((2, cases.ratio.size))
    block = 128  # cases at a time, for the caches

    def go() -> None:
        for first in range(0, cases.ratio.size, block):
            part = Cases(*(column[first : first + block] for column in cases))
            problem = forms.SINH.pose(part)
            half = 0.5 * (problem.end - problem.begin)
            places = problem.begin + half * (1.0 + nodes[:, np.newaxis])
            found[0, first : first + block] = half * (weights @ rhs(places, None, problem.constants)[0])
            found[1, first : first + block] = 1.0 / np.sqrt(problem.u)

    return go, lambda: (found[0], found[1])


class _TooLongError(Exception):
    """More evaluations than a case is given."""


def scipy_solver(form: Form, method: str) -> Callable[[Cases, float], tuple[Go, Read]]:
    """Make a solver of ``solve_ivp``, case by case."""
    from scipy.integrate import solve_ivp

    compiled = nb.njit(form.make(math.exp), error_model="numpy")

    def prepare(cases: Cases, accuracy: float) -> tuple[Go, Read]:
        problem, states, times, read = posed(form, cases)

        def one(case: int) -> None:
            constants = problem.constants[:, case].copy()
            count = 0

            def rhs(t: float, y: np.ndarray) -> tuple[float, ...]:
                nonlocal count
                count += 1
                if count > EVALUATIONS:
                    raise _TooLongError
                return compiled(t, y, constants)

            def event(t: float, y: np.ndarray) -> float:
                return float(forms.distance(y[1], constants[0]) - y[0])

            event.terminal, event.direction = True, -1.0
            events = event if form is forms.RATE else None
            span = (problem.begin[case], problem.end[case])
            try:
                solution = solve_ivp(
                    rhs, span, problem.states[:, case], method, rtol=max(accuracy, 3e-14), atol=accuracy, events=events
                )
            except (ValueError, ZeroDivisionError):  # LSODA on "rate": its root finder meets no change of sign
                return
            if solution.status == (1 if events else 0):
                states[:, case], times[case] = solution.y[:, -1], solution.t[-1]

        def go() -> None:
            states[:] = np.nan
            with warnings.catch_warnings(), np.errstate(all="ignore"):
                warnings.simplefilter("ignore")
                try:
                    for case in range(times.size):
                        one(case)
                except _TooLongError:  # the rest would take as long
                    return

        return go, read

    return prepare
