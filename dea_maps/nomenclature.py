"""The names of everything that a data set holds: one table for attributes, charts and error messages.

Fields are normalised by the relaxed critical field ``Ec = sqrt(0.75 * 4**(-1/3) * mu_R/eps)``, times by the
relaxation time ``tau``; stretches are plain ratios. All is dimensionless, so all units are "1".
"""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt


class Kind(NamedTuple):
    """What kind of quantity a parameter is: its bounds, and how it is given in SI units.

    Attributes
    ----------
    lowest, highest : float
        The bounds; every value must be finite.
    included : bool
        Whether the lowest value itself is allowed.
    suffix : str
        What its name has in SI units; empty for a ratio.
    replaces : str
        The end of its name whose place that takes; without it the suffix is added behind an underscore.
    si_units : str
        The CF attribute of its twin in SI units.
    """

    lowest: float
    included: bool = True
    highest: float = math.inf
    suffix: str = ""
    replaces: str = ""
    si_units: str = "1"

    @property
    def limits(self) -> str:
        """What values are allowed, in words."""
        lowest = f"finite and {'at least' if self.included else 'above'} {self.lowest:g}"
        return lowest if self.highest == math.inf else f"from {self.lowest:g} to {self.highest:g}"

    def allows(self, values: "npt.ArrayLike") -> "npt.NDArray[np.bool_]":
        """Return where values are finite and within the bounds."""
        import numpy as np

        array = np.asarray(values)
        above = array >= self.lowest if self.included else array > self.lowest
        return np.asarray(np.isfinite(array) & above & (array <= self.highest))

    def twin(self, name: str) -> str | None:
        """Return the name in SI units of a parameter of this kind; None for a ratio.

        Examples
        --------
        >>> [KINDS["field"].twin(name) for name in ("field", "overdrive_field", "bias")]
        ['voltage', 'overdrive_voltage', 'bias_voltage']
        >>> KINDS["rate"].twin("fall_rate"), KINDS["time"].twin("hold_time"), KINDS["share"].twin("duty")
        ('fall_voltage_rate', 'hold_time_seconds', None)
        """
        if not self.suffix:
            return None
        if self.replaces and (name == self.replaces or name.endswith(f"_{self.replaces}")):
            return name.removesuffix(self.replaces) + self.suffix
        return f"{name}_{self.suffix}"


KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "field": Kind(0.0, suffix="voltage", replaces="field", si_units="V"),
        "rate": Kind(0.0, included=False, suffix="voltage_rate", replaces="rate", si_units="V s-1"),
        "time": Kind(0.0, suffix="seconds", si_units="s"),
        "period": Kind(0.0, included=False, suffix="seconds", si_units="s"),
        "share": Kind(0.0, highest=1.0),
        "count": Kind(0.0),
        "ratio": Kind(1.0),
        "stress": Kind(0.0, suffix="nominal_stress", replaces="stress", si_units="Pa"),
    }
)
"""Every kind of parameter."""


class Quantity(NamedTuple):
    """What a name stands for.

    Attributes
    ----------
    label : str
        A few words for the axis of a chart.
    symbol : str
        The symbol beside it, in Matplotlib's mathtext.
    long_name : str
        The words of the CF attribute, ASCII only.
    units : str
        The CF attribute, in UDUNITS.
    kind : str
        Of a parameter: its key in `KINDS`.
    """

    label: str
    symbol: str
    long_name: str
    units: str = "1"
    kind: str = ""


def _parameter(kind: str, label: str, symbol: str, long_name: str) -> Quantity:
    return Quantity(label, symbol, long_name, "1", kind)


