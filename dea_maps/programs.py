"""Loading programs: the field against time as a sequence of pieces, whose arguments a sweep varies.

Adding a program is one entry here, a class with a name and its pieces: see docs/extending/program.md.
"""

import math
from collections.abc import Mapping
from collections.abc import Sequence as Listed
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from .checks import brief
from .nomenclature import PARAMETERS, VARIABLES
from .pieces import Argument, Hold, Jump, Linear, Piece, Share, Sine

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

_DEFINED: dict[str, "type[Program]"] = {}

PROGRAMS: Mapping[str, "type[Program]"] = MappingProxyType(_DEFINED)
"""Every loading program by its name in files: a class that names itself enters when it is defined."""

ENDLESS = -1
"""Stands for the number of repetitions of a program that is repeated without end."""


class Program:
    """A loading program.

    Attributes
    ----------
    name : str
        Its name in files and specifications.
    words : str
        What it is, for the titles of charts.
    pieces : tuple of Piece
        What the field does, piece after piece.
    repeat : bool or int
        True if the pieces are repeated without end, or how often they are gone through. After the last one the field
        is held.
    kinds : mapping of str to str
        The parameters that a sweep varies, beside the modulus ratio, and the kind of each, see
        `dea_maps.nomenclature.KINDS`.
    parameters : tuple of str
        Their names.
    """

    name: str
    words: str = "loading program"
    pieces: tuple[Piece, ...]
    repeat: bool | int = False
    kinds: Mapping[str, str]
    parameters: tuple[str, ...]

    def __init_subclass__(cls, **options: Any) -> None:
        """Find the parameters of a program whose pieces are its class's, and enter it by its name."""
        super().__init_subclass__(**options)
        if "name" in cls.__dict__:
            other = _DEFINED.get(cls.name)
            if other is not None and other.__qualname__ != cls.__qualname__:  # the same class may be defined anew
                raise ValueError(f"name of {cls.__qualname__} must not be {cls.name!r}, that of {other.__qualname__}")
            _DEFINED[cls.name] = cls
        if "pieces" in cls.__dict__ and isinstance(cls.pieces, tuple):
            found = kinds_of(cls.pieces)
            named = {name: found[name] for name in PARAMETERS if name in found}
            cls.kinds = MappingProxyType({**named, **found})  # those of the table in its order, then others
            cls.parameters = tuple(cls.kinds)

    @property
    def repeats(self) -> int:
        """How often the pieces are gone through; `ENDLESS` without end."""
        return ENDLESS if self.repeat is True else max(int(self.repeat), 1)

    @property
    def results(self) -> tuple[str, ...]:
        """Names of the variables of a sweep."""
        left_out = {
            "largest_stretch": shape_of(self) is not None and not isinstance(self, Sequence),
            "cycles_to_failure": self.repeats == 1,
            "steady_stretch_max": self.repeats != ENDLESS,
            "steady_stretch_min": self.repeats != ENDLESS,
        }
        return tuple(name for name in VARIABLES if not left_out.get(name, False))


class Shape(NamedTuple):
    """A program that needs no more than a form of its own.

    Attributes
    ----------
    name : str
        "step": a field applied at once and held; "ramp": one that rises without end; "ramp_hold": one that rises,
        then is held. As the kernels that serve them are called.
    field, rate : float, str or None
        What the field and the rate are: numbers, or names of parameters.
    """

    name: str
    field: Argument | None = None
    rate: Argument | None = None


def shape_of(program: Program) -> Shape | None:
    """Return the shape of a program whose field only rises; None for any other.

    Examples
    --------
    >>> shape_of(Sequence([Linear("peak", rate=0.5)]))
    Shape(name='ramp_hold', field='peak', rate=0.5)
    """
    if isinstance(program, Waveform) or program.repeats != 1 or len(program.pieces) != 1:
        return None
    (piece,) = program.pieces
    if isinstance(piece, Jump):
        return Shape("step", piece.to)
    if isinstance(piece, Linear) and piece.rate is not None:
        return Shape("ramp", None, piece.rate) if piece.to == math.inf else Shape("ramp_hold", piece.to, piece.rate)
    return None


def _drifts(pieces: Listed[Piece]) -> bool:
    """Return whether a repetition leads every time further: a sine ends between its zeros, and nothing sets a field."""
    if any(isinstance(piece, Linear | Jump) for piece in pieces):
        return False
    return any(
        isinstance(piece, Sine) and (isinstance(piece.cycles, str) or piece.cycles * 2.0 % 1.0) for piece in pieces
    )


def kinds_of(pieces: Listed[Piece]) -> dict[str, str]:
    """Return the parameters that pieces use and the kind of each, in the order of their first use."""
    found: dict[str, str] = {}
    for piece in pieces:
        for name, kind in piece.arguments().items():
            if {found.setdefault(name, kind), kind} == {"time", "period"}:
                found[name] = "period"  # the narrower of the two
            elif found[name] != kind:
                raise ValueError(f"parameter {name!r} is used both as a {found[name]} and as a {kind}")
    return found


