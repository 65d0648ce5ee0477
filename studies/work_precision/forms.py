"""The problem as it is given to other solvers: the paper's rate form, and the best forms known for a general solver.

``u = lambda**-2``, ``r = xi**2``, ``p = m - 1``, ``A = 1 + p/r``, ``B = 1 + p r**2``, load ``e = e_C Er**2``.
Right-hand sides are plain arithmetic, without calls of each other, so that every library can take them: floats, arrays,
symbols.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scenes import Cases

CRITICAL_U = 4.0 ** (-1.0 / 3.0)
CRITICAL_LOAD = 0.75 * CRITICAL_U
THIRD = 1.0 / 3.0

Arrays = Sequence[np.ndarray]


class Problem(NamedTuple):
    """Cases ready for a solver: (cases,) arrays, and (rows, cases) of states and constants.

    ``begin`` and ``end`` are those of the independent variable; ``u`` at failure is filled in where it is known.
    """

    begin: np.ndarray
    end: np.ndarray
    states: np.ndarray
    constants: np.ndarray
    u: np.ndarray | None = None


class Form(NamedTuple):
    """A formulation.

    Attributes
    ----------
    name : str
        "rate" is the paper's own, with an event; the others end at a known place.
    make : callable
        ``make(exp) -> rhs``, ``rhs(t, y, a)`` the derivatives of the states y with the constants a, as a tuple.
    pose : callable
        ``pose(cases) -> Problem``.
    read : callable
        ``read(cases, problem, t, y) -> (time to failure, critical stretch)`` from the end of the integration.
    """

    name: str
    make: Callable[[Any], Callable[..., tuple[Any, ...]]]
    pose: Callable[[Cases], Problem]
    read: Callable[[Cases, Problem, np.ndarray, Arrays], tuple[np.ndarray, np.ndarray]]


def _make_rate(exp: Any) -> Callable[..., tuple[Any, ...]]:
    def rate(t, y, a):
        stretch, xi = y[0], y[1]
        p = a[0]
        inverse = 1.0 / stretch
        v = inverse * inverse
        w = 1.0 / (xi * xi)
        cube = xi * xi * xi
        flow = w * w * xi / v - v * v * cube  # (26)
        load_rate = 2.0 * CRITICAL_LOAD * (a[1] + a[2] * t) * a[2]
        by_xi = -2.0 * p * v * w / xi - 4.0 * p * v * v * v * v * cube
        by_stretch = inverse * v * (8.0 * (1.0 + p * xi * cube) * v * v * v - 2.0 * (1.0 + p * w))
        return (load_rate - by_xi * flow) / by_stretch, flow  # (24)

    return rate


def distance(xi, p):
    """Stretch at the instability for an internal stretch, (25)."""
    r = xi * xi
    return (4.0 * (1.0 + p * r * r) / (1.0 + p / r)) ** (1.0 / 6.0)


def _start_u(load: np.ndarray, ratio: np.ndarray) -> np.ndarray:
    """Return u right after a sudden load, where ``u - u**4 = load/m``, by Newton's method from above."""
    share = load / ratio
    x = np.sqrt(np.maximum(1.0 - share / CRITICAL_LOAD, 0.0))  # u/u* = 1 + y, y**2 (6 + 4 y + y**2) = 3 x**2
    y = x * (0.7071067811865476 + x * (-0.16666666666666666 + x * 0.047))
    for _ in range(4):
        y = y - (y * y * (6.0 + y * (4.0 + y)) - 3.0 * x * x) / (y * (12.0 + y * (12.0 + 4.0 * y)))
    return CRITICAL_U * (1.0 + y)


def _pose_rate(cases: Cases) -> Problem:
    load = CRITICAL_LOAD * cases.field**2
    stretch = 1.0 / np.sqrt(_start_u(load, cases.ratio))
    with np.errstate(divide="ignore"):  # the field never passes sqrt(m); a step takes twice the bottleneck at most
        by_ramp = 1.01 * np.sqrt(cases.ratio) / cases.rate
        by_step = 2.0 + 2.0 * np.pi * (cases.ratio - 1.0) / (3.0 * np.sqrt(cases.field - 1.0 + (cases.rate > 0.0)))
    end = np.where(cases.rate > 0.0, by_ramp, by_step)
    states = np.array([stretch, np.ones_like(stretch)])
    return Problem(np.zeros_like(end), end, states, np.array([cases.ratio - 1.0, cases.field, cases.rate]))


def _read_rate(cases: Cases, problem: Problem, t: np.ndarray, y: Arrays) -> tuple[np.ndarray, np.ndarray]:
    return t, y[0]


# The margin form: with q = 4 B u**3/A from 4 (no load) to 1 (failure) and s = sqrt((4 - q)/3) as the independent
# variable, u = (q A/4 B)**(1/3) and e = 0.75 A u s**2; a ramp has the one state r, a constant field r and T.


def _make_margin_ramp(exp: Any) -> Callable[..., tuple[Any, ...]]:
    def margin_ramp(t, y, a):
        r = y[0]
        p = a[0]
        A = 1.0 + p / r
        B = 1.0 + p * r * r
        rest = 1.0 - t * t
        q = 1.0 + 3.0 * rest
        u = (0.25 * q * A / B) ** THIRD
        z = u * r
        speed = 2.0 * (1.0 / z - z * z)
        field = (0.75 / CRITICAL_LOAD * A * u) ** 0.5  # over s
        by_r = -(4.0 * THIRD) * p / (r * r * A) - (2.0 * THIRD) * p * r / B
        return (8.0 * speed * rest / (q * (2.0 * a[1] / field - t * by_r * speed)),)

    return margin_ramp


