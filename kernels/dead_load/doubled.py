"""Numbers as unevaluated sums of two floats, high and low: sums, products, quotients to some 1e-31 (Dekker 1971)."""

from .._jit import device

_SPLITTER = 134217729.0  # 2**27 + 1


@device
def product(a, b):
    """Return a b of two floats, exactly."""
    high = a * b
    t = _SPLITTER * a
    a1 = t - (t - a)
    a2 = a - a1
    t = _SPLITTER * b
    b1 = t - (t - b)
    b2 = b - b1
    return high, ((a1 * b1 - high) + a1 * b2 + a2 * b1) + a2 * b2


@device
def add(a, a_low, b, b_low):
    """Return the sum."""
    high = a + b
    part = high - a
    low = (a - (high - part)) + (b - part) + a_low + b_low
    total = high + low
    return total, low - (total - high)


@device
def multiply(a, a_low, b, b_low):
    """Return the product."""
    high, low = product(a, b)
    low = low + (a * b_low + a_low * b)
    total = high + low
    return total, low - (total - high)


@device
def quotient(a, b, b_low):
    """Return a float over a sum of two."""
    high = a / b
    back, back_low = product(high, b)
    low = ((a - back) - back_low - high * b_low) / b
    total = high + low
    return total, low - (total - high)
