"""The last stretch to the instability, with the stiffness D as the independent variable, to exactly D = 0.

    dT/dD = D/Q,    dr/dD = F D/Q,    Q = D dD/dT < 0,

with x from r and D, is regular at D = 0 whatever the field does (Henon's device), and needs no event. Where Q does not
stay below zero the film turns back: the passage goes on in time, and tries again from half the stiffness. An
instability after the end of the piece is none.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import device
from ..model import CRITICAL_LOAD
from ..tableaus import DOP853, Row
from .law import Law
from .march import EPSILON, SAFETY, factor_of, make_error, make_weighted_sum
from .pieces import Waves, describe
from .rows import (
    BARRED,
    BASE,
    COUNT,
    ERROR,
    FELL,
    HELD,
    LEAST,
    MOST,
    NEAR,
    OFFSET,
    PIECE,
    READY,
    TIGHTNESS,
    TIME_ERROR,
    T,
    X,
    Y,
)

# Rows of the block.
TIME, CHANGE, UNKNOWN, STIFFNESS, STEP, TRIAL = range(6)
ORIGIN, P_, SIGMA_, START_, SLOPE_, AMPLITUDE_, FREQUENCY_, DURATION_ = range(6, 14)
BEFORE, TIGHT, ENTRY = range(14, 17)  # time before the piece, one over the relative error allowed, D at the start
OF_TIME, OF_STATE = range(17, 19)  # estimated errors
BAD_, GUESS_, NEW_TIME, NEW_CHANGE = range(19, 23)
LOW, HIGH = range(23, 25)  # extremes of the unknown
TIMES = 25
CHANGES = TIMES + DOP853.stages + 1
ROWS = CHANGES + DOP853.stages + 1
LAST_TIME, LAST_CHANGE = CHANGES - 1, ROWS - 1

ATTEMPTS = 200
# A step this short, over the stiffness at the start, that still leads to Q >= 0: the film turns back.
SHORTEST = 0.02


def _make_slopes(law: Law, waves: Waves) -> Callable[..., Any]:
    """Make ``slopes(w, i, t, y, d) -> dT/ds, dr/ds``, with s = -D, and the unknown left in GUESS_."""
    at, flow, local, field, field_rate = law.at, law.plain_flow, law.local, waves.field, waves.rate

    @device
    def slopes(w, i, t, y, d):
        r, p, sigma = w[ORIGIN, i] + y, w[P_, i], w[SIGMA_, i]
        x = at(r, p, sigma, d, w[GUESS_, i])
        E = field(t, w[START_, i], w[SLOPE_, i], w[AMPLITUDE_, i], w[FREQUENCY_, i])
        rate = field_rate(t, w[START_, i], w[SLOPE_, i], w[AMPLITUDE_, i], w[FREQUENCY_, i])
        f = flow(r, x)
        _, _, q, _, _, _ = local(r, p, sigma, x, f, 2.0 * CRITICAL_LOAD * E * rate)
        w[GUESS_, i] = x
        w[BAD_, i] += 0.0 if q < 0.0 else 1.0
        of_time = -d / q
        return of_time, f * of_time

    return slopes


def _make_stage(slopes: Callable[..., Any], weights: Row, stage: int) -> Callable[..., Any]:
    of_time = make_weighted_sum(weights, TIMES)
    of_change = make_weighted_sum(weights, CHANGES)
    node = sum(weights)
    time_row, change_row = TIMES + stage, CHANGES + stage

    @device
    def one_stage(w):
        for i in range(w.shape[1]):
            length = w[TRIAL, i]
            t = w[TIME, i] + length * of_time(w, i)
            y = w[CHANGE, i] + length * of_change(w, i)
            a, b = slopes(w, i, t, y, w[STIFFNESS, i] - node * length)
            w[time_row, i] = a
            w[change_row, i] = b

    return one_stage


def make_finish(law: Law, waves: Waves, lanes: int) -> Callable[..., Any]:
    """Make ``finish(kind, scale, source, columns, p, sigma, cells, status, kept)``.

    Every passage that is NEAR becomes FELL, with T, Y, X those at the instability and the estimated errors of time and
    r there, or READY again.
    """
    slopes = _make_slopes(law, waves)
    ends, local, flow = law.ends, law.local, law.plain_flow
    field, field_rate = waves.field, waves.rate
    stages = [_make_stage(slopes, row, stage + 1) for stage, row in enumerate(DOP853.rows)]
    s1, s2, s3, s4, s5, s6, s7, s8, s9, s10, s11 = stages
    time_sum, change_sum = make_weighted_sum(DOP853.weights, TIMES), make_weighted_sum(DOP853.weights, CHANGES)
    time_error, change_error = make_error(TIMES), make_error(CHANGES)

    @device
    def attempt(w):
        for i in range(w.shape[1]):
            w[GUESS_, i] = w[UNKNOWN, i]
            w[BAD_, i] = 0.0
        s1(w)
        s2(w)
        s3(w)
        s4(w)
        s5(w)
        s6(w)
        s7(w)
        s8(w)
        s9(w)
        s10(w)
        s11(w)
        for i in range(w.shape[1]):
            length = w[TRIAL, i]
            t = w[TIME, i] + length * time_sum(w, i)
            y = w[CHANGE, i] + length * change_sum(w, i)
            rest = w[STIFFNESS, i] - length
            a, b = slopes(w, i, t, y, rest)
            w[LAST_TIME, i] = a
            w[LAST_CHANGE, i] = b
            w[NEW_TIME, i] = t
            w[NEW_CHANGE, i] = y

    @device
    def judge(w):
        """Accept or reject; how many lanes are still on their way."""
        busy = 0
        for i in range(w.shape[1]):
            length = w[TRIAL, i]
            t, y = w[NEW_TIME, i], w[NEW_CHANGE, i]
            r = w[ORIGIN, i] + y
            # Of the whole time, and of the change of r since the start of the passage, as in march.py.
            long = w[BEFORE, i] + t + 1e-300
            size = min(abs(r), abs(y) + abs(length * w[CHANGES, i])) + 1e-300
            a = time_error(w, i, length / long)
            b = change_error(w, i, length / size)
            relative = max(a, b) * w[TIGHT, i]
            good = (w[BAD_, i] == 0.0) & (relative <= 1.0) & (r > 0.0)
            factor = factor_of(relative)
            factor = factor if good else (min(factor, SAFETY) if w[BAD_, i] == 0.0 else 0.3)
            w[OF_TIME, i] += a * long + EPSILON * t if good else 0.0
            w[OF_STATE, i] += b * size + EPSILON * abs(r) if good else 0.0
            w[TIME, i] = t if good else w[TIME, i]
            w[CHANGE, i] = y if good else w[CHANGE, i]
            w[UNKNOWN, i] = w[GUESS_, i] if good else w[UNKNOWN, i]
            w[TIMES, i] = w[LAST_TIME, i] if good else w[TIMES, i]
            w[CHANGES, i] = w[LAST_CHANGE, i] if good else w[CHANGES, i]
            w[LOW, i] = min(w[LOW, i], w[UNKNOWN, i])
            w[HIGH, i] = max(w[HIGH, i], w[UNKNOWN, i])
            rest = max(w[STIFFNESS, i] - length, 0.0) if good else w[STIFFNESS, i]
            w[STIFFNESS, i] = rest
            going = (length > 0.0) & (rest > 0.0) & (w[TIME, i] <= w[DURATION_, i])
            going = going & (good | (length * factor > SHORTEST * w[ENTRY, i]))
            following = min(length * factor, rest)
            following = rest if following > 0.9 * rest else following
            w[TRIAL, i] = following if going else 0.0
            busy += going
        return busy

    @device
    def put(kind, scale, source, columns, p, sigma, cell, kept, passage, w, i):
        """Put a passage into a lane."""
        piece = np.int64(kept[PIECE, passage])
        if piece < kind.size:
            start, slope, amplitude, frequency, duration = describe(kind, scale, source, columns, piece, cell)
        else:
            start, slope, amplitude, frequency, duration = kept[HELD, passage], 0.0, 0.0, 0.0, math.inf
        t, y, x = kept[T, passage], kept[Y, passage], kept[X, passage]
        r = kept[BASE, passage] + y
        E, rate = field(t, start, slope, amplitude, frequency), field_rate(t, start, slope, amplitude, frequency)
        f = flow(r, x)
        d, _, q, _, _, _ = local(r, p[cell], sigma[cell], x, f, 2.0 * CRITICAL_LOAD * E * rate)
        w[TIME, i] = t
        w[CHANGE, i] = y
        w[UNKNOWN, i] = x
        w[STIFFNESS, i] = d
        w[ENTRY, i] = d
        w[ORIGIN, i] = kept[BASE, passage]
        w[P_, i] = p[cell]
        w[SIGMA_, i] = sigma[cell]
        w[START_, i] = start
        w[SLOPE_, i] = slope
        w[AMPLITUDE_, i] = amplitude
        w[FREQUENCY_, i] = frequency
        w[DURATION_, i] = duration
        w[BEFORE, i] = kept[OFFSET, passage]
        w[TIGHT, i] = kept[TIGHTNESS, passage]
        # An error of r at this time is one of time and r at this stiffness.
        bend, load_of_r, of_r = ends(r, p[cell], sigma[cell], x)
        rounding = 4.0 * EPSILON * (1.0 + p[cell] / r)
        late = abs(((of_r * d + bend * abs(load_of_r)) * kept[ERROR, passage] + d * rounding) / q)
        w[OF_TIME, i] = late
        w[OF_STATE, i] = kept[ERROR, passage] + abs(f) * late
        w[TIMES, i] = -d / q
        w[CHANGES, i] = -f * d / q
        w[TRIAL, i] = d
        w[LOW, i] = x
        w[HIGH, i] = x

    @device
    def finish(kind, scale, source, columns, p, sigma, cells, status, kept):
        w = np.ones((ROWS, lanes))
        held = np.empty(lanes, np.int64)
        following = 0
        while True:
            count = 0
            while count < lanes and following < status.size:
                if status[following] == NEAR:
                    put(kind, scale, source, columns, p, sigma, cells[following], kept, following, w, count)
                    held[count] = following
                    count += 1
                following += 1
            if count == 0:
                return
            for i in range(count, lanes):
                w[TRIAL, i] = 0.0
            for _ in range(ATTEMPTS):
                attempt(w)
                if judge(w) == 0:
                    break
            for i in range(count):
                passage = held[i]
                kept[COUNT, passage] += 20.0
                if w[STIFFNESS, i] == 0.0 and w[TIME, i] <= w[DURATION_, i]:
                    status[passage] = FELL
                    kept[T, passage] = w[TIME, i]
                    kept[Y, passage] = w[CHANGE, i]
                    kept[X, passage] = w[UNKNOWN, i]
                    kept[TIME_ERROR, passage] = w[OF_TIME, i]
                    kept[ERROR, passage] = w[OF_STATE, i]
                    kept[LEAST, passage] = min(kept[LEAST, passage], w[LOW, i])
                    kept[MOST, passage] = max(kept[MOST, passage], w[HIGH, i])
                else:
                    status[passage] = READY
                    kept[BARRED, passage] = 0.0 if w[TIME, i] > w[DURATION_, i] else 0.5 * w[ENTRY, i]

    return finish
