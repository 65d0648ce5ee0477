"""What a page to explore shows: the cells of a map, thinned where there are many, and their values in columns."""

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..charts.data import cell_edges, drawable, log_spaced, parameters_along, sizes_in_words
from ..charts.plane import BREAKS_DOWN, regions_of
from ..materials.material import Material
from ..nomenclature import KINDS, quantity_of, si_name
from ..outcomes import Outcome
from ..program_text import kinds_in, program_of
from ..programs import PROGRAMS, Program, shape_of
from ..sweeps.chunks import evenly
from ..sweeps.parameters import check_values

Floats = npt.NDArray[np.float64]

SHOWN = (
    "time_to_failure",
    "seconds_to_failure",
    "critical_stretch",
    "critical_field",
    "critical_voltage",
    "critical_true_field",
    "time_to_breakdown",
    "seconds_to_breakdown",
    "breakdown_stretch",
    "breakdown_field",
    "breakdown_voltage",
    "breakdown_true_field",
    "final_stretch",
    "largest_stretch",
    "cycles_to_failure",
    "steady_stretch_max",
    "steady_stretch_min",
)
"""The variables that a page shows where the map has them, in this order."""

RTOL = 1e-4
"""Relative error allowed in the stretches of the curves: less than can be seen."""

REPETITIONS = 3
"""Repetitions of a program that are followed at most."""

MOST_SLICES, MOST_ALONG = 20, 400
"""Values on a slider, and along an axis: more would not be told apart."""

FEWEST = 400
"""Cells of a map, at least, before values on the sliders are left out, where there are several sliders."""

# Of all values and curves before compression, which makes them four times smaller or more; beside 1.3 MB of library.
_BYTES = 9_000_000
_PLACES = 10  # columns of edges and parameters, at most
_POINTS_RISING, _POINTS = 40, 96

_IN_UNICODE = {
    "$": "",
    r"\,": " ",
    r"\mu": "μ",
    r"\tau": "τ",
    r"\lambda": "λ",
    r"\infty": "∞",
    r"\xi": "ξ",
    r"\max": "max",
    r"\min": "min",
}
_IN_UNICODE |= dict.fromkeys("_{}", "")


_FILM = (
    "unrelaxed_modulus_in_Pa",
    "relaxed_modulus_in_Pa",
    "relaxation_time_in_s",
    "relative_permittivity",
    "thickness_in_m",
)
"""Attributes of a map in SI units."""


class Axis(NamedTuple):
    """A parameter that varies over the map.

    Attributes
    ----------
    name : str
        The parameter.
    total : int
        How many different values the map has, of which `values` are some.
    values : dict of str to (n,) ndarray
        By the name of the parameter and, where the map has it, of what it is in SI units; rising.
    """

    name: str
    total: int
    values: dict[str, Floats]

    @property
    def shown(self) -> str:
        """What stands for the parameter on the page: itself, or what it is in SI units."""
        return next(reversed(self.values))

    @property
    def number(self) -> int:
        """How many values the page shows."""
        return len(self.values[self.name])


