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
def rates(stretch, xi, p, sigma, load_rate):
    """Return the rates of the stretch, (24), and of the internal stretch, (26), under a dead load sigma."""
    a = 1.0 / (stretch * stretch)
    b = 1.0 / (xi * xi)
    xi_rate = b * b * xi / a - a * a * xi * xi * xi
    coupling = p * (2.0 * a * b / xi + 4.0 * a * a * a * a * xi * xi * xi)
    factor = (8.0 * a * a * a * (1.0 + p / (b * b)) - 2.0 * (1.0 + p * b)) * a / stretch + 3.0 * sigma * a * a
    return (load_rate + coupling * xi_rate) / factor, xi_rate


@device
def _derivative(w, i, row, target):
    load_rate = 2.0 * CRITICAL_LOAD * applied_field(w, i, w[row + TIME, i]) * w[SLOPE, i]
    stretch_rate, xi_rate = rates(w[row + SECOND, i], w[row + THIRD, i], w[P, i], 0.0, load_rate)
    w[target + TIME, i] = 1.0
    w[target + SECOND, i] = stretch_rate
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
