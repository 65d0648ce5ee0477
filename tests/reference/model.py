"""The film in arbitrary precision: constants, elementary relations, and what a reference point consists of.

Symbols: ``m`` modulus ratio, ``p = m - 1``, ``u = lambda**-2``, ``r = xi**2``, ``z = u*r``,
``h = 1/z - z**2``, ``A = 1 + p/r``, ``B = 1 + p*r**2``, ``e`` the load ``eps*E**2/mu_R``. Equation numbers
are those of Zhao, Koh and Suo, Int. J. Appl. Mech. 3 (2011) 203-217.
"""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

from mpmath import MPContext

#: A context of its own: the precision of whoever else uses mpmath stays as it is.
mp = MPContext()
mp.dps = 60
mpf = mp.mpf

#: ``u`` at the largest load of the relaxed film, equation (25) with xi = lambda: ``4*u**3 = 1``.
U_STAR = mpf(4) ** (-mpf(1) / 3)
#: That load, equation (23): ``u - u**4`` at ``U_STAR``.
LOAD_UNIT = 3 * U_STAR / 4

SURVIVES, FAILS_LATER, FAILS_AT_ONCE = range(3)


@dataclass(frozen=True)
class Inputs:
    """One scene; every number is exact, a parameter that the program does not take is None."""

    program: str
    modulus_ratio: Fraction
    field: Fraction | None = None
    rate: Fraction | None = None


@dataclass(frozen=True)
class State:
    """A state of the film on its way: time, ``u = lambda**-2``, ``r = xi**2`` and E/Ec."""

    time: mpf
    u: mpf
    r: mpf
    field: mpf


def real(x: Fraction) -> mpf:
    """Return an exact number in working precision."""
    return mpf(x.numerator) / x.denominator


def stretch_at_rest(field: Fraction) -> mpf:
    """Return lambda of the relaxed film, equation (23) with xi = lambda: ``u - u**4 = e``, field <= 1."""
    if field == 1:
        return 1 / mp.sqrt(U_STAR)
    return 1 / mp.sqrt(stiff_root(mpf(1), real(field) ** 2 * LOAD_UNIT, LOAD_UNIT * real(1 - field**2)))


def stiff_root(modulus: mpf, load: mpf, gap: mpf) -> mpf:
    """Return the larger root u of ``modulus*(u - u**4) = load``, the film while ``r = 1`` or ``z = 1``.

    ``gap`` is ``modulus*LOAD_UNIT - load``. With ``v = u - U_STAR`` the equation reads
    ``v**2 * (u**2 + 2*u*U_STAR + 3*U_STAR**2) = gap/modulus``, which loses nothing near the fold.
    """
    if load == 0:
        return mpf(1)
    target = mp.sqrt(gap / modulus)

    def excess(v: mpf) -> mpf:
        return v * mp.sqrt(v * v + 4 * v * U_STAR + 6 * U_STAR**2) - target

    low, high = mpf(0), 1 - U_STAR
    v = target / (mp.sqrt(6) * U_STAR)
    return U_STAR + bracketed_newton(excess, low, high, min(v, high))


def bracketed_newton(function: Callable[[mpf], mpf], low: mpf, high: mpf, start: mpf) -> mpf:
    """Return the zero in [low, high] of an increasing function, to a relative error of working precision.

    Works in twice the precision; secant slopes, bisection where they lead out of the bracket.
    """
    enough = mpf(2) ** -mp.prec
    with mp.workprec(2 * mp.prec):
        x = start
        for _ in range(400):
            value = function(x)
            low, high = (low, x) if value > 0 else (x, high)
            shift = enough * x
            slope = (function(x + shift) - value) / shift if x else mpf(0)
            following = x - value / slope if slope > 0 else low
            if abs(following - x) <= enough * x:
                return following
            x = following if low < following < high else (low + high) / 2
    raise ArithmeticError("no zero found")


def viscous_ratio(h: mpf) -> mpf:
    """Return z, the positive root of ``z**3 + h*z = 1``, that is of ``h = 1/z - z**2``, for h >= 0."""
    x, load = 1.0, float(h)
    for _ in range(60):
        x -= (x**3 + load * x - 1) / (3 * x * x + load)
    z = mpf(x)
    for _ in range(4):
        z -= (z * (z * z + h) - 1) / (3 * z * z + h)
    return z
