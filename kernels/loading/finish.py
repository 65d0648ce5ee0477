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
from ..lane_state import next_cells
from ..model import CRITICAL_LOAD
from .law import Law
from .march import EPSILON, NODES, SAFETY, STAGES, add_slopes, factor_of, make_errors, total_error
from .pieces import LINEAR, Waves, describe, field_at_end
from .rows import (
    BARRED,
    BASE,
    COUNT,
    DOUBT,
    ERROR,
    FELL,
    HELD,
    LEAST,
    MOST,
    NEAR,
    OFFSET,
    PIECE,
    READY,
    ROUNDING,
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
GROWTH_ = 25  # of an error of the time, per change of stiffness
ALONG = 26  # change of r per change of time, at fixed stiffness
TIMES = 27
CHANGES = TIMES + STAGES + 1
ROWS = CHANGES + STAGES + 1

ATTEMPTS = 200
# The few steps of a finish are to be that much more accurate than those in time: their errors add to the time itself.
TIGHTER = 20.0
# Of the time in the piece, what the whole time counts at most. Measured: where steps are allowed errors of a thousandth
# of the time in the piece, their estimates can be a fortieth of the error.
LONG = 10.0
# Of those errors, over the estimates, for the results to be within half of what is allowed.
SAFE = 4.0
# Of the stiffness, by which it may be corrected.
CORRECTION = 0.1
# Step of the difference that gives the growth, over the time left by the tangent of D**2.
NUDGE = 1e-4
# Change of r per change of time, at fixed stiffness, beyond which r does not follow from the equilibrium.
LARGEST_ALONG = 1e8
# A step this short, over the stiffness at the start, that still leads to Q >= 0: the film turns back.
SHORTEST = 0.02


def _make_slopes(law: Law, waves: Waves) -> Callable[..., Any]:
    """Make ``slopes(w, i, t, y, d) -> dT/ds, dr/ds, Q``, with s = -D, and the unknown left in GUESS_."""
    at, flow, local, field, field_rate = law.at, law.plain_flow, law.local, waves.field, waves.rate

    @device
    def slopes(w, i, t, y, d):
        r, p, sigma = w[ORIGIN, i] + y, w[P_, i], w[SIGMA_, i]
        x = at(r, p, sigma, d, w[GUESS_, i])
        E = field(t, w[START_, i], w[SLOPE_, i], w[AMPLITUDE_, i], w[FREQUENCY_, i])
        rate = field_rate(t, w[START_, i], w[SLOPE_, i], w[AMPLITUDE_, i], w[FREQUENCY_, i])
        f = flow(r, x)
        _, _, q, _, _, _, _ = local(r, p, sigma, x, f, 2.0 * CRITICAL_LOAD * E * rate)
        w[GUESS_, i] = x
        w[BAD_, i] += 0.0 if q < 0.0 else 1.0
        of_time = -d / q
        return of_time, f * of_time, q

    return slopes


def _make_growth(law: Law, waves: Waves, slopes: Callable[..., Any]) -> Callable[..., Any]:
    """Make ``growth(w, i, t, y, d) -> growth, along, late, dT/ds, dr/ds``.

    The first is that of an error of the time at fixed D, then dr over dT of it, and the error of the time at this D
    that one of r at this time is.

    Both states obey the equilibrium, so that an error has one direction; the growth is a forward difference, two digits
    are plenty. Next to a folded singularity, D = N = 0, it is large.
    """
    ends, field, field_rate = law.ends, waves.field, waves.rate

    @device
    def growth(w, i, t, y, d):
        r, x = w[ORIGIN, i] + y, w[GUESS_, i]
        E = field(t, w[START_, i], w[SLOPE_, i], w[AMPLITUDE_, i], w[FREQUENCY_, i])
        rate = field_rate(t, w[START_, i], w[SLOPE_, i], w[AMPLITUDE_, i], w[FREQUENCY_, i])
        bend, load_of_r, of_r = ends(r, w[P_, i], w[SIGMA_, i], x)
        # Infinite for an elastic film, whose r has no part in the equilibrium.
        along = 2.0 * CRITICAL_LOAD * E * rate / (load_of_r + d * of_r / bend)
        change = along if abs(along) < LARGEST_ALONG else 0.0
        bad = w[BAD_, i]
        here, of_state, q = slopes(w, i, t, y, d)
        nudge = NUDGE * here * d + 1e-300
        beside, _, _ = slopes(w, i, t + nudge, y + change * nudge, d)
        w[GUESS_, i] = x
        w[BAD_, i] = bad
        return (beside - here) / nudge, along, abs((of_r * d + bend * abs(load_of_r)) / q), here, of_state

    return growth


def make_finish(law: Law, waves: Waves, lanes: int) -> Callable[..., Any]:
    """Make ``finish(kind, scale, source, columns, p, sigma, cells, status, kept)``.

    Every passage that is NEAR becomes FELL, with T, Y, X those at the instability and the estimated errors of time and
    r there, or READY again.
    """
    slopes = _make_slopes(law, waves)
    growth = _make_growth(law, waves, slopes)
    settle, local, flow = law.settle, law.local, law.plain_flow
    field, field_rate = waves.field, waves.rate
    time_errors, change_errors = make_errors(TIMES), make_errors(CHANGES)

    @device
    def attempt(w):
        for i in range(w.shape[1]):
            w[GUESS_, i] = w[UNKNOWN, i]
            w[BAD_, i] = 0.0
        for stage in range(1, STAGES + 1):  # the last one is the new state
            add_slopes(w, stage, TIMES, NEW_TIME)
            add_slopes(w, stage, CHANGES, NEW_CHANGE)
            for i in range(w.shape[1]):
                length = w[TRIAL, i]
                t = w[TIME, i] + length * w[NEW_TIME, i]
                y = w[CHANGE, i] + length * w[NEW_CHANGE, i]
                a, b, _ = slopes(w, i, t, y, w[STIFFNESS, i] - NODES[stage] * length)
                w[NEW_TIME, i] = t
                w[NEW_CHANGE, i] = y
                w[TIMES + stage, i] = a
                w[CHANGES + stage, i] = b

    @device
    def judge(w):
        """Accept or reject; how many lanes are still on their way."""
        busy = 0
        for i in range(w.shape[1]):
            length = w[TRIAL, i]
            t, y = w[NEW_TIME, i], w[NEW_CHANGE, i]
            r = w[ORIGIN, i] + y
            # Of the whole time, and of the change of r since the start of the passage, as in march.py.
            long = min(w[BEFORE, i] + t, LONG * t) + 1e-300
            size = min(abs(r), abs(y) + abs(length * w[CHANGES, i])) + 1e-300
            _, a = time_errors(w, i, length / long)
            _, b = change_errors(w, i, length / size)
            relative = max(a, b) * w[TIGHT, i]
            # A lane that is done waits for the others as it is.
            good = (length > 0.0) & (w[BAD_, i] == 0.0) & (relative <= 1.0) & (r > 0.0)
            factor = factor_of(relative)
            factor = factor if good else (min(factor, SAFETY) if w[BAD_, i] == 0.0 else 0.3)
            rest = max(w[STIFFNESS, i] - length, 0.0) if good else w[STIFFNESS, i]
            # Steps in D change T and r by too much or too little, both alike: what they miss is D, by the equilibrium.
            E = field(t, w[START_, i], w[SLOPE_, i], w[AMPLITUDE_, i], w[FREQUENCY_, i])
            x, bad = settle(r, w[P_, i], w[SIGMA_, i], E, w[GUESS_, i])
            d, _, _, _, _, _, _ = local(r, w[P_, i], w[SIGMA_, i], x, 0.0, 0.0)
            corrected = good & (bad == 0.0) & (abs(d - rest) < CORRECTION * rest)
            w[GUESS_, i] = x if corrected else w[GUESS_, i]
            rest = d if corrected else rest
            grows, along, of_r, of_time, of_state = growth(w, i, t, y, rest)
            grows = grows if rest > 0.0 else 0.0
            grown = np.exp(min(0.5 * length * (w[GROWTH_, i] + grows), 100.0))
            # dT/dD has errors by those of r on the way, whatever the estimate of the time says.
            late = w[OF_TIME, i] * grown + SAFE * max(a * long, b * size * of_r) + EPSILON * t
            w[OF_TIME, i] = late if good else w[OF_TIME, i]
            # At fixed D an error of r goes with that of the time, unless r has too little part in the equilibrium.
            turned = max(1.0, abs(along / w[ALONG, i])) if 0.0 < abs(w[ALONG, i]) < LARGEST_ALONG else 1.0
            w[OF_STATE, i] = w[OF_STATE, i] * grown * turned + b * size + EPSILON * abs(r) if good else w[OF_STATE, i]
            w[ALONG, i] = along if good else w[ALONG, i]
            w[GROWTH_, i] = grows if good else w[GROWTH_, i]
            w[TIME, i] = t if good else w[TIME, i]
            w[CHANGE, i] = y if good else w[CHANGE, i]
            w[UNKNOWN, i] = w[GUESS_, i] if good else w[UNKNOWN, i]
            w[TIMES, i] = of_time if good else w[TIMES, i]
            w[CHANGES, i] = of_state if good else w[CHANGES, i]
            w[LOW, i] = min(w[LOW, i], w[UNKNOWN, i])
            w[HIGH, i] = max(w[HIGH, i], w[UNKNOWN, i])
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
        d, _, q, _, _, _, _ = local(r, p[cell], sigma[cell], x, f, 2.0 * CRITICAL_LOAD * E * rate)
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
        w[TIGHT, i] = TIGHTER * kept[TIGHTNESS, passage]
        rounding = 4.0 * EPSILON * (1.0 + p[cell] / r)
        error = total_error(kept[ERROR, passage], kept[ROUNDING, passage])
        w[GUESS_, i] = x
        w[GROWTH_, i], w[ALONG, i], of_r, w[TIMES, i], w[CHANGES, i] = growth(w, i, t, y, d)
        late = of_r * error + abs(d * rounding / q)
        w[OF_TIME, i] = late
        w[OF_STATE, i] = error + abs(f) * late
        w[TRIAL, i] = d
        w[LOW, i] = x
        w[HIGH, i] = x

    @device
    def finish(kind, scale, source, columns, p, sigma, cells, status, kept):
        w = np.ones((ROWS, lanes))
        held = np.empty(lanes, np.int64)
        following = 0
        while True:
            count, following = next_cells(status, following, NEAR, held)
            if count == 0:
                return
            for i in range(count):
                put(kind, scale, source, columns, p, sigma, cells[held[i]], kept, held[i], w, i)
            for i in range(count, lanes):
                w[TRIAL, i] = 0.0
            for _ in range(ATTEMPTS):
                attempt(w)
                if judge(w) == 0:
                    break
            for i in range(count):
                passage = held[i]
                r = w[ORIGIN, i] + w[CHANGE, i]
                kept[COUNT, passage] += 20.0
                elastic = w[P_, i] == 0.0 and w[SIGMA_, i] == 0.0
                piece = np.int64(kept[PIECE, passage])
                tie = elastic and piece < kind.size and kind[piece] == LINEAR
                tie = tie and abs(field_at_end(kind, scale, source, columns, piece, cells[passage])) == 1.0
                if tie and w[STIFFNESS, i] == 0.0:
                    # Decided on the field: it fails at the end of the piece.
                    w[TIME, i] = w[DURATION_, i]
                    w[OF_TIME, i] = 0.0
                if w[STIFFNESS, i] == 0.0 and w[TIME, i] <= w[DURATION_, i]:
                    status[passage] = FELL
                    kept[T, passage] = w[TIME, i]
                    kept[Y, passage] = w[CHANGE, i]
                    kept[X, passage] = w[UNKNOWN, i]
                    kept[TIME_ERROR, passage] = w[OF_TIME, i]
                    kept[ERROR, passage] = w[OF_STATE, i]
                    if abs(w[ALONG, i]) < LARGEST_ALONG:
                        kept[ERROR, passage] = min(w[OF_STATE, i], abs(w[ALONG, i]) * w[OF_TIME, i] + EPSILON * r)
                    kept[ROUNDING, passage] = 0.0
                    # Whether it failed before the end of the piece.
                    doubt = w[OF_TIME, i] / (w[DURATION_, i] - w[TIME, i] + 1e-300)
                    kept[DOUBT, passage] = max(kept[DOUBT, passage], doubt)
                    kept[LEAST, passage] = min(kept[LEAST, passage], w[LOW, i])
                    kept[MOST, passage] = max(kept[MOST, passage], w[HIGH, i])
                else:
                    status[passage] = READY
                    kept[BARRED, passage] = 0.0 if w[TIME, i] > w[DURATION_, i] else 0.5 * w[ENTRY, i]

    return finish
