"""Time to failure after a hold as a Chebyshev series over the field, one for each (rate, modulus_ratio).

One climb from zero field to the instability, `rising`, passes the corners of all ramps of this rate that end in a
hold. At a few fields the state is found by one step of its method from the last step before, and the rest of the time
to failure by `hold`. Let ``E = (e - e_C)``, E_f the same where the climb ends, ``w = sqrt(E)`` and
``s = sqrt(E_f - E)``. The rest grows like 1/w towards Ec, and is a regular function of s that vanishes like s**2 where
the climb ends, since dE/dv does. So ``w/s`` times the rest is regular in the angle phi of ``w = sqrt(E_f) sin(phi)``,
at both ends and beyond; its series is in

    x = 2 (1 + a) t/(1 + a t) - 1,    t = tan(phi/2) = w/(sqrt(E_f) + s),

with a > 0 to have nodes where the time to failure varies most: at w of about sqrt(e_C), or of p where p is small.

What is estimated of the error, relative to the time to failure: that of r = xi**2 at the corner over 2 h, (26); that of
the quadrature; what the last coefficients say of those that are left out.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import Kernel, device
from ..forms.area_strain import event, excess_and_flow
from ..hold import quadrature
from ..model import CRITICAL_LOAD, CRITICAL_U
from ..rising.control import CROSSED, NEAR, NOTHING, TOO_MANY, make_judge
from ..rising.event import LARGEST_INVERSE_TOLERANCE, make_landing
from ..rising.explicit import make_explicit
from ..rising.start import begin, damping_for, prepare
from ..rising.state import (
    AT_INSTABILITY,
    COUNT,
    EVENT,
    FIELD,
    GLOBAL_ERROR,
    INVERSE_TOLERANCE,
    JACOBIAN,
    LOAD_EXCESS,
    NEW,
    RATE,
    SLOPES,
    SPEED,
    SPENT,
    STATUS,
    STEP,
    TARGET,
    TRIAL,
    Y_CEILING,
    P,
    V,
    Y,
)
from ..runge_kutta.tableaus import TABLEAUS
from ..sweep import LANES
from .chebyshev import FIRST_ENTRY, FIRST_NODE, LADDER, MOST_TERMS, needed_terms, tail

# Rows of the head of a series: E_f, NaN where the climb is not good enough; its root; a; E from which on the series is
# good; results of a film that fails on its ramp; the rate.
EXCESS = 0
ROOT = 1
BEND = 2
FROM = 3
TIME = 4
STRETCH = 5
INTERNAL = 6
AT_FIELD = 7
OF_RATE = 8
HEAD = 9

# Types of the arguments of `make_series`.
SIGNATURE = (
    "float64[::1], float64[::1], float64, float64[::1], float64[::1], float64[:, ::1], float64[:, ::1], int64[::1]"
)

# Rates for which a climb is tried; the others are for the solver of a single cell.
SLOWEST = 1e-9
FASTEST = 1e9

# Shares of the error allowed: of the steps of the climb, of its estimated error when it begins again, of the
# quadrature, of the coefficients left out, and, squared, of the corner.
OF_STEPS = 0.1
OF_CLIMB = 0.4
OF_HOLD = 0.01
OF_SERIES = 0.2
OF_CORNER = 0.005
LANDING = 0.01
# Steps of a climb beyond Ec; tens are needed.
MOST_STEPS = 128
ITERATIONS = 8
# Half of the nodes lie below about this w, in the middle of what varies.
MIDDLE = 0.7
MIDDLE_OF_EXCESS = 1.0
# E below which a series may be left out, the field being Ec to 1e-6.
LOW = 1e-6

# Rows of the steps of a climb: v, y, dy/dv at their beginning.
_START, _VALUE, _SLOPE = range(3)
_STEP_ROWS = 3
# Rows of the nodes of a climb: field f, f**2 - 1, w, s, v, the step that v is on, U - 1 at the corner, what an error
# of y there does to the time to failure.
_FIELD, _ABOVE, _W, _S, _V, _STEP, _BEGINNING, _OF_CORNER = range(8)
_NODE_ROWS = 8
# What rows of a block of lanes stand for while corners are sought: how far s is off, and the last two of a node.
_AWAY, _CORNER, _CHANGE = EVENT, JACOBIAN, GLOBAL_ERROR


@device
def _place(steps, count, fold_v, fold_y, fold_slope, excess, bend, p, speed, nodes, all_nodes, rung):
    """Give every node its field, the step it lies on, and a first guess of its v, cubic in s over the step."""
    first, number = FIRST_NODE[rung], LADDER[rung]
    for j in range(number):
        share = 0.5 * (1.0 + all_nodes[first + j])
        t = share / (1.0 + bend * (1.0 - share))
        root = np.sqrt(excess) / (1.0 + t * t)
        w, s = 2.0 * t * root, (1.0 - t * t) * root
        nodes[_W, j] = w
        nodes[_S, j] = s
        nodes[_ABOVE, j] = w * w / CRITICAL_LOAD
        nodes[_FIELD, j] = np.sqrt(1.0 + w * w / CRITICAL_LOAD)
    k = count
    _, _, change, K = event(fold_v, fold_y, fold_slope, p, speed)
    s0, v0, rise0 = 0.0, fold_v, -1.0 / np.sqrt(max(-0.5 * K * change, 1e-300))
    s1, v1, rise1 = s0, v0, rise0
    for j in range(number):  # with falling field
        s = nodes[_S, j]
        while (s > s0 or k == count) and k > 0:
            k -= 1
            s1, v1, rise1 = s0, v0, rise0
            v0 = steps[_START, k]
            E, D, _, K = event(v0, steps[_VALUE, k], 0.0, p, speed)
            s0 = np.sqrt(max(excess - E, 0.0))
            rise0 = -2.0 * s0 / (K * D)
        length = s0 - s1
        share = (s - s1) / length
        mean = (v0 - v1) / length
        bend0, bend1 = rise1 - mean, mean - rise0
        guess = v1 + (s - s1) * (mean + (1.0 - share) * (bend0 * (1.0 - share) + bend1 * share))
        nodes[_V, j] = min(max(guess, v0), v1)
        nodes[_STEP, j] = k
    return number


def _make_corners(attempt: Callable[..., Any], last: int) -> Callable[..., Any]:
    """Make ``corners(steps, number, excess, p, speed, allowed, nodes, w)``: the state at the corner of every node.

    Newton's method for ``s(v) = s`` has a slope that vanishes nowhere; once s is off by at most ``allowed``, its next
    correction is small enough for a tangent. Returns whether it came so far.
    """

    @device
    def corners(steps, number, excess, p, speed, allowed, nodes, w):
        lanes = w.shape[1]
        for i in range(lanes):
            w[P, i] = p
            w[SPEED, i] = speed
        for first in range(0, number, lanes):
            for i in range(lanes):
                j = min(first + i, number - 1)
                k = np.int64(nodes[_STEP, j])
                w[V, i] = steps[_START, k]
                w[Y, i] = steps[_VALUE, k]
                w[SLOPES, i] = steps[_SLOPE, k]
                w[TRIAL, i] = nodes[_V, j] - w[V, i]
                w[TARGET, i] = nodes[_S, j]
            found = False
            for _ in range(ITERATIONS):
                attempt(w)
                for i in range(lanes):  # no sum or maximum here: it would keep the loop from vector instructions
                    E, D, _, K = event(w[V, i] + w[TRIAL, i], w[NEW, i], 0.0, p, speed)
                    s = np.sqrt(max(excess - E, 1e-300))
                    away = s - w[TARGET, i]
                    w[_AWAY, i] = abs(away)
                    w[STEP, i] = 2.0 * s * away / (K * D)
                largest = 0.0
                for i in range(lanes):
                    largest = max(largest, w[_AWAY, i])
                if largest <= allowed:
                    found = True
                    break
                for i in range(lanes):
                    w[TRIAL, i] += w[STEP, i]
            if not found:
                return False
            for i in range(lanes):
                v = w[V, i] + w[TRIAL, i]
                _, h, _, d = excess_and_flow(v + w[STEP, i], w[NEW, i] + w[STEP, i] * w[last, i], p)
                w[_CORNER, i] = d / CRITICAL_U
                w[_CHANGE, i] = 0.5 * (1.0 + v * v) / h
            for i in range(min(lanes, number - first)):
                nodes[_BEGINNING, first + i] = w[_CORNER, i]
                nodes[_OF_CORNER, first + i] = w[_CHANGE, i]
        return True

    return corners


@device
def _hold(number, excess, rate, p, rtol, nodes, w, rung, values):
    """Find what becomes a series, ``w/s`` times the rest of the time to failure, at every node.

    Returns the smallest of ``w/s`` times the whole time, NaN where a node's is not found, and of those from LOW on; and
    the largest change of the time to failure, relative to itself, by an error of y.
    """
    lanes = w.shape[1]
    # Next to Ec a hold alone takes pi p/(3 sqrt(f - 1)), and no film fails there before its ramp ends.
    smallest = math.pi / 3.0 * p * np.sqrt(2.0 * CRITICAL_LOAD / excess)
    smallest_above = max(smallest, np.sqrt(LOW / excess) / rate)
    of_corner = 0.0
    for first in range(0, number, lanes):
        for i in range(lanes):
            j = min(first + i, number - 1)
            w[quadrature.TIME, i] = nodes[_FIELD, j]
            w[quadrature.BEFORE, i] = nodes[_ABOVE, j]
            w[quadrature.FOUND, i] = nodes[_BEGINNING, j]
        for i in range(lanes):  # from rows of the block alone, so that it becomes vector instructions
            quadrature.prepare_above(w, i, w[quadrature.TIME, i], w[quadrature.BEFORE, i], p, w[quadrature.FOUND, i])
            w[quadrature.BEFORE, i] = 0.0
            rung[i] = quadrature.first_rule(p, rtol)
        quadrature.integrate(w, rung, rtol)
        for i in range(min(lanes, number - first)):
            j = first + i
            rest = w[quadrature.FOUND, i]
            factor = nodes[_W, j] / nodes[_S, j]
            values[j] = factor * rest
            whole = nodes[_FIELD, j] / rate + rest
            if not whole < math.inf:
                return math.nan, math.nan, of_corner
            smallest = min(smallest, factor * whole)
            if nodes[_W, j] * nodes[_W, j] >= LOW:
                smallest_above = min(smallest_above, factor * whole)
            of_corner = max(of_corner, nodes[_OF_CORNER, j] / whole)
    return smallest, smallest_above, of_corner


def _make_to_series(attempt: Callable[..., Any], last: int) -> Callable[..., Any]:
    """Make ``to_series(steps, count, lane, i, ...)``: the series of a climb that is at its instability, from its steps.

    It returns the number of terms, or 0 where the steps are not good enough.
    """
    corners = _make_corners(attempt, last)

    @device
    def to_series(steps, count, lane, i, rtol, nodes, all_nodes, matrices, w, hold, rung, values, head, series):
        rate, p, speed, uncertainty = lane[RATE, i], lane[P, i], lane[SPEED, i], lane[GLOBAL_ERROR, i]
        v, z, aim = lane[V, i], 1.0 - lane[Y, i], lane[STEP, i]
        area = 1.0 + v * v
        # dr/dv vanishes at the instability: half of it acts over the distance left
        r = z * area + 0.5 * aim * (2.0 * v * z - lane[SLOPES, i] * area)
        excess = max(lane[LOAD_EXCESS, i], 0.0) if p > 0.0 else 0.0
        load = CRITICAL_LOAD + excess
        field = np.sqrt(load / CRITICAL_LOAD)
        bend = max(np.sqrt(excess) / min(MIDDLE, MIDDLE_OF_EXCESS * p) - 2.0, 0.0) if p > 0.0 else 0.0
        head[EXCESS] = excess
        head[ROOT] = np.sqrt(excess)
        head[BEND] = bend
        head[FROM] = 0.0
        head[TIME] = field / rate
        head[STRETCH] = np.sqrt(0.75 * (1.0 + p / r) / load)  # there e = (3/4) A u: (23) at (25)
        head[INTERNAL] = np.sqrt(r)
        head[AT_FIELD] = field
        head[OF_RATE] = rate
        if uncertainty > OF_CLIMB * rtol * z:
            return 0
        series[0] = math.nan  # no film fails at a hold
        if excess <= 0.0:
            return 1
        for step in range(_first_rung(rtol), len(LADDER)):
            fold_y = lane[Y, i] + aim * lane[SLOPES, i]
            number = _place(
                steps, count, v + aim, fold_y, lane[SLOPES, i], excess, bend, p, speed, nodes, all_nodes, step
            )
            if not corners(steps, number, excess, p, speed, OF_CORNER * np.sqrt(rtol * excess), nodes, w):
                break
            smallest, smallest_above, of_corner = _hold(
                number, excess, rate, p, OF_HOLD * rtol, nodes, hold, rung, values
            )
            if uncertainty * of_corner > OF_CLIMB * rtol:
                return 0
            for j in range(number):
                series[j] = 0.0
            for q in range(number):
                value = values[q]
                entry = FIRST_ENTRY[step] + q * number
                for j in range(number):
                    series[j] += value * matrices[entry + j]
            left = tail(series, number)
            allowed = OF_SERIES * rtol * smallest
            if left > allowed:
                head[FROM] = LOW
                allowed = OF_SERIES * rtol * smallest_above
            if left <= allowed:
                return needed_terms(series, number, allowed)
        series[0] = math.nan
        return 1

    return to_series


@device
def _first_rung(rtol):
    """Rung of the ladder of nodes to begin with."""
    return 1 if rtol < 1e-4 else 0


def make_series() -> Kernel:
    """Make the compiled ``find(rate, modulus_ratio, rtol, nodes, matrices, head, series, terms)``.

    ``rate``, ``modulus_ratio`` are (series,) arrays; ``head`` (series, HEAD), ``series`` (series, MOST_TERMS) and
    ``terms`` (series,) are filled in, each from its own rate and modulus ratio alone. ``nodes`` and ``matrices`` are
    those of `chebyshev.py`.
    """
    method = make_explicit(TABLEAUS["dop853"])
    attempt, last, rows, share = method.attempt, method.last, method.rows, method.tolerance_factor
    judge = make_judge(method)
    aim_between, land = make_landing(method)
    lanes = LANES

    to_series = _make_to_series(attempt, last)

    @device
    def give_up(head, series):
        for row in range(HEAD):
            head[row] = math.nan
        series[0] = math.nan

    @device
    def start(w, i, rate, modulus_ratio, tolerance, damping):
        w[RATE, i] = rate
        w[FIELD, i] = math.inf
        w[P, i] = modulus_ratio - 1.0
        prepare(w, i, tolerance, share, damping)
        w[Y_CEILING, i] = 0.5 / rate + 3e-15 / tolerance
        w[COUNT, i] = 0.0
        begin(w, i)

    def find(rate, modulus_ratio, rtol, all_nodes, matrices, head, series, terms):
        tolerance = OF_STEPS * rtol
        damping = damping_for(tolerance)
        w = np.zeros((rows, lanes))
        steps = np.zeros((lanes, _STEP_ROWS, MOST_STEPS))
        count = np.zeros(lanes, np.int64)
        before = np.empty((_STEP_ROWS, lanes))
        running = np.full(lanes, -1)
        nodes = np.empty((_NODE_ROWS, MOST_TERMS))
        corner = np.zeros((rows, lanes))
        hold = np.empty((quadrature.ROWS, lanes))
        rung = np.empty(lanes, np.int64)
        values = np.empty(MOST_TERMS)
        following, busy = 0, 0
        for i in range(lanes):
            w[STATUS, i] = SPENT
        while True:
            for i in range(lanes):
                while running[i] < 0 and following < rate.size:
                    number = following
                    following += 1
                    if SLOWEST <= rate[number] <= FASTEST:
                        start(w, i, rate[number], modulus_ratio[number], tolerance, damping)
                        running[i] = number
                        count[i] = 0
                        busy += 1
                    else:
                        give_up(head[number], series[number])
                        terms[number] = 1
            if busy == 0:
                return
            for i in range(lanes):
                w[TRIAL, i] = w[STEP, i] if w[STATUS, i] < AT_INSTABILITY else 0.0
                before[_START, i] = w[V, i]
                before[_VALUE, i] = w[Y, i]
                before[_SLOPE, i] = w[SLOPES, i]
            attempt(w)
            judge(w)
            for i in range(lanes):
                number = running[i]
                if number < 0:
                    continue
                event_met = w[EVENT, i]
                if event_met == NOTHING and w[V, i] == before[_START, i]:
                    continue
                if event_met != NEAR:  # the beginning of a step that was taken, or crossed the instability
                    E, _, _, _ = excess_and_flow(w[V, i], w[Y, i], w[P, i])
                    if event_met == CROSSED or E > 0.0:
                        if count[i] < MOST_STEPS:
                            for row in range(_STEP_ROWS):
                                steps[i, row, count[i]] = before[row, i]
                            count[i] += 1
                        else:
                            w[STATUS, i] = SPENT
                if event_met == CROSSED:
                    aim_between(w, i)
                elif event_met == NEAR:
                    land(w, i, LANDING * rtol * min(1.0, w[P, i]))
                elif event_met == TOO_MANY:
                    w[STATUS, i] = SPENT
                if w[STATUS, i] < AT_INSTABILITY:
                    continue
                found = 0
                if w[STATUS, i] == AT_INSTABILITY:
                    found = to_series(
                        steps[i], count[i], w, i, rtol, nodes, all_nodes, matrices, corner, hold, rung, values,
                        head[number], series[number],
                    )  # fmt: skip
                    if found == 0 and w[INVERSE_TOLERANCE, i] < LARGEST_INVERSE_TOLERANCE:
                        w[INVERSE_TOLERANCE, i] = min(10.0 * w[INVERSE_TOLERANCE, i], LARGEST_INVERSE_TOLERANCE)
                        begin(w, i)
                        count[i] = 0
                        continue
                if found == 0:
                    give_up(head[number], series[number])
                    found = 1
                for j in range(found, MOST_TERMS):
                    series[number, j] = 0.0
                terms[number] = found
                running[i] = -1
                busy -= 1
                w[STATUS, i] = SPENT

    return Kernel(find, SIGNATURE)
