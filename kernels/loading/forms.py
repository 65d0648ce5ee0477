"""The formulations on which methods are compared under any program and dead load, for the Runge-Kutta driver.

rate    states T, lambda, xi: equations (24) and (26) in time, as the paper prints them
time    states T and r = xi**2: (26) in time, with lambda in equilibrium at every stage

Both are singular at the instability, where the rate of the stretch becomes infinite like 1/sqrt(T_f - T).
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .._jit import device
from ..forms.formulation import SECOND, THIRD, Formulation
from ..forms.rate import rates
from ..lane_state import AMPLITUDE, FIELD, FREQUENCY, SIGMA, SLOPE, STATE, TIME, P
from ..model import CRITICAL_LOAD
from .law import LOADED
from .pieces import WITH_SINES


class Form(NamedTuple):
    """A formulation, and its third state from and to r = xi**2: ``of_square(r)``, ``square(third)``."""

    formulation: Formulation
    of_square: Callable[..., Any]
    square: Callable[..., Any]


# One law serves films with and without a dead load, and one set of pieces those with and without sines.
_critical, _load, _begin = LOADED.critical, LOADED.load, LOADED.begin
_field_of, _rate_of = WITH_SINES.field, WITH_SINES.rate


@device
def applied_field(w, i, time):
    """E/Ec at a time within the lane's piece."""
    return _field_of(time, w[FIELD, i], w[SLOPE, i], w[AMPLITUDE, i], w[FREQUENCY, i])


@device
def _load_rate(w, i, time):
    rate = _rate_of(time, w[FIELD, i], w[SLOPE, i], w[AMPLITUDE, i], w[FREQUENCY, i])
    return 2.0 * CRITICAL_LOAD * applied_field(w, i, time) * rate


@device
def carried_load(r, p, sigma):
    """Largest load that the film carries at an internal stretch, (23) at (25)."""
    return _load(r, p, sigma, _critical(r, p, sigma))


@device
def equilibrium_stretch(r, p, sigma, field):
    """Stretch in equilibrium with a field; that at the instability if the film does not carry the field."""
    x = _critical(r, p, sigma)
    if CRITICAL_LOAD * field * field < _load(r, p, sigma, x):
        x = _begin(r, p, sigma, abs(field))
    return 1.0 / x


@device
def _itself(third):
    return third


@device
def _square(third):
    return third * third


@device
def _enter_time(w, i):
    field = applied_field(w, i, w[STATE + TIME, i])
    w[STATE + SECOND, i] = equilibrium_stretch(w[STATE + THIRD, i], w[P, i], w[SIGMA, i], field)


@device
def _enter_rate(w, i):
    xi = w[STATE + THIRD, i]
    field = applied_field(w, i, w[STATE + TIME, i])
    w[STATE + SECOND, i] = equilibrium_stretch(xi * xi, w[P, i], w[SIGMA, i], field)


@device
def _rate_derivative(w, i, row, target):
    load_rate = _load_rate(w, i, w[row + TIME, i])
    stretch_rate, xi_rate = rates(w[row + SECOND, i], w[row + THIRD, i], w[P, i], w[SIGMA, i], load_rate)
    w[target + TIME, i] = 1.0
    w[target + SECOND, i] = stretch_rate
    w[target + THIRD, i] = xi_rate


@device
def _time_derivative(w, i, row, target):
    """Find the derivatives; the stretch at ``row`` becomes that of equilibrium, its rate tells where it turns."""
    time, r = w[row + TIME, i], w[row + THIRD, i]
    stretch = equilibrium_stretch(r, w[P, i], w[SIGMA, i], applied_field(w, i, time))
    xi = np.sqrt(r)
    stretch_rate, xi_rate = rates(stretch, xi, w[P, i], w[SIGMA, i], _load_rate(w, i, time))
    w[row + SECOND, i] = stretch
    w[target + TIME, i] = 1.0
    w[target + SECOND, i] = stretch_rate
    w[target + THIRD, i] = 2.0 * xi * xi_rate


@device
def _rate_distance(w, i, row):
    xi = w[row + THIRD, i]
    return 1.0 / _critical(xi * xi, w[P, i], w[SIGMA, i]) - w[row + SECOND, i]


@device
def _time_distance(w, i, row):
    """Root of what the load lacks of the largest one, over that: it goes with the stiffness; negative behind."""
    carried = carried_load(w[row + THIRD, i], w[P, i], w[SIGMA, i])
    field = applied_field(w, i, w[row + TIME, i])
    lacking = 1.0 - CRITICAL_LOAD * field * field / carried
    root = np.sqrt(abs(lacking))
    return root if lacking > 0.0 else -root


@device
def _read_rate(w, i):
    return w[STATE + SECOND, i], w[STATE + THIRD, i]


@device
def _read_time(w, i):
    r = w[STATE + THIRD, i]
    return 1.0 / _critical(r, w[P, i], w[SIGMA, i]), np.sqrt(r)


RATE = Form(Formulation("rate", 1.0, _enter_rate, _rate_derivative, _rate_distance, _read_rate), np.sqrt, _square)
TIME_FORM = Form(Formulation("time", 1.0, _enter_time, _time_derivative, _time_distance, _read_time), _itself, _itself)

FORMS = {form.formulation.name: form for form in (RATE, TIME_FORM)}
