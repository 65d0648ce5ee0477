"""The largest value of one parameter of a loading program that a film survives, or lasts long enough under."""

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..checks import brief
from ..nomenclature import KINDS
from ..outcomes import Outcome, Reason, flag_attributes
from ..programs import Program
from ..sweeps.grid import kinds_taken, make_grid
from ..sweeps.parameters import ParameterLike
from ..sweeps.solve import Parameters, solve_auto
from .answers import tight_rtol

Array = npt.NDArray[np.float64]

# Where an answer is looked for, by the kind of the parameter: fields in units of that of instant failure.
_RANGES = {
    "field": (1e-6, 2.0),
    "rate": (1e-6, 1e6),
    "time": (1e-6, 1e6),
    "period": (1e-6, 1e6),
    "share": (1e-9, 1.0),
}
_BISECTIONS = 200


def allowable(
    program: Program,
    parameter: str,
    *,
    modulus_ratio: ParameterLike,
    lifetime: float = np.inf,
    cycles: float | None = None,
    prestretch: ParameterLike | None = None,
    stress: ParameterLike | None = None,
    rtol: float = 1e-6,
    **others: ParameterLike,
) -> xr.Dataset:
    """Find the largest value of a parameter with which films survive, or last for a time or a number of cycles.

    Films keep their order: under the pointwise larger load no film fails later, so that there is one largest value of
    a field, a width, a hold time or a duty. For a period and a fall time that is so if it makes the load larger at no
    time smaller; for a rate the answer is the fastest with which the film lasts.

    Parameters
    ----------
    program : Program
        The loading program.
    parameter : str
        The one that is asked for: a field, a rate, a time, a period or a share.
    modulus_ratio, prestretch, stress, **others : number, 1-D array or DataArray
        The other parameters, as in `dea_maps.sweep`.
    lifetime : float
        How long the films must last, in relaxation times; without end by default.
    cycles : float, optional
        How many repetitions of a repeated program they must last, instead of a lifetime.
    rtol : float
        Relative error allowed in the answer, from 1e-10 to 1e-3.

    Returns
    -------
    Dataset
        ``allowable`` and ``reason``: "answered"; "always" where every value looked at is allowed, "never" where
        none is, "unresolved"; NaN there.

    Raises
    ------
    TypeError, ValueError
        If something is of the wrong kind or out of bounds.

    Examples
    --------
    >>> import dea_maps as dm
    >>> ds = dm.allowable(dm.Step(), "field", modulus_ratio=4.0, lifetime=2.443625636)
    >>> round(float(ds.allowable), 6)
    1.2
    """
    tight = tight_rtol(rtol)
    kinds = kinds_taken(program)
    if parameter not in program.parameters:
        names = ", ".join(program.parameters)
        raise ValueError(f"parameter must be one of {names} for the program {program.name!r}; got {brief(parameter)}")
    if parameter in others:
        raise ValueError(f"{parameter} = {brief(others[parameter])} must be left out: it is asked for")
    if kinds[parameter] not in _RANGES:
        raise ValueError(f"parameter must be a field, a rate, a time, a period or a share; got {parameter!r}")
    for name, value in (("lifetime", lifetime), ("cycles", cycles)):
        if value is not None and not (isinstance(value, int | float) and value >= 0.0):
            raise ValueError(f"{name} must be a number of at least 0; got {brief(value)}")
    if cycles is not None and program.repeats == 1:
        raise ValueError(f"cycles must be left out for the program {program.name!r}, which is not repeated")
    given = {"modulus_ratio": modulus_ratio, "prestretch": prestretch, "stress": stress, **others}
    grid = make_grid(program, **given, **{parameter: _placeholder(kinds[parameter])})
    cells = {name: np.array(values, dtype=np.float64).ravel() for name, values in grid.parameters.items()}
    wanted = (lifetime, cycles)
    low, high = (np.full(cells["modulus_ratio"].size, bound) for bound in _RANGES[kinds[parameter]])
    if kinds[parameter] == "field":
        scale = np.sqrt(cells["modulus_ratio"])
        low, high = low * scale, high * scale
    found, reason = _search(program, parameter, cells, low, high, wanted, rtol, tight)
    dims = grid.dims
    words = f"largest {parameter.replace('_', ' ')} with which a film lasts"
    coords = {name: variable for name, variable in grid.coords.items() if name != parameter}
    return xr.Dataset(
        {
            "allowable": (dims, found.reshape(grid.shape), {"long_name": words, "units": "1"}),
            "reason": (
                dims,
                reason.reshape(grid.shape),
                {"long_name": "whether there is an answer", "units": "1", **flag_attributes(Reason)},
            ),
        },
        coords,
    )


def _placeholder(kind: str) -> float:
    """Return a value that a parameter may have."""
    return 0.5 if KINDS[kind].highest == 1.0 else 1.0


def _search(
    program: Program,
    parameter: str,
    cells: Parameters,
    low: Array,
    high: Array,
    wanted: tuple[float, float | None],
    rtol: float,
    tight: float,
) -> tuple[Array, npt.NDArray[np.int8]]:
    """Return the largest values by bisection in the logarithm, and why there may be none."""

    def lasts(values: Array, chosen: npt.NDArray[np.bool_]) -> npt.NDArray[np.int8]:
        """Return 1 where films last, 0 where not, -1 where that is not known."""
        own = {name: array[chosen] for name, array in cells.items()} | {parameter: values[chosen]}
        found = solve_auto(program, own, tight)
        lifetime, cycles = wanted
        if cycles is not None and found.cycles_to_failure is not None:
            long_enough = found.cycles_to_failure >= cycles
        else:
            long_enough = (found.time_to_failure >= lifetime) & (found.outcome != Outcome.FAILS_AT_ONCE)
        answer = np.where((found.outcome == Outcome.SURVIVES) | long_enough, 1, 0)
        return np.where(found.outcome == Outcome.UNRESOLVED, -1, answer).astype(np.int8)

    everywhere = np.ones(low.size, np.bool_)
    at_low, at_high = lasts(low, everywhere), lasts(high, everywhere)
    reason = np.select(
        [at_high == 1, at_low == 0, (at_low == -1) | (at_high == -1)],
        [Reason.ALWAYS, Reason.NEVER, Reason.UNRESOLVED],
        Reason.ANSWERED,
    ).astype(np.int8)
    open_ = reason == Reason.ANSWERED
    unknown = np.zeros(low.size, np.bool_)
    for _ in range(_BISECTIONS):
        if not open_.any():
            break
        middle = np.sqrt(low * high)
        answer = np.zeros(low.size, np.int8)
        answer[open_] = lasts(middle, open_)
        unknown |= answer == -1
        low = np.where(open_ & (answer == 1), middle, low)
        high = np.where(open_ & (answer != 1), middle, high)
        open_ &= high > low * (1.0 + 0.2 * rtol)
    # What is not known on the way lies next to the answer, or the answer is not known.
    reason[unknown & (reason == Reason.ANSWERED) & ~_narrow(low, high, rtol)] = Reason.UNRESOLVED
    return np.where(reason == Reason.ANSWERED, np.sqrt(low * high), np.nan), reason


def _narrow(low: Array, high: Array, rtol: float) -> npt.NDArray[np.bool_]:
    return np.asarray(high <= low * (1.0 + rtol))
