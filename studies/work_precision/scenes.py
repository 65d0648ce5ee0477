"""The scenes: sets of cases, each easy or hard for a reason of its own."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from pieces import CRITICAL_LOAD, Films, critical

SIZES = (16, 256, 4096)
"""Numbers of cases that a scene comes in, squares: every set reaches from end to end of its scene."""


class Cases(NamedTuple):
    """What is to be found out for: (cases,) arrays; ``field`` is zero on a ramp, ``rate`` is zero for a step."""

    field: np.ndarray
    rate: np.ndarray
    ratio: np.ndarray


class Scene(NamedTuple):
    """A set of cases.

    Attributes
    ----------
    name, title : str
        Short name, and what it is.
    program : str
        Loading program, as in `dea_maps`.
    cases : callable
        ``cases(number) -> Cases``, or `Films` where there are several pieces or a dead load.
    """

    name: str
    title: str
    program: str
    cases: Callable[[int], Cases | Films]


def _ramps(slowest: float, fastest: float) -> Callable[[int], Cases]:
    def cases(number: int) -> Cases:
        return Cases(np.zeros(number), np.geomspace(slowest, fastest, number), np.full(number, 4.0))

    return cases


def _steps(number: int) -> Cases:
    return Cases(np.linspace(1.02, 1.98, number), np.zeros(number), np.full(number, 4.0))


def _bottleneck(number: int) -> Cases:
    return Cases(1.0 + np.geomspace(1e-6, 1e-2, number), np.zeros(number), np.full(number, 4.0))


def _ratios(number: int) -> tuple[np.ndarray, int]:
    side = round(number**0.5)
    return np.repeat(np.geomspace(1.5, 10.0, side), side), side


def _step_plane(number: int) -> Cases:
    ratio, side = _ratios(number)
    share = np.tile(np.linspace(0.0, 1.0, side), side)
    return Cases(1.02 + share * (0.99 * np.sqrt(ratio) - 1.02), np.zeros(number), ratio)


def _ramp_plane(number: int) -> Cases:
    ratio, side = _ratios(number)
    return Cases(np.zeros(number), np.tile(np.geomspace(1e-2, 1e2, side), side), ratio)


def _ramps_that_hold(number: int) -> Cases:
    side = round(number**0.5)
    fields, rates = np.linspace(1.02, 2.2, side), np.geomspace(1e-2, 1e2, side)
    return Cases(np.repeat(fields, side), np.tile(rates, side), np.full(number, 4.0))


GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)


def _plane(number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return two shares over a square, and a third one that fills its range evenly wherever one looks."""
    side = round(number**0.5)
    share = np.linspace(0.0, 1.0, side)
    return np.repeat(share, side), np.tile(share, side), np.arange(number) * GOLDEN % 1.0


def _life(field: np.ndarray) -> np.ndarray:
    """Time to failure of a step at a modulus ratio of 4, to about a twentieth."""
    return 0.69 * (2.0 - field) ** 1.27 / (field - 1.0) ** 0.93


def _overdrives(number: int) -> Films:
    a, b, c = _plane(number)
    over = 1.2 + 0.7 * a
    given = {"field": 1.02 + 0.15 * c, "overdrive_field": over, "overdrive_time": (0.05 + 0.8 * b) * _life(over)}
    return Films("OD", "overdrive", given | {"modulus_ratio": np.full(number, 4.0)})


def _trapezoids(number: int) -> Films:
    a, b, c = _plane(number)
    field, rate = 1.25 + 0.65 * a, 10.0 ** (-0.5 + 2.0 * c)
    fall = (0.1 + 0.2 * c) * (field - 1.0) / _life(0.5 * (field + 1.0))
    given = {"field": field, "rate": rate, "hold_time": (0.05 + 1.25 * b) * _life(field), "fall_rate": fall}
    return Films("TZ", "trapezoid", given | {"modulus_ratio": np.full(number, 4.0)})


def _triangles(number: int) -> Films:
    a, b, _ = _plane(number)
    field = 1.565 + 0.095 * b
    cycles = 12.0 * 7.0**a
    given = {"field": field, "period": 0.9 / np.sqrt(field - 1.5568) / cycles}
    return Films("TT", "triangle_train", given | {"modulus_ratio": np.full(number, 4.0)})


def _prestretched(scene: str, program: str) -> Callable[[int], Films]:
    """Return films under fields from little above what they sustain relaxed to almost what they carry."""

    def cases(number: int) -> Films:
        a, b, c = _plane(number)
        stretch = 1.1 + 1.9 * a
        sigma, one = stretch - stretch**-5.0, np.ones(number)
        relaxed, instant = (
            np.sqrt(critical(r, p, sigma)[1] / CRITICAL_LOAD) for r, p in ((one, 0.0 * one), (stretch**2, 3.0 * one))
        )
        given = {"field": relaxed + (0.02 + 0.96 * b) * (instant - relaxed), "prestretch": stretch}
        if program == "ramp_hold":
            given["rate"] = 10.0 ** (-2.0 + 4.0 * c)
        return Films(scene, program, given | {"modulus_ratio": 4.0 * one})

    return cases


_ALL = (
    Scene("S1", "step to Er = 1.02 to 1.98, m = 4", "step", _steps),
    Scene("S2", "ramp at k = 0.01 to 100, m = 4", "ramp", _ramps(1e-2, 1e2)),
    Scene("S3s", "step from Er = 1.02 to almost sqrt(m), m = 1.5 to 10", "step", _step_plane),
    Scene("S3r", "ramp at k = 0.01 to 100, m = 1.5 to 10", "ramp", _ramp_plane),
    Scene("S4s", "bottleneck: step to Er = 1 + 1e-6 to 1 + 1e-2, m = 4", "step", _bottleneck),
    Scene("S4r", "slow ramp at k = 1e-5 to 1e-3, m = 4", "ramp", _ramps(1e-5, 1e-3)),
    Scene("RH", "ramp that holds: k = 0.01 to 100, held at Er = 1.02 to 2.2, m = 4", "ramp_hold", _ramps_that_hold),
    Scene("OD", "overdrive: Er = 1.2 to 1.9 for a while, then 1.02 to 1.17, m = 4", "overdrive", _overdrives),
    Scene("TZ", "trapezoid: up to Er = 1.25 to 1.9, held, slowly down, m = 4", "trapezoid", _trapezoids),
    Scene("TT", "triangles without end, up to Er = 1.565 to 1.7, m = 4", "triangle_train", _triangles),
    Scene("PS", "step on films pre-stretched to 1.1 to 3, m = 4", "step", _prestretched("PS", "step")),
    Scene(
        "PR",
        "ramp that holds, on films pre-stretched to 1.1 to 3, m = 4",
        "ramp_hold",
        _prestretched("PR", "ramp_hold"),
    ),
)
SCENES: Mapping[str, Scene] = {scene.name: scene for scene in _ALL}
