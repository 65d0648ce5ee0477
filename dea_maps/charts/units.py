"""Quantities as charts show them: in ratios and relaxation times, or in volts and seconds."""

import re
from typing import NamedTuple

import numpy as np
import xarray as xr

from ..nomenclature import NOMENCLATURE, SI_NAMES, axis_label, quantity_of, si_name
from ..printable import chart_text
from ..program_text import kinds_in
from ..programs import PROGRAMS
from .choices import UNITS, check_choice

_WORDS = {
    "voltage": "voltage",
    "voltage_rate": "ramp rate",
    "seconds": "time",
    "seconds_to_failure": "time to failure",
    "seconds_to_breakdown": "time to breakdown",
    "critical_voltage": "voltage at failure",
    "applied_voltage": "voltage",
    "true_field": "true field",
}
_VOLTS = {"field": "voltage"}
"""What is added to the name of a parameter of a kind that does not say it, as a bias."""
_SCALES = {
    "V": ((1e3, "kV"), (1.0, "V")),
    "V s-1": ((1.0, "V/s"),),
    "V m-1": ((1e6, "MV/m"),),
    "s": ((1.0, "s"),),
    "Pa": ((1e3, "kPa"), (1.0, "Pa")),
}
"""For units of variables: the units of charts, and what one is worth."""


class Shown(NamedTuple):
    """A quantity as a chart shows it.

    Attributes
    ----------
    values : DataArray
        In double precision.
    label : str
        Words and symbol or unit, for an axis.
    symbol : str
        For an equation; words where the quantity has none.
    unit : str
        Empty for a plain ratio.
    """

    values: xr.DataArray
    label: str
    symbol: str
    unit: str

    def equation(self) -> str:
        """Return the symbol, or else the words, and the value, which must be one."""
        return f"{self.symbol or self.label} = {self.in_words(float(self.values.values.flat[0]))}"

    def per(self, plain: xr.DataArray) -> float:
        """Return what 1 of the same quantity is worth here, as `plain` has it."""
        greatest = float(np.abs(plain).max())
        return float(np.abs(self.values).max()) / greatest if greatest > 0.0 else 1.0

    def in_words(self, value: float) -> str:
        """Return a value, in the unit of this quantity, with the unit."""
        return f"{value:.4g} {self.unit}".rstrip()


def units_of(ds: xr.Dataset, units: str | None) -> str:
    """Return the units of a chart.

    Parameters
    ----------
    ds : Dataset
        What is drawn.
    units : {"tau", "si"} or None
        Those asked for; None for SI units where the data set has them.

    Raises
    ------
    ValueError
        If it is something else, or the data set has no SI units.
    """
    kinds = kinds_in(ds.coords, ds.attrs)
    has_si = any(si_name(name, kinds.get(name)) in ds.variables for name in (*kinds, *SI_NAMES))
    if units is None:
        return "si" if has_si else "tau"
    check_choice("units", units, UNITS)
    if units == "si" and not has_si:
        raise ValueError("units must be tau for a data set without volts and seconds, see dm.physical; got 'si'")
    return units


def shown(ds: xr.Dataset, name: str, units: str) -> Shown:
    """Return a parameter or variable as a chart shows it.

    Parameters
    ----------
    ds : Dataset
        With the variable `name`.
    name : str
        The dimensionless one, or any other with ``long_name`` and ``units``.
    units : {"tau", "si"}
        Whether to show, where the data set has it, what it means in SI units.

    Examples
    --------
    >>> import dea_maps as dm
    >>> ds = dm.physical(dm.sweep(dm.Step(), field=[1.1, 1.2], modulus_ratio=4), dm.VHB, 100e-6)
    >>> shown(ds, "field", "si").label, shown(ds, "field", "tau").label
    ('voltage (kV)', 'field $E/E_c$')
    """
    kinds, plain, words = kinds_in(ds.coords, ds.attrs), name, ""
    twin = si_name(name, kinds.get(name))
    if units == "si" and twin is not None and twin in ds.variables:
        name = twin
    values = ds[name].astype(np.float64)
    if name in NOMENCLATURE or name in kinds:
        quantity = quantity_of(name)
        return Shown(values, axis_label(name), quantity.symbol or quantity.label, "")
    greatest = float(np.abs(values).max()) if values.size else 0.0
    if name == twin and plain in kinds:
        of_kind = _VOLTS.get(kinds[plain], "")
        words = quantity_of(plain).label.replace("field", "voltage")
        words += "" if of_kind in words else f" {of_kind}"
    words = _WORDS.get(name, words or chart_text(ds[name].attrs.get("long_name", name.replace("_", " "))))
    unit = chart_text(ds[name].attrs.get("units", "1"))
    scales = _SCALES.get(unit, ((1.0, "" if unit == "1" else unit),))
    factor, unit = next((scale for scale in scales if scale[0] <= greatest), scales[-1])
    return Shown(values / factor, f"{words} ({unit})" if unit else words, words, unit)


def title_of(ds: xr.Dataset, units: str) -> list[str]:
    """Return in words the loading program, what is the same in all of a data set, and in SI units of what film.

    Parameters
    ----------
    ds : Dataset
        What is drawn.
    units : {"tau", "si"}
        Of the chart.
    """
    fixed = [shown(ds, name, units).equation() for name in kinds_in(ds.coords, ds.attrs) if ds[name].size == 1]
    if "relaxed_threshold" in ds.coords and ds["relaxed_threshold"].size == 1:
        fixed.append(f"relaxed threshold {float(ds['relaxed_threshold'].values.flat[0]):.4g} $E_c$")
    film = []
    if units == "si" and "thickness_in_m" in ds.attrs:
        film = [chart_text(ds.attrs["material"])] if ds.attrs.get("material") else []
        film.append(f"{float(ds.attrs['thickness_in_m']) * 1e6:.4g} µm")
    named = PROGRAMS.get(str(ds.attrs.get("program", "")))
    program = [] if named is None else [named.words]
    if units == "si":
        program = [words.replace("field", "voltage") for words in program]
    return [*program, *fixed, *film]


def micrometres(name: str) -> str:
    """Return the name of a film with the sign of the micrometre, which files spell in ASCII.

    Examples
    --------
    >>> micrometres("VHB, 100 um")
    'VHB, 100 µm'
    """
    return re.sub(r"(?<=\d) um\b", " µm", name)


def time_in_words(time: float, unit: str) -> str:
    """Return a round time with its unit.

    Examples
    --------
    >>> time_in_words(20.0, "s"), time_in_words(1e6, "")
    ('20 s', '$10^{6}$')
    """
    number = f"{time:g}" if 1e-3 <= time < 1e5 else f"$10^{{{np.log10(time):.0f}}}$"
    return f"{number} {unit}".rstrip()
