"""What a cell takes from field and modulus ratio alone: where a film under a held field fails, or its steady state."""

import math

import numpy as np

from .._jit import Kernel, device
from ..hold import quadrature
from ..model import CRITICAL_LOAD, CRITICAL_U, relative_u

# Rows: the field in Ec; E, the load over that of Ec; the root of E, and one over it, NaN without E; both stretches at
# the instability under this field, NaN where none is reached; the stretch of a film that survives, NaN of one that
# does not.
FIELD = 0
EXCESS = 1
ROOT = 2
INVERSE = 3
STRETCH = 4
INTERNAL = 5
FINAL = 6
ROWS = 7


@device
def _fill(table, first, width, field, modulus_ratio):
    p = modulus_ratio - 1.0
    g = (field - 1.0) * (field + 1.0)
    for row in range(ROWS):
        table[first + row * width] = math.nan
    table[first + FIELD * width] = field
    table[first + EXCESS * width] = CRITICAL_LOAD * g
    if field < 1.0 or (field == 1.0 and p > 0.0):
        # Relaxed, lambda = xi: (23) is that of a film with mu_R alone, its margin 1 - field**2.
        table[first + FINAL * width] = 1.0 / np.sqrt(CRITICAL_U * (1.0 + relative_u(-g)))
        return
    root = np.sqrt(CRITICAL_LOAD * g)
    table[first + ROOT * width] = root
    table[first + INVERSE * width] = 1.0 / root
    if p > 0.0 and field * field < modulus_ratio:
        a = quadrature.inverse_internal(field, p)
        table[first + STRETCH * width] = 1.0 / np.sqrt(CRITICAL_U * (1.0 + (g - p * a) / (1.0 + p * a)))
        table[first + INTERNAL * width] = 1.0 / np.sqrt(a)


def make_holds() -> Kernel:
    """Make the compiled ``holds(field, modulus_ratio, width, table)``.

    ``field``, ``modulus_ratio`` are (outer, inner); the flat ``table`` is filled in, as (outer, blocks, ROWS, width),
    the last block filled up with the last column.
    """

    def holds(field, modulus_ratio, width, table):
        outer, inner = field.shape
        first = 0
        for o in range(outer):
            for begin in range(0, inner, width):
                for i in range(width):
                    k = min(begin + i, inner - 1)
                    _fill(table, first + i, width, field[o, k], modulus_ratio[o, k])
                first += ROWS * width

    return Kernel(holds, "float64[:, ::1], float64[:, ::1], int64, float64[::1]")
