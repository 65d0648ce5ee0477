"""What the formulations stepped with a Runge-Kutta method have in common: their functions, and the equilibrium (23).

Each formulation has the three states of `lane_state.py`, time T and two of its own, and its own independent variable.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from .._jit import device
from ..lane_state import BEGINNING, END, FIELD, SLOPE, TIME
from ..model import CRITICAL_LOAD, critical_u, instant_gap, relative_u, upper_stiffness

# The formulation's own states, after the time.
SECOND = 1
THIRD = 2


class Formulation(NamedTuple):
    """Plain functions on one lane of a block ``w``; ``row`` and ``target`` are first rows of a set of states.

    Attributes
    ----------
    name : str
        As in the public interface.
    tolerance_factor : float
        Local tolerance divided by the accuracy asked of the results: below 1 where the form is regular and rtol is a
        promise about the results, 1 where rtol is no more than a local tolerance.
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
    tolerance_factor: float
    enter: Callable[..., Any]
    derivative: Callable[..., Any]
    distance: Callable[..., Any]
    read: Callable[..., Any]


@device
def applied_field(w, i, time):
    """E/Ec at a time within the lane's piece."""
    return w[FIELD, i] + w[SLOPE, i] * (time - w[BEGINNING, i])


@device
def time_left(w, i, row):
    """Time from a state to the end of the piece."""
    return w[END, i] - w[row + TIME, i]


@device
def equilibrium_u(field, r, p):
    """Physical root u of (23) under a field that the film can carry."""
    # At r = 1 the margin is 1 - field**2/(1 + p); there the difference is taken exactly.
    if r == 1.0:
        gap = instant_gap(field, 1.0 + p) / (1.0 + p)
    else:
        A = upper_stiffness(r, p)
        gap = 1.0 - CRITICAL_LOAD * field * field / (0.75 * A * critical_u(r, p))
    return critical_u(r, p) * (1.0 + relative_u(max(gap, 0.0)))
