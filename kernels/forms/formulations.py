"""Right-hand sides, event functions and read-outs of the formulations that are stepped with a Runge-Kutta method.

Each formulation has the three states of `lane_state.py`, time T and two of its own, and its own independent variable.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .._jit import device
from ..lane_state import BEGINNING, END, EXCESS, FIELD, SLOPE, STATE, TIME
from ..model import (
    CRITICAL_LOAD,
    critical_u,
    flow,
    flow_under_field,
    instant_gap,
    relative_u,
    stiffness,
    upper_stiffness,
)

SECOND = 1
THIRD = 2


class Formulation(NamedTuple):
    """Plain functions on one lane of a block ``w``; ``row`` and ``target`` are first rows of a set of states.

    Attributes
    ----------
    name : str
        As in the public interface.
    share : float
        Local tolerance over the accuracy asked of the results: below 1 where the form is regular and rtol is a promise
        about the results, 1 where it is no more than a local tolerance.
    enter : callable
        ``enter(w, i)``: bring the stretch into equilibrium with the field, time and internal stretch kept.
    derivative : callable
        ``derivative(w, i, row, target)``: derivatives of the states at ``row`` into ``target``.
    distance : callable
        ``distance(w, i, row)``: positive before the instability, zero at it, negative or NaN behind it.
    read : callable
        ``read(w, i) -> (stretch, internal stretch)`` at the instability.
    """

    name: str
    share: float
    enter: Callable[..., Any]
    derivative: Callable[..., Any]
    distance: Callable[..., Any]
    read: Callable[..., Any]


@device
def applied_field(w, i, time):
    """E/Ec at a time within the lane's piece."""
    return w[FIELD, i] + w[SLOPE, i] * (time - w[BEGINNING, i])


@device
def _equilibrium_u(field, r, p):
    """Physical root u of (23) under a field that the film can carry."""
    # At r = 1 the margin is 1 - field**2/(1 + p); there the difference is taken exactly.
    if r == 1.0:
        gap = instant_gap(field, 1.0 + p) / (1.0 + p)
    else:
        A = upper_stiffness(r, p)
        gap = 1.0 - CRITICAL_LOAD * field * field / (0.75 * A * critical_u(r, p))
    return critical_u(r, p) * (1.0 + relative_u(max(gap, 0.0)))


# The paper's rate form: states (T, lambda, xi), independent variable T, equations (24) and (26) as printed.


@device
def _rate_enter(w, i):
    field = applied_field(w, i, w[STATE + TIME, i])
    xi = w[STATE + THIRD, i]
    w[STATE + SECOND, i] = 1.0 / np.sqrt(_equilibrium_u(field, xi * xi, w[EXCESS, i]))


@device
def _rate_derivative(w, i, row, target):
    stretch = w[row + SECOND, i]
    xi = w[row + THIRD, i]
    p = w[EXCESS, i]
    a = 1.0 / (stretch * stretch)
    b = 1.0 / (xi * xi)
    load_rate = 2.0 * CRITICAL_LOAD * applied_field(w, i, w[row + TIME, i]) * w[SLOPE, i]
    xi_rate = b * b * xi / a - a * a * xi * xi * xi
    coupling = p * (2.0 * a * b / xi + 4.0 * a * a * a * a * xi * xi * xi)
    factor = (8.0 * a * a * a * (1.0 + p / (b * b)) - 2.0 * (1.0 + p * b)) * a / stretch
    w[target + TIME, i] = 1.0
    w[target + SECOND, i] = (load_rate + coupling * xi_rate) / factor
    w[target + THIRD, i] = xi_rate


@device
def _rate_distance(w, i, row):
    xi = w[row + THIRD, i]
    return 1.0 / np.sqrt(critical_u(xi * xi, w[EXCESS, i])) - w[row + SECOND, i]


@device
def _rate_read(w, i):
    return w[STATE + SECOND, i], w[STATE + THIRD, i]


RATE = Formulation("rate", 1.0, _rate_enter, _rate_derivative, _rate_distance, _rate_read)


# The fold-regular form: states (T, u, r), independent variable s with dT = (D/m) ds; all are smooth through D = 0.


@device
def _fold_enter(w, i):
    field = applied_field(w, i, w[STATE + TIME, i])
    w[STATE + SECOND, i] = _equilibrium_u(field, w[STATE + THIRD, i], w[EXCESS, i])


def _make_fold_derivative(half_rate: Callable[..., Any]) -> Callable[..., Any]:
    """Make the derivative of the fold-regular form with ``half_rate(w, i, u, r)``, half the rate of r, (26)."""

    @device
    def fold_derivative(w, i, row, target):
        u = w[row + SECOND, i]
        r = w[row + THIRD, i]
        p = w[EXCESS, i]
        h = half_rate(w, i, u, r)
        load_rate = 2.0 * CRITICAL_LOAD * applied_field(w, i, w[row + TIME, i]) * w[SLOPE, i]
        scale = 1.0 / (1.0 + p)
        time_rate = stiffness(u, r, p) * scale
        inverse = 1.0 / r
        w[target + TIME, i] = time_rate
        w[target + SECOND, i] = -scale * (load_rate + 2.0 * p * u * h * (inverse * inverse + 2.0 * r * u * u * u))
        w[target + THIRD, i] = 2.0 * h * time_rate

    return fold_derivative


@device
def _from_both(w, i, u, r):
    return flow(u, r)


@device
def _from_load(w, i, u, r):
    p = w[EXCESS, i]
    return flow_under_field(u, w[FIELD, i], p) if w[SLOPE, i] == 0.0 and p > 0.0 else flow(u, r)


@device
def _fold_distance(w, i, row):
    r = w[row + THIRD, i]
    p = w[EXCESS, i]
    return stiffness(w[row + SECOND, i], r, p) / upper_stiffness(r, p)


@device
def _fold_read(w, i):
    # r is stationary at the instability, where dr/ds = 2 h D: (25) on it is second order in what is left of D.
    r = w[STATE + THIRD, i]
    return 1.0 / np.sqrt(critical_u(r, w[EXCESS, i])), np.sqrt(r)


FOLD = Formulation("fold", 0.02, _fold_enter, _make_fold_derivative(_from_both), _fold_distance, _fold_read)

# The same where, under a constant load, h follows from u alone. From u and r it is a difference of two that drift,
# which the bottleneck just above the critical field does not forgive.
FOLD_UNDER_LOAD = FOLD._replace(derivative=_make_fold_derivative(_from_load))

FORMULATIONS = {formulation.name: formulation for formulation in (RATE, FOLD)}


@device
def time_left(w, i, row):
    """Time from a state to the end of the piece."""
    return w[END, i] - w[row + TIME, i]
