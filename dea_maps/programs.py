"""Loading programs: how the field rises with time, by name and by the parameters that a sweep varies."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar


@dataclass(frozen=True)
class Program:
    """A loading program.

    Attributes
    ----------
    name : str
        Its name in files and specifications.
    parameters : tuple of str
        What a sweep under it varies, beside the modulus ratio.
    """

    name: ClassVar[str]
    parameters: ClassVar[tuple[str, ...]]


@dataclass(frozen=True)
class Step(Program):
    """A field applied at once and held: ``E(t)/Ec = field`` for ``t > 0``.

    Examples
    --------
    >>> Step.name, Step.parameters
    ('step', ('field',))
    """

    name = "step"
    parameters = ("field",)


@dataclass(frozen=True)
class Ramp(Program):
    """A field that rises without end: ``E(t)/Ec = rate * t/tau``.

    Examples
    --------
    >>> Ramp.name, Ramp.parameters
    ('ramp', ('rate',))
    """

    name = "ramp"
    parameters = ("rate",)


@dataclass(frozen=True)
class RampHold(Program):
    """A field that rises, then holds: ``E(t)/Ec = min(rate * t/tau, field)``.

    Examples
    --------
    >>> RampHold.name, RampHold.parameters
    ('ramp_hold', ('field', 'rate'))
    """

    name = "ramp_hold"
    parameters = ("field", "rate")


PROGRAMS: Mapping[str, type[Program]] = MappingProxyType({program.name: program for program in (Step, Ramp, RampHold)})
"""Every loading program by its name in files."""
