"""The names of everything that a data set holds: one table for attributes, charts and error messages.

Fields are over the relaxed critical field ``Ec = sqrt(0.75 * 4**(-1/3) * mu_R/eps)``, times over the
relaxation time ``tau``; stretches are plain ratios. All is dimensionless, so all units are "1".
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np


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
    """

    label: str
    symbol: str
    long_name: str
    units: str = "1"


PARAMETERS: Mapping[str, Quantity] = MappingProxyType(
    {
        "field": Quantity("field", r"$E/E_c$", "nominal electric field over the relaxed critical field"),
        "rate": Quantity("ramp rate", r"$k\,\tau/E_c$", "ramp rate, in relaxed critical fields per relaxation time"),
        "modulus_ratio": Quantity(
            "modulus ratio", r"$\mu_U/\mu_R$", "unrelaxed shear modulus over relaxed shear modulus"
        ),
    }
)
"""What a sweep can vary, in the order of its dimensions."""

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
            "nominal electric field at electromechanical instability, over the relaxed critical field",
        ),
        "final_stretch": Quantity(
            "final stretch",
            r"$\lambda_\infty$",
            "equibiaxial stretch after full relaxation, where the film survives",
        ),
    }
)
"""What a sweep finds, in the order of its variables."""

TRAJECTORY: Mapping[str, Quantity] = MappingProxyType(
    {
        "time": Quantity("time", r"$t/\tau$", "time since the loading began, in relaxation times"),
        "stretch": Quantity("stretch", r"$\lambda$", "equibiaxial stretch"),
        "internal_stretch": Quantity("internal stretch", r"$\xi$", "stretch of the dashpot"),
        "applied_field": Quantity(
            "applied field", r"$E/E_c$", "nominal electric field applied, over the relaxed critical field"
        ),
        "margin": Quantity(
            "margin",
            r"$1 - e/e_c(\xi)$",
            "margin to electromechanical instability: one minus load over the largest load carried",
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
        "breakdown_stretch": Quantity(
            "breakdown stretch", r"$\lambda$", "equibiaxial stretch at electrical breakdown"
        ),
        "breakdown_field": Quantity(
            "breakdown field",
            r"$E/E_c$",
            "nominal electric field at electrical breakdown, over the relaxed critical field",
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
            "nominal electric displacement, over the square root of permittivity times relaxed shear modulus",
        ),
        "stress_1": Quantity(
            "stress 1", r"$s_1/\mu_R$", "nominal stress in direction 1, over the relaxed shear modulus"
        ),
        "stress_2": Quantity(
            "stress 2", r"$s_2/\mu_R$", "nominal stress in direction 2, over the relaxed shear modulus"
        ),
        "det_hessian": Quantity(
            "determinant of the Hessian",
            r"$\varepsilon\,\det\mathbf{H}/\mu_R^2$",
            "determinant of the Hessian of the free energy, over the squared relaxed shear modulus per permittivity",
        ),
        "dissipation_rate": Quantity(
            "dissipation rate",
            r"$\tau\,\dot\Gamma/\mu_R$",
            "energy dissipated per volume and relaxation time, over the relaxed shear modulus",
        ),
        "stored_energy": Quantity(
            "stored energy", r"$W/\mu_R$", "density of the Helmholtz free energy, over the relaxed shear modulus"
        ),
        "work": Quantity(
            "work", "", "work of the loads per volume since the loading began, over the relaxed shear modulus"
        ),
        "dissipated_energy": Quantity(
            "dissipated energy",
            r"$\Gamma/\mu_R$",
            "energy dissipated per volume since the loading began, over the relaxed shear modulus",
        ),
        "critical_stretch_1": Quantity(
            "critical stretch 1", r"$\lambda_1$", f"stretch in direction 1 {_INSTABILITY}"
        ),
        "critical_stretch_2": Quantity(
            "critical stretch 2", r"$\lambda_2$", f"stretch in direction 2 {_INSTABILITY}"
        ),
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

OUTCOMES = ("survives", "fails_later", "fails_at_once", "unresolved")
"""Words for the values 0, 1, 2, ... of ``outcome``."""


def cf_attributes(name: str) -> dict[str, str]:
    """Return the CF attributes ``long_name`` and ``units`` of a parameter or variable.

    Parameters
    ----------
    name : str
        A key of `NOMENCLATURE`.

    Examples
    --------
    >>> cf_attributes("field")
    {'long_name': 'nominal electric field over the relaxed critical field', 'units': '1'}
    """
    quantity = NOMENCLATURE[name]
    return {"long_name": quantity.long_name, "units": quantity.units}


def flags(words: tuple[str, ...]) -> dict[str, Any]:
    """Return the CF attributes of a variable whose values 0, 1, 2, ... stand for words.

    Examples
    --------
    >>> flags(("no", "yes"))["flag_meanings"]
    'no yes'
    """
    return {"flag_values": np.arange(len(words), dtype=np.int8), "flag_meanings": " ".join(words)}


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
    quantity = NOMENCLATURE[name]
    return f"{quantity.label} {quantity.symbol}".rstrip()
