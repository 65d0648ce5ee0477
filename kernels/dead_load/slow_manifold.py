"""Slow manifold of a film under a dead load: y = 1 - z there, and where a slow ramp may enter it.

(8.13) of docs/theory/dead_load.md; `rising/start.py` has that of a free film.
"""

import numpy as np

from .._jit import device
from ..hold.gauss_legendre import NODES, OFFSETS
from ..model import CRITICAL_LOAD
from .film import curvature, relaxed_stiffness

SEARCHES = 3
_THIRD = np.float32(1.0 / 3.0)
# Two thirds of the bits of 1, less what makes errors of either sign equal.
_BITS_OF_ONE = np.float32(709921077)


@device
def damping_of(rtol):
    """Damping of the error of the start of a slow ramp."""
    return 4.0 - np.log(rtol)


@device
def damping_from(w_t, sigma, p, load_t, d):
    """Return how far an error of y has decayed, as a logarithm, when the relaxed film comes from d to its largest load.

    Errors decay at ``nu = 6 u q/(q + 3 p u)``, q = K d/2, and ``dT = 2 w q dw/e'`` with the rate e' of the load; at a
    rate of one, inversely proportional to it.
    """
    total = 0.0
    for j in range(OFFSETS[0], OFFSETS[1]):
        s = 0.5 * d * (1.0 + NODES[0, j])
        x = w_t + s
        u = x * x
        q = 0.5 * s * relaxed_stiffness(s, w_t, sigma)
        G, _ = curvature(s, w_t, 1.0, 1.0, sigma)
        load = max(load_t - s * s * G, 1e-300)
        total += NODES[1, j] * 6.0 * u * x * q * q / ((q + 3.0 * p * u) * np.sqrt(CRITICAL_LOAD * load))
    return 0.5 * d * total


@device
def cube_root(x):
    """Return the cube root within 4 %, without a root: a third of the exponent, by the bits in single precision."""
    bits = np.float32(min(max(x, 1e-37), 1e37)).view(np.int32)
    return np.float64(np.int32(np.float32(bits) * _THIRD + _BITS_OF_ONE).view(np.float32))


@device
def _roughly(w_t, sigma, p, load_t, d):
    """Return what `damping_from` does, less by up to a half: q proportional to d, and all else as it is half-way."""
    x = w_t + 0.5 * d
    u = x * x
    q = 0.5 * d * relaxed_stiffness(0.5 * d, w_t, sigma)
    G, _ = curvature(0.5 * d, w_t, 1.0, 1.0, sigma)
    load = load_t - 0.25 * d * d * G
    return 2.0 * d * u * x * q * q / ((0.67 * q + 3.0 * p * u) * np.sqrt(CRITICAL_LOAD * load))


@device
def distance_at(w_t, sigma, p, load_t, relaxed, rate, damping):
    """Return roughly the d from which on an error decays by exp(-damping); at most ``relaxed``, that without field."""
    d = 0.5 * relaxed
    for _ in range(SEARCHES):
        decay = _roughly(w_t, sigma, p, load_t, d) / rate
        d = min(d * cube_root(damping / decay), relaxed)
    return d


@device
def slow_manifold(w_t, sigma, load_t, rate, d):
    """Return y on the slow manifold, to leading order in the rate; u, q, the load's rate and G there."""
    q = 0.5 * d * relaxed_stiffness(d, w_t, sigma)
    G, _ = curvature(d, w_t, 1.0, 1.0, sigma)
    u = (w_t + d) * (w_t + d)
    load_rate = 2.0 * rate * np.sqrt(CRITICAL_LOAD * max(load_t - d * d * G, 0.0))
    return load_rate / (6.0 * u * u * q), u, q, load_rate, G
