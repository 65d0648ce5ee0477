"""The truth under programs of several pieces and dead loads: the paper's equations, made regular, by extrapolation.

The states are time, lambda and xi, and the independent variable s is that of ``dT = D ds`` with ``D = de/dlambda``,
which vanishes at the instability, so that (24) and (26) are regular through it. Steps are the midpoint rule
extrapolated from six numbers of substeps (Gragg; Bulirsch and Stoer), order 12, in extended precision where there is
one, as lambda and xi apart lose the distance from equilibrium close to a critical field. The end of a piece is one step
in time, and the instability a root of D in the length of the last step. `dea_maps` has neither these states nor this
method.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pieces import CRITICAL_LOAD, Array, Films, Pieces, critical, equilibrium, film_of, pieces_of

SUBSTEPS = (2, 4, 6, 8, 10, 12)
TOLERANCE = 2e-14  # between two columns; the result is that of the better one
SHORTEST = 1e-12
LONGEST = 100_000  # pieces that a film may survive, and steps in one of them

Rhs = Callable[[Array], Array]


class Failure(NamedTuple):
    """What becomes of the films, (cases,) arrays: time and stretch, the pieces outlasted, the time in the last one."""

    time: Array
    stretch: Array
    outlasted: NDArray[np.int64]
    within: Array


def _rhs(p: Array, sigma: Array, start: Array, slope: Array) -> Rhs:
    """Return the derivatives of time, lambda and xi by s; the first one is D."""

    def rhs(y: Array) -> Array:
        t, stretch, xi = y
        inverse = 1.0 / stretch
        v, square = inverse * inverse, xi * xi
        cube = xi * square
        A, B = 1.0 + p / square, 1.0 + p * square * square
        D = v * inverse * (8.0 * B * v * v * v + 3.0 * sigma * inverse - 2.0 * A)
        flow = 1.0 / (v * cube) - v * v * cube
        by_xi = -2.0 * p * v * (1.0 / cube + 2.0 * v * v * v * cube)
        load_rate = 2.0 * CRITICAL_LOAD * (start + slope * t) * slope
        return np.array([D, load_rate - by_xi * flow, flow * D])

    return rhs


def _extrapolate(rhs: Rhs, y: Array, length: Array) -> tuple[Array, Array]:
    """Return the states a step further, and how far the last two columns of the extrapolation are apart."""
    begin = rhs(y)
    row: list[Array] = []
    for number, substeps in enumerate(SUBSTEPS):
        h = length / substeps
        before, now = y, y + h * begin
        for _ in range(substeps - 1):
            before, now = now, before + 2.0 * h * rhs(now)
        finer = [now]
        for column in range(number):
            share = (substeps / SUBSTEPS[number - 1 - column]) ** 2 - 1.0
            finer.append(finer[column] + (finer[column] - row[column]) / share)
        row, last = finer, row
    apart = np.max(np.abs(row[-1] - last[-1]) / (1.0 + np.abs(row[-1])), axis=0)
    return row[-1], np.where(np.isfinite(apart), apart, np.inf)


def _instability(rhs: Rhs, y: Array, length: Array) -> Array:
    """Return the states where D vanishes, within a step, by the secant method between bounds."""
    low, high = np.zeros_like(length), length
    at_low, at_high = rhs(y)[0], rhs(_extrapolate(rhs, y, length)[0])[0]
    best = length
    for step in range(40):  # regula falsi, Illinois variant, a bisection now and then
        best = 0.5 * (low + high) if step % 5 == 4 else (low * at_high - high * at_low) / (at_high - at_low)
        found, _ = _extrapolate(rhs, y, best)
        left = rhs(found)[0]
        above = left > 0.0
        at_high, at_low = np.where(above, 0.5 * at_high, left), np.where(above, left, 0.5 * at_low)
        low, high = np.where(above, best, low), np.where(above, high, best)
        if np.all((np.abs(left) < 1e-16) | (high - low <= 2e-16 * length)):
            break
    return found


def _piece(
    y: Array, p: Array, sigma: Array, start: Array, slope: Array, duration: Array, tolerance: float
) -> NDArray[np.bool_]:
    """Take films through a piece, or to failure: states (3, cases) in place; return whether they fail."""
    fails = np.zeros(duration.size, bool)
    length = np.full(duration.size, 1e-2, np.longdouble)
    going = np.flatnonzero(duration > 0.0)
    for _ in range(LONGEST):
        if going.size == 0:
            return fails
        some = p[going], sigma[going], start[going], slope[going]
        rhs, end, h = _rhs(*some), duration[going], length[going]
        trial, apart = _extrapolate(rhs, y[:, going], h)
        good = apart <= tolerance
        at_end, unstable = trial[0] >= end, rhs(trial)[0] <= 0.0
        arrives, breaks = good & at_end, good & unstable & ~at_end
        passes = good & ~at_end & ~unstable
        grown = np.clip(0.8 * (tolerance / np.maximum(apart, 1e-30)) ** (1.0 / 11.0), 0.3, 2.0)
        length[going] = h * np.where(good & ~passes, 0.5, grown)  # an end that is not found is approached
        if length[going].min() < SHORTEST:
            raise RuntimeError("the truth under a program of pieces was not found: steps without end")
        done = np.zeros(going.size, bool)
        if arrives.any():
            which = going[arrives]
            own = _rhs(*(part[arrives] for part in some))

            def in_time(y: Array, own: Rhs = own) -> Array:
                slopes = own(y)
                return slopes / slopes[0]

            landed, apart = _extrapolate(in_time, y[:, which], end[arrives] - y[0, which])
            well = apart <= tolerance
            y[:, which[well]] = landed[:, well]
            done[np.flatnonzero(arrives)[well]] = True
        if breaks.any():
            which = going[breaks]
            found = _instability(_rhs(*(part[breaks] for part in some)), y[:, which], h[breaks])
            first = found[0] < end[breaks]  # time turns round at the instability: the piece may end before it
            y[:, which[first]] = found[:, first]
            fails[which[first]] = True
            done[np.flatnonzero(breaks)[first]] = True
        y[:, going[passes]] = trial[:, passes]
        going = going[~done]
    raise RuntimeError("the truth under a program of pieces was not found: too many steps")


def failures(films: Films, refinement: int = 1) -> Failure:
    """Take films of which every one fails to its end."""
    p, r, sigma = (part.astype(np.longdouble) for part in film_of(films))
    way: Pieces = pieces_of(films)
    time, within = np.zeros((2, p.size), np.longdouble)
    stretch, outlasted = np.full(p.size, np.nan, np.longdouble), np.zeros(p.size, np.int64)
    alive = np.arange(p.size)
    xi = np.sqrt(r)
    for number in range(LONGEST):
        if not way.repeated and number == way.start.shape[0]:
            raise RuntimeError(f"{films.scene}: films survive, number {alive[:5]}")
        start, slope, duration = (part[number % way.start.shape[0], alive] for part in way[:3])
        start, slope, duration = (part.astype(np.longdouble) for part in (start, slope, duration))
        w = equilibrium(start, xi[alive] ** 2, p[alive], sigma[alive])
        y = np.array([np.zeros(alive.size), 1.0 / w, xi[alive]])
        fails = _piece(y, p[alive], sigma[alive], start, slope, duration, TOLERANCE / refinement**2)
        time[alive] += y[0]
        xi[alive] = y[2]
        over = alive[fails]
        within[over], outlasted[over] = y[0, fails], number
        stretch[over] = 1.0 / critical(xi[over] ** 2, p[over], sigma[over])[0]
        alive = alive[~fails]
        if alive.size == 0:
            return Failure(time.astype(float), stretch.astype(float), outlasted, within.astype(float))
    raise RuntimeError(f"{films.scene}: films survive {LONGEST} pieces")
