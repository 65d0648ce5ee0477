"""Integration of the general model through its loading, in a time that stays regular at the instability.

The rates of the stretches and of the electric displacement solve the linear system (12) of Zhao, Koh and Suo (2011),
whose determinant vanishes at the instability. With ``phi`` the determinant of the Hessian (13) scaled to a unit
diagonal, 1 where nothing couples and 0 at the instability, and a new independent variable ``s`` with ``dt = phi ds``,
every rate is finite by Cramer's rule, and failure is a plain change of sign. In the time itself the rates grow like
``(t_f - t)**-1/2`` there, and methods step over the fold and come back on the wrong branch.

The equations of state (18) to (20) are integrated, not solved: what the state has drifted from them decays at
`_RETURN` per relaxation time, so that a long stay near the instability cannot amplify it.
"""

from dataclasses import dataclass
from math import inf, nan, sqrt
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.integrate import DOP853, DenseOutput, OdeSolution, OdeSolver, Radau, solve_ivp
from scipy.optimize import brentq

from .free_energy import State, coupling, equations_of_state, flow, hessian, scaled_hessian

Array = npt.NDArray[np.float64]

ROWS = 8
"""Rows of what is integrated: the five of `State`, then time, work of the loads and energy dissipated."""
TIME, WORK, DISSIPATED = 5, 6, 7
REFERENCE = (1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0)
"""The film in its reference state: nothing stretched, no load."""

_RETURN = 5.0  # per relaxation time, like the fastest flow: no stiffer than the model is
_SAFETY = 0.02  # of the tolerance of the results, for that of a step
_SMALLEST_TOLERANCE = 2.5e-14  # what SciPy's methods accept
_SLOW = 300.0  # relaxation times: on longer lines, and up to the steady state, an implicit method takes fewer steps
_MOST_EVALUATIONS = 50_000  # of the rates on a line, a second or two; a line that needs more is unresolved
_SMALLEST_MOTION = 1e-13  # per relaxation time: less is rounding
_DIFFERENCE = 1e-7  # of a Jacobian, relative
_LOOKS = 4  # within a step, for an instability that is passed and left again
_CLOSE = 0.1  # of the tolerance of the results: an instability so close to a corner of the load is not told from it
_NEWTON_STEPS = 3
_NEWTON_STEPS_TO_REST = 20


class Loading(NamedTuple):
    """Loads along a straight line: two stresses or stretches and the field, dimensionless.

    Attributes
    ----------
    start : tuple of float
        At the start of the line.
    end : tuple of float
        At its end.
    held : tuple of bool
        For each direction, whether its stretch is prescribed instead of its stress.
    """

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    held: tuple[bool, bool]


@dataclass(frozen=True)
class Leg:
    """What was integrated along one straight line.

    Attributes
    ----------
    pieces : callable
        Rows of the state, of shape (`ROWS`, n), at n values of ``s``.
    nodes : ndarray
        Values of ``s`` at the steps.
    times : ndarray
        Times there, rising.
    line : _Line
        Its loads.
    """

    pieces: OdeSolution
    nodes: Array
    times: Array
    line: "_Line"

    def states(self, s: Array) -> Array:
        """Return rows of the state, of shape (`ROWS`, n), at values of ``s``."""
        rows = np.asarray(self.pieces(s))
        rows[TIME] = self.line.time(rows[TIME])
        return rows


class End(NamedTuple):
    """How a line ended.

    Attributes
    ----------
    rows : ndarray of shape (ROWS,)
        The last state.
    why : {"arrived", "unstable", "steady state", "not converged"}
        What stopped it.
    close : bool
        Whether it arrived so close to an instability, or became unstable so close to its end, that the two cannot be
        told apart at this accuracy; the last state is then that at the instability, and it has arrived.
    """

    rows: Array
    why: str
    close: bool = False


