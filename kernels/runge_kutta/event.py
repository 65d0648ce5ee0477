"""Decision on an attempted step: accept, reject, or adjust its length until it ends on an event.

An event is the instability or the end of the piece, whichever comes first. Its function is the smaller of the
distance to the instability and the time left: positive before the first event, not positive from there on. It is
brought to zero by repeating the step from the same state with another length (Illinois variant of the regula falsi,
with a bisection every third time), so the event is located at the method's own order, with its own error.
"""

import math
from collections.abc import Callable
from typing import Any

from .._jit import device
from ..forms.formulation import Formulation, time_left
from ..lane_state import (
    AT_END,
    ERROR,
    EVENT,
    FAILED,
    HIGH,
    HIGH_EVENT,
    LOCATING,
    LOW,
    LOW_EVENT,
    NEW,
    NOT_FINITE,
    RUNNING,
    SLOPES,
    STATE,
    STATES,
    STEP,
    STEP_COLLAPSED,
    TIME,
    TRIAL,
)

# Time of failure and (25) at a regular form are second order in what is left of the distance: 1e-18, below rounding.
DISTANCE_TOLERANCE = 1e-9
ROUNDING = 4.4e-16  # two units
# A located event at which the distance is still this large was a jump of the numerical solution, not a zero: the square
# root of the smallest rtol that can be asked for, 1e-12.
LARGEST_RESIDUAL = 1e-6


def make_judge(
    formulation: Formulation, control: Callable[..., Any], last_slopes: int
) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Make ``aim(w, i, status)``, the length of the next attempt, and ``judge(w, i, status) -> status`` after it."""
    distance = formulation.distance

    @device
    def event_function(w, i, row):
        value = min(distance(w, i, row), time_left(w, i, row))
        return value if not math.isnan(distance(w, i, row)) else math.nan

    @device
    def aim(w, i, status):
        if status == RUNNING:
            return w[STEP, i]
        if status != LOCATING:
            return 0.0
        low = w[LOW, i]
        width = w[HIGH, i] - low
        fraction = w[LOW_EVENT, i] / (w[LOW_EVENT, i] - w[HIGH_EVENT, i])
        return low + width * min(max(fraction, 0.0), 1.0)

    @device
    def accept(w, i):
        for state in range(STATES):
            w[STATE + state, i] = w[NEW + state, i]
            w[SLOPES + state, i] = w[last_slopes + state, i]

    @device
    def start_locating(w, i):
        w[LOW, i] = 0.0
        w[LOW_EVENT, i] = event_function(w, i, STATE)
        w[HIGH, i] = w[TRIAL, i]
        w[HIGH_EVENT, i] = w[EVENT, i] if w[EVENT, i] <= 0.0 else -w[LOW_EVENT, i]

    @device
    def narrow(w, i):
        length = w[TRIAL, i]
        before = w[HIGH, i] - w[LOW, i]
        if w[EVENT, i] > 0.0:
            w[LOW, i] = length
            w[LOW_EVENT, i] = w[EVENT, i]
            w[HIGH_EVENT, i] *= 0.5
        else:
            w[HIGH, i] = length
            w[HIGH_EVENT, i] = w[EVENT, i] if w[EVENT, i] <= 0.0 else -w[LOW_EVENT, i]
            w[LOW_EVENT, i] *= 0.5
        if w[HIGH, i] - w[LOW, i] > 0.5 * before:  # aim at the middle next
            w[HIGH_EVENT, i] = -w[LOW_EVENT, i]

    @device
    def located(w, i):
        near = distance(w, i, NEW)
        left = time_left(w, i, NEW)
        narrowest = w[HIGH, i] - w[LOW, i] <= ROUNDING * w[HIGH, i]
        on_instability = abs(near) <= DISTANCE_TOLERANCE and left >= -ROUNDING * w[NEW + TIME, i]
        on_end = abs(left) <= ROUNDING * w[NEW + TIME, i] and near > 0.0
        return narrowest or on_instability or on_end

    @device
    def judge(w, i, status):
        w[EVENT, i] = event_function(w, i, NEW)
        if status == RUNNING:
            length = w[TRIAL, i]
            control(w, i, length)
            if not w[ERROR, i] <= 1.0:
                return STEP_COLLAPSED if w[STEP, i] <= 1e-300 or w[NEW + TIME, i] == w[STATE + TIME, i] else RUNNING
            if w[EVENT, i] > 0.0:
                accept(w, i)
                return RUNNING
            start_locating(w, i)
            return LOCATING
        if not located(w, i):
            narrow(w, i)
            return LOCATING
        near = distance(w, i, NEW)
        left = time_left(w, i, NEW)
        accept(w, i)
        if abs(left) < abs(near):
            return AT_END
        if math.isnan(near):
            return NOT_FINITE
        return FAILED if abs(near) <= LARGEST_RESIDUAL else STEP_COLLAPSED

    return aim, judge
