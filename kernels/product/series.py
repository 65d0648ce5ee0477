"""Time to failure after a hold as a Chebyshev series over the field, one for each (rate, modulus_ratio).

One climb from zero field to the instability, `ramp.py`, passes the corners of all ramps of this rate that end in a hold:
at a few fields the state is read from it by dense output, and the rest of the time to failure found by `quadrature.py`. Let
``E = (e - e_C)``, E_f the same where the climb ends, ``w = sqrt(E)`` and ``s = sqrt(E_f - E)``. The rest grows like 1/w
towards Ec, and is a regular function of s that vanishes like s**2 where the climb ends, since dE/dv does. So ``w/s`` times
the rest is regular in the angle phi of ``w = sqrt(E_f) sin(phi)``, at both ends and beyond; its series is in

    x = 2 (1 + a) t/(1 + a t) - 1,    t = tan(phi/2) = w/(sqrt(E_f) + s),

with a > 0 to have nodes where the time to failure varies most: at w of about sqrt(e_C), or of p where p is small.

What is estimated of the error, relative to the time to failure at every node: that of r = xi**2 at the corner over 2 h, (26);
that of the quadrature; the last coefficients of the series.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .. import quadrature, ramp
from .._jit import FINGERPRINT, compiled, device
from ..area import event, excess_and_flow, slope
from ..area_explicit import make_explicit
from ..area_lanes import (
    COUNT,
    EVENT,
    FIELD,
    GLOBAL,
    NEW,
    RATE,
    SCALE,
    SLOPES,
    SPEED,
    SPENT,
    STATUS,
    STEP,
    TIGHTNESS,
    TRIAL,
    P,
    V,
    Y,
)
from ..landing import LARGEST_TIGHTNESS, cubic_root
from ..model import CRITICAL_LOAD
from ..sweep import LANES
from ..tableaus import TABLEAUS
from . import dense
from .chebyshev import FIRST_ENTRY, FIRST_NODE, LADDER, MOST_TERMS, needed_terms, tail

# Rows of the head of a series: E_f, NaN where none is good enough; its root; a; E from which on the series is good; results of a film that fails on its ramp; the
# rate.
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

# Rates for which a climb is tried; the others are for the solver of a single cell.
SLOWEST = 1e-9
FASTEST = 1e9

# Shares of the error allowed: of the steps of the climb, of its estimated error when it begins again, of the quadrature, of
# the last coefficients, and of the load at the corner: its time changes by half of its relative change.
OF_STEPS = 0.2
OF_CLIMB = 0.4
OF_HOLD = 0.1
OF_SERIES = 0.2
OF_CORNER = 0.02
# Steps of a climb beyond Ec; tens are needed.
MOST_STEPS = 128
ITERATIONS = 8
# Half of the nodes lie below about this w, in the middle of what varies.
MIDDLE = 0.7
MIDDLE_OF_EXCESS = 1.0
# E below which a series may be left out, the field being Ec to 1e-6.
LOW = 1e-6

# Rows of the nodes of a climb: field, s, v, the step that v is on with its beginning, state, and one over its length.
_FIELD, _W, _S, _V, _START, _VALUE, _INVERSE, _POLYNOMIAL = range(8)
_OF_CORNER = _POLYNOMIAL + dense.DEGREE  # what an error of r does to the time to failure
_BEGINNING = _OF_CORNER + 1  # U - 1 at the corner
_NEXT = _OF_CORNER + 2
_NODE_ROWS = _OF_CORNER + 3


@device
def _fold(steps, k, p, speed):
    """Where on step k the instability is: its v, the state there, and E there."""
    start, length = steps[dense.START, k], steps[dense.LENGTH, k]
    last = dense.DERIVATIVES + dense.STAGES - 1
    _, D0, change0, _ = event(start, steps[dense.VALUE, k], steps[dense.DERIVATIVES, k], p, speed)
    _, D1, change1, _ = event(start + length, steps[dense.NEXT, k], steps[last, k], p, speed)
    v = start + cubic_root(D0, change0, D1, change1, length)
    for _ in range(4):
        y = dense.value(steps, dense.POLYNOMIAL, k, steps[dense.VALUE, k], (v - start) / length)
        _, D, change, _ = event(v, y, slope(v, y, p, speed), p, speed)
        v = min(max(v - D / change, start), start + length)
    y = dense.value(steps, dense.POLYNOMIAL, k, steps[dense.VALUE, k], (v - start) / length)
    excess, _, _, _ = excess_and_flow(v, y, p)
    return v, y, excess


@device
def _place(steps, count, fold_v, excess, bend, p, nodes, all_nodes, rung):
    """Give every node its field, the step it lies on, and a first guess of its v, linear in s over the step."""
    first, number = FIRST_NODE[rung], LADDER[rung]
    for j in range(number):
        share = 0.5 * (1.0 + all_nodes[first + j])
        t = share / (1.0 + bend * (1.0 - share))
        root = 2.0 * t / (1.0 + t * t)
        field = np.sqrt(1.0 + excess * root * root / CRITICAL_LOAD)
        E = CRITICAL_LOAD * (field - 1.0) * (field + 1.0)  # of the field as rounded
        nodes[_FIELD, j] = field
        nodes[_W, j] = np.sqrt(E)
        nodes[_S, j] = np.sqrt(max(excess - E, 0.0))
    k = count
    s0, s1 = -1.0, 0.0
    for j in range(number):  # with falling field
        s = nodes[_S, j]
        while s > s0 and k > 0:
            k -= 1
            E0, _, _, _ = excess_and_flow(steps[dense.START, k], steps[dense.VALUE, k], p)
            s1 = max(s0, 0.0)
            s0 = np.sqrt(max(excess - E0, 0.0))
        v = steps[dense.START, k]
        end = v + steps[dense.LENGTH, k] if k < count - 1 else fold_v
        nodes[_V, j] = end + (v - end) * (s - s1) / (s0 - s1)
        nodes[_START, j] = v
        nodes[_VALUE, j] = steps[dense.VALUE, k]
        nodes[_INVERSE, j] = 1.0 / steps[dense.LENGTH, k]
        for row in range(dense.DEGREE):
            nodes[_POLYNOMIAL + row, j] = steps[dense.POLYNOMIAL + row, k]
    return number


@device
def _solve(number, excess, p, speed, nodes, allowed):
    """Newton's method for ``s(v) = s`` at every node, with a slope that vanishes nowhere; returns the largest error of E."""
    largest = math.inf
    for _ in range(ITERATIONS):
        largest = 0.0
        for j in range(number):
            v = nodes[_V, j]
            y = dense.value(nodes, _POLYNOMIAL, j, nodes[_VALUE, j], (v - nodes[_START, j]) * nodes[_INVERSE, j])
            E, D, _, K = event(v, y, 0.0, p, speed)
            s = np.sqrt(max(excess - E, 1e-300))
            nodes[_NEXT, j] = v + 2.0 * s * (s - nodes[_S, j]) / (K * D)
            largest = max(largest, abs(s * s - nodes[_S, j] * nodes[_S, j]))
        if largest <= allowed:
            return largest
        for j in range(number):
            nodes[_V, j] = nodes[_NEXT, j]
    return largest


