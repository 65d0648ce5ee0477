"""Rising field under a dead load: field, stretch and dashpot as functions of a length along the film's way.

States x = E/Ec - f_t, d = w - w_t and y = 1 - z, about the largest field f_t of a relaxed film. With E = k T, h = H(y),
``K d = -g'/w`` and the load's rate per field, ``e' = 2 e_C E/Ec``, (18) to (20) and (26) give

    dx : dd : dy = w D : -(e' + 2 p u**3 H h/k) : (2/w) (z e' + u**2 (h/k) (4 p u h - K d)),

a direction without a singularity at D = 0, from the film without field on. The independent variable s is the length in
x/f_i, ln w and y. At the instability x and r = xi**2 are stationary, so that it is located by steps along the solution.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import device
from ..hold.gauss_legendre import NODES, OFFSETS
from ..lane_state import AT_END, BUDGET_SPENT, FAILED
from ..model import CRITICAL_LOAD
from ..runge_kutta.step import make_sequence, make_weighted_sum
from ..runge_kutta.tableaus import Row, Tableau
from .film import FIELD_I, FIELD_T, LOAD_T, W_I, W_T, curvature, first_d, relaxed_stiffness, stable_side, unstable_d

# Status of a cell: to be taken from the film without field, not at rest, to the instability or a given field.
CREEPS = 9

# Status of a lane.
CLIMBING, TO_INSTABILITY, TO_FIELD, VACANT = 0.0, 1.0, 2.0, 3.0

# Rows of the block.
X = 0  # states, the same at the end of an attempt, and at a stage
NEW = 3
INPUT = 6
STATES = 3
STATUS = 9
STEP = 10  # proposed
TRIAL = 11  # of this attempt
PREVIOUS = 12  # root of the last accepted error
COUNT = 13
TIGHTNESS = 14  # one over the error allowed in a step
P = 15
SIGMA = 16
AT = 17  # w_t
FIELD = 18  # f_t
PER_FIELD = 19  # 1/f_i
SLOWNESS = 20  # 1/k
TARGET = 21  # x at which to stop
Y_SHARE = 22  # of the error allowed in y, where less is left after the rise
ROUND = 23  # attempts to keep the constraint
SLOPES = 24

# Rows of the states to begin with.
FIRST_D, SLOW_X, SLOW_D, SLOW_Y, SLOW_STEP = range(5)
STARTS = 5

# Rows of what is reached.
REACHED_R, REACHED_D, REACHED_ROUNDING = range(3)  # the last: error of the time of failure, by rounding of r
REACHED = 3
# Units of rounding by which r may be wrong.
ROUNDINGS = 32.0 * 2.0**-52

SAFETY = 0.9
SMALLEST_FACTOR = 0.2
LARGEST_FACTOR = 4.0
# Of the accuracy asked of the results; measured, see docs/theory/dead_load.md.
SHARE = 0.6
Y_FLOOR = 0.3
ATTEMPTS = 3000
FIRST_STEP = 0.1
# The remainder of a landing, relative to the accuracy asked.
LEFT = 1e-3
# Bounds by rounding: of what counts as relaxation there, and of one over the error allowed in a step.
SMALLEST_P = 1e-10
TIGHTEST = 1e14
# On the slow manifold: no entry where y is larger, nor so close to the film at rest without field.
LARGEST_Y = 0.05
LATEST = 0.9
STABLE_STEP = 2.0
SEARCHES = 4
# Error of the field, of the accuracy asked, above which a climb is repeated with a tenth of the tolerance.
OFF = 0.3
ROUNDS = 4


@device
def damping_of(rtol):
    """Damping of the error of the start of a slow ramp."""
    return 4.0 - np.log(rtol)


@device
def rounding_of(r, h):
    """Error of the time of failure by the rounding of r, which rises at 2 h."""
    return ROUNDINGS * r / (2.0 * abs(h) + ROUNDINGS)


@device
def write_failure(result, cell, time, w, r, field):
    """Write the results of a film that fails."""
    result[0, cell] = time
    result[1, cell] = 1.0 / w
    result[2, cell] = np.sqrt(r)
    result[3, cell] = field


@device
def _parts(w, i, d, y):
    """Return w, 1/w, u, z, h, 1/z**2 + 2 z, K d and D."""
    x = w[AT, i] + d
    u = x * x
    z = 1.0 - y
    both = 1.0 / (x * z)
    inverse = both * x
    h = y * (1.0 + z + z * z) * inverse
    relaxed = d * relaxed_stiffness(d, w[AT, i], w[SIGMA, i])
    stiff = relaxed + 2.0 * w[P, i] * u * (3.0 * z * z - h)
    return x, both * z, u, z, h, inverse * inverse + 2.0 * z, relaxed, stiff


@device
def rhs(w, i, x, d, y):
    """Return dx/ds, dd/ds, dy/ds."""
    unknown, stretch, u, z, h, H, relaxed, D = _parts(w, i, d, y)
    p = w[P, i]
    rise = 2.0 * CRITICAL_LOAD * (w[FIELD, i] + x)
    slow = h * w[SLOWNESS, i]
    of_x = unknown * D
    of_d = -(rise + 2.0 * p * u * u * u * H * slow)
    of_y = 2.0 * stretch * (z * rise + u * u * slow * (4.0 * p * u * h - relaxed))
    a = of_x * w[PER_FIELD, i]
    b = of_d * stretch
    scale = 1.0 / np.sqrt(a * a + b * b + of_y * of_y)
    return of_x * scale, of_d * scale, of_y * scale


@device
def event(w, i):
    """Return D, dD/ds, dx/ds and d2x/ds2, the latter near the instability, of the state of a lane."""
    x, d, y = w[X, i], w[X + 1, i], w[X + 2, i]
    of_x, of_d, of_y = rhs(w, i, x, d, y)
    unknown, _, u, z, h, H, _, D = _parts(w, i, d, y)
    p = w[P, i]
    of_w = 48.0 * unknown * u * u + 3.0 * w[SIGMA, i] + 4.0 * p * unknown * (3.0 * z * z - h)
    change = of_w * of_d - 2.0 * p * u * (6.0 * z + H) * of_y
    # dx/ds is D times a factor: that of dd/ds over its part without it.
    rise = 2.0 * CRITICAL_LOAD * (w[FIELD, i] + x) + 2.0 * p * u * u * u * H * h * w[SLOWNESS, i]
    return D, change, of_x, -unknown * of_d / rise * change


@device
def _stiffness_at(w, i, row):
    return _parts(w, i, w[row + 1, i], w[row + 2, i])[7]


def _make_stage(weights: Row, target: int, slope: int) -> Callable[..., Any]:
    """Make ``stage(w)``: the states at one stage into ``target``, and the slopes there."""
    weighted_sum = make_weighted_sum(weights, SLOPES)

    @device
    def stage(w):
        for i in range(w.shape[1]):
            for state in range(STATES):
                w[target + state, i] = w[X + state, i] + w[TRIAL, i] * weighted_sum(w, i, state)
            a, b, c = rhs(w, i, w[target, i], w[target + 1, i], w[target + 2, i])
            w[slope, i] = a
            w[slope + 1, i] = b
            w[slope + 2, i] = c

    return stage


@device
def damping_from(w_t, sigma, p, load_t, d):
    """Return how far an error of y has decayed, as a logarithm, when the relaxed film comes from d to its largest load.

    Errors decay at ``nu = 6 u q/(q + 3 p u)``, q = K d/2, and ``dT = 2 w q dw/e'`` with the rate e' of the load; at a
    rate of one, inversely proportional to it.
    """
    total = 0.0
    for j in range(OFFSETS[0], OFFSETS[1]):
        s = 0.5 * d * (1.0 + NODES[0, j])
        x = w_t + s
        u = x * x
        q = 0.5 * s * relaxed_stiffness(s, w_t, sigma)
        G, _ = curvature(s, w_t, 1.0, 1.0, sigma)
        load = max(load_t - s * s * G, 1e-300)
        total += NODES[1, j] * 6.0 * u * x * q * q / ((q + 3.0 * p * u) * np.sqrt(CRITICAL_LOAD * load))
    return 0.5 * d * total


@device
def _above_cube_root(x):
    """Return the cube root within some percents, by square roots, which vectorise: x**(85/256)."""
    fourth = np.sqrt(np.sqrt(x))
    last = np.sqrt(np.sqrt(fourth))
    total = fourth * last
    last = np.sqrt(np.sqrt(last))
    return total * last * np.sqrt(np.sqrt(last))


@device
def entry_at(w_t, sigma, p, load_t, relaxed, rate, damping):
    """Return the d from which on an error decays by exp(-damping); at most ``relaxed``, that without field."""
    entry = 0.5 * relaxed
    for _ in range(SEARCHES):
        decay = damping_from(w_t, sigma, p, load_t, entry) / rate
        entry = min(entry * _above_cube_root(damping / decay), relaxed)
    return entry


@device
def slow_manifold(w_t, sigma, load_t, rate, d):
    """Return y on the slow manifold, to leading order in the rate; u, q, the load's rate and G there."""
    q = 0.5 * d * relaxed_stiffness(d, w_t, sigma)
    G, _ = curvature(d, w_t, 1.0, 1.0, sigma)
    u = (w_t + d) * (w_t + d)
    load_rate = 2.0 * rate * np.sqrt(CRITICAL_LOAD * max(load_t - d * d * G, 0.0))
    return load_rate / (6.0 * u * u * q), u, q, load_rate, G


