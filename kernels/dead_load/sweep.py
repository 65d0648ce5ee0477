"""A run of cells under a dead load: describe, classify, solve, write."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import Kernel, device
from ..hold import quadrature
from ..hold.results import read_hold
from ..lane_state import AT_END, BUDGET_SPENT, FAILS_AT_ONCE, RUNNING, SURVIVES, next_cells
from ..programs import Program
from ..sweep import (
    CRITICAL_FIELD,
    CRITICAL_INTERNAL_STRETCH,
    CRITICAL_STRETCH,
    FINAL_STRETCH,
    LANES,
    RESULTS,
    TIME_TO_FAILURE,
)
from . import hold, near_instant, rise
from .film import (
    FIELD_I,
    FIELD_T,
    FILM,
    GAP_I,
    GAP_T,
    LOAD_T,
    W_I,
    W_T,
    describe,
    equilibrium_d,
    failure,
    first_d,
    guess_of_failure,
    quick_failure,
    stable_side,
)

# Eight nodes: the estimate of fewer may fall short of the error of a fresh film, and nodes are cheap here.
LOWEST_RULE = 2
# Types of the arguments of a sweep.
SIGNATURE = "float64[::1], float64[::1], float64[::1], float64[::1], float64[::1], float64, int8[::1], float64[:, :]"


def make_classify(program: Program) -> Callable[..., Any]:
    """Make ``classify(film, cell, modulus_ratio)``: the outcomes that need no integration, else RUNNING."""
    begins_with_step = program.begins_with_step
    rises_without_end = program.pieces == 1 and not begins_with_step

    @device
    def classify(film, cell, modulus_ratio):
        if rises_without_end:
            return RUNNING
        if begins_with_step and film[GAP_I, cell] <= 0.0:
            return FAILS_AT_ONCE
        above = film[GAP_T, cell]
        # A film with any relaxation left survives the relaxed threshold itself; an elastic one (m = 1) does not.
        if above < 0.0 or (above == 0.0 and modulus_ratio > 1.0):
            return SURVIVES
        return RUNNING

    return classify


# Rows of the block of holds, beside those of `hold.py`: of one array, whose rows the compiler knows not to overlap.
(
    RELAXES,  # p
    DEAD_LOAD,
    AT,  # w_t
    LOAD,
    ABOVE,  # e - e_t and e_i - e
    BELOW,
    AT_FIRST,  # w_i
    START,
    SHARE,
    FIRST,  # w - w_t and 1/r with which the hold begins, and at its end
    INVERSE,
    LAST,
    END,
    SETTLED,
) = range(hold.HOLD_ROWS, hold.HOLD_ROWS + 14)
BLOCK = hold.HOLD_ROWS + 14


@device
def give(w, i, film, cell, field, p, start, sigma):
    """Fill in a lane, but for the states with which the hold begins and ends."""
    w[RELAXES, i] = p
    w[DEAD_LOAD, i] = sigma
    w[AT, i] = film[W_T, cell]
    w[LOAD, i] = film[LOAD_T, cell] + film[GAP_T, cell]
    w[ABOVE, i] = film[GAP_T, cell]
    w[BELOW, i] = film[GAP_I, cell]
    w[AT_FIRST, i] = film[W_I, cell]
    w[START, i] = start
    whole = film[FIELD_I, cell] - film[FIELD_T, cell]
    w[SHARE, i] = min(max((field - film[FIELD_T, cell]) / whole, 0.0), 1.0)


@device
def prepare_holds(w):
    """Complete the lanes, whose holds begin at FIRST and INVERSE."""
    lanes = w.shape[1]
    for i in range(lanes):
        w[END, i], w[LAST, i] = guess_of_failure(w[AT, i], w[INVERSE, i], w[FIRST, i], w[SHARE, i])
        w[SETTLED, i] = 0.0
    # Next to the relaxed threshold some films take twice as many iterations; more in one loop do not vectorise.
    for _ in range(2):
        unsettled = 0
        for i in range(lanes):
            a, d, settled = quick_failure(
                w[RELAXES, i],
                w[AT, i],
                w[DEAD_LOAD, i],
                w[LOAD, i],
                w[ABOVE, i],
                w[INVERSE, i],
                w[END, i],
                w[LAST, i],
            )
            w[END, i] = a if w[SETTLED, i] == 0.0 else w[END, i]
            w[LAST, i] = d if w[SETTLED, i] == 0.0 else w[LAST, i]
            w[SETTLED, i] = 1.0 if settled else w[SETTLED, i]
        for i in range(lanes):
            unsettled += w[SETTLED, i] == 0.0
        if unsettled == 0:
            break
    for i in range(lanes):
        if w[SETTLED, i] == 0.0:
            w[END, i], w[LAST, i] = failure(
                w[RELAXES, i],
                w[AT, i],
                w[DEAD_LOAD, i],
                w[LOAD, i],
                w[ABOVE, i],
                w[INVERSE, i],
                w[FIRST, i],
                w[SHARE, i],
            )
    for i in range(lanes):
        hold.prepare(
            w,
            i,
            w[RELAXES, i],
            w[DEAD_LOAD, i],
            w[AT, i],
            w[ABOVE, i],
            w[FIRST, i],
            w[END, i],
            w[LAST, i],
        )


def make_solve_step(lanes: int) -> Callable[..., Any]:
    """Make the solver of `make_sweep` for a field applied at once and held."""

    @device
    def solve_step(film, field, rate, modulus_ratio, start, sigma, tolerance, status, result):
        w = np.ones((BLOCK, lanes))
        rule = np.empty(lanes, np.int64)
        cells = np.empty(lanes, np.int64)
        count, following = next_cells(status, 0, RUNNING, cells)
        while count > 0:
            for i in range(lanes):
                cell = cells[i]
                p = modulus_ratio[cell] - 1.0
                give(w, i, film, cell, field[cell], p, start[cell], sigma[cell])
                w[quadrature.BEFORE, i] = 0.0
                rule[i] = max(quadrature.first_rule(p, tolerance), LOWEST_RULE)
            for i in range(lanes):
                w[INVERSE, i] = 1.0 / (w[START, i] * w[START, i])
                w[FIRST, i], _ = first_d(
                    w[RELAXES, i], w[START, i], w[AT, i], w[DEAD_LOAD, i], w[AT_FIRST, i], w[BELOW, i]
                )
            prepare_holds(w)
            hold.integrate(w, rule, tolerance)
            for i in range(count):
                cell = cells[i]
                p = modulus_ratio[cell] - 1.0
                gap = film[GAP_I, cell]
                if gap < near_instant.LARGEST_GAP * p * film[W_T, cell] * film[W_T, cell]:
                    r = start[cell] * start[cell]
                    s, w_i, w_t = sigma[cell], film[W_I, cell], film[W_T, cell]
                    b, end = near_instant.state_at_failure(p, r, w_i, s, gap)
                    _, unstable = first_d(p, start[cell], w_t, s, w_i, gap)
                    above = stable_side(gap, w_i, 1.0 + p / r, 1.0 + p * r * r, s)
                    time = near_instant.time_to_failure(p, s, w_t, film[GAP_T, cell], unstable, above, end)
                    w[quadrature.FOUND, i] = time
                    w[quadrature.INTERNAL, i] = r + b
                    w[hold.UNSTABLE_W, i] = w_i + end
                status[cell] = read_hold(w, i, 1.0 / w[hold.UNSTABLE_W, i], field[cell], cell, result)
            count, following = next_cells(status, following, RUNNING, cells)

    return solve_step


@device
def _without_end(film, cell, p):
    return math.inf


@device
def _up_to_hold(film, cell, p):
    # No film reaches the field at which it fails at once; an elastic one fails at that of a relaxed one.
    if p == 0.0 or film[GAP_I, cell] <= 0.0:
        return math.inf
    return film[GAP_T, cell]


def make_solve_ramp(lanes: int) -> Callable[..., Any]:
    """Make the solver of `make_sweep` for a field that rises without end."""
    rising = rise.make_rise(_without_end, lanes)

    @device
    def solve_ramp(film, field, rate, modulus_ratio, start, sigma, tolerance, status, result):
        reached = np.empty((rise.REACHED, status.size))
        rising(film, field, rate, modulus_ratio, start, sigma, tolerance, status, reached, result)

    return solve_ramp


def make_solve_ramp_hold(lanes: int) -> Callable[..., Any]:
    """Make the solver of `make_sweep` for a field that rises, then holds."""
    rising = rise.make_rise(_up_to_hold, lanes)

    @device
    def solve_ramp_hold(film, field, rate, modulus_ratio, start, sigma, tolerance, status, result):
        reached = np.empty((rise.REACHED, status.size))
        rising(film, field, rate, modulus_ratio, start, sigma, tolerance, status, reached, result)
        w = np.ones((BLOCK, lanes))
        rule = np.empty(lanes, np.int64)
        cells = np.empty(lanes, np.int64)
        count, following = next_cells(status, 0, AT_END, cells)
        while count > 0:
            for i in range(lanes):
                cell = cells[i]
                p = modulus_ratio[cell] - 1.0
                give(w, i, film, cell, field[cell], p, start[cell], sigma[cell])
                a = 1.0 / reached[rise.REACHED_R, cell]
                guess = reached[rise.REACHED_D, cell]
                w[INVERSE, i] = a
                w[FIRST, i] = equilibrium_d(p, a, film[W_T, cell], sigma[cell], film[GAP_T, cell], guess)
                w[quadrature.BEFORE, i] = field[cell] / rate[cell]
                rule[i] = max(quadrature.first_rule(p, tolerance), LOWEST_RULE)
            prepare_holds(w)
            hold.integrate(w, rule, tolerance)
            for i in range(count):
                cell = cells[i]
                status[cell] = read_hold(w, i, 1.0 / w[hold.UNSTABLE_W, i], field[cell], cell, result)
                # Where all is over at once after a fast ramp, the rounding of r counts.
                rounding = reached[rise.REACHED_ROUNDING, cell]
                lost = rounding > tolerance * w[quadrature.TIME, i] + tolerance * (field[cell] / rate[cell])
                if lost:
                    status[cell] = BUDGET_SPENT
            count, following = next_cells(status, following, AT_END, cells)

    return solve_ramp_hold


SOLVERS = {"step": make_solve_step, "ramp": make_solve_ramp, "ramp_hold": make_solve_ramp_hold}


def make_sweep(program: Program, lanes: int = LANES) -> Kernel:
    """Make the compiled ``sweep(field, rate, modulus_ratio, start, sigma, tolerance, status, result)``.

    As `kernels.sweep.make_sweep`, with the internal stretch at the start and the dead load, both (cells,).
    """
    classify = make_classify(program)
    solve = SOLVERS[program.name](lanes)

    def sweep(field, rate, modulus_ratio, start, sigma, tolerance, status, result):
        film = np.empty((FILM, field.size))
        for cell in range(field.size):  # apart from the next loop, which does not vectorise
            describe(film, cell, field[cell], modulus_ratio[cell] - 1.0, start[cell], sigma[cell])
        for cell in range(field.size):
            status[cell] = classify(film, cell, modulus_ratio[cell])
        for row in range(RESULTS):
            for cell in range(field.size):
                result[row, cell] = math.nan
        solve(film, field, rate, modulus_ratio, start, sigma, tolerance, status, result)
        for cell in range(field.size):
            if status[cell] == FAILS_AT_ONCE:
                result[TIME_TO_FAILURE, cell] = 0.0
                result[CRITICAL_STRETCH, cell] = 1.0 / film[W_I, cell]
                result[CRITICAL_INTERNAL_STRETCH, cell] = start[cell]
                result[CRITICAL_FIELD, cell] = film[FIELD_I, cell]
            elif status[cell] == BUDGET_SPENT:
                for row in range(RESULTS):
                    result[row, cell] = math.nan
            elif status[cell] == SURVIVES:
                below = stable_side(-film[GAP_T, cell], film[W_T, cell], 1.0, 1.0, sigma[cell])
                result[FINAL_STRETCH, cell] = 1.0 / (film[W_T, cell] + below)

    return Kernel(sweep, SIGNATURE)
