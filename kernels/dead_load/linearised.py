"""A film at rest under its dead load, soon after the field begins to rise: its linearised equations, in closed form.

(8.14) of docs/theory/dead_load.md.
"""

import math

import numpy as np

from .._jit import device
from ..model import CRITICAL_LOAD
from .slow_manifold import cube_root

# Time since the start over that of relaxation, at most: up to there, the series below has all digits.
LATEST = 1.5
SEARCHES = 3
# 1/3!, 1/4!, ...
_FACTORIALS = tuple(1.0 / math.factorial(j) for j in range(16, 2, -1))


@device
def first_state(rest, p, rate, allowed):
    """Return v and y at a time at which y is in error by about ``allowed`` or less; v = 0 is none of regularity.

    ``rest`` is the stretch without field. With a large p, y is like the power 2/3 of v from a very small v on.
    """
    square = 1.0 / (rest * rest)
    a = 1.0 + 5.0 * square * square * square
    b = 6.0 * p * square
    scale = CRITICAL_LOAD * rate * rate * (a + b) / (36.0 * a * a * a * square * square * square)
    time = LATEST
    for _ in range(SEARCHES):
        # v**2 and y, within some percents, the latter over the time; errors are of the order v**2 y over the time.
        strain = scale * time * time * (a + b * time / (3.0 + 0.75 * time))
        y = 4.0 * a * scale * time / (2.0 + 0.67 * time)
        time = min(LATEST, time * cube_root(allowed / (strain * y)))
    # (time - 1 + exp(-time))/time**2 = 1/2 - time third
    third = 0.0
    for k in range(len(_FACTORIALS)):
        third = _FACTORIALS[k] - time * third
    over = scale * time * time
    return np.sqrt(over * (a + 2.0 * b * time * third)), 4.0 * a * over * (0.5 - time * third)
