"""When the true field of a film first reaches its strength: roots on the recorded steps of its integration.

The true field ``E lambda**2`` over the strength is looked at where the field has jumped, at the end of every step and,
where its tangents say that it may have a maximum there, within a step. Under a program that is repeated without end the
internal stretch at the start of a cycle rises from cycle to cycle, and the stretch with it: a film that survives breaks
down if it does so in its limit cycle, or never.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ..materials.strength import StrengthOf, excess
from ..outcomes import Limit, Reason
from ..programs import ENDLESS, Program
from ..sweeps.dead_load import film_of
from ..sweeps.loading import SINE, repetition_starts, table_of
from ..sweeps.solve import STEPS as STEP
from ..sweeps.solve import Passages
from .answers import roots

Array = npt.NDArray[np.float64]
Cells = dict[str, Array]

# Steps recorded at a time: of a film, and of all.
_ROOM, _MOST_ROOM, _STEPS = 48, 4096, 400_000
# Relative error allowed in passages, over that of the answers, until they are accurate.
_TOLERANCES = (0.1, 1e-3, 1e-5)
_SMALLEST_TOLERANCE = 1e-14
# Distance to the instability at which a film has failed, over the relative error allowed.
_CLOSENESS = 0.01
# Step of the difference that gives the exponent of the strength.
_NUDGE = 1e-5
# Points within a step at which a maximum is looked for first.
_LOOKS = np.linspace(0.0, 1.0, 11)[1:-1]
_ITERATIONS = 60
# Relative error that a film taken for one at rest in a hold may have.
_AT_REST = 1e-7

_CRITICAL_LOAD = 0.75 * 4.0 ** (-1.0 / 3.0)
# Where the excess is found to be above zero.
_JUMP, _END, _INSIDE = range(3)


class Found(NamedTuple):
    """What comes first, and where there is a breakdown its time, the stretch and the field before the sign is lost."""

    limit: npt.NDArray[np.int8]
    time: Array
    stretch: Array
    field: Array


class Ends(NamedTuple):
    """What is known of films from their sweep: whether they survive, and stretch and field at failure."""

    survives: npt.NDArray[np.bool_]
    stretch: Array
    field: Array


def first_passage(program: Program, cells: Cells, strength: StrengthOf, ends: Ends, rtol: float) -> Found:
    """Find what comes first in films, breakdown, instability, or none, with time, stretch and field at breakdown.

    Parameters
    ----------
    program, cells
        The loading program and its parameters, (films,).
    strength : callable
        The true field at which a film breaks down, over the relaxed critical field.
    ends : Ends
        What becomes of the films without breakdown.
    rtol : float
        Relative error allowed.
    """
    size = ends.survives.size
    found = Found(np.full(size, Limit.UNRESOLVED, np.int8), *(np.full(size, np.nan) for _ in range(3)))
    open_ = np.ones(size, np.bool_)
    if program.repeats == ENDLESS and ends.survives.any():
        own = _some(cells, ends.survives)
        never = np.zeros(size, np.bool_)
        never[ends.survives] = _limit_cycle_is_safe(program, own, strength, rtol)
        found.limit[never] = Limit.NONE
        open_ &= ~never
    for tolerance in _TOLERANCES:
        chosen = np.flatnonzero(open_)
        if not chosen.size:
            break
        own = _some(cells, chosen)
        theirs = Ends(ends.survives[chosen], ends.stretch[chosen], ends.field[chosen])
        search = _Search(program, own, strength, theirs, rtol, tolerance)
        search.run()
        accurate = search.error <= rtol
        found.limit[chosen[accurate]] = search.found.limit[accurate]
        for mine, its in zip(found[1:], search.found[1:], strict=True):
            mine[chosen[accurate]] = its[accurate]
        open_[chosen[accurate]] = False
    return found


def _some(cells: Cells, films: npt.NDArray[Any]) -> Cells:
    return {name: values[films] for name, values in cells.items()}


class _Search:
    """The passages of films at one tolerance."""

    def __init__(
        self, program: Program, cells: Cells, strength: StrengthOf, ends: Ends, rtol: float, tolerance: float,
        square: Array | None = None, one_cycle: bool = False,
    ) -> None:  # fmt: skip
        size = ends.survives.size
        self._strength, self._ends, self._rtol = strength, ends, rtol
        tolerance = max(tolerance * rtol, _SMALLEST_TOLERANCE)
        self.passages = Passages(program, cells, tolerance, _CLOSENESS * rtol, square, one_cycle)
        self._program, self._cells = program, cells
        self._films = np.arange(size)
        self._before = np.full(size, -1.0)
        self.error = np.zeros(size)
        self.found = Found(np.full(size, Limit.UNRESOLVED, np.int8), *(np.full(size, np.nan) for _ in range(3)))

    def run(self) -> None:
        """Follow all films until it is known what comes first."""
        room = _ROOM
        while self._films.size:
            going = self._look(*self.passages.go_on(room))
            self.passages.keep(going)
            self._films, self._before = self._films[going], self._before[going]
            room = min(max(_STEPS // max(self._films.size, 1), _ROOM), _MOST_ROOM)

    def _look(self, count: npt.NDArray[np.int64], steps: Array) -> npt.NDArray[np.bool_]:
        """Look at recorded steps; which films are still on their way."""
        taken = np.arange(steps.shape[2]) < count[:, np.newaxis]
        entered = taken & (steps[STEP.T_0] == 0.0)
        reached = np.where(entered, steps[STEP.FIELD_0], 0.0)
        further = entered & (steps[STEP.REACHED] > steps[STEP.STRETCH_0])  # jumps up and down again
        if further.any():
            film, number = np.nonzero(further)
            reached[further] = self._field_at(film, steps[STEP.REACHED, film, number], self._r(steps, film, number))
        jumped = self._over(entered, steps[STEP.REACHED], reached)
        ended = self._over(taken, steps[STEP.STRETCH_1], steps[STEP.FIELD_1])
        started = np.concatenate([self._before[:, np.newaxis], ended[:, :-1]], axis=1)
        started = np.where(entered, jumped, started)
        where = np.full((3, count.size), steps.shape[2])  # the first step at which it happened, of each kind
        for kind, over in ((_JUMP, jumped), (_END, ended)):
            met = taken & (over >= 0.0)
            where[kind] = np.where(met.any(axis=1), met.argmax(axis=1), steps.shape[2])
        earliest = np.minimum(where[_JUMP], where[_END])
        inner = taken & (np.arange(steps.shape[2]) < earliest[:, np.newaxis])
        at = np.ones(count.size)
        self._maxima(steps, inner, started, ended, where[_INSIDE], at)
        kind = where.argmin(axis=0)
        first = where.min(axis=0)
        met = first < steps.shape[2]
        if met.any():
            self._jumps(steps, np.flatnonzero(met & (kind == _JUMP)), first)
            crossing = np.flatnonzero(met & (kind != _JUMP))
            self._crossings(steps, crossing, first[crossing], np.where(kind == _INSIDE, at, 1.0)[crossing], started)
        state = self.passages.state
        self._fail(np.flatnonzero(~met & (state == Passages.NEAR)), count, steps)
        self._fail_at_jump(np.flatnonzero(~met & (state == Passages.JUMPED)), count, steps)
        self._rest(np.flatnonzero(~met & (state == Passages.RESTS)), count, steps)
        self.found.limit[self._films[~met & (state == Passages.ENDED)]] = Limit.NONE
        some = count > 0
        self._before[some] = ended[some, count[some] - 1]
        return np.asarray(~met & (state == Passages.READY))

    def _over(self, which: npt.NDArray[np.bool_], stretch: Array, field: Array) -> Array:
        """Return the excess of the true field over the strength, -1 where it is not asked for."""
        over = np.full(which.shape, -1.0)
        over[which] = excess(self._strength, np.abs(field[which]), stretch[which])
        return over

    @staticmethod
    def _r(steps: Array, film: Any, number: Any) -> Array:
        return np.asarray(steps[STEP.BASE_0, film, number] + steps[STEP.Y_0, film, number])

    def _field_at(self, film: npt.NDArray[np.int64], stretch: Array, r: Array) -> Array:
        """Return the field with which films are in equilibrium, (18) to (20)."""
        p, w = self.passages.ratio[film] - 1.0, 1.0 / stretch
        load = w * w * (1.0 + p / r - (1.0 + p * r * r) * w**6 - self.passages.load[film] * w)
        return np.sqrt(np.maximum(load, 0.0) / _CRITICAL_LOAD)

    def _time(self, film: npt.NDArray[np.int64], step: Array) -> Array:
        """Return the time at which recorded steps start."""
        return np.asarray(self._start(film, step[STEP.CYCLE]) + (step[STEP.OFFSET_0] + step[STEP.T_0]))

    def _start(self, film: npt.NDArray[np.int64], completed: Array) -> Array:
        """Return the time at which a repetition starts."""
        return repetition_starts(self._program, _some(self._cells, self._films[film]), completed)

    def _write(self, film: npt.NDArray[np.int64], time: Array, stretch: Array, field: Array, error: Array) -> None:
        own = self._films[film]
        self.found.limit[own] = np.where(np.isfinite(stretch), Limit.BREAKDOWN, Limit.UNRESOLVED)
        for rows, values in zip(self.found[1:], (time, stretch, np.abs(field)), strict=True):
            rows[own] = np.where(np.isfinite(stretch), values, np.nan)
        self.error[own] = error

    def _exponent(self, stretch: Array) -> Array:
        """Return 2 - d ln strength/d ln stretch: how the excess grows with the stretch."""
        more = np.log(self._strength(stretch * (1.0 + _NUDGE)) / self._strength(stretch))
        return np.asarray(2.0 - more / np.log1p(_NUDGE))

    def _maxima(
        self, steps: Array, inner: npt.NDArray[np.bool_], started: Array, ended: Array, where: Any, at: Array
    ) -> None:
        """Find the first steps in which the excess is above zero but at neither end; where it is largest there."""
        falls = (steps[STEP.FIELD_RATE_1] < 0.0) | (steps[STEP.STRETCH_RATE_1] < 0.0)
        changes = np.signbit(steps[STEP.FIELD_0]) != np.signbit(steps[STEP.FIELD_1])
        film, number = np.nonzero(inner & (falls | changes))
        if not film.size:
            return
        step = steps[:, film, number]
        slopes = [
            step[rate] + self._exponent(step[stretch]) * step[own]
            for rate, stretch, own in (
                (STEP.FIELD_RATE_0, STEP.STRETCH_0, STEP.STRETCH_RATE_0),
                (STEP.FIELD_RATE_1, STEP.STRETCH_1, STEP.STRETCH_RATE_1),
            )
        ]
        with np.errstate(divide="ignore", invalid="ignore"):
            low, high = (np.log1p(over[film, number]) for over in (started, ended))
            meet = (high - low - slopes[1] * step[STEP.LENGTH]) / (slopes[0] - slopes[1])
            above = (slopes[1] < 0.0) & (low + slopes[0] * meet > 0.0)
        possible = (slopes[0] > 0.0) & (above | changes[film, number])
        film, number, step = film[possible], number[possible], step[:, possible]
        if not film.size:
            return

        def below(share: Array, index: Array) -> Array:
            chosen = index.astype(np.int64)
            length = share * step[STEP.LENGTH, chosen]
            stretch, field = self.passages.within(film[chosen], step[:, chosen], length)
            return -excess(self._strength, np.abs(field), stretch)

        index = np.arange(film.size)
        looks = np.stack([below(np.full(film.size, share), index) for share in _LOOKS])
        best = looks.argmin(axis=0)
        share, depth = _LOOKS[best], looks[best, index]
        width = _LOOKS[0]
        sought = (depth > 0.0) & (best > 0) & (best < _LOOKS.size - 1)
        if sought.any():
            from scipy.optimize import elementwise  # here: a first small sweep needs no minima

            triple = share[sought] - width, share[sought], share[sought] + width
            least = elementwise.find_minimum(
                below, triple, args=(index[sought].astype(float),), maxiter=_ITERATIONS,
                tolerances={"xatol": 1e-6, "xrtol": 0.0, "fatol": 0.0, "frtol": 0.0},
            )  # fmt: skip
            share[sought], depth[sought] = least.x, least.f_x
        for k in np.flatnonzero(depth < 0.0)[::-1]:  # the earliest one of a film comes last
            where[film[k]], at[film[k]] = number[k], share[k]

    def _crossings(
        self, steps: Array, film: npt.NDArray[np.int64], number: npt.NDArray[np.int64], high: Array, started: Array
    ) -> None:
        """Find the roots within steps."""
        if not film.size:
            return
        step = steps[:, film, number]

        def over(share: Array, index: Array) -> Array:
            chosen = index.astype(np.int64)
            length = share * step[STEP.LENGTH, chosen]
            stretch, field = self.passages.within(film[chosen], step[:, chosen], length)
            return excess(self._strength, np.abs(field), stretch)

        index = np.arange(film.size)
        everywhere = np.ones(film.size, np.bool_)
        share, _ = roots(over, np.zeros(film.size), high, everywhere, (index.astype(float),), xatol=1e-14)
        share = np.where(np.isfinite(share), share, high)
        length = share * step[STEP.LENGTH]
        stretch, field = self.passages.within(film, step, length)
        time = self._time(film, step) + length
        # What errors of the stretch make of the strength and, where that is less, of the time and the field then.
        of_strength = abs(self._exponent(stretch)) * step[STEP.ERROR_1]
        rise = over(high, index.astype(float)) - np.maximum(started[film, number], -1.0)
        late = of_strength * high * step[STEP.LENGTH] / np.maximum(rise, 1e-300)
        of_time = late * np.maximum(1.0 / np.maximum(time, 1e-300), abs(step[STEP.FIELD_RATE_1]))
        self._write(film, time, stretch, field, np.minimum(of_strength, of_time))

    def _jumps(self, steps: Array, film: npt.NDArray[np.int64], first: npt.NDArray[np.int64]) -> None:
        """Find the fields at which films break down while the field jumps."""
        if film.size:
            step = steps[:, film, first[film]]
            r = step[STEP.BASE_0] + step[STEP.Y_0]
            self._at_jump(film, step[STEP.REACHED], r, self._time(film, step))
            # What a film at rest in a hold lacked of it at its end is no jump, and known to no more than that.
            over = excess(self._strength, self._field_at(film, step[STEP.REACHED], r), step[STEP.REACHED])
            self.error[self._films[film]] = np.where(over < _AT_REST, over, 0.0)

    def _at_jump(self, film: npt.NDArray[np.int64], reached: Array, r: Array, time: Array) -> None:
        p = self.passages.ratio[film] - 1.0
        unloaded = ((1.0 + p * r * r) / (1.0 + p / r)) ** (1.0 / 6.0)

        def lacks(stretch: Array, index: Array) -> Array:
            chosen = index.astype(np.int64)
            field = self._field_at(film[chosen], stretch, r[chosen])
            return excess(self._strength, field, stretch)

        index = np.arange(film.size).astype(float)
        everywhere = np.ones(film.size, np.bool_)
        stretch, _ = roots(lacks, unloaded, reached, everywhere, (index,), xrtol=1e-15)
        stretch = np.where(np.isfinite(stretch), stretch, reached)
        self._write(film, time, stretch, self._strength(stretch) / stretch**2, np.zeros(film.size))

    def _rest(self, film: npt.NDArray[np.int64], count: npt.NDArray[np.int64], steps: Array) -> None:
        """Films at rest under the field held: what they still lack of it is less than the error allowed."""
        if not film.size:
            return
        own, step = self._films[film], steps[:, film, count[film] - 1]
        stretch, field = self._ends.stretch[own], np.abs(step[STEP.FIELD_1])
        breaks = excess(self._strength, field, stretch) > 0.0
        self.found.limit[own] = Limit.NONE
        at = stretch_at(self._strength, field[breaks], stretch[breaks])
        time = self._time(film, step) + step[STEP.LENGTH]
        self._write(film[breaks], time[breaks], at, field[breaks], np.zeros(at.size))

    def _fail(self, film: npt.NDArray[np.int64], count: npt.NDArray[np.int64], steps: Array) -> None:
        """Films that have come to the instability."""
        if not film.size:
            return
        own = self._films[film]
        stretch, field = self._ends.stretch[own], self._ends.field[own]
        breaks = excess(self._strength, field, stretch) > 0.0
        self.found.limit[own] = Limit.INSTABILITY
        film, field = film[breaks], field[breaks]
        step = steps[:, film, count[film] - 1]
        time = self._time(film, step) + step[STEP.LENGTH]
        self._write(film, time, stretch_at(self._strength, field, stretch[breaks]), field, np.zeros(film.size))

    def _fail_at_jump(self, film: npt.NDArray[np.int64], count: npt.NDArray[np.int64], steps: Array) -> None:
        """Films that a jump takes to more than they carry."""
        if not film.size:
            return
        r, critical = self.passages.square[film], self.passages.stretch[film]
        breaks = excess(self._strength, self._field_at(film, critical, r), critical) > 0.0
        self.found.limit[self._films[film]] = Limit.INSTABILITY
        film = film[breaks]
        cycles, since = (array[film] for array in self.passages.time)
        self._at_jump(film, critical[breaks], r[breaks], self._start(film, cycles) + since)


def _limit_cycle_is_safe(program: Program, cells: Cells, strength: StrengthOf, rtol: float) -> npt.NDArray[np.bool_]:
    """Return which films that survive without end do not break down in their limit cycle, and so never."""
    size = cells["modulus_ratio"].size
    square = film_of(cells)[1] ** 2
    following = square.copy()
    settled = np.zeros(size, np.bool_)
    for _ in range(_ITERATIONS):
        films = np.flatnonzero(~settled)
        if not films.size:
            break
        passages = Passages(program, _some(cells, films), 0.1 * rtol, _CLOSENESS * rtol, following[films], True)
        while (passages.state == Passages.READY).any():
            passages.go_on(_ROOM)
        change, gain = passages.change
        ends = passages.state == Passages.ENDED
        # From where the film does not come to the end of the cycle, go back, and on by one cycle.
        ahead = np.where(gain < 1.0, change / np.where(gain < 1.0, 1.0 - gain, 1.0), change)
        settled[films] = ends & (np.abs(ahead) <= 1e-3 * rtol * following[films])
        square[films] = np.where(ends, following[films] + change, square[films])
        following[films] = np.where(ends, following[films] + ahead, square[films])
    unknown = Ends(np.ones(size, np.bool_), np.full(size, np.nan), np.full(size, np.nan))

    def no_less(stretch: Array) -> Array:
        return strength(stretch) * (1.0 + 0.1 * rtol)  # what is met in the limit alone is not met

    search = _Search(program, cells, no_less, unknown, rtol, _TOLERANCES[0], following, True)
    search.run()
    return np.asarray(settled & (search.found.limit == Limit.NONE))


def peak_field(program: Program, cells: Cells) -> Array:
    """Return a bound on the field of a program: the largest one, unless it oscillates about other ones.

    Examples
    --------
    >>> from dea_maps.programs import Overdrive
    >>> given = {"field": 0.9, "overdrive_field": 1.5, "overdrive_time": 0.1, "modulus_ratio": 4.0}
    >>> peak_field(Overdrive(), {name: np.array([value]) for name, value in given.items()})
    array([1.5])
    """
    table = table_of(program)
    columns = [np.abs(np.broadcast_to(column(cells), cells["modulus_ratio"].shape)) for column in table.columns]
    sines = table.kind == SINE
    peak = np.zeros(cells["modulus_ratio"].size)
    for source in np.unique(table.source[~sines, :2]):
        peak = np.maximum(peak, abs(table.scale[:, :2][table.source[:, :2] == source]).max() * columns[source])
    for scale, source in zip(table.scale[sines], table.source[sines], strict=True):
        mean, amplitude = (abs(scale[k]) * columns[source[k]] for k in range(2))
        peak = np.maximum(peak, mean + amplitude)
    return peak


def stretch_at(strength: StrengthOf, field: Array, farthest: Array) -> Array:
    """Return the stretch at which a nominal field breaks a film down: a question of the strength alone."""
    found, reason = roots(
        lambda stretch, field: excess(strength, field, stretch),
        np.ones_like(field),
        farthest,
        np.isfinite(field),
        (field,),
        xrtol=1e-15,
    )
    return np.where(reason == Reason.ANSWERED, found, farthest)
