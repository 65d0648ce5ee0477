"""Passages through a program recorded step by step, and the states within a step, for what is sought on the way.

`record` takes films through their program in lanes and writes down every accepted step, until there is no more room,
the program has come to its end, or the film has come to its own: the instability, a jump that it does not carry, rest.
`within` gives the state in the middle of a step that was recorded: one more step from the same start, shorter, as
accurate as the step itself.
"""

import math

import numpy as np

from .._jit import Kernel, device
from .cells import LANES
from .law import Law
from .march import PIECE_DONE, ROWS, TOO_MANY, VACANT, make_passage, total_error
from .pieces import Waves, describe, field_at_end
from .rows import (
    AMPLITUDE,
    BAD,
    BARRED,
    BASE,
    BEGINS,
    DURATION,
    ENDED,
    ERROR,
    EVENT,
    FREQUENCY,
    GROWTH,
    HELD,
    KEPT,
    LEAST,
    NEAR,
    NEW_X,
    OFFSET,
    PIECE,
    RATE_OF_X,
    READY,
    ROUNDING,
    SIGMA,
    SLOPE,
    SLOPES,
    SPENT,
    START,
    STEP,
    TIGHTNESS,
    TRIAL,
    UNTIL,
    D,
    P,
    Q,
    T,
    X,
    Y,
)

RESTS = 6
"""Status of a film at rest under a field that is held without end, beside those of `rows.py`."""

SIGNATURE = (
    "int8[::1], float64[:, ::1], int64[:, ::1], float64[:, ::1], int64, int64, boolean, "
    "float64[::1], float64[::1], float64, "
    "int8[::1], float64[::1], float64[:, ::1], int64[::1], float64[:, :, ::1]"
)
SIGNATURE_WITHIN = (
    "int8[::1], float64[:, ::1], int64[:, ::1], float64[:, ::1], int64[::1], "
    "float64[::1], float64[::1], float64[:, ::1], float64[::1], float64[:, ::1]"
)

# Rows of a recorded step: where it starts,
(
    CYCLE,  # cycles completed before
    OFFSET_0,  # time of the start of the piece, within the cycle
    PIECE_0,
    T_0,  # time within the piece
    BASE_0,
    Y_0,
    X_0,
    SLOPE_0,
    HELD_0,
    LENGTH,
    # stretch reached while the field jumped before it, stretch and field at both ends, their logarithmic rates,
    REACHED,
    STRETCH_0,
    STRETCH_1,
    FIELD_0,
    FIELD_1,
    STRETCH_RATE_0,
    STRETCH_RATE_1,
    FIELD_RATE_0,
    FIELD_RATE_1,
    # and at its end: relative error of the stretch.
    ERROR_1,
) = range(20)
RECORDED = 20

# Distance from rest, over r, below which nothing more is to come: that of rounding, or the error allowed in a step.
AT_REST = 1e-13
# Steps of a sine, at least, in a period: of an extreme of the field and a zero there is one at most in a step.
PER_PERIOD = 8.0


