"""The equilibrium of the film and its derivatives for one scalar state r = xi**2, without and with a dead load.

Zhao, Koh, Suo (2011), equibiaxial, (18)-(20) with s1 = s2 = s, (23) and (26). With ``w = 1/lambda``, ``u = w**2``,
``p = mu_U/mu_R - 1``, ``A = 1 + p/r``, ``B = 1 + p r**2`` and ``sigma = s/mu_R``

    e = A w**2 - B w**8 - sigma w**3                   equilibrium; e = e_C (E/Ec)**2
    dr/dT = F = 2 (1/z - z**2),  z = r w**2            flow
    D = 8 B w**6 + 3 sigma w - 2 A                     stiffness: zero at the instability

Both laws have the same functions of the unknown x, which is u without a dead load (and D half of the above) and w
with one. The right-hand side in time is F(r, x(r, e)), a scalar equation; x is solved for at each stage.
"""

from collections.abc import Callable
from decimal import Decimal
from typing import Any, NamedTuple

import numpy as np

from .._jit import device
from ..model import CRITICAL_LOAD, CRITICAL_U, instant_gap, relative_u

# What the double falls short of (3/4) 4**(-1/3).
CRITICAL_LOAD_REST = float(Decimal("0.4724703937105774367877039777") - Decimal(CRITICAL_LOAD))
# The iterations of `settle` are cubic: what the last one leaves must not exceed this, relative to x.
UNSETTLED = 1e-15
# Above this p, or above Ec, the flow is computed from the load, which keeps it accurate relative to itself near Ec.
FROM_LOAD = 0.5
ELASTIC = 1e-6


class Law(NamedTuple):
    """Functions of one law of equilibrium.

    Attributes
    ----------
    settle : callable
        ``settle(r, p, sigma, field, x) -> x, bad``: the unknown at a field from a guess; bad where there is none.
    flow : callable
        ``flow(r, p, x, field)``: dr/dT.
    plain_flow : callable
        ``plain_flow(r, x)``: the same, of the two states alone.
    local : callable
        ``local(r, p, sigma, x, F, load_rate) -> D, N, Q, growth, rate_of_x, fragility, sensitivity``: stiffness;
        N = -D dx/dT up to a positive factor; Q = D dD/dT; dF/dr at a fixed load; dx/dT; the error of r, times this
        over D**2, is the error of the load that is carried over the distance to it; and times the last one the relative
        error of the stretch at this load.
    ends : callable
        ``ends(r, p, sigma, x) -> bend, load_of_r, stiffness_of_r``: -dD/dT per N over D; de/dr at fixed x; dD/dr.
    at : callable
        ``at(r, p, sigma, D, x)``: the unknown at a stiffness from a guess.
    begin : callable
        ``begin(r, p, sigma, field)``: the unknown from nothing; field below what the film carries.
    critical : callable
        ``critical(r, p, sigma)``: the unknown at D = 0, (25); that of a relaxed film at its largest load with p = 0.
    relaxed_at : callable
        ``relaxed_at(sigma, field, top) -> stable, unstable``: of a relaxed film under a field that it can carry.
    load : callable
        ``load(r, p, sigma, x)``: e.
    stretch : callable
        ``stretch(x)``: lambda.
    excess : callable
        ``excess(sigma, field, top)``: load above the largest of a relaxed film, which has the unknown ``top``, accurate
        relative to itself.
    """

    settle: Callable[..., Any]
    flow: Callable[..., Any]
    plain_flow: Callable[..., Any]
    local: Callable[..., Any]
    ends: Callable[..., Any]
    at: Callable[..., Any]
    begin: Callable[..., Any]
    critical: Callable[..., Any]
    relaxed_at: Callable[..., Any]
    load: Callable[..., Any]
    stretch: Callable[..., Any]
    excess: Callable[..., Any]


@device
def _free_iterate(a, b, c, x):
    """One iteration, of Euler, for a x - b x**4 = c: the root of its parabola on the stable side."""
    below = b * x * x
    cube = below * x
    miss = x * (a - cube) - c
    d = 4.0 * cube - a
    square = d * d + 24.0 * below * miss
    root = np.sqrt(max(square, 0.0))
    return 2.0 * miss / (d + root), root, square


