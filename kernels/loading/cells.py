"""Cells from t = 0 to their outcome: passages through the program, one after another, and the verdicts.

A program that ends constant is decided by the load held at the end, a repeated one by the map P of r from the start of
a cycle to its end, which is increasing: a film survives if P(r1) <= r1 for one r1 that it has not passed.
"""

import math

import numpy as np

from .._jit import Kernel, device
from ..lane_state import BUDGET_SPENT, FAILED, FAILS_AT_ONCE, RUNNING, SURVIVES
from ..model import CRITICAL_LOAD
from .finish import make_finish
from .law import Law
from .march import EPSILON, make_march, total_error
from .pieces import ENDLESS, Waves, describe, field_at_end
from .results import (
    CRITICAL_FIELD,
    CRITICAL_INTERNAL_STRETCH,
    CRITICAL_STRETCH,
    CYCLES_TO_FAILURE,
    FINAL_STRETCH,
    LARGEST_STRETCH,
    RESULTS,
    STEADY_STRETCH_MAX,
    STEADY_STRETCH_MIN,
    TIME_TO_FAILURE,
)
from .rows import (
    BASE,
    DOUBT,
    ENDED,
    ERROR,
    FELL,
    GAIN,
    HELD,
    JUMPED,
    KEPT,
    LEAST,
    MOST,
    NEAR,
    OFFSET,
    PIECE,
    READY,
    RESOLUTION,
    ROUNDING,
    STEP,
    TIGHTNESS,
    TIME_ERROR,
    T,
    X,
    Y,
)

LANES = 16
SIGNATURE = (
    "int8[::1], float64[:, ::1], int64[:, ::1], float64[:, ::1], int64, "
    "float64[::1], float64[::1], float64[::1], float64, "
    "int8[::1], float64[:, :]"
)

# What a passage of a cell is for.
CYCLING = 0  # the cell's own way
FIXING = 1  # towards the fixed point of the map of a cycle
PROVING = 2  # from beside it: the certificate

# Share of the error allowed in a result that a step may take, at first.
SHARE = 0.3
LARGEST_TIGHTNESS = 1e16
# Doubt from which on whether a film got past the instability is not decided.
DOUBTFUL = 0.25
# Iterations towards a fixed point before cycling goes on.
ITERATIONS = 12
# Cycles in all that a cell is taken through one by one.
CYCLES = 100_000

# Rows of what is kept of a cell, beside its passage.
COMPLETED = 0  # cycles
NEXT_TRIAL = 1  # cycle after which to look for a fixed point (again)
PURPOSE = 2
ITERATION = 3
LAST_R = 4  # of the search for the fixed point: the start before, and the change over the cycle
LAST_CHANGE = 5
RETURN_R = 6  # where cycling goes on after a search in vain
RETURN_ERROR = 7
LARGEST = 8  # least unknown on the cell's own way
CYCLE_TIME = 9
LIMIT_LEAST = 10  # of the limit cycle
LIMIT_MOST = 11
RETURN_DOUBT = 12
RETURN_ROUNDING = 13
TRIED = 14
NOTES = 15


