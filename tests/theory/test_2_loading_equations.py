"""A naive twin of the general loading programs: one film in plain Python, piece after piece, cycle after cycle.

States T, lambda and xi against s with dT = (de/dlambda) ds, where nothing is singular at the instability, by SciPy's
DOP853 from equations (18) to (20), (24) and (26) of the paper. A repeated program is gone through until the internal
stretch no longer changes.
"""

import itertools
import math

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import dea_maps as dm

CRITICAL_LOAD = 0.75 * 4 ** (-1 / 3)
SURVIVES, FAILS_LATER, FAILS_AT_ONCE = range(3)
RTOL = 1e-6
MOST_CYCLES = 80


class Film:
    """A film under its dead load: what it carries, and how it creeps."""

    def __init__(self, ratio, sigma):
        self.p, self.sigma = ratio - 1, sigma

    def load(self, stretch, xi):
        """e in equilibrium."""
        A, B = 1 + self.p / xi**2, 1 + self.p * xi**4
        return A * stretch**-2 - B * stretch**-8 - self.sigma * stretch**-3

    def stiffness(self, stretch, xi):
        """de/dlambda, zero at the instability."""
        A, B = 1 + self.p / xi**2, 1 + self.p * xi**4
        return -2 * A * stretch**-3 + 8 * B * stretch**-9 + 3 * self.sigma * stretch**-4

    def critical(self, xi):
        low = 0.5
        return brentq(lambda stretch: self.stiffness(stretch, xi), low, 40 * xi, xtol=1e-15)

    def equilibrium(self, field, xi):
        """Stretch under a field, None where the film does not carry it."""
        top, e = self.critical(xi), CRITICAL_LOAD * field**2
        if self.load(top, xi) <= e:
            return None
        return brentq(lambda stretch: self.load(stretch, xi) - e, 0.5, top, xtol=1e-15)

    def slopes(self, state, field, rate):
        _, stretch, xi = state
        flow = stretch**2 * xi**-3 - stretch**-4 * xi**3
        of_xi = -2 * self.p * (xi**-3 * stretch**-2 + 2 * xi**3 * stretch**-8)
        D = self.stiffness(stretch, xi)
        return [D, 2 * CRITICAL_LOAD * field * rate - of_xi * flow, flow * D]


class Walk:
    """A film on its way through pieces (start, slope, amplitude, period, duration)."""

    def __init__(self, film, xi):
        self.film, self.xi, self.time, self.stretches = film, xi, 0.0, []
        self.failure = None

    def fail(self, time, stretch, xi, field):
        self.failure = {"time_to_failure": time, "critical_stretch": stretch, "critical_internal_stretch": xi}
        self.failure["critical_field"] = field

    def along(self, piece):
        """Go through a piece, up to the instability if it comes first."""
        start, slope, amplitude, period, duration = piece
        film, turn = self.film, 2 * math.pi / period

        def applied(t):
            return start + slope * t + amplitude * math.sin(turn * t), slope + amplitude * turn * math.cos(turn * t)

        stretch = film.equilibrium(start, self.xi)
        if stretch is None:
            top = film.critical(self.xi)
            self.fail(self.time, top, self.xi, math.sqrt(film.load(top, self.xi) / CRITICAL_LOAD))
            return
        self.stretches.append(stretch)
        if duration == 0.0:
            return

        def slopes(s, state):
            return film.slopes(state, *applied(state[0]))

        events = (
            lambda s, state: film.stiffness(state[1], state[2]),
            lambda s, state: state[0] - duration,
            lambda s, state: slopes(s, state)[1],
        )
        events[0].terminal = events[1].terminal = True
        solution = solve_ivp(slopes, (0, 1e9), [0, stretch, self.xi], "DOP853", events=events, rtol=1e-10, atol=1e-12)
        assert solution.status == 1
        t, stretch, self.xi = solution.y[:, -1]
        self.stretches += [stretch, *(state[1] for state in solution.y_events[2])]
        if solution.t_events[0].size:
            self.fail(self.time + t, stretch, self.xi, abs(applied(t)[0]))
        self.time += t

    def final(self, field):
        """Stretch relaxed under a field held for ever; None where the film fails under it."""
        relaxed = Film(1.0, self.film.sigma)
        stable = relaxed.equilibrium(field, 1.0)
        if stable is None:
            return None
        top, e = relaxed.critical(1.0), CRITICAL_LOAD * field**2
        # Behind its top the load falls towards zero as the stretch grows without end.
        carried_far = relaxed.load(1e6, 1.0) >= e
        unstable = math.inf if carried_far else brentq(lambda stretch: relaxed.load(stretch, 1.0) - e, top, 1e6)
        return stable if self.xi <= unstable else None


