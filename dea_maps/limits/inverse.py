"""Inverse questions, answered by root finding on the kernels: how hard may a film be driven, how far does it get.

Every answer is a data set with the answer itself and ``reason``, a flag that says whether there is one. Where a
breakdown strength is given, see `dea_maps.breakdown`, the film must not break down either, and ``limit`` says what
limits it.
"""

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..materials.strength import Strength, StrengthOf, check_strength, excess, strength_of
from ..outcomes import Limit, Outcome, Reason
from ..programs import Ramp, Step
from ..sweeps.dead_load import critical_stretch, film_of, has_dead_load, largest_field, relaxed_threshold
from ..sweeps.parameters import ParameterLike
from ..sweeps.solve import solve_auto, trace
from .answers import Flags, answer, broadcast, roots, tight_rtol

Array = npt.NDArray[np.float64]

SLOWEST, FASTEST = 1e-6, 1e5
"""Ramp rates among which `allowable_rate` looks, in critical fields per relaxation time."""
# The slowest ramp that it follows in time, where breakdown limits it.
_SLOWEST_FOLLOWED = 1e-4
# A field at which a film under a dead load fails at once, over that of which rounding does not tell.
_BEYOND_ROUNDING = 1.0 + 1e-14

# An internal stretch beyond every failure, over the stretch at the instability of the relaxed film.
_FAR = 1e3

Film = dict[str, Array]
"""Parameters of films by name: the modulus ratio, and the prestretch or the stress of those under a dead load."""


def film_quantities(
    modulus_ratio: ParameterLike, prestretch: ParameterLike | None, stress: ParameterLike | None
) -> dict[str, tuple[ParameterLike, float, bool]]:
    """Return the parameters of films with their bounds, as `dea_maps.limits.answers.broadcast` takes them.

    Raises
    ------
    ValueError
        If both a prestretch and a stress are given.

    Examples
    --------
    >>> film_quantities(4.0, 2.0, None)
    {'modulus_ratio': (4.0, 1.0, False), 'prestretch': (2.0, 1.0, False)}
    """
    if prestretch is not None and stress is not None:
        raise ValueError("prestretch and stress must not both be given: either stands for the dead load")
    quantities = {"modulus_ratio": (modulus_ratio, 1.0, False)}
    for name, value, lowest in (("prestretch", prestretch, 1.0), ("stress", stress, 0.0)):
        if value is not None:
            quantities[name] = (value, lowest, False)
    return quantities


def _fields_of(film: Film) -> tuple[Array, Array]:
    """Return the largest fields that films carry: relaxed, and at once."""
    ratio, start, load = film_of(film)
    if not has_dead_load(film):
        return np.ones_like(ratio), np.sqrt(ratio)
    threshold = relaxed_threshold(load)
    return threshold, np.maximum(largest_field(start, ratio, load), threshold)


def _farthest(film: Film) -> Array:
    """Return the stretch at failure just above the relaxed threshold, which the slowest ramps tend to."""
    ratio, _, load = film_of(film)
    relaxed = critical_stretch(np.ones_like(load), np.ones_like(load), load)

    def lacks(internal: Array, ratio: Array, load: Array, threshold: Array) -> Array:
        return largest_field(internal, ratio, load) - threshold

    arguments = ratio, load, _fields_of(film)[0]
    internal, _ = roots(lacks, relaxed, _FAR * relaxed, ratio > 1.0, arguments, xrtol=1e-15)
    return critical_stretch(internal, ratio, load)


