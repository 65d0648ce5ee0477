"""Many cycles from few: the change of r over a cycle interpolated over a range of r, and the map iterated there.

A cycle takes r to P(r) = r + d(r), and d is a regular function of r below the largest r whose cycle is survived. From
its values at the Chebyshev points of a range [0, width], counted from the r reached, follow the cycles within it: by
iteration of the interpolant or, where d hardly changes from one cycle to the next, by the flow s' = v(s) whose state
after a unit of time is that after a cycle,

    v = d - d d'/2 + d d'**2/3 + d**2 d''/12 + ...,    cycles from a to b = integral ds/v from a to b.

The terms left out are of the order of d'**3 and d d' d'' relative to d.
"""

import math

import numpy as np

from .._jit import device

NODES = 16
# Chebyshev points of the first kind on [0, 1], ascending; and the matrix from values there to coefficients.
_ANGLES = (2.0 * np.arange(NODES) + 1.0) * np.pi / (2.0 * NODES)
POINTS = np.sin(0.5 * _ANGLES) ** 2
_TO_SERIES = np.array([np.cos(k * (np.pi - _ANGLES)) * (2.0 if k else 1.0) / NODES for k in range(NODES)])
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

# Rows of the coefficients: of d and of its first two derivatives by r.
CHANGE, SLOPE, BEND = range(3)


@device
def fit(values, width, series):
    """Fill ``series`` (3, NODES) from ``values`` of d at ``width * POINTS``; the size of what it leaves out of d."""
    for k in range(NODES):
        total = 0.0
        for j in range(NODES):
            total += _TO_SERIES[k, j] * values[j]
        series[CHANGE, k] = total
    for row in (SLOPE, BEND):
        # Derivatives of Chebyshev series, by recurrence.
        series[row, NODES - 1] = 0.0
        above, own = 0.0, 0.0
        for k in range(NODES - 2, -1, -1):
            above, own = own, above + 2.0 * (k + 1.0) * series[row - 1, k + 1]
            series[row, k] = own * (2.0 / width)
        series[row, 0] *= 0.5
    return abs(series[CHANGE, NODES - 1]) + abs(series[CHANGE, NODES - 2])


@device
def evaluate(series, row, x):
    """Return the sum of a series at x in [-1, 1]."""
    one, two = 0.0, 0.0
    for k in range(NODES - 1, 0, -1):
        one, two = 2.0 * x * one - two + series[row, k], one
    return x * one - two + series[row, 0]


@device
def _flow(series, x):
    """Return 1/v, and d, at x."""
    d, slope, bend = evaluate(series, CHANGE, x), evaluate(series, SLOPE, x), evaluate(series, BEND, x)
    return (1.0 + 0.5 * slope - (slope * slope + d * bend) / 12.0) / d, d


@device
def advance(series, width, floor, most):
    """Go through the cycles that end before the last of the points: those that start up to there are survived.

    Parameters
    ----------
    series : (3, NODES) ndarray
        Of d, see `fit`.
    width, floor : float
        Where d is no larger than ``floor`` there is no cycle to count, and the way ends.
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
    scale, end = 2.0 / width, width * POINTS[NODES - 1]
    while s < end and cycles < most and singles < SINGLES:
        x = scale * s - 1.0
        d = evaluate(series, CHANGE, x)
        if not d > floor:
            break
        slope, bend = evaluate(series, SLOPE, x), evaluate(series, BEND, x)
        uneven = np.sqrt(slope * slope + abs(d * bend))
        step = min(PART * d / (uneven + 1e-300), end - s)
        gentle = uneven <= GENTLE
        while gentle and step > FEW * d:
            total, late = 0.0, 0.0
            for j in range(_GAUSS.size):
                inverse, own = _flow(series, x + scale * step * _GAUSS[j])
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
            inverse, other = _flow(series, x + scale * step)
            v, part = 1.0 / inverse, total - whole
            tilt = evaluate(series, SLOPE, x + scale * step)
            turn = tilt * tilt + other * evaluate(series, BEND, x + scale * step)
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
