"""Materials in SI units: what turns ratios into pascals, seconds and volts per metre."""

import math
import numbers
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..checks import brief, in_units

Array = npt.NDArray[np.float64]

VACUUM_PERMITTIVITY = 8.8541878128e-12
"""In farads per metre (CODATA 2018)."""

_POSITIVE = ("unrelaxed_modulus", "relaxed_modulus", "relaxation_time")
_UNITS = {
    "unrelaxed_modulus": "Pa",
    "relaxed_modulus": "Pa",
    "relaxation_time": "s",
    "relative_permittivity": "1",
    "breakdown_strength": "V/m",
}


@dataclass(frozen=True)
class Material:
    """A dielectric elastomer of the model of Zhao, Koh and Suo (2011), in SI units; other units of pint are converted.

    Attributes
    ----------
    unrelaxed_modulus, relaxed_modulus : float
        Shear moduli ``mu_U`` and ``mu_R`` in Pa, above 0, the first at least the second.
    relaxation_time : float
        ``tau`` in s, above 0, (15).
    relative_permittivity : float or None
        ``eps`` over that of vacuum, at least 1; None where it is not known.
    name, source : str
        What it is, and where the numbers are from.
    breakdown_strength : float, callable or None
        The true field in V/m at which the film breaks down, above 0, or what returns it for an array of stretches; None
        where it is not known.

    Raises
    ------
    TypeError, ValueError
        If a number is of the wrong kind or out of bounds.

    Examples
    --------
    >>> from dea_maps import VHB
    >>> round(VHB.modulus_ratio, 2), round(VHB.critical_field / 1e6, 1)
    (3.85, 16.1)
    """

    unrelaxed_modulus: float
    relaxed_modulus: float
    relaxation_time: float
    relative_permittivity: float | None = None
    name: str = ""
    source: str = ""
    breakdown_strength: float | Callable[[Array], Array] | None = None

    def __post_init__(self) -> None:
        for name in _POSITIVE:
            value = _number(name, getattr(self, name))
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} must be finite and above 0; got {value}")
            object.__setattr__(self, name, value)
        if self.unrelaxed_modulus < self.relaxed_modulus:
            raise ValueError(
                f"unrelaxed_modulus must be at least relaxed_modulus, {self.relaxed_modulus:g}; "
                f"got {self.unrelaxed_modulus:g}"
            )
        if self.relative_permittivity is not None:
            value = _number("relative_permittivity", self.relative_permittivity)
            if not (math.isfinite(value) and value >= 1.0):
                raise ValueError(f"relative_permittivity must be None, or finite and at least 1; got {value}")
            object.__setattr__(self, "relative_permittivity", value)
        if self.breakdown_strength is not None and not callable(self.breakdown_strength):
            value = _number("breakdown_strength", self.breakdown_strength)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"breakdown_strength must be None, a function, or finite and above 0; got {value}")
            object.__setattr__(self, "breakdown_strength", value)
        for name in ("name", "source"):
            if not isinstance(getattr(self, name), str):
                raise TypeError(f"{name} must be a string; got {brief(getattr(self, name))}")

    @property
    def modulus_ratio(self) -> float:
        """Unrelaxed over relaxed shear modulus."""
        return self.unrelaxed_modulus / self.relaxed_modulus

    @property
    def critical_field(self) -> float:
        """Relaxed critical field ``Ec = sqrt(0.75 * 4**(-1/3) * mu_R/eps)`` in V/m, nominal.

        Raises
        ------
        ValueError
            If the relative permittivity is not known.
        """
        if self.relative_permittivity is None:
            raise ValueError("relative_permittivity must be known for a critical field; got None")
        permittivity = self.relative_permittivity * VACUUM_PERMITTIVITY
        return math.sqrt(0.75 * 4.0 ** (-1.0 / 3.0) * self.relaxed_modulus / permittivity)

    def strength(self, stretch: Array) -> Array:
        """Return the true field at which the film breaks down, normalised by the relaxed critical field.

        Parameters
        ----------
        stretch : ndarray

        Raises
        ------
        ValueError
            If the breakdown strength or the relative permittivity is not known.
        """
        if self.breakdown_strength is None:
            raise ValueError("breakdown_strength must be known for a limit on the true field; got None")
        known = self.breakdown_strength
        in_si = known(stretch) if callable(known) else np.full(np.shape(stretch), known)
        return np.asarray(in_si) / self.critical_field


def _number(name: str, value: object) -> float:
    value = in_units(name, value, _UNITS[name])
    if not isinstance(value, numbers.Real) or isinstance(value, bool):
        raise TypeError(f"{name} must be a real number; got {brief(value)}")
    return float(value)


VHB = Material(
    unrelaxed_modulus=87.8e3,
    relaxed_modulus=22.8e3,
    relaxation_time=200.0,
    relative_permittivity=4.7,
    name="VHB",
    source="moduli and relaxation time: Zhao, Koh, Suo (2011), section 4, fit to uniaxial tension by Plante and "
    "Dubowsky (2006)",
)
"""The acrylic elastomer VHB as the paper fits it; its relative permittivity, 4.7, is not from there."""
