"""The truth, by formulations and methods that share nothing with `dea_maps`, nor, for ramps, with the other solvers.

Constant field: the integral over ``u = u* - w sinh(t)`` by Gauss and Legendre on many short pieces. Ramp: with
``w = sqrt(1 - lambda**-2)`` as the independent variable and ``rho = xi**2 - 1`` as the state,

    drho/dw = 4 w h D/(de/dT + 2 p u h (1/r**2 + 2 r u**3)),    u = 1 - w**2,    h = 1/z - z**2,    z = u r,

by collocation at 8 Radau nodes on short panels (order 15, L-stable); D = 0 is located by the length of the last panel.
Films under several pieces or a dead load are those of `passages`.
"""

import importlib.util
import sys
from functools import cache
from pathlib import Path
from typing import Any

import forms
import numpy as np
from numpy.typing import NDArray
from passages import Failure, failures
from pieces import Films, pieces_of
from scenes import SCENES, Cases, Scene

STAGES = 8
PANEL = 0.01
PIECES = 8
NEWTON = 9
SAMPLE = 3
Array = NDArray[np.float64]


@cache
def radau() -> tuple[Array, Array]:
    """Nodes on (0, 1] and integration matrix of the Radau IIA method."""
    series = np.zeros(STAGES + 1)
    series[STAGES - 1 :] = -1.0, 1.0
    nodes = np.sort(np.polynomial.legendre.legroots(series))
    nodes[-1] = 1.0
    degrees = np.arange(STAGES)
    values = np.polynomial.legendre.legvander(nodes, STAGES)
    integrals = np.empty((STAGES, STAGES))
    integrals[:, 0] = nodes + 1.0
    integrals[:, 1:] = (values[:, 2:] - values[:, :-2]) / (2.0 * degrees[1:] + 1.0)
    return 0.5 * (nodes + 1.0), 0.5 * integrals @ np.linalg.inv(values[:, :STAGES])


def _state(w: Array, rho: NDArray, p: Array) -> tuple[NDArray, ...]:
    """Return e, D, u, h and r."""
    u = 1.0 - w * w
    r = 1.0 + rho
    less = w * w * r - rho  # 1 - z
    z = 1.0 - less
    h = less * (1.0 + z + z * z) / z
    load = u * (w * w * (1.0 + u + u * u) + p * u * h)
    stiffness = 4.0 * (1.0 + p * r * r) * u**3 - 1.0 - p / r
    return load, stiffness, u, h, r


def _slope(w: Array, rho: NDArray, p: Array, rate: Array) -> NDArray:
    with np.errstate(all="ignore"):  # a trial of Newton's method may lead anywhere
        load, stiffness, u, h, r = _state(w, rho, p)
        rise = 2.0 * rate * np.sqrt(forms.CRITICAL_LOAD * load)
        return 4.0 * w * h * stiffness / (rise + 2.0 * p * u * h * (1.0 / (r * r) + 2.0 * r * u**3))


def _panel(w: Array, rho: Array, width: Array, p: Array, rate: Array) -> Array:
    """State at the end of one panel of each case, NaN where Newton's method fails; derivatives by a complex step."""
    nodes, matrix = radau()
    places = w[:, np.newaxis] + width[:, np.newaxis] * nodes
    p, rate = p[:, np.newaxis], rate[:, np.newaxis]
    # First guess: 1 - z grows like w, as it does on the slow manifold; from the unloaded film, no flow.
    share = (w * w * (1.0 + rho) - rho) / np.maximum(w, 1e-300)
    values = (places * places - share[:, np.newaxis] * places) / (1.0 - places * places)
    values = np.where((w > 0.0)[:, np.newaxis], values, rho[:, np.newaxis])
    scaled = width[:, np.newaxis, np.newaxis] * matrix
    change = values
    for _ in range(NEWTON):
        found = _slope(places, values + 1e-40j, p, rate)
        residual = rho[:, np.newaxis] + np.einsum("cij,cj->ci", scaled, found.real) - values
        jacobian = np.eye(STAGES) - scaled * (found.imag * 1e40)[:, np.newaxis, :]
        lost = ~np.isfinite(jacobian).all(axis=(1, 2))
        jacobian[lost] = np.eye(STAGES)
        change = np.linalg.solve(jacobian, residual[..., np.newaxis])[..., 0]
        values = values + change
        if np.all(np.abs(change) <= 2e-15 * (1.0 + np.abs(values))):
            break
    settled = np.all(np.abs(change) <= 1e-13 * (1.0 + np.abs(values)), axis=1)
    right = np.all((values > 0.0) & (places * places * (1.0 + values) > values), axis=1)  # 0 < z < 1: no other branch
    return np.where(settled & right, values[:, -1], np.nan)


