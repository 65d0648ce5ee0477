"""The fold-regular form: states (T, u, r), independent variable s with dT = (D/m) ds.

    dT/ds = D/m,    du/ds = -(e' + 2 p u h (1/r**2 + 2 r u**3))/m,    dr/ds = 2 h D/m

from (23) and (26). The right-hand sides are rational without a pole at D = 0: the solution is smooth through the
instability, where T has a maximum.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import device
from ..lane_state import FIELD, SLOPE, STATE, TIME, P
from ..model import CRITICAL_LOAD, critical_u, flow, flow_under_field, stiffness, upper_stiffness
from .formulation import SECOND, THIRD, Formulation, applied_field, equilibrium_u


@device
def _enter(w, i):
    field = applied_field(w, i, w[STATE + TIME, i])
    w[STATE + SECOND, i] = equilibrium_u(field, w[STATE + THIRD, i], w[P, i])


def _make_derivative(half_rate: Callable[..., Any]) -> Callable[..., Any]:
    """Make the derivative of the fold-regular form with ``half_rate(w, i, u, r)``, half the rate of r, (26)."""

    @device
    def derivative(w, i, row, target):
        u = w[row + SECOND, i]
        r = w[row + THIRD, i]
        p = w[P, i]
        h = half_rate(w, i, u, r)
        load_rate = 2.0 * CRITICAL_LOAD * applied_field(w, i, w[row + TIME, i]) * w[SLOPE, i]
        scale = 1.0 / (1.0 + p)
        time_rate = stiffness(u, r, p) * scale
        inverse = 1.0 / r
        w[target + TIME, i] = time_rate
        w[target + SECOND, i] = -scale * (load_rate + 2.0 * p * u * h * (inverse * inverse + 2.0 * r * u * u * u))
        w[target + THIRD, i] = 2.0 * h * time_rate

    return derivative


@device
def _from_both(w, i, u, r):
    return flow(u, r)


@device
def _from_load(w, i, u, r):
    p = w[P, i]
    return flow_under_field(u, w[FIELD, i], p) if w[SLOPE, i] == 0.0 and p > 0.0 else flow(u, r)


@device
def _distance(w, i, row):
    r = w[row + THIRD, i]
    p = w[P, i]
    return stiffness(w[row + SECOND, i], r, p) / upper_stiffness(r, p)


@device
def _read(w, i):
    # r is stationary at the instability, where dr/ds = 2 h D: (25) on it is second order in what is left of D.
    r = w[STATE + THIRD, i]
    return 1.0 / np.sqrt(critical_u(r, w[P, i])), np.sqrt(r)


# Measured (studies/tolerance): with this factor the results keep rtol in the region that `dm.methods()` states.
TOLERANCE_FACTOR = 0.02

FOLD = Formulation("fold", TOLERANCE_FACTOR, _enter, _make_derivative(_from_both), _distance, _read)

# The same where, under a constant load, h follows from u alone. From u and r it is a difference of two states whose
# errors drift, and just above the critical field the time to failure amplifies them by 1/(2 (f - 1)).
FOLD_UNDER_LOAD = FOLD._replace(derivative=_make_derivative(_from_load))
