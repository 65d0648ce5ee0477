"""Explicit Runge-Kutta steps of the scalar form of `forms/area_strain.py` over a block of lanes."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import device
from ..runge_kutta.step import make_sequence, make_weighted_sum
from ..runge_kutta.tableaus import Row, Tableau
from .free_film import FREE
from .state import NEW, SLOPES, TRIAL, AreaMethod, RisingForm, V, Y

# Factor of the third difference of the slopes with which it is, raised to h**5, below the estimate of order 5 in the
# median; measured on random ramps.
DIFFERENCE = 0.002


def _make_stage(weights: Row, stage: int, rhs: Callable[..., Any]) -> Callable[..., Any]:
    """Make ``stage(w)``: the slope at one stage, in every lane."""
    weighted_sum = make_weighted_sum(weights, SLOPES, states=1)
    node = sum(weights)
    target = SLOPES + stage

    @device
    def one_stage(w):
        for i in range(w.shape[1]):
            y = w[Y, i] + w[TRIAL, i] * weighted_sum(w, i, 0)
            w[target, i] = rhs(w, i, w[V, i] + node * w[TRIAL, i], y)

    return one_stage


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
    estimates = [make_weighted_sum(weights, SLOPES, states=1) for weights in tableau.errors]
    if len(estimates) == 1:
        (fourth,) = estimates
        third = make_weighted_sum(_third_difference(tableau), SLOPES, states=1)

        @device
        def embedded(w, i, size):
            # An estimate that vanishes like h**5, and a difference that vanishes like h**4, raised to h**5: y is even
            # in v at first, so that the estimate, odd in h to leading order, is smaller there than the error; and like
            # every single one it changes sign.
            a = abs(size * fourth(w, i, 0))
            b = abs(size * third(w, i, 0))
            return max(a, b * np.sqrt(np.sqrt(b)))

        return embedded
    fifth, third = estimates

    @device
    def extrapolated(w, i, size):
        # Estimates that vanish like h**6 and h**4, each raised to h**9, and the larger taken: Hairer's own blend of
        # the two is zero wherever the first one changes sign, which a scalar equation makes happen.
        a = abs(size * fifth(w, i, 0))
        b = abs(size * third(w, i, 0))
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


def make_explicit(tableau: Tableau, form: RisingForm = FREE) -> AreaMethod:
    """Make the steps of a Runge-Kutta method with an embedded error estimate."""
    rhs = form.rhs
    stages = make_sequence([_make_stage(row, stage + 1, rhs) for stage, row in enumerate(tableau.rows)])
    solution = make_weighted_sum(tableau.weights, SLOPES, states=1)
    last = SLOPES + tableau.stages
    # Measured (studies/tolerance): the estimate raised to h**9 is far above the error, that of order 5 is close to it.
    # They make repetitions rare; what is accepted in the end is decided by the error carried along.
    tolerance_factor = 1.5 if len(tableau.errors) == 2 else 0.2

    @device
    def attempt(w):
        stages(w)
        for i in range(w.shape[1]):
            w[NEW, i] = w[Y, i] + w[TRIAL, i] * solution(w, i, 0)
            w[last, i] = rhs(w, i, w[V, i] + w[TRIAL, i], w[NEW, i])

    error, root = _make_error(tableau), _make_root(tableau.error_order)
    return AreaMethod(attempt, error, root, True, tolerance_factor, last, last + 1, form)