def _climb(cases: Cases, target: Array, panel: float) -> tuple[Array, Array]:
    """Return (w, rho) where a ramp reaches a load, or the instability if that is infinite."""
    p, rate = cases.ratio - 1.0, cases.rate

    def left(w: Array, rho: Array, which: NDArray) -> Array:
        load, stiffness, *_ = _state(w, rho, p[which])
        return np.where(np.isfinite(target[which]), target[which] - load, stiffness)

    w, rho = np.zeros_like(p), np.zeros_like(p)
    width = np.minimum(0.1 * rate, panel)
    distance = np.full(p.size, np.inf)
    crossed = np.zeros(p.size)  # what is left, at the end of the panel that passes the event
    going = np.full(p.size, True)
    while going.any():
        now = np.flatnonzero(going)
        end = _panel(w[now], rho[now], width[now], p[now], rate[now])
        width[now[np.isnan(end)]] *= 0.4
        if width.min() < 1e-10:
            raise RuntimeError("the truth about a ramp was not found: panels without end")
        now, end = now[np.isfinite(end)], end[np.isfinite(end)]
        ahead = left(w[now] + width[now], end, now)
        passed = ahead <= 0.0
        crossed[now[passed]] = ahead[passed]
        going[now[passed]] = False
        now, end, ahead = now[~passed], end[~passed], ahead[~passed]
        w[now] += width[now]
        rho[now] = end
        distance[now] = ahead
        width[now] = np.minimum(1.4 * width[now], panel)
    every = np.arange(p.size)
    low, high, at_low, at_high = np.zeros_like(width), width.copy(), distance, crossed
    best = width
    for step in range(40):  # regula falsi, Illinois variant, a bisection now and then
        best = 0.5 * (low + high) if step % 5 == 4 else (low * at_high - high * at_low) / (at_high - at_low)
        best = np.where(np.isfinite(best), best, low)
        found = left(w + best, _panel(w, rho, best, p, rate), every)
        above = found > 0.0
        at_high = np.where(above, 0.5 * at_high, found)
        at_low = np.where(above, found, 0.5 * at_low)
        low, high = np.where(above, best, low), np.where(above, high, best)
        if np.all(np.abs(found) < 3e-16) or np.all(high - low <= 2e-16 * w):
            break
    return w + best, _panel(w, rho, best, p, rate)


def _ramp(cases: Cases, panel: float) -> tuple[Array, Array]:
    w, rho = _climb(cases, np.full(cases.rate.size, np.inf), panel)
    load, _, u, _, _ = _state(w, rho, cases.ratio - 1.0)
    return np.sqrt(load / forms.CRITICAL_LOAD) / cases.rate, 1.0 / np.sqrt(u)


def _integral(begin: Array, end: Array, constants: Array, pieces: int) -> Array:
    """Time under a constant field between two places of the sinh map."""
    rhs = forms.SINH.make(np.exp)
    nodes, weights = np.polynomial.legendre.leggauss(16)
    length = (end - begin) / pieces
    total = np.zeros_like(begin)
    for piece in range(pieces):
        for node, weight in zip(nodes, weights, strict=True):
            place = begin + length * (piece + 0.5 * (1.0 + node))
            total += 0.5 * weight * length * rhs(place, None, constants)[0]
    return total


def _step(cases: Cases, pieces: int) -> tuple[Array, Array]:
    excess, width, begin, end, last = forms.sinh_ends(cases)
    time = _integral(begin, end, np.array([cases.ratio - 1.0, excess, width]), pieces)
    return time, 1.0 / np.sqrt(last)


