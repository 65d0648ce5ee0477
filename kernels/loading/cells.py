"""Cells from t = 0 to their outcome: passages through the program, one after another, and the verdicts.

A program that ends constant is decided by the load held at the end, a repeated one by the map P of r from the start of
a cycle to its end, which is increasing: a film survives if P(r1) <= r1 for one r1 that it has not passed. Few cycles
are gone through one by one; many follow from a few, see `cycles`.
"""

import math

import numpy as np

from .._jit import Kernel, device
from ..lane_state import BUDGET_SPENT, FAILED, FAILS_AT_ONCE, RUNNING, SURVIVES
from ..model import CRITICAL_LOAD
from .cycles import COUNTS, NODES, POINTS, advance, change_at, fit, place
from .finish import make_finish
from .held import make_hold
from .law import ELASTIC, Law
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
    BEGINS,
    DOUBT,
    ENDED,
    ERROR,
    FELL,
    FIRST_STEP,
    GAIN,
    HELD,
    HOLDS,
    JUMPED,
    KEPT,
    LEAST,
    LEAST_ERROR,
    LEAST_SLOPE,
    MOST,
    NEAR,
    OFFSET,
    PIECE,
    REACH,
    REACH_R,
    REACH_X,
    READY,
    RESOLUTION,
    ROUNDING,
    SCALE,
    SPENT,
    STEP,
    TIGHTNESS,
    TIME_ERROR,
    UNTIL,
    WAITING,
    T,
    X,
    Y,
)
from .together import find_shared, set_out_together, take_over

LANES = 16
SIGNATURE = (
    "int8[::1], float64[:, ::1], int64[:, ::1], float64[:, ::1], int64, int64, "
    "float64[::1], float64[::1], float64[::1], float64, "
    "int8[::1], float64[:, :]"
)

# What a passage of a cell is for.
CYCLING = 0  # the cell's own way
FIXING = 1  # towards the fixed point of the map of a cycle
PROVING = 2  # from beside it: the certificate
SAMPLING = 3  # several, from points of a range of r: many cycles from few

# Share of the error allowed in a result that a step may take, at first.
SHARE = 0.3
LARGEST_TIGHTNESS = 1e16
# The error allowed in a result above which steps are no longer: measured, they are not fewer, and estimates are worse.
LOOSEST = 1e-4
# Doubt from which on whether a film got past the instability is not decided.
DOUBTFUL = 0.25
# Iterations towards a fixed point before cycling goes on.
ITERATIONS = 12
# Passages through a cycle of a cell, in all; and iterations of an interpolant that cost about as much as one.
CYCLES = 20_000
PER_PASSAGE = 100.0
# Passages from points of ranges of r that go on side by side.
ROOM = 64 * NODES
# Cycles one by one before many are tried.
BEFORE_MANY = 3
# Cycles that a range must hold to be worth its passages, over the number of these.
WORTH = 1.1
# Width of the first range, in changes of r over a cycle.
LEAST_WIDTH, MOST_WIDTH = 96.0, 1536.0
# What a range of r leaves of the way to R, or to an r whose cycle is not survived; and over the distance of R to the
# passage from which R was estimated, between those.
LEAST_ROOM, LARGEST_ROOM = 0.02, 0.08
UNSURE = 0.3
# The few points in a range are for tolerances above the first of these, and for less cycles than the second.
FINE, FEW_CYCLES = 1e-7, 1000.0
# Error of the number of cycles allowed in one range.
MISCOUNT = 0.005

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
FIRST_TIME = 9  # duration of the first cycle, and of the others
CYCLE_TIME = 10
LIMIT_LEAST = 11  # of the limit cycle
LIMIT_MOST = 12
RETURN_DOUBT = 13
RETURN_ROUNDING = 14
TRIED = 15
PROVED = 16  # r came back no larger from a cycle on the cell's own way
NEXT_SAMPLING = 17
WIDTH = 18  # of the range of r, negative where r falls
FIRST_NODE = 19
ONE_BY_ONE = 20  # passages through a cycle
USUAL_STEP = 21  # first step of a cycle, and its change of r
USUAL_CHANGE = 22
FAILING = 23  # least r known whose cycle is not survived
LARGEST_ERROR = 24  # relative error of the stretch at LARGEST, and of those of the limit cycle
LIMIT_ERROR = 25
BORDER = 26  # estimate of R; the start of the passage that it is from, and the change of r over that
BORDER_FROM = 27
BORDER_CHANGE = 28
CURVE = 29  # of the range of r, see `place`, and which number of points it has
CHOICE = 30
NOTES = 31


