"""A run of cells under a dead load: describe, classify, solve, write."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import Kernel, device
from ..hold import quadrature
from ..lane_state import AT_END, BUDGET_SPENT, FAILED, FAILS_AT_ONCE, RUNNING, SURVIVES, next_cells
from ..model import CRITICAL_LOAD
from ..programs import Program
from ..runge_kutta.tableaus import TABLEAUS
from ..sweep import (
    CRITICAL_FIELD,
    CRITICAL_INTERNAL_STRETCH,
    CRITICAL_STRETCH,
    FINAL_STRETCH,
    LANES,
    RESULTS,
    TIME_TO_FAILURE,
)
from . import climb, hold, near_instant
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
    stable_side,
)

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


@device
def prepare_hold(w, i, film, cell, p, sigma, first, a):
    """Set a lane to a hold from w - w_t = ``first`` at r = 1/a."""
    gap = film[GAP_T, cell]
    # Where the field is between those at which a relaxed film and one at first fail, from 0 to 1.
    field = np.sqrt(film[LOAD_T, cell] + gap) / np.sqrt(film[LOAD_T, cell])
    whole = film[FIELD_I, cell] / film[FIELD_T, cell] - 1.0
    share = min(max((field - 1.0) / whole, 0.0), 1.0)
    end, last = failure(p, film[W_T, cell], sigma, film[LOAD_T, cell] + gap, gap, a, first, share)
    hold.prepare(w, i, p, sigma, film[W_T, cell], gap, first, end, last)


@device
def read_hold(w, i, field, cell, result):
    """Write what a lane found for a cell under a constant field; returns its status."""
    rest = w[quadrature.FOUND, i]
    time = w[quadrature.BEFORE, i] + (0.0 if rest < 0.0 else rest)  # rounding, where a hold begins at its end
    if not time < math.inf:  # not as accurate as asked, or beyond what a float can hold
        return BUDGET_SPENT
    result[TIME_TO_FAILURE, cell] = time
    result[CRITICAL_STRETCH, cell] = 1.0 / w[hold.UNSTABLE_W, i]
    result[CRITICAL_INTERNAL_STRETCH, cell] = np.sqrt(w[quadrature.INTERNAL, i])
    result[CRITICAL_FIELD, cell] = field
    return FAILED


def make_solve_step(lanes: int) -> Callable[..., Any]:
    """Make the solver of `make_sweep` for a field applied at once and held."""

    @device
    def solve_step(film, field, rate, modulus_ratio, start, sigma, tolerance, status, result):
        w = np.ones((hold.HOLD_ROWS, lanes))
        rule = np.empty(lanes, np.int64)
        cells = np.empty(lanes, np.int64)
        count, following = next_cells(status, 0, RUNNING, cells)
        while count > 0:
            for i in range(lanes):
                cell = cells[i]
                p = modulus_ratio[cell] - 1.0
                first, _ = first_d(p, start[cell], film[W_T, cell], sigma[cell], film[W_I, cell], film[GAP_I, cell])
                a = 1.0 / (start[cell] * start[cell])
                prepare_hold(w, i, film, cell, p, sigma[cell], first, a)
                w[quadrature.BEFORE, i] = 0.0
                rule[i] = quadrature.first_rule(p, tolerance)
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
                status[cell] = read_hold(w, i, field[cell], cell, result)
            count, following = next_cells(status, following, RUNNING, cells)

    return solve_step


@device
def _without_end(film, cell, field, p):
    return math.inf


@device
def _up_to_hold(film, cell, field, p):
    # No film reaches the field at which it fails at once; an elastic one fails at that of a relaxed one.
    if p == 0.0 or film[GAP_I, cell] <= 0.0:
        return math.inf
    return film[GAP_T, cell] / (CRITICAL_LOAD * (field + film[FIELD_T, cell]))


def make_solve_ramp(lanes: int) -> Callable[..., Any]:
    """Make the solver of `make_sweep` for a field that rises without end."""
    rise = climb.make_climb(TABLEAUS["dop853"], _without_end, lanes)

    @device
    def solve_ramp(film, field, rate, modulus_ratio, start, sigma, tolerance, status, result):
        reached = np.empty((climb.REACHED, status.size))
        rise(film, field, rate, modulus_ratio, start, sigma, tolerance, status, reached, result)

    return solve_ramp


def make_solve_ramp_hold(lanes: int) -> Callable[..., Any]:
    """Make the solver of `make_sweep` for a field that rises, then holds."""
    rise = climb.make_climb(TABLEAUS["dop853"], _up_to_hold, lanes)

    @device
    def solve_ramp_hold(film, field, rate, modulus_ratio, start, sigma, tolerance, status, result):
        reached = np.empty((climb.REACHED, status.size))
        rise(film, field, rate, modulus_ratio, start, sigma, tolerance, status, reached, result)
        w = np.ones((hold.HOLD_ROWS, lanes))
        rule = np.empty(lanes, np.int64)
        cells = np.empty(lanes, np.int64)
        count, following = next_cells(status, 0, AT_END, cells)
        while count > 0:
            for i in range(lanes):
                cell = cells[i]
                p = modulus_ratio[cell] - 1.0
                a = 1.0 / reached[climb.REACHED_R, cell]
                guess = reached[climb.REACHED_D, cell]
                first = equilibrium_d(p, a, film[W_T, cell], sigma[cell], film[GAP_T, cell], guess)
                prepare_hold(w, i, film, cell, p, sigma[cell], first, a)
                w[quadrature.BEFORE, i] = field[cell] / rate[cell]
                rule[i] = quadrature.first_rule(p, tolerance)
            hold.integrate(w, rule, tolerance)
            for i in range(count):
                status[cells[i]] = read_hold(w, i, field[cells[i]], cells[i], result)
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
        for cell in range(field.size):
            describe(film, cell, field[cell], modulus_ratio[cell] - 1.0, start[cell], sigma[cell])
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
            elif status[cell] == SURVIVES:
                below = stable_side(-film[GAP_T, cell], film[W_T, cell], 1.0, 1.0, sigma[cell])
                result[FINAL_STRETCH, cell] = 1.0 / (film[W_T, cell] + below)

    return Kernel(sweep, SIGNATURE)
