"""Near-instant failure under a dead load: the integral of `hold.py` where the field is almost that of failure at once.

The interval in d is short and the stiffness D, zero at its end, small all along it, a difference of terms of order
one. With w_1, z_1 at the end and ``[f] = (f(w) - f(w_1))/(w - w_1)``, ``D = (w - w_1) K`` and

    K = 8 [w**6] + 3 sigma + 6 p (z**2 [u] + u_1 (z + z_1) [z]) - 2 [N/u],
    [z] = -z_1 [h]/(z**2 + z z_1 + z_1**2 + h),    p h = N/u**2,    [N] = -[u] + [u**4] + sigma [w**3].
"""

from .._jit import device
from ..hold.gauss_legendre import NODES, OFFSETS
from .film import curvature
from .hold import flow_root

# Gap of the load, e_i - e, divided by p, below which this form is used, as without a dead load.
LARGEST_GAP = 1e-3
_RULE = 4  # of `NODE_COUNTS`
_ITERATIONS = 40


@device
def _sixth(w, v):
    """[w**6]."""
    return (w * w * w + v * v * v) * (w * w + w * v + v * v)


@device
def _eighth(w, v):
    """[w**8]."""
    u, s = w * w, v * v
    return (u * u + s * s) * (u + s) * (w + v)


@device
def state_at_failure(p, r0, w_i, sigma, gap_i):
    """Return b = r - r_0 and w_1 - w_i at the instability, accurate relative to themselves.

    The largest load has fallen by ``gap_i``, and D = 0; differences of both equations from those at r_0, w_i, iterated
    from b = 0, each time with an error smaller by about a factor b.
    """
    A, B = 1.0 + p / r0, 1.0 + p * r0 * r0
    b, d = 0.0, 0.0
    for _ in range(_ITERATIONS):
        w = w_i + d
        u = w * w
        r = r0 + b
        G, _ = curvature(d, w_i, A, B, sigma)
        last = b
        b = (gap_i - d * d * G) / (p * u * (1.0 / (r0 * r) + (r0 + r) * u * u * u))
        r = r0 + b
        of_w = 8.0 * B * _sixth(w, w_i) + 3.0 * sigma
        d = -b * p * (2.0 / (r0 * r) + 8.0 * (r0 + r) * u * u * u) / of_w
        if abs(b - last) <= 1e-15 * b:
            break
    return b, d


@device
def time_to_failure(p, sigma, w_t, gap_t, unstable, start, end):
    """Time to failure from w - w_i = ``start``, just after the sudden field, to ``end``; ``unstable`` is w_i - w_t."""
    d1 = unstable + end
    w1 = w_t + d1
    u1 = w1 * w1
    G, _ = curvature(d1, w_t, 1.0, 1.0, sigma)
    N1 = gap_t + d1 * d1 * G
    z1 = flow_root(p * u1 * u1 / (p * u1 * u1 + N1))
    half = 0.5 * (start - end)
    total = 0.0
    for j in range(OFFSETS[_RULE], OFFSETS[_RULE + 1]):
        above = half * (1.0 + NODES[0, j])  # w - w_1
        d = d1 + above
        w = w_t + d
        u = w * w
        G, _ = curvature(d, w_t, 1.0, 1.0, sigma)
        N = gap_t + d * d * G
        scaled = p * u * u
        z = flow_root(scaled / (scaled + N))
        of_u = w + w1
        of_N = _eighth(w, w1) + sigma * (w * w + w * w1 + w1 * w1) - of_u
        of_h = (of_N - N1 * (u + u1) * of_u / (u1 * u1)) / scaled
        of_z = -z1 * of_h / (z * z + z * z1 + z1 * z1 + N / scaled)
        K = 8.0 * _sixth(w, w1) + 3.0 * sigma + 6.0 * p * (z * z * of_u + u1 * (z + z1) * of_z)
        K -= 2.0 * (of_N - N1 * of_u / u1) / u
        total += NODES[1, j] * above * K * z * z / (2.0 * w * (1.0 + 2.0 * z * z * z) * N)
    return half * total
