"""A naive twin of the stepped kernels, one film in plain Python, straight from the equations of the paper.

Textbook Runge-Kutta steps of fixed length, bisection of the last one down to the event: slow and readable. At the same
step the kernels must give the same numbers. A second check integrates the paper's equations with scipy.
"""

import math

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

import dea_maps as dm

CRITICAL_LOAD = 0.75 * 4 ** (-1 / 3)
FAILS_LATER = 1


def pieces_of(program, field, rate):
    """Pieces of a loading program: field at the start, its rate, duration."""
    if isinstance(program, dm.Step):
        return [(field, 0.0, math.inf)]
    if isinstance(program, dm.Ramp):
        return [(0.0, rate, math.inf)]
    return [(0.0, rate, field / rate), (field, 0.0, math.inf)]


def equilibrium(load, xi, p):
    """Stretch below lambda_c that solves (23) for a load that the film can carry."""
    A, B = 1 + p * xi**-2, 1 + p * xi**4
    low, high = (B / A) ** (1 / 6), critical_stretch(xi, p)  # unloaded, and at the instability
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if A * middle**-2 - B * middle**-8 < load else (low, middle)
    return (low + high) / 2


def critical_stretch(xi, p):
    """Equation (25)."""
    return 2 ** (1 / 3) * ((1 + p * xi**4) / (1 + p * xi**-2)) ** (1 / 6)


class Rate:
    """Equations (24) and (26) in time; states T, lambda, xi."""

    def state(self, time, stretch, xi):
        return np.array([time, stretch, xi])

    def slopes(self, state, field, rate, p):
        _, lam, xi = state
        xi_rate = lam**2 * xi**-3 - lam**-4 * xi**3
        load_rate = 2 * CRITICAL_LOAD * field * rate
        factor = -2 * lam**-3 * (1 + p * xi**-2) + 8 * lam**-9 * (1 + p * xi**4)
        relaxing = p * (2 * lam**-2 * xi**-3 + 4 * lam**-8 * xi**3) * xi_rate
        return np.array([1.0, (load_rate + relaxing) / factor, xi_rate])

    def distance(self, state, p):
        _, lam, xi = state
        return critical_stretch(xi, p) - lam


class Fold:
    """The same in rescaled time, dT = (D/m) ds; states T, u = lambda**-2, r = xi**2."""

    def state(self, time, stretch, xi):
        return np.array([time, stretch**-2, xi**2])

    def slopes(self, state, field, rate, p):
        _, u, r = state
        h = 1 / (u * r) - (u * r) ** 2
        D = 4 * (1 + p * r**2) * u**3 - (1 + p / r)
        load_rate = 2 * CRITICAL_LOAD * field * rate
        fall = load_rate + 2 * p * u * (r**-2 + 2 * r * u**3) * h
        return np.array([D, -fall, 2 * h * D]) / (1 + p)

    def distance(self, state, p):
        _, u, r = state
        return 4 * (1 + p * r**2) * u**3 - (1 + p / r)


class Walk:
    """One piece of a loading program, up to the last step, the one that would end behind an event."""

    def __init__(self, form, p, now, xi, piece, step):
        start, slope, duration = piece
        self.form, self.p, self.end = form, p, now + duration
        self.applied = lambda time: (start + slope * (time - now), slope)
        self.state = form.state(now, equilibrium(CRITICAL_LOAD * start**2, xi, p), xi)
        while self.before(following := self.advance(step)):
            self.state = following

    def slopes(self, state):
        return self.form.slopes(state, *self.applied(state[0]), self.p)

    def advance(self, h):
        """The classical Runge-Kutta step."""
        k1 = self.slopes(self.state)
        k2 = self.slopes(self.state + h / 2 * k1)
        k3 = self.slopes(self.state + h / 2 * k2)
        k4 = self.slopes(self.state + h * k3)
        return self.state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)

    def before(self, state):
        return self.form.distance(state, self.p) > 0 and state[0] < self.end

    def event(self, step):
        """State at the first event of the piece, the last step bisected."""
        low, high = 0.0, step
        for _ in range(100):
            middle = (low + high) / 2
            low, high = (middle, high) if self.before(self.advance(middle)) else (low, middle)
        return self.advance(high)


