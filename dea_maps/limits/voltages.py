"""Design answers: the allowable voltage of a film, for how long, and the strain that it gives."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from .. import __version__
from ..atomic import PathLike
from ..checks import brief
from ..materials.material import Material
from ..materials.si_units import check_film, warn_film
from ..materials.toml import material_of
from ..outcomes import Limit, Outcome, flag_attributes, words_of
from ..plausibility import warn_implausible
from ..printable import printable
from ..programs import Step
from ..sweeps.dead_load import critical_stretch, film_of
from ..sweeps.parameters import ParameterLike
from ..sweeps.solve import solve_auto
from ..toml_tables import check_keys, check_number, read_toml, values_of
from .answers import broadcast
from .inverse import allowable_field
from .passage import stretch_at

Array = npt.NDArray[np.float64]

_QUANTITIES = {
    "allowable_voltage": ("largest constant voltage that the film sustains without failure for the holding time", "V"),
    "allowable_field": ("nominal electric field under that voltage", "V m-1"),
    "true_field": ("true electric field at the end of the holding time", "V m-1"),
    "stretch": ("equibiaxial stretch at the end of the holding time", "1"),
    "area_strain": ("area strain at the end of the holding time", "1"),
}


def design(
    material: Material,
    thickness: ParameterLike,
    holding_time: ParameterLike,
    rtol: float = 1e-6,
    *,
    prestretch: float | None = None,
    nominal_stress: float | None = None,
) -> xr.Dataset:
    """Find the allowable voltages of films of a material for given times, and how far the films stretch.

    Electromechanical instability limits them, and electrical breakdown too, if the material knows its breakdown
    strength; see `dea_maps.allowable_field`. The answers are limits: how far a design keeps from them is its choice.

    Parameters
    ----------
    material : Material
        With a known permittivity.
    thickness : number or 1-D array
        Of undeformed films, in m, above 0.
    holding_time : number or 1-D array
        In s, above 0; may be infinite.
    rtol : float
        Relative error allowed in the voltage, from 1e-10 to 1e-3.
    prestretch : float, optional
        Stretch, at least 1, to which films relaxed under a dead load before the voltage.
    nominal_stress : float, optional
        Dead load in Pa, equal in both directions, applied to the fresh film with the voltage; at most one of the two.

    Returns
    -------
    Dataset
        Over ``film`` and ``holding_time``: ``allowable_voltage`` (V), ``allowable_field`` (nominal, V/m), and at the
        end of the holding time ``true_field`` (V/m), ``stretch``, from the unstretched film, and ``area_strain``, from
        the film that was pre-stretched, if it was; ``limit``, CF flags for what limits the voltage. NaN where that
        could not be found as accurately as asked. The sets of several materials can be joined by
        ``xarray.concat(sets, "film")``.

    Raises
    ------
    TypeError, ValueError
        If something is of the wrong kind or out of bounds.

    Warns
    -----
    ImplausibleWarning
        Names what is implausible of the films or the times: its unit may be another one.

    Examples
    --------
    >>> import dea_maps as dm
    >>> ds = dm.design(dm.VHB, [50e-6, 100e-6], [1.0, 3600.0])
    >>> ds.film.values.tolist(), ds.allowable_voltage.values.round().tolist()
    (['VHB, 50 um', 'VHB, 100 um'], [[1566.0, 818.0], [3133.0, 1636.0]])
    """
    (hold,) = broadcast(holding_time=(holding_time, 0.0, True))
    (thick,) = broadcast(thickness=(thickness, 0.0, False))
    times, thicknesses = np.atleast_1d(hold.values), np.atleast_1d(thick.values)
    for H in thicknesses.ravel():
        check_film(material, float(H))
    if times.ndim > 1 or thicknesses.ndim > 1:
        raise ValueError(f"thickness and holding_time must be 1-D at most; got shapes {thick.shape} and {hold.shape}")
    if not (times > 0.0).all():
        raise ValueError(f"holding_time must be above 0, in s; got {times.min()}")
    warn_film(material, thicknesses)
    warn_implausible("holding_time", times)
    strength = None if material.breakdown_strength is None else material.strength
    asked = xr.DataArray(times / material.relaxation_time, dims="holding_time")
    film: dict[str, float] = {"modulus_ratio": material.modulus_ratio}
    if prestretch is not None:
        film["prestretch"] = _load("prestretch", prestretch, 1.0)
    if nominal_stress is not None:
        film["stress"] = _load("nominal_stress", nominal_stress, 0.0) / material.relaxed_modulus
    if len(film) > 2:
        raise ValueError("prestretch and nominal_stress must not both be given: either stands for the dead load")
    found = allowable_field(asked, rtol=rtol, strength=strength, **film)
    field = found["allowable_field"].values
    limit = (
        found["limit"].values if "limit" in found else np.where(np.isnan(field), Limit.UNRESOLVED, Limit.INSTABILITY)
    )
    stretch = _farthest(material, film, field, times, limit, rtol)
    nominal = field * material.critical_field
    one_film = {
        "allowable_field": nominal,
        "true_field": nominal * stretch**2,
        "stretch": stretch,
        "area_strain": (stretch / film.get("prestretch", 1.0)) ** 2 - 1.0,
    }
    shape = (thicknesses.size, times.size)
    values = {"allowable_voltage": np.outer(thicknesses, nominal)}
    values |= {name: np.broadcast_to(array, shape).copy() for name, array in one_film.items()}
    dims = ("film", "holding_time")
    ds = xr.Dataset()
    for name, (words, units) in _QUANTITIES.items():
        ds[name] = (dims, values[name], {"long_name": words, "units": units})
    what = {"long_name": "what limits the voltage", "units": "1", **flag_attributes(Limit)}
    ds["limit"] = (dims, np.broadcast_to(limit, shape).astype(np.int8), what)
    name = material.name or "film"
    films = [f"{name}, {1e6 * H:g} um" for H in thicknesses]
    ds = ds.assign_coords(
        film=("film", films, {"long_name": "film"}),
        thickness=("film", thicknesses, {"long_name": "thickness of the undeformed film", "units": "m"}),
        material=("film", [name] * len(films), {"long_name": "material"}),
        relaxed_critical_field=(
            "film",
            [material.critical_field] * len(films),
            {"long_name": "nominal field that the film sustains indefinitely", "units": "V m-1"},
        ),
        holding_time=("holding_time", times, {"long_name": "time for which the voltage is held", "units": "s"}),
    )
    ds.attrs = {
        "Conventions": "CF-1.11, ACDD-1.3",
        "title": "Allowable voltages of dielectric-elastomer actuators",
        "source": f"dea_maps {__version__}, root finding on the model of Zhao, Koh, Suo (2011)",
        "dea_maps_version": __version__,
        "history": f"dea_maps {__version__}: design of {', '.join(films)}",
        "rtol": rtol,
    }
    for name in ("holding_time", "thickness"):
        ds[name].encoding["_FillValue"] = None
    return ds


def _load(name: str, value: object, lowest: float) -> float:
    """Return a dead load after checking it."""
    check_number(name, value)
    assert isinstance(value, int | float)
    if not lowest <= value < np.inf:
        raise ValueError(f"{name} must be finite and at least {lowest:g}; got {value}")
    return float(value)


def _farthest(
    material: Material, film: Mapping[str, float], field: Array, times: Array, limit: npt.NDArray[np.int8], rtol: float
) -> Array:
    """Return the stretch of films at their allowable field."""
    known = ~np.isnan(field)
    cells = {name: np.full(known.sum(), value) for name, value in film.items()}
    load = film_of(cells)[2]
    ends = solve_auto(Step(), {"field": field[known], **cells}, rtol)
    stretch = np.full(field.shape, np.nan)
    stretch[known] = np.where(ends.outcome == Outcome.SURVIVES, ends.final_stretch, ends.critical_stretch)
    indefinite = known & np.isinf(times)  # up to the relaxed threshold itself
    stretch[indefinite] = critical_stretch(np.ones_like(load), np.ones_like(load), load)[indefinite[known]]
    broken = limit == Limit.BREAKDOWN
    if broken.any():
        stretch[broken] = stretch_at(material.strength, field[broken], stretch[broken])
    return stretch


def read_design(path: PathLike) -> xr.Dataset:
    r"""Read the specification of a design, and answer it.

    Parameters
    ----------
    path : str or path-like
        A TOML file with ``[material]``, see `dea_maps.read_material`, or several ``[[material]]``, each with
        ``thickness`` (m; a number, a list or a range), and ``[design]`` with ``holding_time`` (s; likewise, also
        ``inf``) and, optionally, ``rtol`` and a dead load, ``prestretch`` or ``nominal_stress`` (Pa).

    Returns
    -------
    Dataset
        As from `design`.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is not TOML, or something is missing, unknown or not allowed; with the name of the file.

    Examples
    --------
    >>> import dea_maps as dm, os, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = os.path.join(folder, "design.toml")
    ...     with open(path, "w") as file:
    ...         _ = file.write('[material]\npreset = "VHB"\nthickness = 50e-6\n[design]\nholding_time = [1, 3600, inf]')
    ...     dm.read_design(path).allowable_voltage.values.round().tolist()
    [[1566.0, 818.0, 804.0]]
    """
    document = read_toml(path)
    try:
        return _designed(document)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{path}: {error}") from None


def _designed(document: Mapping[str, Any]) -> xr.Dataset:
    check_keys("the file", document, ("material", "design"), noun="table")
    table = document["design"]
    if not isinstance(table, dict):
        raise ValueError(f"design must be a table, [design]; got {brief(table)}")
    check_keys("[design]", table, ("holding_time",), ("rtol", "prestretch", "nominal_stress"))
    load = {name: table[name] for name in ("prestretch", "nominal_stress") if name in table}
    rtol = table.get("rtol", 1e-6)
    check_number("design.rtol", rtol)
    given = [np.inf] if table["holding_time"] == np.inf else table["holding_time"]
    indefinite = [time for time in given if time == np.inf][:1] if isinstance(given, list) else []
    finite = [time for time in given if time != np.inf] if indefinite else given
    times = [] if finite == [] and indefinite else values_of("design.holding_time", finite)
    times = np.append(np.asarray(times, dtype=np.float64), indefinite)
    tables = document["material"] if isinstance(document["material"], list) else [document["material"]]
    sets = []
    for table in tables:
        material = material_of(table, ("thickness",))
        thickness = np.atleast_1d(np.asarray(values_of("material.thickness", table["thickness"]), dtype=np.float64))
        sets.append(design(material, thickness, times, rtol, **load))
    return xr.concat(sets, "film", combine_attrs="override")


def describe_design(ds: xr.Dataset) -> str:
    """Return a design as a table for a terminal.

    Examples
    --------
    >>> import dea_maps as dm
    >>> print(describe_design(dm.design(dm.VHB, 50e-6, [1.0, 3600.0])))
    film        held    voltage      field     E/Ec  true field  stretch  area strain  limited by
    VHB, 50 um   1 s   1.566 kV  31.3 MV/m  1.95 Ec   50.1 MV/m    1.265         60 %  instability
    VHB, 50 um   1 h  0.8181 kV  16.4 MV/m  1.02 Ec   53.7 MV/m    1.812        228 %  instability
    """
    rows = [("film", "held", "voltage", "field", "E/Ec", "true field", "stretch", "area strain", "limited by")]
    for film in ds["film"].values:
        critical = float(ds["relaxed_critical_field"].sel(film=film))
        for index, time in enumerate(ds["holding_time"].values):
            cell = {name: ds[name].sel(film=film).values[index] for name in (*_QUANTITIES, "limit")}
            rows.append(
                (
                    printable(film),
                    time_in_words(float(time)),
                    f"{1e-3 * cell['allowable_voltage']:.4g} kV",
                    f"{1e-6 * cell['allowable_field']:.3g} MV/m",
                    f"{cell['allowable_field'] / critical:.3g} Ec",
                    f"{1e-6 * cell['true_field']:.3g} MV/m",
                    f"{cell['stretch']:.3f}",
                    f"{100.0 * cell['area_strain']:.0f} %",
                    words_of(Limit)[int(cell["limit"])],
                )
            )
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    first, *middle, last = range(len(widths))
    return "\n".join(
        "  ".join(
            [row[first].ljust(widths[first]), *(row[column].rjust(widths[column]) for column in middle), row[last]]
        )
        for row in rows
    )


def time_in_words(seconds: float) -> str:
    """Return a time in the unit in which its number is short.

    Examples
    --------
    >>> [time_in_words(seconds) for seconds in (0.5, 90.0, 349.0, 7200.0, 3650 * 86400.0, np.inf)]
    ['0.5 s', '90 s', '5.82 min', '2 h', '3650 d', 'indefinitely']
    """
    if np.isinf(seconds):
        return "indefinitely"
    lengths = {"d": 86400.0, "h": 3600.0, "min": 60.0, "s": 1.0}
    unit = next((unit for unit, length in lengths.items() if seconds >= 2 * length or seconds == length), "s")
    number = seconds / lengths[unit]
    return f"{number:.0f} {unit}" if number >= 100.0 else f"{number:.3g} {unit}"
