"""Specifications: a sweep described in a TOML file."""

import difflib
import sys
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .nomenclature import PARAMETERS
from .parameters import brief, check_values
from .programs import PROGRAMS, Program
from .storage import PathLike

_SPACINGS = ("linear", "log")


@dataclass(frozen=True, eq=False)
class Specification:
    """A sweep as a specification describes it.

    Attributes
    ----------
    program : Program
        The loading program.
    parameters : dict of str to float, list of float or ndarray of float64
        What ``[grid]`` gives, dimensionless.
    accuracy : dict of str to float or str
        What ``[accuracy]`` gives: any of ``rtol``, ``method``, ``formulation``, ``step``.
    """

    program: Program
    parameters: dict[str, Any]
    accuracy: dict[str, Any]


def read_specification(path: PathLike) -> Specification:
    r"""Read a specification and check its tables, keys and types.

    What values the parameters may have is for `dea_maps.grid.make_grid` to say.

    Parameters
    ----------
    path : str or path-like
        A TOML file with the tables ``[program]``, ``[grid]`` and, optionally, ``[accuracy]``.

    Returns
    -------
    Specification

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is not TOML, if a table, key or name is unknown or missing, or if a value is not allowed; with
        the name of the file.
    MemoryError
        If a range has more values than memory holds.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "step.toml")
    ...     _ = file.write_text('[program]\nname = "step"\n[grid]\nfield = [0.9, 1.1]\nmodulus_ratio = 4')
    ...     read_specification(file).parameters
    {'field': [0.9, 1.1], 'modulus_ratio': 4}
    """
    file = Path(path)
    try:
        with file.open("rb") as stream:
            document = tomllib.load(stream)
    except OSError as error:
        raise type(error)(f"cannot read {file}: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{file} is not TOML: {error}") from None
    try:
        return _specification(document)
    except ValueError as error:
        raise ValueError(f"{file}: {error}") from None


def thinned(parameters: Mapping[str, Any], most: int = 10) -> dict[str, Any]:
    """Return the parameters of a specification with fewer values, the first and the last among them.

    Examples
    --------
    >>> thinned({"field": list(range(100)), "rate": 1.0}, 4)
    {'field': [0, 33, 66, 99], 'rate': 1.0}
    """
    fewer = dict(parameters)
    for name, values in parameters.items():
        if isinstance(values, list | np.ndarray) and len(values) > most:
            chosen = np.linspace(0, len(values) - 1, most).round().astype(int)
            fewer[name] = [values[i] for i in chosen]
    return fewer


def _specification(document: Mapping[str, Any]) -> Specification:
    _check_keys("the file", document, ("program", "grid"), ("accuracy",), noun="table")
    for name, table in document.items():
        if not isinstance(table, dict):
            raise ValueError(f"{name} must be a table, [{name}]; got {brief(table)}")
    _check_keys("[program]", document["program"], ("name",))
    _check_keys("[grid]", document["grid"], (), PARAMETERS)
    accuracy = document.get("accuracy", {})
    _check_keys("[accuracy]", accuracy, (), ("rtol", "method", "formulation", "step"))
    if "rtol" in accuracy and "step" in accuracy:
        raise ValueError("[accuracy] must have rtol or step; got both")
    for key, value in accuracy.items():
        if key in {"rtol", "step"}:
            _check_number(f"accuracy.{key}", value)
        elif not isinstance(value, str):
            raise ValueError(f"accuracy.{key} must be a string; got {brief(value)}")
    parameters = {name: _values(name, value) for name, value in document["grid"].items()}
    return Specification(_program(document["program"]["name"]), parameters, dict(accuracy))


def _program(name: object) -> Program:
    if name not in PROGRAMS or not isinstance(name, str):
        raise ValueError(f"program.name must be one of {', '.join(PROGRAMS)}; got {_unknown(name, PROGRAMS)}")
    return PROGRAMS[name]()


def _values(name: str, given: Any) -> Any:
    """Return a number or a list as given, and a range as its values, whose ends are exact."""
    key = f"grid.{name}"
    if isinstance(given, dict):
        return _range(name, given)
    if isinstance(given, list):
        for index, item in enumerate(given):
            _check_number(f"{key}[{index}]", item)
        return given
    if isinstance(given, bool) or not isinstance(given, int | float):
        raise ValueError(f"{key} must be a number, a list or {{start, stop, num}}; got {brief(given)}")
    _check_number(key, given)
    return given


def _range(name: str, given: dict[str, Any]) -> npt.NDArray[np.float64]:
    key = f"grid.{name}"
    _check_keys(key, given, ("start", "stop", "num"), ("spacing",))
    for end in ("start", "stop"):
        _check_number(f"{key}.{end}", given[end])
    start, stop, num = float(given["start"]), float(given["stop"]), given["num"]
    spacing = given.get("spacing", "linear")
    if spacing not in _SPACINGS:
        raise ValueError(f"{key}.spacing must be one of {', '.join(_SPACINGS)}; got {_unknown(spacing, _SPACINGS)}")
    if isinstance(num, bool) or not isinstance(num, int) or num < 1:
        raise ValueError(f"{key}.num must be a whole number of at least 1; got {brief(num)}")
    if num == 1 and start != stop:
        raise ValueError(f"{key}.num must be at least 2 for start and stop to differ; got 1")
    check_values(name, np.array([start, stop]))
    if spacing == "log" and min(start, stop) <= 0:
        raise ValueError(f"{key} must have start and stop above 0 for spacing 'log'; got {start} and {stop}")
    try:
        return np.geomspace(start, stop, num) if spacing == "log" else np.linspace(start, stop, num)
    except (MemoryError, OverflowError, ValueError):
        raise MemoryError(f"{key}.num asks for {num} values: more than there is memory for") from None


def _check_number(key: str, value: Any) -> None:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not (is_number and abs(value) <= sys.float_info.max):  # also where a whole number is beyond any float
        raise ValueError(f"{key} must be a finite number; got {brief(value)}")


def _check_keys(
    place: str,
    table: Mapping[str, Any],
    required: Iterable[str],
    optional: Iterable[str] = (),
    noun: str = "key",
) -> None:
    known = [*required, *optional]
    for key in table:
        if key not in known:
            raise ValueError(f"{place} may have the {noun}s {', '.join(known)}; got {_unknown(key, known)}")
    for key in required:
        if key not in table:
            raise ValueError(f"{place} must have the {noun} {key!r}; it is missing")


def _unknown(name: object, known: Iterable[str]) -> str:
    """Return what was given, with the known name that is nearest to it."""
    (nearest,) = difflib.get_close_matches(str(name), list(known), n=1, cutoff=0.0)
    return f"{brief(name)}, to which {nearest!r} is nearest"