@device
def _read(number, p, nodes):
    """What the hold needs of every node; returns the largest 1 + v**2."""
    for j in range(number):
        v = nodes[_V, j]
        y = dense.value(nodes, _POLYNOMIAL, j, nodes[_VALUE, j], (v - nodes[_START, j]) * nodes[_INVERSE, j])
        _, h, _, _ = excess_and_flow(v, y, p)
        area = 1.0 + v * v
        nodes[_OF_CORNER, j] = 0.5 * area / h
        nodes[_BEGINNING, j] = quadrature.start_of_hold(nodes[_FIELD, j], p, (1.0 - y) * area)


@device
def _hold(number, rate, p, rtol, nodes, w, rung, values):
    """What becomes a series, ``w/s`` times the rest of the time to failure, at every node.

    Returns the smallest of ``w/s`` times the whole time, NaN if one is not found, and of those from LOW on; and the largest
    change of the time to failure, relative to itself, by an error of y.
    """
    lanes = w.shape[1]
    smallest, smallest_above, of_corner = math.inf, math.inf, 0.0
    for first in range(0, number, lanes):
        for i in range(lanes):
            j = min(first + i, number - 1)
            field = nodes[_FIELD, j]
            quadrature.prepare(w, i, field, p, nodes[_BEGINNING, j])
            w[quadrature.BEFORE, i] = field / rate
            rung[i] = quadrature.first_rung(p, rtol)
        quadrature.integrate(w, rung, rtol)
        for i in range(min(lanes, number - first)):
            j = first + i
            rest = w[quadrature.FOUND, i]
            factor = nodes[_W, j] / nodes[_S, j]
            values[j] = factor * rest
            whole = w[quadrature.BEFORE, i] + rest
            if not whole < math.inf:
                return math.nan, math.nan, of_corner
            smallest = min(smallest, factor * whole)
            if nodes[_W, j] * nodes[_W, j] >= LOW:
                smallest_above = min(smallest_above, factor * whole)
            of_corner = max(of_corner, nodes[_OF_CORNER, j] / whole)
    return smallest, smallest_above, of_corner


