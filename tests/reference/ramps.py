"""Formulation A under a rising field: collocation in the field for r, then in the margin to the failure.

No film fails below E/Ec = 1, and there the film follows ``dr/dE = 2h/k`` with u from the equilibrium (23):
regular, stiff for slow ramps. From there on the margin form ends at a known point: ``q = 4*B*u**3/A`` falls
to 1 at the failure (25); with ``s = sqrt((4 - q)/3)``, ``e = (3/4)*A*u*s**2``, the problem ends at s = 1.
"""

from fractions import Fraction
from functools import cache

from collocation import STAGES, OutOfDomainError, Radau
from model import LOAD_UNIT, U_STAR, State, mp, mpf, real, stiff_root

#: Newton doubles the digits: a step this small leaves an error far below the working precision's.
NEWTON_ENOUGH = mpf(10) ** -32


@cache
def method() -> Radau:
    """Return the collocation method, made once."""
    return Radau(STAGES)


def equilibrium(load: mpf, r: mpf, p: mpf, start: mpf | None = None) -> mpf:
    """Return u on the physical branch of equation (23), ``e = A*u - B*u**4``, by Newton's method.

    From the unloaded film's u, the default, the iterates fall monotonically to the root.
    """
    A, B = 1 + p / r, 1 + p * r * r
    u = mp.cbrt(A / B) if start is None else start
    for _ in range(300):
        cube = B * u**3
        slope = 4 * cube - A
        if slope <= 0:
            break
        step = (u * (cube - A) + load) / slope
        u -= step
        if abs(step) <= NEWTON_ENOUGH:
            return u
    raise OutOfDomainError("the film does not carry this load")


def state_at(field: Fraction, rate: Fraction, p: mpf) -> tuple[mpf, mpf]:
    """Return (u, r) when a ramp reaches the field, which it must without failing before.

    The variable is the angle of ``E = field*sin(angle)``: the relaxed film's u has a root singularity at
    E = 1, every film's at its failure, and either may lie just beyond the end. An elastic film (p = 0) is
    followed to field 1, its failure, only.
    """
    k, end = real(rate), real(field)
    known: dict[mpf, mpf] = {}

    def slope(angle: mpf, r: mpf) -> tuple[mpf, float]:
        if r <= 0:
            raise OutOfDomainError("r must be positive")
        cosine, sine = mp.cos_sin(angle)
        load = LOAD_UNIT * (end * sine) ** 2
        if p:
            u = known[angle] = equilibrium(load, r, p, known.get(angle))
        else:
            u = stiff_root(mpf(1), load, LOAD_UNIT * cosine**2)
        z = u * r
        h = 1 / z - z * z
        along = u
        if p:
            along -= p * u * (1 / r + 2 * (r * u) * r * u * u) / (4 * (1 + p * r * r) * u**3 - 1 - p / r)
        scale = 2 * end * cosine / k
        return scale * h, float(-scale * (1 / z**2 + 2 * z) * along)

    r = method().integrate(slope, mpf(0), mpf(1), mp.pi / 2, min(mpf(1), k * (1 + p) / end))
    return (equilibrium(LOAD_UNIT * end * end, r, p) if p else U_STAR), r


@cache
def ramp_failure(rate: Fraction, p: mpf) -> State:
    """Return the state at which a pure ramp fails; equations (23), (25) and (26)."""
    k = real(rate)
    u, r = state_at(Fraction(1), rate, p)
    if p == 0:
        return State(1 / k, u, r, mpf(1))

    def margin(s: mpf, r: mpf) -> tuple[mpf, mpf, mpf, mpf]:
        A, B, q = 1 + p / r, 1 + p * r * r, 4 - 3 * s * s
        u = mp.cbrt(q * A / (4 * B))
        return u, A, B, q

    def growth(s: mpf, r: mpf) -> mpf:
        u, A, B, q = margin(s, r)
        z = u * r
        flow = 2 * (1 / z - z * z)
        capacity = mp.sqrt(3 * A * u / (4 * LOAD_UNIT))
        fall = 2 * p / (3 * r * r * A) + p * r / (3 * B)
        return 4 * flow * (1 - s * s) / q / (k / capacity + s * fall * flow)

    def slope(s: mpf, r: mpf) -> tuple[mpf, float]:
        if r <= 0:
            raise OutOfDomainError("r must be positive")
        shift = mpf(10) ** -25
        value = growth(s, r)
        return value, float((growth(s, r + shift) - value) / shift)

    q = 4 * (1 + p * r * r) * u**3 / (1 + p / r)
    s = mp.sqrt((4 - q) / 3)
    r = method().integrate(slope, s, r, mpf(1), (1 - s) / 20)
    u, A, _, _ = margin(mpf(1), r)
    field = mp.sqrt(3 * A * u / (4 * LOAD_UNIT))
    return State(field / k, u, r, field)
