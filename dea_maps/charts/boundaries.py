"""Boundaries between the outcomes of films: curves of `dea_maps.allowable`, not edges of the cells of a map."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy.interpolate import PchipInterpolator

from ..limits.allowable import allowable
from ..outcomes import Outcome
from ..pieces import Jump
from ..program_text import kinds_in, program_of
from ..programs import Program, shape_of
from ..sweeps.chunks import evenly
from ..sweeps.dead_load import film_of, largest_field, relaxed_threshold

Floats = npt.NDArray[np.float64]
Outcomes = npt.NDArray[np.int8]

_ASKED = ("field", "share", "time")
"""Kinds of parameters of which there is one largest value with which a film survives; the first is asked for."""

_RTOL = 1e-3
"""Of the curves: less than the width of a line."""

_EXACT = 1e-6
"""Of thresholds that are known in closed form."""

_PLACES = 25
"""Values of the other parameter at which `dea_maps.allowable` is asked: root finding takes as long as many cells."""


class Limits(NamedTuple):
    """The values of a parameter at which the outcome changes, for some values of the others.

    Attributes
    ----------
    survived : (n,) ndarray
        The largest with which a film survives; infinite where it always does, 0 where it never does.
    at_once : (n,) ndarray
        The least with which it fails at once; infinite where it never does.
    rtol : float
        Relative error of these values.
    """

    survived: Floats
    at_once: Floats
    rtol: float


class Boundary(NamedTuple):
    """The boundaries on a map, or along one parameter.

    Attributes
    ----------
    parameter : str
        The one whose limits they are.
    places : (n,) ndarray
        Rising values of the other parameter of the map; one place, NaN, without another parameter.
    limits : Limits
        At these places.
    exact : callable or None
        Gives the limits at any places, where they are known in closed form.
    """

    parameter: str
    places: Floats
    limits: Limits
    exact: Callable[[Floats], Limits | None] | None = None

    def at(self, places: Floats, log: bool) -> tuple[Floats, Floats]:
        """Return both limits at other places, by interpolation without overshoots.

        Parameters
        ----------
        places : (n,) ndarray
            Between the first and the last of `places`.
        log : bool
            Whether on a logarithmic scale of the places.
        """
        if len(self.places) == 1:
            survived, at_once = (np.full(places.shape, limit[0]) for limit in self.limits[:2])
            return survived, at_once
        known = self.exact(places) if self.exact is not None else None
        if known is not None:
            return known.survived, known.at_once
        places = np.clip(places, self.places[0], self.places[-1])
        scaled, wanted = (np.log(self.places), np.log(places)) if log else (self.places, places)
        found = [self._between(scaled, limit, wanted) for limit in self.limits[:2]]
        return found[0], found[1]

    @staticmethod
    def _between(places: Floats, limit: Floats, wanted: Floats) -> Floats:
        finite = np.isfinite(limit)
        if not finite.any():
            return np.full(wanted.shape, np.inf)
        # A limit that tends to infinity leaves the chart: ten times its largest value is beyond the frame.
        held = np.where(finite, limit, 10.0 * limit[finite].max())
        return np.asarray(PchipInterpolator(places, held)(wanted))


def limits_of(program: Program, parameter: str, others: Mapping[str, Floats]) -> Limits | None:
    """Return where the outcome changes along one parameter; None where that is not known.

    A field that is applied at once or by one ramp, then held, is survived up to the relaxed threshold, (23) with the
    dashpot relaxed. For any other program `dea_maps.allowable` finds the limit. A film fails at once under a first
    jump to more than its threshold with the dashpot as it is at the start.

    Parameters
    ----------
    program : Program
        The loading program.
    parameter : str
        One of its parameters.
    others : mapping of str to (n,) ndarray
        All others, and those of the film.

    Examples
    --------
    >>> from dea_maps.programs import Step
    >>> limits = limits_of(Step(), "field", {"modulus_ratio": np.array([4.0])})
    >>> limits.survived.round(9).tolist(), limits.at_once.round(9).tolist()
    ([1.0], [2.0])
    """
    ratio, start, load = film_of(others)
    if _in_closed_form(program, parameter):
        survived, rtol = relaxed_threshold(load), _EXACT
    else:
        given: dict[str, Any] = {name: xr.DataArray(values, dims="place") for name, values in others.items()}
        found = allowable(program, parameter, rtol=_RTOL, **given)
        reasons = np.array(found["reason"].attrs["flag_meanings"].split())[found["reason"].values]
        survived = np.select([reasons == "always", reasons == "never"], [np.inf, 0.0], found["allowable"].values)
        rtol = _RTOL
        if np.isnan(survived).any():
            return None
    first = next(iter(getattr(program, "pieces", ())), None)
    jumps = isinstance(first, Jump) and first.to == parameter
    at_once = largest_field(start, ratio, load) if jumps else np.full(ratio.shape, np.inf)
    return Limits(np.asarray(survived), at_once, rtol)


def _in_closed_form(program: Program, parameter: str) -> bool:
    """Tell whether the program does no more than apply this field, at once or by one ramp, and hold it."""
    shape = shape_of(program)
    return shape is not None and shape.field == parameter


def boundary_of(ds: xr.Dataset, names: tuple[str, ...], logs: Mapping[str, bool] | None = None) -> Boundary | None:
    """Return the boundaries on a map over one or two parameters; None where the cells must show them.

    That is so where the program is not known, where no field, share or time varies, and where a cell says something
    else: then the boundary is no curve of one value of this parameter for each value of the other.

    Parameters
    ----------
    ds : Dataset
        A map whose dimensions are each along one of the parameters.
    names : tuple of str
        The parameters that vary, one or two.
    logs : mapping of str to bool, optional
        Which of them are on logarithmic axes; by default none.
    """
    kinds = kinds_in(ds.coords, ds.attrs)
    try:
        program = program_of(ds.attrs)
    except ValueError:
        return None
    asked = [name for kind in _ASKED for name in names if kinds[name] == kind and name in program.kinds]
    if not asked or {*program.kinds, "modulus_ratio"} - kinds.keys():
        return None
    parameter = asked[0]
    other = next((name for name in names if name != parameter), None)
    rows = np.unique(ds[other].values.astype(np.float64)) if other else np.array([np.nan])

    def limits_at(places: Floats) -> Limits | None:
        fixed = {name: np.full(places.shape, float(ds[name].values.flat[0])) for name in kinds if name != parameter}
        return limits_of(program, parameter, fixed if other is None else {**fixed, other: places})

    closed = _in_closed_form(program, parameter)
    places = rows if closed else _spread(rows, bool(logs and other and logs[other]))
    limits = limits_at(places)
    if limits is None:
        return None
    boundary = Boundary(parameter, places, limits, limits_at if closed else None)
    return boundary if _agrees(ds, boundary, other) else None


def _spread(rows: Floats, log: bool) -> Floats:
    """Return some of the rows of a map, and places between them if they are few."""
    chosen = rows[evenly(len(rows), _PLACES)]
    if 1 < len(rows) <= _PLACES // 2:
        spaced = np.geomspace if log else np.linspace
        chosen = np.unique(np.concatenate([chosen, spaced(rows[0], rows[-1], _PLACES // 2)]))
    return chosen


def _agrees(ds: xr.Dataset, boundary: Boundary, other: str | None) -> bool:
    """Tell whether every resolved cell at the places is on the side of the boundary that its outcome says."""
    value = ds[boundary.parameter].astype(np.float64)
    outcome = ds["outcome"]
    parts = [(outcome, *(limit[0] for limit in boundary.limits[:2]))]
    if other is not None:
        row = ds[other].astype(np.float64)
        parts = [
            (outcome.where(row == place, Outcome.UNRESOLVED), survived, at_once)
            for place, survived, at_once in zip(boundary.places, *boundary.limits[:2], strict=True)
            if (row == place).any()
        ]
    margin = 2.0 * boundary.limits.rtol
    for found, survived, at_once in parts:
        close = (abs(value - survived) <= margin * survived) | (abs(value - at_once) <= margin * value)
        said = xr.where(
            value >= at_once, Outcome.FAILS_AT_ONCE, xr.where(value <= survived, Outcome.SURVIVES, Outcome.FAILS_LATER)
        )
        if not bool(((found == said) | (found == Outcome.UNRESOLVED) | close).all()):
            return False
    return True
