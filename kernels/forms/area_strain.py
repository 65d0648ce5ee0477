"""The ramp as one scalar equation that is regular from the unloaded film to the instability and beyond.

Independent variable ``v = sqrt(lambda**2 - 1)``, the square root of the area strain; state ``y = 1 - z`` with
``z = (xi/lambda)**2``. Under ``E = k T`` time is no state, ``k T = sqrt(e/e_C)`` follows from the load

    e = u - u**4 + p u**2 h,    u = 1/(1 + v**2),    h = 1/z - z**2,

and with ``e' = de/dT = 2 k sqrt(e_C e)`` and ``H = 1/z**2 + 2 z`` equations (23) and (26) become

    dy/dv = 2 v u (z e' + 2 h u**2 (1 - 4 u**3 + 2 p u h)) / (e' + 2 p u**3 H h),
    D = 4 u**3 - 1 + p u (3 z**2 - h).

The right-hand side has no singularity at D = 0, and the denominator none at all: both its terms are positive.
h comes from y without cancellation, which a slow ramp needs, where y is of the order of k.
"""

import numpy as np

from .._jit import device
from ..model import CRITICAL_U, deficit

# Area strain of the relaxed film under its largest load.
CRITICAL_STRAIN = 4.0 ** (1.0 / 3.0) - 1.0
# Added to e' so that dy/dv has its limit, zero, at v = 0, where the quotient is 0/0; slower ramps than
# `rising.driver.SLOWEST`, on which it would count, are not solved.
SMALLEST_LOAD_RATE = 1e-150
# Relative step of the difference that gives df/dy: an error of its order, rounding of 1e-11, where two digits suffice.
DIFFERENCE_STEP = 1e-5


@device
def excess_and_flow(v, y, p):
    """Load in excess of e_C, the largest one of a relaxed film, with ``e - e_C`` accurate relative to itself near it.

    With u* = 4**(-1/3) and d = u - u*, ``u - u**4 = e_C - d**2 (u**2 + 2 u u* + 3 u***2)``. A film that hardly relaxes
    fails within p of e_C, and whether it reaches a given field is decided there.

    Returns
    -------
    e - e_C, h, u, d : float
    """
    area = 1.0 + v * v
    z = 1.0 - y
    inverse = 1.0 / (area * z)
    u = z * inverse
    h = y * (1.0 + z + z * z) * (area * inverse)
    d = (CRITICAL_STRAIN - v * v) * (CRITICAL_U * u)
    return p * u * u * h - deficit(u, d), h, u, d


@device
def stiffness(y, p, h, u, d):
    """D = -de/du, with ``4 u**3 - 1 = 4 (u**3 - u***3)``."""
    z = 1.0 - y
    return 4.0 * d * (u * (u + CRITICAL_U) + CRITICAL_U * CRITICAL_U) + p * u * (3.0 * z * z - h)


@device
def rhs(v, y, p, speed):
    """dy/dv; ``speed`` is 2 k sqrt(e_C), so that e' = speed * sqrt(e).

    Numerator and denominator multiplied by (1 + v**2)**5 z**3 leave one division and one square root.
    """
    strain = v * v
    area = 1.0 + strain
    square = area * area
    cube = square * area
    z = 1.0 - y
    z2 = z * z
    less = y * (1.0 + z + z2)  # 1 - z**3
    bend = p * less * square
    rate = (speed * np.sqrt((strain * (square + area + 1.0) * z + bend) * z) + SMALLEST_LOAD_RATE) * cube * z2
    rise = z * (rate + 2.0 * less * ((cube - 4.0) * z + 2.0 * bend))
    return 2.0 * v * rise / (area * (rate + 2.0 * bend * (1.0 + 2.0 * z2 * z)))


@device
def jacobian(v, y, f, p, speed):
    """df/dy of dy/dv = f, by a forward difference; two digits suffice to carry an estimated error along."""
    return (rhs(v, y + DIFFERENCE_STEP * y, p, speed) - f) / (DIFFERENCE_STEP * y + 1e-300)


@device
def event(v, y, rate_of_y, p, speed):
    """Everything that locating an event takes at a state.

    Returns
    -------
    e - e_C, D, dD/dv, K : float
        Load in excess of e_C, stiffness, its derivative along the solution, and K = (de/dv)/D, which is positive.
    """
    excess, h, u, d = excess_and_flow(v, y, p)
    z = 1.0 - y
    u2 = u * u
    H = 1.0 / (z * z) + 2.0 * z
    du = -2.0 * v * u2
    change = (12.0 * u2 + p * (3.0 * z * z - h)) * du - p * u * (6.0 * z + H) * rate_of_y
    load_rate = speed * np.sqrt(u2 * (v * v * (1.0 + u + u2) + p * h)) + SMALLEST_LOAD_RATE
    return excess, stiffness(y, p, h, u, d), change, -du * load_rate / (load_rate + 2.0 * p * u2 * u * H * h)
