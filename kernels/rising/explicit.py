"""Explicit Runge-Kutta steps of the scalar form of `forms/area_strain.py` over a block of lanes."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import device
from ..forms.area_strain import rhs
from ..runge_kutta.tableaus import Row, Tableau
from .state import NEW, SLOPES, SPEED, TRIAL, AreaMethod, P, V, Y

# Factor of the third difference of the slopes with which it is, raised to h**5, below the estimate of order 5 in the
# median; measured on random ramps.
DIFFERENCE = 0.002


def _make_weighted_sum(weights: Row) -> Callable[..., Any]:
    """Make ``weighted_sum(w, i)`` of the slopes; zero weights cost nothing."""
    factors = tuple(weight for weight in weights if weight != 0.0)
    sources = tuple(SLOPES + stage for stage, weight in enumerate(weights) if weight != 0.0)
    count = len(factors)

    @device
    def weighted_sum(w, i):
        total = factors[0] * w[sources[0], i]
        for j in range(1, count):
            total += factors[j] * w[sources[j], i]
        return total

    return weighted_sum


def _make_stage(weights: Row, stage: int) -> Callable[..., Any]:
    """Make ``stage(w)``: the slope at one stage, in every lane."""
    weighted_sum = _make_weighted_sum(weights)
    node = sum(weights)
    target = SLOPES + stage

    @device
    def one_stage(w):
        for i in range(w.shape[1]):
            y = w[Y, i] + w[TRIAL, i] * weighted_sum(w, i)
            w[target, i] = rhs(w[V, i] + node * w[TRIAL, i], y, w[P, i], w[SPEED, i])

    return one_stage


@device
def _nothing(w):
    """Fill an unused place among the stages."""


def _make_stages(tableau: Tableau) -> Callable[..., Any]:
    """Make ``stages(w)``: all slopes but the first, which is there already, and the one at the new state."""
    functions = [_make_stage(row, stage + 1) for stage, row in enumerate(tableau.rows)]
    functions += [_nothing] * (11 - len(functions))
    s1, s2, s3, s4, s5, s6, s7, s8, s9, s10, s11 = functions

    @device
    def stages(w):
        s1(w)
        s2(w)
        s3(w)
        s4(w)
        s5(w)
        s6(w)
        s7(w)
        s8(w)
        s9(w)
        s10(w)
        s11(w)

    return stages


def _third_difference(tableau: Tableau) -> Row:
    """Weights of `DIFFERENCE` times the third divided difference of the slopes at both ends and two stages."""
    nodes = (0.0, *(sum(row) for row in tableau.rows), 1.0)
    chosen = (0, 2, 3, len(nodes) - 1)
    weights = [0.0] * len(nodes)
    for j in chosen:
        weights[j] = DIFFERENCE / math.prod(nodes[j] - nodes[k] for k in chosen if k != j)
    return tuple(weights)


def _make_error(tableau: Tableau) -> Callable[..., Any]:
    """Make ``error(w, i, size)``: estimated relative error of a step, ``size`` being the step over the new state."""
    estimates = [_make_weighted_sum(weights) for weights in tableau.errors]
    if len(estimates) == 1:
        (fourth,) = estimates
        third = _make_weighted_sum(_third_difference(tableau))

        @device
        def embedded(w, i, size):
            # An estimate that vanishes like h**5, and a difference that vanishes like h**4, raised to h**5: y is even
            # in v at first, so that the estimate, odd in h to leading order, is smaller there than the error; and like
            # every single one it changes sign.
            a = abs(size * fourth(w, i))
            b = abs(size * third(w, i))
            return max(a, b * np.sqrt(np.sqrt(b)))

        return embedded
    fifth, third = estimates

    @device
    def extrapolated(w, i, size):
        # Estimates that vanish like h**6 and h**4, each raised to h**9, and the larger taken: Hairer's own blend of
        # the two is zero wherever the first one changes sign, which a scalar equation makes happen.
        a = abs(size * fifth(w, i))
        b = abs(size * third(w, i))
        root = np.sqrt(np.float32(max(a * a, b * b * b)))
        return np.float64(root * np.sqrt(root))

    return extrapolated


def _make_root(order: int) -> Callable[..., Any]:
    """Make ``root(x)``: the order-th root; square roots, which vectorise, where the order allows."""
    if order == 8:

        @device
        def eighth_root(x):
            return np.sqrt(np.sqrt(np.sqrt(x)))

        return eighth_root
    power = np.float32(1.0 / order)

    @device
    def root(x):
        return x**power

    return root


def make_explicit(tableau: Tableau) -> AreaMethod:
    """Make the steps of a Runge-Kutta method with an embedded error estimate."""
    stages = _make_stages(tableau)
    solution = _make_weighted_sum(tableau.weights)
    last = SLOPES + tableau.stages
    # Measured (studies/tolerance): the estimate raised to h**9 is far above the error, that of order 5 is close to it.
    # They make repetitions rare; what is accepted in the end is decided by the error carried along.
    tolerance_factor = 1.5 if len(tableau.errors) == 2 else 0.2

    @device
    def attempt(w):
        stages(w)
        for i in range(w.shape[1]):
            w[NEW, i] = w[Y, i] + w[TRIAL, i] * solution(w, i)
            w[last, i] = rhs(w[V, i] + w[TRIAL, i], w[NEW, i], w[P, i], w[SPEED, i])

    error, root = _make_error(tableau), _make_root(tableau.error_order)
    return AreaMethod(attempt, error, root, True, tolerance_factor, last, last + 1)
