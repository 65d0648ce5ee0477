"""The scenes: six sets of cases, each easy or hard for a reason of its own, and the truth about them."""

from collections.abc import Callable, Mapping
from functools import cache
from typing import NamedTuple

import numpy as np

import dea_maps as dm

SIZES = tuple(4**power for power in range(2, 10))
"""Numbers of cases that a scene comes in: every set reaches from end to end of its scene."""


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


_ALL = (
    Scene("S1", "step to Er = 1.02 to 1.98, m = 4", "step", _steps),
    Scene("S2", "ramp at k = 0.01 to 100, m = 4", "ramp", _ramps(1e-2, 1e2)),
    Scene("S3s", "step from Er = 1.02 to almost sqrt(m), m = 1.5 to 10", "step", _step_plane),
    Scene("S3r", "ramp at k = 0.01 to 100, m = 1.5 to 10", "ramp", _ramp_plane),
    Scene("S4s", "bottleneck: step to Er = 1 + 1e-6 to 1 + 1e-2, m = 4", "step", _bottleneck),
    Scene("S4r", "slow ramp at k = 1e-5 to 1e-3, m = 4", "ramp", _ramps(1e-5, 1e-3)),
)
SCENES: Mapping[str, Scene] = {scene.name: scene for scene in _ALL}


def sweep(scene: Scene, cases: Cases, **options: object) -> tuple[np.ndarray, np.ndarray]:
    """Time to failure and critical stretch of every case, (cases,) each, by `dea_maps.sweep` as a user calls it."""
    import xarray as xr

    def along(values: np.ndarray) -> xr.DataArray:
        return xr.DataArray(values, dims="case")

    if scene.program == "step":
        ds = dm.sweep(dm.Step(), field=along(cases.field), modulus_ratio=along(cases.ratio), **options)
    else:
        ds = dm.sweep(dm.Ramp(), rate=along(cases.rate), modulus_ratio=along(cases.ratio), **options)
    return ds.time_to_failure.values, ds.critical_stretch.values


@cache
def truth(name: str, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Time to failure and critical stretch at the tightest accuracy there is, certified by the test suite."""
    scene = SCENES[name]
    time, stretch = sweep(scene, scene.cases(number), rtol=1e-12)
    if not (np.isfinite(time).all() and (time > 0.0).all()):
        raise RuntimeError(f"scene {name}: not every case fails later than at once")
    return time, stretch
