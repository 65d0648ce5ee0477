"""Formulation B: Taylor series of the film in rescaled time, in integer fixed-point arithmetic.

With ``dT = D ds``, ``D = 4*B*u**3 - A``, time, u and r are smooth through the failure; by (23) and (26)

    dT/ds = D,    du/ds = -(de/dT + 2*p*u*(1/r**2 + 2*r*u**3)*h),    dr/ds = 2*h*D,

whether the load rises or is held, and the failure (25) is the zero of D. Nothing is solved along the way:
(23) holds because its derivative does. Numbers are integers over ``2**BITS``.

A slow ramp starts late, on the relaxed film ``z = 1``. Two films under the same load approach each other as
``exp(-integral of the relaxation rate)``, so the start is forgotten; it is put where that factor, taken up to
E = Ec, is below 1e-75. The estimate runs along the relaxed film; the true film lags behind it by a small part
of the way, and 1e-60 is what is relied on.
"""

from bisect import bisect_left
from fractions import Fraction
from functools import cache
from math import isqrt
from operator import mul

import numpy as np
from model import LOAD_UNIT, U_STAR, Inputs, State, mp, mpf, real, stiff_root

try:
    from gmpy2 import mpz as integer
except ImportError:
    integer = int

BITS = 256
ONE = integer(1) << BITS
DAMPING = 75 * np.log(10)
STEPS = 20_000

#: Time, u and r in fixed point.
Triple = tuple[int, int, int]