def follow(rows: Array, loading: Loading, duration: float, p: float, rtol: float) -> tuple[Leg | None, End]:
    """Integrate along a straight line of loads, up to its end and no further.

    An instability counts only if it comes before the end of the line. A step that passes it has the largest time of
    its branch there; if that is more than the end of the line, the line ends first.

    Parameters
    ----------
    rows : ndarray of shape (ROWS,)
        Where to start, in equilibrium with the loads there.
    loading : Loading
        The loads.
    duration : float
        In relaxation times; 0 for a sudden change, in which all loads change in proportion while the dashpot stands
        still; infinite for a hold until the film fails or its dashpot rests.
    p : float
        Modulus ratio less one.
    rtol : float
        Relative error allowed.

    Returns
    -------
    leg : Leg or None
        What was integrated; None where it takes no time.
    end : End
    """
    since = float(rows[TIME])
    line = _Line(loading, since, duration, p)
    rows = rows.copy()
    rows[TIME] = 0.0
    resting = max(rtol / (1.0 + p), _SMALLEST_MOTION)  # a film of large modulus ratio is slow, not in its steady state
    if duration == inf and line.motion(rows) <= resting:
        return None, _steady_state(line.dated(rows), loading, rtol)
    tolerance = max(_SAFETY * rtol, _SMALLEST_TOLERANCE)
    method: type[OdeSolver] = DOP853
    options: dict[str, Any] = {"rtol": tolerance, "atol": tolerance}
    if duration > _SLOW:
        method, options = Radau, {**options, "jac": line.jacobian}
    nodes, states = [0.0], [rows]
    pieces: list[DenseOutput] = []

    def ended(rows: Array, why: str, close: bool = False) -> tuple[Leg | None, End]:
        rows = line.dated(rows)
        leg = None
        if duration > 0.0 and pieces:
            times = np.maximum.accumulate(line.time(np.array([state[TIME] for state in states])))
            times[-1] = max(times[-2], rows[TIME])
            leg = Leg(OdeSolution(nodes, pieces), np.array(nodes), times, line)
        if why == "steady state":
            return leg, _steady_state(rows, loading, rtol)
        return leg, End(rows, why, close)

    with np.errstate(all="ignore"):  # a trial step may go anywhere: it is rejected
        try:
            if not np.isfinite(line.rates(0.0, rows)).all():
                return ended(rows, "not converged")
            solver = method(line.rates, 0.0, rows, inf, **options)
            while True:
                before = solver.y
                solver.step()
                if solver.status == "failed":
                    return ended(before, "not converged")
                piece = solver.dense_output()
                pieces.append(piece)
                nodes.append(solver.t)
                states.append(solver.y)
                landing = _Landing(line, method, options, piece, before)
                passed = landing.first_unstable()
                if passed is not None:
                    s, last = landing.instability(passed)
                    nodes[-1] = s
                    states[-1] = last
                    gap = last[TIME] - line.target
                    if duration < inf and abs(gap) <= _CLOSE * rtol * line.scale:
                        last[TIME] = line.target
                        return ended(last, "arrived", close=True)
                    if gap < 0.0:
                        return ended(last, "unstable")
                if states[-1][TIME] >= line.target:
                    nodes[-1], states[-1] = landing.arrival(nodes[-1])
                    return ended(states[-1], "arrived")
                if duration == inf and line.motion(solver.y) <= resting:
                    return ended(solver.y, "steady state")
        except _TooMuchWorkError:
            return ended(states[-1], "not converged")


def _steady_state(rows: Array, loading: Loading, rtol: float) -> End:
    """Solve for the stable state of full relaxation that a film close to its steady state tends to.

    There the dashpot has the stretch of the film, and (18) to (20) are those of a film with ``mu_R`` alone.
    A film that moves slowly where there is no such state is not converged.
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
            return End(rows, "not converged")
        values += change
        if np.abs(change).max() < 1e-15 * np.abs(values).max():
            break
    stable = scaled_hessian(_relaxed(values), 0.0, loading.held).phi > 0.0
    moved = values - rows[:3]
    if not stable or not np.abs(moved).max() < sqrt(rtol) * np.abs(values).max():
        return End(rows, "not converged")
    end = np.array([*values, values[0], values[1], *rows[TIME:]])
    end[WORK] += float(np.dot(moved, loading.start))  # nothing is moved where the stretch is prescribed
    return End(end, "steady state")


def _relaxed(values: Array) -> State[float]:
    """Return the state of a film with ``mu_R`` alone."""
    stretch_1, stretch_2, displacement = values.tolist()
    return State(stretch_1, stretch_2, displacement, 1.0, 1.0)


class _TooMuchWorkError(Exception):
    """A line needs more evaluations of the rates than allowed."""


class _Line:
    """Rates along a straight line of loads.

    Time is counted from its start, in relaxation times or, where the line is shorter than one, in its own length: so
    a sudden change is a line of length 0, and a line as short as numbers can be is no different.
    """

    def __init__(self, loading: Loading, since: float, duration: float, p: float) -> None:
        self._loading = loading
        self._since = since
        self._p = p
        self._evaluations = 0
        self.unit = min(duration, 1.0)
        self.target = 1.0 if duration <= 1.0 else duration
        constant = loading.start == loading.end
        self.scale = self.target + (since / self.unit if constant and self.unit > 0.0 else 0.0)
        changes = (new - old for old, new in zip(loading.start, loading.end, strict=True))
        self._slope = tuple(change / self.target for change in changes)

    def time(self, elapsed: Any) -> Any:
        """Return the time from the start of the loading."""
        return self._since + self.unit * elapsed

    def elapsed(self, times: Array) -> Array:
        """Return times from the start of the loading as this line counts them."""
        return (times - self._since) / self.unit

    def dated(self, rows: Array) -> Array:
        """Return a state with the time from the start of the loading."""
        rows = rows.copy()
        rows[TIME] = self._since if self.unit == 0.0 else self.time(rows[TIME])
        return rows

    def motion(self, y: Array) -> float:
        """Return how fast the dashpot moves, per relaxation time."""
        return float(np.abs(flow(State(*y[:TIME].tolist()))).sum())

    def phi(self, y: Array) -> float:
        """Return the determinant of the scaled Hessian."""
        return scaled_hessian(State(*y[:TIME].tolist()), self._p, self._loading.held).phi

    def rates(self, _: float, y: Array) -> list[float]:
        """Return derivatives by ``s``: (12) by Cramer's rule, (21), (22), ``dt = phi ds``, work, (11)."""
        self._evaluations += 1
        if self._evaluations > _MOST_EVALUATIONS:
            raise _TooMuchWorkError
        try:
            return self._rates(y.tolist())
        except (ZeroDivisionError, ValueError):  # out of what numbers can hold
            return [nan] * ROWS

    def _rates(self, values: list[float]) -> list[float]:
        state = State(*values[:TIME])
        start, _, held = self._loading
        slope = self._slope
        loads = [first + values[TIME] * rate for first, rate in zip(start, slope, strict=True)]
        p, unit = self._p, self.unit
        (root_1, root_2, root_3), c12, c13, c23, phi = scaled_hessian(state, p, held)
        s1, s2, field = equations_of_state(state, p)
        x1, x2 = flow(state)
        dissipated = unit * p * (x1 * x1 + x2 * x2)
        x1, x2 = unit * x1, unit * x2
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
        return [d1, d2, d3, phi * x1, phi * x2, phi, work, phi * dissipated]

    def jacobian(self, s: float, y: Array) -> Array:
        """Return derivatives of the rates by differences; of their own, since SciPy's overflow where all are zero."""
        here = np.asarray(self.rates(s, y))
        matrix = np.zeros((ROWS, ROWS))
        for column in range(TIME + 1):
            ahead = y.copy()
            ahead[column] += _DIFFERENCE * max(1.0, abs(y[column]))
            matrix[:, column] = (np.asarray(self.rates(s, ahead)) - here) / (ahead[column] - y[column])
        return matrix