def naive_failure(program, field, rate, ratio, step):
    """Time, stretch and internal stretch at failure, by steps of one length on the regular form."""
    p, now, xi = ratio - 1, 0.0, 1.0
    for piece in pieces_of(program, field, rate):
        walk = Walk(Fold(), p, now, xi, piece, step)
        now, _, r = walk.event(step)
        xi = math.sqrt(r)
        if now < walk.end * (1 - 1e-14):
            return now, critical_stretch(xi, p), xi
    raise AssertionError("no failure")


NAMES = ("time_to_failure", "critical_stretch", "critical_internal_stretch")
# Field, rate and modulus ratio of every film. Ramps that are held fail in the hold, in the ramp, and in the hold again.
SCENES = [
    (dm.Step(), [(1.05, None, 2.0), (1.2, None, 4.0), (1.5, None, 4.0), (3.0, None, 10.0)]),
    (dm.Ramp(), [(None, 0.3, 2.0), (None, 1.0, 4.0), (None, 5.0, 10.0)]),
    (dm.RampHold(), [(1.2, 0.7, 4.0), (2.0, 1.0, 4.0), (1.5, 10.0, 3.0)]),
]


def swept(program, films, form, step):
    """Time, stretch and internal stretch at failure of every film, by the kernel."""
    columns = zip(("field", "rate", "modulus_ratio"), zip(*films, strict=True), strict=True)
    given = {name: xr.DataArray(list(values), dims="film") for name, values in columns if None not in values}
    ds = dm.sweep(program, **given, method="rk4", formulation=form, step=step)
    assert (ds.outcome == FAILS_LATER).all()
    return np.stack([ds[name].values for name in NAMES], axis=-1)


@pytest.mark.parametrize(("program", "films"), SCENES, ids=[scene[0].name for scene in SCENES])
def test_regular_form_agrees_with_its_naive_twin(program, films):
    naive = [naive_failure(program, *film, 0.02) for film in films]
    np.testing.assert_allclose(swept(program, films, "fold", 0.02), naive, rtol=1e-12)


def test_rate_form_agrees_with_its_naive_twin():
    # A step over the singularity may meet lambda = lambda_c more than once. What the kernel finds must be such a
    # point, on the twin's own last step. The kernel stops at a distance of 1e-9 in lambda.
    films = [(1.05, None, 2.0), (1.2, None, 4.0), (1.5, None, 4.0)]
    for film, found in zip(films, swept(dm.Step(), films, "rate", 0.005), strict=True):
        p = film[2] - 1
        walk = Walk(Rate(), p, 0.0, 1.0, pieces_of(dm.Step(), *film[:2])[0], 0.005)
        assert 0 < found[0] - walk.state[0] <= 0.005
        np.testing.assert_allclose(walk.advance(found[0] - walk.state[0]), found, rtol=1e-9)
        assert critical_stretch(found[2], p) == pytest.approx(found[1], abs=2e-9)


FILMS_IN_TIME = [
    (dm.Step(), {"field": 1.2, "modulus_ratio": 4.0}, 2.443625636),
    (dm.Ramp(), {"rate": 0.1, "modulus_ratio": 4.0}, 12.44370088),
    (dm.RampHold(), {"field": 0.9, "rate": 0.5, "modulus_ratio": 4.0}, 12.0),
]


@pytest.mark.parametrize(("program", "given", "last"), FILMS_IN_TIME, ids=[film[0].name for film in FILMS_IN_TIME])
def test_trajectory_follows_the_equations_of_the_paper(program, given, last):
    """Equations (24) and (26) as printed, by scipy, away from the fold: up to nine tenths of the time to failure."""
    times = np.linspace(0.0, 0.9, 10) * last
    p, form = given["modulus_ratio"] - 1, Rate()
    expected, now, xi = [], 0.0, 1.0
    for start, slope, duration in pieces_of(program, given.get("field"), given.get("rate")):
        end = min(now + duration, last)
        inside = times[(times >= now) & (times <= end)]
        state = form.state(now, equilibrium(CRITICAL_LOAD * start**2, xi, p), xi)

        def slopes(time, y, start=start, slope=slope, now=now):
            return form.slopes([time, *y], start + slope * (time - now), slope, p)[1:]

        solution = solve_ivp(
            slopes, (now, end), state[1:], method="Radau", t_eval=[*inside, end], rtol=1e-9, atol=1e-11
        )
        expected += list(solution.y.T[: len(inside)])
        now, xi = end, solution.y[1, -1]
    ds = dm.trajectory(program, time=times, **given, rtol=1e-9)
    np.testing.assert_allclose(np.stack([ds.stretch, ds.internal_stretch], axis=-1), expected, rtol=1e-7)
