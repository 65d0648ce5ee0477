"""Specifications: a sweep described in a TOML file."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .cuts import evenly
from .material import Material
from .material_table import material_of
from .nomenclature import PARAMETERS
from .parameters import BOUNDS, brief, check_values
from .programs import PROGRAMS, Program
from .storage import PathLike
from .tables import check_keys, check_number, read_toml, unknown, values_of

IN_VOLTS = {"voltage": "field", "voltage_rate": "rate"}
"""What ``[grid]`` may have in V and V/s where there is a material, and the parameters that they give."""


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
    material : Material or None
        What ``[material]`` gives, with a known permittivity.
    thickness : float or None
        In m; what ``[material]`` gives.
    """

    program: Program
    parameters: dict[str, Any]
    accuracy: dict[str, Any]
    material: Material | None = None
    thickness: float | None = None


def read_specification(path: PathLike) -> Specification:
    r"""Read a specification and check its tables, keys and types.

    What values the parameters may have is for `dea_maps.grid.make_grid` to say.

    Parameters
    ----------
    path : str or path-like
        A TOML file with the tables ``[program]``, ``[grid]`` and, optionally, ``[accuracy]`` and ``[material]``, see
        `dea_maps.read_material`, with the ``thickness`` of the film in m. With a material, ``[grid]`` may have
        ``voltage`` (V) and ``voltage_rate`` (V/s) instead of field and rate, and the modulus ratio may be left out.
        Its ``breakdown_strength`` is a limit on the true field of every film, see `dea_maps.breakdown`.

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
    >>> from pathlib import Path
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "step.toml")
    ...     _ = file.write_text('[program]\nname = "step"\n[grid]\nfield = [0.9, 1.1]\nmodulus_ratio = 4')
    ...     read_specification(file).parameters
    {'field': [0.9, 1.1], 'modulus_ratio': 4}
    """
    document = read_toml(path)
    try:
        return _specification(document)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


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
            fewer[name] = [values[i] for i in evenly(len(values), most)]
    return fewer


def _specification(document: Mapping[str, Any]) -> Specification:
    check_keys("the file", document, ("program", "grid"), ("accuracy", "material"), noun="table")
    for name, table in document.items():
        if not isinstance(table, dict):
            raise ValueError(f"{name} must be a table, [{name}]; got {brief(table)}")
    check_keys("[program]", document["program"], ("name",))
    accuracy = document.get("accuracy", {})
    check_keys("[accuracy]", accuracy, (), ("rtol", "method", "formulation", "step"))
    if "rtol" in accuracy and "step" in accuracy:
        raise ValueError("[accuracy] must have rtol or step; got both")
    for key, value in accuracy.items():
        if key in {"rtol", "step"}:
            check_number(f"accuracy.{key}", value)
        elif not isinstance(value, str):
            raise ValueError(f"accuracy.{key} must be a string; got {brief(value)}")
    program = _program(document["program"]["name"])
    if "material" not in document:
        return Specification(program, _parameters(document["grid"]), dict(accuracy))
    film = _film(document["material"])
    return Specification(program, _parameters(document["grid"], *film), dict(accuracy), *film)


def _program(name: object) -> Program:
    if name not in PROGRAMS or not isinstance(name, str):
        raise ValueError(f"program.name must be one of {', '.join(PROGRAMS)}; got {unknown(name, PROGRAMS)}")
    return PROGRAMS[name]()


def _film(table: Any) -> tuple[Material, float]:
    material = material_of(table, ("thickness",))
    check_number("material.thickness", table["thickness"])
    if not table["thickness"] > 0:
        raise ValueError(f"material.thickness must be above 0, in m; got {table['thickness']}")
    if material.relative_permittivity is None:
        raise ValueError("[material] must have the key 'relative_permittivity'; it is missing")
    return material, float(table["thickness"])


def _parameters(table: Mapping[str, Any], material: Material | None = None, thickness: float = 0.0) -> dict[str, Any]:
    """Return the parameters of ``[grid]``; with a material, also those in volts, and its modulus ratio."""
    if material is None:
        check_keys("[grid]", table, (), PARAMETERS)
        return {name: _values(name, name, given, 1.0) for name, given in table.items()}
    of_one = {"voltage": material.critical_field * thickness}
    of_one["voltage_rate"] = of_one["voltage"] / material.relaxation_time
    check_keys("[grid]", table, (), (*PARAMETERS, *IN_VOLTS))
    found = {}
    for key, given in table.items():
        name = IN_VOLTS.get(key, key)
        if name in found:
            raise ValueError(f"[grid] must have {name} or {key}; got both")
        found[name] = _values(key, name, given, of_one.get(key, 1.0))
    return {**found, "modulus_ratio": found.get("modulus_ratio", material.modulus_ratio)}


def _values(key: str, name: str, given: Any, unit: float) -> Any:
    """Return the values of a parameter over what is 1, once they are checked."""
    values = values_of(f"grid.{key}", given)
    check_values(key, np.asarray(values, dtype=np.float64), BOUNDS[name])
    if key == name:
        return values
    return np.asarray(values, dtype=np.float64) / unit
