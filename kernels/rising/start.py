"""Start of a climb: where to enter the slow manifold, what a cell needs for its steps, the first state of a lane.

The derivations are in docs/theory: slow_manifold.md for the entry, tolerance.md for the tolerances.
"""

import numpy as np

from .._jit import device
from ..forms.area_strain import excess_and_flow, jacobian, rhs
from ..model import CRITICAL_LOAD, CRITICAL_U
from .state import (
    CLIMBING,
    FIELD,
    GLOBAL_ERROR,
    INVERSE_TOLERANCE,
    JACOBIAN,
    LANDING,
    PREVIOUS,
    RATE,
    SLOPES,
    SPEED,
    START_JACOBIAN,
    START_SLOPE,
    START_STEP,
    START_V,
    START_Y,
    STATUS,
    STEP,
    TARGET,
    Y_CEILING,
    Y_FLOOR,
    P,
    V,
    Y,
)

# A root of (5.4) beyond this is none of a slow ramp: the climb begins with the unloaded film (u = 1). Where it lies
# bears on the cost alone; the damping is that required.
LARGEST_ENTRY = 0.97
# y_floor, (7.1), is that of the slow manifold where a damping of 1 is left, no farther from the fold than u = 0.8 and
# no larger than 0.1. Like the first step below, it bears on the cost: `land` accepts by the error carried along.
FLOOR_DAMPING = 1.0
FLOOR_U = 0.8
LARGEST_FLOOR = 0.1
# The first step from v = 0, where y = v**2 to leading order: the v at which y is 0.09 y_floor.
FIRST_STEP = 0.3
LARGEST_FIRST_STEP = 0.1
# On the slow manifold: the length at which an explicit method is at its limit of stability, |J| h = 2 and more.
STABLE_STEP = 2.0
# Largest dr/dT on the physical branch, 2 (4**(1/3) - 4**(-2/3)) = 2.3811, rounded up; see (7.2).
LARGEST_FLOW = 2.382


@device
def slow_manifold_entry(p, rate, damping):
    """Return u of the relaxed film from which on an error decays by exp(-damping) before the largest load.

    Errors relative to the slow manifold decay at the rate ``nu = 6 u q/(q + 3 p u)``, q = -de/du of the relaxed film,
    until its largest load is reached at q = 0. With ``e <= e_C``

        Phi = integral of nu dT >= q**3/(12 e_C k u (q + 3 p u)),

    q = 4 u**3 - 1 at the entry, a bound that Newton's method makes equal to the damping required, from above: stopped
    early, it gives more.

    Returns
    -------
    float
        u at the entry; 1 where an error decays by less over the whole ramp.
    """
    scale = 12.0 * CRITICAL_LOAD * rate * damping
    cube = 3.0 * scale * p * CRITICAL_U
    fourth = np.sqrt(np.sqrt(cube))
    sixteenth = np.sqrt(np.sqrt(fourth))
    # 1.2 cube**(21/64) is above the cube root, and close enough, where u is below 1.
    above = np.sqrt(scale) + 1.2 * fourth * sixteenth * np.sqrt(np.sqrt(sixteenth))
    u = min(CRITICAL_U + above / (12.0 * CRITICAL_U * CRITICAL_U), 1.0)
    for _ in range(3):
        square = u * u
        q = 4.0 * square * u - 1.0
        below = q + 3.0 * p * u
        value = q * q * q - scale * u * below
        rise = 36.0 * q * q * square - scale * (below + u * (12.0 * square + 3.0 * p))
        u = min(u - value / rise, 1.0)
    return u if scale * (3.0 + 3.0 * p) < 27.0 else 1.0


@device
def slow_manifold_y(u, rate):
    """Y = 1 - (xi/lambda)**2 on the slow manifold, to leading order in the rate."""
    square = u * u
    load_rate = 2.0 * rate * np.sqrt(CRITICAL_LOAD * u * (1.0 - square * u))
    return load_rate / (6.0 * square * (4.0 * square * u - 1.0))


