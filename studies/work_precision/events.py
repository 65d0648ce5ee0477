"""Several pieces by solvers that are told nothing: every piece ends by one of two events, whichever comes first.

The independent variable s is that of ``dT = D/(D + 2 A) ds``, so that the equations are regular through the
instability, which is the event D = 0, and not stiff far from it; the other event is the end of the piece. The states
are time in the piece, w = 1/lambda and r.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import numba as nb
import numpy as np
from numpy.typing import NDArray
from pieces import CRITICAL_LOAD, Array, Films, critical, equilibrium, film_of, pieces_of
from solvers import Answer, Go, Read

FAR = 1e6
STEPS = 1000
LAST = 1e9  # time for which a field is held that is held for ever
PIECES = 1000

Through = Callable[[Array, Array], NDArray[np.bool_]]
"""Takes states at the start of a piece, taken to its end in place, and constants; returns who fails."""


def _stiffness(w: Any, r: Any, a: Any) -> Any:
    return 8.0 * (1.0 + a[0] * r * r) * w * w * w * w * w * w + 3.0 * a[3] * w - 2.0 * (1.0 + a[0] / r)


def _rhs(t: Any, y: Any, a: Any) -> tuple[Any, ...]:
    """Return the derivatives of time, w and r; the constants are p, start, slope, dead load, duration."""
    w, r = y[1], y[2]
    p, field, sigma = a[0], a[1] + a[2] * y[0], a[3]
    u = w * w
    z = u * r
    cube = u * u * u
    flow = 2.0 * (1.0 / z - z * z)
    rise = 8.0 * (1.0 + p * r * r) * cube + 3.0 * sigma * w  # D + 2 A
    share = 1.0 - 2.0 * (1.0 + p / r) / rise
    by_r = -p * u * (1.0 / (r * r) + 2.0 * r * cube)
    return share, (by_r * flow - 2.0 * CRITICAL_LOAD * field * a[2]) / (w * rise), flow * share


@cache
def _taylor(tolerance: float, batch: int) -> Any:
    import heyoka as hy

    hy.set_logger_level_critical()
    y = list(hy.make_vars("y0", "y1", "y2"))
    a = [hy.par[number] for number in range(5)]
    events = [
        hy.t_event_batch(_stiffness(y[1], y[2], a), direction=hy.event_direction.negative),
        hy.t_event_batch(y[0] / a[4] - 1.0, direction=hy.event_direction.positive),
    ]
    system = list(zip(y, _rhs(None, y, a), strict=True))
    zeros = np.ones((3, batch)), np.ones((5, batch))
    return hy.taylor_adaptive_batch(system, state=zeros[0], pars=zeros[1], tol=tolerance, t_events=events)


def heyoka(batch: int) -> Callable[[float], Through]:
    """Return heyoka in batches of lanes; an event in one of them stops all, and the others go on from there."""

    def engine(tolerance: float) -> Through:
        solver = _taylor(tolerance, batch)

        def through(states: Array, constants: Array) -> NDArray[np.bool_]:
            size = states.shape[1]
            fails = np.zeros(size, bool)
            for start in range(0, size, batch):
                part = np.minimum(np.arange(start, start + batch), size - 1)
                solver.reset_cooldowns()
                solver.set_time(np.zeros(batch))
                solver.state[:] = states[:, part]
                solver.pars[:] = constants[:, part]
                end, first = np.full(batch, FAR), np.zeros(batch, int)
                for _ in range(batch):
                    solver.propagate_until(end, max_steps=STEPS)
                    found = [int(outcome.value) for outcome, *_ in solver.propagate_res]
                    for lane, value in enumerate(found):
                        if -3 < value < 0 and first[lane] == 0:
                            first[lane] = value
                            end[lane] = solver.time[lane]
                    if first.all():
                        break
                own = slice(start, min(start + batch, size))
                lanes = slice(own.stop - own.start)
                states[:, own] = np.where(first == 0, np.nan, solver.state)[:, lanes]
                fails[own] = (first == -1)[lanes]
            return fails

        return through

    return engine


def scipy(method: str) -> Callable[[float], Through]:
    """Return ``solve_ivp``, film by film, on a compiled right-hand side."""
    from scipy.integrate import solve_ivp

    rhs, stiffness = nb.njit(_rhs, error_model="numpy"), nb.njit(_stiffness, error_model="numpy")

    def unstable(t: float, y: Array, a: Array) -> float:
        return float(stiffness(y[1], y[2], a))

    def over(t: float, y: Array, a: Array) -> float:
        return float(y[0] - a[4])

    unstable.terminal, unstable.direction = True, -1.0
    over.terminal, over.direction = True, 1.0

    def engine(tolerance: float) -> Through:
        def through(states: Array, constants: Array) -> NDArray[np.bool_]:
            fails = np.zeros(states.shape[1], bool)
            for film in range(fails.size):
                found = solve_ivp(
                    rhs, (0.0, FAR), states[:, film], method, rtol=max(tolerance, 3e-14), atol=tolerance,
                    events=(unstable, over), args=(constants[:, film].copy(),),
                )  # fmt: skip
                fails[film] = len(found.t_events[0]) > 0
                states[:, film] = found.y[:, -1] if found.status == 1 else np.nan
            return fails

        return through

    return engine


def untold(engine: Callable[[float], Through]) -> Callable[[Films, float], tuple[Go, Read]]:
    """Make a solver of films under several pieces from one that ends a piece by events."""

    def prepare(films: Films, accuracy: float) -> tuple[Go, Read]:
        p, square, sigma = film_of(films)
        way = pieces_of(films)
        through = engine(accuracy)
        duration = np.minimum(way.duration, LAST)
        ends = way.start + way.slope * np.where(way.slope == 0.0, 0.0, duration)
        count = way.start.shape[0]
        w, r, time = np.empty((3, p.size))

        def go() -> None:
            r[:], time[:] = square, 0.0
            alive = np.arange(p.size)
            for number in range(PIECES if way.repeated else count):
                here = number % count
                jumps = alive[(np.abs(way.start[here, alive] - ends[here - 1, alive]) > 1e-9) | (number == 0)]
                if jumps.size:
                    w[jumps] = equilibrium(way.start[here, jumps], r[jumps], p[jumps], sigma[jumps])
                pieces = (p, way.start[here], way.slope[here], sigma, duration[here])
                constants = np.array([part[alive] for part in pieces])
                states = np.array([np.zeros(alive.size), w[alive], r[alive]])
                fails = through(states, constants)
                spent, w[alive], r[alive] = states
                time[alive] += spent
                alive = alive[~fails & np.isfinite(spent)]
                if alive.size == 0:
                    return
            time[alive] = np.nan  # it survives the pieces

        def read() -> Answer:
            return time, 1.0 / critical(r, p, sigma)[0]

        return go, read

    return prepare
