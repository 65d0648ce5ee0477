"""Stretch and internal stretch at given times: the first lane steps, the others give the states within its step.

A state within a step is one more Runge-Kutta step from the same start, of the length that ends on it, as accurate as
the step itself and in the same vector instructions; nothing is kept but what is asked for.
"""

import math

import numpy as np

from .._jit import Kernel, device
from .cells import LANES, LARGEST_TIGHTNESS, SHARE
from .law import Law
from .march import CLOSE, NOTHING, PIECE_DONE, ROWS, make_passage, total_error
from .pieces import Waves, field_at_end
from .rows import (
    BAD,
    BARRED,
    BASE,
    BEGINS,
    DURATION,
    ENDED,
    ERROR,
    EVENT,
    GROWTH,
    HELD,
    KEPT,
    NEW,
    NEW_X,
    OFFSET,
    PIECE,
    READY,
    RESOLUTION,
    ROUNDING,
    STEP,
    TIGHTNESS,
    TRIAL,
    UNTIL,
    T,
    X,
    Y,
)

SIGNATURE = (
    "int8[::1], float64[:, ::1], int64[:, ::1], float64[:, ::1], int64, int64, "
    "float64[::1], float64[::1], float64[::1], float64, "
    "float64[:, ::1], int64[::1], float64[:, ::1], float64[:, ::1]"
)

# Repetitions with shorter steps.
REPETITIONS = 4


def make_trajectory(law: Law, waves: Waves, lanes: int = LANES) -> Kernel:
    """Make the compiled trajectories under general loading programs; see the package for its arguments."""
    attempt, judge, take, go_on = make_passage(law, waves, False)[:4]
    stretch_of = law.stretch

    @device
    def amplified(w):
        """By how much more the stretch changes than r, both relatively, at a fixed load, in the first lane."""
        stretch = stretch_of(w[X, 0])
        u = 1.0 / (stretch * stretch)
        z = (w[BASE, 0] + w[Y, 0]) * u
        return abs(0.5 + 0.25 * w[GROWTH, 0] / (u * (1.0 / (z * z) + 2.0 * z)))

    def trajectory(
        kind,
        scale,
        source,
        columns,
        repeats,
        once,
        modulus_ratio,
        start_stretch,
        dead_load,
        tolerance,
        times,
        wanted,
        stretch,
        internal_stretch,
    ):
        p = modulus_ratio - 1.0
        cells = np.zeros(1, np.int64)
        kept = np.zeros((KEPT, 1))
        w = np.zeros((ROWS, lanes))
        for cell in range(modulus_ratio.size):
            cells[0] = cell
            asked = times[cell]
            count = wanted[cell]
            tightness = 1.0 / (SHARE * tolerance)
            for _ in range(REPETITIONS):
                stretch[cell, :] = math.nan
                internal_stretch[cell, :] = math.nan
                kept[:, 0] = 0.0
                kept[T, 0] = BEGINS
                kept[BASE, 0] = start_stretch[cell] * start_stretch[cell]
                kept[TIGHTNESS, 0] = tightness
                kept[RESOLUTION, 0] = math.inf  # extremes on the way are of no interest
                kept[HELD, 0] = -1.0
                kept[UNTIL, 0] = once if once > 0 else kind.size
                state = take(kind, scale, source, columns, p, dead_load, cells, kept, w, 0, 0)
                passed, cycles, sample, excess = 0.0, 0.0, 0, 0.0
                while (state == READY or state == ENDED) and sample < count:  # noqa: PLR1714, SIM109 -- compiled
                    if state == ENDED:
                        cycles += 1.0
                        passed += w[OFFSET, 0]
                        E = field_at_end(kind, scale, source, columns, kind.size - 1, cell)
                        kept[:, 0] = w[:KEPT, 0]
                        kept[BASE, 0] = w[BASE, 0] + w[Y, 0]
                        kept[Y, 0] = 0.0
                        kept[T, 0] = BEGINS
                        kept[X, 0] = E
                        kept[OFFSET, 0] = 0.0
                        if cycles == repeats:
                            kept[HELD, 0] = abs(E)
                        else:
                            kept[PIECE, 0] = once
                            kept[UNTIL, 0] = kind.size
                        state = take(kind, scale, source, columns, p, dead_load, cells, kept, w, 0, 0)
                        continue
                    now = passed + w[OFFSET, 0]
                    while sample < count and asked[sample] <= now + w[T, 0]:
                        stretch[cell, sample] = stretch_of(w[X, 0])
                        internal_stretch[cell, sample] = np.sqrt(w[BASE, 0] + w[Y, 0])
                        sample += 1
                    if sample == count:
                        break
                    if w[HELD, 0] >= 0.0:
                        w[DURATION, 0] = 2.0 * (asked[count - 1] - now) + 1.0
                    length = min(w[STEP, 0], w[DURATION, 0] - w[T, 0])
                    last = min(sample + lanes - 2, count - 1)
                    length = min(length, max(asked[last] - now - w[T, 0], 1e-12 * w[STEP, 0]))
                    w[TRIAL, 0] = length
                    w[BARRED, 0] = 0.0  # in time to the end: steps that shrink to nothing are the failure
                    for i in range(1, lanes):
                        for row in range(ROWS):
                            w[row, i] = w[row, 0]
                        number = sample + i - 1
                        within = asked[number] - now - w[T, 0] if number < count else 0.0
                        w[TRIAL, i] = within if within <= length else 0.0
                    before, first = w[T, 0], sample
                    attempt(w)
                    judge(w)
                    if w[T, 0] > before:
                        for i in range(1, lanes):
                            over = asked[sample] >= now + w[DURATION, 0] if sample < count else True
                            if over or w[TRIAL, i] == 0.0 or w[BAD, i] != 0.0:
                                break
                            stretch[cell, sample] = stretch_of(w[NEW_X, i])
                            internal_stretch[cell, sample] = np.sqrt(w[BASE, i] + w[NEW, i])
                            sample += 1
                        if sample > first or asked[sample] <= now + w[T, 0]:
                            error = total_error(w[ERROR, 0], w[ROUNDING, 0]) / (w[BASE, 0] + w[Y, 0])
                            excess = max(excess, error * max(0.5, amplified(w)))
                    if w[EVENT, 0] == PIECE_DONE:
                        while sample < count and asked[sample] < now + w[DURATION, 0]:  # at rest
                            stretch[cell, sample] = stretch_of(w[X, 0])
                            internal_stretch[cell, sample] = np.sqrt(w[BASE, 0] + w[Y, 0])
                            sample += 1
                        if w[HELD, 0] >= 0.0:
                            break
                        state = go_on(kind, scale, source, columns, cell, w, 0)
                    elif w[EVENT, 0] != NOTHING and w[EVENT, 0] != CLOSE:
                        break
                if excess <= tolerance or tightness >= LARGEST_TIGHTNESS:
                    break
                tightness = min(tightness * max(3.0 * excess / tolerance, 10.0), LARGEST_TIGHTNESS)

    return Kernel(trajectory, SIGNATURE)