def allowable_field(
    lifetime: ParameterLike,
    modulus_ratio: ParameterLike,
    rtol: float = 1e-6,
    strength: Strength | None = None,
    *,
    prestretch: ParameterLike | None = None,
    stress: ParameterLike | None = None,
) -> xr.Dataset:
    """Find the largest constant field that a film sustains without failure for a given time.

    The time to failure under a constant field falls from infinity, just above the relaxed critical field, to zero at
    ``sqrt(modulus_ratio)``, (23) and (26) of Zhao, Koh and Suo (2011). Under a dead load, (18) to (20), it does so from
    the relaxed threshold of that load to what the film carries at once.

    Parameters
    ----------
    lifetime : number, 1-D array or DataArray
        In relaxation times, at least 0; may be infinite.
    modulus_ratio : number, 1-D array or DataArray
        As in `dea_maps.sweep`.
    rtol : float
        Relative error allowed in the field, from 1e-10 to 1e-3.
    strength : float or callable, optional
        The true field at which the film breaks down, as in `dea_maps.breakdown`; by default that is not asked about.
    prestretch, stress : number, 1-D array or DataArray, optional
        Dead load, as in `dea_maps.sweep`; at most one of the two.

    Returns
    -------
    Dataset
        ``allowable_field`` normalised by the relaxed critical field: the film fails after `lifetime`, and under
        any larger field sooner; ``reason``; with a strength ``limit``, "instability" or "breakdown".

    Raises
    ------
    TypeError, ValueError
        If something is of the wrong kind or out of bounds.

    Examples
    --------
    >>> round(allowable_field(2.443625636, 4.0, rtol=1e-9).allowable_field.item(), 7)
    1.2
    """
    life, *of_film = broadcast(lifetime=(lifetime, 0.0, True), **film_quantities(modulus_ratio, prestretch, stress))
    tight = tight_rtol(rtol)
    film, wanted = _named(of_film), life.values.ravel()
    low, top = _fields_of(film)
    at_once = top
    if has_dead_load(film):
        top = top * _BEYOND_ROUNDING

    def field_of(s: Array, low: Array, top: Array) -> Array:
        return low + (top - low) * s * s  # the time to failure grows like 1/s

    def lasting(s: Array, low: Array, top: Array, wanted: Array, *of_film: Array) -> Array:
        cells = {"field": field_of(s, low, top), **dict(zip(film, of_film, strict=True))}
        time = solve_auto(Step(), cells, tight).time_to_failure
        return np.where(np.isnan(time), 0.5, time / (time + wanted) - 0.5)

    inner = np.isfinite(wanted) & (wanted > 0.0) & (top > low)
    s, reason = roots(
        lasting, np.zeros_like(low), np.ones_like(low), inner, (low, top, wanted, *film.values()), xrtol=0.1 * rtol
    )
    found = np.where(inner, field_of(s, low, top), np.where(np.isinf(wanted), low, at_once))
    limit = None
    if strength is not None:
        found, reason, limit = _or_breakdown(found, reason, film, wanted, strength_of(strength), rtol)
    words = "largest constant field that a film sustains without failure for lifetime"
    return answer("allowable_field", found, reason, life, words, limit)


def _named(arrays: Iterable[xr.DataArray]) -> Film:
    return {str(array.name): array.values.ravel() for array in arrays}


def _or_breakdown(
    field: Array, reason: Flags, film: Film, lifetime: Array, strength: StrengthOf, rtol: float
) -> tuple[Array, Flags, Flags]:
    """Return the largest fields sustained without breakdown either, from those sustained without instability."""
    tight = tight_rtol(rtol)
    at_limit = solve_auto(Step(), {"field": field, **film}, tight)
    farthest = np.where(at_limit.outcome == Outcome.SURVIVES, at_limit.final_stretch, at_limit.critical_stretch)
    load = film_of(film)[2]
    farthest = np.where(np.isinf(lifetime), critical_stretch(np.ones_like(load), np.ones_like(load), load), farthest)
    check_strength(strength, farthest)

    def over(field: Array, lifetime: Array, *of_film: Array) -> Array:
        cells = {"field": field, **dict(zip(film, of_film, strict=True))}
        ends = np.where(np.isinf(lifetime), 0.0, lifetime)[:, np.newaxis]
        stretch = trace(Step(), cells, ends, tight)[0][:, 0]
        relaxed = solve_auto(Step(), cells, tight).final_stretch
        stretch = np.where(np.isinf(lifetime), relaxed, stretch)
        return np.where(np.isnan(stretch), 1.0, excess(strength, field, stretch))  # beyond the instability

    broken = (reason == Reason.ANSWERED) & (excess(strength, field, farthest) > 0.0)
    lower, why = roots(over, np.zeros_like(field), field, broken, (lifetime, *film.values()), xrtol=0.1 * rtol)
    reason = np.where(broken, why, reason).astype(np.int8)
    limit = np.where(
        reason == Reason.ANSWERED, np.where(broken, Limit.BREAKDOWN, Limit.INSTABILITY), Limit.UNRESOLVED
    ).astype(np.int8)
    return np.where(broken, lower, field), reason, limit


