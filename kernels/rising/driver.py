"""Integration loop of a ramp on the area-strain form, `forms/area_strain.py`, to the instability or to a given load.

Every lane of a block takes steps of its own length, and the next waiting cell as soon as it is done with one: how many
steps a cell needs differs by a factor of ten, and no lane waits for another.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import device
from ..lane_state import AT_END, BUDGET_SPENT, FAILED, RUNNING, next_cells
from .control import CROSSED, NEAR, NOTHING, TOO_MANY, make_judge
from .event import LARGEST_INVERSE_TOLERANCE, make_landing
from .start import begin, damping_for
from .state import (
    AT_INSTABILITY,
    COUNT,
    EVENT,
    FIELD,
    INVERSE_TOLERANCE,
    RATE,
    REACHED,
    SLOPES,
    SPENT,
    STATUS,
    STEP,
    TRIAL,
    AreaMethod,
    P,
)

# In Ec per tau; on slower ramps what keeps the right-hand side from 0/0, `area_strain.SMALLEST_LOAD_RATE`, would count.
SLOWEST = 1e-140

# Instead of the number of a cell: the lane has none.
VACANT = -1


def make_climb(method: AreaMethod, target: Callable[..., Any], lanes: int) -> Callable[..., Any]:
    """Make the climb of a run of free films, with ``target(field, modulus_ratio)`` the field at which it ends, in Ec.

    ``climb(field, rate, modulus_ratio, rtol, status, reached)``, as `make_climb_of_cells` says.
    """

    @device
    def give(waiting, j, cell, cells):
        field, rate, modulus_ratio = cells
        waiting[RATE, j] = rate[cell]
        waiting[FIELD, j] = target(field[cell], modulus_ratio[cell])
        waiting[P, j] = modulus_ratio[cell] - 1.0

    climb_of_cells = make_climb_of_cells(method, give, lanes)

    @device
    def climb(field, rate, modulus_ratio, rtol, status, reached):
        climb_of_cells((field, rate, modulus_ratio), rtol, status, reached)

    return climb


def make_climb_of_cells(method: AreaMethod, give: Callable[..., Any], lanes: int) -> Callable[..., Any]:
    """Make the climb of a run of cells, with ``give(waiting, j, cell, given)`` filling in what a lane is given.

    ``climb(given, rtol, status, reached)``: every running cell to its event, or to the end of its attempts. Its
    ``status`` (cells,) becomes FAILED at the instability, AT_END at the target, which may be infinite, or
    BUDGET_SPENT; ``reached`` (REACHED, cells) says where.
    """
    attempt = method.attempt
    judge = make_judge(method)
    aim_between, land = make_landing(method)
    prepare = method.form.prepare
    rows, late_start, tolerance_factor = method.rows, method.late_start, method.tolerance_factor

    @device
    def handle(w, i, rtol):
        """Deal with what the last attempt of a lane met."""
        if w[EVENT, i] == CROSSED:
            aim_between(w, i)
        elif w[EVENT, i] == NEAR:
            if land(w, i, rtol):
                w[INVERSE_TOLERANCE, i] = min(10.0 * w[INVERSE_TOLERANCE, i], LARGEST_INVERSE_TOLERANCE)
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
    def climb(given, rtol, status, reached):
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
                            give(waiting, j, waiting_cells[j], given)
                        for j in range(lanes):
                            prepare(waiting, j, rtol, tolerance_factor, damping)
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
