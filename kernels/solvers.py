"""Solvers of the loading programs: a ramp is one scalar equation, a constant field one integral."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ._jit import device
from .hold import near_instant, quadrature
from .hold.results import read_hold
from .lane_state import AT_END, BUDGET_SPENT, FAILED, next_cells
from .model import CRITICAL_LOAD, CRITICAL_U, instant_gap, upper_stiffness
from .rising import driver as ramp
from .rising import state as lane
from .rising.state import AreaMethod
from .sweep import CRITICAL_FIELD, CRITICAL_INTERNAL_STRETCH, CRITICAL_STRETCH, FIELD, MODULUS_RATIO, TIME_TO_FAILURE


@device
def _stretch_at_failure(w, i):
    beyond = w[quadrature.CENTRE, i] + w[quadrature.HALF, i]
    return (1.0 + beyond) / np.sqrt(CRITICAL_U)


@device
def solve_step(w, status, given, tolerance, step, attempts, found):
    """Solver of `sweep.in_blocks` for a field applied at once and held."""
    lanes = w.shape[1]
    rule = np.empty(lanes, np.int64)
    for i in range(lanes):
        field, p = given[FIELD, i], given[MODULUS_RATIO, i] - 1.0
        quadrature.prepare(w, i, field, p, quadrature.start_of_step(field, p))
        w[quadrature.BEFORE, i] = 0.0
        rule[i] = quadrature.first_rule(p, tolerance)
    quadrature.integrate(w, rule, tolerance)
    for i in range(lanes):
        field, p = given[FIELD, i], given[MODULUS_RATIO, i] - 1.0
        if given[MODULUS_RATIO, i] - field * field < near_instant.LARGEST_GAP * p:
            gap = instant_gap(field, given[MODULUS_RATIO, i])
            b, end = near_instant.state_at_failure(field, p, gap)
            w[quadrature.FOUND, i] = near_instant.time_to_failure(field, p, b, end, quadrature.start_of_step(field, p))
            w[quadrature.INTERNAL, i] = 1.0 / (1.0 - b)
        status[i] = read_hold(w, i, _stretch_at_failure(w, i), given[FIELD, i], i, found)


@device
def _square_of_internal(reached, cell, fraction):
    """Return r = xi**2 = (1 - y)(1 + v**2) at the event, from the state close to it and a fraction of dr/dv there."""
    v, z = reached[lane.REACHED_V, cell], 1.0 - reached[lane.REACHED_Y, cell]
    area = 1.0 + v * v
    change = 2.0 * v * z - reached[lane.REACHED_SLOPE, cell] * area
    return z * area + fraction * reached[lane.REACHED_AIM, cell] * change


@device
def _read_ramp(reached, cell, rate, p, result):
    """Write what a cell found at the instability on a ramp; returns its status."""
    # dr/dv vanishes at the instability: half of it acts over the distance left.
    r = _square_of_internal(reached, cell, 0.5)
    load = CRITICAL_LOAD + reached[lane.REACHED_LOAD_EXCESS, cell]
    field = np.sqrt(load / CRITICAL_LOAD)
    if not field / rate < math.inf:
        return BUDGET_SPENT
    result[TIME_TO_FAILURE, cell] = field / rate
    # There e = (3/4) A u: (23) at (25).
    result[CRITICAL_STRETCH, cell] = np.sqrt(0.75 * upper_stiffness(r, p) / load)
    result[CRITICAL_INTERNAL_STRETCH, cell] = np.sqrt(r)
    result[CRITICAL_FIELD, cell] = field
    return FAILED


@device
def _without_end(field, modulus_ratio):
    return math.inf


@device
def _up_to_hold(field, modulus_ratio):
    # No film reaches the field at which it fails at once, so a hold beyond that never begins.
    return field if field * field < modulus_ratio else math.inf


def make_solve_ramp(method: AreaMethod, lanes: int) -> Callable[..., Any]:
    """Make the solver of `sweep.make_sweep` for a field that rises without end."""
    climb = ramp.make_climb(method, _without_end, lanes)

    @device
    def solve_ramp(field, rate, modulus_ratio, tolerance, step, attempts, status, result):
        reached = np.empty((len(lane.REACHED), status.size))
        climb(field, rate, modulus_ratio, tolerance, status, reached)
        for cell in range(status.size):
            if status[cell] == FAILED:
                status[cell] = _read_ramp(reached, cell, rate[cell], modulus_ratio[cell] - 1.0, result)

    return solve_ramp


def make_solve_ramp_hold(method: AreaMethod, lanes: int) -> Callable[..., Any]:
    """Make the solver of `sweep.make_sweep` for a field that rises, then holds."""
    climb = ramp.make_climb(method, _up_to_hold, lanes)

    @device
    def solve_holds(field, rate, modulus_ratio, tolerance, status, reached, result):
        w = np.empty((quadrature.ROWS, lanes))
        cells = np.empty(lanes, np.int64)
        rule = np.empty(lanes, np.int64)
        count, first = next_cells(status, 0, AT_END, cells)
        while count > 0:
            for i in range(lanes):
                cell = cells[i]
                p = modulus_ratio[cell] - 1.0
                start = quadrature.start_of_hold(field[cell], p, _square_of_internal(reached, cell, 1.0))
                quadrature.prepare(w, i, field[cell], p, start)
                w[quadrature.BEFORE, i] = field[cell] / rate[cell]
                rule[i] = quadrature.first_rule(p, tolerance)
            quadrature.integrate(w, rule, tolerance)
            for i in range(count):
                cell = cells[i]
                status[cell] = read_hold(w, i, _stretch_at_failure(w, i), field[cell], cell, result)
            count, first = next_cells(status, first, AT_END, cells)

    @device
    def solve_ramp_hold(field, rate, modulus_ratio, tolerance, step, attempts, status, result):
        reached = np.empty((len(lane.REACHED), status.size))
        climb(field, rate, modulus_ratio, tolerance, status, reached)
        for cell in range(status.size):
            if status[cell] == FAILED:
                status[cell] = _read_ramp(reached, cell, rate[cell], modulus_ratio[cell] - 1.0, result)
        solve_holds(field, rate, modulus_ratio, tolerance, status, reached, result)

    return solve_ramp_hold
