"""One film of the general model from the reference state to its failure or its rest, load by load."""

from collections.abc import Callable
from math import inf, nan
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq, elementwise

from ..outcomes import Outcome
from .free_energy import CRITICAL_FIELD, State, equations_of_state
from .integrate import REFERENCE, ROWS, TIME, Leg, Loading, follow
from .load_history import LoadHistory

Array = npt.NDArray[np.float64]

_LOOKS = 4  # within a step, for a loss of tension
_LATE = 50.0  # relaxation times after the last change of a load: what remains is slow, for an implicit method


class Loads(NamedTuple):
    """Everything that is prescribed.

    Attributes
    ----------
    direction_1, direction_2 : LoadHistory
        Nominal stress over ``mu_R``, or stretch.
    field : LoadHistory
        Nominal field normalised by the relaxed critical field.
    held : tuple of bool
        For each direction, whether it is the stretch that is prescribed.
    """

    direction_1: LoadHistory
    direction_2: LoadHistory
    field: LoadHistory
    held: tuple[bool, bool]

    def after(self, time: float) -> tuple[float, float, float]:
        """Return stresses or stretches, and the field over ``sqrt(mu_R/eps)``, after any sudden change."""
        return self.direction_1.after(time), self.direction_2.after(time), self.field.after(time) * CRITICAL_FIELD

    def before(self, time: float) -> tuple[float, float, float]:
        """Return them before any sudden change: in the reference state, at time 0."""
        if time == 0.0:
            return float(self.held[0]), float(self.held[1]), 0.0
        return self.direction_1.before(time), self.direction_2.before(time), self.field.before(time) * CRITICAL_FIELD

    def corners(self) -> list[float]:
        """Return the times at which a load changes suddenly or changes its slope, from 0, and that of `_LATE`."""
        times = sorted({0.0, *self.direction_1.times, *self.direction_2.times, *self.field.times})
        return [*times, times[-1] + _LATE]


class Result(NamedTuple):
    """The result of an integration.

    Attributes
    ----------
    legs : list of Leg
        What was integrated, in order of time.
    outcome : Outcome
    end : ndarray of shape (ROWS,)
        The last state: at failure, in the steady state, or where the integration did not converge.
    """

    legs: list[Leg]
    outcome: Outcome
    end: Array


def integrated(loads: Loads, p: float, rtol: float) -> Result:
    """Follow a film until it fails or its dashpot rests under loads that no longer change.

    A film that comes to the instability at a corner of its loads, as far as this accuracy can tell, fails there if it
    fails when the corner is put first, and is unresolved if it does not.

    Parameters
    ----------
    loads : Loads
        What is prescribed.
    p : float
        Modulus ratio less one.
    rtol : float
        Relative error allowed.
    """
    legs: list[Leg] = []
    rows = np.array(REFERENCE)
    corners = loads.corners()
    close: Array | None = None
    for start, stop in zip(corners, [*corners[1:], inf], strict=True):
        old, new = loads.before(start), loads.after(start)
        last = loads.before(stop) if stop < inf else new
        lines = [(Loading(old, new, loads.held), 0.0)] if old != new else []
        for loading, duration in [*lines, (Loading(new, last, loads.held), stop - start)]:
            leg, end = follow(rows, loading, duration, p, rtol)
            rows = end.rows
            legs += [leg] if leg else []
            if end.why != "arrived":
                if close is None or end.why == "not converged":
                    return Result(legs, _outcome(end.why, rows), rows)
                same = end.why == "unstable" and rows[TIME] <= close[TIME] * (1.0 + rtol)
                return Result(legs, _outcome("unstable" if same else "not converged", close), close)
            if end.close and close is None:
                close = rows
    raise AssertionError("the last line has no end in time")


def sampled(result: Result, times: Array) -> Array:
    """Return the states of a film at times, NaN after its failure.

    Parameters
    ----------
    result : Result
        From `integrated`.
    times : ndarray of shape (n,)
        In relaxation times, at least 0.

    Returns
    -------
    ndarray of shape (ROWS, n)
    """
    rows = np.full((ROWS, times.size), np.nan)
    if result.outcome == Outcome.SURVIVES:
        rows[:] = result.end[:, np.newaxis]
    for leg in result.legs:
        within = (times >= leg.times[0]) & (times <= leg.times[-1])
        if within.any():
            rows[:, within] = _sample(leg, times[within])
    rows[TIME] = times
    return rows


def _sample(leg: Leg, times: Array) -> Array:
    """Return the rows of the state at times within a leg."""
    right = np.clip(np.searchsorted(leg.times, times, side="left"), 1, leg.nodes.size - 1)
    ends = leg.nodes[right - 1], leg.nodes[right]

    def ahead(s: Array, times: Array) -> Array:
        return np.asarray(leg.states(s)[TIME] - times)

    found = elementwise.find_root(ahead, ends, args=(times,), tolerances={"xatol": 1e-16, "xrtol": 4e-16})
    nearer = np.where(times - leg.times[right - 1] < leg.times[right] - times, *ends)
    signs_equal = found.status == -1  # at a step's end, up to rounding
    return leg.states(np.where(signs_equal, nearer, found.x))


def tension_loss(result: Result, loads: Loads, p: float, rtol: float) -> float:
    """Return the time at which a stress first becomes compressive, NaN where none does before the film fails.

    Parameters
    ----------
    result : Result
        From `integrated`.
    loads : Loads
        What is prescribed.
    p : float
        Modulus ratio less one.
    rtol : float
        Relative error allowed: a stress that follows from a prescribed stretch is compressive where it is less than
        that of the unrelaxed modulus below 0.
    """
    last = result.end[TIME] if result.outcome != Outcome.SURVIVES else inf
    found = [inf]
    for direction, (history, held) in enumerate(zip(loads[:2], loads.held, strict=True)):
        if held:
            found.append(_slack(result, direction, p, rtol * (1.0 + p)))
        else:
            found.append(history.first_below_zero())
    first = min(found)
    return first if first < inf and first <= last else nan


def _slack(result: Result, direction: int, p: float, least: float) -> float:
    """Return when the stress of a direction whose stretch is prescribed falls below 0, infinity where it does not."""

    def stress(rows: Array) -> Array:
        return np.asarray(equations_of_state(State(*rows[:TIME]), p)[direction])

    for leg in result.legs:
        start, stop = leg.nodes[:-1, np.newaxis], leg.nodes[1:, np.newaxis]
        s = np.append((start + np.linspace(0.0, 1.0, _LOOKS, endpoint=False) * (stop - start)).ravel(), leg.nodes[-1])
        along = stress(leg.states(s))
        compressed = np.flatnonzero(along < -least)
        if compressed.size:
            tense = np.flatnonzero(along[: compressed[0]] >= 0.0)
            if not tense.size:
                return float(leg.times[0])
            ends = s[tense[-1]], s[tense[-1] + 1]
            return float(leg.states(np.array([_zero(leg, stress, *ends)]))[TIME, 0])
    return float(result.end[TIME]) if stress(result.end) < -least else inf  # within a sudden change


def _zero(leg: Leg, stress: Callable[[Array], Array], low: float, high: float) -> float:
    """Return where in a leg a stress vanishes."""
    return float(brentq(lambda s: float(stress(leg.states(np.array([s])))[0]), low, high))


def _outcome(why: str, rows: Array) -> Outcome:
    if why == "unstable":
        return Outcome.FAILS_AT_ONCE if rows[TIME] == 0.0 else Outcome.FAILS_LATER
    return Outcome.SURVIVES if why == "steady state" else Outcome.UNRESOLVED