@dataclass(frozen=True)
class Step(Program):
    """A field applied at once and held: ``E(t)/Ec = field`` for ``t > 0``.

    Examples
    --------
    >>> Step.name, Step().parameters
    ('step', ('field',))
    """

    name = "step"
    words = "step to a held field"
    pieces = (Jump("field"),)


@dataclass(frozen=True)
class Ramp(Program):
    """A field that rises without end: ``E(t)/Ec = rate * t/tau``.

    Examples
    --------
    >>> Ramp.name, Ramp().parameters
    ('ramp', ('rate',))
    """

    name = "ramp"
    words = "ramp of the field without end"
    pieces = (Linear(math.inf, rate="rate"),)


@dataclass(frozen=True)
class RampHold(Program):
    """A field that rises, then holds: ``E(t)/Ec = min(rate * t/tau, field)``.

    Examples
    --------
    >>> RampHold.name, RampHold().parameters
    ('ramp_hold', ('field', 'rate'))
    """

    name = "ramp_hold"
    words = "ramp to a held field"
    pieces = (Linear("field", rate="rate"),)


@dataclass(frozen=True)
class Pulse(Program):
    """A field applied at once for a time, then none.

    Examples
    --------
    >>> Pulse().parameters
    ('field', 'width')
    """

    name = "pulse"
    words = "one pulse of the field"
    pieces = (Jump("field"), Hold("width"), Jump(0.0))


@dataclass(frozen=True)
class Trapezoid(Program):
    """A field that rises at a rate, is held for a time, and falls to zero at a rate.

    Examples
    --------
    >>> Trapezoid().parameters
    ('field', 'rate', 'hold_time', 'fall_rate')
    """

    name = "trapezoid"
    words = "ramp, a hold and a fall of the field"
    pieces = (Linear("field", rate="rate"), Hold("hold_time"), Linear(0.0, rate="fall_rate"))


@dataclass(frozen=True)
class Overdrive(Program):
    """A field applied at once for a time, then another one that is held.

    Examples
    --------
    >>> Overdrive().parameters
    ('field', 'overdrive_field', 'overdrive_time')
    """

    name = "overdrive"
    words = "overdrive, then a held field"
    pieces = (Jump("overdrive_field"), Hold("overdrive_time"), Jump("field"))


@dataclass(frozen=True)
class PulseTrain(Program):
    """A field applied at once for a share of every period, without end.

    Examples
    --------
    >>> PulseTrain().parameters
    ('field', 'period', 'duty')
    """

    name = "pulse_train"
    words = "repeated pulses of the field"
    pieces = (Jump("field"), Hold(Share("duty", "period")), Jump(0.0), Hold(Share("duty", "period", rest=True)))
    repeat = True


@dataclass(frozen=True)
class TriangleTrain(Program):
    """A field that rises from zero and falls back to zero along straight lines in every period, without end.

    Examples
    --------
    >>> TriangleTrain().parameters
    ('field', 'period')
    """

    name = "triangle_train"
    words = "repeated triangles of the field"
    pieces = (Linear("field", time=Share(0.5, "period")), Linear(0.0, time=Share(0.5, "period")))
    repeat = True


@dataclass(frozen=True)
class BiasedSine(Program):
    """A field that oscillates about a bias: ``bias + amplitude * sin(2 pi t/period)``, without end.

    The amplitude may exceed the bias: the load goes with the square of the field.

    Examples
    --------
    >>> BiasedSine().parameters
    ('bias', 'amplitude', 'period')
    """

    name = "biased_sine"
    words = "sine about a bias"
    pieces = (Jump("bias"), Sine("amplitude", "period"))
    repeat = True


