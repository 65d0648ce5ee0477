"""Passages through a program: dr/dT = F(r, E(T)), explicit Runge-Kutta steps in lanes.

A step of length s lasts T = s (1 + Q s/(2 D**2)), which is dT/ds = D/D(0) where D**2 follows its tangent: next to the
instability r has a term in the power 3/2 of the time left to it, which is smooth in s. Every lane takes steps of its
own length, in a piece of its own, and the next waiting passage as soon as its own is done or waits for another phase. r
is kept as its value at the start of the passage and the change since, so that the change, of which cycles consist, is
accurate relative to itself.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .._jit import device
from ..elementary import exponential
from ..model import CRITICAL_LOAD, instant_gap
from ..runge_kutta.tableaus import DOP853, Row
from .law import ELASTIC, Law
from .pieces import Waves, describe, field_at_end
from .rows import (
    AMPLITUDE,
    BAD,
    BARRED,
    BASE,
    BETWEEN,
    COUNT,
    DOUBT,
    DURATION,
    ENDED,
    ERROR,
    EVENT,
    FIRST_STEP,
    FLOW,
    FREQUENCY,
    GAIN,
    GROWTH,
    HELD,
    HOLDING,
    HOLDS,
    JUMPED,
    KEPT,
    LAST_LENGTH,
    LAST_ROOT,
    LEAST,
    LEAST_ERROR,
    LEAST_SLOPE,
    LONGEST,
    MOST,
    NEAR,
    NEW,
    NEW_X,
    OFFSET,
    PENDING,
    PIECE,
    RATE_OF_X,
    REACH,
    REACH_R,
    REACH_X,
    READY,
    RESOLUTION,
    ROUNDING,
    SCALE,
    SIGMA,
    SLOPE,
    SLOPES,
    SPENT,
    START,
    STEP,
    TIGHTNESS,
    TRIAL,
    TURN,
    UNTIL,
    ZERO,
    D,
    N,
    P,
    Q,
    T,
    X,
    Y,
)

ATTEMPTS = 2_000_000
LARGEST_FACTOR = 4.0
SMALLEST_FACTOR = 0.2
SAFETY = 0.9
EPSILON = 2.0**-52

LAST = SLOPES + DOP853.stages
ROWS = LAST + 1

NOTHING, PIECE_DONE, CLOSE, TOO_MANY = 0.0, 1.0, 2.0, 3.0
VACANT = -1

# Steps to the instability, by the tangent of D**2, below which stiffness becomes the variable.
AHEAD = 2.0
# The same, over what is left of the piece, above which the film is taken not to fail in it: the tangent is above the
# curve where the load rises, and what it misses a step in time finds.
WITHIN = 1.0
# Length of a step, over that to the instability by the tangent of D**2, halved.
SHORT_OF = 0.45
# Distance from rest, over r, at which one iteration of Newton's method leaves rounding.
AT_REST = 1e-8
RELAXATIONS = 40.0
# Ratio of D**2 at both ends of a step, and of the least within it to those, below which it is next to the instability.
UNEVEN = 0.2
DIP = 0.8
# Relaxation times in a step beyond which it is next to its limit of stability, and the error does not follow either.
STIFF = 4.0
# Of the period of a sine that a step may be long: in longer ones the stages do not see its shape, nor do the estimates.
# Irrational, so that steps as long as this leave no last one of next to nothing.
PART_OF_PERIOD = math.sqrt(5.0) / 8.0
# Of the errors relative to the change in a step below which they are rounding and do not fall with the order.
NOISE = 1e-12
# Error of r in a step that always passes: below rounding; in a cycle like the one before, below that of its change.
FLOOR = 1e-17
# Part of r that it changes by from rest to the instability, about: bears on the cost alone.
LARGEST_CHANGE = 0.1
# The same over the length of the step: what rounding of dr/dT, a difference of numbers near 1, leaves in an estimate.
UNCERTAIN = EPSILON


@device
def total_error(error, rounding):
    """Error of r by the method and by rounding, whose parts add like independent ones: two standard deviations."""
    return error + 2.0 * np.sqrt(rounding)


def make_weighted_sum(weights: Row, first: int) -> Callable[..., Any]:
    """Make ``weighted_sum(w, i)`` of the rows from ``first`` on; zero weights cost nothing."""
    factors = tuple(weight for weight in weights if weight != 0.0)
    sources = tuple(first + stage for stage, weight in enumerate(weights) if weight != 0.0)
    count = len(factors)

    @device
    def weighted_sum(w, i):
        total = factors[0] * w[sources[0], i]
        for j in range(1, count):
            total += factors[j] * w[sources[j], i]
        return total

    return weighted_sum


# Stages as a table, in a loop rather than unrolled: eleven times less to compile, for a tenth of the time.
STAGES = DOP853.stages
COEFFICIENTS = np.zeros((STAGES + 1, STAGES))
for _stage, _row in enumerate((*DOP853.rows, DOP853.weights)):
    COEFFICIENTS[_stage + 1, : len(_row)] = _row
NODES = COEFFICIENTS.sum(axis=1)
# The guess of the unknown goes on along the secant through the start of the step and the stage before.
RATIOS = np.ones(STAGES + 1)
RATIOS[2:] = NODES[2:] / NODES[1:-1]


@device
def add_slopes(w, stage, first, target):
    """Sum of the rows from ``first`` on with the coefficients of a stage, into the row ``target``."""
    for i in range(w.shape[1]):
        w[target, i] = COEFFICIENTS[stage, 0] * w[first, i]
    for j in range(1, stage):
        coefficient = COEFFICIENTS[stage, j]
        if coefficient != 0.0:
            for i in range(w.shape[1]):
                w[target, i] += coefficient * w[first + j, i]


@device
def to_end(w, i):
    """Return the length of a step to the end of the piece; infinite where the tangent meets the instability before."""
    left = w[DURATION, i] - w[T, i]
    square = 1.0 + 4.0 * w[TURN, i] * left
    length = 2.0 * left / (1.0 + np.sqrt(max(square, 0.0)))
    length = length if square > 0.0 else math.inf
    return length if left < math.inf else left


def _make_attempt(law: Law, waves: Waves) -> Callable[..., Any]:
    """Make ``attempt(w)``: the state ``NEW`` after a step, the unknown and dr/dT there."""
    settle, flow, field = law.settle, law.flow, waves.field

    @device
    def attempt(w):
        for i in range(w.shape[1]):
            w[NEW_X, i] = w[X, i]
            w[BAD, i] = 0.0
        for stage in range(1, STAGES + 1):  # the last one is the new state
            add_slopes(w, stage, SLOPES, NEW)
            node, ratio = NODES[stage], RATIOS[stage]
            for i in range(w.shape[1]):
                length = w[TRIAL, i]
                y = w[Y, i] + length * w[NEW, i]
                r = w[BASE, i] + y
                s = node * length
                E = field(
                    w[T, i] + s * (1.0 + w[TURN, i] * s), w[START, i], w[SLOPE, i], w[AMPLITUDE, i], w[FREQUENCY, i]
                )
                guess = w[X, i] + ratio * (w[NEW_X, i] - w[X, i])
                x, bad = settle(r, w[P, i], w[SIGMA, i], E, guess)
                w[BAD, i] += bad
                w[NEW, i] = y
                w[NEW_X, i] = x
                F = flow(r, w[P, i], x, E)
                w[FLOW, i] = F
                w[SLOPES + stage, i] = F * (1.0 + 2.0 * w[TURN, i] * s)

    return attempt


def make_errors(first: int) -> Callable[..., Any]:
    """Make ``errors(w, i, size)``: relative errors of a step, ``size`` being its length over the scale.

    First that of the embedded solution of order 5, which holds whatever the solution does, then the one extrapolated
    from both embedded solutions to the order 8 that is carried on, where the solution is smooth.
    """
    fifth = make_weighted_sum(DOP853.errors[0], first)
    third = make_weighted_sum(DOP853.errors[1], first)

    @device
    def errors(w, i, size):
        # a vanishes like h**6 and b like h**4. Each alone, raised to h**9, is too small where the step is long, and
        # vanishes where it changes sign; a times a/b, h**8, sees how fast the errors fall with the order.
        a = abs(size * fifth(w, i))
        b = abs(size * third(w, i))
        rough = max(a, b * np.sqrt(b))
        return rough, max(rough * np.sqrt(rough), 3.0 * a * a / (a + b + NOISE))

    return errors


@device
def factor_of(relative):
    """Return the factor for the step length after an error this large over what is allowed."""
    return factor_of_root(eighth_root(relative))


@device
def eighth_root(relative):
    """Return the eighth root of an error over what is allowed, in single precision."""
    return float(np.sqrt(np.sqrt(np.sqrt(np.float32(max(relative, 1e-12))))))


@device
def factor_of_root(root):
    """Return the factor for the step length, from the eighth root of an error over what is allowed."""
    factor = SAFETY / root
    return min(factor, LARGEST_FACTOR) if factor > SMALLEST_FACTOR else SMALLEST_FACTOR  # also where it is NaN


@device
def hermite(x0, v0, x1, v1, share):
    """Return Hermite's cubic at a share of the way."""
    left = 1.0 - share
    return left * left * (x0 * (1.0 + 2.0 * share) + v0 * share) + share * share * (
        x1 * (3.0 - 2.0 * share) - v1 * left
    )


