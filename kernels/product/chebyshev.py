"""Chebyshev interpolation as sums with fixed matrices: values at nodes -> coefficients."""

import numpy as np

from .._jit import device

# Numbers of nodes, whole blocks of lanes, each tried when the last was not enough.
LADDER = (16, 32, 48, 64, 96)
MOST_TERMS = LADDER[-1]
# Coefficients are stored in groups, the last one filled up with zeros.
GROUP = 4


def _nodes(count: int) -> np.ndarray:
    return np.cos(np.pi * (np.arange(count) + 0.5) / count)


def _to_series(count: int) -> np.ndarray:
    """Matrix (node, degree): the interpolant's coefficients are ``values @ matrix``."""
    matrix = 2.0 / count * np.polynomial.chebyshev.chebvander(_nodes(count), count - 1)
    matrix[:, 0] *= 0.5
    return matrix


NODES = np.concatenate([_nodes(count) for count in LADDER])
FIRST_NODE = (0, *(int(end) for end in np.cumsum(LADDER)))
TO_SERIES = np.concatenate([_to_series(count).ravel() for count in LADDER])
FIRST_ENTRY = (0, *(int(end) for end in np.cumsum(np.square(LADDER))))


@device
def needed_terms(series, count, allowed):
    """Return how many of ``count`` terms to keep for what is left out to sum up to at most ``allowed``; at least one."""
    left_out = abs(series[count - 1])
    while count > 1 and left_out <= allowed:
        count -= 1
        left_out += abs(series[count - 1])
    return count


@device
def tail(series, count):
    """Estimate the error of an interpolant from its last coefficients."""
    return 3.0 * max(abs(series[count - 1]), abs(series[count - 2]), abs(series[count - 3]))
