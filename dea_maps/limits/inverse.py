"""Inverse questions, answered by root finding on the kernels: how hard may a film be driven, how far does it get.

Every answer is a data set with the answer itself and ``reason``, a flag that says whether there is one. Where a
breakdown strength is given, see `dea_maps.breakdown`, the film must not break down either, and ``limit`` says what
limits it.
"""

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..materials.strength import Strength, StrengthOf, check_strength, excess, strength_of
from ..outcomes import Limit, Outcome, Reason
from ..programs import Ramp, Step
from ..sweeps.parameters import ParameterLike
from ..sweeps.solve import solve_auto, trace
from .answers import Flags, answer, broadcast, roots, tight_rtol

Array = npt.NDArray[np.float64]

SLOWEST, FASTEST = 1e-6, 1e5
"""Ramp rates among which `allowable_rate` looks, in critical fields per relaxation time."""
# The slowest ramp that it follows in time, where breakdown limits it.
_SLOWEST_FOLLOWED = 1e-4
_ELASTIC_STRETCH = 2.0 ** (1.0 / 3.0)


def allowable_field(
    lifetime: ParameterLike, modulus_ratio: ParameterLike, rtol: float = 1e-6, strength: Strength | None = None
) -> xr.Dataset:
    """Find the largest constant field that a film sustains without failure for a given time.

    The time to failure under a constant field falls from infinity, just above the relaxed critical field, to zero at
    ``sqrt(modulus_ratio)``, (23) and (26) of Zhao, Koh and Suo (2011).

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
    life, ratio = broadcast(lifetime=(lifetime, 0.0, True), modulus_ratio=(modulus_ratio, 1.0, False))
    tight = tight_rtol(rtol)
    m, wanted = ratio.values.ravel(), life.values.ravel()
    top = np.sqrt(m)

    def field_of(s: Array, m: Array) -> Array:
        return 1.0 + (np.sqrt(m) - 1.0) * s * s  # the time to failure grows like 1/s

    def lasting(s: Array, m: Array, wanted: Array) -> Array:
        time = solve_auto(Step(), {"field": field_of(s, m), "modulus_ratio": m}, tight).time_to_failure
        return np.where(np.isnan(time), 0.5, time / (time + wanted) - 0.5)

    inner = np.isfinite(wanted) & (wanted > 0.0) & (m > 1.0)
    found = np.where(np.isinf(wanted) | (m == 1.0), 1.0, top)
    s, reason = roots(lasting, np.zeros_like(m), np.ones_like(m), inner, (m, wanted), xrtol=0.1 * rtol)
    found = np.where(inner, field_of(s, m), found)
    limit = None
    if strength is not None:
        found, reason, limit = _or_breakdown(found, reason, m, wanted, strength_of(strength), rtol)
    words = "largest constant field that a film sustains without failure for lifetime"
    return answer("allowable_field", found, reason, life, words, limit)


def _or_breakdown(
    field: Array, reason: Flags, m: Array, lifetime: Array, strength: StrengthOf, rtol: float
) -> tuple[Array, Flags, Flags]:
    """Return the largest fields sustained without breakdown either, from those sustained without instability."""
    tight = tight_rtol(rtol)
    at_limit = solve_auto(Step(), {"field": field, "modulus_ratio": m}, tight)
    farthest = np.where(at_limit.outcome == Outcome.SURVIVES, at_limit.final_stretch, at_limit.critical_stretch)
    check_strength(strength, farthest)

    def over(field: Array, m: Array, lifetime: Array) -> Array:
        cells = {"field": field, "modulus_ratio": m}
        ends = np.where(np.isinf(lifetime), 0.0, lifetime)[:, np.newaxis]
        stretch = trace(Step(), cells, ends, tight)[0][:, 0]
        relaxed = solve_auto(Step(), cells, tight).final_stretch
        stretch = np.where(np.isinf(lifetime), relaxed, stretch)
        return np.where(np.isnan(stretch), 1.0, excess(strength, field, stretch))  # beyond the instability

    broken = (reason == Reason.ANSWERED) & (excess(strength, field, farthest) > 0.0)
    lower, why = roots(over, np.zeros_like(m), field, broken, (m, lifetime), xrtol=0.1 * rtol)
    reason = np.where(broken, why, reason).astype(np.int8)
    limit = np.where(
        reason == Reason.ANSWERED, np.where(broken, Limit.BREAKDOWN, Limit.INSTABILITY), Limit.UNRESOLVED
    ).astype(np.int8)
    return np.where(broken, lower, field), reason, limit


def allowable_rate(
    stretch: ParameterLike, modulus_ratio: ParameterLike, rtol: float = 1e-6, strength: Strength | None = None
) -> xr.Dataset:
    """Find the fastest ramp under which a film gets to a given stretch before it fails.

    The stretch at failure falls with the ramp rate, to ``2**(1/3)``; the field at which the film gets to a stretch
    grows.

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
    aim, ratio = broadcast(stretch=(stretch, 1.0, False), modulus_ratio=(modulus_ratio, 1.0, False))
    tight = tight_rtol(rtol)
    m, wanted = ratio.values.ravel(), aim.values.ravel()

    def reaches(log_rate: Array, m: Array, wanted: Array) -> Array:
        ds = solve_auto(Ramp(), {"rate": np.exp(log_rate), "modulus_ratio": m}, tight)
        return np.asarray(ds.critical_stretch / wanted - 1.0)

    low, high = np.full_like(m, np.log(SLOWEST)), np.full_like(m, np.log(FASTEST))
    slow, fast = reaches(low, m, wanted), reaches(high, m, wanted)
    # Just above the relaxed critical field, a constant one lets the film get as far as the slowest ramp.
    just_above = {"field": np.full_like(m, np.nextafter(1.0, 2.0)), "modulus_ratio": m}
    farthest = solve_auto(Step(), just_above, tight).critical_stretch
    always = wanted <= _ELASTIC_STRETCH
    inner = (slow > 0.0) & (fast < 0.0) & ~always
    log_rate, reason = roots(reaches, low, high, inner, (m, wanted), xrtol=0.1 * rtol)
    never = wanted >= np.where(m == 1.0, _ELASTIC_STRETCH, farthest)
    outside = np.where(always, Reason.ALWAYS, np.where(never, Reason.NEVER, Reason.BEYOND_RATES))
    reason = np.where(inner, reason, outside).astype(np.int8)
    limit = None
    if strength is not None:
        log_rate, reason, limit = _rate_or_breakdown(log_rate, reason, m, wanted, strength_of(strength), rtol)
    words = "fastest ramp under which a film gets to stretch"
    return answer("allowable_rate", np.exp(log_rate), reason, aim, words, limit)


