"""Specifications: a sweep described in a TOML file."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..atomic import PathLike
from ..checks import brief
from ..csv_tables import read_columns
from ..materials.material import Material
from ..materials.si_units import Film, one_in_si
from ..materials.toml import material_of
from ..nomenclature import KINDS, PARAMETERS, si_name
from ..program_text import piece_of
from ..programs import PROGRAMS, Program, Sequence, Waveform
from ..runs.request import Request
from ..sweeps.chunks import evenly
from ..sweeps.dead_load import has_dead_load
from ..sweeps.grid import kinds_taken
from ..sweeps.methods import choose
from ..sweeps.parameters import check_values
from ..sweeps.ratios import in_ratios
from ..toml_tables import check_keys, check_number, read_toml, unknown, values_of


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

    def request(self, quick: bool = False) -> Request:
        """Return what it asks of a sweep; quick, with few values of every parameter."""
        parameters = thinned(self.parameters) if quick else self.parameters
        return Request(self.program, parameters, **self.accuracy, material=self.material, thickness=self.thickness)


def read_specification(path: PathLike) -> Specification:
    """Read the specification of one film, or of none, see `read_specifications`.

    Raises
    ------
    OSError, ValueError, MemoryError
        As there, and if it has several films.
    """
    first, *others = read_specifications(path)
    if others:
        raise ValueError(f"{path}: [material] must be of one film; got {1 + len(others)} films")
    return first


def read_specifications(path: PathLike) -> list[Specification]:
    r"""Read a specification and check its tables, keys and types, once for every film.

    Parameters
    ----------
    path : str or path-like
        A TOML file with the tables ``[program]``, ``[grid]`` and, optionally, ``[accuracy]`` and ``[material]``, see
        `dea_maps.read_material`, with the ``thickness`` of the film in m; there may be several ``[[material]]``, and
        each thickness may be a list or a range. With a material, ``[grid]`` may have
        ``voltage`` (V) and ``voltage_rate`` (V/s) instead of field and rate, and the modulus ratio may be left out.
        Its ``breakdown_strength`` is a limit on the true field of every film, see `dea_maps.breakdown`.

    Returns
    -------
    list of Specification
        One for each film, or a single one without any.

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
    ...     read_specifications(file)[0].parameters
    {'field': [0.9, 1.1], 'modulus_ratio': 4}
    """
    document = read_toml(path)
    try:
        return _specifications(document, Path(path).parent)
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


def _specifications(document: Mapping[str, Any], folder: Path) -> list[Specification]:
    # By hand: a schema library would name neither the table as the user wrote it nor the name that is nearest.
    check_keys("the file", document, ("program", "grid"), ("accuracy", "material"), noun="table")
    for name, table in document.items():
        if not isinstance(table, dict) and not (name == "material" and isinstance(table, list)):
            raise ValueError(f"{name} must be a table, [{name}]; got {brief(table)}")
    accuracy = document.get("accuracy", {})
    check_keys("[accuracy]", accuracy, (), ("rtol", "method", "formulation", "step"))
    if "rtol" in accuracy and "step" in accuracy:
        raise ValueError("[accuracy] must have rtol or step; got both")
    for key, value in accuracy.items():
        if key in {"rtol", "step"}:
            check_number(f"accuracy.{key}", value)
        elif not isinstance(value, str):
            raise ValueError(f"accuracy.{key} must be a string; got {brief(value)}")
    films = _films(document["material"]) if "material" in document else [None]
    return [_of_film(document, folder, accuracy, film) for film in films]


def _of_film(
    document: Mapping[str, Any], folder: Path, accuracy: Mapping[str, Any], film: Film | None
) -> Specification:
    """Return what the document asks of a film."""
    program = _program(document["program"], {} if film is None else one_in_si(*film), folder)
    parameters = _parameters(program, document["grid"], film)
    defaults = {"method": "auto", "formulation": "auto", "rtol": 1e-6, "step": None}
    choose(program, **{**defaults, **accuracy}, dead_load=has_dead_load(parameters))
    return Specification(program, parameters, dict(accuracy), *(film or ()))


def _program(table: Mapping[str, Any], ones: Mapping[str, float], folder: Path) -> Program:
    """Return the program of a specification; ``ones`` are what its units are worth in SI units, for a film."""
    name = table.get("name")
    if name is not None and (not isinstance(name, str) or name not in PROGRAMS):
        raise ValueError(f"program.name must be one of {', '.join(PROGRAMS)}; got {unknown(name, PROGRAMS)}")
    made = PROGRAMS.get(str(name))
    if made is Sequence:
        return _sequence(table, ones)
    if made is Waveform:
        return _waveform(table, ones, folder)
    check_keys("[program]", table, ("name",))
    return PROGRAMS[table["name"]]()


def _sequence(table: Mapping[str, Any], ones: Mapping[str, float]) -> Sequence:
    check_keys("[program]", table, ("name", "pieces"), ("repeat",))
    if not isinstance(table["pieces"], list):
        raise ValueError(f"program.pieces must be a list of tables; got {brief(table['pieces'])}")
    units = {kind: 1.0 / one for kind, one in ones.items()}
    try:
        numbered = enumerate(table["pieces"], 1)
        pieces = tuple(piece_of(piece, f"program.pieces, piece {number}", units) for number, piece in numbered)
        return Sequence(pieces, table.get("repeat", False))
    except TypeError as error:
        raise ValueError(str(error)) from None


def _waveform(table: Mapping[str, Any], ones: Mapping[str, float], folder: Path) -> Waveform:
    """Return a waveform from a CSV file beside the specification, with the columns time and value."""
    check_keys("[program]", table, ("name", "file"), ("repeat",))
    if not isinstance(table["file"], str):
        raise ValueError(f"program.file must be the name of a CSV file; got {brief(table['file'])}")
    path = folder / table["file"]
    columns = read_columns(path, ("time", "value"))
    times, values = columns["time"] / ones.get("time", 1.0), columns["value"] / ones.get("field", 1.0)
    try:
        return Waveform(times, values, table.get("repeat", False))
    except (TypeError, ValueError) as error:
        raise ValueError(f"{path}: {error}") from None


def _films(given: Any) -> list[Film | None]:
    """Return the films of one table ``[material]``, or of several."""
    tables = given if isinstance(given, list) else [given]
    if not tables:
        raise ValueError("material must be a table, [material], or several; got none")
    films: list[Film | None] = []
    for table in tables:
        material = material_of(table, ("thickness",))
        if material.relative_permittivity is None:
            raise ValueError("[material] must have the key 'relative_permittivity'; it is missing")
        thicknesses = values_of("material.thickness", table["thickness"])
        if not np.size(thicknesses):
            raise ValueError("material.thickness must have at least one value; got none")
        for thickness in np.atleast_1d(thicknesses).tolist():
            if not thickness > 0:
                raise ValueError(f"material.thickness must be above 0, in m; got {thickness}")
            films.append(Film(material, float(thickness)))
    return films


def _parameters(program: Program, table: Mapping[str, Any], film: Film | None) -> dict[str, Any]:
    """Return the parameters of ``[grid]`` as ratios; for a film, its modulus ratio is the default."""
    kinds = kinds_taken(program)
    names = {name: name for name in kinds}
    if film is not None:
        names |= {twin: name for name, kind in kinds.items() if (twin := si_name(name, kind)) is not None}
    others = [key for key in table if key in PARAMETERS and key not in names]
    check_keys("[grid]", table, (), [*names, *others])
    taken = (*program.parameters, "modulus_ratio")
    for key in table:
        if key not in names:
            raise ValueError(f"grid.{key} is not taken by the program {program.name!r}, but {', '.join(taken)}")
        if names[key] in table and names[key] != key:
            raise ValueError(f"[grid] must have {names[key]} or {key}; got both")
    given = {key: values_of(f"grid.{key}", values) for key, values in table.items()}
    for key, values in given.items():
        check_values(key, np.asarray(values, dtype=np.float64), KINDS[kinds[names[key]]])
    found = in_ratios(kinds, given, film)
    if film is not None:
        found.setdefault("modulus_ratio", film.material.modulus_ratio)
    if isinstance(program, Waveform) and film is not None:
        found.setdefault("field", 1.0)  # its values are in volts
    for name in taken:
        if name not in found:
            keys = [key for key, of in names.items() if of == name]
            raise ValueError(f"[grid] must have the key {' or '.join(map(repr, keys))}; it is missing")
    return found
