"""A load held without end, just above the largest that a relaxed film carries: the time to failure as an integral.

Under a constant load e the unknown x alone says how fast the film flows. With g(x) the load of the relaxed film,
largest at x_m, and ``gap = e - g(x_m)``,

    h = (gap + g(x_m) - g(x))/(p q(x)),    z**3 + h z = 1,    dr/dT = 2 h,    dr/dx = D_x/(de/dr),

so that T is the integral of D_x/(-2 h de/dr) over x, from the state at the start to D = 0. 1/h has poles next to the
real axis, at x_m +- i s; ``x = x_m + s sinh(theta)`` takes them to a distance of pi/2 whatever the gap.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import device
from .law import Law

EPSILON = 2.0**-52
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
# Length in theta of the longest part with a rule of its own. Derived: 16 points leave 3.4**-32 of the pole at pi/2.
LONGEST = 2.0
# Times that the parts are halved, until two results agree.
HALVINGS = 6


def make_time_held(law: Law) -> Callable[..., Any]:
    """Make ``time_held(x, p, sigma, field, top, tolerance) -> time, r, error``, r being that at the instability.

    ``top`` is the unknown x_m. The error is relative to the time.
    """
    excess, lacking, curvature, along = law.excess, law.lacking, law.curvature, law.along

    @device
    def state(d, gap, p, sigma, top):
        """Return D_x, -de/dr, h, r at x = top + d."""
        x = top + d
        return along(x, (gap + lacking(sigma, top, d)) / p, p, sigma)

    @device
    def time_held(x, p, sigma, field, top, tolerance):
        gap = excess(sigma, field, top)
        # The instability, D = 0, between no u at all and the start.
        low, high = -top * (1.0 - 1e-6), x - top
        below, _, _, _ = state(low, gap, p, sigma, top)
        above, _, _, _ = state(high, gap, p, sigma, top)
        if not (below < 0.0 and above > 0.0):
            return 0.0, 1.0, math.inf
        side = 0
        for _ in range(200):
            middle = low + (high - low) * below / (below - above)
            value, _, _, _ = state(middle, gap, p, sigma, top)
            if value <= 0.0:
                low, below = middle, value
                above *= 0.5 if side < 0 else 1.0
                side = -1
            else:
                high, above = middle, value
                below *= 0.5 if side > 0 else 1.0
                side = 1
            if high - low <= 4.0 * EPSILON * top or value == 0.0:
                break
        end = middle
        _, _, _, r = state(end, gap, p, sigma, top)
        s = np.sqrt(gap / curvature(sigma, top))
        start = math.asinh((x - top) / s)
        length = start - math.asinh(end / s)
        parts = 1 + np.int64(length / LONGEST)
        coarse, fine = 0.0, 0.0
        for _ in range(HALVINGS):
            half = 0.5 * length / parts
            total = 0.0
            for part in range(parts):
                for j in range(_NODES.size):
                    theta = start - half * (2.0 * part + 1.0 + _NODES[j])
                    stiff, pull, h, _ = state(s * math.sinh(theta), gap, p, sigma, top)
                    total += _WEIGHTS[j] * s * math.cosh(theta) * stiff / (2.0 * h * pull)
            coarse, fine = fine, half * total
            parts *= 2
            if abs(fine - coarse) <= tolerance * fine:
                break
        return fine, r, abs(fine - coarse) / fine + 16.0 * EPSILON

    return time_held
