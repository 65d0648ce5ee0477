"""What voltages and rates are for a film, in all the units that its users think in: one line that shows a slip."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..printable import printable
from ..program_text import kinds_in
from .material import Material

_METRES = ((1.0, "m"), (1e-3, "mm"), (1e-6, "um"))
_VOLTS = ((1e3, "kV"), (1.0, "V"))
_FIELDS = ((1e6, "MV/m"), (1e3, "kV/m"), (1.0, "V/m"))


def scales(material: Material, thickness: float, **fields: npt.ArrayLike) -> str:
    """Return a thickness, and fields or rates in volts, volts per metre and critical fields.

    Parameters
    ----------
    material : Material
        With a known permittivity.
    thickness : float
        In m.
    **fields : number or ndarray
        ``field`` normalised by the relaxed critical field, ``rate`` in that per relaxation time: the least and the
        greatest are shown. Without any, what the relaxed critical field is.

    Examples
    --------
    >>> from dea_maps import VHB
    >>> scales(VHB, 100e-6, field=1.3675)
    'VHB, 100 um, 2.2 kV = 22 MV/m = 1.37 Ec'
    >>> scales(VHB, 100e-6)
    'VHB, 100 um, 1.61 kV = 16.1 MV/m = 1 Ec'
    >>> scales(VHB, 100e-6, rate=[0.5, 1.0])
    'VHB, 100 um, 4.02 to 8.04 V/s = 40.2 to 80.4 kV/m/s = 0.5 to 1 Ec per 200 s'
    """
    ends = {name: _ends(values) for name, values in (fields or {"field": 1.0}).items()}
    words = [*([material.name] if material.name else []), _with_unit([thickness], _METRES)]
    for name, values in ends.items():
        if not values:
            continue
        per, tau, second = ("", 1.0, "") if name == "field" else ("/s", material.relaxation_time, " per ")
        nominal = [value * material.critical_field / tau for value in values]
        volts = _with_unit([value * thickness for value in nominal], _VOLTS) + per
        ratio = _with_unit(values, ((1.0, "Ec"),)) + (f"{second}{tau:.3g} s" if second else "")
        words.append(f"{volts} = {_with_unit(nominal, _FIELDS)}{per} = {ratio}")
    return printable(", ".join(words))


def scales_of(ds: xr.Dataset) -> str | None:
    """Return the scales of a map in volts and seconds, from its attributes; None if it is of no film.

    Examples
    --------
    >>> import dea_maps as dm
    >>> scales_of(dm.physical(dm.sweep(dm.Step(), field=[1.0, 1.2], modulus_ratio=4.0), dm.VHB, 1e-3))
    'VHB, 1 mm, 16.1 to 19.3 kV = 16.1 to 19.3 MV/m = 1 to 1.2 Ec'
    """
    if "thickness_in_m" not in ds.attrs:
        return None
    stiff, soft, tau, permittivity = (float(ds.attrs[name]) for name in _NUMBERS)
    material = Material(stiff, soft, tau, permittivity, str(ds.attrs.get("material", "")))
    kinds = kinds_in(ds.coords, ds.attrs)
    among = {kind: [ds[name].values.ravel() for name in kinds if kinds[name] == kind] for kind in ("field", "rate")}
    given = {kind: np.concatenate(values) for kind, values in among.items() if values}
    return scales(material, float(ds.attrs["thickness_in_m"]), **given)


_NUMBERS = ("unrelaxed_modulus_in_Pa", "relaxed_modulus_in_Pa", "relaxation_time_in_s", "relative_permittivity")


def _ends(values: npt.ArrayLike) -> list[float]:
    """Return the least and the greatest of some values, one number where they are the same."""
    array = np.asarray(values, dtype=np.float64)
    return sorted({float(array.min()), float(array.max())}) if array.size else []


def _with_unit(values: Sequence[float], units: Sequence[tuple[float, str]]) -> str:
    """Return one or two numbers in the largest unit of which the greatest has at least one."""
    one, unit = next((scale for scale in units if values[-1] >= scale[0] * (1.0 - 1e-9)), units[-1])
    return f"{' to '.join(f'{value / one:.3g}' for value in values)} {unit}"
