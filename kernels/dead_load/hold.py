"""Constant field under a dead load: the time to failure as one integral over the stretch, free of its poles.

    T = integral of F/N dd,    F = D z**2/(2 w (1 + 2 z**3)),    N = p u**2 h = gap_t + d**2 G(d),    z**3 + h z = 1,

from the equilibrium at the start to D = 0, d = w - w_t. At 1/N the integrand has a pair of poles that closes in on the
real axis like the root of gap_t, the load in excess of the largest one of a relaxed film; as in `hold/quadrature.py`,
whose rows and rules are used, the straight line through the rest at both poles is integrated exactly. The nodes lie in
the variable tau of ``lambda - lambda_t = 2 b tau/(1 - tau**2)``, whose scale b is the distance of the branch points of
z: they crowd where a film that has hardly begun to relax, far from its equilibrium, comes close to it.
"""

import numpy as np

from .._jit import device
from ..hold import quadrature
from ..hold.gauss_legendre import DONE
from ..hold.quadrature import (
    ACROSS,
    ALONG,
    CENTRE,
    FOUND,
    HALF,
    INTERNAL,
    LINE,
    LINE_SLOPE,
    RATIO,
    REAL,
    ROWS,
    SQUARE,
)
from .film import curvature, relaxed_stiffness

# Rows of the block, beside those of `hold/quadrature.py`.
P = ROWS  # modulus ratio - 1
SIGMA = ROWS + 1
W_T = ROWS + 2
GAP_T = ROWS + 3
SCALE = ROWS + 4  # b
UNSTABLE_W = ROWS + 5  # w at the instability
KEPT = ROWS + 6  # the time, where it was found at once
HOLD_ROWS = ROWS + 7

# Square of b: twice the load by which N vanishes at the branch points of z, h**3 = -27/4. Measured: from 1 to 4 the
# number of nodes hardly changes.
_BRANCH = 2.5
# Square of an interval divided by that of its distance from the poles, below which they stay in the integrand: with the
# poles six half intervals away every rule gains its digits, while a film that is far from them may be far from z = 1.
_SHORT = 0.1
_POLE_ITERATIONS = 5
_POLE_FOUND = 1e-6


@device
def flow_root(t):
    """Root z of z**3 + h z = 1 for any h >= 0, from t = 1/(1 + h): a polynomial, error 0.5 %, then Halley's method."""
    z = t * (
        1.0039985987739486
        + t
        * (
            0.6394073908819824
            + t * (5.755212875351214 + t * (-19.258102096395643 + t * (19.43459010407007 - t * 6.576029747706315)))
        )
    )
    h = 1.0 / t - 1.0
    for _ in range(2):
        square = z * z
        value = z * (square + h) - 1.0
        slope = 3.0 * square + h
        z = z - value * slope / (slope * slope - 3.0 * value * z)
    return z


@device
def _horner(x, y, n_x, n_y, s_x, s_y, c):
    """Return value and slope of a polynomial at x + i y after one more coefficient."""
    return n_x * x - n_y * y + c, n_x * y + n_y * x, s_x * x - s_y * y + n_x, s_x * y + s_y * x + n_y


@device
def _value_and_slope(x, y, c7, c6, c5, c4, c3, c2, c0):
    """Return ``d**8 + c7 d**7 + ... + c2 d**2 + c0`` at d = x + i y and its slope, real and imaginary parts."""
    a, b, c, d = x + c7, y, 1.0, 0.0
    a, b, c, d = _horner(x, y, a, b, c, d, c6)
    a, b, c, d = _horner(x, y, a, b, c, d, c5)
    a, b, c, d = _horner(x, y, a, b, c, d, c4)
    a, b, c, d = _horner(x, y, a, b, c, d, c3)
    a, b, c, d = _horner(x, y, a, b, c, d, c2)
    a, b, c, d = _horner(x, y, a, b, c, d, 0.0)
    return _horner(x, y, a, b, c, d, c0)


@device
def poles(gap, w, sigma):
    """Upper one of the pair of roots of ``N = gap + d**2 G(d)`` next to d = 0, and N' there.

    The guess is exact to second order for a small gap. Real arithmetic, which vectorises: the root, N' and the length
    of the last step of Newton's method, which tells whether it was found.
    """
    square = w * w
    cube = square * w
    c2 = 28.0 * cube * cube - 1.0 + 3.0 * sigma * w
    c3 = sigma + 56.0 * cube * square
    c4 = 70.0 * square * square
    c5 = 56.0 * cube
    c6 = 28.0 * square
    c7 = 8.0 * w
    # i eta/sqrt(1 + i eta g), eta = sqrt(gap/c2), g = c3/c2
    eta = np.sqrt(gap / c2)
    across = eta * c3 / c2
    size = np.sqrt(1.0 + across * across)
    below = np.sqrt(0.5 * (size + 1.0))
    along = eta / size
    x = along * 0.5 * across / below
    y = along * below
    step = 0.0
    for _ in range(_POLE_ITERATIONS):
        n_x, n_y, s_x, s_y = _value_and_slope(x, y, c7, c6, c5, c4, c3, c2, gap)
        inverse = 1.0 / (s_x * s_x + s_y * s_y + 1e-300)
        of_x = (n_x * s_x + n_y * s_y) * inverse
        of_y = (n_y * s_x - n_x * s_y) * inverse
        x -= of_x
        y -= of_y
        step = abs(of_x) + abs(of_y)
    _, _, slope_x, slope_y = _value_and_slope(x, y, c7, c6, c5, c4, c3, c2, gap)
    return x, y, slope_x, slope_y, step