def make_record(law: Law, waves: Waves, lanes: int = LANES) -> Kernel:
    """Make the compiled ``record``; see the package for the program.

    After the program: ``one_cycle``, whether to stop at the end of every cycle; modulus ratio and dead load;
    ``closeness``, the distance to the instability, over the time in the piece, at which a film is NEAR; and of each
    film ``state``, ``cycles``, ``kept`` (KEPT, films), ``count`` and ``steps`` (RECORDED, films, room).
    """
    attempt, judge, take, go_on = make_passage(law, waves, False)[:4]
    stretch_of = law.stretch
    field, field_rate = waves.field, waves.rate

    @device
    def rate_of_stretch(x, rate):
        """Logarithmic rate of the stretch, which is a power of the unknown."""
        return rate / x * (np.log(stretch_of(4.0)) / np.log(4.0))

    @device
    def begin_again(kind, scale, source, columns, repeats, once, cycles, kept, film):
        cycles[film] += 1.0
        E = field_at_end(kind, scale, source, columns, kind.size - 1, film)
        kept[BASE, film] += kept[Y, film]
        kept[Y, film] = 0.0
        kept[T, film] = BEGINS
        kept[X, film] = E
        kept[OFFSET, film] = 0.0
        if cycles[film] == repeats:
            kept[HELD, film] = abs(E)
        else:
            kept[PIECE, film] = once
            kept[UNTIL, film] = kind.size

    @device
    def write(w, i, before, step, film, number, steps, cycles):
        steps[CYCLE, film, number] = cycles
        steps[OFFSET_0, film, number] = w[OFFSET, i]
        steps[PIECE_0, film, number] = w[PIECE, i]
        steps[T_0, film, number] = before[0, i]
        steps[BASE_0, film, number] = w[BASE, i]
        steps[Y_0, film, number] = before[1, i]
        steps[X_0, film, number] = before[2, i]
        steps[SLOPE_0, film, number] = before[3, i]
        steps[HELD_0, film, number] = w[HELD, i]
        steps[LENGTH, film, number] = step
        x0, x1 = before[2, i], w[X, i]
        steps[REACHED, film, number] = stretch_of(min(x0, before[5, i]))
        steps[STRETCH_0, film, number] = stretch_of(x0)
        steps[STRETCH_1, film, number] = stretch_of(x1)
        start, slope, amplitude, frequency = w[START, i], w[SLOPE, i], w[AMPLITUDE, i], w[FREQUENCY, i]
        early, late = before[0, i], before[0, i] + step
        E0 = field(early, start, slope, amplitude, frequency)
        E1 = field(late, start, slope, amplitude, frequency)
        steps[FIELD_0, film, number] = E0
        steps[FIELD_1, film, number] = E1
        steps[STRETCH_RATE_0, film, number] = rate_of_stretch(x0, before[4, i])
        steps[STRETCH_RATE_1, film, number] = rate_of_stretch(x1, w[RATE_OF_X, i])
        steps[FIELD_RATE_0, film, number] = field_rate(early, start, slope, amplitude, frequency) / E0 if E0 else 0.0
        steps[FIELD_RATE_1, film, number] = field_rate(late, start, slope, amplitude, frequency) / E1 if E1 else 0.0
        # dr at a fixed load changes the stretch by more the closer the instability is; see `local` of the law.
        r = w[BASE, i] + w[Y, i]
        stretch = stretch_of(x1)
        u = 1.0 / (stretch * stretch)
        z = r * u
        amplified = max(0.5, abs(0.5 + 0.25 * w[GROWTH, i] / (u * (1.0 / (z * z) + 2.0 * z))))
        steps[ERROR_1, film, number] = amplified * total_error(w[ERROR, i], w[ROUNDING, i]) / r

    def record(
        kind,
        scale,
        source,
        columns,
        repeats,
        once,
        one_cycle,
        modulus_ratio,
        dead_load,
        closeness,
        state,
        cycles,
        kept,
        count,
        steps,
    ):
        p = modulus_ratio - 1.0
        films = np.arange(state.size)
        room = steps.shape[2]
        w = np.zeros((ROWS, lanes))
        before = np.zeros((6, lanes))
        held, again = np.empty(lanes, np.int64), np.empty(lanes, np.int64)
        for i in range(lanes):
            held[i] = VACANT
            again[i] = VACANT
            w[BASE, i] = 1.0
            w[X, i] = 1.0
        following, busy = 0, 0
        while True:
            for i in range(lanes):
                while held[i] == VACANT and (again[i] != VACANT or following < state.size):
                    film = again[i]
                    if film == VACANT:
                        film = following
                        following += 1
                    again[i] = VACANT
                    if state[film] != READY:
                        continue
                    now = take(kind, scale, source, columns, p, dead_load, films, kept, w, i, film)
                    if now == READY:
                        held[i] = film
                        busy += 1
                        continue
                    for row in range(KEPT):
                        kept[row, film] = w[row, i]
                    if now == ENDED and not one_cycle:
                        begin_again(kind, scale, source, columns, repeats, once, cycles, kept, film)
                        again[i] = film
                    else:
                        state[film] = now
            if busy == 0:
                return
            for i in range(lanes):
                length = min(w[STEP, i], w[DURATION, i] - w[T, i])
                if w[FREQUENCY, i] > 0.0 and length * w[FREQUENCY, i] * PER_PERIOD > 1.0:
                    length = 1.0 / (PER_PERIOD * w[FREQUENCY, i])
                w[TRIAL, i] = length if held[i] != VACANT else 0.0
                w[BARRED, i] = 0.0  # in time to the end
                before[0, i] = w[T, i]
                before[1, i] = w[Y, i]
                before[2, i] = w[X, i]
                before[3, i] = w[SLOPES, i]
                before[4, i] = w[RATE_OF_X, i]
                before[5, i] = w[LEAST, i]
            attempt(w)
            judge(w)
            for i in range(lanes):
                film = held[i]
                if film == VACANT:
                    continue
                if w[T, i] > before[0, i]:
                    write(w, i, before, w[TRIAL, i], film, count[film], steps, cycles[film])
                    count[film] += 1
                    w[LEAST, i] = math.inf
                now = READY
                # The tangent of D**2 ends at the instability.
                ahead = -0.5 * w[D, i] * w[D, i] / w[Q, i] if w[Q, i] < 0.0 else math.inf
                if w[EVENT, i] == PIECE_DONE:
                    w[LEAST, i] = math.inf
                    now = go_on(kind, scale, source, columns, film, w, i)
                elif w[EVENT, i] == TOO_MANY:
                    now = SPENT
                elif ahead <= closeness * min(w[DURATION, i], w[OFFSET, i] + w[T, i]):
                    now = NEAR
                elif w[HELD, i] >= 0.0 and w[GROWTH, i] < 0.0:
                    away = abs(w[SLOPES, i] / w[GROWTH, i])
                    close = max(AT_REST, 1.0 / w[TIGHTNESS, i]) * (w[BASE, i] + w[Y, i])
                    now = RESTS if away <= close else READY
                if now != READY or count[film] == room:
                    for row in range(KEPT):
                        kept[row, film] = w[row, i]
                    held[i] = VACANT
                    busy -= 1
                    if now == ENDED and not one_cycle:
                        begin_again(kind, scale, source, columns, repeats, once, cycles, kept, film)
                        again[i] = film if count[film] < room else VACANT
                    else:
                        state[film] = now

    return Kernel(record, SIGNATURE)