def _make_judge(law: Law, waves: Waves, bent: bool) -> Callable[..., Any]:
    """Make ``judge(w) -> events``: accept or reject the last attempt of every lane, and propose the next step."""
    local, field, field_rate = law.local, waves.field, waves.rate
    errors = make_errors(SLOPES)

    @device
    def judge(w):
        events = 0
        for i in range(w.shape[1]):
            length = w[TRIAL, i]
            y, x = w[NEW, i], w[NEW_X, i]
            r = w[BASE, i] + y
            flow = w[FLOW, i]
            lasts, pace = length * (1.0 + w[TURN, i] * length), 1.0 + 2.0 * w[TURN, i] * length
            t = w[T, i] + lasts
            change = abs(y) + abs(length * w[SLOPES, i])
            least = min(FLOOR, max(EPSILON * w[SCALE, i], UNCERTAIN * lasts)) if w[SCALE, i] > 0.0 else FLOOR
            scale = min(abs(r), max(change, max(w[SCALE, i], least * w[TIGHTNESS, i])))
            rough, fine = errors(w, i, length / scale)
            E = field(t, w[START, i], w[SLOPE, i], w[AMPLITUDE, i], w[FREQUENCY, i])
            rate = field_rate(t, w[START, i], w[SLOPE, i], w[AMPLITUDE, i], w[FREQUENCY, i])
            load_rate = 2.0 * CRITICAL_LOAD * E * rate
            d, n, q, growth, rate_of_x, fragility, sensitivity = local(r, w[P, i], w[SIGMA, i], x, flow, load_rate)
            s0, s1 = w[D, i] * w[D, i], d * d
            # The tangents of D**2 at both ends, and where they meet.
            m0, m1 = 2.0 * lasts * w[Q, i], 2.0 * lasts * q
            meet = (s1 - s0 - m1) / (m0 - m1)
            turned = (m0 < 0.0) & (m1 > 0.0)
            lowest = s0 + m0 * meet if turned else min(s0, s1)
            # Next to the instability the solution is not smooth: no power of the estimate follows the error.
            smooth = (s1 > UNEVEN * s0) & (s0 > UNEVEN * s1) & (lowest >= DIP * min(s0, s1))
            growing = 0.5 * length * (w[GROWTH, i] + pace * growth)
            grown = exponential(min(growing, 100.0))
            estimate = fine if smooth & (growing > -STIFF) else rough
            # An error made within the step has grown at its end, and where it grows much the estimates fall behind.
            estimate = estimate * grown if growing > 1.0 else estimate
            relative = estimate * w[TIGHTNESS, i]
            settled = w[BAD, i] == 0.0
            good = settled & (relative <= 1.0) & (r > 0.0) & (d > 0.0)

            # Where the tangents meet below zero, the film may have failed in between.
            missed = good & turned & (lowest <= 0.0)
            # An extreme of the unknown within the step, by Hermite's cubic, if it counts. Of the two zeros of its slope
            # one is the least value, and one the largest.
            x0, v0, v1 = w[X, i], length * w[RATE_OF_X, i], length * pace * rate_of_x
            second, third = 3.0 * (x - x0) - 2.0 * v0 - v1, v0 + v1 - 2.0 * (x - x0)
            square = second * second - 3.0 * third * v0
            root = np.sqrt(max(square, 0.0))
            far = -second - root if second > 0.0 else root - second
            one, other = far / (3.0 * third), v0 / far
            at_least, at_most = (other if second > 0.0 else one), (one if second > 0.0 else other)
            margin = 1.0 + w[RESOLUTION, i]
            # The cubic is wrong by less than what an extreme differs from the ends of the step: one of many that hardly
            # differ from another counts if it may be the largest.
            under, over = min(x0, x), max(x0, x)
            below, above = hermite(x0, v0, x, v1, at_least), hermite(x0, v0, x, v1, at_most)
            low = (below * margin < under) & ((2.0 * below - under) * margin < w[LEAST, i])
            high = (above > margin * over) & (2.0 * above - over > margin * w[MOST, i])
            low = low & (at_least > 0.0) & (at_least < 1.0)
            high = high & (at_most > 0.0) & (at_most < 1.0)
            extreme = good & (not missed) & (square > 0.0) & (low | high)
            share = at_least if low else at_most
            accepted = good & (not missed) & (not extreme)

            root = eighth_root(relative)
            factor = factor_of_root(root)
            # Where errors grow from step to step they go on doing so: predictive control (Gustafsson 1994).
            predicted = factor * length * w[LAST_ROOT, i] / (w[LAST_LENGTH, i] * root)
            predicted = max(min(factor, predicted), SMALLEST_FACTOR) if w[LAST_LENGTH, i] > 0.0 else factor
            # A length at this stiffness, and the same at the next.
            unit = d / w[D, i] if accepted & bent else 1.0
            w[LAST_LENGTH, i] = length * unit if accepted else w[LAST_LENGTH, i]
            w[LAST_ROOT, i] = root if accepted else w[LAST_ROOT, i]
            factor = predicted if accepted else (min(factor, SAFETY) if settled else min(factor, 0.4))
            factor = 0.4 if missed else factor
            factor = share if extreme else factor
            proposed = min(length * factor * unit, w[LONGEST, i])
            last = length >= to_end(w, i)
            cut = last | (length < 0.5 * w[STEP, i])
            w[STEP, i] = max(proposed, w[STEP, i]) if accepted & cut else proposed
            w[FIRST_STEP, i] = proposed if accepted & (w[FIRST_STEP, i] == 0.0) else w[FIRST_STEP, i]

            carried = w[ERROR, i] * grown + estimate * scale
            # Of the sum y, of F, and of r in F.
            parts = y * y + 4.0 * (change - abs(y)) * (change - abs(y)) + r * r * min(1.0, growing * growing)
            rounding = w[ROUNDING, i] * grown * grown + 0.25 * EPSILON * EPSILON * parts
            w[ERROR, i] = carried if accepted else w[ERROR, i]
            w[ROUNDING, i] = rounding if accepted else w[ROUNDING, i]
            w[GAIN, i] *= grown if accepted else 1.0
            # On the way to an instability the distance to it vanishes whatever the errors: near misses count.
            # Of one within the step the distance is at least that where the tangents meet.
            nearest = min(lowest, s1) if turned else s1
            doubt = total_error(carried, rounding) * fragility / max(nearest, 1e-300)
            reach = nearest / fragility
            closest = accepted & (reach < w[REACH, i])
            w[REACH, i] = reach if closest else w[REACH, i]
            w[REACH_R, i] = r if closest else w[REACH_R, i]
            w[REACH_X, i] = x if closest else w[REACH_X, i]
            past = max(w[DOUBT, i], max(w[PENDING, i], doubt))
            w[DOUBT, i] = past if accepted & (q >= 0.0) else w[DOUBT, i]
            w[PENDING, i] = doubt if accepted else w[PENDING, i]
            w[T, i] = t if accepted else w[T, i]
            w[Y, i] = y if accepted else w[Y, i]
            w[X, i] = x if accepted else w[X, i]
            w[SLOPES, i] = flow if accepted else w[SLOPES, i]
            w[D, i] = d if accepted else w[D, i]
            w[N, i] = n if accepted else w[N, i]
            w[Q, i] = q if accepted else w[Q, i]
            w[GROWTH, i] = growth if accepted else w[GROWTH, i]
            w[RATE_OF_X, i] = rate_of_x if accepted else w[RATE_OF_X, i]

            # At rest under a held field: there is nothing more to come in this piece.
            away = w[SLOPES, i] / w[GROWTH, i]
            remaining = w[DURATION, i] - w[T, i]
            rest = (w[SLOPE, i] == 0.0) & (w[AMPLITUDE, i] == 0.0) & (w[GROWTH, i] < 0.0)
            rest = rest & (remaining < math.inf) & (abs(away) <= AT_REST * (w[BASE, i] + w[Y, i]))
            rest = rest & (-w[GROWTH, i] * remaining > RELAXATIONS)
            done = (accepted & last) | rest
            w[Y, i] = w[Y, i] - away if rest else w[Y, i]
            w[X, i] = w[X, i] - w[RATE_OF_X, i] / w[GROWTH, i] if rest else w[X, i]
            least_yet = accepted & (x < w[LEAST, i])
            w[LEAST_ERROR, i] = sensitivity * total_error(carried, rounding) if least_yet else w[LEAST_ERROR, i]
            w[LEAST_SLOPE, i] = sensitivity * w[GAIN, i] if least_yet else w[LEAST_SLOPE, i]
            w[LEAST, i] = min(w[LEAST, i], w[X, i])
            w[MOST, i] = max(w[MOST, i], w[X, i])
            w[GAIN, i] *= 0.0 if rest else 1.0

            distance = -0.5 * w[D, i] * w[D, i] / w[Q, i]  # in time to the instability, by the tangent of D**2
            ahead = AHEAD * w[STEP, i] if settled else 4.0 * length
            close = (w[Q, i] < 0.0) & (w[D, i] < w[BARRED, i]) & (distance < min(ahead, WITHIN * remaining))
            w[TURN, i] = 0.5 * w[Q, i] / (w[D, i] * w[D, i]) if bent & (w[SLOPE, i] != 0.0) else 0.0
            w[COUNT, i] += 1.0
            spent = (w[COUNT, i] >= ATTEMPTS) | (not (length > max(1e-15 * w[T, i], 1e-250)))
            met = PIECE_DONE if done else (CLOSE if close else (TOO_MANY if spent else NOTHING))
            w[EVENT, i] = met if length > 0.0 else NOTHING
            events += w[EVENT, i] != NOTHING
        return events

    return judge


