"""Maps of SciPy's solvers on the paper's rate form, written as a user of SciPy would write it."""

import math
import warnings

import numpy as np
from common.internals import model
from numpy.typing import NDArray
from scenes import Cells, Scene
from scipy.integrate import solve_ivp
from verdicts import BUDGET_SPENT, EVENT_MISSED, NOT_FINITE, STEP_COLLAPSED, TOLERANCES, errors, of_answers

METHODS = ("RK45", "DOP853", "Radau", "BDF", "LSODA")
# Calls of the right-hand side; and the time at which a solver that saw nothing is told to stop, in times to failure.
BUDGET = 30_000
LATEST = 3.0


class BudgetSpentError(Exception):
    """Raised from the right-hand side."""


class RateForm:
    """Equations (24) and (26) in time, states (lambda, xi), under a constant field or a ramp."""

    def __init__(self, modulus_ratio: float, field: float, rate: float) -> None:
        self.p = modulus_ratio - 1.0
        self.rate = rate
        self.calls = 0
        margin = model.instant_gap(field, modulus_ratio) / modulus_ratio
        self.start = (1.0 if rate > 0.0 else 1.0 / math.sqrt(model.CRITICAL_U * (1.0 + model.relative_u(margin))), 1.0)

    def __call__(self, time: float, state: NDArray[np.float64]) -> tuple[float, float]:
        """Rates of stretch and internal stretch; NaN where they have no number."""
        self.calls += 1
        if self.calls > BUDGET:
            raise BudgetSpentError
        p, stretch, xi = self.p, float(state[0]), float(state[1])
        try:
            xi_rate = stretch**2 * xi**-3 - stretch**-4 * xi**3
            load_rate = 2.0 * model.CRITICAL_LOAD * self.rate**2 * time
            coupling = p * (2.0 * xi**-3 * stretch**-2 + 4.0 * xi**3 * stretch**-8)
            factor = 8.0 * (1.0 + p * xi**4) * stretch**-9 - 2.0 * (1.0 + p * xi**-2) * stretch**-3
            return (load_rate + coupling * xi_rate) / factor, xi_rate
        except (OverflowError, ZeroDivisionError):
            return math.nan, math.nan

    def distance(self, time: float, state: NDArray[np.float64]) -> float:
        """Event (25): lambda_c - lambda."""
        del time
        square = float(state[1]) ** 2
        return ((1.0 + self.p * square**2) / (0.25 * (1.0 + self.p / square))) ** (1.0 / 6.0) - float(state[0])


def solve(method: str, form: RateForm, end: float, tolerance: float) -> tuple[int | None, NDArray[np.float64]]:
    """Return a verdict, None where a failure is reported, and (time, stretch, field)."""
    nothing = np.full(3, np.nan)

    def event(time: float, state: NDArray[np.float64]) -> float:
        return form.distance(time, state)

    event.terminal = True
    event.direction = -1.0
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            solution = solve_ivp(form, (0.0, end), form.start, method, events=event, rtol=tolerance, atol=tolerance)
    except BudgetSpentError:
        return BUDGET_SPENT, nothing
    except ValueError:  # SciPy's root finder: the dense output does not change sign over the step, its ends do
        return EVENT_MISSED, nothing
    except ZeroDivisionError:
        return NOT_FINITE, nothing
    if solution.status == 1:
        time = solution.t_events[0][0]
        return None, np.array([time, solution.y_events[0][0][0], form.rate * time])
    if not np.isfinite(solution.y[:, -1]).all():
        return NOT_FINITE, nothing
    return (EVENT_MISSED if solution.status == 0 else STEP_COLLAPSED), nothing


def map_of(method: str, scene: Scene, values: NDArray, tolerances: NDArray) -> tuple[NDArray, NDArray]:
    """Return verdicts and errors, (tolerances, values) each."""
    cells: Cells = scene.cells(scene.preferred[0], values)
    kinds = np.empty((tolerances.size, values.size), np.int8)
    sizes = np.full(kinds.shape, np.nan)
    for row, column in np.ndindex(kinds.shape):
        truth = cells.truth[:, [column]]
        field, rate = cells.field[column], cells.rate[column]
        form = RateForm(cells.modulus_ratio[column], field, rate)
        verdict, found = solve(method, form, LATEST * truth[0, 0], tolerances[row])
        if verdict is None:
            if rate == 0.0:
                found[2] = field
            verdict = of_answers(found[:, np.newaxis], truth, TOLERANCES * tolerances[[row]])[0]
            sizes[row, column] = errors(found[:, np.newaxis], truth)[0]
        kinds[row, column] = verdict
    return kinds, sizes