@device
def damping_for(rtol):
    """Damping of the error of the start of a slow ramp that leaves exp(-2) rtol of it; docs/theory/slow_manifold.md."""
    return 2.0 - np.log(rtol)


@device
def _shortest_time_to_failure(field, p):
    """Lower bound (7.2) of the time to failure under a held field; below 0 where the film may fail on its ramp.

    r = xi**2 must grow from 1 until the film cannot carry the field, (25). The logarithm of the largest load is convex
    in r and falls at 2 p/m first; dr/dT is at most `LARGEST_FLOW`, (26).
    """
    return ((1.0 + p) - field * field) / (2.0 * LARGEST_FLOW * p)


@device
def prepare(w, i, rtol, tolerance_factor, damping):
    """Complete what a lane is given, P, RATE and FIELD, by what it takes to climb with results good to ``rtol``.

    ``tolerance_factor`` is the method's, ``damping`` that of `damping_for`, or infinite for a method that begins every
    ramp with the unloaded film.
    """
    rate, field, p = w[RATE, i], w[FIELD, i], w[P, i]
    speed = 2.0 * rate * np.sqrt(CRITICAL_LOAD)
    end = CRITICAL_LOAD * (field - 1.0) * (field + 1.0)
    w[SPEED, i] = speed
    w[TARGET, i] = end
    # (7.3): an error of xi**2 at the corner delays the failure by about half of it, relative to a time longer than the
    # ramp, or by itself divided by dr/dT, which is at least 2 e/m there, relative to one longer than
    # `_shortest_time_to_failure`; the last term is rounding, below which nothing is gained.
    longer = 2.0 * CRITICAL_LOAD * field * field / (1.0 + p) * _shortest_time_to_failure(field, p)
    w[Y_CEILING, i] = max(0.5 * field / rate, longer) + 3e-15 / rtol
    # (7.1); the power 3/4 of m is measured (studies/tolerance): few cells have to begin again.
    w[INVERSE_TOLERANCE, i] = np.sqrt(1.0 + p) * np.sqrt(np.sqrt(1.0 + p)) / (tolerance_factor * rtol)
    # Errors that decay before the fold need not be resolved: neither the start of a slow ramp, nor y to better than
    # it counts where errors cease to decay.
    u = slow_manifold_entry(p, rate, damping)
    y = slow_manifold_y(min(u, LARGEST_ENTRY), rate)
    v = np.sqrt(1.0 / u - 1.0)
    excess, _, _, _ = excess_and_flow(v, y, p)
    late = (u < LARGEST_ENTRY) & (excess < end)  # slow, and the climb does not end before that
    v = v if late else 0.0
    y = y if late else 0.0
    floor = min(LARGEST_FLOOR, slow_manifold_y(min(slow_manifold_entry(p, rate, FLOOR_DAMPING), FLOOR_U), rate))
    w[Y_FLOOR, i] = floor
    w[LANDING, i] = 1.0
    f = rhs(v, y, p, speed)
    grows = jacobian(v, y, f, p, speed)
    w[START_V, i] = v
    w[START_Y, i] = y
    w[START_SLOPE, i] = f
    w[START_JACOBIAN, i] = grows
    w[START_STEP, i] = STABLE_STEP / abs(grows) if late else min(LARGEST_FIRST_STEP, FIRST_STEP * np.sqrt(floor))


@device
def begin(w, i):
    """Set a lane to the state with which its climb begins."""
    w[STATUS, i] = CLIMBING
    w[V, i] = w[START_V, i]
    w[Y, i] = w[START_Y, i]
    w[SLOPES, i] = w[START_SLOPE, i]
    w[JACOBIAN, i] = w[START_JACOBIAN, i]
    w[STEP, i] = w[START_STEP, i]
    w[GLOBAL_ERROR, i] = 0.0
    w[PREVIOUS, i] = 1.0
