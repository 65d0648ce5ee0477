"""Rising field on a film that is at rest under its dead load: one scalar equation, `rising.state.RisingForm`.

With the stretch lambda_p of the film at rest without field, w_p = 1/lambda_p, ``s = lambda/lambda_p = 1 + v**2`` is
the area-strain form's variable; the state y = 1 - z is the same. In units of w_p, with ``c = w_p**6``, ``P = p w_p**2``
and sigma w_p = 1 - c, since the film is at rest, (18) to (20) and (26) become

    e = (v**2/s**3) (1 + c (s**-1 + .. + s**-5)) + P h/s**4,
    dy/dv = (4 v/s) (z R + h s**-4 (4 P h s**-2 + 2 - 8 c s**-6 - 3 (1 - c)/s))/(R + 2 P H h s**-6),

where ``R = 2 k lambda_p**3 sqrt(e_C e)``: no singularity at the instability, and a positive denominator.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import device
from ..forms.area_strain import DIFFERENCE_STEP, SMALLEST_LOAD_RATE
from ..lane_state import AT_END, BUDGET_SPENT, FAILED
from ..model import CRITICAL_LOAD
from ..rising import state as lane
from ..rising.driver import make_climb_of_cells
from ..rising.explicit import make_explicit
from ..rising.start import FIRST_STEP, LARGEST_FIRST_STEP, LARGEST_FLOOR, STABLE_STEP
from ..rising.state import (
    FIELD,
    INVERSE_TOLERANCE,
    LANDING,
    RATE,
    SHAPE,
    SPEED,
    START_JACOBIAN,
    START_SLOPE,
    START_STEP,
    START_V,
    START_Y,
    TARGET,
    TOP,
    Y_CEILING,
    Y_FLOOR,
    P,
    RisingForm,
)
from ..runge_kutta.tableaus import TABLEAUS
from .climb import (
    LARGEST_Y,
    LATEST,
    REACHED_D,
    REACHED_R,
    REACHED_ROUNDING,
    SHARE,
    damping_of,
    entry_at,
    rounding_of,
    slow_manifold,
    write_failure,
)
from .film import FIELD_T, GAP_I, GAP_T, LOAD_T, W_I, W_T, curvature, unstable_d

# Rows of the states on the slow manifold: with y_floor, and e - e_t, infinite where a ramp begins without field.
LATE_V, LATE_Y, LATE_EXCESS, FLOOR = range(4)
STARTS = 4
# Of the time in `_ceiling`: half of that estimate, and some less.
HOLD_SHARE = 0.4
# y_floor, of which the cost alone depends, is y where a damping of 1 is left, no farther than this share of the way to
# the film without field.
FLOOR_SHARE = 0.5


@device
def _rhs(w, i, v, y):
    """dy/dv; numerator and denominator multiplied by s**10 z**3 leave one division and one square root."""
    c, p = w[SHAPE, i], w[P, i]
    strain = v * v
    s = 1.0 + strain
    square = s * s
    fourth = square * square
    sixth = fourth * square
    z = 1.0 - y
    z2 = z * z
    less = y * (1.0 + z + z2)  # 1 - z**3
    bend = p * less * fourth
    sums = fourth * (s + c) + c * ((square + 1.0) * s + square + 1.0)
    rate = (w[SPEED, i] * np.sqrt((strain * sums * z + bend) * z) + SMALLEST_LOAD_RATE) * sixth * z2
    rise = z * (rate + less * ((2.0 * sixth - 3.0 * (1.0 - c) * fourth * s - 8.0 * c) * z + 4.0 * bend))
    return 4.0 * v * rise / (s * (rate + 2.0 * bend * (1.0 + 2.0 * z2 * z)))


@device
def _parts(w, i, v, y):
    """Return e - e_t, D, and x = 1/s, z, h of a state."""
    c, top = w[SHAPE, i], w[TOP, i]
    z = 1.0 - y
    s = 1.0 + v * v
    inverse = 1.0 / (s * z)
    x = inverse * z
    h = y * (1.0 + z + z * z) * (inverse * s)
    d = x - top
    G, _ = curvature(d, top, 1.0, c, 1.0 - c)
    square = x * x
    bend = w[P, i] * square
    relaxed = d * (8.0 * c * (square * x + top * top * top) * (square + x * top + top * top) + 3.0 * (1.0 - c))
    return bend * square * h - d * d * G, relaxed + 2.0 * bend * (3.0 * z * z - h), x, z, h


@device
def _look(w, i, v, y):
    excess, stiffness, _, _, _ = _parts(w, i, v, y)
    return excess, stiffness


@device
def _event(w, i, v, y, slope):
    c = w[SHAPE, i]
    excess, D, x, z, h = _parts(w, i, v, y)
    H = 1.0 / (z * z) + 2.0 * z
    square = x * x
    bend = w[P, i] * square
    of_x = 48.0 * c * square * square * x + 3.0 * (1.0 - c) + 4.0 * w[P, i] * x * (3.0 * z * z - h)
    change = -2.0 * (v * square * of_x + bend * (6.0 * z + H) * slope)
    load = v * v * square * x * (1.0 + c * x * (1.0 + x * (1.0 + x * (1.0 + x * (1.0 + x))))) + bend * square * h
    rate = w[SPEED, i] * np.sqrt(load) + SMALLEST_LOAD_RATE
    return excess, D, change, 2.0 * v * square * x * rate / (rate + 2.0 * bend * square * square * H * h)


@device
def _prepare(w, i, rtol, tolerance_factor, damping):
    w[Y_CEILING, i] = max(w[Y_CEILING, i], 0.5 * w[FIELD, i] / w[RATE, i]) + 3e-15 / rtol
    w[INVERSE_TOLERANCE, i] /= tolerance_factor * rtol
    # Where a slow ramp's film leaves the slow manifold, r bends within a distance that its y there measures.
    w[LANDING, i] = w[Y_FLOOR, i] / LARGEST_FLOOR
    v, y = w[START_V, i], w[START_Y, i]
    f = _rhs(w, i, v, y)
    grows = (_rhs(w, i, v, y + DIFFERENCE_STEP * y) - f) / (DIFFERENCE_STEP * y + 1e-300)
    first = min(LARGEST_FIRST_STEP, FIRST_STEP * np.sqrt(w[Y_FLOOR, i]))
    w[START_SLOPE, i] = f
    w[START_JACOBIAN, i] = grows
    w[START_STEP, i] = STABLE_STEP / abs(grows) if y > 0.0 else first


AT_REST = RisingForm(_rhs, _look, _event, _prepare)


@device
def is_at_rest(start, sigma):
    """Whether a film is in equilibrium with its load before the field rises: pre-stretched by it, or free."""
    return start > 1.0 or sigma == 0.0


@device
def start_of(film, cell, starts, p, start, sigma, rate, damping):
    """Fill in a column of ``starts``, (STARTS, cells): where a slow ramp enters the slow manifold, and y_floor."""
    w_t, load_t = film[W_T, cell], film[LOAD_T, cell]
    first = 1.0 / start
    relaxed = first - w_t
    entry = entry_at(w_t, sigma, p, load_t, relaxed, rate, damping)
    y, u, _, _, G = slow_manifold(w_t, sigma, load_t, rate, entry)
    z = 1.0 - y
    nearer = min(entry / np.sqrt(np.sqrt(damping)), FLOOR_SHARE * relaxed)
    floor, _, _, _, _ = slow_manifold(w_t, sigma, load_t, rate, nearer)
    good = (entry < LATEST * relaxed) & (y < LARGEST_Y)
    starts[LATE_EXCESS, cell] = p * u * u * y * (1.0 + z + z * z) / z - entry * entry * G if good else math.inf
    starts[LATE_V, cell] = np.sqrt((relaxed - entry) / (w_t + entry))
    starts[LATE_Y, cell] = y
    starts[FLOOR, cell] = min(LARGEST_FLOOR, floor)


@device
def _ceiling(film, cell, p, first):
    """Return the shortest hold, roughly, over its delay by a relative error of r at its beginning.

    r rises from r_0 by more than the spare load e_i - e over ``S = -de_c/dr = p (w_i**2/r_0**2 + 2 r_0 w_i**8)``, at a
    rate of no more than its largest, and of no less than e/(2 e_i) of that at the beginning.
    """
    u = film[W_I, cell] * film[W_I, cell]
    spare = max(film[GAP_I, cell], 0.0)
    load = film[LOAD_T, cell] + film[GAP_T, cell]
    cube = u * u * u
    a = first * first
    fall = p * u * (a + 2.0 * cube / (a * a)) + 1e-300
    return HOLD_SHARE * load / (load + spare) * spare / fall


def make_give(target_of: Callable[..., Any]) -> Callable[..., Any]:
    """Make ``give`` of `rising.driver.make_climb_of_cells`; ``target_of(film, cell, p)`` is e - e_t there."""

    @device
    def give(w, j, cell, cells):
        film, starts, field, rate, modulus_ratio, start = cells
        first = 1.0 / start[cell]
        square = first * first
        p = modulus_ratio[cell] - 1.0
        target = target_of(film, cell, p)
        late = starts[LATE_EXCESS, cell] < min(target, 1e300)
        w[P, j] = p * square
        w[Y_CEILING, j] = _ceiling(film, cell, p, first)
        w[RATE, j] = rate[cell]
        w[FIELD, j] = field[cell] if target < math.inf else math.inf
        w[INVERSE_TOLERANCE, j] = np.sqrt(1.0 + p) * np.sqrt(np.sqrt(1.0 + p))
        w[SHAPE, j] = square * square * square
        w[TOP, j] = film[W_T, cell] * start[cell]
        w[SPEED, j] = 2.0 * rate[cell] * np.sqrt(CRITICAL_LOAD) / (square * first)
        w[TARGET, j] = target / square
        w[START_V, j] = starts[LATE_V, cell] if late else 0.0
        w[START_Y, j] = starts[LATE_Y, cell] if late else 0.0
        w[Y_FLOOR, j] = starts[FLOOR, cell]

    return give


@device
def _state(risen, cell, w_t, start, fraction):
    """Return r and w - w_t at the event, from the state close to it and a fraction of dr/dv there."""
    v, z, aim = risen[lane.REACHED_V, cell], 1.0 - risen[lane.REACHED_Y, cell], risen[lane.REACHED_AIM, cell]
    s = 1.0 + v * v
    change = (4.0 * v * z - risen[lane.REACHED_SLOPE, cell] * s) * s
    v += aim
    return (z * s * s + fraction * aim * change) * start * start, 1.0 / (start * (1.0 + v * v)) - w_t


@device
def read_failure(risen, cell, film, p, start, sigma, rate, result):
    """Write what a cell found at the instability; returns its status."""
    # dr/dv vanishes at the instability: half of it acts over the distance left.
    r, d = _state(risen, cell, film[W_T, cell], start, 0.5)
    excess = risen[lane.REACHED_LOAD_EXCESS, cell] / (start * start)
    field = film[FIELD_T, cell] * np.sqrt(1.0 + excess / film[LOAD_T, cell])
    if not field / rate < math.inf:
        return BUDGET_SPENT
    write_failure(
        result, cell, field / rate, film[W_T, cell] + unstable_d(p, 1.0 / r, film[W_T, cell], sigma, d), r, field
    )
    return FAILED


@device
def read_end(risen, cell, film, start, reached):
    """Write how a cell reached the field at which it is held, in ``reached``, as `climb.make_climb` does."""
    r, d = _state(risen, cell, film[W_T, cell], start, 1.0)
    y = risen[lane.REACHED_Y, cell]
    z = 1.0 - y
    reached[REACHED_R, cell] = r
    reached[REACHED_D, cell] = d
    reached[REACHED_ROUNDING, cell] = rounding_of(r, y * (1.0 + z + z * z) / z)


def make_rise(target_of: Callable[..., Any], lanes: int) -> Callable[..., Any]:
    """Make ``rise(film, field, rate, modulus_ratio, start, sigma, rtol, status, reached, result)``, as `make_climb`.

    It takes the cells of status RUNNING, films at rest.
    """
    method = make_explicit(TABLEAUS["dop853"], AT_REST)
    climb_of_cells = make_climb_of_cells(method, make_give(target_of), lanes)

    @device
    def rise(film, field, rate, modulus_ratio, start, sigma, rtol, status, reached, result):
        starts = np.empty((STARTS, status.size))
        risen = np.empty((len(lane.REACHED), status.size))
        damping = damping_of(rtol)
        for cell in range(status.size):
            start_of(film, cell, starts, modulus_ratio[cell] - 1.0, start[cell], sigma[cell], rate[cell], damping)
        climb_of_cells((film, starts, field, rate, modulus_ratio, start), SHARE * rtol, status, risen)
        for cell in range(status.size):
            p = modulus_ratio[cell] - 1.0
            if status[cell] == FAILED:
                status[cell] = read_failure(risen, cell, film, p, start[cell], sigma[cell], rate[cell], result)
            elif status[cell] == AT_END:
                read_end(risen, cell, film, start[cell], reached)

    return rise
