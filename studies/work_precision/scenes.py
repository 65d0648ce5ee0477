"""The scenes: sets of cases, each easy or hard for a reason of its own."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

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
        ``cases(number) -> Cases``.
    """

    name: str
    title: str
    program: str
    cases: Callable[[int], Cases]


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


_ALL = (
    Scene("S1", "step to Er = 1.02 to 1.98, m = 4", "step", _steps),
    Scene("S2", "ramp at k = 0.01 to 100, m = 4", "ramp", _ramps(1e-2, 1e2)),
    Scene("S3s", "step from Er = 1.02 to almost sqrt(m), m = 1.5 to 10", "step", _step_plane),
    Scene("S3r", "ramp at k = 0.01 to 100, m = 1.5 to 10", "ramp", _ramp_plane),
    Scene("S4s", "bottleneck: step to Er = 1 + 1e-6 to 1 + 1e-2, m = 4", "step", _bottleneck),
    Scene("S4r", "slow ramp at k = 1e-5 to 1e-3, m = 4", "ramp", _ramps(1e-5, 1e-3)),
    Scene("RH", "ramp that holds: k = 0.01 to 100, held at Er = 1.02 to 2.2, m = 4", "ramp_hold", _ramps_that_hold),
)
SCENES: Mapping[str, Scene] = {scene.name: scene for scene in _ALL}
