"""A block of lanes up a ramp, on the scalar form of `area.py`, to the instability or to a given load.

Every lane has its own step length. A lane that crosses an event is brought back onto it by steps of signed length,
aimed by the derivatives known there: the right-hand side is regular on both sides of either event.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ._jit import device
from .area import event, forgotten, growth, load_and_flow, slope, slow_share
from .area_lanes import (
    AT_INSTABILITY,
    AT_LOAD,
    CLIMBING,
    DAMPING,
    EVENT,
    GLOBAL,
    GROWTH,
    LOAD,
    NEW,
    PREVIOUS,
    RATE,
    REFERENCE,
    SCALE,
    SLOPES,
    SPEED,
    SPENT,
    STATUS,
    STEP,
    TARGET,
    TO_INSTABILITY,
    TO_LOAD,
    TOLERANCE,
    TRIAL,
    AreaMethod,
    P,
    V,
    Y,
)
from .model import CRITICAL_LOAD

# A climb takes some tens of steps whatever the rate; a lane that needs so many has met something unforeseen.
ATTEMPTS = 2000
LARGEST_FACTOR = 2.5
SMALLEST_FACTOR = 0.2
SAFETY = 0.9
# A landing ends when what its Taylor polynomial leaves out is this share of the error allowed.
LEFT = 0.01
# What rounding leaves of the tolerance.
SMALLEST_TOLERANCE = 1e-15


@device
def _exponential(x):
    """exp(x) to some 10 % where it matters, never too small by more: rational, so that it vectorises."""
    t = abs(x)
    series = 1.0 + t * (1.0 + t * (0.5 + t * (0.16666666666666666 + t * 0.041666666666666664)))
    return series if x > 0.0 else 1.0 / series


@device
def start_lane(w, i, rate, field, p, rtol, share, damping):
    """Set a lane to climb to a field in Ec or, if that is infinite, to the instability, with an error ``rtol``.

    ``share`` is the method's, ``damping`` that of `damping_for`, or infinite for a method that begins every ramp at
    its beginning.
    """
    w[P, i] = p
    w[RATE, i] = rate
    w[SPEED, i] = 2.0 * rate * np.sqrt(CRITICAL_LOAD)
    w[TARGET, i] = CRITICAL_LOAD * field * field
    # An error of xi**2 at the corner delays the failure by about half of it, in a life that is longer than the ramp;
    # below a few units of rounding there is nothing to gain.
    w[SCALE, i] = 0.5 * field / rate + 3e-15 / rtol
    w[TOLERANCE, i] = share * rtol / (np.sqrt(1.0 + p) * np.sqrt(np.sqrt(1.0 + p)))
    w[DAMPING, i] = damping
    _begin(w, i)


@device
def damping_for(rtol):
    """Damping of what is wrong with the start of a slow ramp, for it not to show in the results."""
    return 2.0 - np.log(rtol)


@device
def _begin(w, i):
    p, rate = w[P, i], w[RATE, i]
    # What the film is to forget need not be resolved: neither the start of a slow ramp, nor y to better than it
    # counts where the film stops forgetting.
    u = forgotten(p, rate, w[DAMPING, i])
    y = slow_share(min(u, 0.97), rate)
    v = np.sqrt(1.0 / u - 1.0)
    load, _, _ = load_and_flow(v, y, p)
    late = (u < 0.97) & (load < w[TARGET, i])  # slow, and the climb does not end before that
    v = v if late else 0.0
    y = y if late else 0.0
    w[REFERENCE, i] = min(0.1, slow_share(min(forgotten(p, rate, 1.0), 0.8), rate))
    w[STATUS, i] = CLIMBING
    w[V, i] = v
    w[Y, i] = y
    f = slope(v, y, p, w[SPEED, i])
    w[SLOPES, i] = f
    w[GROWTH, i] = growth(v, y, f, p, w[SPEED, i])
    # On the slow manifold, close to what an explicit method can stand; near v = 0, where y follows v**2 at first,
    # what its reference lets pass.
    w[STEP, i] = 2.0 / abs(w[GROWTH, i]) if late else min(0.1, 0.3 * np.sqrt(w[REFERENCE, i]))
    w[GLOBAL, i] = 0.0
    w[PREVIOUS, i] = 1.0


@device
def _cubic_root(f0, d0, f1, d1, length):
    """Where on a step a quantity vanishes that changes sign over it, from values and derivatives at both ends.

    Returns the distance from the beginning of the step: cubic Hermite interpolation, bisected and polished.
    """
    low = 0.0
    high = 1.0
    a = d0 * length
    b = 3.0 * (f1 - f0) - (2.0 * d0 + d1) * length
    c = (d0 + d1) * length - 2.0 * (f1 - f0)
    x = f0 / (f0 - f1)
    for _ in range(12):
        value = f0 + x * (a + x * (b + x * c))
        if (value > 0.0) == (f0 > 0.0):
            low = x
        else:
            high = x
        x = x - value / (a + x * (2.0 * b + 3.0 * x * c))
        if not low < x < high:
            x = 0.5 * (low + high)
    return x * length


@device
def _aim_between(w, i, last):
    """Length of a step that ends on the event which the last attempt crossed, by cubic interpolation over it."""
    p, speed, target, length = w[P, i], w[SPEED, i], w[TARGET, i], w[TRIAL, i]
    e0, D0, change0, K0 = event(w[V, i], w[Y, i], w[SLOPES, i], p, speed)
    e1, D1, change1, K1 = event(w[V, i] + length, w[NEW, i], w[last, i], p, speed)
    if D1 > 0.0 and e1 >= target:
        w[STATUS, i] = TO_LOAD
        w[STEP, i] = _cubic_root(e0 - target, K0 * D0, e1 - target, K1 * D1, length)
        return
    fold = _cubic_root(D0, change0, D1, change1, length)
    w[STATUS, i] = TO_INSTABILITY
    w[STEP, i] = fold
    # The load rises from its slope at the beginning to no slope at the fold: a parabola guesses how high.
    if e0 + 0.5 * K0 * D0 * fold > target:
        w[STATUS, i] = TO_LOAD
        highest = e0 + 0.5 * K0 * D0 * fold
        w[STEP, i] = fold * (1.0 - np.sqrt((highest - target) / (highest - e0)))


@device
def _land(w, i, rtol):
    """Verdict on a lane close to its event: done, climbing anew, or the signed length of its next step."""
    v, y, target = w[V, i], w[Y, i], w[TARGET, i]
    e, D, change, K = event(v, y, w[SLOPES, i], w[P, i], w[SPEED, i])
    if w[STATUS, i] == TO_INSTABILITY:
        aim = -D / change
        # de/dv and dr/dv vanish at the instability: half of either, times the distance, leaves a third-order error.
        highest = e + 0.5 * K * D * aim
        # Whether a load in between is reached takes e relative to what relaxation does to it, which is p.
        share = LEFT * rtol * (min(1.0, w[P, i]) if target < math.inf else 1.0)
        if abs(aim * aim * aim) <= share:
            if highest <= target:
                w[LOAD, i] = highest
                w[STATUS, i] = AT_INSTABILITY
            else:
                w[STATUS, i] = TO_LOAD
                aim -= np.sqrt(-2.0 * (highest - target) / (K * change))
    else:
        # e(v + aim) = target, with de/dv = K D and its derivative, which is K dD/dv near the instability.
        gap = target - e
        rise = K * D
        square = rise * rise + 2.0 * K * change * gap
        if square < 0.0:  # the load looks out of reach from here: see how high it gets
            w[STATUS, i] = TO_INSTABILITY
            w[STEP, i] = -D / change
            return
        aim = 2.0 * gap / (rise + np.sqrt(square))
        if aim * aim <= LEFT * rtol * min(1.0, w[SCALE, i]):
            w[LOAD, i] = target
            w[STATUS, i] = AT_LOAD
    w[STEP, i] = aim
    # Relative errors of the field and of the stretch at the instability are at most that of r = (1 - y)/u.
    too_far = w[GLOBAL, i] > rtol * min(1.0 - y, w[SCALE, i]) and w[TOLERANCE, i] > SMALLEST_TOLERANCE
    if w[STATUS, i] >= AT_INSTABILITY and too_far:
        w[TOLERANCE, i] = max(0.1 * w[TOLERANCE, i], SMALLEST_TOLERANCE)
        _begin(w, i)


def make_climb(method: AreaMethod) -> Callable[..., Any]:
    """Make ``climb(w, rtol) -> attempts``: all lanes to their event, or to the end of their attempts."""
    attempt = method.attempt
    error = method.error
    root = method.root
    last = method.last

    @device
    def judge(w):
        events = 0
        for i in range(w.shape[1]):
            length = w[TRIAL, i]
            v = w[V, i] + length
            y = w[NEW, i]
            size = min(max(y, w[REFERENCE, i]), w[SCALE, i])
            estimate = error(w, i, length / size)
            relative = estimate / w[TOLERANCE, i]
            climbing = w[STATUS, i] == CLIMBING
            landing = (w[STATUS, i] > CLIMBING) & (w[STATUS, i] < AT_INSTABILITY)
            # Outside 0 < y < 1, where explicit steps that are too long may lead, lie other branches.
            good = (relative <= 1.0) & (y > 0.0) & (y < 1.0)
            load, h, u = load_and_flow(v, y, w[P, i])
            z = 1.0 - y
            D = 4.0 * u * u * u - 1.0 + w[P, i] * u * (3.0 * z * z - h)
            met = climbing & good & ((D <= 0.0) | (load >= w[TARGET, i]))
            accepted = (climbing | landing) & good & (not met)
            missed = landing & (not good)  # climb on, or go back further, with shorter steps

            now = root(max(relative, 1e-12))
            factor = SAFETY * np.sqrt(w[PREVIOUS, i]) / now
            factor = factor if factor > SMALLEST_FACTOR else SMALLEST_FACTOR  # also where it is NaN
            w[PREVIOUS, i] = now if good else 1.0
            factor = min(factor, LARGEST_FACTOR if good else SAFETY)
            w[STEP, i] = length * factor if climbing | missed else w[STEP, i]
            w[STATUS, i] = CLIMBING if missed & (length > 0.0) else w[STATUS, i]

            stiffness = growth(v, y, w[last, i], w[P, i], w[SPEED, i])
            carried = w[GLOBAL, i] * _exponential(0.5 * length * (w[GROWTH, i] + stiffness)) + estimate * size
            w[GLOBAL, i] = carried if accepted else w[GLOBAL, i]
            w[GROWTH, i] = stiffness if accepted else w[GROWTH, i]
            w[V, i] = v if accepted else w[V, i]
            w[Y, i] = y if accepted else w[Y, i]
            w[SLOPES, i] = w[last, i] if accepted else w[SLOPES, i]
            near = landing & good
            w[EVENT, i] = 1.0 if met else (2.0 if near else 0.0)
            events += met | near
        return events

    @device
    def climb(w, rtol):
        lanes = w.shape[1]
        for attempts in range(ATTEMPTS):
            running = 0
            for i in range(lanes):
                w[TRIAL, i] = w[STEP, i] if w[STATUS, i] < AT_INSTABILITY else 0.0
                running += w[STATUS, i] < AT_INSTABILITY
            if running == 0:
                return attempts
            attempt(w)
            if judge(w) > 0:
                for i in range(lanes):
                    if w[EVENT, i] == 1.0:
                        _aim_between(w, i, last)
                    elif w[EVENT, i] == 2.0:
                        _land(w, i, rtol)
        for i in range(lanes):
            if w[STATUS, i] < AT_INSTABILITY:
                w[STATUS, i] = SPENT
        return ATTEMPTS

    return climb

