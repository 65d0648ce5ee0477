"""One attempted Runge-Kutta step over a block of lanes: stages, new state, error estimate."""

from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import device
from ..lane_state import ERROR, INPUT, NEW, SLOPES, STATE, STATES, TIME, TRIAL
from .tableaus import Row, Tableau


def make_weighted_sum(weights: Row, slopes: int = SLOPES, states: int = STATES) -> Callable[..., Any]:
    """Make ``weighted_sum(w, i, state)``: the slopes of one state, combined; zero weights cost nothing.

    ``slopes`` is the row of the first slope, ``states`` the number of rows of a stage.
    """
    terms = [(weight, slopes + states * stage) for stage, weight in enumerate(weights) if weight != 0.0]
    factors = tuple(weight for weight, _ in terms)
    first_rows = tuple(row for _, row in terms)
    count = len(terms)

    @device
    def weighted_sum(w, i, state):
        total = 0.0
        for j in range(count):
            total += factors[j] * w[first_rows[j] + state, i]
        return total

    return weighted_sum


def _make_combination(weights: Row, target: int, derivative: Callable[..., Any], slope: int) -> Callable[..., Any]:
    """Make ``combination(w)``: state + trial step * weighted slopes into ``target``, its derivative into ``slope``."""
    weighted_sum = make_weighted_sum(weights)

    @device
    def combination(w):
        for i in range(w.shape[1]):
            for state in range(STATES):
                w[target + state, i] = w[STATE + state, i] + w[TRIAL, i] * weighted_sum(w, i, state)
            derivative(w, i, target, slope)

    return combination


@device
def _nothing(w):
    """Fill an unused place of a sequence."""


def make_sequence(functions: list[Callable[..., Any]]) -> Callable[..., Any]:
    """Make ``sequence(w)`` that calls functions one after the other.

    Every level of nesting is optimised anew by the compiler, so the calls stand side by side, six at a time.
    """
    if len(functions) > 6:
        functions = [make_sequence(functions[k : k + 6]) for k in range(0, len(functions), 6)]
    functions = functions + [_nothing] * (6 - len(functions))
    first, second, third, fourth, fifth, sixth = functions

    @device
    def sequence(w):
        first(w)
        second(w)
        third(w)
        fourth(w)
        fifth(w)
        sixth(w)

    return sequence


def make_attempt(tableau: Tableau, derivative: Callable[..., Any]) -> Callable[..., Any]:
    """Make ``attempt(w)``: from the slopes at the state to the new state and the slopes there, in every lane."""
    combinations = [
        _make_combination(row, INPUT, derivative, SLOPES + STATES * (stage + 1))
        for stage, row in enumerate(tableau.rows)
    ]
    last = SLOPES + STATES * tableau.stages
    return make_sequence([*combinations, _make_combination(tableau.weights, NEW, derivative, last)])


def make_looped_attempt(tableau: Tableau, derivative: Callable[..., Any]) -> Callable[..., Any]:
    """Make what `make_attempt` makes, of the first lane alone, with a loop over the stages: short machine code."""
    last = tableau.stages
    weights = np.zeros((last, last))
    for stage, row in enumerate((*tableau.rows, tableau.weights)):
        weights[stage, : len(row)] = row

    @device
    def attempt(w):
        for stage in range(1, last + 1):
            for state in range(STATES):
                total = 0.0
                for j in range(stage):
                    total += weights[stage - 1, j] * w[SLOPES + STATES * j + state, 0]
                w[NEW + state, 0] = w[STATE + state, 0] + w[TRIAL, 0] * total
            derivative(w, 0, NEW, SLOPES + STATES * stage)

    return attempt


@device
def _scale(w, i, state):
    """Size against which an error in a state counts: its larger value over the step, so all errors are relative."""
    return max(abs(w[STATE + state, i]), abs(w[NEW + state, i]), 1e-300)


def make_error(tableau: Tableau) -> Callable[..., Any]:
    """Make ``error(w, tolerance)``: the largest relative error estimate of the states over the tolerance, per lane."""
    estimates = [make_weighted_sum(weights) for weights in tableau.errors]
    if not estimates:

        @device
        def no_error(w, tolerance):
            w[ERROR, :] = 0.0

        return no_error

    if len(estimates) == 1:
        estimate = estimates[0]
    else:
        fifth, third = estimates

        @device
        def estimate(w, i, state):
            # Hairer's blend of the estimates of order 5 and 3: behaves as one of order 8
            a = fifth(w, i, state)
            b = third(w, i, state)
            return a * a / np.sqrt(a * a + 0.01 * b * b + 1e-300)

    @device
    def error(w, tolerance):
        for i in range(w.shape[1]):
            worst = 0.0
            for state in range(TIME, STATES):
                relative = abs(w[TRIAL, i] * estimate(w, i, state)) / _scale(w, i, state)
                worst = relative if not relative <= worst else worst  # NaN wins
            w[ERROR, i] = worst / tolerance

    return error
