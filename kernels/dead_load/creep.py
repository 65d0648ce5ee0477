"""First part of a rising field on a film that creeps under its dead load: the dashpot over the field.

The field E/Ec = f = k T itself is the independent variable, until e is no longer small against p u**2, or D against
its parts; then the scalar equation of `rise.py` takes over, whose e is a difference. The state is r = xi**2,

    dr/df = (2/k) (1/z - z**2),    z = r w**2,

w = 1/lambda by Halley's method from equilibrium, (18) to (20), at every stage.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import device
from ..lane_state import AT_END, BUDGET_SPENT, RUNNING
from ..model import CRITICAL_LOAD
from ..runge_kutta.step import make_sequence, make_weighted_sum
from ..runge_kutta.tableaus import Row, Tableau

# Status of a cell that is to be taken through this part.
CREEPS = 9

# Rows of what is known of a cell, and of what is found: w, r and f at the end.
P, SIGMA, SLOWNESS, END, ENOUGH, INVERSE_TOLERANCE, W, R = range(8)
CREEP = 8
# Rows of the block, after these.
FIELD = 8
STEP = 9  # proposed
TRIAL = 10  # of this attempt; zero in a lane that is vacant
PREVIOUS = 11  # root of the last accepted error
COUNT = 12
DONE = 13
GUESS = 14  # of w at the next stage, and its last correction
OFF = 15
SLOPES = 16

SAFETY = 0.9
SMALLEST_FACTOR = 0.2
LARGEST_FACTOR = 4.0
# Root of the error that counts as that of the step before, after one that was rejected: without it, every second step
# may be rejected while steps shorten.
AFTER_REJECTION = 0.5
ATTEMPTS = 3000
# Changes, relative, over the first step: times the eighth root of the tolerance.
FIRST_STEP = 1.2
# Where it ends: e over p u**2, or D over its positive part. No step ends closer to the instability than the last.
LARGE = 0.1
SMALL_STIFFNESS = 0.3
SMALLEST_STIFFNESS = 0.02
# Iterations for w, from that of the stage before, and the correction at which it has been found.
ITERATIONS = 3
FOUND = 1e-6
ROUNDING = 1e-15
VACANT = -1


@device
def _miss(p, sigma, f, x, r):
    """Return by how much a film carries more than e, and the first and second derivatives of that by w."""
    A, B = 1.0 + p / r, 1.0 + p * r * r
    u = x * x
    bend = B * u * u * u
    drag = sigma * x
    return (
        u * (A - bend - drag) - CRITICAL_LOAD * f * f,
        x * (2.0 * A - 8.0 * bend - 3.0 * drag),
        2.0 * A - 56.0 * bend - 6.0 * drag,
    )


@device
def change_of_w(p, sigma, slowness, f, x, r):
    """dw/df."""
    _, slope, _ = _miss(p, sigma, f, x, r)
    u = x * x
    z = r * u
    cube = z * z * z
    of_r = p * u * (1.0 + 2.0 * cube) / (r * r)  # -de/dr
    return 2.0 * (CRITICAL_LOAD * f + of_r * slowness * (1.0 - cube) / z) / slope


@device
def _rhs(w, i, f, r):
    """dr/df; leaves w of the film in row GUESS, and its last correction in row OFF."""
    p, sigma = w[P, i], w[SIGMA, i]
    x, step = w[GUESS, i], 0.0
    for _ in range(ITERATIONS):
        miss, slope, bend = _miss(p, sigma, f, x, r)
        step = 2.0 * miss * slope / (2.0 * slope * slope - miss * bend)
        x = x - step
    w[GUESS, i] = x
    w[OFF, i] = step
    z = r * x * x
    return 2.0 * w[SLOWNESS, i] * ((1.0 - z * z * z) / z)


def _make_stage(weights: Row, slope: int) -> Callable[..., Any]:
    """Make ``stage(w)``: the slope at one stage."""
    weighted_sum = make_weighted_sum(weights, SLOPES, states=1)
    node = sum(weights)

    @device
    def stage(w):
        for i in range(w.shape[1]):
            length = w[TRIAL, i]
            w[slope, i] = _rhs(w, i, w[FIELD, i] + node * length, w[R, i] + length * weighted_sum(w, i, 0))

    return stage


def make_creep(tableau: Tableau, lanes: int) -> Callable[..., Any]:
    """Make ``creep(films, rtol, status)`` of a run of cells; ``films`` is (CREEP, cells).

    Those of status CREEPS are taken from W, R without field to W, R at END; their status becomes AT_END, if END is as
    it was, RUNNING, if it is less, or BUDGET_SPENT.
    """
    rows = [_make_stage(row, SLOPES + k + 1) for k, row in enumerate(tableau.rows)]
    stages = make_sequence(rows)
    solution = make_weighted_sum(tableau.weights, SLOPES, states=1)
    fifth, third = (make_weighted_sum(weights, SLOPES, states=1) for weights in tableau.errors)
    last = SLOPES + tableau.stages

    @device
    def advance(w):
        """Take the last stage, accept or reject, and propose."""
        for i in range(w.shape[1]):
            length = w[TRIAL, i]
            r = w[R, i] + length * solution(w, i, 0)
            f = w[FIELD, i] + length
            slope = _rhs(w, i, f, r)
            x = w[GUESS, i]
            # The estimates of order 5 and 3, over the change of r, each raised to h**9, and the larger taken.
            change = abs(r - w[R, i]) + 1e-300
            a = length / change * fifth(w, i, 0)
            b = abs(length / change * third(w, i, 0))
            raised = np.sqrt(max(a * a, b * b * b))
            relative = change / abs(r) * raised * np.sqrt(raised) * w[INVERSE_TOLERANCE, i]
            p, u = w[P, i], x * x
            bend = 8.0 * (r + p * r * r * r) * u * u * u + 3.0 * w[SIGMA, i] * x * r
            stiff = bend - 2.0 * (r + p)
            good = (relative <= 1.0) & (x > 0.0) & (u * r < 1.0) & (stiff > SMALLEST_STIFFNESS * bend)
            good = good & (abs(w[OFF, i]) <= FOUND * x)
            large = (f >= w[ENOUGH, i]) & (CRITICAL_LOAD * f * f * r >= LARGE * p * u)
            ended = large | (stiff < SMALL_STIFFNESS * bend) | (w[END, i] - f <= ROUNDING * w[END, i])
            w[DONE, i] = 1.0 if good & ended else 0.0
            now = np.sqrt(np.sqrt(np.sqrt(max(relative, 1e-12))))
            factor = np.sqrt(w[PREVIOUS, i]) / now * SAFETY
            factor = factor if factor > SMALLEST_FACTOR else SMALLEST_FACTOR  # also where it is NaN
            factor = min(factor, LARGEST_FACTOR if good else SAFETY)
            w[PREVIOUS, i] = now if good else AFTER_REJECTION
            w[STEP, i] = length * factor
            w[COUNT, i] += 1.0
            w[FIELD, i] = f if good else w[FIELD, i]
            w[W, i] = x if good else w[W, i]
            w[R, i] = r if good else w[R, i]
            w[SLOPES, i] = slope if good else w[SLOPES, i]
            w[GUESS, i] = w[W, i]

    @device
    def creep(films, rtol, status):
        w = np.ones((last, lanes))
        cells = np.empty(lanes, np.int64)
        for i in range(lanes):
            cells[i] = VACANT
        first_step = FIRST_STEP * np.sqrt(np.sqrt(np.sqrt(rtol)))
        following = 0
        while True:
            busy = 0
            for i in range(lanes):
                cell = cells[i]
                if cell != VACANT and (w[DONE, i] > 0.0 or w[COUNT, i] >= ATTEMPTS):
                    films[W, cell] = w[W, i]
                    films[R, cell] = w[R, i]
                    if w[DONE, i] == 0.0:
                        status[cell] = BUDGET_SPENT
                    elif w[END, i] - w[FIELD, i] <= ROUNDING * w[END, i]:
                        status[cell] = AT_END
                    else:
                        status[cell] = RUNNING
                    films[END, cell] = w[FIELD, i]
                    cells[i] = VACANT
                if cells[i] == VACANT:
                    while following < status.size and status[following] != CREEPS:
                        following += 1
                    if following < status.size:
                        for row in range(CREEP):
                            w[row, i] = films[row, following]
                        w[FIELD, i] = 0.0
                        w[GUESS, i] = w[W, i]
                        w[SLOPES, i] = _rhs(w, i, 0.0, w[R, i])
                        w[STEP, i] = min(first_step * w[R, i] / w[SLOPES, i], w[ENOUGH, i])
                        w[PREVIOUS, i] = 1.0
                        w[COUNT, i] = 0.0
                        w[DONE, i] = 0.0
                        cells[i] = following
                        following += 1
                    else:
                        w[STEP, i] = 0.0
                        w[END, i] = 0.0
                        w[FIELD, i] = 0.0
                busy += cells[i] != VACANT
            if busy == 0:
                return
            for i in range(lanes):
                # Steps of equal length to the end, no longer than proposed.
                left = w[END, i] - w[FIELD, i]
                w[TRIAL, i] = left / np.ceil(max(left / (w[STEP, i] + 1e-300), 1.0)) if left > 0.0 else 0.0
            stages(w)
            advance(w)

    return creep
