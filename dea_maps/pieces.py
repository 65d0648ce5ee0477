"""The pieces of a loading program: what the field does next, with arguments that are numbers or names of parameters."""

import math
import numbers
from collections.abc import Iterator, Mapping
from dataclasses import KW_ONLY, dataclass
from typing import ClassVar

from .checks import brief
from .nomenclature import KINDS, RESERVED, Kind


@dataclass(frozen=True)
class Share:
    """A share of a time, as the duty of a period: ``share * of``, or ``(1 - share) * of`` if it is the rest.

    Parameters
    ----------
    share : float or str
        From 0 to 1, or the name of a parameter.
    of : float or str
        The time in tau, or the name of a parameter.
    rest : bool
        Whether what the share leaves is meant.

    Examples
    --------
    >>> Hold(Share("duty", of="period")).arguments()
    {'period': 'period', 'duty': 'share'}
    """

    share: float | str
    of: float | str
    rest: bool = False

    def __post_init__(self) -> None:
        """Check both arguments."""
        _check("share", self.share, KINDS["share"])
        _check("of", self.of, KINDS["period"])


Argument = float | str
"""A number, or the name of a sweep parameter."""
Time = Argument | Share
"""A time in tau: a number, the name of a parameter, or a share of one of these."""


@dataclass(frozen=True)
class Piece:
    """A piece of a loading program; begins at the field that the piece before it reached, zero before the first."""

    _kinds: ClassVar[Mapping[str, str]]
    _optional: ClassVar[tuple[str, ...]] = ()

    def arguments(self) -> dict[str, str]:
        """Return the names of parameters that the piece uses, and the kind of each, in order."""
        found: dict[str, str] = {}
        for name, kind in self._named():
            if found.setdefault(name, kind) != kind:
                raise ValueError(f"parameter {name!r} is used both as a {found[name]} and as a {kind}")
        return found

    def _named(self) -> Iterator[tuple[str, str]]:
        for argument, kind in self._kinds.items():
            value = getattr(self, argument)
            if isinstance(value, Share):
                for name, part in ((value.of, "period"), (value.share, "share")):
                    if isinstance(name, str):
                        yield name, part
            elif isinstance(value, str):
                yield value, kind

    def __post_init__(self) -> None:
        """Check the kind and the range of every argument."""
        for argument, kind in self._kinds.items():
            value = getattr(self, argument)
            left_out = value is None and argument in self._optional
            if not left_out and not (isinstance(value, Share) and kind == "time"):
                _check(argument, value, KINDS[kind], type(self).__name__)


@dataclass(frozen=True)
class Hold(Piece):
    """The field is held for a time (tau).

    Examples
    --------
    >>> Hold("hold_time").arguments()
    {'hold_time': 'time'}
    """

    time: Time

    _kinds: ClassVar = {"time": "time"}


@dataclass(frozen=True)
class Linear(Piece):
    """The field goes to a value (Ec) along a straight line, at a rate (Ec per tau, a magnitude) or in a time (tau).

    The value may be infinite: at a rate, the field then rises without end.

    Examples
    --------
    >>> Linear("field", rate="rate").arguments()
    {'field': 'field', 'rate': 'rate'}
    """

    to: Argument
    _: KW_ONLY
    rate: Argument | None = None
    time: Time | None = None

    _kinds: ClassVar = {"to": "field", "rate": "rate", "time": "time"}
    _optional: ClassVar = ("rate", "time")

    def __post_init__(self) -> None:
        """Check the arguments, and that there is one of rate and time."""
        if (self.rate is None) == (self.time is None):
            raise ValueError(f"Linear must have either rate or time; got {'neither' if self.rate is None else 'both'}")
        super().__post_init__()


@dataclass(frozen=True)
class Jump(Piece):
    """The field changes to a value (Ec) at once.

    Examples
    --------
    >>> Jump(0.95).arguments()
    {}
    """

    to: Argument

    _kinds: ClassVar = {"to": "field"}


@dataclass(frozen=True)
class Sine(Piece):
    """The field oscillates about the value reached, ``amplitude * sin(2 pi t/period)``, for a number of cycles.

    Examples
    --------
    >>> Sine("amplitude", period=2.0, cycles=10).arguments()
    {'amplitude': 'field'}
    """

    amplitude: Argument
    period: Argument
    cycles: Argument = 1

    _kinds: ClassVar = {"amplitude": "field", "period": "period", "cycles": "count"}


PIECES: Mapping[str, type[Piece]] = {"hold": Hold, "linear": Linear, "jump": Jump, "sine": Sine}
"""Every kind of piece by its name in specifications."""


def _check(name: str, value: object, kind: Kind, owner: str = "Share") -> None:
    """Check an argument: a number within the bounds of its kind, or a name that a parameter may have."""
    if isinstance(value, str):
        if not value.isidentifier():
            raise ValueError(f"{name} of {owner} must be a number or the name of a parameter; got {value!r}")
        if value in RESERVED:
            raise ValueError(f"{name} of {owner} must not be {value!r}, a name that the sweep itself uses")
        return
    if isinstance(value, bool) or not isinstance(value, numbers.Real):
        raise TypeError(f"{name} of {owner} must be a number or the name of a parameter; got {brief(value)}")
    number = float(value)
    endless = owner == "Linear" and name == "to" and number == math.inf
    above = number >= kind.lowest if kind.included else number > kind.lowest
    if not ((above and number <= kind.highest and math.isfinite(number)) or endless):
        raise ValueError(f"{name} of {owner} must be {kind.limits}; got {brief(value)}")
