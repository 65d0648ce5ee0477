"""Trajectories: the states of one cell after another at given times."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import Kernel, device
from ..forms.fold import FOLD_UNDER_LOAD
from ..forms.formulation import SECOND, THIRD
from ..lane_state import AT_END, END, FAILS_AT_ONCE, RUNNING, SLOPES, STATE, TIME, P, rows
from ..programs import Program
from ..sweep import make_classify
from .driver import make_advance, make_begin
from .tableaus import Tableau

# Types of the arguments of a trajectory.
SIGNATURE = "float64[::1], float64[::1], float64[::1], float64[::1], float64, int64, float64[:, ::1], float64[:, ::1]"


def make_trajectory(program: Program, tableau: Tableau, control: Callable[..., Any]) -> Kernel:
    """Make the compiled ``trajectory(field, rate, modulus_ratio, times, tolerance, attempts, stretch, internal)``.

    ``field``, ``rate``, ``modulus_ratio`` are (cells,) arrays, ``times`` (times,) ascending and not negative;
    ``stretch`` and ``internal`` (cells, times) are filled in, NaN from failure on. Each time ends a stretch of
    integration of its own, on the regular form; the stretch read there is that of equilibrium with the field.
    """
    pieces = program.pieces
    begin = make_begin(program, FOLD_UNDER_LOAD)
    advance = make_advance(FOLD_UNDER_LOAD, tableau, control)
    classify = make_classify(program)
    enter = FOLD_UNDER_LOAD.enter
    derivative = FOLD_UNDER_LOAD.derivative
    block_rows = rows(tableau.stages)

    @device
    def integrate_to(w, status, time, tolerance, attempts):
        if time > w[STATE + TIME, 0]:
            w[END, 0] = time
            status[0] = RUNNING
            advance(w, status, tolerance, attempts)
            if status[0] == AT_END:
                w[STATE + TIME, 0] = time
                enter(w, 0)
                derivative(w, 0, STATE, SLOPES)

    def trajectory(field, rate, modulus_ratio, times, tolerance, attempts, stretch, internal):
        w = np.zeros((block_rows, 1))
        status = np.empty(1, np.int64)
        for cell in range(field.size):
            stretch[cell, :] = math.nan
            internal[cell, :] = math.nan
            w[P, 0] = modulus_ratio[cell] - 1.0
            if classify(field[cell], rate[cell], modulus_ratio[cell]) == FAILS_AT_ONCE:
                continue
            status[0] = AT_END
            sample = 0
            for index in range(pieces):
                if status[0] != AT_END:
                    break
                if begin(w, 0, index, field[cell], rate[cell], 0.0) != RUNNING:
                    break
                piece_end = w[END, 0]
                while sample < times.size and times[sample] <= piece_end and status[0] == AT_END:
                    integrate_to(w, status, times[sample], tolerance, attempts)
                    if status[0] == AT_END:
                        stretch[cell, sample] = 1.0 / np.sqrt(w[STATE + SECOND, 0])
                        internal[cell, sample] = np.sqrt(w[STATE + THIRD, 0])
                        sample += 1
                if status[0] == AT_END and piece_end < math.inf:
                    integrate_to(w, status, piece_end, tolerance, attempts)
                    w[END, 0] = piece_end

    return Kernel(trajectory, SIGNATURE)