class Passage(NamedTuple):
    """What a lane takes to go through a program.

    Attributes
    ----------
    attempt, judge : callable
        ``attempt(w)`` one step of every lane, ``judge(w)`` accepts or rejects it and says what was met, in EVENT.
    take : callable
        ``take(kind, scale, source, columns, p, sigma, cells, kept, w, i, passage)`` puts a passage into a lane; its
        status.
    go_on : callable
        ``go_on(kind, scale, source, columns, cell, w, i)`` from the end of a piece to the next; the status.
    put, leave, enter : callable
        What the last two consist of, to be compiled once.
    """

    attempt: Callable[..., Any]
    judge: Callable[..., Any]
    take: Callable[..., Any]
    go_on: Callable[..., Any]
    put: Callable[..., Any]
    leave: Callable[..., Any]
    enter: Callable[..., Any]


def make_passage(law: Law, waves: Waves, bent: bool) -> Passage:
    """Make the functions that take lanes through a program; ``bent`` says whether TURN is not zero."""
    flow, local, begin, critical, load, ends = law.flow, law.local, law.begin, law.critical, law.load, law.ends
    plain_flow = law.plain_flow
    field, field_rate, zero = waves.field, waves.rate, waves.zero

    @device
    def set_piece(kind, scale, source, columns, cell, w, i):
        piece = np.int64(w[PIECE, i])
        if piece < kind.size:
            start, slope, amplitude, frequency, duration = describe(kind, scale, source, columns, piece, cell)
        else:
            start, slope, amplitude, frequency, duration = w[HELD, i], 0.0, 0.0, 0.0, math.inf
        w[START, i] = start
        w[SLOPE, i] = slope
        w[AMPLITUDE, i] = amplitude
        w[FREQUENCY, i] = frequency
        w[DURATION, i] = duration
        w[LONGEST, i] = PART_OF_PERIOD / frequency if frequency > 0.0 else math.inf
        w[ZERO, i] = zero(start, amplitude)

    @device
    def jump(w, i, E):
        """Bring a lane to another field at once; false where the film does not carry it."""
        r, p, sigma = w[BASE, i] + w[Y, i], w[P, i], w[SIGMA, i]
        x = critical(r, p, sigma)
        E = abs(E)
        if (r == 1.0 or p == 0.0) and sigma == 0.0:
            beyond = instant_gap(E, 1.0 + p) <= 0.0
        else:
            carried = load(r, p, sigma, x)
            beyond = np.sqrt(carried / CRITICAL_LOAD) <= E
            error = total_error(w[ERROR, i], w[ROUNDING, i])
            if error > 0.0:
                _, load_of_r, _ = ends(r, p, sigma, x)
                gap = abs(carried - CRITICAL_LOAD * E * E)
                w[DOUBT, i] = max(w[DOUBT, i], abs(load_of_r) * error / gap)
        w[X, i] = x if beyond else begin(r, p, sigma, E)
        w[LEAST, i] = min(w[LEAST, i], w[X, i])
        w[MOST, i] = max(w[MOST, i], w[X, i])
        return not beyond

    @device
    def look(w, i):
        """Everything that follows from the state of a lane."""
        t, r = w[T, i], w[BASE, i] + w[Y, i]
        E = field(t, w[START, i], w[SLOPE, i], w[AMPLITUDE, i], w[FREQUENCY, i])
        rate = field_rate(t, w[START, i], w[SLOPE, i], w[AMPLITUDE, i], w[FREQUENCY, i])
        F = flow(r, w[P, i], w[X, i], E)
        w[SLOPES, i] = F
        d, n, q, growth, rate_of_x, fragility, sensitivity = local(
            r, w[P, i], w[SIGMA, i], w[X, i], F, 2.0 * CRITICAL_LOAD * E * rate
        )
        w[D, i] = d
        w[N, i] = n
        w[Q, i] = q
        w[GROWTH, i] = growth
        w[RATE_OF_X, i] = rate_of_x
        w[TURN, i] = 0.5 * q / (d * d) if bent and w[SLOPE, i] != 0.0 else 0.0
        error = total_error(w[ERROR, i], w[ROUNDING, i])
        w[PENDING, i] = error * fragility / (d * d)
        if w[X, i] <= w[LEAST, i]:
            w[LEAST_ERROR, i] = sensitivity * error
            w[LEAST_SLOPE, i] = sensitivity * w[GAIN, i]

    @device
    def expected_change(w, i):
        """Return about what r changes by while the field rises from nothing, where the flow grows like its square."""
        r, p, sigma = w[BASE, i] + w[Y, i], w[P, i], w[SIGMA, i]
        end = abs(w[START, i] + w[SLOPE, i] * w[DURATION, i])
        x = critical(r, p, sigma)
        carried = np.sqrt(load(r, p, sigma, x) / CRITICAL_LOAD)
        if end < carried:
            x = begin(r, p, sigma, end)
        lasts = w[DURATION, i] * min(1.0, carried / end)
        return min(LARGEST_CHANGE * r, abs(plain_flow(r, x)) * lasts / 3.0)

    @device
    def enter(kind, scale, source, columns, cell, w, i, E, fresh):
        """Begin a piece, and those of no duration before it, after the field E; the status of the passage.

        ``fresh`` says whether the unknown is not yet that of any field.
        """
        w[T, i] = 0.0
        at_end = False
        # An elastic film under the field that it fails under, whatever rounding said at the end of the piece before.
        tie = not fresh and w[P, i] == 0.0 and w[SIGMA, i] == 0.0 and abs(E) >= 1.0
        while True:
            if not (at_end or tie):
                if w[PIECE, i] == w[UNTIL, i] and w[HELD, i] < 0.0:
                    return ENDED
                set_piece(kind, scale, source, columns, cell, w, i)
            target = field_at_end(kind, scale, source, columns, np.int64(w[PIECE, i]), cell) if at_end else w[START, i]
            target = E if tie else target
            if (fresh or tie or target != E) and not jump(w, i, target):
                return JUMPED
            if tie:
                tie = False
                continue
            fresh = False
            E = target
            if at_end:
                w[PIECE, i] += 1.0
            elif w[DURATION, i] > 0.0:
                break
            at_end = not at_end
        w[BARRED, i] = math.inf
        w[LAST_LENGTH, i] = 0.0
        look(w, i)
        if not w[STEP, i] > 0.0:
            w[STEP, i] = 2.0 * w[TIGHTNESS, i] ** (-0.125) / abs(w[GROWTH, i])
            if w[SLOPES, i] == 0.0 and w[SLOPE, i] != 0.0:
                w[SCALE, i] = expected_change(w, i)
        w[STEP, i] = min(w[STEP, i], w[LONGEST, i])
        asked = w[HOLDING, i] > (0.0 if w[DURATION, i] == math.inf else 1.0)
        held = w[SLOPE, i] == 0.0 and w[AMPLITUDE, i] == 0.0 and w[P, i] > ELASTIC
        if asked and held and (abs(E) > 1.0 or w[SIGMA, i] > 0.0):
            return HOLDS
        return READY

    @device
    def put(kind, scale, source, columns, p, sigma, cells, kept, w, i, passage):
        """Put a passage into a lane; whether it is about to enter its piece."""
        for row in range(KEPT):
            w[row, i] = kept[row, passage]
        cell = cells[passage]
        w[P, i] = p[cell]
        w[SIGMA, i] = sigma[cell]
        if w[T, i] < 0.0:
            return True
        w[LAST_LENGTH, i] = 0.0
        set_piece(kind, scale, source, columns, cell, w, i)
        look(w, i)
        return False

    @device
    def leave(kind, scale, source, columns, cell, w, i):
        """Leave a piece; the field at its end."""
        E = field_at_end(kind, scale, source, columns, np.int64(w[PIECE, i]), cell)
        w[DOUBT, i] = max(w[DOUBT, i], w[PENDING, i])
        w[OFFSET, i] += w[DURATION, i]
        w[PIECE, i] += 1.0
        return E

    @device
    def take(kind, scale, source, columns, p, sigma, cells, kept, w, i, passage):
        if put(kind, scale, source, columns, p, sigma, cells, kept, w, i, passage):
            return enter(kind, scale, source, columns, cells[passage], w, i, w[X, i], True)
        return READY

    @device
    def go_on(kind, scale, source, columns, cell, w, i):
        E = leave(kind, scale, source, columns, cell, w, i)
        return enter(kind, scale, source, columns, cell, w, i, E, False)

    return Passage(_make_attempt(law, waves), _make_judge(law, waves, bent), take, go_on, put, leave, enter)


