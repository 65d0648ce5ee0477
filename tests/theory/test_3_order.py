"""Observed order of convergence, the event included, on the form that is regular at the instability.

The references come from other variables and other integrators: a ramp up to its failure on the margin form, up to its
corner on the field, a constant field by a quadrature over ``u = lambda**-2`` (the time to failure is an integral). They
also give the length of the solution in the variable that the kernel steps in. Steps are that length over N - 1/2: the
event then always falls in the middle of a step, and the error becomes a smooth function of the step.
"""

import math
from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from dea_maps.kernels import build, lane_state, sweep
from dea_maps.kernels.runge_kutta.tableaus import TABLEAUS

CRITICAL_LOAD = 0.75 * 4 ** (-1 / 3)
TIGHT = {"method": "DOP853", "rtol": 3e-14, "atol": 1e-15}
NODES, WEIGHTS = np.polynomial.legendre.leggauss(80)


class Reference(NamedTuple):
    """Time and stretch at failure, and the length of each piece in the kernel's variable s, dT = (D/m) ds."""

    time: float
    stretch: float
    lengths: tuple[float, ...]


def softening(u, r, p):
    """A, B and D = 4 B u**3 - A, the factor before dlambda/dT in equation (24) but for a power of lambda."""
    A, B = 1 + p / r, 1 + p * r * r
    return A, B, 4 * B * u**3 - A


def flow(u, r):
    """dr/dT, equation (26) for r = xi**2."""
    z = u * r
    return 2 * (1 / z - z * z)


def stretch_under(load, r, p):
    """Physical root u of equation (23), coming down to it from the unloaded film."""
    A, B = 1 + p / r, 1 + p * r * r
    low = (A / (4 * B)) ** (1 / 3)
    u = 4 ** (1 / 3) * low
    for _ in range(80):
        step = (u * (A - B * u**3) - load) / (A - 4 * B * u**3)
        u -= step
        if abs(step) < 4e-16:
            return u
    raise AssertionError("no equilibrium")


def ramp(rate, ratio):
    """The margin form: s from 0 to 1 at the failure, 4 B u**3/A = 4 - 3 s**2, E = s G(s, r)."""
    p = ratio - 1

    def capacity(s, r):
        A, B = 1 + p / r, 1 + p * r * r
        u = ((4 - 3 * s * s) * A / (4 * B)) ** (1 / 3)
        return A, B, u, math.sqrt(0.75 * A * u / CRITICAL_LOAD)

    def slopes(s, y):
        r = y[0]
        A, B, u, G = capacity(s, r)
        fall = G * (2 * p / (3 * r * r * A) + p * r / (3 * B))  # -dG/dr
        slow = 4 * G / (4 - 3 * s * s) / (rate + s * fall * flow(u, r))  # dT/ds over 1 - s**2
        return [flow(u, r) * slow * (1 - s * s), ratio * slow / (3 * A)]

    r, length = solve_ivp(slopes, (0, 1), [1.0, 0.0], **TIGHT).y[:, -1]
    _, _, u, field = capacity(1.0, r)
    return Reference(field / rate, u**-0.5, (length,))


def corner(field, rate, ratio):
    """Where a ramp gets to a field: u, r, and the length of the way."""
    p = ratio - 1

    def slopes(E, y):
        u = stretch_under(CRITICAL_LOAD * E * E, y[0], p)
        return [flow(u, y[0]) / rate, ratio / softening(u, y[0], p)[2] / rate]

    r, length = solve_ivp(slopes, (0, field), [1.0, 0.0], **TIGHT).y[:, -1]
    return stretch_under(CRITICAL_LOAD * field * field, r, p), length


def hold(field, start, ratio):
    """From u at the start to failure under a constant field: time and length are integrals over u."""
    p = ratio - 1
    r = brentq(lambda r: (1 + p / r) ** 4 - (1 + p * r * r) * field**6, 1, 50, xtol=1e-15, rtol=1e-15)
    end = ((1 + p / r) / (4 * (1 + p * r * r))) ** (1 / 3)
    time = length = 0.0
    for node, weight in zip(NODES, WEIGHTS, strict=True):
        u = end + (start - end) * (node + 1) / 2
        h = (CRITICAL_LOAD * field * field - u + u**4) / (p * u * u)
        r = brentq(lambda z, h=h: z * (z * z + h) - 1, 0, 1, xtol=1e-16, rtol=1e-15) / u
        piece = ratio / (2 * p * u * (1 / r**2 + 2 * r * u**3) * h) * weight * (start - end) / 2
        length += piece
        time += piece * softening(u, r, p)[2] / ratio
    return Reference(time, end**-0.5, (length,))


