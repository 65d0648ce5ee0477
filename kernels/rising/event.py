"""Location of the event of a climb that a step crossed: the instability, or a given load before it.

The right-hand side of `forms/area_strain.py` is regular on both sides of either event, so a landing is a step or two
of signed length, aimed by the derivatives known where the lane is. Repeating the step with other lengths, as
`runge_kutta/event.py` does for any formulation, takes 25 attempts a cell where a whole climb takes 7, landing included:
some 350 % more (measured: dop853, rtol 1e-6, random ramps).
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import device
from .state import (
    AT_INSTABILITY,
    AT_LOAD,
    GLOBAL_ERROR,
    INVERSE_TOLERANCE,
    LANDING,
    LOAD_EXCESS,
    NEW,
    SLOPES,
    STATUS,
    STEP,
    TARGET,
    TO_INSTABILITY,
    TO_LOAD,
    TRIAL,
    Y_CEILING,
    AreaMethod,
    P,
    V,
    Y,
)

# A landing ends when the first term that its Taylor polynomial leaves out is this fraction of the error allowed: two
# digits of it are left for the constants of that term (docs/theory/area_strain.md).
LEFT = 0.01
# Bound of the third-order error of the highest load, divided by its second-order rise and the distance left. Measured:
# tests/kernels/test_rising_event.py lands next to the load of failure in every regime.
UNCERTAIN = 10.0
# A step cannot be asked for less than some units of rounding.
LARGEST_INVERSE_TOLERANCE = 1e15


@device
def hermite_root(f0, d0, f1, d1, length):
    """Where on a step a quantity vanishes that changes sign over it, from values and derivatives at both ends.

    Returns the distance from the beginning of the step: cubic Hermite interpolation, its root by Newton's method
    within a bracket, to some digits: it gives the length of the next step, which `land` corrects.
    """
    low = 0.0
    high = 1.0
    a = d0 * length
    b = 3.0 * (f1 - f0) - (2.0 * d0 + d1) * length
    c = (d0 + d1) * length - 2.0 * (f1 - f0)
    x = f0 / (f0 - f1)
    for _ in range(3):
        value = f0 + x * (a + x * (b + x * c))
        if (value > 0.0) == (f0 > 0.0):
            low = x
        else:
            high = x
        x = x - value / (a + x * (2.0 * b + 3.0 * x * c))
        if not low < x < high:
            x = 0.5 * (low + high)
    return x * length


def make_landing(method: AreaMethod) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Make ``aim_between(w, i)`` and ``land(w, i, rtol)``: a lane that crossed an event, and one close to it."""
    event = method.form.event
    last = method.last

    @device
    def aim_between(w, i):
        """Length of a step that ends on the event which the last attempt crossed, by cubic interpolation over it."""
        target, length = w[TARGET, i], w[TRIAL, i]
        e0, D0, change0, K0 = event(w, i, w[V, i], w[Y, i], w[SLOPES, i])
        e1, D1, change1, K1 = event(w, i, w[V, i] + length, w[NEW, i], w[last, i])
        if D1 > 0.0 and e1 >= target:
            w[STATUS, i] = TO_LOAD
            w[STEP, i] = hermite_root(e0 - target, K0 * D0, e1 - target, K1 * D1, length)
            return
        fold = hermite_root(D0, change0, D1, change1, length)
        w[STATUS, i] = TO_INSTABILITY
        w[STEP, i] = fold
        # The load rises from its slope at the beginning to no slope at the fold: a parabola estimates how high.
        if e0 + 0.5 * K0 * D0 * fold > target:
            w[STATUS, i] = TO_LOAD
            highest = e0 + 0.5 * K0 * D0 * fold
            w[STEP, i] = fold * (1.0 - np.sqrt((highest - target) / (highest - e0)))

    @device
    def land(w, i, rtol):
        """Decide on a lane close to its event: done, or the signed length of its next step.

        Returns whether the event is reached with an error too large, so that the lane has to begin again.
        """
        v, y, target = w[V, i], w[Y, i], w[TARGET, i]
        e, D, change, K = event(w, i, v, y, w[SLOPES, i])
        if w[STATUS, i] == TO_INSTABILITY:
            aim = -D / change
            # de/dv and dr/dv vanish at the instability: half of either, times the distance, leaves a third-order error.
            highest = e + 0.5 * K * D * aim
            # Whether a load in between is reached takes e relative to what relaxation does to it, which is p.
            allowed = LEFT * rtol * (min(1.0, w[P, i]) if target < math.inf else 1.0) * w[LANDING, i]
            left = abs(aim * aim * aim)
            # Where that error decides between the two events, it counts relative to the time to failure under the load.
            undecided = abs(highest - target) <= UNCERTAIN * abs(aim) * (highest - e)
            if left <= (allowed * min(1.0, w[Y_CEILING, i]) if undecided else allowed):
                if highest <= target:
                    w[LOAD_EXCESS, i] = highest
                    w[STATUS, i] = AT_INSTABILITY
                else:
                    w[STATUS, i] = TO_LOAD
                    aim -= np.sqrt(-2.0 * (highest - target) / (K * change))
        else:
            # e(v + aim) = target, with de/dv = K D and its derivative, which is K dD/dv near the instability.
            gap = target - e
            rise = K * D
            square = rise * rise + 2.0 * K * change * gap
            if square < 0.0:  # the load looks out of reach from here: find its maximum
                w[STATUS, i] = TO_INSTABILITY
                w[STEP, i] = -D / change
                return False
            aim = 2.0 * gap / (rise + np.sqrt(square))
            if aim * aim <= LEFT * rtol * min(1.0, w[Y_CEILING, i]) * w[LANDING, i]:
                w[LOAD_EXCESS, i] = target
                w[STATUS, i] = AT_LOAD
        w[STEP, i] = aim
        # Relative errors of the field and of the stretch at the instability are at most that of r = (1 - y)/u.
        too_large = w[GLOBAL_ERROR, i] > rtol * min(1.0 - y, w[Y_CEILING, i])
        return w[STATUS, i] >= AT_INSTABILITY and too_large and w[INVERSE_TOLERANCE, i] < LARGEST_INVERSE_TOLERANCE

    return aim_between, land
