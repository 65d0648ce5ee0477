"""The largest value of one parameter of a loading program that a film survives, or lasts long enough under."""

from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..checks import brief, in_units
from ..materials.material import Material
from ..materials.si_units import Film, film_of, in_si, warn_film
from ..materials.strength import StrengthOf
from ..nomenclature import KINDS
from ..outcomes import Limit, Outcome, Reason, flag_attributes
from ..programs import Program
from ..sweeps.dead_load import has_dead_load
from ..sweeps.grid import kinds_taken, make_grid
from ..sweeps.loading import repetitions_before
from ..sweeps.methods import LARGEST_RTOL, choose
from ..sweeps.parameters import ParameterLike
from ..sweeps.ratios import in_ratios
from ..sweeps.solve import Parameters, solve_auto
from .answers import SMALLEST_RTOL, tight_rtol
from .breakdown import solve_with_limits

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
# By how much the tolerance of a film that is unresolved is larger the next time.
_LOOSER = 100.0


def allowable(
    program: Program,
    parameter: str,
    *,
    modulus_ratio: ParameterLike | None = None,
    lifetime: float = np.inf,
    lifetime_seconds: float | None = None,
    cycles: float | None = None,
    prestretch: ParameterLike | None = None,
    stress: ParameterLike | None = None,
    rtol: float = 1e-6,
    material: Material | None = None,
    thickness: float | None = None,
    **others: ParameterLike,
) -> xr.Dataset:
    """Find the largest value of a parameter with which films survive, or last for a time or a number of cycles.

    Films keep their order: under the pointwise larger load no film fails later, so that there is one largest value of
    a field, a width, a hold time or a duty. For a period and a fall time that is so if it makes the load larger at no
    time smaller; for a rate the answer is the fastest with which the film lasts. If the material knows its breakdown
    strength, the film must not break down either, see `dea_maps.breakdown`.

    Parameters
    ----------
    program : Program
        The loading program.
    parameter : str
        The one that is asked for: a field, a rate, a time, a period or a share; for a film, also by its name in SI
        units.
    modulus_ratio, prestretch, stress, material, thickness, **others
        The other parameters, and the film, as in `dea_maps.sweep`.
    lifetime : float
        How long the films must last, in relaxation times; without end by default.
    lifetime_seconds : float, optional
        The same in s, for a film, instead of `lifetime`.
    cycles : float, optional
        How many repetitions of a repeated program they must last, instead of a lifetime.
    rtol : float
        Relative error allowed in the answer, from 1e-10 to 1e-3.

    Returns
    -------
    Dataset
        ``allowable`` and ``reason``: "answered"; "always" where every value looked at is allowed, "never" where
        none is; "unresolved" where the largest one known to be allowed and the smallest one known not to be are
        farther apart than `rtol`, as may happen below 1e-5 where a limit cycle is lost at a tangent; NaN there. For a
        film also its twin in SI units, as ``allowable_voltage``, and if it may break down ``limit``: "instability"
        or "breakdown" just above the answer.

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
    >>> ds = dm.allowable(dm.Step(), "voltage", lifetime_seconds=600.0, material=dm.VHB, thickness=100e-6)
    >>> round(float(ds.allowable_voltage))
    1863
    """
    tight_rtol(rtol)
    kinds = kinds_taken(program)
    film = film_of(material, thickness)
    parameter = _asked(program, parameter, film)
    if lifetime_seconds is not None:
        if lifetime != np.inf:
            raise ValueError("lifetime and lifetime_seconds must not both be given: they are the same quantity")
        if film is None:
            message = f"lifetime_seconds = {brief(lifetime_seconds)} is in s: material and thickness are missing"
            raise ValueError(message)
        lifetime_seconds = in_units("lifetime_seconds", lifetime_seconds, "s")
        _check_number("lifetime_seconds", lifetime_seconds)
        lifetime = lifetime_seconds / film.material.relaxation_time
    given = {"modulus_ratio": modulus_ratio, "prestretch": prestretch, "stress": stress, **others}
    ratios = in_ratios(kinds, given, film)
    if film is not None:
        warn_film(*film)
        ratios.setdefault("modulus_ratio", film.material.modulus_ratio)
    if parameter in ratios:
        raise ValueError(f"{parameter} = {brief(ratios[parameter])} must be left out: it is asked for")
    if kinds[parameter] not in _RANGES:
        raise ValueError(f"parameter must be a field, a rate, a time, a period or a share; got {parameter!r}")
    for name, value in (("lifetime", lifetime), ("cycles", cycles)):
        if value is not None:
            _check_number(name, value)
    if cycles is not None and program.repeats == 1:
        raise ValueError(f"cycles must be left out for the program {program.name!r}, which is not repeated")
    grid = make_grid(program, **ratios, **{parameter: _placeholder(kinds[parameter])})
    cells = {name: np.array(values, dtype=np.float64).ravel() for name, values in grid.parameters.items()}
    wanted = (lifetime, cycles)
    low, high = (np.full(cells["modulus_ratio"].size, bound) for bound in _RANGES[kinds[parameter]])
    if kinds[parameter] == "field":
        scale = np.sqrt(cells["modulus_ratio"])
        low, high = low * scale, high * scale
    strength = film.material.strength if film is not None and film.limited else None
    found, reason, limit = _search(program, parameter, cells, low, high, wanted, rtol, strength)
    dims = grid.dims
    words = f"largest {parameter.replace('_', ' ')} with which a film lasts"
    coords = {name: variable for name, variable in grid.coords.items() if name != parameter}
    ds = xr.Dataset(
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
    if film is None:
        return ds
    if limit is not None:
        about = {"long_name": f"what limits {parameter}", "units": "1", **flag_attributes(Limit)}
        ds["limit"] = (dims, limit.reshape(grid.shape), about)
    answer = {"allowable": kinds[parameter]}
    return in_si(ds, *film, {name: kind for name, kind in kinds.items() if name in coords} | answer)


def _asked(program: Program, parameter: str, film: Film | None) -> str:
    """Return the name of the parameter that is asked for, given perhaps by that in SI units."""
    twins = {} if film is None else {KINDS[kind].twin(name): name for name, kind in program.kinds.items()}
    name = twins.get(parameter, parameter)
    if name not in program.parameters:
        names = ", ".join([*program.parameters, *(twin for twin in twins if twin)])
        raise ValueError(f"parameter must be one of {names} for the program {program.name!r}; got {brief(parameter)}")
    return name


def _check_number(name: str, value: object) -> None:
    if not (isinstance(value, int | float) and value >= 0.0):
        raise ValueError(f"{name} must be a number of at least 0; got {brief(value)}")


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
    strength: StrengthOf | None,
) -> tuple[Array, npt.NDArray[np.int8], npt.NDArray[np.int8] | None]:
    """Return the largest values by bisection in the logarithm, why there may be none, and what limits them."""
    lifetime, cycles = wanted
    tight = tight_rtol(rtol)

    def fates(values: Array, chosen: npt.NDArray[np.bool_]) -> tuple[dict[str, npt.NDArray[Any]], Array]:
        """Return the results of films, and how accurate they are: outcomes are certain at any tolerance.

        Next to a boundary the answer to what is beside the outcome may be too sensitive for a small one.
        """
        own = {name: array[chosen] for name, array in cells.items()} | {parameter: values[chosen]}
        found = _fates(program, own, tight, strength)
        accuracy, loose = np.full(values[chosen].size, tight), _LOOSER * tight
        lost = found["outcome"] == Outcome.UNRESOLVED
        while lost.any() and loose <= LARGEST_RTOL:
            again = _fates(program, {name: array[lost] for name, array in own.items()}, loose, strength)
            for name, array in again.items():
                found[name][lost] = array
            accuracy[lost] = loose
            lost, loose = found["outcome"] == Outcome.UNRESOLVED, _LOOSER * loose
        return found, accuracy

    def lasts(values: Array, chosen: npt.NDArray[np.bool_]) -> npt.NDArray[np.int8]:
        """Return 1 where films last, 0 where not, -1 where that is not known."""
        found, accuracy = fates(values, chosen)
        unknown = found["outcome"] == Outcome.UNRESOLVED
        if cycles is not None:
            long_enough = found["cycles_to_failure"] >= cycles
        else:
            time = found["time_to_failure"]
            long_enough = (time >= lifetime) & (found["outcome"] != Outcome.FAILS_AT_ONCE)
            if lifetime < np.inf:
                unknown |= (accuracy > tight) & (abs(time - lifetime) <= accuracy * lifetime)
        answer = np.where((found["outcome"] == Outcome.SURVIVES) | long_enough, 1, 0)
        return np.where(unknown, -1, answer).astype(np.int8)

    def narrow(
        low: Array, high: Array, open_: npt.NDArray[np.bool_], beyond: bool
    ) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
        """Return the largest value known to be allowed, the smallest known not to be, where one was not known.

        ``beyond``: the answer is looked for above what is not known, otherwise below.
        """
        allowed, failing, unknown = low, high, np.zeros(low.size, np.bool_)
        for _ in range(_BISECTIONS):
            if not open_.any():
                break
            middle = np.sqrt(low * high)
            answer = np.zeros(low.size, np.int8)
            answer[open_] = lasts(middle, open_)
            allowed = np.where(open_ & (answer == 1), middle, allowed)
            failing = np.where(open_ & (answer == 0), middle, failing)
            unknown |= answer == -1
            above = (answer == 1) | ((answer == -1) & beyond)
            low, high = np.where(open_ & above, middle, low), np.where(open_ & ~above, middle, high)
            open_ = open_ & (high > low * (1.0 + 0.2 * rtol))
        return allowed, failing, unknown

    everywhere = np.ones(low.size, np.bool_)
    at_low, at_high = lasts(low, everywhere), lasts(high, everywhere)
    reason = np.select(
        [at_high == 1, at_low == 0, (at_low == -1) | (at_high == -1)],
        [Reason.ALWAYS, Reason.NEVER, Reason.UNRESOLVED],
        Reason.ANSWERED,
    ).astype(np.int8)
    allowed, failing, unknown = narrow(low, high, reason == Reason.ANSWERED, False)
    allowed, failing, _ = narrow(allowed, failing, unknown, True)
    reason[(reason == Reason.ANSWERED) & (failing > allowed * (1.0 + rtol))] = Reason.UNRESOLVED
    answered = reason == Reason.ANSWERED
    limit = None
    if strength is not None:
        limit = np.where(reason == Reason.ALWAYS, Limit.NONE, Limit.UNRESOLVED).astype(np.int8)
        if answered.any():
            limit[answered] = fates(failing, answered)[0]["first_limit"]
    return np.where(answered, np.sqrt(allowed * failing), np.nan), reason, limit


def _fates(
    program: Program, films: Parameters, tight: float, strength: StrengthOf | None
) -> dict[str, npt.NDArray[Any]]:
    """Return the results of a sweep over scattered films, for which a breakdown is a failure."""
    if strength is None:
        return solve_auto(program, films, tight).by_name()
    choice = choose(program, "auto", "auto", max(tight, SMALLEST_RTOL), None, has_dead_load(films))
    found = solve_with_limits(program, films, choice, strength)
    first, time = found["first_limit"], found["time_to_breakdown"]
    broken = first == Limit.BREAKDOWN
    cases = [first == Limit.UNRESOLVED, broken & (time == 0.0), broken]
    fate = [Outcome.UNRESOLVED, Outcome.FAILS_AT_ONCE, Outcome.FAILS_LATER]
    found["outcome"] = np.select(cases, fate, found["outcome"])
    found["time_to_failure"] = np.where(broken, time, found["time_to_failure"])
    if "cycles_to_failure" in found:
        completed = repetitions_before(program, films, time)
        found["cycles_to_failure"] = np.where(broken, completed, found["cycles_to_failure"])
    return found
