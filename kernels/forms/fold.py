"""The fold-regular form: states (T, u, r), independent variable s with dT = (D/m) ds.

    dT/ds = D/m,    du/ds = -(e' + 2 p u h (1/r**2 + 2 r u**3))/m,    dr/ds = 2 h D/m

from (23) and (26). The right-hand sides are rational without a pole at D = 0: the solution is smooth through the
instability, where T has a maximum.
"""

import numpy as np

from .._jit import device
from ..lane_state import SLOPE, STATE, TIME, P
from ..model import CRITICAL_LOAD, critical_u, flow, stiffness, upper_stiffness
from .formulation import SECOND, THIRD, Formulation, applied_field, equilibrium_u


@device
def _enter(w, i):
    field = applied_field(w, i, w[STATE + TIME, i])
    w[STATE + SECOND, i] = equilibrium_u(field, w[STATE + THIRD, i], w[P, i])


@device
def _derivative(w, i, row, target):
    u = w[row + SECOND, i]
    r = w[row + THIRD, i]
    p = w[P, i]
    h = flow(u, r)
    load_rate = 2.0 * CRITICAL_LOAD * applied_field(w, i, w[row + TIME, i]) * w[SLOPE, i]
    scale = 1.0 / (1.0 + p)
    time_rate = stiffness(u, r, p) * scale
    inverse = 1.0 / r
    w[target + TIME, i] = time_rate
    w[target + SECOND, i] = -scale * (load_rate + 2.0 * p * u * h * (inverse * inverse + 2.0 * r * u * u * u))
    w[target + THIRD, i] = 2.0 * h * time_rate


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

FOLD = Formulation("fold", TOLERANCE_FACTOR, _enter, _derivative, _distance, _read)
