"""Specifications: a sweep described in a TOML file."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..atomic import PathLike
from ..checks import brief
from ..materials.material import Material
from ..materials.toml import material_of
from ..nomenclature import PARAMETERS
from ..programs import PROGRAMS, Program
from ..sweeps.chunks import evenly
from ..sweeps.methods import choose
from ..sweeps.parameters import BOUNDS, check_values
from ..toml_tables import check_keys, check_number, read_toml, unknown, values_of

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
        If a range asks for more values than it may have.

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
    except (MemoryError, TypeError, ValueError) as error:
        raise type(error)(f"{path}: {error}") from None


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
    choose(program, **{"method": "auto", "formulation": "auto", "rtol": 1e-6, "step": None, **accuracy})
    film = _film(document["material"]) if "material" in document else ()
    return Specification(program, _parameters(program, document["grid"], *film), dict(accuracy), *film)


def _program(name: object) -> Program:
    if not isinstance(name, str) or name not in PROGRAMS:
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


def _parameters(
    program: Program, table: Mapping[str, Any], material: Material | None = None, thickness: float = 0.0
) -> dict[str, Any]:
    """Return the parameters of ``[grid]``; with a material, also those in volts, and its modulus ratio."""
    ones = dict.fromkeys(PARAMETERS, 1.0)
    if material is not None:
        ones["voltage"] = material.critical_field * thickness
        ones["voltage_rate"] = ones["voltage"] / material.relaxation_time
    check_keys("[grid]", table, (), ones)
    taken = (*program.parameters, "modulus_ratio")
    names = {key: IN_VOLTS.get(key, key) for key in table}
    for key, name in names.items():
        if name not in taken:
            raise ValueError(f"grid.{key} is not taken by the program {program.name!r}, but {', '.join(taken)}")
        if name in table and name != key:
            raise ValueError(f"[grid] must have {name} or {key}; got both")
    found = {name: _values(key, name, table[key], ones[key]) for key, name in names.items()}
    if material is not None:
        found.setdefault("modulus_ratio", material.modulus_ratio)
    for name in taken:
        if name not in found:
            keys = [key for key in ones if IN_VOLTS.get(key, key) == name]
            raise ValueError(f"[grid] must have the key {' or '.join(map(repr, keys))}; it is missing")
    return found


def _values(key: str, name: str, given: Any, one: float) -> Any:
    """Return the values of a parameter over what is 1, once they are checked."""
    values = values_of(f"grid.{key}", given)
    check_values(key, np.asarray(values, dtype=np.float64), BOUNDS[name])
    if key == name:
        return values
    with np.errstate(over="ignore", under="ignore"):
        ratios = np.asarray(values, dtype=np.float64) / one
    check_values(f"{key} as a {name}", ratios, BOUNDS[name])
    return ratios