class _Landing:
    """Where within a step a line ends, better than interpolation finds it.

    Parameters
    ----------
    line : _Line
        Its rates.
    method, options
        Of the integration.
    piece : DenseOutput
        The interpolant of the step.
    rows : ndarray of shape (ROWS,)
        The state at its start.
    """

    def __init__(
        self, line: _Line, method: type[OdeSolver], options: dict[str, Any], piece: DenseOutput, rows: Array
    ) -> None:
        self._line = line
        self._method = method
        self._options = options
        self._piece = piece
        self._rows = rows

    def first_unstable(self) -> float | None:
        """Return the first place looked at in the step where the state is unstable, or None."""
        start, stop = self._piece.t_old, self._piece.t
        for s in np.linspace(start, stop, _LOOKS + 1)[1:].tolist():
            if self._line.phi(self._piece(s)) <= 0.0:
                return float(s)
        return None

    def instability(self, unstable: float) -> tuple[float, Array]:
        """Return where the instability is, before a place that is unstable, and the state there."""
        start = self._piece.t_old
        if self._line.phi(self._rows) <= 0.0:
            return start, self._rows.copy()
        s = brentq(lambda s: self._line.phi(self._piece(s)), start, unstable)
        before, rows = start, self._rows
        for _ in range(_NEWTON_STEPS):
            rows = self._moved(before, rows, s)
            before = s
            s -= self._line.phi(rows) / self._curvature(s, rows)
        return before, rows

    def arrival(self, late: float) -> tuple[float, Array]:
        """Return where the line ends, before a place beyond its end and before any instability, and the state there.

        Near the instability the time is a parabola in ``s``; its end is found as the root of that.
        """
        target, start = self._line.target, self._piece.t_old
        s = brentq(lambda s: self._piece(s)[TIME] - target, start, late) if self._piece(late)[TIME] > target else late
        before, rows = start, self._rows
        for _ in range(_NEWTON_STEPS):
            rows = self._moved(before, rows, s)
            before = s
            gap, phi = target - float(rows[TIME]), self._line.phi(rows)
            root = sqrt(max(phi * phi + 2.0 * self._curvature(s, rows) * gap, 0.0))
            s += 2.0 * gap / (phi + root) if phi + root > 0.0 else 0.0
        return before, rows

    def _moved(self, before: float, rows: Array, s: float) -> Array:
        if s == before:
            return rows
        return np.asarray(solve_ivp(self._line.rates, (before, s), rows, method=self._method, **self._options).y[:, -1])

    def _curvature(self, s: float, rows: Array) -> float:
        """Return the derivative of phi by ``s``, by a difference."""
        slope = np.asarray(self._line.rates(s, rows))
        small = 1e-6 / max(1.0, float(np.abs(slope).max()))
        ahead, behind = (self._line.phi(rows + sign * small * slope) for sign in (1.0, -1.0))
        return (ahead - behind) / (2.0 * small)
