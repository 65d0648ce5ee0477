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
    """Return how many of ``count`` terms to keep, at least one, for the rest to sum up to at most ``allowed``."""
    left_out = abs(series[count - 1])
    while count > 1 and left_out <= allowed:
        count -= 1
        left_out += abs(series[count - 1])
    return count


@device
def _largest_of_three(series, last):
    return max(abs(series[last]), abs(series[last - 1]), abs(series[last - 2]))


@device
def tail(series, count):
    """Estimate the error of an interpolant from its last coefficients, falling on as they fell over the last quarter.

    What is left out adds up to the last one over 1 - q, q the ratio of one to the next, and shows up once more in the
    coefficients that are there. Where they fall no more, they are those of independent errors at the nodes.
    """
    quarter = count // 4
    end = _largest_of_three(series, count - 1)
    before = _largest_of_three(series, count - 1 - quarter)
    ratio = (end / (before + 1e-300)) ** (1.0 / quarter)
    return end * min(2.0 / max(1.0 - ratio, 1e-9), 2.0 * np.sqrt(count))