@device
def _record(steps, k, w, i, last, v, y, derivative, uncertainty, length, next_y):
    """Write down the last attempt of a lane as step k of its climb."""
    steps[dense.START, k] = v
    steps[dense.VALUE, k] = y
    steps[dense.LENGTH, k] = length
    steps[dense.NEXT, k] = next_y
    steps[dense.UNCERTAINTY, k] = uncertainty
    steps[dense.DERIVATIVES, k] = derivative
    for stage in range(1, dense.STAGES - 1):
        steps[dense.DERIVATIVES + stage, k] = w[SLOPES + stage, i]
    steps[dense.DERIVATIVES + dense.STAGES - 1, k] = w[last, i]


@device
def _to_series(steps, count, rate, p, rtol, nodes, all_nodes, matrices, w, rung, values, head, series):
    """Make the series of a climb from its steps; returns its number of terms, or 0 where the steps are not good enough."""
    speed = 2.0 * rate * np.sqrt(CRITICAL_LOAD)
    dense.prepare(steps, count, p, speed)
    v, y, excess = _fold(steps, count - 1, p, speed)
    excess = excess if p > 0.0 else 0.0
    r = (1.0 - y) * (1.0 + v * v)
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
    uncertainty = 0.0
    for k in range(count):
        uncertainty = max(uncertainty, steps[dense.UNCERTAINTY, k])
    if uncertainty > OF_CLIMB * rtol * (1.0 - y):
        return 0
    series[0] = math.nan  # no film fails at a hold
    if excess <= 0.0:
        return 1
    for step in range(_first_rung(rtol), len(LADDER)):
        number = _place(steps, count, v, excess, bend, p, nodes, all_nodes, step)
        error_of_load = OF_CORNER * rtol * CRITICAL_LOAD
        if not _solve(number, excess, p, speed, nodes, error_of_load) <= error_of_load:
            break
        _read(number, p, nodes)
        smallest, smallest_above, of_corner = _hold(number, rate, p, OF_HOLD * rtol, nodes, w, rung, values)
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
    head[EXCESS] = math.nan
    series[0] = math.nan
    return 1


@device
def _first_rung(rtol):
    """Rung of the ladder of nodes to begin with."""
    return (rtol < 1e-4) + (rtol < 1e-8) + (rtol < 1e-11)


