"""Constant field: the time to failure as one integral over the stretch, free of its poles, for a block of lanes.

With U = u/u*, u* = 4**(-1/3), y = U**(-1/2) = lambda/2**(1/3), P = p u* and the field f in Ec, (23) and (26) give

    T = (4/u*) integral dy/y  D z**2/((1 + 2 z**3) n),    n = U**4 - 4 U + 3 f**2,    z**3 + h z = 1,
    h = n y**4/(4 P),    D = U**3 - 1 + 3 P U z**2 - n y**2/4,

from the state at the start to D = 0. At 1/n the integrand has a pair of poles C, C* that close in on the real axis
like sqrt(f - 1). There h = 0 and z = 1, so their residues are known; with n = Q R, Q = (U - q)**2 + c**2 the pair's own
factor, the straight line L(U) through the rest of the integrand at C and C* leaves (rest - L)/Q without poles, for
Gauss and Legendre, and L/Q to a logarithm and an arc tangent. What is left is so smooth that 8 nodes give 1e-10 for
modulus ratios up to 10, uniformly in the field. The resolvent cubic of n gives q and c without iteration on complex
numbers and without cancellation.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import device
from ..elementary import angle, logarithm_of_one_plus
from ..model import CRITICAL_U, instant_gap, relative_u
from .flow_cubic import flow_root
from .gauss_legendre import DONE, NEXT_RULE_BELOW, NODES, OFFSETS, RULES

# Rows of the block.
SCALED_P = 0  # P = p u*
CENTRE = 1  # of the interval in y - 1, and half of its length
HALF = 2
REAL = 3  # q - 1
SQUARE = 4  # c**2
PARTNER = 5  # square of the imaginary part of the other pair of roots, -q +- i sqrt(PARTNER)
LINE = 6  # L(q), and the slope of L
LINE_SLOPE = 7
POLE_PART = 8  # integral of L/Q: from the ratio of Q at both ends and the angle that the interval subtends at the poles
INTERNAL = 9  # xi**2 at the instability
SUM = 10  # Legendre coefficients of the smooth part: the zeroth and the last two
FIRST = 11
LAST = 12
LAST_BUT_ONE = 13
TIME = 14
BEFORE = 15  # time before that of the integral
ERROR = 16  # estimated error of the time, relative to the whole time
FOUND = 17  # the time, where it is as accurate as asked
RATIO = 18  # less 1
ACROSS = 19
ALONG = 20
SUBTRACTED = 21  # sum over the nodes of the size of the subtracted pole part
ROWS = 22


# Square of an interval divided by that of its distance from the poles, below which they stay in the integrand. Derived:
# with the poles 200 half intervals away the lowest rule leaves 200**-10, while subtracting them costs digits.
SHORT_INTERVAL = 1e-4
EPSILON = 2.0**-52


@device
def start_of_step(f, p):
    """Relative excess of U over 1 right after a sudden field, xi = 1; accurate relative to itself."""
    return relative_u(instant_gap(f, 1.0 + p) / (1.0 + p))


@device
def _powers(f, p):
    """f**6 and G = (f**6 - 1)/p without cancellation."""
    square = f * f
    return square * square * square, (f - 1.0) * (f + 1.0) / p * (square * square + square + 1.0)


@device
def start_of_hold(f, p, r):
    """Relative excess of U over 1 in equilibrium with the field f at an internal stretch sqrt(r).

    The margin g = 1 - e/e_c(xi) comes from ``(1 - g)**3 = f**6 B/A**4``, the difference divided by p beforehand.
    """
    sixth, G = _powers(f, p)
    a = 1.0 / r
    c = p * a
    A = 1.0 + c
    square = A * A
    gap = p * (a * (4.0 + c * (6.0 + c * (4.0 + c))) - G - sixth * r * r) / (square * square)
    critical = (A / (1.0 + p * r * r)) ** (1.0 / 3.0)
    root = f * f / (A * critical)
    margin = gap / (1.0 + root + root * root)
    return critical * (1.0 + relative_u(max(margin, 0.0))) - 1.0


@device
def inverse_internal(f, p):
    """Return a = 1/r at the instability under a constant field, where A**4 = f**6 B, (23) at (25).

    With ``G = (f**6 - 1)/p`` it reads ``a**2 (4 a + 6 p a**2 + 4 p**2 a**3 + p**3 a**4 - G) = f**6``, which has lost
    the terms that cancel for a small p. The first guess, within 6 % for all f and p, joins the limits of p = 0 and
    of large p; each iteration about squares its error.
    """
    sixth, G = _powers(f, p)
    reached = (f - 1.0) * (f + 1.0) / p
    a = f / np.sqrt(1.0 + p) * (1.0 - 0.37 * (1.0 - reached) / (1.0 + 0.2 * p))
    for _ in range(4):
        c = p * a
        rise = a * (12.0 + c * (24.0 + c * (20.0 + 6.0 * c))) - 2.0 * G
        a = a - (a * a * (a * (4.0 + c * (6.0 + c * (4.0 + c))) - G) - sixth) / (a * rise)
    return a


@device
def prepare(w, i, f, p, start):
    """Compute all of a lane but the sum over nodes and the pole part; ``start`` is U - 1 at the start.

    No branch and no call, so that a loop over lanes becomes vector instructions; the values of a lane that has nothing
    to integrate mean nothing and are not read.
    """
    prepare_above(w, i, f, (f - 1.0) * (f + 1.0), p, start)


@device
def prepare_above(w, i, f, g, p, start):
    """Do what `prepare` does with ``g = f**2 - 1`` given: next to Ec, f does not carry it to all its digits."""
    P = p * CRITICAL_U
    a = inverse_internal(f, p)
    end = (g - p * a) / (1.0 + p * a)
    # y - 1 without cancellation: just below sqrt(m) Ec, the interval is short and D vanishes all along.
    root0 = np.sqrt(1.0 + start)
    root1 = np.sqrt(1.0 + end)
    y0 = -start / (root0 * (1.0 + root0))
    y1 = -end / (root1 * (1.0 + root1))

    # A = 4 (1 + x), the largest root of the resolvent A**3 - 12 f**2 A - 16 = 0.
    # The first guess is within 1.4 %, which three iterations square to rounding.
    x = g / (4.0 / 3.0 + 5.0 / 3.0 * np.sqrt(1.0 + 0.48 * g))
    for _ in range(3):
        residual = x * (9.0 + x * (12.0 + 4.0 * x)) - 3.0 * g * (1.0 + x)
        x = x - residual / (9.0 + x * (24.0 + 12.0 * x) - 3.0 * g)
    q = np.sqrt(1.0 + x)
    real = x / (q + 1.0)
    square = real * (q * q + q + 1.0) / q
    partner = q * q + 1.0 / q
    c = np.sqrt(square)

    # Rest of the integrand at C = q + i c: (C**3 - 1 + 3 P C)/(3 C R(C)), R(C) = (2 q + i c)**2 + partner.
    top_re = real * (q * q + q + 1.0) + 3.0 * q * (P - square)
    top_im = c * (3.0 * q * q - square + 3.0 * P)
    r_re = 4.0 * q * q - square + partner
    r_im = 4.0 * q * c
    bottom_re = 3.0 * (q * r_re - c * r_im)
    bottom_im = 3.0 * (q * r_im + c * r_re)
    scale = 1.0 / (bottom_re * bottom_re + bottom_im * bottom_im)
    line = (top_re * bottom_re + top_im * bottom_im) * scale
    line_slope = (top_im * bottom_re - top_re * bottom_im) * scale / c

    # Poles far from a short interval are not subtracted: a small difference of large numbers would be left.
    near = 1.0 if (start - end) * (start - end) >= SHORT_INTERVAL * square else 0.0
    v0 = start - real
    v1 = end - real
    w[SCALED_P, i] = P
    w[CENTRE, i] = 0.5 * (y0 + y1)
    w[HALF, i] = 0.5 * (start - end) / (root0 * root1 * (root0 + root1))
    w[REAL, i] = real
    w[SQUARE, i] = square
    w[PARTNER, i] = partner
    w[LINE, i] = near * line
    w[LINE_SLOPE, i] = near * line_slope
    w[RATIO, i] = (start - end) * (v0 + v1) / (v1 * v1 + square)
    w[ACROSS, i] = c * (start - end)
    w[ALONG, i] = square + v0 * v1
    w[INTERNAL, i] = 1.0 / a


@device
def _integrate_pole_part(w):
    """Integral of L/Q, the logarithm and the arc tangent, in every lane."""
    for i in range(w.shape[1]):
        exact = w[LINE, i] / np.sqrt(w[SQUARE, i]) * angle(w[ACROSS, i], w[ALONG, i])
        w[POLE_PART, i] = exact + 0.5 * w[LINE_SLOPE, i] * logarithm_of_one_plus(w[RATIO, i])


@device
def _smooth_part(w, i, node):
    """Return what is left of the integrand at a node, and the size of what was subtracted from it."""
    beyond = w[CENTRE, i] + w[HALF, i] * node
    y = 1.0 + beyond
    P = w[SCALED_P, i]
    inverse = 1.0 / y
    U = inverse * inverse
    height = -beyond * (2.0 + beyond) * U  # U - 1
    v = height - w[REAL, i]
    q = 1.0 + w[REAL, i]
    Q = v * v + w[SQUARE, i]
    R = (U + q) * (U + q) + w[PARTNER, i]
    n4 = 0.25 * Q * R * y * y
    h = n4 * y * y / P
    z = flow_root(h)
    D = height * (U * U + U + 1.0) + 3.0 * P * U * z * z - n4
    below = (3.0 - 2.0 * h * z) * R
    subtracted = U * inverse * (w[LINE, i] + w[LINE_SLOPE, i] * v) * below
    scale = 1.0 / (below * Q)
    return (D * z * z * inverse - subtracted) * scale, abs(subtracted * scale)


def make_integrate_nodes(smooth_part: Callable[..., Any], scale: float, caution: float) -> Callable[..., Any]:
    """Make ``integrate_nodes(w, first, last)`` of an integrand less its pole part, ``smooth_part(w, i, node)``.

    ``scale`` is that of the time over half the interval times the sum over the nodes, plus half the pole part.
    """

    @device
    def integrate_nodes(w, first, last):
        """Time of every lane with the nodes ``first`` to ``last`` of ``NODES``, and an estimate of its error.

        The Legendre coefficients of the smooth part fall geometrically and Gauss's error falls like the square of the
        last ones. The estimate is a quarter of that square over the largest of the first ones, which bounds it from
        above (tests and studies/tolerance hold it to the truth); ``caution`` is that quarter, or more.
        """
        lanes = w.shape[1]
        for i in range(lanes):
            w[SUBTRACTED, i] = 0.0
            w[SUM, i] = 0.0
            w[FIRST, i] = 0.0
            w[LAST, i] = 0.0
            w[LAST_BUT_ONE, i] = 0.0
        for j in range(first, last):
            node, weight, of_first, of_last_but_one, of_last = NODES[:, j]
            for i in range(lanes):
                value, subtracted = smooth_part(w, i, node)
                w[SUBTRACTED, i] += weight * subtracted
                w[SUM, i] += weight * value
                w[FIRST, i] += of_first * value
                w[LAST_BUT_ONE, i] += of_last_but_one * value
                w[LAST, i] += of_last * value
        for i in range(lanes):
            w[TIME, i] = scale * (w[HALF, i] * w[SUM, i] + 0.5 * w[POLE_PART, i])
            tail = max(abs(w[LAST, i]), abs(w[LAST_BUT_ONE, i]))
            largest = max(abs(0.5 * w[SUM, i]), abs(w[FIRST, i])) + 1e-300
            whole = w[BEFORE, i] + abs(w[TIME, i])
            # At a node close to the poles a small difference of large numbers is left: some roundings each.
            rounding = 16.0 * EPSILON * w[SUBTRACTED, i]
            w[ERROR, i] = abs(scale * w[HALF, i]) * (caution * tail * tail / largest + rounding) / (whole + 1e-300)

    return integrate_nodes


_integrate_nodes = make_integrate_nodes(_smooth_part, 4.0 / CRITICAL_U, 0.25)


@device
def first_rule(p, rtol):
    """Rule with which a lane begins: the lowest whose estimate is expected to satisfy it.

    The modulus ratios from which to begin one and two rules higher are measured, as is `NEXT_RULE_BELOW`.
    """
    rule = 0
    for limit in NEXT_RULE_BELOW:
        rule += rtol < limit
    return rule + (p > 9.0) + (p > 60.0)


def make_integrate(integrate_nodes: Callable[..., Any]) -> Callable[..., Any]:
    """Make ``integrate(w, rule, rtol)`` from the sum over the nodes of one rule."""

    @device
    def integrate(w, rule, rtol):
        """Time of every lane, by the first rule from its own on at which the estimated error is at most ``rtol``.

        ``rule`` (lanes,) is set to ``DONE`` where the time is as accurate as asked; other lanes are unresolved.
        """
        lanes = w.shape[1]
        _integrate_pole_part(w)
        for i in range(lanes):
            w[FOUND, i] = math.nan
        for step in range(RULES):
            waiting = 0
            due = 0
            for i in range(lanes):
                waiting += rule[i] < DONE
                due += rule[i] <= step
            if waiting == 0:
                return
            if due == 0:
                continue
            integrate_nodes(w, OFFSETS[step], OFFSETS[step + 1])
            for i in range(lanes):
                if rule[i] <= step and w[ERROR, i] <= rtol:
                    w[FOUND, i] = w[TIME, i]
                    rule[i] = DONE

    return integrate


integrate = make_integrate(_integrate_nodes)
