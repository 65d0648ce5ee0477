"""TOML files: read whole, and their tables checked key by key."""

import difflib
import sys
import tomllib
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from .atomic import PathLike, read_text
from .checks import brief

_SPACINGS = ("linear", "log")
_MOST_VALUES = 10**8  # of a range: 0.8 GB


def read_toml(path: PathLike) -> dict[str, Any]:
    r"""Read a TOML file.

    Raises
    ------
    OSError
        If it cannot be read.
    ValueError
        If it is not TOML, or nested more deeply than Python reads; with the name of the file.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "a.toml")
    ...     _ = file.write_text("[table]\nkey = 1")
    ...     read_toml(file)
    {'table': {'key': 1}}
    """
    text = read_text(path, "TOML")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError(f"{path} is not TOML that can be read: its values are nested too deeply") from None
    except ValueError as error:  # also Python's, of a whole number with thousands of digits
        raise ValueError(f"{path} is not TOML: {error}") from None


def check_keys(
    place: str,
    table: Mapping[str, Any],
    required: Iterable[str],
    optional: Iterable[str] = (),
    noun: str = "key",
) -> None:
    """Check that a table has the keys that it must have, and no others than it may have.

    Examples
    --------
    >>> check_keys("[program]", {"nmae": "step"}, ["name"])
    Traceback (most recent call last):
    ...
    ValueError: [program] may have the keys name; got 'nmae', to which 'name' is nearest
    """
    known = [*required, *optional]
    for key in table:
        if key not in known:
            raise ValueError(f"{place} may have the {noun}s {', '.join(known)}; got {unknown(key, known)}")
    for key in required:
        if key not in table:
            raise ValueError(f"{place} must have the {noun} {key!r}; it is missing")


def check_number(key: str, value: Any) -> None:
    """Check that a value is a finite number."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not (is_number and abs(value) <= sys.float_info.max):  # also where a whole number is beyond any float
        raise ValueError(f"{key} must be a finite number; got {brief(value)}")


def unknown(name: object, known: Iterable[str]) -> str:
    """Return what was given, with the known name that is nearest to it."""
    (nearest,) = difflib.get_close_matches(str(name), list(known), n=1, cutoff=0.0)
    return f"{brief(name)}, to which {nearest!r} is nearest"


def values_of(key: str, given: Any) -> Any:
    """Return a number or a list as given, a range ``{start, stop, num, spacing}`` as its values, whose ends are exact.

    Parameters
    ----------
    key : str
        Where it is in the file, as ``grid.field``.
    given : Any
        What is there.

    Returns
    -------
    float, list of float or ndarray of float64

    Raises
    ------
    ValueError
        If it is none of these, or not made of finite numbers.
    MemoryError
        If a range asks for more values than it may have; before any is made.

    Examples
    --------
    >>> values_of("grid.rate", {"start": 0.01, "stop": 1, "num": 3, "spacing": "log"}).tolist()
    [0.01, 0.1, 1.0]
    """
    if isinstance(given, dict):
        return _range(key, given)
    if isinstance(given, list):
        for index, item in enumerate(given):
            check_number(f"{key}[{index}]", item)
        return given
    if isinstance(given, bool) or not isinstance(given, int | float):
        raise ValueError(f"{key} must be a number, a list or {{start, stop, num}}; got {brief(given)}")
    check_number(key, given)
    return given


def _range(key: str, given: dict[str, Any]) -> npt.NDArray[np.float64]:
    check_keys(key, given, ("start", "stop", "num"), ("spacing",))
    for end in ("start", "stop"):
        check_number(f"{key}.{end}", given[end])
    start, stop, num = float(given["start"]), float(given["stop"]), given["num"]
    spacing = given.get("spacing", "linear")
    if spacing not in _SPACINGS:
        raise ValueError(f"{key}.spacing must be one of {', '.join(_SPACINGS)}; got {unknown(spacing, _SPACINGS)}")
    if isinstance(num, bool) or not isinstance(num, int) or num < 1:
        raise ValueError(f"{key}.num must be a whole number of at least 1; got {brief(num)}")
    if num == 1 and start != stop:
        raise ValueError(f"{key}.num must be at least 2 for start and stop to differ; got 1")
    if spacing == "log" and min(start, stop) <= 0:
        raise ValueError(f"{key} must have start and stop above 0 for spacing 'log'; got {start} and {stop}")
    if num > _MOST_VALUES:
        raise MemoryError(f"{key}.num asks for {num} values: more than the {_MOST_VALUES:,} that a range may have")
    with np.errstate(all="ignore"):
        values = np.geomspace(start, stop, num) if spacing == "log" else np.linspace(start, stop, num)
    if not np.isfinite(values).all():
        raise ValueError(f"{key} must have start and stop with finite values between; got {start} and {stop}")
    return values