def reference(program, field, rate, ratio):
    if program == "ramp":
        return ramp(rate, ratio)
    if program == "step":
        return hold(field, stretch_under(CRITICAL_LOAD * field * field, 1.0, ratio - 1), ratio)
    u, length = corner(field, rate, ratio)
    held = hold(field, u, ratio)
    return Reference(field / rate + held.time, held.stretch, (length, *held.lengths))


def kernel(program, method):
    """The sweep as plain Python, of one lane: the same functions that are compiled, at their own order."""
    made = build.sweep_for(program, "fold", method, adaptive=False, lanes=1)
    return getattr(made, "py_func", made)


# Scenes in which the leading term of the error rules well before rounding does: program, method, field, rate, modulus
# ratio, numbers of steps. The films of m = 200 have a long and even way to go. The hold of a ramp_hold is as long as
# its ramp, so that the event falls in the middle of a step in both.
SCENES = [
    ("step", "rk4", 1.5, 0.0, 4.0, (16, 23, 32, 45)),
    ("step", "dopri5", 1.3, 0.0, 3.0, (45, 64, 91, 128)),
    ("step", "dop853", 4.0, 0.0, 200.0, (20, 25, 32, 40)),
    ("ramp", "rk4", 0.0, 12.0, 4.0, (32, 45, 64, 91)),
    ("ramp", "dopri5", 0.0, 12.0, 4.0, (23, 32, 45, 64)),
    ("ramp", "dop853", 0.0, 0.1, 200.0, (32, 40, 51, 64)),
    ("ramp_hold", "rk4", 1.74746, 5.0, 4.0, (16, 23, 32, 45)),
    ("ramp_hold", "dopri5", 4.7018, 0.5, 200.0, (91, 128, 181, 256)),
    ("ramp_hold", "dop853", 4.7018, 0.5, 200.0, (13, 16, 20, 25)),
]


@pytest.mark.parametrize(
    ("program", "method", "field", "rate", "ratio", "counts"), SCENES, ids=["-".join(scene[:2]) for scene in SCENES]
)
def test_time_and_stretch_converge_at_the_order_of_the_method(program, method, field, rate, ratio, counts):
    exact = reference(program, field, rate, ratio)
    assert exact.lengths[-1] == pytest.approx(exact.lengths[0], rel=1e-4)
    steps = exact.lengths[-1] / (np.array(counts) - 0.5)
    cell = [np.array([value]) for value in (field, rate, ratio)]
    errors = []
    for step in steps:
        status, result = np.empty(1, np.int8), np.empty((sweep.RESULTS, 1))
        kernel(program, method)(*cell, math.inf, step, 10_000, status, result)
        assert status[0] == lane_state.FAILED
        found = result[[sweep.TIME_TO_FAILURE, sweep.CRITICAL_STRETCH], 0]
        errors.append(np.abs(found / exact[:2] - 1))
    assert np.min(errors) > 3e-14, "rounding, not the method"
    order = TABLEAUS[method].order
    for name, column in zip(("time", "stretch"), np.transpose(errors), strict=True):
        slope = np.polyfit(np.log(steps), np.log(column), 1)[0]
        assert slope == pytest.approx(order, abs=0.2), f"{name}: {column}"


def test_references_agree_with_the_table():
    """Ten digits each, computed by other means."""
    assert reference("step", 1.5, 0.0, 4.0)[:2] == pytest.approx((0.5463781327, 1.464347835), rel=4e-10)
    assert reference("ramp", 0.0, 1.0, 4.0)[:2] == pytest.approx((1.581172717, 1.423228766), rel=4e-10)
    # a ramp that is over at once
    assert reference("ramp_hold", 1.5, 1e5, 4.0)[:2] == pytest.approx((0.5463781327, 1.464347835), rel=1e-4)