def naive(pieces, repeats, ratio, sigma, start):
    """What becomes of a film; None where the twin does not wait for it."""
    walk, cycles = Walk(Film(ratio, sigma), start), 0
    largest = 0.0
    while walk.failure is None:
        before, walk.stretches = walk.xi, []
        for piece in pieces:
            walk.along(piece)
            if walk.failure:
                break
        largest = max([largest, *walk.stretches])
        if walk.failure:
            break
        cycles += 1
        if repeats is not None and cycles == repeats:
            begin, slope, amplitude, period, duration = pieces[-1]
            held = begin + slope * duration + amplitude * math.sin(2 * math.pi * duration / period)
            final = walk.final(held)
            if final is not None:
                return {"outcome": SURVIVES, "final_stretch": final, "largest_stretch": max(largest, final)}
            walk.along((held, 0.0, 0.0, 1.0, math.inf))
        elif repeats is None and abs(walk.xi - before) <= 1e-9 * before:
            steady = {"steady_stretch_max": max(walk.stretches), "steady_stretch_min": min(walk.stretches)}
            return {"outcome": SURVIVES, "largest_stretch": largest, **steady}
        elif cycles == MOST_CYCLES:
            return None
    found = {"outcome": FAILS_LATER if walk.time > 0 else FAILS_AT_ONCE, **walk.failure}
    found["largest_stretch"] = max(largest, walk.failure["critical_stretch"])
    return found if repeats == 1 or walk.time == 0 else {**found, "cycles_to_failure": cycles}


def linear(start, end, duration):
    return start, (end - start) / duration if duration else 0.0, 0.0, 1.0, duration


def hold(field, time):
    return linear(field, field, time)


WAVE = ([0.0, 0.7, 1.1, 2.5], [0.3, 1.0, -0.9, 0.2])


def samples(field):
    times, values = WAVE
    corners = [(t, field * v) for t, v in zip(times, values, strict=True)]
    return [linear(a, b, s - t) for (t, a), (s, b) in itertools.pairwise(corners)]


