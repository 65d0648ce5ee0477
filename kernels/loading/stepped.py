"""General loading programs by the Runge-Kutta methods that others are compared with, one film after another.

The outcomes follow from the same theorems as in `cells.py`: the load held at the end decides, or the map P of r from
the start of a repetition to its end, P(r1) <= r1. Both are those of the method: nothing estimates how wrong they are.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import Kernel, device
from ..forms.formulation import SECOND, THIRD
from ..lane_state import (
    AMPLITUDE,
    AT_END,
    BEGINNING,
    BUDGET_SPENT,
    END,
    FAILED,
    FAILS_AT_ONCE,
    FIELD,
    FREQUENCY,
    LOCATING,
    NEW,
    PREVIOUS_ERROR,
    RUNNING,
    SIGMA,
    SLOPE,
    SLOPES,
    STATE,
    STATES,
    STEP,
    SURVIVES,
    TIME,
    TRIAL,
    P,
    rows,
)
from ..model import CRITICAL_LOAD, instant_gap
from ..runge_kutta.driver import first_step
from ..runge_kutta.event import DISTANCE_TOLERANCE, make_judge
from ..runge_kutta.step import make_error, make_looped_attempt
from ..runge_kutta.tableaus import Tableau
from .forms import Form, applied_field, carried_load
from .law import LOADED
from .pieces import ENDLESS, describe, field_at_end
from .results import (
    CRITICAL_FIELD,
    CRITICAL_INTERNAL_STRETCH,
    CRITICAL_STRETCH,
    CYCLES_TO_FAILURE,
    FINAL_STRETCH,
    LARGEST_STRETCH,
    RESULTS,
    STEADY_STRETCH_MAX,
    STEADY_STRETCH_MIN,
    TIME_TO_FAILURE,
)

SIGNATURE = (
    "int8[::1], float64[:, ::1], int64[:, ::1], float64[:, ::1], int64, int64, "
    "float64[::1], float64[::1], float64[::1], float64, float64, int64, "
    "int8[::1], float64[:, :]"
)

# How a passage through the pieces ended.
ENDED, FELL, JUMPED, SPENT = range(4)
# What a passage is for, see `cells.py`.
CYCLING, FIXING, PROVING = range(3)

# Bisections of a step in which the stretch turns: its extreme is second order in what is left of the length.
TURNS = 26
# The fixed point of P counts as found when it changes by no more than this, relative to itself, or than the tolerance.
FOUND = 1e-12
# Iterations towards it before cycling goes on, and starts beside it from which P(r1) <= r1 is tried.
ITERATIONS = 12
TRIALS = 5
# Relative distance of a load from the largest one below which rounding decides which is larger.
CLOSE = 2e-15


def _make_advance(form: Form, tableau: Tableau, control: Callable[..., Any]) -> Callable[..., Any]:
    """Make ``advance(w, extremes, tolerance, attempts) -> status, attempts left``: to the first event of the piece.

    ``extremes`` (2,) are the largest stretch on the way, and the smallest one.
    """
    attempt = make_looped_attempt(tableau, form.formulation.derivative)
    error = make_error(tableau)
    last = SLOPES + STATES * tableau.stages
    aim, judge = make_judge(form.formulation, control, last)

    @device
    def find_turn(w, extremes, before):
        """Find the extreme of the stretch within the step from the states and slopes before; w is left as it was."""
        after = np.empty(2 * STATES)
        for row in range(STATES):
            after[row] = w[STATE + row, 0]
            after[STATES + row] = w[SLOPES + row, 0]
            w[STATE + row, 0] = before[row]
            w[SLOPES + row, 0] = before[STATES + row]
        low, high = 0.0, after[TIME] - before[TIME]
        for _ in range(TURNS):
            w[TRIAL, 0] = 0.5 * (low + high)
            attempt(w)
            if (w[last + SECOND, 0] > 0.0) == (before[STATES + SECOND] > 0.0):
                low = w[TRIAL, 0]
            else:
                high = w[TRIAL, 0]
        extremes[0] = max(extremes[0], w[NEW + SECOND, 0])
        extremes[1] = min(extremes[1], w[NEW + SECOND, 0])
        for row in range(STATES):
            w[STATE + row, 0] = after[row]
            w[SLOPES + row, 0] = after[STATES + row]

    @device
    def advance(w, extremes, tolerance, attempts):
        status = RUNNING
        before = np.empty(2 * STATES)
        while status <= LOCATING and attempts > 0:
            for row in range(STATES):
                before[row] = w[STATE + row, 0]
                before[STATES + row] = w[SLOPES + row, 0]
            w[TRIAL, 0] = aim(w, 0, status)
            attempt(w)
            error(w, tolerance)
            status = judge(w, 0, status)
            attempts -= 1
            if w[STATE + TIME, 0] > before[TIME] and status != LOCATING and status != FAILED:  # noqa: PLR1714
                extremes[0] = max(extremes[0], w[STATE + SECOND, 0])
                extremes[1] = min(extremes[1], w[STATE + SECOND, 0])
                if before[STATES + SECOND] * w[SLOPES + SECOND, 0] < 0.0:
                    find_turn(w, extremes, before)
                    attempts -= TURNS
        return (status if status > LOCATING else BUDGET_SPENT), attempts

    return advance


def _make_passage(form: Form, tableau: Tableau, control: Callable[..., Any]) -> Callable[..., Any]:
    """Make ``passage(...)``: through the pieces of a program; how it ended, the time passed, the attempts left."""
    advance = _make_advance(form, tableau, control)
    enter, derivative, distance = form.formulation.enter, form.formulation.derivative, form.formulation.distance
    of_square, square = form.of_square, form.square

    @device
    def jump(w, extremes, E):
        """Bring the film to another field at once; false where it does not carry it."""
        r, p, sigma = square(w[STATE + THIRD, 0]), w[P, 0], w[SIGMA, 0]
        if r == 1.0 and sigma == 0.0:
            beyond = instant_gap(abs(E), 1.0 + p) <= 0.0
        else:
            beyond = np.sqrt(carried_load(r, p, sigma) / CRITICAL_LOAD) <= abs(E)
        w[FIELD, 0] = E
        w[SLOPE, 0] = 0.0
        w[AMPLITUDE, 0] = 0.0
        enter(w, 0)
        extremes[0] = max(extremes[0], w[STATE + SECOND, 0])
        extremes[1] = min(extremes[1], w[STATE + SECOND, 0])
        return not beyond

    @device
    def passage(w, extremes, kind, scale, source, columns, cell, first, until, r, E, tolerance, step, attempts):
        """Through the pieces from the first one on, from r and the field E; after the last, E is held."""
        passed = 0.0
        piece = first
        w[STATE + THIRD, 0] = of_square(r)
        while True:
            start, slope, amplitude, frequency, duration = E, 0.0, 0.0, 0.0, math.inf
            if piece < kind.size:
                start, slope, amplitude, frequency, duration = describe(kind, scale, source, columns, piece, cell)
            # A repetition begins in equilibrium; after that the stretch is what the steps make of it, up to a jump.
            if (start != E or (piece == first and first < kind.size)) and not jump(w, extremes, start):
                return JUMPED, passed, attempts
            E = start
            if duration > 0.0:
                w[FIELD, 0] = start
                w[SLOPE, 0] = slope
                w[AMPLITUDE, 0] = amplitude
                w[FREQUENCY, 0] = frequency
                w[BEGINNING, 0] = 0.0
                w[END, 0] = duration
                w[STATE + TIME, 0] = 0.0
                derivative(w, 0, STATE, SLOPES)
                w[PREVIOUS_ERROR, 0] = 1.0
                w[STEP, 0] = step if step > 0.0 else first_step(w, 0)
                status = FAILED
                if distance(w, 0, STATE) > DISTANCE_TOLERANCE:
                    status, attempts = advance(w, extremes, tolerance, attempts)
                if status != AT_END:
                    return (FELL if status == FAILED else SPENT), passed + w[STATE + TIME, 0], attempts
                passed += duration
            if piece >= kind.size:
                return ENDED, passed, attempts
            end = field_at_end(kind, scale, source, columns, piece, cell)
            if duration == 0.0 and end != E and not jump(w, extremes, end):
                return JUMPED, passed, attempts
            E = end
            piece += 1
            if piece == until:
                return ENDED, passed, attempts

    return passage


def make_stepped(form: Form, tableau: Tableau, control: Callable[..., Any]) -> Kernel:
    """Make the compiled sweep of general loading programs by a Runge-Kutta method.

    Its arguments are those of the package's sweep, with ``step`` and ``attempts`` after ``tolerance``: the step length
    of a method of fixed step, and how many steps a film may take in all before it counts as unresolved.
    """
    passage = _make_passage(form, tableau, control)
    read, square = form.formulation.read, form.square
    critical, load, relaxed_at = LOADED.critical, LOADED.load, LOADED.relaxed_at
    block_rows = rows(tableau.stages)

    @device
    def write_failure(w, state, time, result, cell):
        r, p, sigma = square(w[STATE + THIRD, 0]), w[P, 0], w[SIGMA, 0]
        stretch, internal = read(w, 0)
        field = abs(applied_field(w, 0, w[STATE + TIME, 0]))
        if state == JUMPED:
            stretch, internal = 1.0 / critical(r, p, sigma), np.sqrt(r)
            field = np.sqrt((1.0 + p) if r == 1.0 and sigma == 0.0 else carried_load(r, p, sigma) / CRITICAL_LOAD)
        result[TIME_TO_FAILURE, cell] = time
        result[CRITICAL_STRETCH, cell] = stretch
        result[CRITICAL_INTERNAL_STRETCH, cell] = internal
        result[CRITICAL_FIELD, cell] = field
        return stretch

    @device
    def held_without_end(r, p, sigma, E, result, cell):
        """Return what becomes of a film under the load held at the end, RUNNING if it fails; its final stretch."""
        top = critical(1.0, 0.0, sigma)
        largest = load(1.0, 0.0, sigma, top)
        e = CRITICAL_LOAD * E * E
        if sigma > 0.0 and abs(e - largest) <= CLOSE * largest:
            return BUDGET_SPENT
        stable, unstable = relaxed_at(sigma, abs(E), top)
        carried = abs(E) <= 1.0 if sigma == 0.0 else e <= largest
        if carried and (r * unstable * unstable <= 1.0 or p == 0.0):
            result[FINAL_STRETCH, cell] = 1.0 / stable
            return SURVIVES
        return RUNNING

    def stepped(
        kind,
        scale,
        source,
        columns,
        repeats,
        once,
        modulus_ratio,
        start_stretch,
        dead_load,
        tolerance,
        step,
        attempts,
        status,
        result,
    ):
        w = np.zeros((block_rows, 1))
        extremes = np.empty(2)
        accuracy = max(tolerance, FOUND)
        for cell in range(modulus_ratio.size):
            for row in range(RESULTS):
                result[row, cell] = math.nan
            p, sigma = modulus_ratio[cell] - 1.0, dead_load[cell]
            w[P, 0] = p
            w[SIGMA, 0] = sigma
            r, E, left = start_stretch[cell] * start_stretch[cell], 0.0, attempts
            first, until = 0, once if once > 0 else kind.size
            time, completed, following_trial, largest = 0.0, 0.0, 2.0, 0.0
            purpose, count, return_r, last_r, last_change = CYCLING, 0, r, r, math.inf
            most, least, beside = 0.0, 0.0, 0.0  # of the limit cycle; how far from the fixed point
            verdict = RUNNING
            while verdict == RUNNING:
                extremes[0] = 0.0
                extremes[1] = math.inf
                state, passed, left = passage(
                    w, extremes, kind, scale, source, columns, cell, first, until, r, E, tolerance, step, left
                )
                end = square(w[STATE + THIRD, 0])
                change = end - r
                failed = state == FELL or state == JUMPED  # noqa: PLR1714 -- compiled
                vain = failed
                if state == SPENT:
                    verdict = BUDGET_SPENT
                elif purpose == CYCLING:
                    time += passed
                    largest = max(largest, extremes[0])
                    if failed:
                        largest = max(largest, write_failure(w, state, time, result, cell))
                        if not largest < math.inf:  # a step leapt over the instability, and further steps went nowhere
                            for row in range(RESULTS):
                                result[row, cell] = math.nan
                            verdict = BUDGET_SPENT
                            continue
                        result[LARGEST_STRETCH, cell] = largest
                        verdict = FAILED if time > 0.0 else FAILS_AT_ONCE
                        if repeats != 1 and time > 0.0:
                            result[CYCLES_TO_FAILURE, cell] = completed
                        continue
                    completed += 1.0
                    E = field_at_end(kind, scale, source, columns, kind.size - 1, cell)
                    r = end
                    steady = first == once  # the change is that of P
                    first, until = once, kind.size
                    if completed == repeats:
                        verdict = held_without_end(r, p, sigma, E, result, cell)
                        first = kind.size
                        if verdict == SURVIVES:
                            result[LARGEST_STRETCH, cell] = max(largest, result[FINAL_STRETCH, cell])
                    elif repeats == ENDLESS and steady and change <= 0.0:
                        verdict, most, least = SURVIVES, extremes[0], extremes[1]
                    elif repeats == ENDLESS and steady and completed >= following_trial and change < last_change:
                        purpose, count, return_r = FIXING, 0, end
                        ratio = change / last_change
                        last_r, last_change = end - change, change
                        r = end + change * ratio / (1.0 - ratio)
                    else:
                        last_change = change if steady else math.inf
                elif purpose == FIXING and not failed:
                    slope = (change - last_change) / (r - last_r)
                    following = max(r - change / slope, return_r)
                    count += 1
                    last_r, last_change = r, change
                    if not slope < 0.0 or count > ITERATIONS:
                        vain = True
                    elif abs(following - r) <= accuracy * r:
                        most, least = extremes[0], extremes[1]
                        purpose, count, beside = PROVING, 0, 4.0 * accuracy * r
                        last_r = max(following, r)
                        r = last_r + beside
                    else:
                        r = following
                elif not failed:
                    count += 1
                    if change <= 0.0:
                        verdict = SURVIVES
                    elif count < TRIALS:
                        beside *= 8.0
                        r = last_r + beside
                    else:
                        vain = True
                if vain:
                    purpose, r, last_change = CYCLING, return_r, math.inf
                    following_trial = 2.0 * completed + 1.0
                if verdict == SURVIVES and repeats == ENDLESS:
                    result[STEADY_STRETCH_MAX, cell] = most
                    result[STEADY_STRETCH_MIN, cell] = least
                    result[LARGEST_STRETCH, cell] = max(largest, most)
            status[cell] = verdict

    return Kernel(stepped, SIGNATURE)
