"""Cells up a ramp, on the scalar form of `forms/area_strain.py`, to the instability or to a given load.

Every lane of a block takes steps of its own length, and the next waiting cell as soon as it is done with one: how many
steps a cell needs differs by a factor of ten, and no lane waits for another.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import device
from ..forms.area_strain import NUDGE, excess_and_flow, forgotten, growth, slope, slow_share, stiffness
from ..lane_state import AT_END, BUDGET_SPENT, FAILED, RUNNING, next_cells
from ..model import CRITICAL_LOAD
from .event import LARGEST_TIGHTNESS, aim_between, land
from .state import (
    AT_INSTABILITY,
    CLIMBING,
    COUNT,
    EVENT,
    FIELD,
    GLOBAL,
    GROWTH,
    NEW,
    PREVIOUS,
    RATE,
    REACHED,
    REFERENCE,
    SCALE,
    SLOPES,
    SPEED,
    SPENT,
    START_GROWTH,
    START_SLOPE,
    START_STEP,
    START_V,
    START_Y,
    STATUS,
    STEP,
    TARGET,
    TIGHTNESS,
    TRIAL,
    AreaMethod,
    P,
    V,
    Y,
)

# A climb takes some tens of steps whatever the rate; a lane that needs so many has met something unforeseen.
ATTEMPTS = 2000
LARGEST_FACTOR = 2.5
SMALLEST_FACTOR = 0.2
SAFETY = 0.9

# Below, in Ec per tau, what keeps the right-hand side from 0/0 would count.
SLOWEST = 1e-140

# What an attempt may meet.
NOTHING, CROSSED, NEAR, TOO_MANY = 0.0, 1.0, 2.0, 3.0
# Instead of the number of a cell: the lane has none.
VACANT = -1


@device
def _exponential(x):
    """exp(x) to some 10 % where it matters, never too small by more: without a division, so that it is quick."""
    s = max(0.0625 * x, -1.0)
    base = 1.0 + s + 0.5 * s * s
    square = base * base
    fourth = square * square
    eighth = fourth * fourth
    return eighth * eighth


@device
def damping_for(rtol):
    """Damping of what is wrong with the start of a slow ramp, for it not to show in the results."""
    return 2.0 - np.log(rtol)


@device
def _shortest_life(field, p):
    """Return a time that any film lives which fails under a held field; below 0 where it may fail on its ramp.

    r = xi**2 must grow from 1 until the film carries the field no more, (25). The logarithm of the load that it carries
    is convex in r and falls at 2 p/m first; dr/dT is at most 2 (s - 1/s**2) at s = 2**(2/3), which is 2.382, (26).
    """
    return ((1.0 + p) - field * field) / (2.0 * 2.382 * p)


@device
def prepare(w, i, rtol, share, damping):
    """Complete what a lane is given, P, RATE and FIELD, by what it takes to climb with results good to ``rtol``.

    ``share`` is the method's, ``damping`` that of `damping_for`, or infinite for a method that begins every ramp at its
    beginning.
    """
    rate, field, p = w[RATE, i], w[FIELD, i], w[P, i]
    speed = 2.0 * rate * np.sqrt(CRITICAL_LOAD)
    end = CRITICAL_LOAD * (field - 1.0) * (field + 1.0)
    w[SPEED, i] = speed
    w[TARGET, i] = end
    # An error of xi**2 at the corner delays the failure by about half of it, in a life that is longer than the ramp, or
    # by itself over dr/dT, which is at least 2 e/m there, in one longer than `_shortest_life`; below a few units of
    # rounding there is nothing to gain.
    longer = 2.0 * CRITICAL_LOAD * field * field / (1.0 + p) * _shortest_life(field, p)
    w[SCALE, i] = max(0.5 * field / rate, longer) + 3e-15 / rtol
    w[TIGHTNESS, i] = np.sqrt(1.0 + p) * np.sqrt(np.sqrt(1.0 + p)) / (share * rtol)
    # What the film is to forget need not be resolved: neither the start of a slow ramp, nor y to better than it
    # counts where the film stops forgetting.
    u = forgotten(p, rate, damping)
    y = slow_share(min(u, 0.97), rate)
    v = np.sqrt(1.0 / u - 1.0)
    excess, _, _, _ = excess_and_flow(v, y, p)
    late = (u < 0.97) & (excess < end)  # slow, and the climb does not end before that
    v = v if late else 0.0
    y = y if late else 0.0
    reference = min(0.1, slow_share(min(forgotten(p, rate, 1.0), 0.8), rate))
    w[REFERENCE, i] = reference
    f = slope(v, y, p, speed)
    grows = growth(v, y, f, p, speed)
    w[START_V, i] = v
    w[START_Y, i] = y
    w[START_SLOPE, i] = f
    w[START_GROWTH, i] = grows
    # On the slow manifold, close to what an explicit method can stand; near v = 0, where y follows v**2 at first,
    # what its reference lets pass.
    w[START_STEP, i] = 2.0 / abs(grows) if late else min(0.1, 0.3 * np.sqrt(reference))


@device
def begin(w, i):
    """Set a lane at its start."""
    w[STATUS, i] = CLIMBING
    w[V, i] = w[START_V, i]
    w[Y, i] = w[START_Y, i]
    w[SLOPES, i] = w[START_SLOPE, i]
    w[GROWTH, i] = w[START_GROWTH, i]
    w[STEP, i] = w[START_STEP, i]
    w[GLOBAL, i] = 0.0
    w[PREVIOUS, i] = 1.0


def make_judge(method: AreaMethod) -> Callable[..., Any]:
    """Make ``judge(w) -> events``: accept or reject the last attempt of every lane, and propose the next step."""
    error = method.error
    root = method.root
    last = method.last

    @device
    def judge(w):
        events = 0
        for i in range(w.shape[1]):
            length = w[TRIAL, i]
            v = w[V, i] + length
            y = w[NEW, i]
            size = min(max(y, w[REFERENCE, i]), w[SCALE, i])
            inverse = 1.0 / size
            estimate = error(w, i, length * inverse)
            relative = estimate * w[TIGHTNESS, i]
            climbing = w[STATUS, i] == CLIMBING
            landing = (w[STATUS, i] > CLIMBING) & (w[STATUS, i] < AT_INSTABILITY)
            # Outside 0 < y < 1, where explicit steps that are too long may lead, lie other branches.
            good = (relative <= 1.0) & (y > 0.0) & (y < 1.0)
            excess, h, u, d = excess_and_flow(v, y, w[P, i])
            fallen = stiffness(y, w[P, i], h, u, d) <= 0.0
            met = climbing & good & (fallen | (excess >= w[TARGET, i]))
            accepted = (climbing | landing) & good & (not met)
            missed = landing & (not good)  # climb on, or go back further, with shorter steps

            # In single precision, which is plenty for a step length, roots and quotients take a quarter of the time.
            now = root(np.float32(max(relative, 1e-12)))
            factor = float(np.sqrt(np.float32(w[PREVIOUS, i])) / now) * SAFETY
            factor = factor if factor > SMALLEST_FACTOR else SMALLEST_FACTOR  # also where it is NaN
            w[PREVIOUS, i] = now if good else 1.0
            factor = min(factor, LARGEST_FACTOR if good else SAFETY)
            w[STEP, i] = length * factor if climbing | missed else w[STEP, i]
            w[STATUS, i] = CLIMBING if missed & (length > 0.0) else w[STATUS, i]

            beside = slope(v, y + NUDGE * size, w[P, i], w[SPEED, i])
            grows = (beside - w[last, i]) * (inverse * (1.0 / NUDGE))
            carried = w[GLOBAL, i] * _exponential(0.5 * length * (w[GROWTH, i] + grows)) + estimate * size
            w[GLOBAL, i] = carried if accepted else w[GLOBAL, i]
            w[GROWTH, i] = grows if accepted else w[GROWTH, i]
            w[V, i] = v if accepted else w[V, i]
            w[Y, i] = y if accepted else w[Y, i]
            w[SLOPES, i] = w[last, i] if accepted else w[SLOPES, i]
            near = landing & good
            w[COUNT, i] += 1.0
            spent = (w[COUNT, i] >= ATTEMPTS) & (climbing | landing)
            met_or_near = CROSSED if met else (NEAR if near else NOTHING)
            w[EVENT, i] = TOO_MANY if spent else met_or_near
            events += met | near | spent
        return events

    return judge


def make_climb(method: AreaMethod, target: Callable[..., Any], lanes: int) -> Callable[..., Any]:
    """Make the climb of a run of cells, with ``target(field, modulus_ratio)`` the field at which it ends, in Ec.

    ``climb(field, rate, modulus_ratio, rtol, status, reached)``: every running cell to its event, or to the end of its
    attempts. Its ``status`` (cells,) becomes FAILED at the instability, AT_END at the target, which may be
    infinite, or BUDGET_SPENT; ``reached`` (REACHED, cells) says where.
    """
    attempt = method.attempt
    judge = make_judge(method)
    last, rows, share, late_start = method.last, method.rows, method.share, method.late_start

    @device
    def handle(w, i, rtol):
        """Deal with what the last attempt of a lane met."""
        if w[EVENT, i] == CROSSED:
            aim_between(w, i, last)
        elif w[EVENT, i] == NEAR:
            if land(w, i, rtol):
                w[TIGHTNESS, i] = min(10.0 * w[TIGHTNESS, i], LARGEST_TIGHTNESS)
                begin(w, i)
        elif w[EVENT, i] == TOO_MANY:
            w[STATUS, i] = SPENT

    @device
    def leave(w, i, cell, status, reached):
        """Write down where a lane got to."""
        for row in range(len(REACHED)):
            reached[row, cell] = w[REACHED[row], i]
        status[cell] = BUDGET_SPENT
        if w[RATE, i] >= SLOWEST and w[STATUS, i] != SPENT:
            status[cell] = FAILED if w[STATUS, i] == AT_INSTABILITY else AT_END

    @device
    def climb(field, rate, modulus_ratio, rtol, status, reached):
        damping = damping_for(rtol) if late_start else math.inf
        w = np.zeros((rows, lanes))
        waiting = np.zeros((SLOPES, lanes))  # cells that are prepared together, to be taken one by one
        waiting_cells = np.empty(lanes, np.int64)
        cells = np.empty(lanes, np.int64)
        count, taken, first, busy = 0, 0, 0, 0
        for i in range(lanes):
            cells[i] = VACANT
            w[STATUS, i] = SPENT
        events = lanes
        while True:
            for i in range(lanes if events > 0 else 0):
                if cells[i] != VACANT and w[EVENT, i] != NOTHING:
                    handle(w, i, rtol)
                    if w[STATUS, i] >= AT_INSTABILITY:
                        leave(w, i, cells[i], status, reached)
                        cells[i] = VACANT
                        busy -= 1
                if cells[i] == VACANT and taken == count:
                    count, first = next_cells(status, first, RUNNING, waiting_cells)
                    taken = 0
                    if count > 0:
                        for j in range(lanes):  # apart from the next loop, which vectorises
                            cell = waiting_cells[j]
                            waiting[RATE, j] = rate[cell]
                            waiting[FIELD, j] = target(field[cell], modulus_ratio[cell])
                            waiting[P, j] = modulus_ratio[cell] - 1.0
                        for j in range(lanes):
                            prepare(waiting, j, rtol, share, damping)
                if cells[i] == VACANT and taken < count:
                    for row in range(P, SLOPES):
                        w[row, i] = waiting[row, taken]
                    w[COUNT, i] = 0.0
                    begin(w, i)
                    cells[i] = waiting_cells[taken]
                    taken += 1
                    busy += 1
            if busy == 0:
                return
            for i in range(lanes):
                w[TRIAL, i] = w[STEP, i] if w[STATUS, i] < AT_INSTABILITY else 0.0
            attempt(w)
            events = judge(w)

    return climb