@device
def start_of(film, cell, starts, p, start, sigma, rate, damping):
    """Fill in a column of ``starts``, (STARTS, cells): both states with which the climb of a cell may begin.

    The film without field; and the slow manifold at the d from which on an error decays by exp(-damping).
    """
    w_t, f_t, load_t = film[W_T, cell], film[FIELD_T, cell], film[LOAD_T, cell]
    load_i = CRITICAL_LOAD * film[FIELD_I, cell] * film[FIELD_I, cell]
    d, _ = first_d(p, start, w_t, sigma, film[W_I, cell], load_i)
    starts[FIRST_D, cell] = d
    relaxed = stable_side(load_t, w_t, 1.0, 1.0, sigma)  # of the film at rest without field
    entry = entry_at(w_t, sigma, p, load_t, relaxed, rate, damping)
    y, u, q, load_rate, G = slow_manifold(w_t, sigma, load_t, rate, entry)
    z = 1.0 - y
    excess = p * u * u * y * (1.0 + z + z * z) / z - entry * entry * G
    field = np.sqrt(max(f_t * f_t + excess / CRITICAL_LOAD, 0.0))
    nu = 6.0 * u * q / (q + 3.0 * p * u)
    along = load_rate / (2.0 * u * (q + 3.0 * p * u))
    steep = rate / film[FIELD_I, cell]
    good = (entry < LATEST * relaxed) & (y < LARGEST_Y)
    starts[SLOW_X, cell] = excess / (CRITICAL_LOAD * (field + f_t)) if good else math.inf
    starts[SLOW_D, cell] = entry
    starts[SLOW_Y, cell] = y
    starts[SLOW_STEP, cell] = STABLE_STEP * np.sqrt(along * along + steep * steep) / nu