def fixed(x: mpf | Fraction) -> int:
    """Return a number in fixed point."""
    if isinstance(x, Fraction):
        return integer((x.numerator << BITS) // x.denominator)
    return integer(int(mp.nint(mp.ldexp(x, BITS))))


def times(a: int, b: int) -> int:
    """Return the fixed-point product."""
    return a * b >> BITS


def evaluate(series: list[int], x: int) -> int:
    """Return the value of a power series at x."""
    value = integer(0)
    for coefficient in reversed(series):
        value = (value * x >> BITS) + coefficient
    return value


def root(series: list[int], target: int, x: int) -> int:
    """Return where a power series takes a value, by Newton's method from x.

    Time as a series is concave up to the failure: from the left, Newton's method cannot overshoot.
    """
    derivative = [n * c for n, c in enumerate(series)][1:]
    for _ in range(60):
        step = ((evaluate(series, x) - target) << BITS) // evaluate(derivative, x)
        x -= step
        if abs(step).bit_length() < BITS // 4:
            return x
    raise ArithmeticError("the event was not located")


class Film:
    """Power series of the film about a point of rescaled time."""

    def __init__(self, p: Fraction, rate: Fraction, order: int, digits: int) -> None:
        self.p = fixed(p)
        self.double_p = 2 * self.p
        self.order = order
        # de/dT = 2*eC*k**2*T under a ramp
        self.loading = fixed(2 * LOAD_UNIT * real(rate) ** 2)
        self.smallest = BITS - int(digits * 3.3219280948873623)

    def expand(self, time: int, u: int, r: int, scale: int, rising: bool) -> tuple[list[int], ...]:
        """Return the series of time, u, r and D in units of ``scale``."""
        N, p = self.order, self.p
        T, U, R = [time], [u], [r]
        Z, IZ, IR, Z2, U2, U3, R2, F, G, IR2, C, UC, H, D = ([] for _ in range(14))
        inverse_z = None

        def product(a: list[int], b: list[int], n: int) -> int:
            return sum(map(mul, a[: n + 1], b[n::-1])) >> BITS

        for n in range(N):
            Z.append(product(U, R, n))
            if n == 0:
                inverse_z = (ONE << BITS) // Z[0]
                IZ.append(inverse_z)
            else:
                IZ.append(-(sum(map(mul, Z[1:], IZ[n - 1 :: -1])) >> BITS) * inverse_z >> BITS)
            # 1/r = u/z
            IR.append(product(U, IZ, n))
            Z2.append(product(Z, Z, n))
            U2.append(product(U, U, n))
            U3.append(product(U, U2, n))
            R2.append(product(R, R, n))
            F.append((ONE if n == 0 else 0) + times(p, R2[n]))
            G.append(product(F, U3, n))
            D.append(4 * G[n] - (ONE if n == 0 else 0) - times(p, IR[n]))
            IR2.append(product(IR, IR, n))
            C.append(IR2[n] + 2 * product(R, U3, n))
            UC.append(product(U, C, n))
            H.append(IZ[n] - Z2[n])
            fall = times(self.double_p, product(UC, H, n))
            if rising:
                fall += times(self.loading, T[n])
            T.append(times(scale, D[n]) // (n + 1))
            U.append(-times(scale, fall) // (n + 1))
            R.append(2 * times(scale, product(H, D, n)) // (n + 1))
        return T, U, R, D

    def reach(self, *series: list[int]) -> float:
        """Return how many units the series may be carried for the last two terms to stay small enough."""
        logarithms = [
            (self.smallest - abs(s[n]).bit_length()) / n for s in series for n in (len(s) - 1, len(s) - 2) if s[n]
        ]
        return min(2.0, 2.0 ** min(logarithms)) if logarithms else 2.0

    def follow(self, state: Triple, until: int | None, rising: bool) -> tuple[bool, Triple]:
        """Advance to the failure, or to the time ``until``; return whether it failed, and the state there."""
        time, u, r = state
        # a first guess; the reach of the series corrects it
        scale = ONE // (1 + int(self.p >> BITS) + isqrt(int(self.loading >> BITS)))
        for _ in range(STEPS):
            T, U, R, D = self.expand(time, u, r, scale, rising)
            reach = self.reach(T, U, R)
            x = fixed(mpf(reach))
            margin, reached = evaluate(D, x), evaluate(T, x)
            failed = margin <= 0
            if failed:
                x = root(D, 0, x)
                reached = evaluate(T, x)
            if until is not None and reached >= until:
                x = root(T, until, integer(0))
                return False, (until, evaluate(U, x), evaluate(R, x))
            time, u, r = reached, evaluate(U, x), evaluate(R, x)
            if failed:
                return True, (time, u, r)
            scale = times(scale, x)
        raise ArithmeticError("the failure was not reached")


@cache
def relaxation(p: float) -> tuple[np.ndarray, np.ndarray]:
    """Return fields from 1 down to 0 and for each the integral of the relaxation rate over fields up to 1.

    Along the relaxed film ``e = u - u**4`` the flow (26) is damped at the rate
    ``6*u*(4*u**3 - 1)/(4*u**3 - 1 + 3*p*u)``.
    """
    u_star = float(U_STAR)
    # squares: nodes crowd towards the critical field; just off it, where the rate of an elastic film is 0/0
    u = u_star + (1 - u_star) * np.linspace(1e-7, 1, 20_001) ** 2
    field = np.sqrt((u - u**4) / float(LOAD_UNIT))
    rising = 4 * u**3 - 1
    rate = 6 * u * rising / (rising + 3 * p * u)
    pieces = (rate[1:] + rate[:-1]) / 2 * (field[:-1] - field[1:])
    return field, np.concatenate([[0], np.cumsum(pieces)])


def start_of_ramp(p: Fraction, rate: Fraction) -> tuple[mpf, mpf, mpf]:
    """Return time, u and r to start a ramp at: the unloaded film, or the relaxed film if the ramp is slow."""
    fields, damping = relaxation(float(p))
    index = bisect_left(damping, DAMPING * float(rate))
    if index >= len(fields) - 1:
        return mpf(0), mpf(1), mpf(1)
    field = mpf(float(fields[index]))
    load = LOAD_UNIT * field**2
    u = stiff_root(mpf(1), load, LOAD_UNIT - load)
    return field / real(rate), u, 1 / u


def failure(inputs: Inputs, order: int = 56, digits: int = 50) -> State:
    """Return the state at which the film fails; the scene must be one that fails, and not at once."""
    m, field, rate = inputs.modulus_ratio, inputs.field, inputs.rate
    p = m - 1
    if inputs.program == "step":
        film = Film(p, Fraction(0), order, digits)
        u = stiff_root(real(m), LOAD_UNIT * real(field**2), LOAD_UNIT * real(m - field**2))
        start = mpf(0), u, mpf(1)
        failed = False
    else:
        film = Film(p, rate, order, digits)
        start = start_of_ramp(p, rate)
    state = tuple(fixed(x) for x in start)
    if inputs.program != "step":
        corner = None if field is None else fixed(field / rate)
        failed, state = film.follow(state, corner, rising=True)
    held = not failed
    if held:
        _, state = film.follow(state, None, rising=False)
    time, u, r = (mp.ldexp(mpf(int(x)), -BITS) for x in state)
    return State(time, u, r, real(field) if held else real(rate) * time)
