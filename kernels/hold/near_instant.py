"""Near-instant failure, below the field at which a film fails at once: the integral of `quadrature.py` uncancelled.

The interval in U is short and the stiffness D, zero at its end, small all along
it, a difference of terms of order one. With U1 and z1 at the end and q = z**2 + z z1 + z1**2 + h,

    D = (U - U1) K,    K = 3/4 (U**2 + U U1 + U1**2 + f**2/(U U1)) + 3 P z**2
                           - 3/4 U1 z1 (z + z1) ((U + U1) (1 - 3 f**2/(U U1)**2) + 4/(U U1))/q,

and what m exceeds f**2 by, the gap, is known without an error. The poles are 60 half intervals away, or more.
"""

from .._jit import device
from ..model import CRITICAL_U
from .flow_cubic import flow_root
from .gauss_legendre import NODES, OFFSETS

# Gap, divided by p = m - 1, below which this form is used. Derived (docs/theory/near_instant.md): the poles are more
# than 60 half intervals away; above it the general integral is accurate to 1e-13.
LARGEST_GAP = 1e-3
_RULE = 2  # of `NODE_COUNTS`, eight nodes: an error of 60**-16


@device
def state_at_failure(f, p, gap):
    """Return 1 - 1/r and U - 1 at the instability, accurate relative to themselves.

    b = 1 - 1/r solves ``b (p (1 - b)**2 (m + A) (m**2 + A**2) + (2 - b) (p m**3 + G)) = m G``, which is (23) at (25),
    with ``G = m**3 - f**6``; each iteration gains a factor 1/b, at least 1000.
    """
    m = 1.0 + p
    square = f * f
    G = gap * (m * m + m * square + square * square)
    b = 0.0
    for _ in range(7):
        A = m - p * b
        left = 1.0 - b
        b = m * G / (p * left * left * (m + A) * (m * m + A * A) + (2.0 - b) * (p * m * m * m + G))
    return b, (p * b - gap) / (m - p * b)


@device
def time_to_failure(f, p, b, end, start):
    """Time to failure, the integral from U - 1 = ``start``, just after the sudden field, to ``end``."""
    P = p * CRITICAL_U
    square = f * f
    U1 = 1.0 + end
    z1 = CRITICAL_U * U1 / (1.0 - b)
    half = 0.5 * (start - end)
    total = 0.0
    for j in range(OFFSETS[_RULE], OFFSETS[_RULE + 1]):
        above = half * (1.0 + NODES[0, j])  # U - U1
        height = end + above
        U = 1.0 + height
        # n = U**4 - 4 U + 3 f**2, of terms that are none of them negative
        n = height * height * (U * (U + 2.0) + 3.0) + 3.0 * (f - 1.0) * (f + 1.0)
        h = n / (4.0 * P * U * U)
        z = flow_root(h)
        both = 1.0 / (U * U1)
        q = z * z + z * z1 + z1 * z1 + h
        bend = (U + U1) * (1.0 - 3.0 * square * both * both) + 4.0 * both
        K = 0.75 * (U * U + U * U1 + U1 * U1 + square * both - U1 * z1 * (z + z1) * bend / q) + 3.0 * P * z * z
        total += NODES[1, j] * above * K * z * z / (U * (3.0 - 2.0 * h * z) * n)
    return 2.0 / CRITICAL_U * half * total
