"""The rate form of the paper: states (T, lambda, xi), independent variable T, equations (24) and (26) as printed.

It is singular at the instability, where the rate of the stretch becomes infinite like 1/sqrt(T_f - T), and serves for
comparison.
"""

import numpy as np

from .._jit import device
from ..lane_state import SLOPE, STATE, TIME, P
from ..model import CRITICAL_LOAD, critical_u
from .formulation import SECOND, THIRD, Formulation, applied_field, equilibrium_u


@device
def _enter(w, i):
    field = applied_field(w, i, w[STATE + TIME, i])
    xi = w[STATE + THIRD, i]
    w[STATE + SECOND, i] = 1.0 / np.sqrt(equilibrium_u(field, xi * xi, w[P, i]))


@device
def _derivative(w, i, row, target):
    stretch = w[row + SECOND, i]
    xi = w[row + THIRD, i]
    p = w[P, i]
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
def _distance(w, i, row):
    xi = w[row + THIRD, i]
    return 1.0 / np.sqrt(critical_u(xi * xi, w[P, i])) - w[row + SECOND, i]


@device
def _read(w, i):
    return w[STATE + SECOND, i], w[STATE + THIRD, i]


# No factor makes rtol more than a local tolerance on a singular form.
RATE = Formulation("rate", 1.0, _enter, _derivative, _distance, _read)
