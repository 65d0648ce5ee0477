"""Stretches beside the guaranteed results, of films that survive, against the flow in time by SciPy."""

import itertools

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

import dea_maps as dm

CRITICAL_LOAD = 0.75 * 4.0 ** (-1.0 / 3.0)


class Film:
    """A film under a dead load: (23), solved anew wherever it is asked for, and (26) for r = xi**2."""

    def __init__(self, ratio, sigma=0.0):
        self.p, self.sigma = ratio - 1.0, sigma

    def stretch(self, r, field):
        """Newton's method from above the root, where the load is concave: w = 1/lambda falls to it."""
        a, b, e = 1.0 + self.p / r, 1.0 + self.p * r * r, CRITICAL_LOAD * field * field
        w = (a / b) ** (1.0 / 6.0)
        for _ in range(100):
            miss = a * w**2 - b * w**8 - self.sigma * w**3 - e
            following = w - miss / (2.0 * a * w - 8.0 * b * w**7 - 3.0 * self.sigma * w**2)
            if not following < w:
                break
            w = following
        return 1.0 / w

    def along(self, field, times, r):
        """Go from corner to corner of a field; r at the end, and the least and the largest stretch."""
        stretches = []
        for start, end in itertools.pairwise(times):

            def flow(t, state):
                z = state[0] / self.stretch(state[0], field(t)) ** 2
                return [2.0 * (1.0 / z - z * z)]

            path = solve_ivp(flow, (start, end), [r], "DOP853", dense_output=True, rtol=1e-12, atol=1e-14)

            def at(t, path=path):
                return self.stretch(path.sol(t)[0], field(t))

            sampled = np.linspace(start, end, 200)
            values = np.array([at(t) for t in sampled])
            for sign in (1.0, -1.0):
                best = int(np.argmin(sign * values))
                around = sampled[max(best - 1, 0)], sampled[min(best + 1, 199)]
                refined = minimize_scalar(
                    lambda t, at=at, sign=sign: sign * at(t), bounds=around, method="bounded", options={"xatol": 1e-9}
                )
                stretches += [values[best], at(refined.x)]
            r = path.y[0, -1]
        return r, min(stretches), max(stretches)

    def limit_cycle(self, field, times, close=1e-10):
        """Least and largest stretch of the limit cycle: r at its start by secants, from a fresh film and beside it."""
        before, after = 1.0, 1.01
        changes = [self.along(field, times, r)[0] - r for r in (before, after)]
        while abs(after - before) > close:
            following = after - changes[1] * (after - before) / (changes[1] - changes[0])
            before, after = after, following
            changes = [changes[1], self.along(field, times, after)[0] - after]
        return self.along(field, times, after)[1:]


SINES = [
    {"modulus_ratio": 2.05, "bias": 0.4268, "amplitude": 0.6511, "period": 4.9e-4},
    {"modulus_ratio": 8.7, "stress": 0.35, "bias": 0.55, "amplitude": 0.7336, "period": 5.7e-3},
    {"modulus_ratio": 4.0, "bias": 0.5, "amplitude": 0.52, "period": 1.0},
    {"modulus_ratio": 4.0, "bias": 0.0, "amplitude": 1.2, "period": 8.0},
    {"modulus_ratio": 4.0, "bias": 0.6, "amplitude": 0.3, "period": 0.01},
]


@pytest.mark.parametrize("film", SINES)
@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
def test_limit_cycle_of_a_biased_sine(film, rtol):
    """The field of all but the last changes its sign: two zeros of it and an extreme lie close together."""
    quarters = film["period"] * np.linspace(0.0, 1.0, 5)

    def field(t):
        return film["bias"] + film["amplitude"] * np.sin(2.0 * np.pi * t / film["period"])

    least, largest = Film(film["modulus_ratio"], film.get("stress", 0.0)).limit_cycle(field, quarters)
    found = dm.sweep(dm.BiasedSine(), rtol=rtol, **film)
    assert found.outcome == 0
    assert float(found.steady_stretch_min) == pytest.approx(least, rel=rtol + 1e-10)
    assert float(found.steady_stretch_max) == pytest.approx(largest, rel=rtol + 1e-10)


TANGENTS = [
    {"modulus_ratio": 53.06467654615457, "field": 2.096583603829454},
    {"modulus_ratio": 294.5971774868962, "stress": 2.0581489250364187, "field": 0.572199755693237},
]


@pytest.mark.parametrize("film", TANGENTS)
def test_limit_cycle_beside_its_loss_at_a_tangent(film):
    """A cycle leaves 1 - 1e-4 or so of an error at its start: what a cycle misses becomes 1e4 times as much."""
    times = np.array([0.0, 0.4, 1.0, 2.0])
    wave = dm.Waveform(times, [0.0, 1.0, -0.5, 0.8], repeat=True)
    values = film["field"] * np.array([0.0, 1.0, -0.5, 0.8])
    least, largest = Film(film["modulus_ratio"], film.get("stress", 0.0)).limit_cycle(
        lambda t: float(np.interp(t, times, values)), times, 1e-7
    )
    for rtol in (1e-4, 1e-6):
        found = dm.sweep(wave, rtol=rtol, **film)
        assert float(found.steady_stretch_min) == pytest.approx(least, rel=rtol)
        assert float(found.steady_stretch_max) == pytest.approx(largest, rel=rtol)


def test_the_largest_of_peaks_that_grow_little_from_one_to_the_next():
    film = {"modulus_ratio": 11.609704669694947, "low": 0.30171027728813465, "amplitude": 1.2064556589204725}
    cycles, held, period = 40, 9.980392642183208, 1.6803843394620888
    pieces = [dm.Jump("low"), dm.Hold(held), dm.Sine("amplitude", period, cycles)]

    def field(t):
        wave = np.sin(2.0 * np.pi * (t - held) / period) if t > held else 0.0
        return film["low"] + film["amplitude"] * wave

    times = [0.0, *(held + period * np.linspace(0.0, cycles, 4 * cycles + 1))]
    largest = Film(film["modulus_ratio"]).along(field, times, 1.0)[2]
    for rtol in (1e-4, 1e-6, 1e-8):
        found = dm.sweep(dm.Sequence(pieces), rtol=rtol, **film)
        assert found.outcome == 0
        assert float(found.largest_stretch) == pytest.approx(largest, rel=rtol + 1e-10)


FALLS = [
    {"modulus_ratio": 7.174016625641439, "stress": 2.1210716175593936, "field": 0.3062881689191575,
     "rate": 16.347448964830345, "hold_time": 8.117664290931907, "fall_rate": 0.09171625369901534},
    {"modulus_ratio": 11.368139340709325, "stress": 0.36349118620662346, "field": 1.244332398830267,
     "rate": 1.3032758732477203, "hold_time": 0.0005461715597300788, "fall_rate": 1.428742577054328},
]  # fmt: skip


@pytest.mark.parametrize("film", FALLS)
@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9])
def test_film_that_creeps_at_both_ends_of_a_fall(film, rtol):
    """Its stretch grows at first and at the end, and falls in between: the largest one lies within."""
    up, hold, down = film["field"] / film["rate"], film["hold_time"], film["field"] / film["fall_rate"]
    times = np.cumsum([0.0, up, hold, down])

    def field(t):
        return float(np.interp(t, times, [0.0, film["field"], film["field"], 0.0]))

    largest = Film(film["modulus_ratio"], film["stress"]).along(field, times, 1.0)[2]
    found = dm.sweep(dm.Trapezoid(), rtol=rtol, **film)
    assert found.outcome == 0
    assert float(found.largest_stretch) == pytest.approx(largest, rel=rtol + 1e-10)
