"""Maps and trajectories in volts, seconds and volts per metre, for a film of a material and a thickness."""

import math
import numbers
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..checks import brief, in_units
from ..nomenclature import BREAKDOWN, KINDS, NOMENCLATURE, TRAJECTORY, VARIABLES, si_name
from ..plausibility import warn_implausible
from ..program_text import kinds_in
from .material import Material
from .toml import PowerLaw


class Film(NamedTuple):
    """A film of a material: what volts and seconds are for.

    Attributes
    ----------
    material : Material
        With a known permittivity.
    thickness : float
        Of the undeformed film in m.
    """

    material: Material
    thickness: float

    @property
    def limited(self) -> bool:
        """Whether its breakdown strength is known."""
        return self.material.breakdown_strength is not None


def film_of(material: Material | None, thickness: float | None) -> Film | None:
    """Return a film from what may be given of it; None if nothing is.

    Raises
    ------
    TypeError, ValueError
        If one is given without the other, is of the wrong kind or out of bounds, or the permittivity is not known.

    Examples
    --------
    >>> from dea_maps import VHB
    >>> film_of(VHB, 100e-6).thickness
    0.0001
    """
    if material is None and thickness is None:
        return None
    if material is None or thickness is None:
        lacking = "material" if material is None else "thickness"
        raise TypeError(f"material and thickness must be given together; got no {lacking}")
    in_metres = in_units("thickness", thickness, "m")
    check_film(material, in_metres)
    return Film(material, float(in_metres))


def physical(ds: xr.Dataset, material: Material, thickness: float) -> xr.Dataset:
    """Add to a map or to trajectories what they mean for a film, in SI units.

    With ``Ec`` the material's relaxed critical field, ``tau`` its relaxation time and ``H`` the thickness before
    deformation: voltages are ``field Ec H``, times ``T tau``, true fields ``field Ec lambda**2``, as the film keeps its
    volume.

    Parameters
    ----------
    ds : Dataset
        From `dea_maps.sweep`, `dea_maps.trajectory` or a file of either, perhaps with some of the variables only.
    material : Material
        With a known permittivity. What it says of the modulus ratio is not used: `ds` has its own.
    thickness : float
        Of the undeformed film in m, above 0.

    Returns
    -------
    Dataset
        All of `ds`, and where `ds` has what it takes: the coordinates ``voltage`` (V), ``voltage_rate`` (V s-1) and
        ``seconds`` (s, along ``time``); the variables ``seconds_to_failure`` (s), ``critical_voltage`` (V),
        ``critical_true_field`` (V m-1), ``applied_voltage`` (V), ``true_field`` (V m-1); for every stretch of the film
        its area strain, as ``area_strain``, ``critical_area_strain``: ``stretch**2 - 1``, or with a pre-stretch
        ``(stretch/prestretch)**2 - 1``.

    Raises
    ------
    TypeError, ValueError
        If something is of the wrong kind or out of bounds, or the permittivity is not known.

    Warns
    -----
    ImplausibleWarning
        Names what is implausible of the film: its unit may be another one.

    Examples
    --------
    >>> import dea_maps as dm
    >>> ds = dm.physical(dm.sweep(dm.Step(), field=[1.1, 1.2], modulus_ratio=dm.VHB.modulus_ratio), dm.VHB, 100e-6)
    >>> ds.voltage.values.round().tolist(), ds.seconds_to_failure.values.round().tolist()
    ([1770.0, 1931.0], [951.0, 455.0])
    """
    if not isinstance(ds, xr.Dataset):
        raise TypeError(f"ds must be a data set; got {brief(ds)}")
    thickness = in_units("thickness", thickness, "m")
    check_film(material, thickness)
    warn_film(material, thickness)
    return in_si(ds, material, thickness)


_Formula = Callable[[Sequence[xr.Variable]], xr.Variable]
"""What a quantity is, from those that it needs."""

_STRETCHES = tuple(
    name for name in (*VARIABLES, *TRAJECTORY, *BREAKDOWN) if "stretch" in name and "internal" not in name
)
"""Stretches of the film, each of which has an area strain."""

_RESULTS = {
    "seconds": ("time", "time", "time since the loading began"),
    "seconds_to_failure": ("time", "time_to_failure", "time to electromechanical instability"),
    "critical_voltage": ("field", "critical_field", "voltage at the instability"),
    "applied_voltage": ("field", "applied_field", "voltage applied"),
    "seconds_to_breakdown": ("time", "time_to_breakdown", "time to electrical breakdown"),
    "breakdown_voltage": ("field", "breakdown_field", "voltage at electrical breakdown"),
}
"""Results in SI units by name: the kind, the ratio, and the words for them."""

_TRUE_FIELDS = {
    "critical_true_field": ("critical_field", "critical_stretch", "true electric field at the instability"),
    "true_field": ("applied_field", "stretch", "true electric field"),
    "breakdown_true_field": ("breakdown_field", "breakdown_stretch", "true electric field at electrical breakdown"),
}
"""True fields by name: the nominal field, the stretch, and the words for them."""

_WORDS = {"voltage": "voltage across the film", "voltage_rate": "rate of the voltage on the ramp"}


def one_in_si(material: Material, thickness: float) -> dict[str, float]:
    """Return what one unit of every kind of parameter is worth in SI units, for a film.

    Examples
    --------
    >>> from dea_maps import VHB
    >>> round(one_in_si(VHB, 100e-6)["field"]), one_in_si(VHB, 100e-6)["time"]
    (1609, 200.0)
    """
    volts, tau = material.critical_field * float(thickness), material.relaxation_time
    return {
        "field": volts, "rate": volts / tau, "time": tau, "period": tau, "stress": material.relaxed_modulus
    }  # fmt: skip