def make_within(law: Law, waves: Waves, lanes: int = LANES) -> Kernel:
    """Make the compiled ``within``; see the package for the program.

    After the program, for each state asked for: its ``film``; then, of films, modulus ratio and dead load; of states
    the recorded ``start`` (RECORDED, states), the ``length`` to go from there, and the ``found`` (2, states): stretch
    and field.
    """
    attempt = make_passage(law, waves, False).attempt
    stretch_of, field = law.stretch, waves.field

    def within(kind, scale, source, columns, film, modulus_ratio, dead_load, start, length, found):
        w = np.zeros((ROWS, lanes))
        for i in range(lanes):
            w[BASE, i] = 1.0
            w[X, i] = 1.0
        for first in range(0, length.size, lanes):
            for i in range(lanes):
                number = first + i
                w[TRIAL, i] = 0.0
                if number < length.size:
                    piece, held = np.int64(start[PIECE_0, number]), start[HELD_0, number]
                    if piece < kind.size:
                        begin, slope, amplitude, frequency, _ = describe(
                            kind, scale, source, columns, piece, film[number]
                        )
                    else:
                        begin, slope, amplitude, frequency = held, 0.0, 0.0, 0.0
                    w[START, i] = begin
                    w[SLOPE, i] = slope
                    w[AMPLITUDE, i] = amplitude
                    w[FREQUENCY, i] = frequency
                    w[P, i] = modulus_ratio[film[number]] - 1.0
                    w[SIGMA, i] = dead_load[film[number]]
                    w[T, i] = start[T_0, number]
                    w[BASE, i] = start[BASE_0, number]
                    w[Y, i] = start[Y_0, number]
                    w[X, i] = start[X_0, number]
                    w[SLOPES, i] = start[SLOPE_0, number]
                    w[TRIAL, i] = length[number]
            attempt(w)
            for i in range(min(lanes, length.size - first)):
                late = w[T, i] + w[TRIAL, i]
                found[0, first + i] = stretch_of(w[NEW_X, i]) if w[BAD, i] == 0.0 else math.nan
                found[1, first + i] = field(late, w[START, i], w[SLOPE, i], w[AMPLITUDE, i], w[FREQUENCY, i])

    return Kernel(within, SIGNATURE_WITHIN)