@device
def _free_settle(r, p, sigma, field, x):
    # (23) times r: no division.
    a = r + p
    b = r + p * r * r * r
    c = CRITICAL_LOAD * field * field * r
    change, root, square = _free_iterate(a, b, c, x)
    x = x + change
    change, root, square = _free_iterate(a, b, c, x)
    x = x + change
    size = abs(change)
    good = (square >= 0.0) & (4.0 * b * size * size * size <= UNSETTLED * root) & (x > 0.0)
    return x, (0.0 if good else 1.0)


@device
def _free_flow(r, p, x, field):
    z = r * x
    d = x - CRITICAL_U
    excess = CRITICAL_LOAD * (field - 1.0) * (field + 1.0)
    lacking = d * d * (x * (x + 2.0 * CRITICAL_U) + 3.0 * CRITICAL_U * CRITICAL_U)
    from_load = (p > FROM_LOAD) | ((excess > 0.0) & (p > ELASTIC))
    above = excess + lacking if from_load else 1.0 - z * z * z
    below = p * x * x if from_load else z
    return 2.0 * above / below


@device
def _free_plain_flow(r, x):
    z = r * x
    return 2.0 * (1.0 - z * z * z) / z


@device
def _free_local(r, p, sigma, x, flow, load_rate):
    square = x * x
    cube = square * x
    inverse = 1.0 / r
    b = 1.0 + p * r * r
    d = 4.0 * b * cube - 1.0 - p * inverse
    stiff = 1.0 / d
    load_of_r = -p * x * (inverse * inverse + 2.0 * r * cube)
    n = load_rate - load_of_r * flow
    bend = 12.0 * b * square
    q = d * p * (inverse * inverse + 8.0 * r * cube) * flow - bend * n
    z = r * x
    growth = -2.0 * (1.0 / (z * z) + 2.0 * z) * (x + r * load_of_r * stiff)
    return d, n, q, growth, -n * stiff, -2.0 * bend * load_of_r, -0.5 * load_of_r * stiff / x


@device
def _free_ends(r, p, sigma, x):
    square = x * x
    cube = square * x
    inverse = 1.0 / r
    bend = 12.0 * (1.0 + p * r * r) * square
    load_of_r = -p * x * (inverse * inverse + 2.0 * r * cube)
    return bend, load_of_r, p * (inverse * inverse + 8.0 * r * cube)


@device
def _free_at(r, p, sigma, d, x):
    target = (1.0 + p / r + d) / (4.0 * (1.0 + p * r * r))
    for _ in range(3):  # Halley's iteration for a cube root
        cube = x * x * x
        x = x * (cube + 2.0 * target) / (2.0 * cube + target)
    return x


@device
def _free_begin(r, p, sigma, field):
    a = 1.0 + p / r
    b = 1.0 + p * r * r
    critical = (0.25 * a / b) ** (1.0 / 3.0)
    # Next to the field that a fresh film fails under at once, its gap to it is known without cancellation.
    fresh = instant_gap(field, 1.0 + p) / (1.0 + p)
    margin = fresh if r == 1.0 else 1.0 - CRITICAL_LOAD * field * field / (0.75 * a * critical)
    y = relative_u(max(margin, 0.0))
    return critical * (1.0 + y)


@device
def _free_critical(r, p, sigma):
    return (0.25 * (1.0 + p / r) / (1.0 + p * r * r)) ** (1.0 / 3.0)


@device
def _free_relaxed_at(sigma, field, top):
    """Roots of u - u**4 = e on both sides of the largest load; e_C - e is exact."""
    gap = CRITICAL_LOAD * (1.0 - field) * (1.0 + field)
    s = np.sqrt(max(gap, 0.0) / 6.0) / CRITICAL_U
    up, down = s, -s
    for _ in range(60):
        apart = up - down
        u = CRITICAL_U + up
        rise = 4.0 * u * u * u - 1.0
        step = up * up * (u * u + 2.0 * u * CRITICAL_U + 3.0 * CRITICAL_U * CRITICAL_U) - gap
        up = up - step / rise if rise > 0.0 else up
        u = CRITICAL_U + down
        rise = 4.0 * u * u * u - 1.0
        step = down * down * (u * u + 2.0 * u * CRITICAL_U + 3.0 * CRITICAL_U * CRITICAL_U) - gap
        down = max(down - step / rise, -CRITICAL_U) if rise < 0.0 else down
        if up - down == apart:
            break
    return CRITICAL_U + up, CRITICAL_U + down


