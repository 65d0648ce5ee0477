"""Formulation A under constant load: the time as one integral over ``u = lambda**-2``, by Gauss quadrature.

Under a constant load ``e``, equation (23) gives ``h`` as a function of ``u`` alone,
``h = (e - u + u**4)/(p*u**2)``; with ``r = z(h)/u`` the flow (26), ``dr/dT = 2h``, becomes
``T = integral of (dr/du)/(2h) du``. Just above the critical field the integrand has poles beside the real
axis; ``u = U_STAR + w*sinh(theta)``, ``w**2 = (e - eC)/(6*U_STAR**2)``, moves them to ``theta = +-i*pi/2``.
"""

from collections.abc import Callable
from fractions import Fraction
from functools import cache
from itertools import pairwise

from model import LOAD_UNIT, U_STAR, bracketed_newton, mp, mpf, real, stiff_root, viscous_ratio

NODES = 40
TOLERANCE = mpf(10) ** -42


def failure_state(field: Fraction, p: mpf) -> tuple[mpf, mpf]:
    """Return (u, r) at which the film fails under a constant field between 1 and sqrt(m).

    Equations (23) and (25): ``e = e_c(xi)`` is ``A**4 = B*field**6``, one increasing equation in r.
    """

    def excess(growth: mpf) -> mpf:
        r = 1 + growth
        return (1 + p * r * r) * real(field) ** 6 - (1 + p / r) ** 4

    high = mpf(1)
    while excess(high) < 0:
        high *= 2
    r = 1 + bracketed_newton(excess, mpf(0), high, high / 2)
    return mp.cbrt((1 + p / r) / (4 * (1 + p * r * r))), r


def start_of_step(field: Fraction, modulus_ratio: Fraction) -> mpf:
    """Return u right after the field is switched on: equation (23) with xi = 1, ``m*(u - u**4) = e``."""
    gap = LOAD_UNIT * real(modulus_ratio - field**2)
    return stiff_root(real(modulus_ratio), LOAD_UNIT * real(field**2), gap)


def time_between(u_start: mpf, u_end: mpf, field: Fraction, p: mpf) -> mpf:
    """Return the time the film takes from ``u_start`` down to ``u_end`` under a constant field > 1."""
    over = LOAD_UNIT * real(field**2 - 1)
    width = mp.sqrt(over / (6 * U_STAR**2))

    def rate_of_time(theta: mpf) -> mpf:
        v = width * mp.sinh(theta)
        u = U_STAR + v
        pu2 = p * u * u
        h = (over + v * v * (u * u + 2 * u * U_STAR + 3 * U_STAR**2)) / pu2
        z = viscous_ratio(h)
        slope = 4 * v * (u * u + u * U_STAR + U_STAR**2) / pu2 - 2 * h / u
        growth = -z * z * slope / (1 + 2 * z**3) - z / u
        return -growth / (2 * h * u) * width * mp.cosh(theta)

    first = mp.asinh((u_end - U_STAR) / width)
    last = mp.asinh((u_start - U_STAR) / width)
    pieces = max(1, int(mp.ceil((last - first) / 2)))
    knots = mp.linspace(first, last, pieces + 1)
    wholes = [gauss(rate_of_time, a, b) for a, b in pairwise(knots)]
    scale = mp.fsum(wholes)
    return mp.fsum(
        refined(rate_of_time, a, b, whole, scale * TOLERANCE)
        for (a, b), whole in zip(pairwise(knots), wholes, strict=True)
    )


def refined(function: Callable[[mpf], mpf], a: mpf, b: mpf, whole: mpf, tolerance: mpf) -> mpf:
    """Return the integral over [a, b], halving until the halves agree with the whole."""
    middle = (a + b) / 2
    left, right = gauss(function, a, middle), gauss(function, middle, b)
    if abs(left + right - whole) <= tolerance:
        return left + right
    return refined(function, a, middle, left, tolerance) + refined(function, middle, b, right, tolerance)


def gauss(function: Callable[[mpf], mpf], a: mpf, b: mpf) -> mpf:
    """Return the Gauss-Legendre approximation of the integral over [a, b]."""
    half, middle = (b - a) / 2, (a + b) / 2
    return half * mp.fsum(weight * function(middle + half * node) for node, weight in gauss_rule())


@cache
def gauss_rule() -> list[tuple[mpf, mpf]]:
    """Return nodes and weights of the Gauss-Legendre rule: Newton on the Legendre polynomial."""
    rule = []
    for j in range(NODES):
        x = mp.cos(mp.pi * (j + mpf(3) / 4) / (NODES + mpf(1) / 2))
        for _ in range(9):
            before, value = mpf(1), x
            for n in range(2, NODES + 1):
                before, value = value, ((2 * n - 1) * x * value - (n - 1) * before) / n
            derivative = NODES * (before - x * value) / (1 - x * x)
            x -= value / derivative
        rule.append((x, 2 / ((1 - x * x) * derivative**2)))
    return rule