def make_sweep(law: Law, waves: Waves, lanes: int = LANES) -> Kernel:
    """Make the compiled sweep of general loading programs; see the package for its arguments."""
    march = make_march(law, waves, lanes)
    finish = make_finish(law, waves, lanes)
    critical, load, stretch, relaxed_at, ends = law.critical, law.load, law.stretch, law.relaxed_at, law.ends
    field_in, field_rate = waves.field, waves.rate

    @device
    def set_out(kept, cell, r, field, tightness, resolution):
        """Set a passage at the beginning of the program, after a field."""
        for row in range(KEPT):
            kept[row, cell] = 0.0
        kept[T, cell] = -1.0
        kept[BASE, cell] = r
        kept[X, cell] = field
        kept[TIGHTNESS, cell] = tightness
        kept[RESOLUTION, cell] = resolution
        kept[LEAST, cell] = math.inf
        kept[HELD, cell] = -1.0

    @device
    def write_failure(kind, scale, source, columns, kept, notes, p, sigma, tolerance, state, cell, result):
        """Write what a failed cell found; by how much its errors exceed what is allowed."""
        r = kept[BASE, cell] + kept[Y, cell]
        x = critical(r, p[cell], sigma[cell])
        time = notes[COMPLETED, cell] * notes[CYCLE_TIME, cell] + (kept[OFFSET, cell] + kept[T, cell])
        _, load_of_r, _ = ends(r, p[cell], sigma[cell], x)
        carried = load(r, p[cell], sigma[cell], x)
        capacity = np.sqrt(carried / CRITICAL_LOAD)
        field = capacity
        field_error = abs(load_of_r) * kept[ERROR, cell] / (2.0 * carried)
        time_error = 0.0
        if state == FELL:
            piece = np.int64(kept[PIECE, cell])
            E, rate = kept[HELD, cell], 0.0
            if piece < kind.size:
                start, slope, amplitude, frequency, _ = describe(kind, scale, source, columns, piece, cell)
                E = field_in(kept[T, cell], start, slope, amplitude, frequency)
                rate = field_rate(kept[T, cell], start, slope, amplitude, frequency)
            time_error = kept[TIME_ERROR, cell]
            by_time = abs(rate) * time_error / max(abs(E), 1e-300)
            field = abs(E) if by_time < field_error else capacity
            field_error = min(by_time, field_error)
        result[TIME_TO_FAILURE, cell] = time
        result[CRITICAL_STRETCH, cell] = stretch(x)
        result[CRITICAL_INTERNAL_STRETCH, cell] = np.sqrt(r)
        result[CRITICAL_FIELD, cell] = field
        result[LARGEST_STRETCH, cell] = stretch(min(notes[LARGEST, cell], kept[LEAST, cell], x))
        excess = max(time_error / (time + 1e-300), field_error, 0.5 * kept[ERROR, cell] / r) / tolerance
        return max(excess, kept[DOUBT, cell] / DOUBTFUL)

    def sweep(
        kind,
        scale,
        source,
        columns,
        repeats,
        modulus_ratio,
        start_stretch,
        dead_load,
        tolerance,
        status,
        result,
    ):
        count = modulus_ratio.size
        p = modulus_ratio - 1.0
        cells = np.arange(count)
        state = np.empty(count, np.int8)
        kept = np.empty((KEPT, count))
        notes = np.zeros((NOTES, count))
        tightness = 1.0 / (SHARE * tolerance)
        resolution = 0.1 * tolerance
        for cell in range(count):
            status[cell] = RUNNING
            for row in range(RESULTS):
                result[row, cell] = math.nan
            set_out(kept, cell, start_stretch[cell] * start_stretch[cell], 0.0, tightness, resolution)
            state[cell] = READY
            notes[NEXT_TRIAL, cell] = 2.0
            notes[LARGEST, cell] = math.inf
        while True:
            while True:
                march(kind, scale, source, columns, p, dead_load, cells, state, kept)
                near = 0
                for cell in range(count):
                    near += state[cell] == NEAR
                if near == 0:
                    break
                finish(kind, scale, source, columns, p, dead_load, cells, state, kept)
            running = 0
            for cell in range(count):
                if status[cell] != RUNNING:
                    continue
                sigma = dead_load[cell]
                failed = state[cell] == FELL or state[cell] == JUMPED
                excess = 0.0
                verdict = RUNNING
                spent = state[cell] != FELL and state[cell] != JUMPED and state[cell] != ENDED
                E = field_at_end(kind, scale, source, columns, kind.size - 1, cell)
                purpose = notes[PURPOSE, cell]
                r = kept[BASE, cell] + kept[Y, cell]
                if spent:
                    verdict, excess = FAILED, 1e4  # lost beside the instability: once more, with shorter steps
                elif failed and purpose == CYCLING:
                    excess = write_failure(
                        kind, scale, source, columns, kept, notes, p, dead_load, tolerance, state[cell], cell, result
                    )
                    verdict = FAILED
                    if result[TIME_TO_FAILURE, cell] == 0.0:
                        verdict = FAILS_AT_ONCE
                        result[CRITICAL_FIELD, cell] = (
                            np.sqrt(modulus_ratio[cell]) if sigma == 0.0 and r == 1.0 else result[CRITICAL_FIELD, cell]
                        )
                    elif repeats != 1:
                        # Under the load held at the end all repetitions are completed, the last one counted here again.
                        again = 1.0 if kept[HELD, cell] >= 0.0 else 0.0
                        result[CYCLES_TO_FAILURE, cell] = notes[COMPLETED, cell] + again
                elif purpose == CYCLING:
                    notes[COMPLETED, cell] += 1.0
                    notes[CYCLE_TIME, cell] = kept[OFFSET, cell]
                    notes[LARGEST, cell] = min(notes[LARGEST, cell], kept[LEAST, cell])
                    if notes[COMPLETED, cell] == repeats:
                        # The load held at the end decides.
                        held = abs(E)
                        top = critical(1.0, 0.0, sigma)
                        largest = load(1.0, 0.0, sigma, top)
                        e = CRITICAL_LOAD * held * held
                        carried = held <= 1.0 if sigma == 0.0 else e <= largest
                        close = sigma > 0.0 and abs(e - largest) <= 8.0 * EPSILON * largest
                        stable, unstable = relaxed_at(sigma, held, top)
                        ratio = stretch(unstable)
                        turning = ratio * ratio
                        if close:
                            status[cell] = BUDGET_SPENT
                            continue
                        excess = kept[DOUBT, cell] / DOUBTFUL
                        if carried:
                            error = total_error(kept[ERROR, cell], kept[ROUNDING, cell])
                            excess = max(excess, 3.0 * error / abs(turning - r))
                        if carried and (r <= turning or p[cell] == 0.0):
                            verdict = SURVIVES
                            result[FINAL_STRETCH, cell] = stretch(stable)
                            result[LARGEST_STRETCH, cell] = max(stretch(notes[LARGEST, cell]), stretch(stable))
                        else:
                            # It fails under the load held: one more piece, without end.
                            notes[COMPLETED, cell] -= 1.0
                            kept[HELD, cell] = held
                            kept[T, cell] = -1.0
                            kept[X, cell] = held
                            kept[STEP, cell] = 0.0
                            state[cell] = READY
                    elif kept[TIGHTNESS, cell] < LARGEST_TIGHTNESS and (
                        total_error(kept[ERROR, cell], kept[ROUNDING, cell]) > 2.0 * tolerance * r
                        or kept[DOUBT, cell] > DOUBTFUL
                    ):
                        verdict, excess = FAILED, 10.0  # in vain: errors that are too large have only grown since
                    elif notes[COMPLETED, cell] >= CYCLES:
                        status[cell] = BUDGET_SPENT
                        continue
                    else:
                        change, error, doubt = kept[Y, cell], kept[ERROR, cell], kept[DOUBT, cell]
                        rounding = kept[ROUNDING, cell]
                        ratio = np.exp(kept[GAIN, cell])
                        step, base = kept[STEP, cell], kept[BASE, cell]
                        allowed = kept[TIGHTNESS, cell]
                        set_out(kept, cell, r, E, allowed, resolution)
                        kept[STEP, cell] = 0.0 * step
                        state[cell] = READY
                        if repeats == ENDLESS and notes[COMPLETED, cell] >= notes[NEXT_TRIAL, cell] and ratio < 1.0:
                            notes[RETURN_R, cell] = r
                            notes[RETURN_ERROR, cell] = error
                            notes[RETURN_DOUBT, cell] = doubt
                            notes[RETURN_ROUNDING, cell] = rounding
                            notes[PURPOSE, cell] = FIXING
                            notes[ITERATION, cell] = 0.0
                            notes[LAST_R, cell] = base
                            notes[LAST_CHANGE, cell] = change
                            kept[BASE, cell] = max(base + change / (1.0 - ratio), r)
                        else:
                            kept[ERROR, cell] = error
                            kept[DOUBT, cell] = doubt
                            kept[ROUNDING, cell] = rounding
                else:
                    # On the way to the fixed point, or beside it.
                    start, change = kept[BASE, cell], kept[Y, cell]
                    error = total_error(kept[ERROR, cell], kept[ROUNDING, cell])
                    ratio = np.exp(kept[GAIN, cell])
                    allowed = kept[TIGHTNESS, cell]
                    vain = failed or kept[DOUBT, cell] > DOUBTFUL
                    noise = error + EPSILON * start
                    if purpose == PROVING and not vain:
                        if change + error <= 0.0:
                            verdict = SURVIVES
                            highest = min(notes[LIMIT_LEAST, cell], notes[LARGEST, cell])
                            result[STEADY_STRETCH_MAX, cell] = stretch(notes[LIMIT_LEAST, cell])
                            result[STEADY_STRETCH_MIN, cell] = stretch(notes[LIMIT_MOST, cell])
                            result[LARGEST_STRETCH, cell] = stretch(highest)
                        elif notes[TRIED, cell] < 4.0:
                            notes[TRIED, cell] += 1.0
                            distance = start - notes[LAST_R, cell]
                            set_out(kept, cell, notes[LAST_R, cell] + 8.0 * distance, E, allowed, resolution)
                            state[cell] = READY
                        else:
                            vain = True
                    elif not vain:
                        notes[ITERATION, cell] += 1.0
                        slope = (change - notes[LAST_CHANGE, cell]) / (start - notes[LAST_R, cell])
                        if not (slope < 0.0) or not (slope > -1.0):
                            slope = ratio - 1.0
                        following = start - change / slope
                        notes[LAST_R, cell] = start
                        notes[LAST_CHANGE, cell] = change
                        if not slope < 0.0:
                            vain = True
                        elif abs(following - start) <= 0.05 * tolerance * start or abs(change) <= noise:
                            notes[LIMIT_LEAST, cell] = kept[LEAST, cell]
                            notes[LIMIT_MOST, cell] = kept[MOST, cell]
                            notes[PURPOSE, cell] = PROVING
                            notes[TRIED, cell] = 0.0
                            beside = max(following, start) + 4.0 * noise / -slope
                            set_out(kept, cell, beside, E, allowed, resolution)
                            state[cell] = READY
                        elif notes[ITERATION, cell] >= ITERATIONS:
                            vain = True
                        else:
                            set_out(kept, cell, max(following, notes[RETURN_R, cell]), E, allowed, resolution)
                            state[cell] = READY
                    if vain and purpose == PROVING:
                        # There is a fixed point, too close to failure for these errors.
                        verdict, excess = SURVIVES, 100.0
                    elif vain:
                        notes[PURPOSE, cell] = CYCLING
                        notes[NEXT_TRIAL, cell] = 2.0 * notes[COMPLETED, cell] + 1.0
                        set_out(kept, cell, notes[RETURN_R, cell], E, allowed, resolution)
                        kept[ERROR, cell] = notes[RETURN_ERROR, cell]
                        kept[DOUBT, cell] = notes[RETURN_DOUBT, cell]
                        kept[ROUNDING, cell] = notes[RETURN_ROUNDING, cell]
                        state[cell] = READY
                if verdict != RUNNING:
                    if excess <= 1.0:
                        status[cell] = verdict
                        continue
                    # Less accurate than asked: once more, with shorter steps.
                    allowed = kept[TIGHTNESS, cell] * (max(3.0 * excess, 10.0) if excess < 3e3 else 1e4)
                    for row in range(RESULTS):
                        result[row, cell] = math.nan
                    if kept[TIGHTNESS, cell] >= LARGEST_TIGHTNESS:
                        status[cell] = BUDGET_SPENT
                        continue
                    for row in range(NOTES):
                        notes[row, cell] = 0.0
                    notes[NEXT_TRIAL, cell] = 2.0
                    notes[LARGEST, cell] = math.inf
                    r = start_stretch[cell] * start_stretch[cell]
                    set_out(kept, cell, r, 0.0, min(allowed, LARGEST_TIGHTNESS), resolution)
                    state[cell] = READY
                running += 1
            if running == 0:
                break

    return Kernel(sweep, SIGNATURE)
