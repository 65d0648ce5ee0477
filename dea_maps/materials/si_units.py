"""Maps and trajectories in volts, seconds and volts per metre, for a film of a material and a thickness."""

import math
import numbers
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..checks import brief
from ..nomenclature import KINDS, si_name
from ..plausibility import warn_implausible
from ..program_text import kinds_in
from .material import Material
from .toml import PowerLaw


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
        ``critical_true_field`` (V m-1), ``applied_voltage`` (V), ``true_field`` (V m-1).

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
    check_film(material, thickness)
    warn_film(material, thickness)
    return in_si(ds, material, thickness)


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


def in_si(ds: xr.Dataset, material: Material, thickness: float) -> xr.Dataset:
    """Return what `physical` does, for a film that is checked already."""
    Ec, tau, H = material.critical_field, material.relaxation_time, float(thickness)
    known = set(ds.variables)
    added = ds.copy(deep=False)
    made: list[str] = []  # coordinates

    def add(name: str, needs: tuple[str, ...], value: Callable[..., xr.Variable], units: str, long_name: str) -> None:
        if known.issuperset(needs):
            variable = value(*(ds[need].variable.to_base_variable() for need in needs))
            variable.attrs = {"long_name": long_name, "units": units}
            variable.encoding = {key: value for key, value in ds[needs[0]].encoding.items() if key != "source"}
            added[name] = variable
            if all(need in ds.coords for need in needs):
                made.append(name)

    ones = one_in_si(material, H)
    for parameter, kind in kinds_in(ds.coords, ds.attrs).items():
        twin = si_name(parameter, kind)
        if twin is not None:
            words = _WORDS.get(twin, twin.replace("_seconds", "").replace("_", " "))
            add(twin, (parameter,), lambda value, one=ones[kind]: value * one, KINDS[kind].si_units, words)
    add("seconds", ("time",), lambda T: T * tau, "s", "time since the loading began")
    add("seconds_to_failure", ("time_to_failure",), lambda T: T * tau, "s", "time to electromechanical instability")
    add("critical_voltage", ("critical_field",), lambda E: E * (Ec * H), "V", "voltage at the instability")
    add(
        "critical_true_field",
        ("critical_field", "critical_stretch"),
        lambda E, stretch: E * Ec * stretch**2,
        "V m-1",
        "true electric field at the instability",
    )
    add("applied_voltage", ("applied_field",), lambda E: E * (Ec * H), "V", "voltage applied")
    add(
        "true_field",
        ("applied_field", "stretch"),
        lambda E, stretch: E * Ec * stretch**2,
        "V m-1",
        "true electric field",
    )
    add("seconds_to_breakdown", ("time_to_breakdown",), lambda T: T * tau, "s", "time to electrical breakdown")
    add("breakdown_voltage", ("breakdown_field",), lambda E: E * (Ec * H), "V", "voltage at electrical breakdown")
    add(
        "breakdown_true_field",
        ("breakdown_field", "breakdown_stretch"),
        lambda E, stretch: E * Ec * stretch**2,
        "V m-1",
        "true electric field at electrical breakdown",
    )
    if "prestretch" in ds.coords:
        for stretch in ("stretch", "critical_stretch"):
            counted = "the film that its dead load has pre-stretched"
            add(
                f"actuation_{stretch}", (stretch, "prestretch"),
                lambda x, p: x / p, "1", f"{stretch.replace('_', ' ')}, from {counted}",
            )  # fmt: skip
            add(
                "area_strain" if stretch == "stretch" else "critical_area_strain", (stretch, "prestretch"),
                lambda x, p: (x / p) ** 2 - 1.0, "1", f"area strain, from {counted}",
            )  # fmt: skip
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