def allowable_rate(
    stretch: ParameterLike,
    modulus_ratio: ParameterLike,
    rtol: float = 1e-6,
    strength: Strength | None = None,
    *,
    prestretch: ParameterLike | None = None,
    stress: ParameterLike | None = None,
) -> xr.Dataset:
    """Find the fastest ramp under which a film gets to a given stretch before it fails.

    The stretch at failure falls with the ramp rate, to that of a film that cannot flow, ``2**(1/3)`` without a dead
    load; the field at which the film gets to a stretch grows. Stretches count from the unstretched film.

    Parameters
    ----------
    stretch : number, 1-D array or DataArray
        At least 1.
    modulus_ratio : number, 1-D array or DataArray
        As in `dea_maps.sweep`.
    rtol : float
        Relative error allowed in the rate, from 1e-10 to 1e-3; where the stretch hardly depends on it, in the stretch.
    strength : float or callable, optional
        The true field at which the film breaks down, as in `dea_maps.breakdown`; by default that is not asked about.
    prestretch, stress : number, 1-D array or DataArray, optional
        Dead load, as in `dea_maps.sweep`; at most one of the two.

    Returns
    -------
    Dataset
        ``allowable_rate`` in relaxed critical fields per relaxation time; ``reason``: "always" where any rate will do,
        "never" where none, "beyond_rates" where the answer is not from 1e-6 to 1e5, or below 1e-4 and limited by
        breakdown. NaN there. With a strength ``limit``, "instability", "breakdown", or "none" where any rate will do.

    Raises
    ------
    TypeError, ValueError
        If something is of the wrong kind or out of bounds.

    Examples
    --------
    >>> round(allowable_rate(1.423228766, 4.0, rtol=1e-9).allowable_rate.item(), 6)
    1.0
    """
    aim, *of_film = broadcast(stretch=(stretch, 1.0, False), **film_quantities(modulus_ratio, prestretch, stress))
    tight = tight_rtol(rtol)
    film, wanted = _named(of_film), aim.values.ravel()
    m = film["modulus_ratio"]

    def reaches(log_rate: Array, wanted: Array, *of_film: Array) -> Array:
        cells = {"rate": np.exp(log_rate), **dict(zip(film, of_film, strict=True))}
        return np.asarray(solve_auto(Ramp(), cells, tight).critical_stretch / wanted - 1.0)

    slowest = _SLOWEST_FOLLOWED if has_dead_load(film) else SLOWEST
    low, high = np.full_like(m, np.log(slowest)), np.full_like(m, np.log(FASTEST))
    slow, fast = (reaches(log_rate, wanted, *film.values()) for log_rate in (low, high))
    farthest = _farthest(film)
    _, at_once = _fields_of(film)
    nearest = solve_auto(Step(), {"field": 2.0 * at_once, **film}, tight).critical_stretch
    always = wanted <= nearest
    inner = (slow > 0.0) & (fast < 0.0) & ~always
    log_rate, reason = roots(reaches, low, high, inner, (wanted, *film.values()), xrtol=0.1 * rtol)
    never = wanted >= np.where(m == 1.0, nearest, farthest)
    outside = np.where(always, Reason.ALWAYS, np.where(never, Reason.NEVER, Reason.BEYOND_RATES))
    reason = np.where(inner, reason, outside).astype(np.int8)
    limit = None
    if strength is not None:
        log_rate, reason, limit = _rate_or_breakdown(log_rate, reason, film, wanted, strength_of(strength), rtol)
    words = "fastest ramp under which a film gets to stretch"
    return answer("allowable_rate", np.exp(log_rate), reason, aim, words, limit)