@device
def prepare(w, i, p, sigma, w_t, gap_t, first, a, last):
    """Complete a lane but for the sum over nodes: from d = ``first`` to the instability at 1/a = r, d = ``last``."""
    w0 = w_t + first
    w1 = w_t + last
    u_t = w_t * w_t
    G, _ = curvature(0.0, w_t, 1.0, 1.0, sigma)
    b = np.sqrt((gap_t + _BRANCH * p * u_t * u_t) / G) / u_t
    y0 = -first / (w0 * w_t)
    y1 = -last / (w1 * w_t)
    tau0 = y0 / (b + np.sqrt(b * b + y0 * y0))
    tau1 = y1 / (b + np.sqrt(b * b + y1 * y1))
    w[P, i] = p
    w[SIGMA, i] = sigma
    w[W_T, i] = w_t
    w[GAP_T, i] = gap_t
    w[SCALE, i] = b
    w[CENTRE, i] = 0.5 * (tau0 + tau1)
    w[HALF, i] = 0.5 * (tau1 - tau0)
    w[INTERNAL, i] = 1.0 / a
    w[UNSTABLE_W, i] = w1

    real, across, slope_x, slope_y, step = poles(gap_t, w_t, sigma)
    square = across * across
    length = first - last
    outside = max(max(last - real, real - first), 0.0)
    near = (length * length >= _SHORT * (square + outside * outside)) & (step <= _POLE_FOUND * across)
    near = near & (w_t + real > 0.0)
    across = across if near else 1.0
    # D z**2/(2 w (1 + 2 z**3)) at z = 1, over R = N'/(2 i c): i c (d K + 6 p u)/(3 w N'), with -g'/w = d K.
    at = w_t + real
    u_x, u_y = at * at - across * across, 2.0 * at * across
    third_x, third_y = at * u_x - across * u_y, at * u_y + across * u_x
    sixth_x, sixth_y = third_x * third_x - third_y * third_y, 2.0 * third_x * third_y
    top_x = 8.0 * sixth_x + 3.0 * sigma * at - 2.0 + 6.0 * p * u_x
    top_y = 8.0 * sixth_y + 3.0 * sigma * across + 6.0 * p * u_y
    below_x = 3.0 * (at * slope_x - across * slope_y)
    below_y = 3.0 * (at * slope_y + across * slope_x)
    scale = across / (below_x * below_x + below_y * below_y + 1e-300)
    line = -scale * (top_y * below_x - top_x * below_y)
    line_slope = scale * (top_x * below_x + top_y * below_y)
    v0 = first - real
    v1 = last - real
    w[REAL, i] = real
    w[SQUARE, i] = square if near else 1.0
    w[LINE, i] = line if near else 0.0
    w[LINE_SLOPE, i] = line_slope / across if near else 0.0
    w[RATIO, i] = length * (v0 + v1) / (v1 * v1 + square) if near else 0.0
    w[ACROSS, i] = across * length if near else 0.0
    w[ALONG, i] = square + v0 * v1 if near else 1.0


@device
def _smooth_part(w, i, node):
    """Half of what is left of the integrand in tau at a node, and the size of what was subtracted from it."""
    tau = w[CENTRE, i] + w[HALF, i] * node
    w_t = w[W_T, i]
    p, sigma = w[P, i], w[SIGMA, i]
    less = 1.0 - tau * tau
    far = 2.0 * w[SCALE, i] * tau * w_t
    inverse = 1.0 / (less + far)
    x = less * w_t * inverse  # the unknown w
    d = -far * w_t * inverse
    G, _ = curvature(d, w_t, 1.0, 1.0, sigma)
    N = w[GAP_T, i] + d * d * G
    u = x * x
    scaled = p * u * u
    z = flow_root(scaled / (scaled + N))
    z2 = z * z
    Du = d * relaxed_stiffness(d, w_t, sigma) * u + 6.0 * scaled * z2 - 2.0 * N  # the stiffness times u
    v = d - w[REAL, i]
    Q = v * v + w[SQUARE, i]
    below = 2.0 * u * x * (1.0 + 2.0 * z2 * z) * N
    subtracted = (w[LINE, i] + w[LINE_SLOPE, i] * v) * below
    # - dd/dtau = 2 b (1 + tau**2) (w_t/(less + far))**2
    length = w[SCALE, i] * (1.0 + tau * tau) * w_t * w_t * inverse * inverse
    scale = length / (below * Q)
    return (Du * z2 * Q - subtracted) * scale, abs(subtracted * scale)


# Where a film has hardly begun to relax, a small part of the integrand has coefficients that fall more slowly than
# those of the rest. Measured on 20,000 random films: a hundred times the estimate of a geometric sequence bounds all.
integrate_nodes = quadrature.make_integrate_nodes(_smooth_part, 2.0, 25.0)
_integrate = quadrature.make_integrate(integrate_nodes)


@device
def integrate(w, rule, rtol):
    """Time of every lane, as `hold/quadrature.py` does it; once more with the poles left in where that failed.

    Far from z = 1, its value at the poles, what is subtracted may exceed the integrand by far.
    """
    _integrate(w, rule, rtol)
    again = 0
    for i in range(w.shape[1]):
        if rule[i] < DONE:
            again += 1
            w[LINE, i] = 0.0
            w[LINE_SLOPE, i] = 0.0
        w[KEPT, i] = w[FOUND, i]
    if again > 0:
        _integrate(w, rule, rtol)
        for i in range(w.shape[1]):
            w[FOUND, i] = w[FOUND, i] if w[KEPT, i] != w[KEPT, i] else w[KEPT, i]
