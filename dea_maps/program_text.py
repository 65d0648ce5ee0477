"""Loading programs as text: the pieces of a specification, and the attributes by which a file names its program."""

import json
from collections.abc import Iterable, Mapping
from typing import Any

from .checks import brief
from .nomenclature import KINDS, PARAMETERS
from .pieces import Hold, Jump, Linear, Piece, Share, Sine
from .programs import PROGRAMS, Program, Sequence, Waveform

MOST_SAMPLES = 4000
"""Samples of a waveform that the attributes of a file hold at most."""

_KEYS: Mapping[type[Piece], Mapping[str, str]] = {
    Hold: {"hold": "time"},
    Linear: {"linear_to": "to", "rate": "rate", "time": "time"},
    Jump: {"jump_to": "to"},
    Sine: {"sine": "amplitude", "period": "period", "cycles": "cycles"},
}
"""Keys of a piece in a specification, and the arguments that they give; the first one names the piece."""

_KINDS = {
    "hold": "time", "linear_to": "field", "rate": "rate", "time": "time", "jump_to": "field", "sine": "field",
    "period": "period", "cycles": "count",
}  # fmt: skip


def piece_of(table: object, where: str, units: Mapping[str, float] | None = None) -> Piece:
    """Return a piece from a table of a specification.

    Parameters
    ----------
    table : object
        As ``{"linear_to": "field", "rate": "rate"}``: numbers, names of parameters, or for a time
        ``{"share": "duty", "of": "period"}``.
    where : str
        What it is called in messages.
    units : mapping of str to float, optional
        What one unit of a kind in SI units is worth in the program's own: then keys in SI units are taken as well,
        as ``hold_seconds`` or ``linear_to_voltage``.

    Raises
    ------
    TypeError, ValueError
        If it is no piece; the message begins with ``where``.

    Examples
    --------
    >>> piece_of({"linear_to": "field", "rate": 0.5}, "piece 1")
    Linear(to='field', rate=0.5, time=None)
    """
    if not isinstance(table, dict):
        raise TypeError(f"{where} must be a table with one of {_names()}; got {brief(table)}")
    given: dict[str, Any] = {}
    for key, value in table.items():
        plain, scaled = _plain(key, value, where, units or {})
        if plain in given:
            raise ValueError(f"{where} must have {plain} or {key}; got both")
        given[plain] = scaled
    found = [kind for kind, keys in _KEYS.items() if next(iter(keys)) in given]
    if len(found) != 1:
        raise ValueError(f"{where} must have one of {_names()}; got {', '.join(map(repr, table)) or 'none'}")
    (kind,) = found
    unknown = [key for key in given if key not in _KEYS[kind]]
    if unknown:
        raise ValueError(f"{where} has the unknown key {unknown[0]!r}; known are {', '.join(_KEYS[kind])}")
    try:
        return kind(**{_KEYS[kind][key]: value for key, value in given.items()})
    except TypeError as error:
        if "required" not in str(error):
            raise TypeError(f"{where}: {error}") from None
        raise ValueError(f"{where} must have all of {', '.join(_KEYS[kind])}; got {', '.join(given)}") from None
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None


def table_of(piece: Piece) -> dict[str, Any]:
    """Return a piece as a table of a specification.

    Examples
    --------
    >>> table_of(Hold(Share("duty", "period")))
    {'hold': {'share': 'duty', 'of': 'period'}}
    """
    values = {key: getattr(piece, argument) for key, argument in _KEYS[type(piece)].items()}
    return {key: _plain_value(value) for key, value in values.items() if value is not None}


def attributes_of(program: Program) -> dict[str, Any]:
    """Return the attributes by which a file names a program; `program_of` reads them.

    Examples
    --------
    >>> attributes_of(Sequence([Jump("field")]))["program_pieces"]
    '[{"jump_to": "field"}]'
    """
    named: dict[str, Any] = {"program": program.name}
    if isinstance(program, Waveform):
        named["program_repeat"] = int(program.repeat)
        named["program_samples"] = program.times.size
        if program.times.size <= MOST_SAMPLES:
            named |= {"program_times": program.times, "program_values": program.values}
    elif isinstance(program, Sequence):
        named["program_pieces"] = json.dumps([table_of(piece) for piece in program.pieces])
        named["program_repeat"] = json.dumps(program.repeat)
    return named


def program_of(attributes: Mapping[Any, Any]) -> Program:
    """Return the program that the attributes of a data set name.

    Raises
    ------
    ValueError
        If they name none, or if a waveform has more samples than a file holds.
    """
    name = attributes.get("program")
    known = PROGRAMS.get(name) if isinstance(name, str) else None
    if known is None:
        raise ValueError(f"the attribute 'program' must be one of {', '.join(PROGRAMS)}; got {brief(name)}")
    try:
        if known is Waveform:
            if "program_times" not in attributes:
                raise ValueError(f"a file holds the samples of a waveform up to {MOST_SAMPLES} of them")
            import numpy as np

            return Waveform(
                np.atleast_1d(attributes["program_times"]),
                np.atleast_1d(attributes["program_values"]),
                bool(attributes["program_repeat"]),
            )
        if known is Sequence:
            tables = json.loads(attributes["program_pieces"])
            pieces = tuple(piece_of(table, f"piece {number}") for number, table in enumerate(tables, 1))
            return Sequence(pieces, json.loads(attributes["program_repeat"]))
        return known()
    except (KeyError, TypeError, json.JSONDecodeError) as error:
        raise ValueError(f"the attributes of the program {name!r} are not those of this package: {error}") from None


def kinds_in(names: Iterable[Any], attributes: Mapping[Any, Any]) -> dict[str, str]:
    """Return the parameters of a data set, and the kind of each, in the order of dimensions.

    Parameters
    ----------
    names : iterable
        Names of its coordinates.
    attributes : mapping
        Its attributes: a program that they name has its parameters; without one, those of a known name are taken.

    Examples
    --------
    >>> kinds_in(["time", "modulus_ratio", "rate"], {"program": "ramp"})
    {'rate': 'rate', 'modulus_ratio': 'ratio'}
    """
    try:
        of_program = dict(program_of(attributes).kinds)
    except ValueError:
        named = PROGRAMS.get(str(attributes.get("program")))
        of_program = dict(getattr(named, "kinds", {}))
    known = {**of_program, **{name: quantity.kind for name, quantity in PARAMETERS.items()}}
    there = set(names)
    return {name: kind for name, kind in known.items() if name in there}


def _names() -> str:
    return ", ".join(next(iter(keys)) for keys in _KEYS.values())


def _plain(key: str, value: Any, where: str, units: Mapping[str, float]) -> tuple[str, Any]:
    """Return a key and its value in the program's own units."""
    if isinstance(value, dict):
        unknown = [name for name in value if name not in {"share", "of", "rest"}]
        if unknown or not {"share", "of"} <= value.keys():
            raise ValueError(f"{where}: {key} must be a time or a table with share and of; got {brief(value)}")
        return key, Share(**value)
    for plain, kind in _KINDS.items():
        if units and KINDS[kind].twin(plain) == key:
            return plain, value if isinstance(value, str) else value * units[kind]
    return key, value


def _plain_value(value: Any) -> Any:
    if isinstance(value, Share):
        return {"share": value.share, "of": value.of, **({"rest": True} if value.rest else {})}
    return value
