"""Many cycles from few: the change of r over a cycle interpolated over a range of r, and the map iterated there.

A cycle takes r to P(r) = r + d(r), and d is a regular function of the root of R - r, R being the largest r whose cycle
is survived. Along a range [0, width] of s, counted from the r reached, this root is the variable of a Chebyshev series,
from the values of d at its points. From the series follow the cycles in the range: by iteration or, where d hardly
changes from one cycle to the next, by the flow s' = v(s) whose state after a unit of time is that after a cycle,

    v = d - d d'/2 + d d'**2/3 + d**2 d''/12 + ...,    cycles from a to b = integral ds/v from a to b.

The terms left out are of the order of d'**3 and d d' d'' relative to d.
"""

import math

import numpy as np
from numpy.typing import NDArray

from .._jit import device

# Numbers of points in a range: for few cycles at loose tolerances, and for others.
COUNTS = (10, 15)
NODES = max(COUNTS)


def _points_of(count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Chebyshev points of the first kind on [0, 1], ascending; and the matrix from values there to coefficients."""
    angles = (2.0 * np.arange(count) + 1.0) * np.pi / (2.0 * count)
    to_series = [np.cos(k * (np.pi - angles)) * (2.0 if k else 1.0) / count for k in range(count)]
    points, matrix = np.ones(NODES), np.zeros((NODES, NODES))
    points[:count] = np.sin(0.5 * angles) ** 2
    matrix[:count, :count] = to_series
    return points, matrix


POINTS = np.array([_points_of(count)[0] for count in COUNTS])
_TO_SERIES = np.array([_points_of(count)[1] for count in COUNTS])
_GAUSS, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_GAUSS = 0.5 * (1.0 + _GAUSS)
_WEIGHTS = 0.5 * _WEIGHTS

# Slope of d, and root of d d'', below which the flow is used. Derived: the terms left out are then 1e-12 of d.
GENTLE = 3e-4
# Length of a step of the flow, over the distance of the nearest zero of d in the plane of complex r, estimated as for a
# parabola. Derived: eight Gauss points then leave 1e-15.
PART = 0.5
# Cycles in a step of the flow, at least.
FEW = 8.0

# Cycles iterated one by one in a range, at most: some milliseconds. Where more are left the next range begins there.
SINGLES = 100_000

# What each of the coefficients left out is taken to be, over the one before. Measured: errors are within what follows
# where R is wrong by half of what a range leaves of the way to it, or by a twentieth towards the range.
DECAY = 0.4

# Rows of the coefficients: of d and of its first two derivatives by the variable of the series.
CHANGE, SLOPE, BEND = range(3)


@device
def place(part, curve):
    """Return where in a range, as a share of it, a part of the way of the variable of the series lies.

    ``curve`` is the width of the range over the distance of its start to R: 0 where the variable is r itself.
    """
    part = part / (1.0 + np.sqrt(1.0 - curve))
    return part * (2.0 - curve * part)


@device
def fit(values, choice, series):
    """Fill ``series`` (3, NODES) from ``values`` of d at the points of a choice; what it leaves out of d, at most."""
    count = COUNTS[choice]
    for k in range(count):
        total = 0.0
        for j in range(count):
            total += _TO_SERIES[choice, k, j] * values[j]
        series[CHANGE, k] = total
    for row in (SLOPE, BEND):
        # Derivatives of Chebyshev series, by recurrence.
        series[row, count - 1] = 0.0
        above, own = 0.0, 0.0
        for k in range(count - 2, -1, -1):
            above, own = own, above + 2.0 * (k + 1.0) * series[row - 1, k + 1]
            series[row, k] = own
        series[row, 0] *= 0.5
    # As if each of the last three were followed by such ones, since one or two may be small by chance. Interpolation
    # adds the coefficients left out to those in the series as well.
    last, other, third = abs(series[CHANGE, count - 1]), abs(series[CHANGE, count - 2]), abs(series[CHANGE, count - 3])
    return 2.0 * (last + DECAY * (other + DECAY * third)) * DECAY / (1.0 - DECAY)


@device
def evaluate(series, row, choice, x):
    """Return the sum of a series at x in [-1, 1]."""
    one, two = 0.0, 0.0
    for k in range(COUNTS[choice] - 1, 0, -1):
        one, two = 2.0 * x * one - two + series[row, k], one
    return x * one - two + series[row, 0]


@device
def change_at(series, choice, width, curve, s):
    """Return d at s."""
    share = s / width
    part = share * (1.0 + np.sqrt(1.0 - curve)) / (1.0 + np.sqrt(1.0 - curve * share))
    return evaluate(series, CHANGE, choice, 2.0 * part - 1.0)


@device
def all_at(series, choice, width, curve, s):
    """Return d, d' and d'' at s."""
    share = s / width
    whole, root = 1.0 + np.sqrt(1.0 - curve), np.sqrt(1.0 - curve * share)
    x = 2.0 * share * whole / (1.0 + root) - 1.0
    of_share = whole / (root * width)  # dx/ds
    first, second = evaluate(series, SLOPE, choice, x), evaluate(series, BEND, choice, x)
    bend = second * of_share * of_share + first * of_share * curve / (2.0 * root * root * width)
    return evaluate(series, CHANGE, choice, x), first * of_share, bend


@device
def _flow(d, slope, bend):
    """Return 1/v."""
    return (1.0 + 0.5 * slope - (slope * slope + d * bend) / 12.0) / d


@device
def advance(series, choice, width, curve, floor, most):
    """Go through the cycles that end before the last of the points: those that start up to there are survived.

    Parameters
    ----------
    series : (3, NODES) ndarray
        Of d, see `fit`.
    choice : int
        Of the number of points.
    width, curve, floor : float
        See `place`. Where d is no larger than ``floor`` there is no cycle to count, and the way ends.
    most : float
        Cycles at most.

    Returns
    -------
    s : float
        Where the next cycle starts: below the last point, so that this one is survived as well.
    cycles : float
    grown : float
        What an error at the start has become, over itself.
    gathered : float
        The error at the end over an error in d, the same in every cycle.
    singles : int
        How many cycles were iterated one by one.
    """
    s, cycles, grown, gathered, singles = 0.0, 0.0, 1.0, 0.0, 0
    end = width * place(POINTS[choice, COUNTS[choice] - 1], curve)
    while s < end and cycles < most and singles < SINGLES:
        d, slope, bend = all_at(series, choice, width, curve, s)
        if not d > floor:
            break
        uneven = np.sqrt(slope * slope + abs(d * bend))
        step = min(min(PART * d / (uneven + 1e-300), end - s), PART * (width / (curve + 1e-300) - s))
        gentle = uneven <= GENTLE
        while gentle and step > FEW * d:
            total, late = 0.0, 0.0
            for j in range(_GAUSS.size):
                own, tilt, turn = all_at(series, choice, width, curve, s + step * _GAUSS[j])
                inverse = _flow(own, tilt, turn)
                total += _WEIGHTS[j] * inverse
                late += _WEIGHTS[j] * inverse / own
            total, late = total * step, late * step
            if not (total > 0.0 and total < math.inf):
                gentle = False
            elif total > most - cycles:
                step = 0.5 * step
            else:
                break
        if gentle and step > FEW * d:
            # To the end of the step, and back by the part of a cycle that is too much.
            whole = math.floor(total)
            other, tilt, turn = all_at(series, choice, width, curve, s + step)
            v, part = 1.0 / _flow(other, tilt, turn), total - whole
            turn = tilt * tilt + other * turn
            back = part * v * (1.0 - 0.5 * part * (tilt - 0.5 * turn) + part * part * turn / 6.0)
            s = s + (step - back)
            gathered = other * (gathered / d + late)
            grown = grown * (other / d)
            cycles += whole
        else:
            if s + d >= end:
                break
            s += d
            gathered = gathered * (1.0 + slope) + 1.0
            grown = grown * (1.0 + slope)
            cycles += 1.0
            singles += 1
    return s, cycles, grown, gathered, singles