PARAMETERS: Mapping[str, Quantity] = MappingProxyType(
    {
        "field": _parameter(
            "field", "field", r"$E/E_c$", "nominal electric field, normalised by the relaxed critical field"
        ),
        "rate": _parameter(
            "rate", "ramp rate", r"$k\,\tau/E_c$", "ramp rate, in relaxed critical fields per relaxation time"
        ),
        "overdrive_field": _parameter(
            "field",
            "overdrive field",
            r"$E_o/E_c$",
            "nominal electric field of the overdrive, normalised by the relaxed critical field",
        ),
        "bias": _parameter(
            "field", "bias", r"$E_b/E_c$", "mean nominal electric field, normalised by the relaxed critical field"
        ),
        "amplitude": _parameter(
            "field",
            "amplitude",
            r"$E_a/E_c$",
            "amplitude of the nominal electric field, normalised by the relaxed critical field",
        ),
        "width": _parameter("time", "width", r"$t_w/\tau$", "duration of the pulse, in relaxation times"),
        "hold_time": _parameter("time", "hold time", r"$t_h/\tau$", "time at constant field, in relaxation times"),
        "fall_rate": _parameter(
            "rate",
            "fall rate",
            r"$k_f\,\tau/E_c$",
            "rate at which the field falls, in relaxed critical fields per relaxation time",
        ),
        "overdrive_time": _parameter(
            "time", "overdrive time", r"$t_o/\tau$", "duration of the overdrive, in relaxation times"
        ),
        "period": _parameter("period", "period", r"$t_p/\tau$", "period of the loading, in relaxation times"),
        "duty": _parameter("share", "duty", r"$d$", "share of the period during which the field is applied"),
        "modulus_ratio": _parameter(
            "ratio", "modulus ratio", r"$\mu_U/\mu_R$", "unrelaxed shear modulus over relaxed shear modulus"
        ),
        "prestretch": _parameter(
            "ratio",
            "pre-stretch",
            r"$\lambda_p$",
            "equibiaxial stretch to which the film relaxed under its dead load before the voltage",
        ),
        "stress": _parameter(
            "stress",
            "dead load",
            r"$s/\mu_R$",
            "equibiaxial nominal stress of the dead load, normalised by the relaxed shear modulus",
        ),
    }
)
"""Parameters of the built-in programs and of every sweep."""

_WORDS = {
    "field": "nominal electric field, normalised by the relaxed critical field",
    "rate": "rate of the field, in relaxed critical fields per relaxation time",
    "time": "duration, in relaxation times",
    "period": "period, in relaxation times",
    "share": "share of a time",
    "count": "number of cycles",
    "stress": "nominal stress, over the relaxed shear modulus",
}


def parameter(name: str, kind: str) -> Quantity:
    """Return what a parameter of a program stands for, its name being one of `PARAMETERS` or the user's own.

    Examples
    --------
    >>> parameter("rest_time", "time").long_name
    'rest time: duration, in relaxation times'
    """
    known = PARAMETERS.get(name)
    if known is not None and known.kind == kind:
        return known
    label = name.replace("_", " ")
    return _parameter(kind, label, "", f"{label}: {_WORDS[kind]}")


VARIABLES: Mapping[str, Quantity] = MappingProxyType(
    {
        "outcome": Quantity("outcome", "", "outcome of loading"),
        "time_to_failure": Quantity(
            "time to failure", r"$t/\tau$", "time to electromechanical instability, in relaxation times"
        ),
        "critical_stretch": Quantity(
            "critical stretch", r"$\lambda$", "equibiaxial stretch at electromechanical instability"
        ),
        "critical_internal_stretch": Quantity(
            "critical internal stretch", r"$\xi$", "stretch of the dashpot at electromechanical instability"
        ),
        "critical_field": Quantity(
            "critical field",
            r"$E/E_c$",
            "nominal electric field at electromechanical instability, normalised by the relaxed critical field",
        ),
        "final_stretch": Quantity(
            "final stretch",
            r"$\lambda_\infty$",
            "equibiaxial stretch after full relaxation, where the film survives",
        ),
        "largest_stretch": Quantity(
            "largest stretch", r"$\lambda_{\max}$", "largest equibiaxial stretch until failure or the steady state"
        ),
        "cycles_to_failure": Quantity(
            "cycles to failure", r"$N$", "completed repetitions before electromechanical instability"
        ),
        "steady_stretch_max": Quantity(
            "largest steady stretch", r"$\lambda_{\max}$", "largest equibiaxial stretch of the limit cycle"
        ),
        "steady_stretch_min": Quantity(
            "smallest steady stretch", r"$\lambda_{\min}$", "smallest equibiaxial stretch of the limit cycle"
        ),
    }
)
"""What sweeps find, in the order of the variables; which of them, is for the program to say."""

