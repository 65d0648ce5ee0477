"""Logarithm and arc tangent that vectorise: no branch, no table, no call, and errors of a few units of rounding.

The polynomials interpolate at Chebyshev's nodes, to 1e-18 relative.
"""

import math

import numpy as np

from ._jit import device

# atan(t)/t in powers of t**2, for t up to tan(pi/8).
_ATAN = (
    1.0,
    -0.3333333333333312,
    0.19999999999940837,
    -0.14285714279244968,
    0.11111110744657099,
    -0.09090896801472813,
    0.07692045194561481,
    -0.06662950246036792,
    0.05846866752275139,
    -0.05035049795312439,
    0.03796390316111083,
    -0.017803896394812564,
)
# atanh(s)/s in powers of s**2, for s up to (sqrt(2) - 1)/(sqrt(2) + 1).
_ATANH = (
    1.0,
    0.33333333333333826,
    0.19999999999650955,
    0.1428571438036914,
    0.11111098523202137,
    0.09091816120808513,
    0.0765625655736915,
    0.07404933786156531,
)
_LOG_2 = math.log(2.0)
_MANTISSA_BITS = 52
_ROOT_HALF = 0x3FE6A09E667F3BCD  # the bits of sqrt(1/2)


@device
def _polynomial(coefficients, x):
    total = coefficients[-1]
    for k in range(len(coefficients) - 2, -1, -1):
        total = total * x + coefficients[k]
    return total


@device
def angle(across, along):
    """atan2(across, along) for ``across`` of at least 0, from 0 to pi; by a fourth of it."""
    half = across / (np.sqrt(across * across + along * along) + abs(along))
    quarter = half / (1.0 + np.sqrt(1.0 + half * half))
    acute = 4.0 * quarter * _polynomial(_ATAN, quarter * quarter)
    return acute if along >= 0.0 else math.pi - acute


@device
def logarithm_of_one_plus(x):
    """Natural logarithm of 1 + x, a normal float above 0, accurate relative to itself for small x."""
    bits = np.float64(1.0 + x).view(np.int64)
    exponent = (bits - _ROOT_HALF) >> _MANTISSA_BITS
    mantissa = np.int64(bits - (exponent << _MANTISSA_BITS)).view(np.float64)  # from sqrt(1/2) to sqrt(2)
    excess = x if exponent == 0 else mantissa - 1.0
    s = excess / (2.0 + excess)
    return exponent * _LOG_2 + 2.0 * s * _polynomial(_ATANH, s * s)


@device
def exponential(x):
    """exp(x) to some 10 % where it matters, never too small by more: without a division, so that it is quick."""
    s = max(0.0625 * x, -1.0)
    base = 1.0 + s + 0.5 * s * s
    square = base * base
    fourth = square * square
    eighth = fourth * fourth
    return eighth * eighth