def make_series() -> Callable[..., Any]:
    """Make the compiled ``find(rate, modulus_ratio, rtol, nodes, matrices, head, series, terms)``.

    ``rate``, ``modulus_ratio`` are (series,) arrays; ``head`` (series, HEAD), ``series`` (series, MOST_TERMS), ``terms``
    (series,) are filled in, each from its own rate and modulus ratio alone. ``nodes`` and ``matrices`` are those of
    `chebyshev.py`.
    """
    method = make_explicit(TABLEAUS["dop853"])
    attempt, last, rows, share = method.attempt, method.last, method.rows, method.share
    judge = ramp.make_judge(method)
    fingerprint = FINGERPRINT
    lanes = LANES

    @device
    def start(w, i, rate, modulus_ratio, tolerance, damping):
        w[RATE, i] = rate
        w[FIELD, i] = math.inf
        w[P, i] = modulus_ratio - 1.0
        ramp.prepare(w, i, tolerance, share, damping)
        w[SCALE, i] = 0.5 / rate + 3e-15 / tolerance
        w[COUNT, i] = 0.0
        ramp.begin(w, i)

    def find(rate, modulus_ratio, rtol, all_nodes, matrices, head, series, terms):
        source = fingerprint  # in the closure, hence in the key of the on-disk cache
        tolerance = OF_STEPS * rtol
        damping = ramp.damping_for(tolerance)
        w = np.zeros((rows, lanes))
        steps = np.zeros((lanes, dense.ROWS, MOST_STEPS))
        nodes = np.empty((_NODE_ROWS, MOST_TERMS))
        before = np.empty((4, lanes))
        values = np.empty(MOST_TERMS)
        hold = np.empty((quadrature.ROWS, lanes))
        rung = np.empty(lanes, np.int64)
        count = np.zeros(lanes, np.int64)
        climb = np.full(lanes, -1)
        following, busy = 0, 0
        for i in range(lanes):
            w[STATUS, i] = SPENT
        while True:
            for i in range(lanes):
                if climb[i] < 0:
                    while following < rate.size:
                        number = following
                        following += 1
                        if SLOWEST <= rate[number] <= FASTEST:
                            start(w, i, rate[number], modulus_ratio[number], tolerance, damping)
                            climb[i] = number
                            count[i] = 0
                            busy += 1
                            break
                        head[number] = math.nan
                        series[number] = 0.0
                        terms[number] = 1
            if busy == 0:
                return len(source)
            for i in range(lanes):
                w[TRIAL, i] = w[STEP, i] if w[STATUS, i] < SPENT else 0.0
                before[0, i] = w[V, i]
                before[1, i] = w[Y, i]
                before[2, i] = w[SLOPES, i]
            attempt(w)
            judge(w)
            for i in range(lanes):
                E, _, _, _ = excess_and_flow(w[V, i], w[Y, i], w[P, i])
                before[3, i] = E
            for i in range(lanes):
                if climb[i] < 0:
                    continue
                crossed = w[EVENT, i] == ramp.CROSSED
                spent = w[EVENT, i] == ramp.TOO_MANY
                if crossed or w[V, i] != before[0, i]:
                    if count[i] == MOST_STEPS:
                        spent = True
                    else:
                        v, y = before[0, i], before[1, i]
                        next_y = w[NEW, i] if crossed else w[Y, i]
                        _record(
                            steps[i], count[i], w, i, last, v, y, before[2, i], w[GLOBAL, i], w[TRIAL, i], next_y
                        )
                        if crossed or before[3, i] > 0.0:  # steps that end before Ec are forgotten
                            count[i] += 1
                if not (crossed or spent):
                    continue
                number = climb[i]
                found = 1
                head[number, EXCESS] = math.nan
                if not spent:
                    found = _to_series(
                        steps[i], count[i], rate[number], modulus_ratio[number] - 1.0, rtol, nodes, all_nodes, matrices,
                        hold, rung, values, head[number], series[number],
                    )  # fmt: skip
                    if found == 0 and w[TIGHTNESS, i] < LARGEST_TIGHTNESS:
                        w[TIGHTNESS, i] = min(10.0 * w[TIGHTNESS, i], LARGEST_TIGHTNESS)
                        ramp.begin(w, i)
                        count[i] = 0
                        continue
                if spent or found == 0:
                    head[number] = math.nan
                    series[number] = 0.0
                    found = 1
                for j in range(found, MOST_TERMS):
                    series[number, j] = 0.0
                terms[number] = found
                climb[i] = -1
                busy -= 1
                w[STATUS, i] = SPENT

    return compiled(find)
