"""What a piece of a program says about the field, in scalars, without and with sines."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .._jit import device

LINEAR, SINE = 0, 1
ENDLESS = -1

# Taylor series of sin(2 pi x)/x in x**2, to rounding for |x| up to 1/4.
_SINE = tuple(float((-1) ** k * (2.0 * np.pi) ** (2 * k + 1) / np.prod(np.arange(1.0, 2 * k + 2))) for k in range(12))
_TURN = 2.0 * np.pi
# Turns between phases that count as one.
NEXT_TO = 1e-6


class Waves(NamedTuple):
    """The field in a piece.

    Attributes
    ----------
    field, rate : callable
        ``field(t, start, slope, amplitude, frequency)``, and dE/dt of the same.
    zero : callable
        ``zero(start, amplitude)``: where a sine is zero, in turns; NaN where it is not.
    turn : callable
        ``turn(t, frequency, zero)``: the next time after t at which the load, E**2, of a sine has an extreme.
    """

    field: Callable[..., Any]
    rate: Callable[..., Any]
    zero: Callable[..., Any]
    turn: Callable[..., Any]


@device
def sine_of_turns(x):
    """sin(2 pi x), by vector instructions."""
    x = x - np.rint(x)
    x = 0.5 - x if x > 0.25 else (-0.5 - x if x < -0.25 else x)
    square = x * x
    total = _SINE[11]
    for k in range(10, -1, -1):
        total = total * square + _SINE[k]
    return total * x


@device
def _linear_field(t, start, slope, amplitude, frequency):
    return start + slope * t


@device
def _linear_rate(t, start, slope, amplitude, frequency):
    return slope


@device
def _no_zero(start, amplitude):
    return math.nan


@device
def _no_turn(t, frequency, zero):
    return math.inf


@device
def _any_field(t, start, slope, amplitude, frequency):
    return start + slope * t + amplitude * sine_of_turns(frequency * t)


@device
def _any_rate(t, start, slope, amplitude, frequency):
    return slope + _TURN * frequency * amplitude * sine_of_turns(frequency * t + 0.25)


@device
def _any_zero(start, amplitude):
    return -math.asin(start / amplitude) / _TURN if abs(start) < abs(amplitude) else math.nan


@device
def _next(phase, first, apart):
    """Return the next of ``first``, ``first + apart``, ... after a phase, that is not next to it."""
    return first + apart * (math.floor((phase - first) / apart + NEXT_TO) + 1.0)


@device
def _any_turn(t, frequency, zero):
    if not frequency > 0.0:
        return math.inf
    phase = frequency * t
    following = _next(phase, 0.25, 0.5)
    if not math.isnan(zero):
        following = min(following, _next(phase, zero, 1.0), _next(phase, 0.5 - zero, 1.0))
    return following / frequency


LINEAR_ONLY = Waves(_linear_field, _linear_rate, _no_zero, _no_turn)
WITH_SINES = Waves(_any_field, _any_rate, _any_zero, _any_turn)


@device
def argument(scale, source, columns, piece, slot, cell):
    """Return an argument of a piece for a cell."""
    return scale[piece, slot] * columns[source[piece, slot], cell]


@device
def field_at_start(kind, scale, source, columns, piece, cell):
    """Return the field with which a piece begins."""
    return argument(scale, source, columns, piece, 0, cell)


@device
def field_at_end(kind, scale, source, columns, piece, cell):
    """Return the field with which a piece ends."""
    if kind[piece] == LINEAR:
        return argument(scale, source, columns, piece, 1, cell)
    mean = argument(scale, source, columns, piece, 0, cell)
    amplitude = argument(scale, source, columns, piece, 1, cell)
    duration = argument(scale, source, columns, piece, 2, cell)
    period = argument(scale, source, columns, piece, 3, cell)
    return mean + amplitude * sine_of_turns(duration / period) if duration > 0.0 else mean


@device
def describe(kind, scale, source, columns, piece, cell):
    """Return start, slope, amplitude, frequency, duration of a piece for a cell."""
    start = argument(scale, source, columns, piece, 0, cell)
    second = argument(scale, source, columns, piece, 1, cell)
    duration = argument(scale, source, columns, piece, 2, cell)
    if kind[piece] == LINEAR:
        slope = (second - start) / duration if duration > 0.0 else 0.0
        return start, slope, 0.0, 0.0, duration
    period = argument(scale, source, columns, piece, 3, cell)
    return start, 0.0, second, 1.0 / period, duration