def make_march(law: Law, waves: Waves, lanes: int) -> Callable[..., Any]:
    """Make ``march(kind, scale, source, columns, p, sigma, cells, status, kept, holding)``.

    Every passage (column of ``kept`` (KEPT, passages), of the cell ``cells[passage]``) whose status is READY goes on
    until it is NEAR the instability, HOLDS, has ENDED, JUMPED beyond what the film carries, or is SPENT. ``holding`` is
    what HOLDING says.
    """
    attempt, judge, _, _, put, leave, enter = make_passage(law, waves, True)
    turn = waves.turn

    @device
    def march(kind, scale, source, columns, p, sigma, cells, status, kept, holding):
        w = np.zeros((ROWS, lanes))
        held = np.empty(lanes, np.int64)
        for i in range(lanes):
            held[i] = VACANT
            w[BASE, i] = 1.0
            w[X, i] = 1.0
            w[HOLDING, i] = holding
        following, busy, events = 0, 0, lanes
        while True:
            for i in range(lanes if events > 0 else 0):
                while True:
                    passage = held[i]
                    E, enters, fresh, state = 0.0, False, False, READY
                    if passage != VACANT:
                        if w[EVENT, i] == NOTHING:
                            break
                        enters = w[EVENT, i] == PIECE_DONE
                        if enters:
                            E = leave(kind, scale, source, columns, cells[passage], w, i)
                        else:
                            state = NEAR if w[EVENT, i] == CLOSE else SPENT
                        w[EVENT, i] = NOTHING
                    else:
                        while following < status.size and status[following] != READY:
                            following += 1
                        if following == status.size:
                            break
                        passage = following
                        following += 1
                        held[i] = passage
                        busy += 1
                        w[EVENT, i] = NOTHING
                        enters = put(kind, scale, source, columns, p, sigma, cells, kept, w, i, passage)
                        E, fresh = w[X, i], True
                        if w[T, i] == BETWEEN:
                            before = np.int64(w[PIECE, i]) - 1
                            E, fresh = field_at_end(kind, scale, source, columns, before, cells[passage]), False
                    if enters:
                        state = enter(kind, scale, source, columns, cells[passage], w, i, E, fresh)
                    if state != READY:
                        for row in range(KEPT):
                            kept[row, passage] = w[row, i]
                        status[passage] = state
                        held[i] = VACANT
                        w[TRIAL, i] = 0.0
                        busy -= 1
            if busy == 0:
                return
            for i in range(lanes):
                left = to_end(w, i)
                even = left if left <= w[STEP, i] else min(w[STEP, i], 0.5 * left)
                even = min(even, SHORT_OF / max(-w[TURN, i], 1e-300)) if left == math.inf else even
                # The stretch has extremes next to those of the load: of either one at most in a step.
                even = min(even, turn(w[T, i], w[FREQUENCY, i], w[ZERO, i]) - w[T, i])
                w[TRIAL, i] = even if held[i] != VACANT else 0.0
            attempt(w)
            events = judge(w)

    return march
