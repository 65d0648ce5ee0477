"""Rising field on a film under a dead load: one scalar equation, `rising.state.RisingForm`.

With the stretch lambda_p of the relaxed film without field, w_p = 1/lambda_p, ``s = lambda/lambda_p = 1 + v**2 - o`` is
the area-strain form's variable; the state y = 1 - z is the same. In units of w_p, with ``c = w_p**6``, ``P = p w_p**2``
and sigma w_p = 1 - c, since that film is at rest, (18) to (20) and (26) become

    e = ((s - 1)/s**3) (1 + c (s**-1 + .. + s**-5)) + P h/s**4,
    dy/dv = (4 v/s) (z R + h s**-4 (4 P h s**-2 + 2 - 8 c s**-6 - 3 (1 - c)/s))/(R + 2 P H h s**-6),

where ``R = 2 k lambda_p**3 sqrt(e_C e)``: no singularity at the instability, and a positive denominator. A film that is
at rest begins there, o = 0. One that creeps first goes through `creep.py`, since its e is a small difference then.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import device
from ..forms.area_strain import DIFFERENCE_STEP, SMALLEST_LOAD_RATE
from ..lane_state import AT_END, BUDGET_SPENT, FAILED, RUNNING
from ..model import CRITICAL_LOAD
from ..rising import state as lane
from ..rising.driver import make_climb_of_cells
from ..rising.explicit import make_explicit
from ..rising.start import LARGEST_FLOOR, STABLE_STEP
from ..rising.state import (
    DECAY_2,
    DECAY_4,
    FIELD,
    INVERSE_TOLERANCE,
    JACOBIAN,
    LANDING,
    OFFSET,
    RATE,
    SHAPE,
    SPEED,
    START_JACOBIAN,
    START_SLOPE,
    START_STEP,
    START_V,
    START_Y,
    STIFF,
    TARGET,
    TOP,
    TRIAL,
    Y_CEILING,
    Y_FLOOR,
    P,
    RisingForm,
)
from ..runge_kutta.tableaus import TABLEAUS
from . import creep
from .film import FIELD_I, FIELD_T, GAP_I, GAP_T, LOAD_T, W_I, W_T, curvature, first_d, unstable_d
from .slow_manifold import cube_root
from .start import (
    CAUTION,
    FIRST_V,
    FIRST_Y,
    FLOOR,
    LONGEST,
    OF_FOURTH,
    OF_SQUARE,
    REST,
    SHIFT,
    STARTS,
    is_at_rest,
    make_starts_of,
    sixteenth_power,
)

# Rows of how the field is reached at which a film is held; the last: error of the time of failure, by rounding of r.
REACHED_R, REACHED_D, REACHED_ROUNDING = range(3)
REACHED = 3
# Units of rounding by which r may be wrong.
ROUNDINGS = 32.0 * 2.0**-52
# Of the accuracy asked of the results; measured, see docs/theory/dead_load.md.
SHARE = 0.6
# Of a film that creeps: the share of the field of a relaxed film to which `creep.py` takes it at least, the share there
# of the accuracy asked, or of this one, and the first step after it, over v and the eighth root of the accuracy.
# Measured, with those of `creep.py`, on 280,000 random films; their cost hardly depends on them.
CREEP_END = 0.5
CREEP_SHARE = 0.2
CREEP_RTOL = 1e-5
STEP_AFTER = 1.3
LARGEST_V = 0.5
# Of the time in `_ceiling`: half of that estimate, and some less.
HOLD_SHARE = 0.4
# Of y, an error that is bounded by what will decay of it.
LARGEST_ERROR = 0.01
# J h at which the error of a step is that of the estimate of order 5 itself. Measured, with the power 3 of J h, on
# ramps that begin on the slow manifold.
STIFF_STEP = 4.5


@device
def _rhs(w, i, v, y):
    """dy/dv; numerator and denominator multiplied by s**10 z**3 leave one division and one square root."""
    c, p = w[SHAPE, i], w[P, i]
    strain = v * v - w[OFFSET, i]
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
    s = 1.0 + (v * v - w[OFFSET, i])
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
    load = (v * v - w[OFFSET, i]) * square * x * (
        1.0 + c * x * (1.0 + x * (1.0 + x * (1.0 + x * (1.0 + x))))
    ) + bend * square * h
    rate = w[SPEED, i] * np.sqrt(load) + SMALLEST_LOAD_RATE
    return excess, D, change, 2.0 * v * square * x * rate / (rate + 2.0 * bend * square * square * H * h)


@device
def _sizes(w, i, v, y, slope):
    """`rising.state.RisingForm`: an error that will decay by exp(-Phi) may be larger by less than exp(Phi).

    Phi = 16 d**2 (c_2 + c_4 d**2), d = x - x_t, is about (8.13) between a damping of 1 and that of the start.
    """
    d = max(1.0 / (1.0 + max(v * v - w[OFFSET, i], 0.0)) - w[TOP, i], 0.0)
    square = d * d
    larger = sixteenth_power(1.0 + square * (w[DECAY_2, i] + square * w[DECAY_4, i]))
    floor = w[Y_FLOOR, i]
    at_first = min(floor * larger, LARGEST_ERROR * y * w[INVERSE_TOLERANCE, i])
    allowed = min(max(max(y, floor), at_first), w[Y_CEILING, i])
    size = min(max(y, slope), max(y, floor))
    stiff = abs(w[JACOBIAN, i] * w[TRIAL, i])
    return size, 1.0 + w[STIFF, i] * stiff * stiff * stiff, size / allowed


@device
def _prepare(w, i, rtol, tolerance_factor, damping):
    w[Y_CEILING, i] = max(w[Y_CEILING, i], 0.5 * w[FIELD, i] / w[RATE, i]) + 3e-15 / rtol
    w[INVERSE_TOLERANCE, i] /= tolerance_factor * rtol
    # The estimate is one of order 5, raised to the power 3/2: a root of it, in a step that is accepted, is the third
    # one of the tolerance.
    w[STIFF, i] = cube_root(w[INVERSE_TOLERANCE, i]) / (STIFF_STEP * STIFF_STEP * STIFF_STEP)
    # Where a slow ramp's film leaves the slow manifold, r bends within a distance that its y there measures.
    w[LANDING, i] = w[Y_FLOOR, i] / LARGEST_FLOOR
    v, y = w[START_V, i], w[START_Y, i]
    f = _rhs(w, i, v, y)
    grows = (_rhs(w, i, v, y + DIFFERENCE_STEP * y) - f) / (DIFFERENCE_STEP * y + 1e-300)
    w[START_SLOPE, i] = f
    w[START_JACOBIAN, i] = grows
    w[START_STEP, i] = min(STABLE_STEP / abs(grows), w[START_STEP, i])


UNDER_LOAD = RisingForm(_rhs, _look, _event, _prepare, _sizes, creep.AFTER_REJECTION)


@device
def write_failure(result, cell, time, w, r, field):
    """Write the results of a film that fails."""
    result[0, cell] = time
    result[1, cell] = 1.0 / w
    result[2, cell] = np.sqrt(r)
    result[3, cell] = field


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
        first = 1.0 / starts[REST, cell]
        square = first * first
        p = modulus_ratio[cell] - 1.0
        target = target_of(film, cell, p)
        w[P, j] = p * square
        w[Y_CEILING, j] = _ceiling(film, cell, p, 1.0 / start[cell])
        w[RATE, j] = rate[cell]
        w[FIELD, j] = field[cell] if target < math.inf else math.inf
        w[INVERSE_TOLERANCE, j] = starts[CAUTION, cell]
        w[SHAPE, j] = square * square * square
        w[DECAY_2, j] = starts[OF_SQUARE, cell] * square
        w[DECAY_4, j] = starts[OF_FOURTH, cell] * square * square
        w[TOP, j] = film[W_T, cell] * starts[REST, cell]
        w[SPEED, j] = 2.0 * rate[cell] * np.sqrt(CRITICAL_LOAD) / (square * first)
        w[TARGET, j] = target / square
        w[START_V, j] = starts[FIRST_V, cell]
        w[START_Y, j] = starts[FIRST_Y, cell]
        w[START_STEP, j] = starts[LONGEST, cell]
        w[Y_FLOOR, j] = starts[FLOOR, cell]
        w[OFFSET, j] = starts[SHIFT, cell]

    return give


@device
def _rounding_of(r, y):
    """Return the error of the time of failure by the rounding of r, which rises at 2 h."""
    z = 1.0 - y
    h = y * (1.0 + z + z * z) / z
    return ROUNDINGS * r / (2.0 * abs(h) + ROUNDINGS)


@device
def _begin_to_creep(film, cell, films, p, start, sigma, rate, end, tolerance):
    """Fill in a column of ``films``, (creep.CREEP, cells)."""
    films[creep.P, cell] = p
    films[creep.SIGMA, cell] = sigma
    films[creep.SLOWNESS, cell] = 1.0 / rate
    films[creep.END, cell] = end
    films[creep.ENOUGH, cell] = CREEP_END * film[FIELD_T, cell]
    films[creep.INVERSE_TOLERANCE, cell] = 1.0 / tolerance
    load_i = CRITICAL_LOAD * film[FIELD_I, cell] * film[FIELD_I, cell]
    d, _ = first_d(p, start, film[W_T, cell], sigma, film[W_I, cell], load_i)
    films[creep.W, cell] = film[W_T, cell] + d
    films[creep.R, cell] = start * start


@device
def _after_creep(film, cell, films, starts, rtol, reached):
    """Fill in a column of ``starts``, in which v is roughly proportional to the time, or of ``reached``."""
    p, sigma, r = films[creep.P, cell], films[creep.SIGMA, cell], films[creep.R, cell]
    f, x = films[creep.END, cell], films[creep.W, cell]
    of_w = creep.change_of_w(p, sigma, films[creep.SLOWNESS, cell], f, x, r)
    first = 1.0 / starts[REST, cell]
    strain = (first - x) / x
    square = -0.5 * f * of_w * first / (x * x)
    starts[FIRST_V, cell] = np.sqrt(square)
    starts[FIRST_Y, cell] = 1.0 - r * x * x
    starts[CAUTION, cell] *= 2.0 / (r * x * x)
    starts[LONGEST, cell] = STEP_AFTER * np.sqrt(np.sqrt(np.sqrt(rtol))) * min(np.sqrt(square), LARGEST_V)
    starts[SHIFT, cell] = square - strain
    reached[REACHED_R, cell] = r
    reached[REACHED_D, cell] = x - film[W_T, cell]
    reached[REACHED_ROUNDING, cell] = _rounding_of(r, 1.0 - r * x * x)


@device
def _state(risen, cell, starts, w_t, fraction):
    """Return r and w - w_t at the event, from the state close to it and a fraction of dr/dv there."""
    v, z, aim = risen[lane.REACHED_V, cell], 1.0 - risen[lane.REACHED_Y, cell], risen[lane.REACHED_AIM, cell]
    rest, shift = starts[REST, cell], starts[SHIFT, cell]
    s = 1.0 + (v * v - shift)
    change = (4.0 * v * z - risen[lane.REACHED_SLOPE, cell] * s) * s
    v += aim
    return (z * s * s + fraction * aim * change) * rest * rest, 1.0 / (rest * (1.0 + (v * v - shift))) - w_t


@device
def read_failure(risen, cell, film, starts, p, sigma, rate, result):
    """Write what a cell found at the instability; returns its status."""
    # dr/dv vanishes at the instability: half of it acts over the distance left.
    r, d = _state(risen, cell, starts, film[W_T, cell], 0.5)
    excess = risen[lane.REACHED_LOAD_EXCESS, cell] / (starts[REST, cell] * starts[REST, cell])
    field = film[FIELD_T, cell] * np.sqrt(1.0 + excess / film[LOAD_T, cell])
    if not field / rate < math.inf:
        return BUDGET_SPENT
    write_failure(
        result, cell, field / rate, film[W_T, cell] + unstable_d(p, 1.0 / r, film[W_T, cell], sigma, d), r, field
    )
    return FAILED


@device
def read_end(risen, cell, film, starts, reached):
    """Write how a cell reached the field at which it is held, in ``reached``, (REACHED, cells)."""
    r, d = _state(risen, cell, starts, film[W_T, cell], 1.0)
    y = risen[lane.REACHED_Y, cell]
    reached[REACHED_R, cell] = r
    reached[REACHED_D, cell] = d
    reached[REACHED_ROUNDING, cell] = _rounding_of(r, y)


def make_rise(target_of: Callable[..., Any], lanes: int) -> Callable[..., Any]:
    """Make ``rise(film, field, rate, modulus_ratio, start, sigma, rtol, status, reached, result)`` of a run of cells.

    Every cell of status RUNNING to the instability, where its results are written, or to the field at which it is held,
    where ``reached`` (REACHED, cells) says how. ``target_of(film, cell, p)`` is e - e_t there.
    """
    method = make_explicit(TABLEAUS["dop853"], UNDER_LOAD)
    climb_of_cells = make_climb_of_cells(method, make_give(target_of), lanes)
    starts_of = make_starts_of(target_of, lanes)
    creep_of_cells = creep.make_creep(TABLEAUS["dop853"], lanes)

    @device
    def creep_first(film, field, rate, modulus_ratio, start, sigma, rtol, status, starts, reached):
        """Take the films that creep, unless they enter the slow manifold, to where the scalar equation serves."""
        films = np.empty((creep.CREEP, status.size))
        for cell in range(status.size):
            p = modulus_ratio[cell] - 1.0
            held = target_of(film, cell, p) < math.inf
            end = field[cell] if held else film[FIELD_I, cell]
            ceiling = max(_ceiling(film, cell, p, 1.0 / start[cell]), 0.5 * end / rate[cell])
            tolerance = CREEP_SHARE * min(rtol, CREEP_RTOL) * (min(1.0, ceiling) if held else 1.0)
            _begin_to_creep(film, cell, films, p, start[cell], sigma[cell], rate[cell], end, tolerance)
            from_start = starts[FIRST_V, cell] == 0.0 and not is_at_rest(start[cell], sigma[cell])
            if status[cell] == RUNNING and from_start:
                status[cell] = creep.CREEPS
        creep_of_cells(films, rtol, status)
        for cell in range(status.size):
            if starts[FIRST_V, cell] == 0.0 and not is_at_rest(start[cell], sigma[cell]):
                _after_creep(film, cell, films, starts, rtol, reached)

    @device
    def rise(film, field, rate, modulus_ratio, start, sigma, rtol, status, reached, result):
        starts = np.empty((STARTS, status.size))
        risen = np.full((len(lane.REACHED), status.size), math.nan)
        fresh = starts_of(film, rate, modulus_ratio, start, sigma, SHARE * rtol, starts)
        if fresh > 0:
            creep_first(film, field, rate, modulus_ratio, start, sigma, rtol, status, starts, reached)
        climb_of_cells((film, starts, field, rate, modulus_ratio, start), SHARE * rtol, status, risen)
        for cell in range(status.size):
            p = modulus_ratio[cell] - 1.0
            if status[cell] == FAILED:
                status[cell] = read_failure(risen, cell, film, starts, p, sigma[cell], rate[cell], result)
            elif status[cell] == AT_END and risen[lane.REACHED_V, cell] >= 0.0:  # else it was reached while creeping
                read_end(risen, cell, film, starts, reached)

    return rise
