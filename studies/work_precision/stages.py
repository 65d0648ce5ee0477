"""Several pieces for solvers that take one right-hand side at a time, from a known place to a known place.

A film goes through a piece that it survives in plain time; where it fails, D or the margin is the independent variable,
so that there is no event to find. Between pieces NumPy finds the stretch after a jump of the field, and that is timed.
What no solver can know beforehand is given to them, from the truth, and is not timed: in which piece every film fails
and when, to change variables half-way there. `dea_maps` is told nothing.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import forms
import numpy as np
from engines import Advance, Engine
from numpy.typing import NDArray
from pieces import CRITICAL_LOAD, Array, Films, critical, equilibrium, film_of, pieces_of
from solvers import Answer, Go, Read
from truth import failure

EARLY = 0.5  # share of the time to failure in the last piece that is taken in time


def _make_time(exp: Any) -> Callable[..., tuple[Any, ...]]:
    """Return the form in plain time without a dead load; states u = 1/lambda**2 and r."""

    def in_time(t, y, a):
        u, r = y[0], y[1]
        p, field = a[0], a[1] + a[2] * t
        square = u * u
        z = u * r
        flow = 2.0 * (1.0 / z - z * z)
        load_rate = 2.0 * CRITICAL_LOAD * field * a[2]
        by_r = -p * (u / (r * r) + 2.0 * r * square * square)
        return (by_r * flow - load_rate) / (4.0 * (1.0 + p * r * r) * u * square - 1.0 - p / r), flow

    return in_time


def _make_loaded_time(exp: Any) -> Callable[..., tuple[Any, ...]]:
    """Return the form in plain time under a dead load; states w = 1/lambda and r."""

    def in_time(t, y, a):
        w, r = y[0], y[1]
        p, field, sigma = a[0], a[1] + a[2] * t, a[3]
        u = w * w
        z = u * r
        flow = 2.0 * (1.0 / z - z * z)
        load_rate = 2.0 * CRITICAL_LOAD * field * a[2]
        by_r = -p * u * (1.0 / (r * r) + 2.0 * r * u * u * u)
        D = 8.0 * (1.0 + p * r * r) * u * u * u + 3.0 * sigma * w - 2.0 * (1.0 + p / r)
        return (by_r * flow - load_rate) / (w * D), flow

    return in_time


def _make_finish(exp: Any) -> Callable[..., tuple[Any, ...]]:
    """Return the form with D as the independent variable, under a dead load; states time, w and r."""

    def finish(t, y, a):
        w, r = y[1], y[2]
        p, field, sigma = a[0], a[1] + a[2] * y[0], a[3]
        u = w * w
        z = u * r
        flow = 2.0 * (1.0 / z - z * z)
        cube = u * u * u
        load_rate = 2.0 * CRITICAL_LOAD * field * a[2]
        by_r = -p * u * (1.0 / (r * r) + 2.0 * r * cube)
        fall = (by_r * flow - load_rate) / w  # of w in time, times D
        of_D = (48.0 * (1.0 + p * r * r) * cube / w + 3.0 * sigma) * fall
        of_D = of_D + p * (16.0 * r * cube + 2.0 / (r * r)) * flow * t
        return t / of_D, fall / of_D, flow * t / of_D

    return finish


class _Stage(NamedTuple):
    """A piece, or a part of it, in time: who jumps to which field at its start, who then goes through it, how long."""

    jumping: NDArray[np.int64]
    field: Array
    films: NDArray[np.int64]
    duration: Array
    constants: Array


class _Finish(NamedTuple):
    """Who fails in pieces of one kind, fields at the start and slopes of these, and from when on the finish serves."""

    films: NDArray[np.int64]
    start: Array
    slope: Array
    begin: Array


class _Plan(NamedTuple):
    """What is known beforehand, and the time at which the last piece of every film begins."""

    stages: list[_Stage]
    finishes: list[_Finish]
    offset: Array


def _plan(films: Films) -> _Plan:
    p, _, sigma = film_of(films)
    way, known = pieces_of(films), failure(films)
    count = way.start.shape[0]
    ends = way.start + way.slope * np.where(way.slope == 0.0, 0.0, way.duration)
    last, every = known.outlasted % count, np.arange(p.size)
    start, slope = way.start[last, every], way.slope[last, every]
    whole = (slope == 0.0) | ((start == 0.0) & (sigma == 0.0))  # the finish serves the piece from its start
    begin = np.where(whole, 0.0, EARLY * known.within)
    offset = np.zeros(p.size)
    stages = []
    for number in range(known.outlasted.max() + 1):
        here = number % count
        duration = np.where(known.outlasted == number, begin, way.duration[here])
        there = known.outlasted >= number
        jumping = np.flatnonzero(there & ((number == 0) | (np.abs(way.start[here] - ends[here - 1]) > 1e-9)))
        moving = np.flatnonzero(there & (duration > 0.0))
        constants = np.array([part[moving] for part in (p, way.start[here], way.slope[here], sigma)])
        stages.append(_Stage(jumping, way.start[here, jumping], moving, duration[moving], constants))
        offset += np.where(known.outlasted > number, way.duration[here], 0.0)
    parts = (np.flatnonzero(which) for which in (slope == 0.0, slope != 0.0))
    finishes = [_Finish(part, start[part], slope[part], begin[part]) for part in parts if part.size]
    return _Plan(stages, finishes, offset)


def _of_known(advance: Advance) -> Advance:
    """Return a solver that leaves out films without an answer so far."""

    def of_known(begin: Array, end: Array, first: Array, constants: Array) -> Array:
        known = np.isfinite(begin) & np.isfinite(first).all(axis=0)
        if known.all():
            return advance(begin, end, first, constants)
        states = np.full_like(first, np.nan)
        if known.any():
            states[:, known] = advance(begin[known], end[known], first[:, known], constants[:, known])
        return states

    return of_known


def staged(engine: Engine) -> Callable[[Films, float], tuple[Go, Read]]:
    """Make a solver of films under several pieces from one of a single right-hand side."""

    def prepare(films: Films, accuracy: float) -> tuple[Go, Read]:
        p, square, sigma = film_of(films)
        plan = _plan(films)
        loaded = bool(np.any(sigma != 0.0))
        makes = (_make_loaded_time, _make_finish, _make_finish) if loaded else (_make_time, forms.HELD, forms.CHANGING)
        in_time, held, changing = (_of_known(engine(make, accuracy)) for make in makes)
        given = slice(None) if loaded else slice(3)
        x, r, within = np.empty((3, p.size))

        def go() -> None:
            r[:] = square
            for stage in plan.stages:
                some = stage.jumping
                if some.size:
                    w = equilibrium(stage.field, r[some], p[some], sigma[some])
                    x[some] = w if loaded else w * w
                now = stage.films
                if now.size:
                    states = np.array([x[now], r[now]])
                    x[now], r[now] = in_time(np.zeros(now.size), stage.duration, states, stage.constants[given])
            for last in plan.finishes:
                now = last.films
                if loaded:
                    w = x[now]
                    A, B = 1.0 + p[now] / r[now], 1.0 + p[now] * r[now] ** 2
                    first = 8.0 * B * w**6 + 3.0 * sigma[now] * w - 2.0 * A
                    constants = np.array([p[now], last.start, last.slope, sigma[now]])
                    within[now], _, r[now] = held(first, 0.0 * first, np.array([last.begin, w, r[now]]), constants)
                    continue
                field = last.start + last.slope * last.begin
                first = field * np.sqrt(CRITICAL_LOAD / (0.75 * (1.0 + p[now] / r[now]) * x[now]))
                one = np.ones(now.size)
                if last.slope[0] == 0.0:
                    r[now], spent = held(first, one, np.array([r[now], 0.0 * one]), p[np.newaxis, now])
                    within[now] = last.begin + spent
                else:
                    (r[now],) = changing(first, one, r[np.newaxis, now], np.array([p[now], last.slope]))
                    A, u = forms.at_failure(r[now], p[now])
                    within[now] = (np.sqrt(0.75 / CRITICAL_LOAD * A * u) - last.start) / last.slope

        def read() -> Answer:
            w, _ = critical(r, p, sigma)
            return plan.offset + within, 1.0 / w

        return go, read

    return prepare
