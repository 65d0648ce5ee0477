"""A load held until the film fails: the time as an integral without poles, for a block of lanes.

Under a load held the state at the failure and the time to it follow from the state at the start alone. They are those
of `hold/quadrature.py` without a dead load and of `dead_load/hold.py` with one; what is estimated here is by how much
an error of the state at the start, and rounding, change the time.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .._jit import device
from ..dead_load import hold as loaded_hold
from ..dead_load import sweep as loaded
from ..dead_load.film import FIELD_T, FILM, GAP_T, W_T, describe, equilibrium_d
from ..hold import quadrature
from ..lane_state import next_cells
from ..model import CRITICAL_LOAD, CRITICAL_U
from .law import FREE, LOADED, Law
from .march import EPSILON, total_error
from .pieces import argument
from .rows import (
    BARRED,
    BASE,
    DOUBT,
    ERROR,
    FELL,
    HELD,
    HOLDS,
    LEAST,
    OFFSET,
    PIECE,
    READY,
    ROUNDING,
    TIME_ERROR,
    T,
    X,
    Y,
)

# Share of the error allowed in the time that the integral may take.
SHARE = 0.1
# What the load carried exceeds the one held by, relatively, below which rounding of the difference is too large for any
# use; above it its part in the time is estimated.
CLOSE = 1e-9
# Roundings of that difference.
ROUNDINGS = 16.0


class _Integral(NamedTuple):
    """The integral under one law of equilibrium.

    Attributes
    ----------
    rows : int
        Of the block of lanes.
    give : callable
        ``give(w, i, film, p, sigma, field, r, x)`` fills in a lane; whether the load is above that of a relaxed film.
    prepare, integrate : callable
        ``prepare(w)`` completes the block, ``integrate(w, rule, tolerance)`` as in `hold/quadrature.py`.
    lowest_rule : int
    unknown : callable
        ``unknown(w, i)``: that at the instability.
    """

    rows: int
    give: Callable[..., Any]
    prepare: Callable[..., Any]
    integrate: Callable[..., Any]
    lowest_rule: int
    unknown: Callable[..., Any]


@device
def _free_give(w, i, film, p, sigma, field, r, x):
    quadrature.prepare(w, i, field, p, quadrature.start_of_hold(field, p, r))
    return field > 1.0


@device
def _free_prepare(w):
    pass


@device
def _free_unknown(w, i):
    y = 1.0 + w[quadrature.CENTRE, i] + w[quadrature.HALF, i]
    return CRITICAL_U / (y * y)


@device
def _loaded_give(w, i, film, p, sigma, field, r, x):
    start = np.sqrt(r)
    describe(film, i, field, p, start, sigma)
    loaded.give(w, i, film, i, field, p, start, sigma)
    w[loaded.INVERSE, i] = 1.0 / r
    w_t = film[W_T, i]
    w[loaded.FIRST, i] = equilibrium_d(p, 1.0 / r, w_t, sigma, film[GAP_T, i], x - w_t)
    return film[GAP_T, i] > 0.0 and field > film[FIELD_T, i]


@device
def _loaded_unknown(w, i):
    return w[loaded_hold.UNSTABLE_W, i]


_INTEGRALS = {
    FREE: _Integral(quadrature.ROWS, _free_give, _free_prepare, quadrature.integrate, 0, _free_unknown),
    LOADED: _Integral(
        loaded.BLOCK,
        _loaded_give,
        loaded.prepare_holds,
        loaded_hold.integrate,
        loaded.LOWEST_RULE,
        _loaded_unknown,
    ),
}


def make_hold(law: Law, lanes: int) -> Callable[..., Any]:
    """Make ``hold(scale, source, columns, p, sigma, cells, status, kept, tolerance)``.

    Every passage that HOLDS becomes FELL, with T, Y, X those at the instability and the estimated errors of time and r
    there; or READY, to go through the piece in steps: where it does not fail in it, without looking for an instability.
    """
    rows, give, prepare, integrate, lowest_rule, unknown = _INTEGRALS[law]
    flow, critical, load = law.flow, law.critical, law.load

    @device
    def hold(scale, source, columns, p, sigma, cells, status, kept, tolerance):
        w = np.ones((rows, lanes))
        film = np.ones((FILM, lanes))
        rule = np.empty(lanes, np.int64)
        held = np.empty(lanes, np.int64)
        fields, served = np.ones(lanes), np.zeros(lanes)
        following = 0
        while True:
            count, following = next_cells(status, following, HOLDS, held)
            if count == 0:
                return
            for i in range(lanes):
                passage = held[i]
                piece = np.int64(kept[PIECE, passage])
                if piece < scale.shape[0]:
                    fields[i] = abs(argument(scale, source, columns, piece, 0, cells[passage]))
                else:
                    fields[i] = kept[HELD, passage]
            for i in range(lanes):
                passage = held[i]
                cell = cells[passage]
                r = kept[BASE, passage] + kept[Y, passage]
                above = give(w, i, film, p[cell], sigma[cell], fields[i], r, kept[X, passage])
                served[i] = 1.0 if above else 0.0
                w[quadrature.BEFORE, i] = kept[OFFSET, passage]
                rule[i] = max(quadrature.first_rule(p[cell], SHARE * tolerance), lowest_rule)
            prepare(w)
            integrate(w, rule, SHARE * tolerance)
            for i in range(count):
                passage = held[i]
                cell = cells[passage]
                status[passage] = READY
                time, E = w[quadrature.FOUND, i], fields[i]
                r, x = kept[BASE, passage] + kept[Y, passage], kept[X, passage]
                e = CRITICAL_LOAD * E * E
                spare = load(r, p[cell], sigma[cell], critical(r, p[cell], sigma[cell])) / e - 1.0
                whole = kept[OFFSET, passage] + time
                rounding = ROUNDINGS * EPSILON / spare * time
                known = served[i] > 0.0 and time >= 0.0 and time < math.inf and spare > CLOSE
                if not (known and rounding <= SHARE * tolerance * whole):
                    continue
                piece = np.int64(kept[PIECE, passage])
                lasts = argument(scale, source, columns, piece, 2, cell) if piece < scale.shape[0] else math.inf
                if time > lasts:
                    kept[BARRED, passage] = 0.0
                    continue
                error = total_error(kept[ERROR, passage], kept[ROUNDING, passage]) + EPSILON * r
                late = w[quadrature.ERROR, i] * whole + rounding + error / flow(r, p[cell], x, E)
                status[passage] = FELL
                kept[T, passage] = time
                kept[Y, passage] = w[quadrature.INTERNAL, i] - kept[BASE, passage]
                kept[X, passage] = unknown(w, i)
                kept[TIME_ERROR, passage] = late
                kept[ERROR, passage] = 16.0 * EPSILON * w[quadrature.INTERNAL, i]
                kept[ROUNDING, passage] = 0.0
                kept[LEAST, passage] = min(kept[LEAST, passage], kept[X, passage])
                # Whether it failed before the end of the piece.
                doubt = late / (lasts - time + 1e-300)
                kept[DOUBT, passage] = max(kept[DOUBT, passage], doubt)

    return hold
