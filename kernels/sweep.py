"""A run of cells: classify, solve, write."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ._jit import Kernel, device
from .lane_state import FAILED, FAILS_AT_ONCE, RUNNING, SURVIVES, next_cells
from .model import CRITICAL_U, instant_gap, relative_u
from .programs import Program

# Rows of the result of a sweep; the first four are what a solver fills in.
TIME_TO_FAILURE = 0
CRITICAL_STRETCH = 1
CRITICAL_INTERNAL_STRETCH = 2
CRITICAL_FIELD = 3
FINAL_STRETCH = 4
RESULTS = 5

# Rows of what is given to the solver of a block.
FIELD = 0
RATE = 1
MODULUS_RATIO = 2
GIVEN = 3

# Types of the arguments of a sweep: the result may be some columns of a larger one.
SIGNATURE = "float64[::1], float64[::1], float64[::1], float64, float64, int64, int8[::1], float64[:, :]"

# Four vectors of AVX2, two of AVX-512: enough to hide the latency of a division.
LANES = 16


def make_classify(program: Program) -> Callable[..., Any]:
    """Make ``classify(field, rate, modulus_ratio)``: the outcomes that need no integration, else RUNNING."""
    peak = program.peak
    begins_with_step = program.begins_with_step

    @device
    def classify(field, rate, modulus_ratio):
        if begins_with_step and instant_gap(field, modulus_ratio) <= 0.0:
            return FAILS_AT_ONCE
        highest = peak(field, rate)
        # A film with any relaxation left survives a field of exactly 1; an elastic one (m = 1) does not.
        if highest < 1.0 or (highest == 1.0 and modulus_ratio > 1.0):
            return SURVIVES
        return RUNNING

    return classify


def in_blocks(solve_block: Callable[..., Any], block_rows: int, lanes: int) -> Callable[..., Any]:
    """Make the solver of a run of cells, as `make_sweep` takes it, from one of a block of lanes.

    ``solve_block(w, status, given, tolerance, step, attempts, found)`` takes the lanes of a block to their end: ``w``
    is its own workspace of ``block_rows`` rows, ``given`` (GIVEN, lanes) and ``found`` (RESULTS, lanes); lanes whose
    ``status`` becomes FAILED have found their results.
    """

    @device
    def solve(field, rate, modulus_ratio, tolerance, step, attempts, status, result):
        w = np.zeros((block_rows, lanes))
        given = np.empty((GIVEN, lanes))
        found = np.empty((RESULTS, lanes))
        block_status = np.empty(lanes, np.int64)
        cells = np.empty(lanes, np.int64)
        count, first = next_cells(status, 0, RUNNING, cells)
        while count > 0:
            for i in range(lanes):
                given[FIELD, i] = field[cells[i]]
                given[RATE, i] = rate[cells[i]]
                given[MODULUS_RATIO, i] = modulus_ratio[cells[i]]
                block_status[i] = RUNNING
            solve_block(w, block_status, given, tolerance, step, attempts, found)
            for i in range(count):
                status[cells[i]] = block_status[i]
                for row in range(FINAL_STRETCH):
                    result[row, cells[i]] = found[row, i]
            count, first = next_cells(status, first, RUNNING, cells)

    return solve


def make_sweep(program: Program, solve: Callable[..., Any]) -> Kernel:
    """Make the compiled ``sweep(field, rate, modulus_ratio, tolerance, step, attempts, status, result)``.

    ``field``, ``rate``, ``modulus_ratio`` are (cells,) arrays of float64; ``status`` (cells,) of int8 and ``result``
    (RESULTS, cells) of float64 are filled in. Every cell depends on its own column alone.

    ``solve(field, rate, modulus_ratio, tolerance, step, attempts, status, result)`` takes the cells whose status is
    RUNNING to their end; where their status becomes FAILED it writes their results, up to FINAL_STRETCH.
    """
    classify = make_classify(program)
    peak = program.peak

    @device
    def write(result, cell, status, field, rate, modulus_ratio):
        """Write the results that take no integration, and NaN where there are none."""
        if status != FAILED:
            for row in range(FINAL_STRETCH):
                result[row, cell] = math.nan
        result[FINAL_STRETCH, cell] = math.nan
        if status == FAILS_AT_ONCE:
            result[TIME_TO_FAILURE, cell] = 0.0
            result[CRITICAL_STRETCH, cell] = 1.0 / np.sqrt(CRITICAL_U)
            result[CRITICAL_INTERNAL_STRETCH, cell] = 1.0
            result[CRITICAL_FIELD, cell] = np.sqrt(modulus_ratio)
        elif status == SURVIVES:
            # Relaxed, lambda = xi: (23) is that of a film with mu_R alone, its margin 1 - field**2.
            highest = peak(field, rate)
            u = CRITICAL_U * (1.0 + relative_u((1.0 - highest) * (1.0 + highest)))
            result[FINAL_STRETCH, cell] = 1.0 / np.sqrt(u)

    def sweep(field, rate, modulus_ratio, tolerance, step, attempts, status, result):
        for cell in range(field.size):
            status[cell] = classify(field[cell], rate[cell], modulus_ratio[cell])
        solve(field, rate, modulus_ratio, tolerance, step, attempts, status, result)
        for cell in range(field.size):
            write(result, cell, status[cell], field[cell], rate[cell], modulus_ratio[cell])

    return Kernel(sweep, SIGNATURE)