def make_sweep(law: Law, waves: Waves, lanes: int = LANES) -> Kernel:
    """Make the compiled sweep of general loading programs; see the package for its arguments."""
    march = make_march(law, waves, lanes)
    finish = make_finish(law, waves, lanes)
    hold = make_hold(law, lanes)
    critical, load, stretch, relaxed_at, ends = law.critical, law.load, law.stretch, law.relaxed_at, law.ends
    surplus = law.excess
    field_in, field_rate = waves.field, waves.rate

    @device
    def set_out(kept, cell, r, field, first, until, tightness, resolution, smallest):
        """Set a passage at the beginning of a piece, after a field; ``smallest``: with the smallest stretch."""
        for row in range(KEPT):
            kept[row, cell] = 0.0
        kept[PIECE, cell] = first
        kept[UNTIL, cell] = until
        kept[T, cell] = BEGINS
        kept[BASE, cell] = r
        kept[X, cell] = field
        kept[TIGHTNESS, cell] = tightness
        kept[RESOLUTION, cell] = resolution
        kept[LEAST, cell] = math.inf
        kept[MOST, cell] = 0.0 if smallest else math.inf
        kept[HELD, cell] = -1.0
        kept[GAIN, cell] = 1.0
        kept[REACH, cell] = math.inf

    @device
    def set_cycle(kept, notes, passage, cell, r, field, once, until, tightness, resolution, smallest):
        """Set a passage of a cell at the beginning of a cycle that is not the first one."""
        set_out(kept, passage, r, field, once, until, tightness, resolution, smallest)
        kept[STEP, passage] = notes[USUAL_STEP, cell]
        kept[SCALE, passage] = notes[USUAL_CHANGE, cell]

    @device
    def begin(kept, notes, cell, r, last, tightness, resolution):
        """Set a cell at t = 0."""
        for row in range(NOTES):
            notes[row, cell] = 0.0
        notes[NEXT_TRIAL, cell] = 2.0
        notes[NEXT_SAMPLING, cell] = BEFORE_MANY
        notes[LARGEST, cell] = math.inf
        notes[FAILING, cell] = math.inf
        notes[BORDER, cell] = math.inf
        notes[BORDER_CHANGE, cell] = math.inf
        set_out(kept, cell, r, 0.0, 0, last, tightness, resolution, False)

    @device
    def go_back(kept, notes, cell, field, once, pieces, resolution):
        """Go on cycling from where a search left."""
        notes[PURPOSE, cell] = CYCLING
        set_cycle(
            kept,
            notes,
            cell,
            cell,
            notes[RETURN_R, cell],
            field,
            once,
            pieces,
            kept[TIGHTNESS, cell],
            resolution,
            False,
        )
        kept[ERROR, cell] = notes[RETURN_ERROR, cell]
        kept[DOUBT, cell] = notes[RETURN_DOUBT, cell]
        kept[ROUNDING, cell] = notes[RETURN_ROUNDING, cell]

    @device
    def write_failure(kind, scale, source, columns, kept, notes, p, sigma, tolerance, state, cell, result):
        """Write what a failed cell found; by how much its errors exceed what is allowed."""
        r = kept[BASE, cell] + kept[Y, cell]
        x = critical(r, p[cell], sigma[cell])
        completed = notes[COMPLETED, cell]
        before = notes[FIRST_TIME, cell] + (completed - 1.0) * notes[CYCLE_TIME, cell] if completed > 0.0 else 0.0
        time = before + (kept[OFFSET, cell] + kept[T, cell])
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
        # Where the stretch was larger on the way, by more than is allowed.
        if min(notes[LARGEST, cell], kept[LEAST, cell]) < x * (1.0 - tolerance):
            earlier = notes[LARGEST, cell] < kept[LEAST, cell]
            excess = max(excess, (notes[LARGEST_ERROR, cell] if earlier else kept[LEAST_ERROR, cell]) / tolerance)
        return max(excess, kept[DOUBT, cell] / DOUBTFUL)

    @device
    def write_survival(notes, tolerance, cell, result):
        """Write the limit cycle; by how much its errors exceed what is allowed."""
        result[STEADY_STRETCH_MAX, cell] = stretch(notes[LIMIT_LEAST, cell])
        result[STEADY_STRETCH_MIN, cell] = stretch(notes[LIMIT_MOST, cell])
        result[LARGEST_STRETCH, cell] = stretch(min(notes[LIMIT_LEAST, cell], notes[LARGEST, cell]))
        error = notes[LIMIT_ERROR, cell]
        if notes[LARGEST, cell] < notes[LIMIT_LEAST, cell]:
            error = max(error, notes[LARGEST_ERROR, cell])
        return 2.0 * error / tolerance

    @device
    def root_of(series, choice, width, curve, low, high):
        """Return where in [low, high], counted from the start of the range, a series falls below zero."""
        for _ in range(50):
            middle = 0.5 * (low + high)
            if change_at(series, choice, width, curve, middle) > 0.0:
                low = middle
            else:
                high = middle
        return high

    @device
    def look_ahead(kept, notes, passage, cell, p, sigma):
        """Estimate R from where a passage came closest to the instability: r grows until there as it does there."""
        base = kept[BASE, passage]
        if base > notes[BORDER_FROM, cell] and kept[REACH, passage] < math.inf and p[cell] > ELASTIC:
            own = kept[REACH_R, passage]
            e = load(own, p[cell], sigma[cell], kept[REACH_X, passage])
            r, known = own, False
            for _ in range(10):  # Newton's method from below; where p is small it may not get there
                x = critical(r, p[cell], sigma[cell])
                _, load_of_r, _ = ends(r, p[cell], sigma[cell], x)
                step = (e - load(r, p[cell], sigma[cell], x)) / load_of_r
                r = r + step
                known = r >= own and abs(step) <= 1e-5 * r
                if known or not r >= own:
                    break
            notes[BORDER, cell] = r - (own - base) if known else math.inf
            notes[BORDER_FROM, cell] = base
            notes[BORDER_CHANGE, cell] = abs(kept[Y, passage])

    @device
    def set_range(notes, cell, width, rest, allowed):
        """Set the next range of r, from RETURN_R on, no wider than this; whether it is worth its passages."""
        r, change = notes[RETURN_R, cell], abs(notes[LAST_CHANGE, cell])
        away = min(notes[BORDER, cell], notes[FAILING, cell]) - r
        upward = notes[LAST_CHANGE, cell] > 0.0
        ahead = notes[BORDER, cell] - max(notes[BORDER_FROM, cell], r)
        room = max(min(UNSURE * ahead, LARGEST_ROOM * away), LEAST_ROOM * away) if away < math.inf else 0.0
        width = min(width, away - room) if upward else width
        cycles = min(width / np.sqrt(change * min(change, notes[BORDER_CHANGE, cell])), rest)
        choice = 0 if allowed * FINE < 1.0 / SHARE and cycles < FEW_CYCLES else 1
        notes[WIDTH, cell] = width if upward else -width
        notes[CURVE, cell] = width / away if upward else 0.0
        notes[CHOICE, cell] = choice
        return cycles >= WORTH * COUNTS[choice] and width > 64.0 * EPSILON * r

    @device
    def use_samples(kept, notes, state, cell, p, sigma, repeats, values, series):
        """Go through many cycles, or set a new range; the verdict on the range, and an excess of errors.

        The cell's purpose becomes SAMPLING, CYCLING, or FIXING from LAST_R and BASE.
        """
        first, choice = np.int64(notes[FIRST_NODE, cell]), np.int64(notes[CHOICE, cell])
        base, width, curve = notes[RETURN_R, cell], abs(notes[WIDTH, cell]), notes[CURVE, cell]
        sign = 1.0 if notes[WIDTH, cell] > 0.0 else -1.0
        nodes = COUNTS[choice]
        worst, good, largest = 0.0, 0, 0.0
        for j in range(nodes):
            slot = first + j
            if state[slot] != ENDED or kept[DOUBT, slot] > DOUBTFUL:
                notes[FAILING, cell] = min(notes[FAILING, cell], kept[BASE, slot])
                break
            values[j] = sign * kept[Y, slot]
            worst = max(worst, total_error(kept[ERROR, slot], kept[ROUNDING, slot]))
            largest = max(largest, abs(values[j]))
            good += 1
        if good > 0:
            look_ahead(kept, notes, first + good - 1, cell, p, sigma)
        allowed = kept[TIGHTNESS, cell]
        notes[ONE_BY_ONE, cell] += nodes
        following = 0.0
        if good < nodes:
            following = max(0.7 * width * place(POINTS[choice, good - 1], curve) if good > 0 else 0.0, 0.1 * width)
        else:
            left = fit(values, choice, series) + 4.0 * EPSILON * largest
            floor = 2.0 * (left + worst)
            below = -1
            if repeats == ENDLESS:
                for j in range(nodes):
                    if below < 0 and values[j] <= 0.0:
                        below = j
            if below >= 0:
                low = width * place(POINTS[choice, below - 1], curve) if below > 0 else 0.0
                high = width * place(POINTS[choice, below], curve)
                notes[LAST_R, cell] = base + sign * high
                notes[LAST_CHANGE, cell] = sign * values[below]
                kept[BASE, cell] = base + sign * root_of(series, choice, width, curve, low, high)
                notes[PURPOSE, cell] = FIXING
                return 0.0
            most = repeats - 1.0 - notes[COMPLETED, cell] if repeats != ENDLESS else math.inf
            s, cycles, grown, gathered, singles = advance(series, choice, width, curve, floor, most)
            notes[ONE_BY_ONE, cell] += singles / PER_PASSAGE
            here = change_at(series, choice, width, curve, s)
            stopped = not here > floor
            if stopped and repeats == ENDLESS:
                notes[LAST_R, cell] = base + sign * width * place(POINTS[choice, 0], curve)
                notes[LAST_CHANGE, cell] = sign * values[0]
                kept[BASE, cell] = base + sign * s
                notes[PURPOSE, cell] = FIXING
                return 0.0
            if stopped:
                cycles = most
            own = total_error(notes[RETURN_ERROR, cell], notes[RETURN_ROUNDING, cell])
            error = grown * own + gathered * worst
            allowance = max(abs(here) * min(MISCOUNT, cycles / allowed), 0.5 * error)
            if stopped or repeats != ENDLESS:
                allowance = max(allowance, 0.1 * base / allowed)
            missed = gathered * left
            factor = 0.8 * (allowance / (missed + 1e-300)) ** (1.0 / (nodes - 2.0))
            following = width * min(max(factor, 0.15), 8.0)
            if missed <= allowance and cycles >= 1.0:
                notes[COMPLETED, cell] += cycles
                notes[RETURN_R, cell] = base + sign * s
                notes[RETURN_ERROR, cell] = grown * notes[RETURN_ERROR, cell] + gathered * (left + worst)
                notes[RETURN_ROUNDING, cell] *= grown * grown
                notes[LAST_CHANGE, cell] = sign * here
                miscount = notes[RETURN_ERROR, cell] / abs(here)
                if repeats == ENDLESS and grown > 1.0 and miscount > DOUBTFUL:
                    return miscount / MISCOUNT
                following = max(following, 0.5 * width)
            else:
                following = min(following, 0.6 * width)
        rest = repeats - notes[COMPLETED, cell] if repeats != ENDLESS else math.inf
        if rest > 2.0 * WORTH * NODES and set_range(notes, cell, following, rest, allowed):
            notes[PURPOSE, cell] = SAMPLING
        else:
            notes[PURPOSE, cell] = CYCLING
            notes[NEXT_SAMPLING, cell] = notes[COMPLETED, cell] + 2.0 * NODES
        return 0.0

    def sweep(
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
        status,
        result,
    ):
        count = modulus_ratio.size
        pieces = kind.size
        room = ROOM if repeats != 1 else 0
        p = modulus_ratio - 1.0
        cells = np.empty(count + room, np.int64)
        state = np.empty(count + room, np.int8)
        kept = np.empty((count + room, KEPT)).T  # what is known of a passage lies together
        notes = np.empty((count, NOTES)).T
        values, series = np.empty(NODES), np.empty((3, NODES))
        resolution = 0.1 * tolerance
        shared, joint = np.empty(count, np.int64), np.empty(count, np.int64)
        fresh = np.ones(count, np.bool_)
        last = once if once > 0 else pieces
        uses = np.empty(columns.shape[0], np.int64)
        find_shared(scale, source, columns, modulus_ratio, start_stretch, dead_load, last, shared, uses)
        holding = 2.0 if repeats == 1 else 1.0  # in cycles that a film survives no held piece ends in failure
        for cell in range(count):
            cells[cell] = cell
            status[cell] = RUNNING
            for row in range(RESULTS):
                result[row, cell] = math.nan
            r = start_stretch[cell] * start_stretch[cell]
            begin(kept, notes, cell, r, last, 1.0 / (SHARE * min(tolerance, LOOSEST)), resolution)
        while True:
            used = count
            for cell in range(count if repeats != 1 else 0):
                if status[cell] == RUNNING and notes[PURPOSE, cell] == SAMPLING:
                    state[cell] = WAITING
                    notes[FIRST_NODE, cell] = -1.0
                    choice = np.int64(notes[CHOICE, cell])
                    if used + COUNTS[choice] <= count + room:
                        notes[FIRST_NODE, cell] = used
                        E = field_at_end(kind, scale, source, columns, pieces - 1, cell)
                        for j in range(COUNTS[choice]):
                            share = place(POINTS[choice, j], notes[CURVE, cell])
                            r = notes[RETURN_R, cell] + notes[WIDTH, cell] * share
                            set_cycle(
                                kept, notes, used, cell, r, E, once, pieces, kept[TIGHTNESS, cell], math.inf, False
                            )
                            state[used] = READY
                            cells[used] = cell
                            used += 1
            branch = set_out_together(shared, last, joint, fresh, state, kept)
            while True:
                march(kind, scale, source, columns, p, dead_load, cells[:used], state[:used], kept, holding)
                near, holds = 0, 0
                for passage in range(used):
                    near += state[passage] == NEAR
                    holds += state[passage] == HOLDS
                if near == 0 and holds == 0:
                    if branch == last:
                        break
                    branch = take_over(branch, last, joint, state, kept)
                if near > 0:
                    finish(kind, scale, source, columns, p, dead_load, cells[:used], state[:used], kept)
                if holds > 0:
                    hold(scale, source, columns, p, dead_load, cells[:used], state[:used], kept, tolerance)
            running = 0
            for cell in range(count):
                if status[cell] != RUNNING:
                    continue
                purpose = notes[PURPOSE, cell]
                if purpose == SAMPLING and notes[FIRST_NODE, cell] < 0.0:
                    running += 1
                    continue
                sigma = dead_load[cell]
                failed = state[cell] == FELL or state[cell] == JUMPED
                spent = state[cell] == SPENT
                excess = 0.0
                verdict = RUNNING
                E = field_at_end(kind, scale, source, columns, pieces - 1, cell)
                r = kept[BASE, cell] + kept[Y, cell]
                if purpose == SAMPLING:
                    excess = use_samples(kept, notes, state, cell, p, dead_load, repeats, values, series)
                    if notes[ONE_BY_ONE, cell] >= CYCLES:
                        status[cell] = BUDGET_SPENT
                        continue
                    if excess > 0.0:
                        verdict = FAILED
                    elif notes[PURPOSE, cell] == FIXING:
                        notes[ITERATION, cell] = 0.0
                        notes[TRIED, cell] = 0.0
                        set_cycle(
                            kept,
                            notes,
                            cell,
                            cell,
                            kept[BASE, cell],
                            E,
                            once,
                            pieces,
                            kept[TIGHTNESS, cell],
                            resolution,
                            True,
                        )
                        state[cell] = READY
                    elif notes[PURPOSE, cell] == CYCLING:
                        go_back(kept, notes, cell, E, once, pieces, resolution)
                        state[cell] = READY
                elif spent:
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
                    notes[CYCLE_TIME, cell] = kept[OFFSET, cell]
                    if notes[COMPLETED, cell] == 0.0:
                        notes[FIRST_TIME, cell] = kept[OFFSET, cell]
                    notes[COMPLETED, cell] += 1.0
                    notes[ONE_BY_ONE, cell] += 1.0
                    notes[USUAL_STEP, cell] = kept[FIRST_STEP, cell]
                    notes[USUAL_CHANGE, cell] = abs(kept[Y, cell])
                    if kept[LEAST, cell] < notes[LARGEST, cell]:
                        notes[LARGEST, cell] = kept[LEAST, cell]
                        notes[LARGEST_ERROR, cell] = kept[LEAST_ERROR, cell]
                    if notes[COMPLETED, cell] == repeats:
                        # The load held at the end decides.
                        held = abs(E)
                        top = critical(1.0, 0.0, sigma)
                        gap = surplus(sigma, held, top)
                        carried = gap <= 0.0
                        excess = kept[DOUBT, cell] / DOUBTFUL
                        stable, turning = 0.0, 0.0
                        if carried:
                            stable, unstable = relaxed_at(sigma, held, top)
                            ratio = stretch(unstable)
                            turning = ratio * ratio
                            error = total_error(kept[ERROR, cell], kept[ROUNDING, cell])
                            excess = max(excess, 3.0 * error / abs(turning - r))
                        if carried and (r <= turning or p[cell] == 0.0):
                            verdict = SURVIVES
                            result[FINAL_STRETCH, cell] = stretch(stable)
                            result[LARGEST_STRETCH, cell] = max(stretch(notes[LARGEST, cell]), stretch(stable))
                            if notes[LARGEST, cell] < stable:
                                excess = max(excess, notes[LARGEST_ERROR, cell] / tolerance)
                        else:
                            # It fails under the load held: one more piece, without end.
                            notes[COMPLETED, cell] -= 1.0
                            kept[HELD, cell] = held
                            kept[T, cell] = BEGINS
                            kept[X, cell] = held
                            kept[STEP, cell] = 0.0
                            state[cell] = READY
                    elif kept[TIGHTNESS, cell] < LARGEST_TIGHTNESS and (
                        total_error(kept[ERROR, cell], kept[ROUNDING, cell]) > 2.0 * tolerance * r
                        or kept[DOUBT, cell] > DOUBTFUL
                    ):
                        verdict, excess = FAILED, 10.0  # in vain: errors that are too large have only grown since
                    elif notes[ONE_BY_ONE, cell] >= CYCLES:
                        status[cell] = BUDGET_SPENT
                        continue
                    else:
                        base, change = kept[BASE, cell], kept[Y, cell]
                        ratio = kept[GAIN, cell]
                        completed = notes[COMPLETED, cell]
                        steady = completed > 1.0 or once == 0
                        notes[RETURN_R, cell] = r
                        notes[RETURN_ERROR, cell] = kept[ERROR, cell]
                        notes[RETURN_DOUBT, cell] = kept[DOUBT, cell]
                        notes[RETURN_ROUNDING, cell] = kept[ROUNDING, cell]
                        notes[LAST_R, cell] = base
                        notes[LAST_CHANGE, cell] = change
                        error = total_error(kept[ERROR, cell], kept[ROUNDING, cell])
                        if steady and change + error < 0.0:
                            notes[PROVED, cell] = 1.0
                        fixing = steady and repeats == ENDLESS and completed >= notes[NEXT_TRIAL, cell] and ratio < 1.0
                        sampling = steady and completed >= notes[NEXT_SAMPLING, cell] and abs(change) > 2.0 * error
                        rest = repeats - completed if repeats != ENDLESS else math.inf
                        sampling = sampling and rest > 2.0 * WORTH * NODES
                        if fixing or sampling:
                            look_ahead(kept, notes, cell, cell, p, dead_load)
                        # A fixed point beyond R is none.
                        root = base + change / (1.0 - ratio)
                        root = root if notes[PROVED, cell] > 0.0 else max(root, r)
                        fixing = fixing and root < min(notes[BORDER, cell], notes[FAILING, cell])
                        width = abs(change) * max(LEAST_WIDTH, min(1.0 / (abs(1.0 - ratio) + 1e-3), MOST_WIDTH))
                        if fixing:
                            notes[PURPOSE, cell] = FIXING
                            notes[ITERATION, cell] = 0.0
                            notes[TRIED, cell] = 0.0
                            set_cycle(
                                kept, notes, cell, cell, root, E, once, pieces, kept[TIGHTNESS, cell], resolution, True
                            )
                            state[cell] = READY
                        elif sampling and set_range(notes, cell, width, rest, kept[TIGHTNESS, cell]):
                            notes[PURPOSE, cell] = SAMPLING
                        else:
                            go_back(kept, notes, cell, E, once, pieces, resolution)
                            state[cell] = READY
                else:
                    # On the way to the fixed point, or beside it.
                    start, change = kept[BASE, cell], kept[Y, cell]
                    error = total_error(kept[ERROR, cell], kept[ROUNDING, cell])
                    ratio = kept[GAIN, cell]
                    allowed = kept[TIGHTNESS, cell]
                    vain = failed or kept[DOUBT, cell] > DOUBTFUL
                    noise = error + EPSILON * start
                    if failed:
                        notes[FAILING, cell] = min(notes[FAILING, cell], start)
                    else:
                        look_ahead(kept, notes, cell, cell, p, dead_load)
                    if purpose == PROVING and change > error and notes[TRIED, cell] < 4.0 and not vain:
                        # Still before the fixed point: one more iterate.
                        notes[TRIED, cell] += 1.0
                        notes[PURPOSE, cell] = FIXING
                        purpose = FIXING
                    if purpose == PROVING and not vain:
                        if change + error <= 0.0:
                            verdict = SURVIVES
                            excess = write_survival(notes, tolerance, cell, result)
                        elif notes[TRIED, cell] < 4.0:
                            notes[TRIED, cell] += 1.0
                            beside = notes[LAST_R, cell] + 8.0 * (start - notes[LAST_R, cell])
                            set_cycle(kept, notes, cell, cell, beside, E, once, pieces, allowed, resolution, True)
                            state[cell] = READY
                        else:
                            vain = True
                    elif not vain:
                        notes[ITERATION, cell] += 1.0
                        slope = (change - notes[LAST_CHANGE, cell]) / (start - notes[LAST_R, cell])
                        if not (slope < 0.0) or not (slope > -1.0):
                            slope = ratio - 1.0
                        following = start - change / slope
                        apart = 4.0 * EPSILON
                        if notes[TRIED, cell] == 0.0:
                            apart = 0.05 * tolerance / max(1.0, kept[LEAST_SLOPE, cell] * start)
                        notes[LAST_R, cell] = start
                        notes[LAST_CHANGE, cell] = change
                        beyond = following >= min(notes[BORDER, cell], notes[FAILING, cell])
                        if not slope < 0.0 or (beyond and notes[PROVED, cell] == 0.0):
                            vain = True
                        elif abs(following - start) <= apart * start or abs(change) <= noise:
                            notes[LIMIT_LEAST, cell] = kept[LEAST, cell]
                            notes[LIMIT_MOST, cell] = kept[MOST, cell]
                            # Of 1 - P', where it is small, neither the product of the growths nor the secant is exact.
                            away = (abs(change) + error) / min(abs(1.0 - ratio), -slope) + EPSILON * start
                            by_start = max(kept[LEAST_SLOPE, cell], 0.5 / start) * away
                            notes[LIMIT_ERROR, cell] = kept[LEAST_ERROR, cell] + by_start
                            notes[PURPOSE, cell] = PROVING
                            beside = max(following, start) + 4.0 * noise / -slope
                            set_cycle(kept, notes, cell, cell, beside, E, once, pieces, allowed, resolution, True)
                            state[cell] = READY
                        elif notes[ITERATION, cell] >= ITERATIONS:
                            vain = True
                        else:
                            if notes[PROVED, cell] == 0.0:
                                following = max(following, notes[RETURN_R, cell])
                            set_cycle(kept, notes, cell, cell, following, E, once, pieces, allowed, resolution, True)
                            state[cell] = READY
                    if vain and purpose == PROVING:
                        # There is a fixed point, too close to failure for these errors.
                        verdict, excess = SURVIVES, 100.0
                    elif vain:
                        notes[NEXT_TRIAL, cell] = 4.0 * notes[COMPLETED, cell] + 2.0
                        go_back(kept, notes, cell, E, once, pieces, resolution)
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
                    r = start_stretch[cell] * start_stretch[cell]
                    begin(kept, notes, cell, r, last, min(allowed, LARGEST_TIGHTNESS), resolution)
                    fresh[cell] = True
                running += 1
            if running == 0:
                break

    return Kernel(sweep, SIGNATURE)
