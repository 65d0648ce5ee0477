"""What a page to explore shows: the cells of a map, thinned where there are many, and their values in columns."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..charts.data import cell_edges, drawable, log_spaced, parameters_along, sizes_in_words
from ..charts.plane import BREAKS_DOWN, regions_of
from ..nomenclature import KINDS, quantity_of
from ..program_text import kinds_in, program_of
from ..programs import PROGRAMS, Program
from ..sweeps.chunks import evenly
from ..sweeps.parameters import check_values

Floats = npt.NDArray[np.float64]

SI: Mapping[str, str] = MappingProxyType(
    {"field": "voltage", "rate": "voltage_rate", "time_to_failure": "seconds_to_failure"}
)
"""What `dea_maps.physical` adds for a film."""

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
)
"""The variables that a page shows where the map has them, in this order."""

MOST_SLICES, MOST_ALONG = 20, 400
"""Values on the slider, and along an axis: more would not be told apart."""

POINTS = 40
"""Points of the curve of a cell."""

# Of all values and curves before compression, which makes them four times smaller or more; beside 1.7 MB of library.
_BYTES = 9_000_000
_CURVE_BYTES = 4 + 2 * 2 * POINTS
_PLACES = 10  # columns of edges and parameters, at most

_IN_UNICODE = {"$": "", r"\,": " ", r"\mu": "μ", r"\tau": "τ", r"\lambda": "λ", r"\infty": "∞", r"\xi": "ξ", "_": ""}


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
    across : Axis or None
        On the slider; None for a map over fewer than three parameters.
    ds : Dataset
        Their values, in memory: the dimensions are those of `across`, `y` and `x`, as far as there are any. The outcome
        is `BREAKS_DOWN` where electrical breakdown comes first, and there is no time to failure.
    """

    program: Program
    x: Axis
    y: Axis | None
    across: Axis | None
    ds: xr.Dataset

    @property
    def axes(self) -> tuple[Axis, ...]:
        """All that varies, in the order of the dimensions of `ds`."""
        return tuple(axis for axis in (self.across, self.y, self.x) if axis is not None)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of slices, rows and columns."""
        across, y = (1 if axis is None else axis.number for axis in (self.across, self.y))
        return across, y, self.x.number

    @property
    def seconds(self) -> float | None:
        """The relaxation time in s where the page shows times in s."""
        known = "seconds_to_failure" in self.ds and "relaxation_time_in_s" in self.ds.attrs
        return float(self.ds.attrs["relaxation_time_in_s"]) if known else None

    @property
    def time_shown(self) -> str:
        """The name of the variable in the colours."""
        return "time_to_failure" if self.seconds is None else "seconds_to_failure"


def cells_of(ds: xr.Dataset) -> Cells:
    """Choose the cells of a map that a page shows, and read their values.

    The shortest dimension, or the last of equally short ones, goes to the slider. Of too many values along a dimension
    some are taken, evenly spread from the first to the last.

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
        If it is not the map of a sweep over one to three parameters.

    Examples
    --------
    >>> import dea_maps as dm
    >>> ds = dm.sweep(dm.RampHold(), field=[1.1, 1.2, 1.3, 1.4], rate=[1.0, 2.0, 9.0], modulus_ratio=[4.0, 2.0])
    >>> cells = cells_of(ds)
    >>> cells.shape, cells.across.name, cells.across.values["modulus_ratio"].tolist()
    ((2, 3, 4), 'modulus_ratio', [2.0, 4.0])
    """
    ds = drawable(ds, "time_to_failure", what="a page")
    program = _program_of(ds)
    along = parameters_along(ds)
    if along is None or len(along) > 3:
        raise ValueError(
            "a page needs one to three dimensions, each along one parameter that varies, not scattered samples; "
            f"got {sizes_in_words(ds)}"
        )
    rising = {dim: np.unique(ds[name].values, return_index=True)[1] for dim, name in along.items()}
    order = list(along)
    if len(order) == 3:
        across = min(reversed(order), key=lambda dim: len(rising[dim]))
        order.remove(across)
        order.append(across)
    kept = ["outcome", *(name for name in SHOWN if name in ds)]
    most = thinned([len(rising[dim]) for dim in order], _BYTES // (_CURVE_BYTES + 4 * (len(kept) + _PLACES)))
    chosen = {dim: rising[dim][evenly(len(rising[dim]), number)] for dim, number in zip(order, most, strict=True)}
    limits = ["first_limit"] if "first_limit" in ds else []
    part = _with_breakdown(ds[kept + limits].isel(chosen).transpose(*reversed(order)).load())
    axes = [_axis(part, along[dim], len(rising[dim])) for dim in order]
    x, y, slider = axes + [None] * (3 - len(axes))
    assert x is not None
    return Cells(program, x, y, slider, part)


def thinned(totals: list[int], cells: int) -> list[int]:
    """Return how many values to keep along x, y and the slider, as many as there are of these.

    Examples
    --------
    >>> thinned([100, 100, 100], 40_000), thinned([100, 100, 3], 40_000), thinned([1000, 20], 40_000)
    ([44, 45, 20], [100, 100, 3], [400, 20])
    """
    caps = [MOST_ALONG, MOST_ALONG, MOST_SLICES]
    numbers = [min(total, cap) for total, cap in zip(totals, caps[: len(totals)], strict=True)]
    room = cells // (numbers[2] if len(numbers) == 3 else 1)
    if len(numbers) == 1:
        return [min(numbers[0], room)]
    if numbers[0] * numbers[1] > room:
        short = min(numbers[:2])
        side = min(short, math.isqrt(room))
        other = min(max(numbers[:2]), room // side)
        numbers[:2] = (side, other) if numbers[0] == short else (other, side)
    return numbers


def plain_label(name: str) -> str:
    """Return the words and the symbol of a quantity, or its words and units in SI, without mathtext.

    Examples
    --------
    >>> plain_label("modulus_ratio"), plain_label("seconds_to_failure")
    ('modulus ratio μU/μR', 'time to failure (s)')
    """
    if name in _SI_LABELS:
        return _SI_LABELS[name]
    symbol = quantity_of(name).symbol
    for mathtext, character in _IN_UNICODE.items():
        symbol = symbol.replace(mathtext, character)
    return f"{quantity_of(name).label} {symbol}".rstrip()


_SI_LABELS = {
    "voltage": "voltage (V)",
    "voltage_rate": "ramp rate (V/s)",
    "seconds_to_failure": "time to failure (s)",
    "critical_voltage": "critical voltage (V)",
    "critical_true_field": "critical true field (MV/m)",
    "seconds_to_breakdown": "time to breakdown (s)",
    "breakdown_voltage": "breakdown voltage (V)",
    "breakdown_true_field": "breakdown true field (MV/m)",
    "seconds": "time (s)",
}


def fixed_parameters(cells: Cells) -> dict[str, float]:
    """Return what is the same in every cell, by its name."""
    varying = {axis.name for axis in cells.axes}
    return {name: float(cells.ds[name]) for name in kinds_in(cells.ds.coords, cells.ds.attrs) if name not in varying}


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
        The position of the slider; 0 where there is none.

    Returns
    -------
    dict of str to ndarray
        ``outcome`` in int8, others in float32; in the units of `plain_label`.
    """
    part = cells.ds if cells.across is None else cells.ds.isel({cells.ds["outcome"].dims[0]: index})
    found: dict[str, npt.NDArray[Any]] = {}
    for name, array in part.data_vars.items():
        scale = 1e-6 if str(name).endswith("true_field") else 1
        kind = np.int8 if name == "outcome" else np.float32
        found[str(name)] = (array.values.ravel() * scale).astype(kind)
    return found


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
    names = [each for each in (name, SI.get(name, name)) if each in ds.coords]
    return Axis(name, total, {each: ds[each].values.astype(np.float64) for each in names})
