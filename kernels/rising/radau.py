"""Radau IIA steps of order 5 of the scalar form of `forms/area_strain.py` over a block of lanes: implicit, L-stable.

Hairer and Wanner, Solving Ordinary Differential Equations II, sections IV.5 and IV.8. For one equation the stage
equations are three, and Newton's method with the Jacobian of every stage needs no more than Cramer's rule.
"""

import math

import numpy as np

from .._jit import device
from ..forms.area_strain import jacobian, rhs
from .free_film import FREE
from .state import JACOBIAN, NEW, SLOPES, SPEED, TRIAL, AreaMethod, P, V, Y

ROOT6 = math.sqrt(6.0)
C1, C2 = (4.0 - ROOT6) / 10.0, (4.0 + ROOT6) / 10.0
A11, A12, A13 = (88.0 - 7.0 * ROOT6) / 360.0, (296.0 - 169.0 * ROOT6) / 1800.0, (-2.0 + 3.0 * ROOT6) / 225.0
A21, A22, A23 = (296.0 + 169.0 * ROOT6) / 1800.0, (88.0 + 7.0 * ROOT6) / 360.0, (-2.0 - 3.0 * ROOT6) / 225.0
A31, A32, A33 = (16.0 - ROOT6) / 36.0, (16.0 + ROOT6) / 36.0, 1.0 / 9.0
# Error estimate of order 3: one more, explicit stage, filtered by the real eigenvalue of the inverse of A.
E1, E2, E3 = -(13.0 + 7.0 * ROOT6) / 3.0, (-13.0 + 7.0 * ROOT6) / 3.0, -1.0 / 3.0
EIGENVALUE = 30.0 / (6.0 + 81.0 ** (1.0 / 3.0) - 9.0 ** (1.0 / 3.0))

# Newton's method from z = 0. A fixed number keeps the lanes together; what has not converged by then, which the last
# change says, is an error of the step (`_error`), so that the step is shortened.
ITERATIONS = 7

# Fraction of the estimate, which is two orders below the method, that bounds the error: measured (studies/tolerance).
OVERESTIMATE = 0.05

# An L-stable method damps what grows, too, where its step is long: past the fold of the slow manifold it would stay
# on the branch that has become unstable. Steps over which an error would grow more than by exp of this are refused:
# below `EIGENVALUE`, 3.6, where the filter of the estimate has its pole (tests/kernels/test_radau.py).
LARGEST_GROWTH = 0.5

# Rows behind those of `rising/state.py`: increments of the stages, the last change of the third, the estimated error.
Z1, Z2, Z3 = SLOPES + 2, SLOPES + 3, SLOPES + 4
CHANGE = SLOPES + 5
ESTIMATE = SLOPES + 6
LAST = SLOPES + 1


@device
def _iterate(w, i):
    """One iteration of Newton's method on z = h A f(y + z)."""
    h, v, y, p, speed = w[TRIAL, i], w[V, i], w[Y, i], w[P, i], w[SPEED, i]
    z1, z2, z3 = w[Z1, i], w[Z2, i], w[Z3, i]
    f1 = rhs(v + C1 * h, y + z1, p, speed)
    f2 = rhs(v + C2 * h, y + z2, p, speed)
    f3 = rhs(v + h, y + z3, p, speed)
    j1 = h * jacobian(v + C1 * h, y + z1, f1, p, speed)
    j2 = h * jacobian(v + C2 * h, y + z2, f2, p, speed)
    j3 = h * jacobian(v + h, y + z3, f3, p, speed)
    r1 = h * (A11 * f1 + A12 * f2 + A13 * f3) - z1
    r2 = h * (A21 * f1 + A22 * f2 + A23 * f3) - z2
    r3 = h * (A31 * f1 + A32 * f2 + A33 * f3) - z3
    m11, m12, m13 = 1.0 - A11 * j1, -A12 * j2, -A13 * j3
    m21, m22, m23 = -A21 * j1, 1.0 - A22 * j2, -A23 * j3
    m31, m32, m33 = -A31 * j1, -A32 * j2, 1.0 - A33 * j3
    c11, c12, c13 = m22 * m33 - m23 * m32, m13 * m32 - m12 * m33, m12 * m23 - m13 * m22
    c21, c22, c23 = m23 * m31 - m21 * m33, m11 * m33 - m13 * m31, m13 * m21 - m11 * m23
    c31, c32, c33 = m21 * m32 - m22 * m31, m12 * m31 - m11 * m32, m11 * m22 - m12 * m21
    scale = 1.0 / (m11 * c11 + m12 * c21 + m13 * c31)
    change = scale * (c31 * r1 + c32 * r2 + c33 * r3)
    w[Z1, i] = z1 + scale * (c11 * r1 + c12 * r2 + c13 * r3)
    w[Z2, i] = z2 + scale * (c21 * r1 + c22 * r2 + c23 * r3)
    w[Z3, i] = z3 + change
    w[CHANGE, i] = change


@device
def _attempt(w):
    lanes = w.shape[1]
    for i in range(lanes):
        w[Z1, i] = 0.0
        w[Z2, i] = 0.0
        w[Z3, i] = 0.0
    for _ in range(ITERATIONS):
        for i in range(lanes):
            _iterate(w, i)
    for i in range(lanes):
        h = w[TRIAL, i]
        w[NEW, i] = w[Y, i] + w[Z3, i]
        w[LAST, i] = rhs(w[V, i] + h, w[NEW, i], w[P, i], w[SPEED, i])
        explicit = h * w[SLOPES, i] + E1 * w[Z1, i] + E2 * w[Z2, i] + E3 * w[Z3, i]
        grows = h * max(w[JACOBIAN, i], jacobian(w[V, i] + h, w[NEW, i], w[LAST, i], w[P, i], w[SPEED, i]))
        # Filtered by the end that is damped less: where a slow ramp's film leaves the slow manifold within the step,
        # the damping at its beginning would filter away the error that grows at its end.
        w[ESTIMATE, i] = abs(explicit / (EIGENVALUE - grows)) if grows < LARGEST_GROWTH else math.inf


@device
def _error(w, i, size):
    # As it is, of order h**4: where the problem is stiff, no power of it follows the error of the method. What
    # Newton's method left counts in full. Where y takes off from the slow manifold, its errors grow with it: they
    # count against the smaller y of the two ends.
    return (OVERESTIMATE * w[ESTIMATE, i] + abs(w[CHANGE, i])) / min(size, w[Y, i] if w[Y, i] > 0.0 else size)


@device
def _root(x):
    return np.sqrt(np.sqrt(x))


# The tolerance factor 0.2 is measured (studies/tolerance), as that of the explicit methods.
RADAU5 = AreaMethod(_attempt, _error, _root, False, 0.2, LAST, ESTIMATE + 1, FREE)
