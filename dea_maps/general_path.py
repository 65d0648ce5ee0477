"""Integration of the general model through its loading, in a time that stays regular at the instability.

The rates of the stretches and of the electric displacement solve the linear system (12) of Zhao, Koh and Suo (2011),
whose determinant vanishes at the instability. With ``phi`` the determinant of the Hessian (13) scaled to a unit
diagonal, 1 where nothing couples and 0 at the instability, and a new independent variable ``s`` with ``dt = phi ds``,
every rate is finite by Cramer's rule, and failure is a plain change of sign. In the time itself the rates grow like
``(t_f - t)**-1/2`` there, and methods step over the fold and come back on the wrong branch.

The equations of state (18) to (20) are integrated, not solved: what the state has drifted from them decays at
`_RETURN` per relaxation time, so that a long stay near the instability cannot amplify it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, sqrt
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp

from .free_energy import State, coupling, equations_of_state, flow, hessian, scaled_hessian

Array = npt.NDArray[np.float64]

ROWS = 8
"""Rows of what is integrated: the five of `State`, then time, work of the loads and energy dissipated."""
TIME, WORK, DISSIPATED = 5, 6, 7
REFERENCE = (1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0)
"""The film in its reference state: nothing stretched, no load."""

_RETURN = 5.0  # per relaxation time, like the fastest flow: no stiffer than the model is
_SAFETY = 0.02  # of the tolerance of the results, for that of a step
_SMALLEST_TOLERANCE = 2.5e-14  # what solve_ivp accepts
_SLOW = 300.0  # relaxation times: an implicit method takes longer lines, and the wait for rest, in fewer steps
_LONGEST = 1e5  # in s, for a hold; what has neither failed nor come to rest by then is unresolved
_LONGEST_PER_TIME = 100.0  # in s per relaxation time, for what ends
_SMALLEST_MOTION = 1e-13  # per relaxation time: less is rounding
_DIFFERENCE = 1e-7  # of a Jacobian, relative
_NEWTON_STEPS = 3
_NEWTON_STEPS_TO_REST = 20


class Loading(NamedTuple):
    """Loads along a straight line: two stresses or stretches and the field, dimensionless.

    Attributes
    ----------
    start : tuple of float
        At the start of the line.
    slope : tuple of float
        Their rates, per relaxation time, or over the whole line where it is sudden.
    held : tuple of bool
        For each direction, whether its stretch is prescribed instead of its stress.
    """

    start: tuple[float, float, float]
    slope: tuple[float, float, float]
    held: tuple[bool, bool]


@dataclass(frozen=True)
class Leg:
    """What was integrated along one straight line.

    Attributes
    ----------
    states : callable
        Rows of the state, of shape (`ROWS`, ...), at values of ``s``.
    nodes : ndarray
        Values of ``s`` at the steps.
    times : ndarray
        Times there, rising.
    """

    states: Callable[[Array], Array]
    nodes: Array
    times: Array


class End(NamedTuple):
    """How a line ended.

    Attributes
    ----------
    rows : ndarray of shape (ROWS,)
        The last state.
    why : {"arrived", "unstable", "at rest", "given up"}
        What stopped it.
    """

    rows: Array
    why: str


def follow(
    rows: Array, loading: Loading, duration: float, p: float, rtol: float, *, sudden: bool = False
) -> tuple[Leg | None, End]:
    """Integrate along a straight line of loads.

    Parameters
    ----------
    rows : ndarray of shape (ROWS,)
        Where to start, in equilibrium with the loads there.
    loading : Loading
        The loads; in a sudden line all change in proportion while the dashpot stands still.
    duration : float
        In relaxation times, or infinite: then until the film fails or its dashpot rests. 1 where sudden.
    p : float
        Modulus ratio less one.
    rtol : float
        Relative error allowed.
    sudden : bool
        Whether it takes no time.

    Returns
    -------
    leg : Leg or None
        What was integrated; None where it ended before it began.
    end : End
    """
    line = _Line(loading, 0.0 if sudden else float(rows[TIME]), p, viscous=not sudden)
    kept_time = rows[TIME]
    if sudden:
        rows = rows.copy()
        rows[TIME] = 0.0
    target = rows[TIME] + duration

    def arrival(_: float, y: Array) -> float:
        return float(target - y[TIME])

    def stability(_: float, y: Array) -> float:
        return line.phi(y)

    resting = max(rtol / (1.0 + p), _SMALLEST_MOTION)  # a film of large modulus ratio is slow, not at rest

    def motion(_: float, y: Array) -> float:
        return float(np.abs(flow(State(*y[:TIME].tolist()))).sum() - resting)

    ends = {"unstable": stability, **({"arrived": arrival} if duration < inf else {"at rest": motion})}
    if duration == inf and motion(0.0, rows) <= 0.0:
        return None, _at_rest(rows, loading, rtol)
    for event in ends.values():
        event.terminal = True  # type: ignore[attr-defined]
        event.direction = -1.0  # type: ignore[attr-defined]
    tolerance = max(_SAFETY * rtol, _SMALLEST_TOLERANCE)
    options: dict[str, Any] = {"rtol": tolerance, "atol": tolerance}
    if duration > _SLOW:
        options |= {"method": "Radau", "jac": line.jacobian}
    else:
        options["method"] = "DOP853"
    longest = _LONGEST + (_LONGEST_PER_TIME * duration if duration < inf else 0.0)
    with np.errstate(all="ignore"):  # a trial step may go anywhere: it is rejected
        run = solve_ivp(line.rates, (0.0, longest), rows, events=list(ends.values()), dense_output=True, **options)
    which = [name for name, found in zip(ends, run.t_events, strict=True) if found.size]
    why = which[0] if run.status == 1 and which else "given up"
    end = run.y[:, -1]
    if why in {"unstable", "arrived"}:
        end = line.land(run.t[-2], run.y[:, -2], run.t[-1], None if why == "unstable" else target, options)
    if sudden:
        end[TIME] = kept_time
        return None, End(end, why)
    leg = Leg(run.sol, run.t, run.y[TIME])
    return leg, _at_rest(end, loading, rtol) if why == "at rest" else End(end, why)


def _at_rest(rows: Array, loading: Loading, rtol: float) -> End:
    """Solve for the stable state of full relaxation that a film almost at rest tends to.

    There the dashpot has taken all of the stretch, and (18) to (20) are those of a film with ``mu_R`` alone.
    A film that lingers where there is no such state is given up.
    """
    values = np.array(rows[:3])
    free = np.array([not loading.held[0], not loading.held[1], True])
    for _ in range(_NEWTON_STEPS_TO_REST):
        state = _relaxed(values)
        h = hessian(state, 0.0)
        matrix = np.array([[h.h11, h.h12, h.h13], [h.h12, h.h22, h.h23], [h.h13, h.h23, h.h33]])
        gap = np.array(loading.start) - equations_of_state(state, 0.0)
        change = np.zeros(3)
        try:
            change[free] = np.linalg.solve(matrix[np.ix_(free, free)], gap[free])
        except np.linalg.LinAlgError:  # on the border of stability itself
            return End(rows, "given up")
        values += change
        if np.abs(change).max() < 1e-15 * np.abs(values).max():
            break
    stable = scaled_hessian(_relaxed(values), 0.0, loading.held).phi > 0.0
    moved = values - rows[:3]
    if not stable or not np.abs(moved).max() < sqrt(rtol) * np.abs(values).max():
        return End(rows, "given up")
    end = np.array([*values, values[0], values[1], *rows[TIME:]])
    end[WORK] += float(np.dot(moved, loading.start))  # nothing is moved where the stretch is prescribed
    return End(end, "at rest")


def _relaxed(values: Array) -> State[float]:
    """Return the state of a film with ``mu_R`` alone."""
    stretch_1, stretch_2, displacement = values.tolist()
    return State(stretch_1, stretch_2, displacement, 1.0, 1.0)


class _Line:
    """Rates along a straight line of loads."""

    def __init__(self, loading: Loading, since: float, p: float, *, viscous: bool) -> None:
        self._loading = loading
        self._since = since
        self._p = p
        self._viscous = viscous

    def phi(self, y: Array) -> float:
        """Return the determinant of the scaled Hessian."""
        return scaled_hessian(State(*y[:TIME].tolist()), self._p, self._loading.held).phi

    def rates(self, _: float, y: Array) -> list[float]:
        """Return derivatives by ``s``: (12) by Cramer's rule, (21), (22), ``dt = phi ds``, work, (11)."""
        values = y.tolist()
        state = State(*values[:TIME])
        start, slope, held = self._loading
        elapsed = values[TIME] - self._since
        loads = [first + elapsed * rate for first, rate in zip(start, slope, strict=True)]
        p = self._p
        (root_1, root_2, root_3), c12, c13, c23, phi = scaled_hessian(state, p, held)
        s1, s2, field = equations_of_state(state, p)
        x1, x2 = flow(state) if self._viscous else (0.0, 0.0)
        c = coupling(state, p)
        # What (12) has on its other side, over the roots of the diagonal.
        b1 = slope[0] - c.c11 * x1 - c.c12 * x2 + _RETURN * (loads[0] - s1)
        b2 = slope[1] - c.c21 * x1 - c.c22 * x2 + _RETURN * (loads[1] - s2)
        b3 = slope[2] + _RETURN * (loads[2] - field)
        if held[0] or held[1]:
            h = hessian(state, p)
            l1, l2 = slope[0] if held[0] else 0.0, slope[1] if held[1] else 0.0
            b1, b2, b3 = b1 - h.h12 * l2, b2 - h.h12 * l1, b3 - h.h13 * l1 - h.h23 * l2
        b1, b2, b3 = b1 / root_1, b2 / root_2, b3 / root_3
        d1 = ((1.0 - c23 * c23) * b1 + (c13 * c23 - c12) * b2 + (c12 * c23 - c13) * b3) / root_1
        d2 = ((c13 * c23 - c12) * b1 + (1.0 - c13 * c13) * b2 + (c12 * c13 - c23) * b3) / root_2
        d3 = ((c12 * c23 - c13) * b1 + (c12 * c13 - c23) * b2 + (1.0 - c12 * c12) * b3) / root_3
        if held[0]:
            d1, loads[0] = phi * slope[0], s1
        if held[1]:
            d2, loads[1] = phi * slope[1], s2
        work = loads[0] * d1 + loads[1] * d2 + loads[2] * d3
        return [d1, d2, d3, phi * x1, phi * x2, phi, work, phi * p * (x1 * x1 + x2 * x2)]

    def jacobian(self, s: float, y: Array) -> Array:
        """Return derivatives of the rates by differences; of their own, since SciPy's overflow where all are zero."""
        here = np.asarray(self.rates(s, y))
        matrix = np.zeros((ROWS, ROWS))
        for column in range(TIME + 1):
            ahead = y.copy()
            ahead[column] += _DIFFERENCE * max(1.0, abs(y[column]))
            matrix[:, column] = (np.asarray(self.rates(s, ahead)) - here) / (ahead[column] - y[column])
        return matrix

    def land(self, before: float, rows: Array, s: float, target: float | None, options: dict[str, Any]) -> Array:
        """Return the state at the instability, or at a time, better than interpolation finds it.

        Parameters
        ----------
        before, rows : float and ndarray of shape (ROWS,)
            The last step before it.
        s : float
            Where interpolation finds it.
        target : float or None
            The time, or None for the instability.
        options : dict
            Method and tolerances.
        """
        for _ in range(_NEWTON_STEPS):
            if s != before:
                rows = solve_ivp(self.rates, (before, s), rows, **options).y[:, -1]
            before = s
            slope = np.asarray(self.rates(s, rows))
            if target is None:
                small = 1e-6 / max(1.0, float(np.abs(slope).max()))
                ahead, behind = (self.phi(rows + sign * small * slope) for sign in (1.0, -1.0))
                s -= self.phi(rows) * 2.0 * small / (ahead - behind)
            else:
                s += (target - float(rows[TIME])) / float(slope[TIME])
        return rows