class Cells(NamedTuple):
    """The cells that a page shows.

    Attributes
    ----------
    program : Program
        The loading program.
    x : Axis
        To the right.
    y : Axis or None
        Upwards; None for a map over one parameter.
    across : tuple of Axis
        On the sliders; none for a map over fewer than three parameters.
    ds : Dataset
        Their values, in memory: the dimensions are those of `across`, `y` and `x`, as far as there are any. The outcome
        is `BREAKS_DOWN` where electrical breakdown comes first, and there is no time to failure.
    """

    program: Program
    x: Axis
    y: Axis | None
    across: tuple[Axis, ...]
    ds: xr.Dataset

    @property
    def axes(self) -> tuple[Axis, ...]:
        """All that varies, in the order of the dimensions of `ds`."""
        return tuple(axis for axis in (*self.across, self.y, self.x) if axis is not None)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of slices, rows and columns."""
        return math.prod(axis.number for axis in self.across), 1 if self.y is None else self.y.number, self.x.number

    @property
    def points(self) -> int:
        """Number of points of the curve of a film."""
        return points_of(self.program)

    @property
    def volts(self) -> float | None:
        """What the relaxed critical field is in V where the page shows times in s."""
        if self.seconds is None:
            return None
        unrelaxed, relaxed, time, permittivity, thickness = (float(self.ds.attrs[name]) for name in _FILM)
        return Material(unrelaxed, relaxed, time, permittivity).critical_field * thickness

    @property
    def seconds(self) -> float | None:
        """The relaxation time in s where the page shows times in s."""
        known = "seconds_to_failure" in self.ds and {"material", *_FILM} <= self.ds.attrs.keys()
        return float(self.ds.attrs["relaxation_time_in_s"]) if known else None

    @property
    def times_shown(self) -> dict[int, str]:
        """The names of the variables in the colours, by the outcome."""
        unit = "time" if self.seconds is None else "seconds"
        shown = {Outcome.FAILS_LATER: f"{unit}_to_failure", BREAKS_DOWN: f"{unit}_to_breakdown"}
        return {outcome: name for outcome, name in shown.items() if name in self.ds}


def cells_of(ds: xr.Dataset) -> Cells:
    """Choose the cells of a map that a page shows, and read their values.

    The two longest dimensions span the map, the first of equally long ones; the others go to sliders. Of too many
    values along a dimension some are taken, evenly spread from the first to the last.

    Parameters
    ----------
    ds : Dataset
        From a sweep, perhaps with what `dea_maps.physical` adds.

    Returns
    -------
    Cells

    Raises
    ------
    TypeError, ValueError
        If it is not the map of a sweep over one parameter or more.

    Examples
    --------
    >>> import dea_maps as dm
    >>> ds = dm.sweep(dm.RampHold(), field=[1.1, 1.2, 1.3, 1.4], rate=[1.0, 2.0, 9.0], modulus_ratio=[4.0, 2.0])
    >>> cells = cells_of(ds)
    >>> cells.shape, cells.across[0].name, cells.across[0].values["modulus_ratio"].tolist()
    ((2, 3, 4), 'modulus_ratio', [2.0, 4.0])
    """
    ds = drawable(ds, "time_to_failure", what="a page")
    program = _program_of(ds)
    along = parameters_along(ds)
    if along is None:
        raise ValueError(
            "a page needs one dimension or more, each along one parameter that varies, not scattered samples; "
            f"got {sizes_in_words(ds)}"
        )
    rising = {dim: np.unique(ds[name].values, return_index=True)[1] for dim, name in along.items()}
    plane = list(along)
    while len(plane) > 2:
        plane.remove(min(reversed(plane), key=lambda dim: len(rising[dim])))
    order = plane + [dim for dim in along if dim not in plane]
    kept = ["outcome", *(name for name in SHOWN if name in ds)]
    cell_bytes = 5 + 6 * points_of(program) + 4 * (len(kept) + _PLACES)
    most = thinned([len(rising[dim]) for dim in order], _BYTES // cell_bytes)
    chosen = {dim: rising[dim][evenly(len(rising[dim]), number)] for dim, number in zip(order, most, strict=True)}
    limits = ["first_limit"] if "first_limit" in ds else []
    part = ds[kept + limits].isel(chosen).transpose(*order[2:], *reversed(plane))
    part = _with_breakdown(part.load())
    x, *rest = [_axis(part, along[dim], len(rising[dim])) for dim in order]
    return Cells(program, x, rest[0] if rest else None, tuple(rest[1:]), part)


def points_of(program: Program) -> int:
    """Return the number of points of the curve of a film: more where the field does not only rise.

    Examples
    --------
    >>> import dea_maps as dm
    >>> points_of(dm.Step()), points_of(dm.PulseTrain())
    (40, 96)
    """
    return _POINTS if shape_of(program) is None else _POINTS_RISING


def thinned(totals: list[int], cells: int) -> list[int]:
    """Return how many values to keep along x, y and the sliders, as many as there are of these.

    Examples
    --------
    >>> thinned([100, 100, 100], 40_000), thinned([100, 100, 3], 40_000), thinned([1000, 20], 40_000)
    ([44, 45, 20], [100, 100, 3], [400, 20])
    >>> thinned([100, 100, 30, 30, 4], 40_000)
    [20, 20, 5, 5, 4]
    """
    sliders = [min(total, MOST_SLICES) for total in totals[2:]]
    while len(sliders) > 1 and math.prod(sliders) > max(cells // FEWEST, 1):
        sliders[sliders.index(max(sliders))] -= 1
    numbers = [min(total, MOST_ALONG) for total in totals[:2]]
    room = cells // math.prod(sliders)
    if len(numbers) == 1:
        return [min(numbers[0], room)]
    if numbers[0] * numbers[1] > room:
        short = min(numbers)
        side = min(short, math.isqrt(room))
        other = min(max(numbers), room // side)
        numbers = [side, other] if numbers[0] == short else [other, side]
    return numbers + sliders


def plain_label(name: str) -> str:
    """Return the words and the symbol of a quantity, or its words and units in SI, without mathtext.

    Examples
    --------
    >>> plain_label("modulus_ratio"), plain_label("seconds_to_failure")
    ('modulus ratio μU/μR', 'time to failure (s)')
    """
    if name in _SI_LABELS:
        return _SI_LABELS[name]
    for suffix, (words, unit) in _SI_SUFFIXES.items():
        if name == suffix or name.endswith(f"_{suffix}"):
            return f"{name.removesuffix(suffix).replace('_', ' ')}{words}".rstrip() + f" ({unit})"
    symbol = quantity_of(name).symbol
    for mathtext, character in _IN_UNICODE.items():
        symbol = symbol.replace(mathtext, character)
    return f"{quantity_of(name).label} {symbol}".rstrip()


_SI_LABELS = {
    "voltage_rate": "ramp rate (V/s)",
    "seconds": "time (s)",
    "seconds_to_failure": "time to failure (s)",
    "critical_true_field": "critical true field (MV/m)",
    "seconds_to_breakdown": "time to breakdown (s)",
    "breakdown_true_field": "breakdown true field (MV/m)",
    "final_area_strain": "final area strain",
    "critical_area_strain": "area strain at failure",
    "breakdown_area_strain": "area strain at breakdown",
}
_SI_SUFFIXES = {
    "voltage_rate": ("rate", "V/s"),
    "voltage": ("voltage", "V"),
    "seconds": ("", "s"),
    "nominal_stress": ("dead load", "Pa"),
}
"""How names of parameters and variables in SI units end, the words instead, and the unit."""

_STRAINS = {f"{state}_stretch": f"{state}_area_strain" for state in ("critical", "breakdown", "final")}


def fixed_parameters(cells: Cells) -> dict[str, float]:
    """Return what is the same in every cell, by its name, in SI units where the map has them."""
    varying = {axis.name for axis in cells.axes}
    names = [name for name in kinds_in(cells.ds.coords, cells.ds.attrs) if name not in varying]
    return {shown: float(cells.ds[shown]) for shown in (_names_of(cells.ds, name)[-1] for name in names)}


def edges(axis: Axis) -> tuple[Floats, bool]:
    """Return the edges of the cells along an axis, and whether it is a log axis."""
    values = axis.values[axis.shown]
    log = log_spaced(values)
    return cell_edges(values, log), log


def columns(cells: Cells, index: int) -> dict[str, npt.NDArray[Any]]:
    """Return the values of one slice, each cell's after the other's, row by row from below.

    Parameters
    ----------
    cells : Cells
        What is shown.
    index : int
        The number of the slice; the last slider moves on first.

    Returns
    -------
    dict of str to ndarray
        ``outcome`` in int8, others in float32; in the units of `plain_label`.
    """
    slices, rows, number = cells.shape
    return {
        name: values.reshape(slices, rows * number)[index].astype(np.int8 if name == "outcome" else np.float32)
        for name, values in results(cells).items()
    }


def results(cells: Cells) -> dict[str, npt.NDArray[Any]]:
    """Return the values of all cells, in the units of `plain_label` and the shape of the map, and area strains."""
    found = {str(name): array for name, array in cells.ds.data_vars.items()} | _area_strains(cells.ds)
    return {name: array.values * (1e-6 if name.endswith("true_field") else 1) for name, array in found.items()}


def _area_strains(ds: xr.Dataset) -> dict[str, xr.DataArray]:
    """Return the area strains, from the film that its dead load has pre-stretched."""
    free = ds["prestretch"] if "prestretch" in ds.coords else 1.0
    return {
        strain: ((ds[stretch] / free) ** 2 - 1.0).transpose(*ds[stretch].dims)
        for stretch, strain in _STRAINS.items()
        if stretch in ds
    }


def _with_breakdown(ds: xr.Dataset) -> xr.Dataset:
    """Return the map with electrical breakdown among its outcomes."""
    if "first_limit" not in ds:
        return ds
    regions = ds["outcome"].copy(data=regions_of(ds))
    hidden = {name: ds[name].where(regions != BREAKS_DOWN) for name in _TIMES if name in ds}
    return ds.assign({**hidden, "outcome": regions}).drop_vars("first_limit")


_TIMES = ("time_to_failure", "seconds_to_failure")


def _program_of(ds: xr.Dataset) -> Program:
    """Return the loading program of a map, after checking that all that it takes is there."""
    named = ds.attrs.get("program")
    if named not in PROGRAMS:
        raise ValueError(f"the map must name its program, one of {', '.join(PROGRAMS)}; got {named!r}")
    program = program_of(ds.attrs)
    for name in (*program.parameters, "modulus_ratio"):
        if name not in ds.coords:
            raise ValueError(f"a page needs the parameter {name}; the map lacks it")
    for name, kind in kinds_in(ds.coords, ds.attrs).items():
        check_values(name, np.asarray(ds[name].values, dtype=np.float64), KINDS[kind])
    return program


def _axis(ds: xr.Dataset, name: str, total: int) -> Axis:
    return Axis(name, total, {each: ds[each].values.astype(np.float64) for each in _names_of(ds, name)})


def _names_of(ds: xr.Dataset, name: str) -> list[str]:
    """Return the name of a parameter and, where the map has it, of what it is in SI units."""
    twin = si_name(name, kinds_in(ds.coords, ds.attrs)[name])
    return [name] if twin is None or twin not in ds.coords else [name, twin]