TRAJECTORY: Mapping[str, Quantity] = MappingProxyType(
    {
        "time": Quantity("time", r"$t/\tau$", "time since the loading began, in relaxation times"),
        "stretch": Quantity("stretch", r"$\lambda$", "equibiaxial stretch"),
        "internal_stretch": Quantity("internal stretch", r"$\xi$", "stretch of the dashpot"),
        "applied_field": Quantity(
            "applied field", r"$E/E_c$", "nominal electric field applied, normalised by the relaxed critical field"
        ),
        "margin": Quantity(
            "margin",
            r"$1 - e/e_c(\xi)$",
            "margin to electromechanical instability: one minus load divided by the largest load sustained",
        ),
    }
)
"""What a trajectory adds to a sweep's parameters and variables."""

BREAKDOWN: Mapping[str, Quantity] = MappingProxyType(
    {
        "first_limit": Quantity("first limit", "", "what ends the loading first"),
        "time_to_breakdown": Quantity(
            "time to breakdown", r"$t/\tau$", "time to electrical breakdown, in relaxation times"
        ),
        "breakdown_stretch": Quantity("breakdown stretch", r"$\lambda$", "equibiaxial stretch at electrical breakdown"),
        "breakdown_field": Quantity(
            "breakdown field",
            r"$E/E_c$",
            "nominal electric field at electrical breakdown, normalised by the relaxed critical field",
        ),
    }
)
"""What a limit on the true field adds to them."""

FLAGGED = ("outcome", "first_limit")
"""Variables of flags, in one byte each; all others are numbers."""

_INSTABILITY = "at electromechanical instability"

GENERAL: Mapping[str, Quantity] = MappingProxyType(
    {
        "time_to_tension_loss": Quantity(
            "time to loss of tension",
            r"$t/\tau$",
            "time from which a stress in the plane is compressive, in relaxation times",
        ),
        "stretch_1": Quantity("stretch 1", r"$\lambda_1$", "stretch in direction 1"),
        "stretch_2": Quantity("stretch 2", r"$\lambda_2$", "stretch in direction 2"),
        "internal_stretch_1": Quantity("internal stretch 1", r"$\xi_1$", "stretch of the dashpot in direction 1"),
        "internal_stretch_2": Quantity("internal stretch 2", r"$\xi_2$", "stretch of the dashpot in direction 2"),
        "electric_displacement": Quantity(
            "electric displacement",
            r"$\tilde D/\sqrt{\varepsilon\mu_R}$",
            "nominal electric displacement, normalised by the square root of permittivity times relaxed shear modulus",
        ),
        "stress_1": Quantity(
            "stress 1", r"$s_1/\mu_R$", "nominal stress in direction 1, normalised by the relaxed shear modulus"
        ),
        "stress_2": Quantity(
            "stress 2", r"$s_2/\mu_R$", "nominal stress in direction 2, normalised by the relaxed shear modulus"
        ),
        "det_hessian": Quantity(
            "determinant of the Hessian",
            r"$\varepsilon\,\det\mathbf{H}/\mu_R^2$",
            "determinant of the Hessian of the free energy, normalised by mu_R squared per permittivity",
        ),
        "dissipation_rate": Quantity(
            "dissipation rate",
            r"$\tau\,\dot\Gamma/\mu_R$",
            "energy dissipated per volume and relaxation time, normalised by the relaxed shear modulus",
        ),
        "stored_energy": Quantity(
            "stored energy", r"$W/\mu_R$", "Helmholtz free energy per volume, normalised by the relaxed shear modulus"
        ),
        "work": Quantity(
            "work", "", "work of the loads per volume since the loading began, normalised by the relaxed shear modulus"
        ),
        "dissipated_energy": Quantity(
            "dissipated energy",
            r"$\Gamma/\mu_R$",
            "energy dissipated per volume since the loading began, normalised by the relaxed shear modulus",
        ),
        "critical_stretch_1": Quantity("critical stretch 1", r"$\lambda_1$", f"stretch in direction 1 {_INSTABILITY}"),
        "critical_stretch_2": Quantity("critical stretch 2", r"$\lambda_2$", f"stretch in direction 2 {_INSTABILITY}"),
        "critical_internal_stretch_1": Quantity(
            "critical internal stretch 1", r"$\xi_1$", f"stretch of the dashpot in direction 1 {_INSTABILITY}"
        ),
        "critical_internal_stretch_2": Quantity(
            "critical internal stretch 2", r"$\xi_2$", f"stretch of the dashpot in direction 2 {_INSTABILITY}"
        ),
        "final_stretch_1": Quantity(
            "final stretch 1",
            r"$\lambda_{1\infty}$",
            "stretch in direction 1 after full relaxation, where the film survives",
        ),
        "final_stretch_2": Quantity(
            "final stretch 2",
            r"$\lambda_{2\infty}$",
            "stretch in direction 2 after full relaxation, where the film survives",
        ),
    }
)
"""What a trajectory of the general model has beside ``outcome``, ``time_to_failure``, ``critical_field``,
``applied_field`` and its parameters."""