def in_si(ds: xr.Dataset, material: Material, thickness: float, kinds: Mapping[str, str] | None = None) -> xr.Dataset:
    """Return what `physical` does, for a film that is checked already.

    Parameters
    ----------
    ds, material, thickness
        As in `physical`.
    kinds : mapping of str to str, optional
        The parameters and the kind of each; by default those of the program that `ds` names.
    """
    Ec, tau, H = material.critical_field, material.relaxation_time, float(thickness)
    ones = one_in_si(material, H)
    known = set(ds.variables)
    added = ds.copy(deep=False)
    made: list[str] = []  # coordinates

    def add(name: str, needs: tuple[str, ...], value: _Formula, units: str, long_name: str) -> None:
        if known.issuperset(needs):
            variable = value([ds[need].variable.to_base_variable() for need in needs])
            variable.attrs = {"long_name": long_name, "units": units}
            variable.encoding = {key: value for key, value in ds[needs[0]].encoding.items() if key != "source"}
            added[name] = variable
            if all(need in ds.coords for need in needs):
                made.append(name)

    for parameter, kind in (kinds_in(ds.coords, ds.attrs) if kinds is None else kinds).items():
        twin = si_name(parameter, kind)
        if twin is not None:
            words = _WORDS.get(twin, twin.replace("_seconds", "").replace("_", " "))
            add(twin, (parameter,), partial(_times, ones[kind]), KINDS[kind].si_units, words)
    for name, (kind, ratio, words) in _RESULTS.items():
        add(name, (ratio,), partial(_times, ones[kind]), KINDS[kind].si_units, words)
    for name, (field, stretch, words) in _TRUE_FIELDS.items():
        add(name, (field, stretch), partial(_true_field, Ec), "V m-1", words)
    loaded = ("prestretch",) if "prestretch" in ds.coords else ()
    counted = ", from the film that its dead load has pre-stretched" if loaded else ""
    for stretch in _STRETCHES:
        words = NOMENCLATURE[stretch].long_name.replace("equibiaxial stretch", "area strain")
        add(stretch.replace("stretch", "area_strain"), (stretch, *loaded), _area_strain, "1", f"{words}{counted}")
    for stretch in ("stretch", "critical_stretch") if loaded else ():
        words = f"{stretch.replace('_', ' ')}{counted}"
        add(f"actuation_{stretch}", (stretch, *loaded), lambda of: of[0] / of[1], "1", words)
    described = {"material": material.name, "material_source": material.source}
    numbers_of = {
        "unrelaxed_modulus_in_Pa": material.unrelaxed_modulus,
        "relaxed_modulus_in_Pa": material.relaxed_modulus,
        "relaxation_time_in_s": tau,
        "relative_permittivity": material.relative_permittivity,
        "thickness_in_m": H,
    }
    if "first_limit" in ds:
        numbers_of |= _strength(material)
    added.attrs.update({**described, **numbers_of})
    return added.set_coords(made)


def _times(one: float, of: Sequence[xr.Variable]) -> xr.Variable:
    """Return a ratio in SI units."""
    return of[0] * one


def _true_field(Ec: float, of: Sequence[xr.Variable]) -> xr.Variable:
    """Return the true field of a nominal field and a stretch: the film keeps its volume."""
    field, stretch = of
    return field * Ec * stretch**2


def _area_strain(of: Sequence[xr.Variable]) -> xr.Variable:
    """Return the area strain of a stretch, and perhaps of a pre-stretch from which it counts."""
    stretch, *prestretch = of
    return (stretch / prestretch[0] if prestretch else stretch) ** 2 - 1.0


def _strength(material: Material) -> dict[str, float]:
    """Return the breakdown strength as attributes, if it is a number or a power of the stretch."""
    known = material.breakdown_strength
    if isinstance(known, PowerLaw):
        return {"breakdown_strength_in_V_per_m": known.at_rest, "breakdown_strength_exponent": known.exponent}
    return {} if known is None or callable(known) else {"breakdown_strength_in_V_per_m": known}


def check_film(material: Material, thickness: float) -> None:
    """Check that a material and a thickness say how many volts a field is.

    Raises
    ------
    TypeError, ValueError
        If something is of the wrong kind or out of bounds, or the permittivity is not known.

    Examples
    --------
    >>> from dea_maps import VHB
    >>> check_film(VHB, 0.0)
    Traceback (most recent call last):
    ...
    ValueError: thickness must be finite and above 0, in m; got 0.0
    """
    if not isinstance(material, Material):
        raise TypeError(f"material must be a Material; got {brief(material)}")
    if not isinstance(thickness, numbers.Real) or isinstance(thickness, bool):
        raise TypeError(f"thickness must be a number; got {brief(thickness)}")
    if not 0.0 < thickness < math.inf:
        raise ValueError(f"thickness must be finite and above 0, in m; got {thickness}")
    material.critical_field  # noqa: B018 -- raises where the permittivity is not known


def warn_film(material: Material, thickness: npt.ArrayLike) -> None:
    """Warn of what is implausible in a material, and in the thickness of films of it.

    Warns
    -----
    ImplausibleWarning
        One for each value.

    Examples
    --------
    >>> from dea_maps import VHB
    >>> import warnings
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     warn_film(VHB, [50e-6, 100e-6])
    >>> caught
    []
    """
    warn_implausible("thickness", thickness)
    for name in ("unrelaxed_modulus", "relaxed_modulus", "relaxation_time"):
        warn_implausible(name, getattr(material, name))
    if material.relative_permittivity is not None:
        warn_implausible("relative_permittivity", material.relative_permittivity)
    strength = material.breakdown_strength
    if strength is not None:
        warn_implausible("breakdown_strength", strength(np.ones(1)) if callable(strength) else strength)
