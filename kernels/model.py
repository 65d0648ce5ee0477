"""The constitutive law in scalars: load, margin, flow, critical state; Zhao, Koh, Suo (2011), equibiaxial.

Throughout, ``u = lambda**-2`` (lambda the stretch), ``r = xi**2`` (xi the internal stretch) and
``p = mu_U/mu_R - 1``, which makes every expression rational. With ``A = 1 + p/r`` and ``B = 1 + p r**2``:

    e = A u - B u**4            load e = eps E**2/mu_R in equilibrium, their (23)
    D = -de/du = 4 B u**3 - A   stiffness against the load; zero at the instability, their (25)
    dr/dT = 2 h,  h = 1/z - z**2,  z = u r        flow, their (26), time T in relaxation times
"""

import numpy as np

from ._jit import device

CRITICAL_U = 4.0 ** (-1.0 / 3.0)  # u at the instability of a relaxed or of an unrelaxed film: lambda = 2**(1/3)
CRITICAL_LOAD = 0.75 * CRITICAL_U  # e at E = Ec: the largest load that a relaxed film can carry


@device
def upper_stiffness(r, p):
    """Return A = 1 + p/r."""
    return 1.0 + p / r


@device
def lower_stiffness(r, p):
    """Return B = 1 + p r**2."""
    return 1.0 + p * r * r


@device
def load(u, r, p):
    """Equilibrium load e(u, r), (23)."""
    return u * (upper_stiffness(r, p) - lower_stiffness(r, p) * u * u * u)


@device
def stiffness(u, r, p):
    """D = -de/du: positive before the instability, zero at it, (24) and (25)."""
    return 4.0 * lower_stiffness(r, p) * u * u * u - upper_stiffness(r, p)


@device
def flow(u, r):
    """Half the rate of r = xi**2 in relaxation times, (26)."""
    z = u * r
    return 1.0 / z - z * z


@device
def deficit(u, d):
    """Return what a relaxed film's load lacks of its largest: ``e_C - (u - u**4)``, with d = u - u*, uncancelled."""
    return d * d * (u * (u + 2.0 * CRITICAL_U) + 3.0 * CRITICAL_U * CRITICAL_U)


@device
def flow_under_field(u, field, p):
    """Half the rate of r in equilibrium with a field, from (23): ``h = (e - u + u**4)/(p u**2)``.

    Accurate relative to itself next to the critical field, where it almost vanishes; field - 1 is exact.
    """
    excess = CRITICAL_LOAD * (field - 1.0) * (field + 1.0)
    return (excess + deficit(u, u - CRITICAL_U)) / (p * u * u)


@device
def critical_u(r, p):
    """U at the instability for this internal stretch, (25)."""
    return (0.25 * upper_stiffness(r, p) / lower_stiffness(r, p)) ** (1.0 / 3.0)


@device
def largest_load(r, p):
    """Largest load that the film can carry at this internal stretch: (23) at (25)."""
    return 0.75 * upper_stiffness(r, p) * critical_u(r, p)


@device
def relative_u(margin):
    """Solve for u over its critical value at a given margin to instability.

    With ``x = u/u_c`` equilibrium (23) reads ``x**4 - 4 x + 3 (1 - g) = 0`` for every internal stretch, where
    ``g = 1 - e/e_c`` is the margin; the physical root is ``x = 1 + y`` in [1, 4**(1/3)].

    Parameters
    ----------
    margin : float
        g in [0, 1].

    Returns
    -------
    float
        y = x - 1, accurate relative to itself down to g = 0.
    """
    s = np.sqrt(margin)
    y = s * (0.7071067811865476 + s * (-0.16666666666666666 + s * 0.047))
    for _ in range(3):  # y**2 (6 + 4 y + y**2) = 3 g in the regular unknown y**2/g: Newton, quadratic from 1e-3
        slope = y * (12.0 + y * (12.0 + 4.0 * y))
        residual = y * y * (6.0 + y * (4.0 + y)) - 3.0 * margin
        y = y - residual / slope if slope > 0.0 else y
    return y


@device
def square_error(a, square):
    """Return a*a - square exactly, for the floating-point square of a (Dekker 1971)."""
    high = a * 134217729.0
    high = high - (high - a)
    low = a - high
    return ((high * high - square) + 2.0 * high * low) + low * low


@device
def instant_gap(field, modulus_ratio):
    """``modulus_ratio - field**2`` without cancellation: positive where the film survives a sudden field."""
    scale = 2.0**-530 if field > 1e150 else 1.0  # a power of two, exact, where the square would overflow
    scaled = field * scale
    square = scaled * scaled
    gap = (modulus_ratio * scale * scale - square) - square_error(scaled, square)
    return gap / (scale * scale)
