"""Integration loop of a block of lanes: piece by piece of the loading program, until every lane is done."""

from collections.abc import Callable
from typing import Any

from .._jit import device
from ..forms.formulation import THIRD, Formulation, applied_field
from ..lane_state import (
    AT_END,
    BEGINNING,
    BUDGET_SPENT,
    END,
    FAILED,
    FIELD,
    LOCATING,
    PREVIOUS_ERROR,
    RUNNING,
    SLOPE,
    SLOPES,
    STATE,
    STATES,
    STEP,
    TIME,
    TRIAL,
    P,
)
from ..programs import Program
from ..sweep import CRITICAL_FIELD, CRITICAL_INTERNAL_STRETCH, CRITICAL_STRETCH, MODULUS_RATIO, RATE, TIME_TO_FAILURE
from ..sweep import FIELD as FIELD_GIVEN
from .event import DISTANCE_TOLERANCE, make_judge
from .step import make_attempt, make_error
from .tableaus import Tableau


@device
def first_step(w, i):
    """Return the length of a first step, from the derivatives at the state."""
    # 1 % of what changes a state by itself, and the field by its scale; in a steady state, some length. The step
    # control corrects it: the choice affects the cost of the first few steps alone.
    fastest = max(abs(w[SLOPE, i] * w[SLOPES + TIME, i]), 1e-12)
    for state in range(TIME + 1, STATES):
        fastest = max(fastest, abs(w[SLOPES + state, i] / w[STATE + state, i]))
    return 0.01 / fastest


def make_begin(program: Program, formulation: Formulation) -> Callable[..., Any]:
    """Make ``begin(w, i, index, field, rate, step) -> status``: set a lane at the start of a piece of its program.

    The internal stretch stays, the stretch jumps to equilibrium with the field at the start of the piece. ``step``
    is the first step length; zero stands for one found from the derivatives.
    """
    piece = program.piece
    enter = formulation.enter
    derivative = formulation.derivative
    distance = formulation.distance

    @device
    def begin(w, i, index, field, rate, step):
        if index == 0:
            w[END, i] = 0.0
            w[STATE + THIRD, i] = 1.0
        start, slope, duration = piece(index, field, rate)
        w[BEGINNING, i] = w[END, i]
        w[STATE + TIME, i] = w[END, i]
        w[FIELD, i] = start
        w[SLOPE, i] = slope
        w[END, i] = w[BEGINNING, i] + duration
        enter(w, i)
        derivative(w, i, STATE, SLOPES)
        w[PREVIOUS_ERROR, i] = 1.0
        w[STEP, i] = step if step > 0.0 else first_step(w, i)
        return FAILED if distance(w, i, STATE) <= DISTANCE_TOLERANCE else RUNNING

    return begin


def make_advance(formulation: Formulation, tableau: Tableau, control: Callable[..., Any]) -> Callable[..., Any]:
    """Make ``advance(w, status, tolerance, attempts)``: all running lanes to the first event of their piece."""
    attempt = make_attempt(tableau, formulation.derivative)
    error = make_error(tableau)
    factor = formulation.tolerance_factor
    aim, judge = make_judge(formulation, control, SLOPES + STATES * tableau.stages)

    @device
    def advance(w, status, tolerance, attempts):
        lanes = w.shape[1]
        for _ in range(attempts):
            running = 0
            for i in range(lanes):
                w[TRIAL, i] = aim(w, i, status[i])
                running += status[i] <= LOCATING
            if running == 0:
                break
            attempt(w)
            error(w, factor * tolerance)
            for i in range(lanes):
                if status[i] <= LOCATING:
                    status[i] = judge(w, i, status[i])
        for i in range(lanes):
            if status[i] <= LOCATING:
                status[i] = BUDGET_SPENT

    return advance


def make_solve(
    program: Program, formulation: Formulation, tableau: Tableau, control: Callable[..., Any]
) -> Callable[..., Any]:
    """Make the solver of `sweep.make_sweep` that steps through the pieces of a program."""
    pieces = program.pieces
    begin = make_begin(program, formulation)
    advance = make_advance(formulation, tableau, control)
    read = formulation.read

    @device
    def solve(w, status, given, tolerance, step, attempts, found):
        lanes = w.shape[1]
        for i in range(lanes):
            w[P, i] = given[MODULUS_RATIO, i] - 1.0
        for index in range(pieces):
            for i in range(lanes):
                if status[i] == (RUNNING if index == 0 else AT_END):
                    status[i] = begin(w, i, index, given[FIELD_GIVEN, i], given[RATE, i], step)
            advance(w, status, tolerance, attempts)
        for i in range(lanes):
            if status[i] == FAILED:
                time = w[STATE + TIME, i]
                stretch, internal = read(w, i)
                found[TIME_TO_FAILURE, i] = time
                found[CRITICAL_STRETCH, i] = stretch
                found[CRITICAL_INTERNAL_STRETCH, i] = internal
                found[CRITICAL_FIELD, i] = applied_field(w, i, time)

    return solve