@device
def _free_load(r, p, sigma, x):
    return x * (1.0 + p / r - (1.0 + p * r * r) * x * x * x)


@device
def _free_stretch(x):
    return 1.0 / np.sqrt(x)


@device
def _free_excess(sigma, field, top):
    return CRITICAL_LOAD * (field - 1.0) * (field + 1.0)


@device
def _loaded_iterate(a, b, c, s, x):
    """One iteration, of Euler, for a x**2 - b x**8 - s x**3 = c: the root of its parabola on the stable side."""
    square = x * x
    sixth = b * square * square * square
    pull = s * x
    miss = square * (a - sixth - pull) - c
    d = x * (8.0 * sixth + 3.0 * pull - 2.0 * a)
    under = d * d + 4.0 * (28.0 * sixth + 3.0 * pull - a) * miss
    root = np.sqrt(max(under, 0.0))
    return 2.0 * miss / (d + root), root, under


@device
def _loaded_settle(r, p, sigma, field, x):
    a = r + p
    b = r + p * r * r * r
    c = CRITICAL_LOAD * field * field * r
    s = sigma * r
    change, root, under = _loaded_iterate(a, b, c, s, x)
    x = x + change
    change, root, under = _loaded_iterate(a, b, c, s, x)
    x = x + change
    size = abs(change)
    square = x * x
    third = 56.0 * b * square * square * x + s
    good = (under >= 0.0) & (third * size * size * size <= UNSETTLED * x * root) & (x > 0.0)
    return x, (0.0 if good else 1.0)


@device
def _loaded_plain_flow(r, x):
    z = r * x * x
    return 2.0 * (1.0 - z * z * z) / z


@device
def _loaded_flow(r, p, x, field):
    return _loaded_plain_flow(r, x)


@device
def _loaded_local(r, p, sigma, x, flow, load_rate):
    u = x * x
    cube = u * u * u
    inverse = 1.0 / r
    b = 1.0 + p * r * r
    d = 8.0 * b * cube + 3.0 * sigma * x - 2.0 * (1.0 + p * inverse)
    stiff = 1.0 / d
    load_of_r = -p * u * (inverse * inverse + 2.0 * r * cube)
    n = load_rate - load_of_r * flow
    bend = 48.0 * b * u * u + 3.0 * sigma / x
    q = d * p * (16.0 * r * cube + 2.0 * inverse * inverse) * flow - bend * n
    z = r * u
    growth = -2.0 * (1.0 / (z * z) + 2.0 * z) * (u + 2.0 * r * load_of_r * stiff)
    return d, n, q, growth, -n * stiff / x, -2.0 * bend * load_of_r, -load_of_r * stiff / u


@device
def _loaded_ends(r, p, sigma, x):
    u = x * x
    cube = u * u * u
    inverse = 1.0 / r
    bend = 48.0 * (1.0 + p * r * r) * u * u + 3.0 * sigma / x
    load_of_r = -p * u * (inverse * inverse + 2.0 * r * cube)
    return bend, load_of_r, p * (16.0 * r * cube + 2.0 * inverse * inverse)


@device
def _loaded_at(r, p, sigma, d, x):
    b = 8.0 * (1.0 + p * r * r)
    target = 2.0 * (1.0 + p / r) + d
    for _ in range(4):  # Halley's iteration
        square = x * x
        fourth = b * square * square
        value = fourth * square + 3.0 * sigma * x - target
        slope = 6.0 * fourth * x + 3.0 * sigma
        x = x - 2.0 * value * slope / (2.0 * slope * slope - 30.0 * value * fourth)
    return x