NOMENCLATURE: Mapping[str, Quantity] = MappingProxyType(
    {**PARAMETERS, **VARIABLES, **TRAJECTORY, **BREAKDOWN, **GENERAL}
)
"""All of them by name."""

RESULTS = frozenset(NOMENCLATURE.keys() - PARAMETERS.keys())
"""Names of what data sets hold beside parameters."""

RESERVED = frozenset(
    {
        *RESULTS,
        "modulus_ratio",
        "prestretch",
        "stress",
        "rtol",
        "method",
        "formulation",
        "step",
        "progress",
        "material",
        "thickness",
        "program",
        "path",
        "variables",
        "dtype",
        "engine",
        "scheduler",
        "memory",
        "fresh",
        "parameter",
        "lifetime",
        "lifetime_seconds",
        "time_seconds",
        "cycles",
        "cycle",
    }
)
"""Names that no parameter of a program can have: those of results, and of the arguments of a sweep."""


def cf_attributes(name: str) -> dict[str, str]:
    """Return the CF attributes ``long_name`` and ``units`` of a parameter or variable.

    Parameters
    ----------
    name : str
        A key of `NOMENCLATURE`.

    Examples
    --------
    >>> cf_attributes("field")
    {'long_name': 'nominal electric field, normalised by the relaxed critical field', 'units': '1'}
    """
    quantity = NOMENCLATURE[name]
    return {"long_name": quantity.long_name, "units": quantity.units}


SI_NAMES: Mapping[str, str] = MappingProxyType(
    {
        "time": "seconds",
        "time_to_failure": "seconds_to_failure",
        "critical_field": "critical_voltage",
        "applied_field": "applied_voltage",
        "time_to_breakdown": "seconds_to_breakdown",
        "breakdown_field": "breakdown_voltage",
    }
)
"""Names in SI units of what sweeps and trajectories find."""


def si_name(name: str, kind: str | None = None) -> str | None:
    """Return the name in SI units of a variable, or of a parameter of some kind; None if there is none.

    Examples
    --------
    >>> si_name("time_to_failure"), si_name("rest_time", "time"), si_name("field"), si_name("duty")
    ('seconds_to_failure', 'rest_time_seconds', 'voltage', None)
    """
    if name in SI_NAMES:
        return SI_NAMES[name]
    kind = kind or (PARAMETERS[name].kind if name in PARAMETERS else None)
    return None if kind is None else KINDS[kind].twin(name)


def quantity_of(name: str) -> Quantity:
    """Return what a name stands for: a key of `NOMENCLATURE`, or a parameter of the user's own.

    Examples
    --------
    >>> quantity_of("rest_time").label
    'rest time'
    """
    return NOMENCLATURE.get(name) or Quantity(name.replace("_", " "), "", name.replace("_", " "))


def axis_label(name: str) -> str:
    r"""Return the words and the symbol for the axis of a chart.

    Parameters
    ----------
    name : str
        A key of `NOMENCLATURE`.

    Examples
    --------
    >>> print(axis_label("modulus_ratio"))
    modulus ratio $\mu_U/\mu_R$
    """
    quantity = quantity_of(name)
    return f"{quantity.label} {quantity.symbol}".rstrip()