# Program, repeats (None without end), its pieces from its parameters, and the parameters from a field and two times.
CASES = {
    "step": (dm.Step(), 1, lambda field: [hold(field, 0.0)], lambda f, a, b: {"field": f}),
    "ramp": (dm.Ramp(), 1, lambda rate: [linear(0.0, 100.0, 100.0 / rate)], lambda f, a, b: {"rate": f / a}),
    "ramp_hold": (
        dm.RampHold(),
        1,
        lambda field, rate: [linear(0.0, field, field / rate)],
        lambda f, a, b: {"field": f, "rate": f / a},
    ),
    "pulse": (
        dm.Pulse(),
        1,
        lambda field, width: [hold(field, width), hold(0.0, 0.0)],
        lambda f, a, b: {"field": f, "width": a},
    ),
    "trapezoid": (
        dm.Trapezoid(),
        1,
        lambda field, rate, hold_time, fall_rate: [
            linear(0.0, field, field / rate),
            hold(field, hold_time),
            linear(field, 0.0, field / fall_rate),
        ],
        lambda f, a, b: {"field": f, "rate": f / a, "hold_time": b, "fall_rate": f / b},
    ),
    "overdrive": (
        dm.Overdrive(),
        1,
        lambda field, overdrive_field, overdrive_time: [hold(overdrive_field, overdrive_time), hold(field, 0.0)],
        lambda f, a, b: {"field": 0.75 * f, "overdrive_field": f, "overdrive_time": a},
    ),
    "pulse_train": (
        dm.PulseTrain(),
        None,
        lambda field, period, duty: [hold(field, duty * period), hold(0.0, (1.0 - duty) * period)],
        lambda f, a, b: {"field": f, "period": a + b, "duty": a / (a + b)},
    ),
    "triangle_train": (
        dm.TriangleTrain(),
        None,
        lambda field, period: [linear(0.0, field, period / 2), linear(field, 0.0, period / 2)],
        lambda f, a, b: {"field": f, "period": a + b},
    ),
    "biased_sine": (
        dm.BiasedSine(),
        None,
        lambda bias, amplitude, period: [(bias, 0.0, amplitude, period, period)],
        lambda f, a, b: {"bias": 0.4 * f, "amplitude": 0.6 * f, "period": a + b},
    ),
    "waveform": (dm.Waveform(*WAVE), 1, samples, lambda f, a, b: {"field": f}),
    "waveform_repeated": (dm.Waveform(*WAVE, repeat=True), None, samples, lambda f, a, b: {"field": f}),
    "sequence": (
        dm.Sequence(
            [dm.Jump("base"), dm.Sine("swing", "period", 0.75), dm.Linear("top", time="rise"), dm.Hold(0.3)], repeat=3
        ),
        3,
        lambda base, swing, period, top, rise: [
            (base, 0.0, swing, period, 0.75 * period),
            linear(base - swing, top, rise),
            hold(top, 0.3),
        ],
        lambda f, a, b: {"base": 0.6 * f, "swing": 0.2 * f, "period": b, "top": f, "rise": a},
    ),
}


def films(name, loaded):
    """Modulus ratio, dead load, internal stretch at the start and parameters of random films."""
    random = np.random.default_rng([*name.encode(), *loaded.encode()])
    for _ in range(6):
        ratio = float(np.exp(random.uniform(0.3, 2.5)))
        start = float(random.uniform(1.1, 2.5)) if loaded == "prestretch" else 1.0
        sigma = {"prestretch": start - start**-5, "stress": float(random.uniform(0.1, 0.6)), "": 0.0}[loaded]
        # Between fields that relaxed films carry and those that fresh ones do.
        field = float(random.uniform(0.7, 1.2) * ratio ** (0.35 * random.random()))
        field /= start ** (1.7 if loaded == "prestretch" else 0.0)
        times = random.uniform(0.3, 2.0, 2)
        yield ratio, sigma, start, CASES[name][3](field, *map(float, times))


@pytest.mark.parametrize("loaded", ["", "prestretch", "stress"])
@pytest.mark.parametrize("name", CASES)
def test_sweeps_agree_with_the_naive_twin(name, loaded):
    program, repeats, pieces, _ = CASES[name]
    drawn = [(film, naive(pieces(**film[3]), repeats, *film[:3])) for film in films(name, loaded)]
    drawn = [(film, expected) for film, expected in drawn if expected is not None]
    assert len(drawn) >= 4
    given = {key: [film[3][key] for film, _ in drawn] for key in drawn[0][0][3]}
    given["modulus_ratio"] = [film[0] for film, _ in drawn]
    if loaded:
        given[loaded] = [film[2] if loaded == "prestretch" else film[1] for film, _ in drawn]
    arrays = {key: xr.DataArray(values, dims="film") for key, values in given.items()}
    ds = dm.sweep(program, **arrays, rtol=RTOL)
    for number, (film, expected) in enumerate(drawn):
        found = {key: float(ds[key][number]) for key in ds}
        assert found["outcome"] == expected["outcome"], film
        for key, value in found.items():
            if key in expected:
                assert value == pytest.approx(expected[key], rel=RTOL, abs=0), (key, film)
            else:
                assert math.isnan(value), (key, film)