@device
def begin(w, i, film, starts, cell, p, start, sigma, rate, target):
    """Set a lane to the state with which the climb of a cell begins."""
    w_t, f_t = film[W_T, cell], film[FIELD_T, cell]
    w[STATUS, i] = CLIMBING
    w[P, i] = p
    w[SIGMA, i] = sigma
    w[AT, i] = w_t
    w[FIELD, i] = f_t
    w[PER_FIELD, i] = 1.0 / film[FIELD_I, cell]
    w[SLOWNESS, i] = 1.0 / rate
    w[TARGET, i] = target
    x, d, step = -f_t, starts[FIRST_D, cell], FIRST_STEP
    y = 1.0 - start * start * (w_t + d) * (w_t + d)
    if starts[SLOW_X, cell] < min(target, 1e300):
        x, d, y, step = starts[SLOW_X, cell], starts[SLOW_D, cell], starts[SLOW_Y, cell], starts[SLOW_STEP, cell]
    w[X, i] = x
    w[X + 1, i] = d
    w[X + 2, i] = y
    a, b, c = rhs(w, i, x, d, y)
    w[SLOPES, i] = a
    w[SLOPES + 1, i] = b
    w[SLOPES + 2, i] = c
    w[STEP, i] = step
    w[PREVIOUS, i] = 1.0
    w[COUNT, i] = 0.0


