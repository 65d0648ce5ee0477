"""Solving no more than the scene needs: a ramp as one scalar equation, a constant field as one integral."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from . import area_lanes as lane
from . import quadrature, ramp
from ._jit import device
from .area_lanes import AreaMethod
from .lanes import BUDGET_SPENT, FAILED, RUNNING
from .model import CRITICAL_LOAD, CRITICAL_U, critical_u
from .sweep import (
    CRITICAL_FIELD,
    CRITICAL_INTERNAL_STRETCH,
    CRITICAL_STRETCH,
    FIELD,
    MODULUS_RATIO,
    RATE,
    TIME_TO_FAILURE,
)

NOTHING_TO_INTEGRATE = -1


@device
def _read_hold(w, i, field, before, found):
    """Write what a lane found under a constant field that came on at a time; returns its status."""
    rest = w[quadrature.FOUND, i]
    time = before + (0.0 if rest < 0.0 else rest)  # rounding, a few ulp below instant failure
    if not time < math.inf:  # not as accurate as asked, or beyond what a float can hold
        return BUDGET_SPENT
    found[TIME_TO_FAILURE, i] = time
    found[CRITICAL_STRETCH, i] = w[quadrature.CENTRE, i] + w[quadrature.HALF, i]
    found[CRITICAL_STRETCH, i] /= np.sqrt(CRITICAL_U)
    found[CRITICAL_INTERNAL_STRETCH, i] = np.sqrt(w[quadrature.INTERNAL, i])
    found[CRITICAL_FIELD, i] = field
    return FAILED


@device
def solve_step(w, status, given, tolerance, step, attempts, found):
    """Solver of `sweep.make_sweep` for a field applied at once and held."""
    lanes = w.shape[1]
    rung = np.empty(lanes, np.int64)
    for i in range(lanes):
        field, p = given[FIELD, i], given[MODULUS_RATIO, i] - 1.0
        quadrature.prepare(w, i, field, p, quadrature.start_of_step(field, p))
    for i in range(lanes):
        first = quadrature.first_rung(given[MODULUS_RATIO, i] - 1.0, tolerance)
        rung[i] = first if status[i] == RUNNING else NOTHING_TO_INTEGRATE
    quadrature.integrate(w, rung, tolerance)
    for i in range(lanes):
        if status[i] == RUNNING:
            status[i] = _read_hold(w, i, given[FIELD, i], 0.0, found)


@device
def _internal(w, i, share):
    """Return r = xi**2 = (1 - y)(1 + v**2) at the event, from the state close to it and a share of dr/dv there."""
    v, z = w[lane.V, i], 1.0 - w[lane.Y, i]
    area = 1.0 + v * v
    return z * area + share * w[lane.STEP, i] * (2.0 * v * z - w[lane.SLOPES, i] * area)


@device
def _read_ramp(w, i, rate, found):
    """Write what a lane found at the instability on a ramp; returns its status."""
    p = w[lane.P, i]
    r = _internal(w, i, 0.5)  # dr/dv vanishes at the instability: half of it acts over the distance that is left
    field = np.sqrt(w[lane.LOAD, i] / CRITICAL_LOAD)
    if not field / rate < math.inf:
        return BUDGET_SPENT
    found[TIME_TO_FAILURE, i] = field / rate
    found[CRITICAL_STRETCH, i] = 1.0 / np.sqrt(critical_u(r, p))
    found[CRITICAL_INTERNAL_STRETCH, i] = np.sqrt(r)
    found[CRITICAL_FIELD, i] = field
    return FAILED


def make_solve_ramp(method: AreaMethod) -> Callable[..., Any]:
    """Make the solver of `sweep.make_sweep` for a field that rises without end."""
    climb = ramp.make_climb(method)
    late_start = method.late_start
    share = method.share

    @device
    def solve_ramp(w, status, given, tolerance, step, attempts, found):
        damping = ramp.damping_for(tolerance) if late_start else math.inf
        for i in range(w.shape[1]):
            ramp.start_lane(w, i, given[RATE, i], math.inf, given[MODULUS_RATIO, i] - 1.0, tolerance, share, damping)
        climb(w, tolerance)
        for i in range(w.shape[1]):
            if w[lane.STATUS, i] == lane.AT_INSTABILITY:
                status[i] = _read_ramp(w, i, given[RATE, i], found)
            else:
                status[i] = BUDGET_SPENT

    return solve_ramp


def make_solve_ramp_hold(method: AreaMethod) -> Callable[..., Any]:
    """Make the solver of `sweep.make_sweep` for a field that rises, then holds.

    Its workspace has the rows of the method first, those of the quadrature behind them.
    """
    climb = ramp.make_climb(method)
    ramp_rows = method.rows
    late_start = method.late_start
    share = method.share

    @device
    def solve_ramp_hold(w, status, given, tolerance, step, attempts, found):
        lanes = w.shape[1]
        damping = ramp.damping_for(tolerance) if late_start else math.inf
        for i in range(lanes):
            # An elastic film never gets past the field at which it fails, so no hold ends its climb.
            field = given[FIELD, i] if given[MODULUS_RATIO, i] > 1.0 else math.inf
            ramp.start_lane(w, i, given[RATE, i], field, given[MODULUS_RATIO, i] - 1.0, tolerance, share, damping)
        for i in range(lanes):
            if status[i] != RUNNING:
                w[lane.STATUS, i] = lane.SPENT
        climb(w, tolerance)
        hold = w[ramp_rows:]
        rung = np.empty(lanes, np.int64)
        for i in range(lanes):
            field, p = given[FIELD, i], given[MODULUS_RATIO, i] - 1.0
            quadrature.prepare(hold, i, field, p, quadrature.start_of_hold(field, p, _internal(w, i, 1.0)))
        for i in range(lanes):
            holds = status[i] == RUNNING and w[lane.STATUS, i] == lane.AT_LOAD
            first = quadrature.first_rung(given[MODULUS_RATIO, i] - 1.0, tolerance)
            rung[i] = first if holds else NOTHING_TO_INTEGRATE
        quadrature.integrate(hold, rung, tolerance)
        for i in range(lanes):
            if status[i] != RUNNING:
                continue
            if w[lane.STATUS, i] == lane.AT_INSTABILITY:
                status[i] = _read_ramp(w, i, given[RATE, i], found)
            elif w[lane.STATUS, i] == lane.AT_LOAD:
                status[i] = _read_hold(hold, i, given[FIELD, i], given[FIELD, i] / given[RATE, i], found)
            else:
                status[i] = BUDGET_SPENT

    return solve_ramp_hold