def _rate_or_breakdown(
    log_rate: Array, reason: Flags, film: Film, wanted: Array, strength: StrengthOf, rtol: float
) -> tuple[Array, Flags, Flags]:
    """Return the fastest ramps under which films get to a stretch without breaking down either."""
    tight = tight_rtol(rtol)
    check_strength(strength, wanted)
    largest = strength(wanted) / wanted**2  # the nominal field at which the film breaks down at that stretch

    def reaches(log_rate: Array, wanted: Array, largest: Array, *of_film: Array) -> Array:
        rate = np.exp(log_rate)
        cells = {"rate": rate, **dict(zip(film, of_film, strict=True))}
        stretch = trace(Ramp(), cells, (largest / rate)[:, np.newaxis], tight)[0][:, 0]
        return np.where(np.isnan(stretch), 1.0, stretch / wanted - 1.0)  # NaN: it got farther, and failed

    arguments = (wanted, largest, *film.values())
    fastest = np.where(reason == Reason.ALWAYS, np.log(FASTEST), log_rate)
    asked = np.isin(reason, (Reason.ANSWERED, Reason.ALWAYS))
    broken = np.array(asked)
    broken[asked] = reaches(fastest[asked], *(argument[asked] for argument in arguments)) < 0.0
    slowest = np.full_like(wanted, np.log(_SLOWEST_FOLLOWED))
    inner = broken & (fastest > slowest)
    inner[inner] = reaches(slowest[inner], *(argument[inner] for argument in arguments)) > 0.0
    lower, why = roots(reaches, slowest, fastest, inner, arguments, xatol=0.1 * rtol)
    # NaN: held there, the film fails in the end.
    relaxed = solve_auto(Step(), {"field": largest, **film}, tight).final_stretch
    outside = np.where(relaxed <= wanted, Reason.NEVER, Reason.BEYOND_RATES)
    reason = np.where(broken, np.where(inner, why, outside), reason).astype(np.int8)
    cases = [broken, reason == Reason.ALWAYS, reason == Reason.ANSWERED]
    limit = np.select(cases, [Limit.BREAKDOWN, Limit.NONE, Limit.INSTABILITY], Limit.UNRESOLVED).astype(np.int8)
    return np.where(broken, lower, log_rate), reason, limit


def reachable_stretch(
    field: ParameterLike,
    time: ParameterLike,
    modulus_ratio: ParameterLike,
    rtol: float = 1e-6,
    strength: Strength | None = None,
    *,
    prestretch: ParameterLike | None = None,
    stress: ParameterLike | None = None,
) -> xr.Dataset:
    """Find how far a film gets under a constant field that is held for a given time.

    Parameters
    ----------
    field, modulus_ratio : number, 1-D array or DataArray
        As in `dea_maps.sweep`.
    time : number, 1-D array or DataArray
        In relaxation times, at least 0; may be infinite.
    rtol : float
        Relative error allowed in the stretch, from 1e-10 to 1e-3.
    strength : float or callable, optional
        The true field at which the film breaks down, as in `dea_maps.breakdown`; by default that is not asked about.
    prestretch, stress : number, 1-D array or DataArray, optional
        Dead load, as in `dea_maps.sweep`; at most one of the two.

    Returns
    -------
    Dataset
        ``reachable_stretch``; ``reason``: "never" where the film fails before that time, "breaks_down" where it breaks
        down before. NaN there.

    Raises
    ------
    TypeError, ValueError
        If something is of the wrong kind or out of bounds.

    Examples
    --------
    >>> reachable_stretch(1.2, [0.0, 1.0], 4.0).reachable_stretch.values.round(3).tolist()
    [1.034, 1.177]
    """
    quantities = film_quantities(modulus_ratio, prestretch, stress)
    held, end, *of_film = broadcast(field=(field, 0.0, False), time=(time, 0.0, True), **quantities)
    tight = tight_rtol(rtol)
    cells = {"field": held.values.ravel(), **_named(of_film)}
    until, indefinite = end.values.ravel(), np.isinf(end.values.ravel())
    film = solve_auto(Step(), cells, tight)
    stretch = trace(Step(), cells, np.where(indefinite, 0.0, until)[:, np.newaxis], tight)[0][:, 0]
    stretch = np.where(indefinite, film.final_stretch, stretch)
    lost = [film.outcome == Outcome.UNRESOLVED, film.time_to_failure <= until, np.isnan(stretch)]
    reason = np.select(lost, [Reason.UNRESOLVED, Reason.NEVER, Reason.UNRESOLVED], Reason.ANSWERED).astype(np.int8)
    if strength is not None:
        limit = strength_of(strength)
        most = np.where(reason == Reason.NEVER, film.critical_stretch, stretch)
        check_strength(limit, most)
        breaks = excess(limit, np.where(reason == Reason.NEVER, film.critical_field, cells["field"]), most) > 0.0
        reason[breaks] = Reason.BREAKS_DOWN
    return answer("reachable_stretch", stretch, reason, held, "stretch after the field was held")
