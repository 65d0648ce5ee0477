"""Fit of a material to curves of uniaxial tension at several stretch rates, and what the curves determine."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy.optimize import least_squares
from scipy.stats import t as student

from ..checks import brief
from ..plausibility import warn_implausible
from .material import Material
from .tension_data import as_curves
from .uniaxial import uniaxial_stress

Array = npt.NDArray[np.float64]

NOISES = ("constant", "proportional")
"""What the scatter of the stresses may be: the same everywhere, or in proportion to the stress."""

_NAMES = ("unrelaxed_modulus", "relaxed_modulus", "relaxation_time", "modulus_ratio")
_CONFIDENCE = 0.95
_WIDEST = 10.0  # upper over lower end of an interval that still determines a parameter
_UNKNOWN = 1e6  # likewise, that says anything
_EDGE = 1e-3  # of the logarithms' allowed range: nearer is at its end
_STEP = 1e-4  # of finite differences, in logarithms
_ROUNDS = 3  # of weighting by the stresses of the last fit
_SMALLEST_WEIGHT = 1e-2  # of the largest stress: what a proportional scatter is at least proportional to
_LOWEST_EXCESS, _HIGHEST_EXCESS = 1e-4, 1e4  # of the modulus ratio above 1
_RANGE_OF_RATES = 1e4  # how far the relaxation time may be from the inverse of any rate
_FIRST_TIMES = np.geomspace(0.1, 100.0, 4)  # over the geometric mean of the inverse rates
_FIRST_EXCESSES = (1.0, 5.0)


@dataclass(frozen=True, eq=False)
class UniaxialFit:
    """A material fitted to curves of uniaxial tension.

    Attributes
    ----------
    material : Material
        The best fit.
    intervals : mapping of str to tuple of float
        Intervals of 95 % confidence for ``unrelaxed_modulus`` and ``relaxed_modulus`` in Pa, ``relaxation_time`` in s
        and ``modulus_ratio``: from the linearised fit in logarithms, with Student's t.
    determined : mapping of str to bool
        Whether the curves determine each of them: the ends of its interval are within a factor of 10, it is not at
        an end of its allowed range, the relaxation time is known at all and, for that, there are two stretch
        rates or more.
    noise : str
        What was assumed of the scatter, one of `NOISES`.
    scatter : float
        Standard deviation of the stresses about the fit: in Pa where constant, over the stress where proportional.
    curves : Dataset
        ``stretch_rate``, ``stretch``, ``nominal_stress`` and ``fitted_stress`` in Pa, along ``point``.
    """

    material: Material
    intervals: Mapping[str, tuple[float, float]]
    determined: Mapping[str, bool]
    noise: str
    scatter: float
    curves: xr.Dataset

    def summary(self) -> str:
        """Return what was found and how well it is determined, on several lines."""
        rates = np.unique(self.curves["stretch_rate"].values)
        at = (
            f"{rates.size} stretch rates, {rates[0]:g} to {rates[-1]:g} per s" if rates.size > 1 else "one stretch rate"
        )
        lines = [f"{self.curves.sizes['point']} points at {at}"]
        units = {"unrelaxed_modulus": (1e-3, " kPa"), "relaxed_modulus": (1e-3, " kPa"), "relaxation_time": (1.0, " s")}
        for name, (low, high) in self.intervals.items():
            factor, unit = units.get(name, (1.0, ""))
            value = getattr(self.material, name) * factor
            known = high <= _UNKNOWN * low
            ends = f"95 % interval {low * factor:.4g} to {high * factor:.4g}{unit}" if known else "no 95 % interval"
            verdict = "" if self.determined[name] else "  NOT DETERMINED by these curves"
            lines.append(f"{name:<18} {value:.4g}{unit:<5} {ends}{verdict}")
        scatter = f"{self.scatter:.3g} Pa" if self.noise == "constant" else f"{self.scatter:.2%} of the stress"
        lines.append(f"{'scatter':<18} {scatter}, taken as {self.noise}")
        if rates.size == 1:
            lines.append("one stretch rate cannot determine the relaxation time: measure at two rates or more")
        return "\n".join(lines)


class _Problem(NamedTuple):
    """Curves as the model wants them: unique nodes, and where each point is among them."""

    rates: Array
    stretches: Array
    row: npt.NDArray[np.intp]
    column: npt.NDArray[np.intp]
    stress: Array

    def shape(self, log_excess: float, log_time: float) -> Array:
        """Return the stress of every point normalised by the relaxed modulus."""
        table = uniaxial_stress(self.stretches, self.rates * np.exp(log_time), 1.0 + np.exp(log_excess))
        return table[self.row, self.column]


def fit_uniaxial(curves: xr.Dataset, *, noise: str = "constant", name: str = "", source: str = "") -> UniaxialFit:
    """Fit both moduli and the relaxation time to curves of uniaxial tension at constant stretch rates.

    Least squares of the nominal stress (18) of Zhao, Koh and Suo (2011), with (19), (21) and (22) at ``s2 = 0`` and no
    field, over the logarithms of ``mu_R``, of ``mu_U/mu_R - 1`` and of ``tau``, within bounds.

    Parameters
    ----------
    curves : Dataset
        ``nominal_stress`` in Pa (or kPa or MPa, by its ``units``), ``stretch`` of at least 1 and ``stretch_rate`` in
        1/s, above 0, as variables or coordinates that broadcast. NaN stresses are gaps. Every curve starts from the
        relaxed state at a stretch of 1.
    noise : {"constant", "proportional"}
        Whether the standard deviation of the stresses is the same everywhere or proportional to the stress; the
        intervals hold as far as that is so.
    name, source : str
        Of the material.

    Returns
    -------
    UniaxialFit
        With ``material``, whose permittivity such curves do not tell (``dataclasses.replace`` adds it),
        ``intervals``, ``determined`` and ``summary()``.

    Raises
    ------
    TypeError, ValueError
        If the curves or another argument are not allowed; before computing.
    RuntimeError
        If no fit is found.

    Warns
    -----
    ImplausibleWarning
        Names what is implausible in the curves: its unit may be another one.

    Examples
    --------
    >>> import dea_maps as dm, numpy as np, xarray as xr
    >>> from dea_maps.materials.uniaxial import uniaxial_stress
    >>> rates, stretch = np.array([1e-3, 1e-2]), np.linspace(1.5, 4.0, 6)
    >>> stress = 22.8e3 * uniaxial_stress(stretch, rates * 200.0, 3.85)
    >>> curves = xr.Dataset({"nominal_stress": (("stretch_rate", "stretch"), stress)}, {
    ...     "stretch_rate": rates, "stretch": stretch})
    >>> fit = dm.fit_uniaxial(curves)
    >>> round(fit.material.relaxation_time, 2), round(fit.material.modulus_ratio, 3)
    (200.0, 3.85)
    """
    if noise not in NOISES:
        raise ValueError(f"noise must be one of {', '.join(NOISES)}; got {brief(noise)}")
    points = as_curves(curves)
    warn_implausible("nominal_stress", float(points["nominal_stress"].max()))
    warn_implausible("stretch", points["stretch"].values)
    warn_implausible("stretch_rate", points["stretch_rate"].values)
    problem = _problem(points)
    scale = float(problem.stress.max())
    start, lower, upper = _start(problem)
    weight = np.full(problem.stress.size, 1.0 / scale)
    for _ in range(_ROUNDS if noise == "proportional" else 1):
        best, jacobian, fitted = _fitted(problem, weight, start, lower, upper)
        start = np.clip(best, lower, upper)
        residual = weight * (fitted - problem.stress)
        if noise == "proportional":
            weight = 1.0 / np.maximum(np.abs(fitted), _SMALLEST_WEIGHT * scale)
    freedom = problem.stress.size - best.size
    variance = float(residual @ residual) / freedom
    relaxed, excess, time = (float(number) for number in np.exp(best))
    material = Material(relaxed * (1.0 + excess), relaxed, time, name=name, source=source)
    widths = student.ppf(0.5 + 0.5 * _CONFIDENCE, freedom) * _deviations(jacobian, variance, excess)
    with np.errstate(over="ignore", invalid="ignore"):
        factors = np.exp(widths)
    values = [getattr(material, key) for key in _NAMES]
    intervals = {key: (v / f, v * f) for key, v, f in zip(_NAMES, values, factors.tolist(), strict=True)}
    # A film that never or always relaxes looks elastic: no one can tell which of its moduli was measured.
    viscous = bool(lower[2] + _EDGE < best[2] < upper[2] - _EDGE) and factors[2] ** 2 <= _UNKNOWN
    inside = viscous & (best > lower + _EDGE) & (best < upper - _EDGE)
    allowed = (inside[:2].all(), inside[0], viscous and problem.rates.size > 1, inside[1])
    determined = {
        key: bool(ok and factor**2 <= _WIDEST)
        for key, ok, factor in zip(_NAMES, allowed, factors.tolist(), strict=True)
    }
    attributes = {"long_name": "nominal stress of the fit", "units": "Pa"}
    points = points.assign(fitted_stress=("point", fitted, attributes))
    scatter = variance**0.5 * (scale if noise == "constant" else 1.0)
    return UniaxialFit(material, intervals, determined, noise, scatter, points)


def _problem(points: xr.Dataset) -> _Problem:
    stretches, column = np.unique(points["stretch"].values, return_inverse=True)
    rates, row = np.unique(points["stretch_rate"].values, return_inverse=True)
    return _Problem(rates, stretches, row, column, points["nominal_stress"].values)


def _start(problem: _Problem) -> tuple[Array, Array, Array]:
    """Return the best of a few starts, with the relaxed modulus that suits each, and the bounds."""
    middle = -np.log(problem.rates).mean()
    span = np.log(_RANGE_OF_RATES)
    size = np.log(problem.stress.max())
    lower = np.array([size - 16.0, np.log(_LOWEST_EXCESS), -np.log(problem.rates.max()) - span])
    upper = np.array([size + 16.0, np.log(_HIGHEST_EXCESS), -np.log(problem.rates.min()) + span])
    found: tuple[float, Array] = np.inf, 0.5 * (lower + upper)
    for time in _FIRST_TIMES:
        for excess in _FIRST_EXCESSES:
            shape = problem.shape(np.log(excess), middle + np.log(time))
            modulus = float(shape @ problem.stress) / float(shape @ shape)
            misfit = float(np.square(modulus * shape - problem.stress).sum())
            if modulus > 0.0 and misfit < found[0]:
                found = misfit, np.array([np.log(modulus), np.log(excess), middle + np.log(time)])
    return np.clip(found[1], lower, upper), lower, upper


def _fitted(problem: _Problem, weight: Array, start: Array, lower: Array, upper: Array) -> tuple[Array, Array, Array]:
    """Return the best logarithms, the Jacobian there and the fitted stresses."""

    @lru_cache(maxsize=8)  # the Jacobian starts from what the residual has just solved
    def shape(log_excess: float, log_time: float) -> Array:
        return problem.shape(log_excess, log_time)

    def residual(x: Array) -> Array:
        found: Array = weight * (np.exp(x[0]) * shape(float(x[1]), float(x[2])) - problem.stress)
        if not np.isfinite(found).all():
            raise RuntimeError(f"no fit: the model cannot be integrated at {np.exp(x).tolist()}")
        return found

    def jacobian(x: Array) -> Array:
        modulus, excess, time = float(np.exp(x[0])), float(x[1]), float(x[2])
        here = shape(excess, time)
        by_excess, by_time = shape(excess + _STEP, time) - here, shape(excess, time + _STEP) - here
        return np.stack([weight * modulus * column for column in (here, by_excess / _STEP, by_time / _STEP)], axis=1)

    run = least_squares(residual, start, jac=jacobian, bounds=(lower, upper), xtol=1e-9, ftol=1e-10, gtol=1e-12)
    if run.status <= 0:
        raise RuntimeError(f"no fit: {run.message}")
    return run.x, run.jac, problem.stress + run.fun / weight


def _deviations(jacobian: Array, variance: float, excess: float) -> Array:
    """Return the standard deviations of the logarithms of `_NAMES`; infinite where nothing determines them."""
    share = excess / (1.0 + excess)  # of a change of the logarithm of the excess in that of the modulus ratio
    rows = np.array([[1.0, share, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, share, 0.0]])
    _, singular, right = np.linalg.svd(jacobian, full_matrices=False)
    with np.errstate(divide="ignore", invalid="ignore"):
        scaled = (rows @ right.T) / np.where(singular > 1e-12 * singular[0], singular, 0.0)
    deviations: Array = np.sqrt(variance) * np.linalg.norm(np.where(np.isnan(scaled), 0.0, scaled), axis=1)
    return deviations
