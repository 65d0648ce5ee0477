"""Parameters as ratios: those given in SI units, for a film, by the names that follow from their kinds."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from ..checks import brief, in_units
from ..materials.si_units import Film, one_in_si
from ..nomenclature import KINDS
from .parameters import as_data_array, check_values


def in_ratios(kinds: Mapping[str, str], given: Mapping[str, Any], film: Film | None) -> dict[str, Any]:
    """Return parameters by their dimensionless names, those in SI units divided by what 1 is for a film.

    Parameters
    ----------
    kinds : mapping of str to str
        The parameters that there may be, and the kind of each, a key of `dea_maps.nomenclature.KINDS`.
    given : mapping
        Parameters by name, as ``field``, or by that of their twin in SI units, as ``voltage``: numbers, arrays,
        DataArrays, or quantities with units, as of pint; None counts as left out. Unknown names are passed on. An array
        in SI units has the dimension that the ratio would have, and a dimension ``voltage`` becomes ``field``.
    film : Film or None
        What the volts and seconds are for.

    Raises
    ------
    TypeError, ValueError
        If a quantity is given twice, or in SI units without a film; if a value is of the wrong kind, out of bounds, or
        in units that do not convert.

    Examples
    --------
    >>> from dea_maps import VHB
    >>> one = one_in_si(VHB, 100e-6)["field"]
    >>> in_ratios({"field": "field"}, {"voltage": [one, 2.0 * one]}, Film(VHB, 100e-6))
    {'field': array([1., 2.])}
    """
    there = {name: value for name, value in given.items() if value is not None}
    twins = {twin: name for name, kind in kinds.items() if (twin := KINDS[kind].twin(name)) and twin not in kinds}
    renamed = {twin: twins[twin] for twin in there if twin in twins}
    found: dict[str, Any] = {}
    for name, value in there.items():
        plain = twins.get(name, name)
        if plain != name and plain in there:
            raise ValueError(f"{plain} and {name} must not both be given: they are the same quantity")
        if plain == name:
            found[name] = in_units(name, value, "1") if name in kinds else value
        elif film is None:
            units = KINDS[kinds[plain]].si_units.replace(" s-1", "/s")
            raise ValueError(f"{name} = {brief(value)} is in {units}: material and thickness are missing")
        else:
            found[plain] = _ratio(name, plain, kinds[plain], value, one_in_si(*film)[kinds[plain]])
    return {name: _with_dimensions(value, renamed) for name, value in found.items()}


def _ratio(name: str, plain: str, kind: str, value: Any, one: float) -> Any:
    """Return a quantity in SI units over what 1 is, once it is checked."""
    units = KINDS[kind].si_units
    array = as_data_array(name, in_units(name, value, units), kind, units)
    with np.errstate(over="ignore", under="ignore"):
        ratios = array.values / one
    check_values(f"{name} as a {plain}", ratios, KINDS[kind])
    if not isinstance(value, xr.DataArray):
        return ratios if ratios.ndim else float(ratios)
    found = array.copy(data=ratios)
    found.attrs = {key: known for key, known in value.attrs.items() if key not in {"units", "long_name"}}
    return found


def _with_dimensions(value: Any, renamed: Mapping[str, str]) -> Any:
    """Return an array whose dimensions in SI units have the names of ratios, without coordinates in SI units."""
    if not isinstance(value, xr.DataArray):
        return value
    array = value.drop_vars([name for name in renamed if name in value.coords])
    return array.rename({name: plain for name, plain in renamed.items() if name in array.dims})
