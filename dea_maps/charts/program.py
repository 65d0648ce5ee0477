"""The loading program of a data set as a picture: field against time at the middle of the parameters."""

from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr
from matplotlib.axes import Axes

from ..materials.material import Material
from ..materials.si_units import in_si, one_in_si
from ..program_text import kinds_in, program_of
from ..programs import ENDLESS
from ..sweeps.loading import field_at, loading_time
from .data import check_variables, on_log_axis
from .layout import add_heading, axes_for, line_width
from .units import Shown, title_of, units_of

Floats = npt.NDArray[np.float64]

_SAMPLES = 1200
_BEFORE, _AFTER = 0.06, 1.3
"""Parts of the loading time that are shown before it and up to its end, if it ends."""

_MOST_CYCLES = 3


def program_chart(ds: xr.Dataset, ax: Axes | None = None, *, units: str | None = None, size: str = "column") -> Axes:
    r"""Draw the field against time under the loading program of a data set.

    Of a parameter that varies, the value in the middle is taken; the title says which. Up to three cycles of a repeated
    program are shown.

    Parameters
    ----------
    ds : Dataset
        From `dea_maps.sweep` or `dea_maps.trajectory`, perhaps with `dea_maps.physical`.
    ax, units, size
        As in `dea_maps.charts.phase_diagram`.

    Returns
    -------
    Axes

    Raises
    ------
    TypeError, ValueError
        If the data set does not name its program with all its parameters; if an option is not one of those allowed.

    Examples
    --------
    >>> import dea_maps as dm
    >>> ds = dm.sweep(dm.TriangleTrain(), field=[1.1, 1.3, 1.5], period=2.0, modulus_ratio=4.0)
    >>> program_chart(ds).get_xlabel()
    'time $t/\\tau$'
    """
    check_variables(ds, what="a chart of the program")
    units = units_of(ds, units)
    ax = axes_for(ax, size)
    middle = at_the_middle(ds)
    time, field = course_of(middle)
    horizontal, vertical = Shown(xr.DataArray(time), r"time $t/\tau$", "", ""), Shown(
        xr.DataArray(field), "field $E/E_c$", "", "")  # fmt: skip
    if units == "si":
        material, thickness = _film_of(ds)
        middle, one = in_si(middle, material, thickness), one_in_si(material, thickness)
        kilo = 1e3 if one["field"] * np.abs(field).max() >= 1e3 else 1.0
        horizontal = Shown(one["time"] * horizontal.values, "time (s)", "", "s")
        vertical = Shown(one["field"] / kilo * vertical.values, "voltage (kV)" if kilo > 1.0 else "voltage (V)", "", "")
    x, y = horizontal.values.values, vertical.values.values
    ax.plot(x, y, color="black", linewidth=line_width(ax, 1.4))
    ax.axhline(0.0, color="0.6", linewidth=line_width(ax, 0.6), zorder=0.5)
    ax.set(xlabel=horizontal.label, ylabel=vertical.label, xlim=(x[0], x[-1]))
    add_heading(ax, title_of(middle, units))
    return ax


def small_course(ds: xr.Dataset) -> tuple[Floats, Floats] | None:
    """Return times and fields under the program of a data set for a small picture; None where it is not known."""
    try:
        return course_of(at_the_middle(ds))
    except ValueError:
        return None


def _film_of(ds: xr.Dataset) -> tuple[Material, float]:
    """Return the film of a data set in SI units."""
    names = ("unrelaxed_modulus", "relaxed_modulus", "relaxation_time", "relative_permittivity")
    units = ("_in_Pa", "_in_Pa", "_in_s", "")
    numbers: dict[str, Any] = {name: float(ds.attrs[name + unit]) for name, unit in zip(names, units, strict=True)}
    return Material(**numbers, name=str(ds.attrs["material"])), float(ds.attrs["thickness_in_m"])


def at_the_middle(ds: xr.Dataset) -> xr.Dataset:
    """Return the parameters of a data set at the middle of those that vary, with its attributes.

    The middle is that of the axis of a chart, linear or logarithmic.

    Examples
    --------
    >>> import dea_maps as dm
    >>> ds = dm.sweep(dm.Ramp(), rate=[0.1, 1.0, 10.0], modulus_ratio=[2.0, 4.0])
    >>> {name: float(value) for name, value in at_the_middle(ds).coords.items()}
    {'rate': 1.0, 'modulus_ratio': 3.0}
    """
    coords = {}
    for name in kinds_in(ds.coords, ds.attrs):
        values = np.unique(ds[name].values.astype(np.float64))
        first, last = values[0], values[-1]
        middle = np.sqrt(first * last) if on_log_axis(values) else 0.5 * (first + last)
        coords[name] = ((), first if first == last else middle, ds[name].attrs)
    return xr.Dataset(coords=coords, attrs=ds.attrs)


def course_of(middle: xr.Dataset) -> tuple[Floats, Floats]:
    """Return times in tau and fields in Ec under a program, all of whose parameters have one value.

    Parameters
    ----------
    middle : Dataset
        From `at_the_middle`.

    Raises
    ------
    ValueError
        If it does not name its program, or lacks one of its parameters.

    Examples
    --------
    >>> import dea_maps as dm
    >>> ds = dm.sweep(dm.Pulse(), field=1.5, width=[2.0, 4.0], modulus_ratio=4.0)
    >>> time, field = course_of(at_the_middle(ds))
    >>> float(time[field > 0.0].max().round(1))
    3.0
    """
    program = program_of(middle.attrs)
    needed = (*program.parameters, "modulus_ratio")
    missing = [name for name in needed if name not in middle.coords]
    if missing:
        raise ValueError(f"a chart of the program needs the parameter {missing[0]}; the data set lacks it")
    given = {name: np.array([float(middle[name])]) for name in needed}
    loading = float(loading_time(program, given)[0])
    if loading == 0.0:
        loading = float(1.0 / given["rate"][0]) if "rate" in given else 1.0
    cycle = loading / max(program.repeats, 1)
    shown = min(program.repeats, _MOST_CYCLES) if program.repeats != ENDLESS else _MOST_CYCLES
    end = shown * cycle if program.repeats != 1 else _AFTER * loading
    time = np.linspace(0.0, end, _SAMPLES)
    time[0] = 1e-9 * end  # at 0 itself the field before a jump
    field = field_at(program, given, time)[0]
    return np.concatenate([[-_BEFORE * end, 0.0], time]), np.concatenate([[0.0, 0.0], field])