def _pose_margin_ramp(cases: Cases) -> Problem:
    one = np.ones_like(cases.rate)
    return Problem(0.0 * one, one, one[np.newaxis].copy(), np.array([cases.ratio - 1.0, cases.rate]))


def at_failure(r: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return A and u at the instability."""
    A = 1.0 + p / r
    return A, (0.25 * A / (1.0 + p * r * r)) ** THIRD


def _read_margin_ramp(cases: Cases, problem: Problem, t: np.ndarray, y: Arrays) -> tuple[np.ndarray, np.ndarray]:
    A, u = at_failure(y[0], problem.constants[0])
    return np.sqrt(0.75 / CRITICAL_LOAD * A * u) / cases.rate, 1.0 / np.sqrt(u)


def _make_margin_step(exp: Any) -> Callable[..., tuple[Any, ...]]:
    def margin_step(t, y, a):
        r = y[0]
        p = a[0]
        A = 1.0 + p / r
        B = 1.0 + p * r * r
        rest = 1.0 - t * t
        q = 1.0 + 3.0 * rest
        z = (0.25 * q * A / B) ** THIRD * r
        by_r = (4.0 * THIRD) * p / (r * r * A) + (2.0 * THIRD) * p * r / B
        slope = 8.0 * rest / (q * t * by_r)
        return slope, 0.5 * slope / (1.0 / z - z * z)

    return margin_step


def _pose_margin_step(cases: Cases) -> Problem:
    load = CRITICAL_LOAD * cases.field**2
    u = _start_u(load, cases.ratio)
    begin = np.sqrt(load / (0.75 * cases.ratio * u))
    one = np.ones_like(u)
    return Problem(begin, one, np.array([one, 0.0 * one]), (cases.ratio - 1.0)[np.newaxis])


def _read_margin_step(cases: Cases, problem: Problem, t: np.ndarray, y: Arrays) -> tuple[np.ndarray, np.ndarray]:
    _, u = at_failure(y[0], problem.constants[0])
    return y[1], 1.0 / np.sqrt(u)


# Constant field as an integral over u = u* - w sinh(t), which moves the poles of the bottleneck off the real axis.


def _make_sinh(exp: Any) -> Callable[..., tuple[Any, ...]]:
    def sinh(t, y, a):
        p, excess, width = a[0], a[1], a[2]
        grown = exp(t)
        shrunk = 1.0 / grown
        x = -0.5 * width * (grown - shrunk)
        u = CRITICAL_U + x
        n = excess + x * x * (u * u + CRITICAL_U * (2.0 * u + 3.0 * CRITICAL_U))  # e - u + u**4
        h = n / (p * u * u)
        root = (0.5 + (0.25 + h * h * h / 27.0) ** 0.5) ** THIRD
        z = root - THIRD * h / root  # z**3 + h z = 1
        D = 4.0 * u * u * u - 1.0 + p * u * (4.0 * z * z - 1.0 / z)
        return (0.25 * width * (grown + shrunk) * D * z * z / (u * n * (1.0 + 2.0 * z * z * z)),)

    return sinh


def sinh_ends(cases: Cases) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return e - e_C, width w of the map, its ends, and u at failure, which solves ``A**4 = Er**6 B``."""
    p = cases.ratio - 1.0
    excess = CRITICAL_LOAD * (cases.field - 1.0) * (cases.field + 1.0)
    width = np.sqrt(excess / (6.0 * CRITICAL_U**2))
    first = _start_u(CRITICAL_LOAD * cases.field**2, cases.ratio)
    sixth = 6.0 * np.log1p(cases.field - 1.0)
    t = np.zeros_like(p)
    for _ in range(6):  # Newton's method for log(r)
        r = np.exp(t)
        A, B = 1.0 + p / r, 1.0 + p * r * r
        t = t + (4.0 * np.log(A) - np.log(B) - sixth) / (4.0 * p / (r * A) + 2.0 * p * r * r / B)
    _, last = at_failure(np.exp(t), p)
    return excess, width, np.arcsinh((CRITICAL_U - first) / width), np.arcsinh((CRITICAL_U - last) / width), last


def _pose_sinh(cases: Cases) -> Problem:
    excess, width, begin, end, last = sinh_ends(cases)
    return Problem(begin, end, np.zeros((1, end.size)), np.array([cases.ratio - 1.0, excess, width]), last)


def _read_sinh(cases: Cases, problem: Problem, t: np.ndarray, y: Arrays) -> tuple[np.ndarray, np.ndarray]:
    return y[0], 1.0 / np.sqrt(problem.u)


HELD, CHANGING = _make_margin_step, _make_margin_ramp
"""Right-hand sides on the margin under a held field and under one that changes linearly."""
RATE = Form("rate", _make_rate, _pose_rate, _read_rate)
SINH = Form("sinh integral", _make_sinh, _pose_sinh, _read_sinh)
BEST = {
    "ramp": (Form("margin", _make_margin_ramp, _pose_margin_ramp, _read_margin_ramp),),
    "step": (Form("margin", _make_margin_step, _pose_margin_step, _read_margin_step), SINH),
}
"""Forms that end at a known place, by loading program."""