@dataclass(frozen=True)
class Sequence(Program):
    """A loading program made of pieces.

    Parameters
    ----------
    pieces : sequence of Piece
        `Hold`, `Linear`, `Jump`, `Sine`; each argument is a number or the name of a parameter of the sweep, whose kind
        follows from its use. The field is zero before the first piece, and held after the last one. A repetition
        begins at the field at which the one before it ended.
    repeat : bool or int
        True repeats the pieces without end, a number that many times.

    Raises
    ------
    TypeError, ValueError
        If something is no piece, if no piece loads the film, if a name has two kinds, if something follows a piece
        without end.

    Examples
    --------
    >>> train = Sequence([Linear("field", time=2.0), Hold("hold_time"), Jump(0.0), Hold(60.0)], repeat=100)
    >>> train.parameters
    ('field', 'hold_time')
    """

    pieces: tuple[Piece, ...]
    repeat: bool | int = False
    name = "sequence"
    words = "sequence of pieces"

    def __post_init__(self) -> None:
        """Check the pieces together, and find the parameters."""
        if isinstance(self.pieces, str | bytes) or not isinstance(self.pieces, Listed):
            raise TypeError(f"pieces must be a list of Hold, Linear, Jump and Sine; got {brief(self.pieces)}")
        for number, piece in enumerate(self.pieces, 1):
            if not isinstance(piece, Piece):
                raise TypeError(f"piece {number} must be a Hold, Linear, Jump or Sine; got {brief(piece)}")
        check_repeat(self.repeat)
        pieces = tuple(self.pieces)
        fields: list[Argument] = [piece.to for piece in pieces if isinstance(piece, Linear | Jump)]
        fields += [piece.amplitude for piece in pieces if isinstance(piece, Sine)]
        if not any(isinstance(value, str) or value != 0.0 for value in fields):
            raise ValueError("pieces must load the film: at least one Jump, Linear or Sine to a field other than 0")
        endless = [isinstance(piece, Linear) and piece.to == math.inf for piece in pieces]
        if any(endless[:-1]) or (endless[-1] and self.repeats != 1):
            raise ValueError("nothing can follow a Linear without end, whose value is infinite")
        if self.repeats != 1 and _drifts(pieces):
            raise ValueError("repeated pieces must have a Jump or a Linear, or Sines of half and whole cycles alone")
        object.__setattr__(self, "pieces", pieces)
        object.__setattr__(self, "kinds", MappingProxyType(kinds_of(pieces)))
        object.__setattr__(self, "parameters", tuple(self.kinds))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by what it was made of."""
        return Sequence, (self.pieces, self.repeat)


@dataclass(frozen=True, eq=False)
class Waveform(Program):
    """A measured field: ``field * values``, linear between the times (tau); the last value held, or all repeated.

    Parameters
    ----------
    times : 1-D array of float
        At least two, in tau, from 0 on, each larger than the one before.
    values : 1-D array of float
        One for each time; negative values are allowed, as the load goes with the square of the field.
    repeat : bool
        Whether the whole is repeated without end, from the first time to the last.

    Raises
    ------
    TypeError, ValueError
        If they are no such arrays.

    Examples
    --------
    >>> Waveform([0.0, 1.0, 3.0], [0.0, 1.0, 0.5]).parameters
    ('field',)
    """

    times: "npt.NDArray[np.float64]"
    values: "npt.NDArray[np.float64]"
    repeat: bool = False
    name = "waveform"
    words = "measured waveform"
    kinds = MappingProxyType({"field": "field"})
    parameters = ("field",)

    def __post_init__(self) -> None:
        """Check the samples."""
        import numpy as np

        arrays = {name: _samples(name, getattr(self, name)) for name in ("times", "values")}
        times, values = arrays["times"], arrays["values"]
        if times.size != values.size:
            raise ValueError(f"times and values must have the same length; got {times.size} and {values.size}")
        if times.size < 2:
            raise ValueError(f"times must have at least 2 samples; got {times.size}")
        if times[0] != 0.0:
            raise ValueError(f"times must begin at 0; got {times[0]}")
        falls = np.flatnonzero(np.diff(times) <= 0.0)
        if falls.size:
            raise ValueError(f"times must rise; got {times[falls[0] + 1]} after {times[falls[0]]}")
        if not values.any():
            raise ValueError("values must load the film: at least one other than 0")
        if not isinstance(self.repeat, bool):
            raise TypeError(f"repeat must be True or False; got {brief(self.repeat)}")
        for name, array in arrays.items():
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def __eq__(self, other: object) -> bool:
        """Compare sample by sample."""
        import numpy as np

        return isinstance(other, Waveform) and (
            self.repeat == other.repeat
            and np.array_equal(self.times, other.times)
            and np.array_equal(self.values, other.values)
        )

    def __hash__(self) -> int:
        """Hash the samples."""
        return hash((self.times.tobytes(), self.values.tobytes(), self.repeat))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by what it was made of."""
        return Waveform, (self.times, self.values, self.repeat)


def _samples(name: str, given: object) -> "npt.NDArray[np.float64]":
    import numpy as np  # at the first waveform: naming a program waits for no library

    try:
        array = np.array(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be a 1-D array of real numbers; got {brief(given)}") from None
    if array.ndim != 1:
        raise ValueError(f"{name} must be a 1-D array; got one of shape {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite; got {array[~np.isfinite(array)][0]}")
    return array


def check_repeat(repeat: object) -> None:
    """Check how often pieces are repeated: True, False or a number from 1 on."""
    if isinstance(repeat, bool):
        return
    if not isinstance(repeat, int):
        raise TypeError(f"repeat must be True, False or a whole number; got {brief(repeat)}")
    if repeat < 1:
        raise ValueError(f"repeat must be True, False or at least 1; got {repeat}")