def _rate_or_breakdown(
    log_rate: Array, reason: Flags, m: Array, wanted: Array, strength: StrengthOf, rtol: float
) -> tuple[Array, Flags, Flags]:
    """Return the fastest ramps under which films get to a stretch without breaking down either."""
    tight = tight_rtol(rtol)
    check_strength(strength, wanted)
    largest = strength(wanted) / wanted**2  # the nominal field at which the film breaks down at that stretch

    def reaches(log_rate: Array, m: Array, wanted: Array, largest: Array) -> Array:
        rate = np.exp(log_rate)
        cells = {"rate": rate, "modulus_ratio": m}
        stretch = trace(Ramp(), cells, (largest / rate)[:, np.newaxis], tight)[0][:, 0]
        return np.where(np.isnan(stretch), 1.0, stretch / wanted - 1.0)  # NaN: it got farther, and failed

    arguments = (m, wanted, largest)
    fastest = np.where(reason == Reason.ALWAYS, np.log(FASTEST), log_rate)
    asked = np.isin(reason, (Reason.ANSWERED, Reason.ALWAYS))
    broken = np.array(asked)
    broken[asked] = reaches(fastest[asked], *(argument[asked] for argument in arguments)) < 0.0
    slowest = np.full_like(m, np.log(_SLOWEST_FOLLOWED))
    inner = broken & (fastest > slowest)
    inner[inner] = reaches(slowest[inner], *(argument[inner] for argument in arguments)) > 0.0
    lower, why = roots(reaches, slowest, fastest, inner, arguments, xatol=0.1 * rtol)
    # NaN: held there, the film fails in the end.
    relaxed = solve_auto(Step(), {"field": largest, "modulus_ratio": m}, tight).final_stretch
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
    held, end, ratio = broadcast(
        field=(field, 0.0, False), time=(time, 0.0, True), modulus_ratio=(modulus_ratio, 1.0, False)
    )
    tight = tight_rtol(rtol)
    cells = {"field": held.values.ravel(), "modulus_ratio": ratio.values.ravel()}
    until, for_good = end.values.ravel(), np.isinf(end.values.ravel())
    film = solve_auto(Step(), cells, tight)
    stretch = trace(Step(), cells, np.where(for_good, 0.0, until)[:, np.newaxis], tight)[0][:, 0]
    stretch = np.where(for_good, film.final_stretch, stretch)
    lost = [film.outcome == Outcome.UNRESOLVED, film.time_to_failure <= until, np.isnan(stretch)]
    reason = np.select(lost, [Reason.UNRESOLVED, Reason.NEVER, Reason.UNRESOLVED], Reason.ANSWERED).astype(np.int8)
    if strength is not None:
        limit = strength_of(strength)
        most = np.where(reason == Reason.NEVER, film.critical_stretch, stretch)
        check_strength(limit, most)
        breaks = excess(limit, np.where(reason == Reason.NEVER, film.critical_field, cells["field"]), most) > 0.0
        reason[breaks] = Reason.BREAKS_DOWN
    return answer("reachable_stretch", stretch, reason, held, "stretch after the field was held")