def _ramp_hold(cases: Cases, panel: float, pieces: int) -> tuple[Array, Array]:
    time, stretch = _ramp(cases, panel)
    holds = cases.field < time * cases.rate
    some = Cases(*(column[holds] for column in cases))
    w, _ = _climb(some, forms.CRITICAL_LOAD * some.field**2, panel)
    excess, width, _, end, last = forms.sinh_ends(some)
    begin = np.arcsinh((forms.CRITICAL_U - 1.0 + w * w) / width)
    rest = _integral(begin, end, np.array([some.ratio - 1.0, excess, width]), pieces)
    time[holds] = some.field / some.rate + rest
    stretch[holds] = 1.0 / np.sqrt(last)
    return time, stretch


def ramp_hold(cases: Cases) -> tuple[Array, Array]:
    """Return time to failure and critical stretch of ramps that hold."""
    return _ramp_hold(cases, PANEL, PIECES)


def _compute(program: str, cases: Cases, refinement: int) -> tuple[Array, Array]:
    panel, pieces = PANEL / refinement, PIECES * refinement
    if program == "step":
        return _step(cases, pieces)
    return _ramp(cases, panel) if program == "ramp" else _ramp_hold(cases, panel, pieces)


@cache
def truth(name: str, number: int) -> tuple[Array, Array]:
    """Time to failure and critical stretch of every case of a scene."""
    cases = SCENES[name].cases(number)
    if isinstance(cases, Films):
        return failure(cases)[:2]
    return _compute(SCENES[name].program, cases, 1)


_FAILURES: dict[tuple[str, int], Failure] = {}


def failure(films: Films) -> Failure:
    """Return what becomes of the films of a scene, computed once for every number of them."""
    key = films.scene, films.ratio.size
    if key not in _FAILURES:
        _FAILURES[key] = failures(films)
    return _FAILURES[key]


def doubt(scene: Scene, number: int) -> float:
    """Return the largest relative change of the truth with panels and pieces halved, or a quarter of the tolerance."""
    cases = scene.cases(number)
    finer = failures(cases, 2)[:2] if isinstance(cases, Films) else _compute(scene.program, cases, 2)
    return max(float(np.max(np.abs(a / b - 1.0))) for a, b in zip(truth(scene.name, number), finer, strict=True))


def against_reference(scene: Scene, number: int) -> float | None:
    """Return the largest relative difference from the tests' references, on a sample; None without their libraries.

    These are computed with mpmath to 20 digits and more or, where there are several pieces or a dead load, with the
    Taylor series of heyoka in extended precision.
    """
    cases, known = scene.cases(number), truth(scene.name, number)
    needed = ("mpmath", "heyoka") if isinstance(cases, Films) else ("mpmath",)
    if not all(importlib.util.find_spec(name) for name in needed):
        return None
    sys.path.append(str(Path(__file__).resolve().parents[2] / "tests" / "reference"))
    certified = _certified_films if isinstance(cases, Films) else _certified
    largest = 0.0
    for index in np.linspace(0, number - 1, SAMPLE).astype(int):
        for mine, value in zip(known, certified(cases, scene.program, index), strict=True):
            largest = max(largest, abs(float(mine[index] / value) - 1.0))
    return largest


def _certified(cases: Cases, program: str, index: int) -> tuple[Any, Any]:
    """Return time and stretch of one case by two formulations that agree."""
    import outcomes
    from points import exact

    names = {"step": ("field",), "ramp": ("rate",), "ramp_hold": ("field", "rate")}[program]
    point = {name: float(getattr(cases, name)[index]) for name in names}
    results = outcomes.certify(exact(program, point | {"modulus_ratio": float(cases.ratio[index])})).results
    return results.time, results.stretch


def _certified_films(films: Films, program: str, index: int) -> tuple[Any, Any]:
    """Return time and stretch of one film by two formulations that agree; NaN where they do not."""
    import dead_load
    import loading

    given = {name: float(values[index]) for name, values in films.given.items()}
    m = given["modulus_ratio"]
    if "prestretch" in given:
        row = dead_load.certify(program, m, given["prestretch"], None, given["field"], given.get("rate"))
    else:
        start, _, duration = (part[:, index] for part in pieces_of(films)[:3])
        arguments = {
            "overdrive": (start[0], duration[0], given["field"]),
            "trapezoid": (given["field"], *duration),
            "triangle_train": (given["field"], duration[0]),
        }[program]
        row = loading.certify(program, m, 1.0, tuple(float(value) for value in arguments))
    return (float(row["time_to_failure"]), float(row["critical_stretch"])) if row else (np.nan, np.nan)