@device
def _loaded_begin(r, p, sigma, field):
    """Newton's method from above the root, where the load is concave: monotone."""
    a = 1.0 + p / r
    b = 1.0 + p * r * r
    e = CRITICAL_LOAD * field * field
    x = (a / b) ** (1.0 / 6.0)
    for _ in range(60):
        square = x * x
        sixth = b * square * square * square
        miss = square * (a - sixth - sigma * x) - e
        d = x * (8.0 * sixth + 3.0 * sigma * x - 2.0 * a)
        if d <= 0.0:
            break
        following = x + miss / d
        if not following < x:
            break
        x = following
    return x


@device
def _loaded_critical(r, p, sigma):
    """Unknown at D = 0: of a convex increasing function, by Newton's method from above."""
    a = 2.0 * (1.0 + p / r)
    b = 8.0 * (1.0 + p * r * r)
    x = (a / b) ** (1.0 / 6.0)
    for _ in range(60):
        square = x * x
        fourth = b * square * square
        following = x - (fourth * square + 3.0 * sigma * x - a) / (6.0 * fourth * x + 3.0 * sigma)
        if not following < x:
            break
        x = following
    return x


@device
def _loaded_relaxed_at(sigma, field, top):
    stable = _loaded_begin(1.0, 0.0, sigma, field)
    e = CRITICAL_LOAD * field * field
    low, high = 0.0, top
    for _ in range(1100):
        x = 0.5 * (low + high)
        if not low < x < high:
            break
        square = x * x
        if square * (1.0 - square * square * square - sigma * x) < e:
            low = x
        else:
            high = x
    return stable, low


@device
def _loaded_load(r, p, sigma, x):
    square = x * x
    return square * (1.0 + p / r - (1.0 + p * r * r) * square * square * square - sigma * x)


@device
def _loaded_stretch(x):
    return 1.0 / x


@device
def _product(a, b):
    """Return a b and its rounding error (Dekker 1971)."""
    whole = a * b
    high_a = a * 134217729.0
    high_a = high_a - (high_a - a)
    high_b = b * 134217729.0
    high_b = high_b - (high_b - b)
    low_a, low_b = a - high_a, b - high_b
    return whole, ((high_a * high_b - whole) + high_a * low_b + low_a * high_b) + low_a * low_b


@device
def _sum(a, b):
    """Return a + b and its rounding error (Knuth)."""
    whole = a + b
    part = whole - a
    return whole, (a - (whole - part)) + (b - part)


@device
def _loaded_excess(sigma, field, top):
    """Terms of order one that cancel next to the largest load, in twice the precision."""
    square, square_rest = _product(field, field)
    e, e_rest = _product(CRITICAL_LOAD, square)
    e_rest += CRITICAL_LOAD * square_rest + CRITICAL_LOAD_REST * square
    u, u_rest = _product(top, top)
    cube, cube_rest = _product(u, top)
    pull, pull_rest = _product(sigma, cube)
    pull_rest += sigma * (cube_rest + u_rest * top)
    fourth, fourth_rest = _product(u, u)
    fourth_rest += 2.0 * u * u_rest
    eighth, eighth_rest = _product(fourth, fourth)
    eighth_rest += 2.0 * fourth * fourth_rest
    one, one_rest = _sum(e, -u)
    two, two_rest = _sum(one, eighth)
    three, three_rest = _sum(two, pull)
    return three + (one_rest + two_rest + three_rest + e_rest - u_rest + eighth_rest + pull_rest)


FREE = Law(
    _free_settle,
    _free_flow,
    _free_plain_flow,
    _free_local,
    _free_ends,
    _free_at,
    _free_begin,
    _free_critical,
    _free_relaxed_at,
    _free_load,
    _free_stretch,
    _free_excess,
)
LOADED = Law(
    _loaded_settle,
    _loaded_flow,
    _loaded_plain_flow,
    _loaded_local,
    _loaded_ends,
    _loaded_at,
    _loaded_begin,
    _loaded_critical,
    _loaded_relaxed_at,
    _loaded_load,
    _loaded_stretch,
    _loaded_excess,
)