@device
def _hermite(f0, d0, f1, d1, length):
    """Where on a step a quantity vanishes that changes sign over it: cubic interpolation, to some digits."""
    low, high = 0.0, 1.0
    a = d0 * length
    b = 3.0 * (f1 - f0) - (2.0 * d0 + d1) * length
    c = (d0 + d1) * length - 2.0 * (f1 - f0)
    x = f0 / (f0 - f1)
    for _ in range(6):
        value = f0 + x * (a + x * (b + x * c))
        if (value > 0.0) == (f0 > 0.0):
            low = x
        else:
            high = x
        x = x - value / (a + x * (2.0 * b + 3.0 * x * c))
        if not low < x < high:
            x = 0.5 * (low + high)
    return x * length


def make_climb(tableau: Tableau, target_of: Callable[..., Any], lanes: int) -> Callable[..., Any]:
    """Make ``climb(film, field, rate, modulus_ratio, start, sigma, rtol, status, reached, result)`` of a run of cells.

    Every cell of status CREEPS to the instability, where its results are written, or to the field at which it is held,
    where ``reached`` (REACHED, cells) says how. ``target_of(film, cell, p)`` is e - e_t there.
    """
    rows = [_make_stage(row, INPUT, SLOPES + STATES * (k + 1)) for k, row in enumerate(tableau.rows)]
    last = SLOPES + STATES * tableau.stages
    stages = make_sequence([*rows, _make_stage(tableau.weights, NEW, last)])
    fifth, third = (make_weighted_sum(weights, SLOPES) for weights in tableau.errors)
    count_of_rows = last + STATES

    @device
    def estimate(w, i, state, size):
        a = w[TRIAL, i] * fifth(w, i, state) * size
        b = w[TRIAL, i] * third(w, i, state) * size
        return a * a / np.sqrt(a * a + 0.01 * b * b + 1e-300)

    @device
    def accept(w, i):
        for state in range(STATES):
            w[X + state, i] = w[NEW + state, i]
            w[SLOPES + state, i] = w[last + state, i]

    @device
    def size_of_y(w, i, y):
        return w[Y_SHARE, i] * min(1.0 - y, max(y, Y_FLOOR))

    @device
    def judge(w, i, rtol):
        """Accept or reject the last attempt of a lane; returns whether it has arrived, and the distance left."""
        length = w[TRIAL, i]
        y = w[NEW + 2, i]
        wide = w[AT, i] + w[NEW + 1, i]
        error = estimate(w, i, 0, 1.0 / w[FIELD, i])
        error = max(error, estimate(w, i, 1, 1.0 / wide))
        error = max(error, estimate(w, i, 2, 1.0 / size_of_y(w, i, y))) * w[TIGHTNESS, i]
        good = (error <= 1.0) and (y < 1.0) and (wide > 0.0)
        root = np.sqrt(np.sqrt(np.sqrt(max(error, 1e-12)))) if error < 1e30 else 1e4
        w[COUNT, i] += 1.0
        if not good:
            w[STATUS, i] = CLIMBING
            w[STEP, i] = abs(length) * max(SMALLEST_FACTOR, min(SAFETY / root, SAFETY))
            w[PREVIOUS, i] = 1.0
            return False, 0.0
        before = w[X, i]
        if w[STATUS, i] == CLIMBING:
            D1 = _stiffness_at(w, i, NEW)
            if D1 <= 0.0 or w[NEW, i] >= w[TARGET, i]:
                D0, change0, _, _ = event(w, i)
                if D1 <= 0.0:
                    f, b, c = w[SLOPES, i], w[SLOPES + 1, i], w[SLOPES + 2, i]
                    x, d, state_y = w[X, i], w[X + 1, i], w[X + 2, i]
                    accept(w, i)
                    D1, change1, _, _ = event(w, i)
                    w[X, i], w[X + 1, i], w[X + 2, i] = x, d, state_y
                    w[SLOPES, i], w[SLOPES + 1, i], w[SLOPES + 2, i] = f, b, c
                    w[STATUS, i] = TO_INSTABILITY
                    w[STEP, i] = _hermite(D0, change0, D1, change1, length)
                else:
                    w[STATUS, i] = TO_FIELD
                    w[STEP, i] = _hermite(
                        before - w[TARGET, i], w[SLOPES, i], w[NEW, i] - w[TARGET, i], w[last, i], length
                    )
                return False, 0.0
            factor = SAFETY * np.sqrt(w[PREVIOUS, i]) / root
            w[STEP, i] = length * min(max(factor, SMALLEST_FACTOR), LARGEST_FACTOR)
            w[PREVIOUS, i] = root
            accept(w, i)
            return False, 0.0
        accept(w, i)
        D, change, rise, curve = event(w, i)
        if w[STATUS, i] == TO_INSTABILITY:
            aim = -D / change
            if abs(aim * aim * aim) <= LEFT * rtol * min(1.0, w[Y_SHARE, i], max(w[P, i], SMALLEST_P)):
                highest = w[X, i] + 0.5 * rise * aim
                if highest <= w[TARGET, i]:
                    return True, aim
                w[STATUS, i] = TO_FIELD
                aim -= np.sqrt(2.0 * (highest - w[TARGET, i]) / abs(curve))
            w[STEP, i] = aim
            return False, 0.0
        gap = w[TARGET, i] - w[X, i]
        square = rise * rise + 2.0 * curve * gap
        if square < 0.0:
            w[STATUS, i] = TO_INSTABILITY
            w[STEP, i] = -D / change
            return False, 0.0
        aim = 2.0 * gap / (rise + np.sqrt(square))
        if aim * aim <= LEFT * rtol * min(1.0, w[Y_SHARE, i], max(w[P, i], SMALLEST_P)):
            return True, aim
        w[STEP, i] = aim
        return False, 0.0

    @device
    def off_constraint(w, i):
        """Relative error of the field by which a state misses (18) to (20), which the exact solution obeys."""
        x, d, y = w[X, i], w[X + 1, i], w[X + 2, i]
        _, _, u, _, h, _, _, _ = _parts(w, i, d, y)
        G, _ = curvature(d, w[AT, i], 1.0, 1.0, w[SIGMA, i])
        field = w[FIELD, i] + x
        miss = CRITICAL_LOAD * x * (field + w[FIELD, i]) + d * d * G - w[P, i] * u * u * h
        return abs(miss) / (2.0 * CRITICAL_LOAD * field * field)

    @device
    def leave(w, i, aim, cell, rate, reached, result):
        """Write down what a lane found for its cell; returns the status."""
        x, d, y = w[X, i], w[X + 1, i], w[X + 2, i]
        _, _, u, z, h, _, _, _ = _parts(w, i, d, y)
        # dr/dT = 2 h
        of_r = 2.0 * h * w[SLOWNESS, i] * w[SLOPES, i]
        r = z / u
        if w[STATUS, i] == TO_INSTABILITY:
            r += 0.5 * of_r * aim
            field = w[FIELD, i] + x + 0.5 * w[SLOPES, i] * aim
            critical = unstable_d(w[P, i], 1.0 / r, w[AT, i], w[SIGMA, i], d + aim * w[SLOPES + 1, i])
            write_failure(result, cell, field / rate, w[AT, i] + critical, r, field)
            return FAILED if field / rate < math.inf else BUDGET_SPENT
        reached[REACHED_R, cell] = r + of_r * aim
        reached[REACHED_D, cell] = d + aim * w[SLOPES + 1, i]
        reached[REACHED_ROUNDING, cell] = rounding_of(r, h)
        return AT_END

    @device
    def climb(film, field, rate, modulus_ratio, start, sigma, rtol, status, reached, result):
        w = np.ones((count_of_rows, lanes))
        starts = np.empty((STARTS, status.size))
        damping = damping_of(rtol)
        for cell in range(status.size):
            p = modulus_ratio[cell] - 1.0
            start_of(film, cell, starts, p, start[cell], sigma[cell], rate[cell], damping)
        cells = np.zeros(lanes, np.int64)
        for i in range(lanes):
            w[STATUS, i] = VACANT
        following = 0
        while True:
            busy = 0
            for i in range(lanes):
                cell = cells[i]
                if w[STATUS, i] != VACANT and w[COUNT, i] > 0.0:
                    arrived, aim = judge(w, i, rtol)
                    if arrived:
                        if off_constraint(w, i) <= OFF * rtol or w[ROUND, i] >= ROUNDS:
                            status[cell] = leave(w, i, aim, cell, rate[cell], reached, result)
                            if w[ROUND, i] >= ROUNDS:
                                status[cell] = BUDGET_SPENT
                            w[STATUS, i] = VACANT
                        else:
                            w[ROUND, i] += 1.0
                            w[TIGHTNESS, i] *= 10.0
                            p = modulus_ratio[cell] - 1.0
                            begin(w, i, film, starts, cell, p, start[cell], sigma[cell], rate[cell], w[TARGET, i])
                    elif w[COUNT, i] >= ATTEMPTS:
                        status[cell] = BUDGET_SPENT
                        w[STATUS, i] = VACANT
                if w[STATUS, i] == VACANT:
                    while following < status.size and status[following] != CREEPS:
                        following += 1
                    if following < status.size:
                        cell = following
                        following += 1
                        cells[i] = cell
                        p = modulus_ratio[cell] - 1.0
                        target = target_of(film, cell, p) / (CRITICAL_LOAD * (field[cell] + film[FIELD_T, cell]))
                        w[ROUND, i] = 0.0
                        w[Y_SHARE, i] = min(1.0, field[cell] / rate[cell] + 1e-5) if target < math.inf else 1.0
                        w[TIGHTNESS, i] = np.sqrt(1.0 + p) * np.sqrt(np.sqrt(1.0 + p)) / (SHARE * rtol)
                        # Whether a film that hardly relaxes reaches a field is decided within p of f_t.
                        if target < math.inf:
                            w[TIGHTNESS, i] = min(w[TIGHTNESS, i] / min(p, 1.0), TIGHTEST)
                        begin(w, i, film, starts, cell, p, start[cell], sigma[cell], rate[cell], target)
                if w[STATUS, i] != VACANT:
                    w[TRIAL, i] = w[STEP, i]
                    w[COUNT, i] = max(w[COUNT, i], 0.5)
                    busy += 1
                else:
                    w[TRIAL, i] = 0.0
            if busy == 0:
                return
            stages(w)

    return climb
