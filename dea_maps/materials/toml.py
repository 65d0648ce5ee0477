"""Materials in TOML: the table ``[material]`` of a specification, or of a file of its own."""

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ..atomic import PathLike
from ..checks import brief
from ..toml_tables import check_keys, check_number, read_toml, unknown
from .material import VHB, Material

PRESETS = {"VHB": VHB}
"""Materials that a table may name instead of giving all numbers."""

_NUMBERS = ("unrelaxed_modulus", "relaxed_modulus", "relaxation_time")
_OPTIONAL = ("relative_permittivity", "breakdown_strength", "name", "source")


@dataclass(frozen=True)
class PowerLaw:
    """A breakdown strength that grows with the stretch: ``at_rest * stretch**exponent``.

    Attributes
    ----------
    at_rest : float
        In V/m, of the undeformed film.
    exponent : float
    """

    at_rest: float
    exponent: float

    def __call__(self, stretch: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return the strength at a stretch, in V/m."""
        return np.asarray(self.at_rest * np.asarray(stretch) ** self.exponent)


def read_material(path: PathLike) -> Material:
    r"""Read a material from a TOML file.

    Parameters
    ----------
    path : str or path-like
        A file with the table ``[material]``: either ``preset``, the name of a known material, of which the other keys
        change what they name, or ``unrelaxed_modulus`` and ``relaxed_modulus`` (Pa) and ``relaxation_time`` (s); also
        ``relative_permittivity``, ``breakdown_strength`` (V/m; a number, or ``{at_rest, exponent}`` for one that grows
        with the stretch), ``name`` and ``source``.

    Returns
    -------
    Material

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is not TOML, or if a key or value is missing, unknown or not allowed; with the name of the file.

    Examples
    --------
    >>> import tempfile, os
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = os.path.join(folder, "film.toml")
    ...     with open(path, "w") as file:
    ...         _ = file.write('[material]\npreset = "VHB"\nrelaxation_time = 150.0')
    ...     read_material(path).relaxation_time
    150.0
    """
    document = read_toml(path)
    try:
        check_keys("the file", document, ("material",), noun="table")
        return material_of(document["material"])
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def material_of(table: Any, others: tuple[str, ...] = ()) -> Material:
    """Return the material of a table ``[material]``, see `read_material`.

    Parameters
    ----------
    table : Any
        What the document has there.
    others : tuple of str
        Keys that the table must have beside those of the material.

    Raises
    ------
    ValueError
        If something is missing, unknown or not allowed.

    Examples
    --------
    >>> material_of({"preset": "VHB"}) == VHB
    True
    """
    if not isinstance(table, dict):
        raise ValueError("material must be a table, [material]")
    if "preset" in table:
        check_keys("[material]", table, ("preset", *others), (*_NUMBERS, *_OPTIONAL))
        if not isinstance(table["preset"], str) or table["preset"] not in PRESETS:
            raise ValueError(
                f"material.preset must be one of {', '.join(PRESETS)}; got {unknown(table['preset'], PRESETS)}"
            )
    else:
        check_keys("[material]", table, (*_NUMBERS, *others), ("preset", *_OPTIONAL))
    given = {key: _value(key, value) for key, value in table.items() if key not in {"preset", *others}}
    try:
        return replace(PRESETS[table["preset"]], **given) if "preset" in table else Material(**given)
    except (TypeError, ValueError) as error:
        raise ValueError(f"material.{error}") from None


def table_of(material: Material, undetermined: Collection[str] = ()) -> str:
    r"""Return a material as the lines of a table ``[material]``, from which `read_material` gets it back.

    Parameters
    ----------
    material : Material
        Its breakdown strength, if known, must be a number or a `PowerLaw`.
    undetermined : collection of str
        What the measurement of the material did not tell: a comment, so that a number must be found before it is read.

    Raises
    ------
    ValueError
        If the breakdown strength is another function.

    Examples
    --------
    >>> print(table_of(Material(9e4, 2e4, 150.0, name='film "A"')))
    [material]
    name = "film \"A\""
    unrelaxed_modulus = 90000.0  # Pa
    relaxed_modulus = 20000.0  # Pa
    relaxation_time = 150.0  # s
    # relative_permittivity = ...  # not known from tension
    """
    lines = [f"{key} = {_quoted(getattr(material, key))}" for key in ("name", "source") if getattr(material, key)]
    units = ("Pa", "Pa", "s")
    for key, unit in zip(_NUMBERS, units, strict=True):
        if key in undetermined:
            lines.append(f"# {key} = ...  # {unit}; not determined by the curves")
        else:
            lines.append(f"{key} = {getattr(material, key)!r}  # {unit}")
    if material.relative_permittivity is None:
        lines.append("# relative_permittivity = ...  # not known from tension")
    else:
        lines.append(f"relative_permittivity = {material.relative_permittivity!r}")
    strength = material.breakdown_strength
    if isinstance(strength, PowerLaw):
        power = f"{{ at_rest = {strength.at_rest!r}, exponent = {strength.exponent!r} }}"
        lines.append(f"breakdown_strength = {power}  # V/m")
    elif callable(strength):
        raise ValueError(f"breakdown_strength must be a number or a PowerLaw to be written; got {brief(strength)}")
    elif strength is not None:
        lines.append(f"breakdown_strength = {strength!r}  # V/m")
    return "\n".join(["[material]", *lines])


def _quoted(words: str) -> str:
    """Return a string as TOML has it, which is as JSON has it but for one character."""
    return json.dumps(words, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(key: str, value: Any) -> Any:
    if key == "breakdown_strength" and isinstance(value, Mapping):
        check_keys(f"material.{key}", value, ("at_rest", "exponent"))
        for name, number in value.items():
            check_number(f"material.{key}.{name}", number)
        return PowerLaw(float(value["at_rest"]), float(value["exponent"]))
    if key not in {"name", "source"}:
        check_number(f"material.{key}", value)
    return value
