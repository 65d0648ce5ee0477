"""Electrical breakdown as a limit on the true field: which comes first, that or the instability."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..checks import brief
from ..materials.strength import Strength, StrengthOf, check_strength, excess, strength_of
from ..nomenclature import BREAKDOWN as VARIABLES
from ..nomenclature import cf_attributes
from ..outcomes import Limit, Outcome, Reason, flag_attributes
from ..program_text import program_of
from ..programs import Program, Step, shape_of
from ..sweeps.chunks import cut
from ..sweeps.dataset import with_maps
from ..sweeps.grid import make_grid
from ..sweeps.loading import field_at, loading_time
from ..sweeps.methods import LARGEST_RTOL, Choice
from ..sweeps.product import product_of
from ..sweeps.solve import solve, solve_auto, trace
from .answers import SMALLEST_RTOL, roots, tight_rtol

Array = npt.NDArray[np.float64]
Cells = dict[str, Array]

# Times to breakdown from the first looked at to the longest, over the scale of the loading.
_EARLIEST, _LATEST = 1e-15, 1e9
# When a field that is held in the end is held, in relaxation times.
_LATE = 1e200
_RESULTS = ("time_to_breakdown", "breakdown_stretch", "breakdown_field")

RTOL = 1e-6
"""Relative error allowed by default."""
BLOCK = 4096
"""Films of a map that are followed side by side: memory for more would not make them faster."""


def breakdown(ds: xr.Dataset, strength: Strength, rtol: float = RTOL) -> xr.Dataset:
    """Find which comes first in every cell of a map, electromechanical instability or electrical breakdown.

    A film breaks down when its true field, the nominal field times the stretch squared, reaches its strength. Along
    each of the loading programs the film spreads and the field does not fall; as long as the nominal field that it
    withstands, ``strength(stretch)/stretch**2``, falls with the stretch, it breaks down at most once, and whether it
    does so before it fails is known from the state at failure. When, is found by root finding on trajectories.

    Parameters
    ----------
    ds : Dataset
        From `dea_maps.sweep` or `dea_maps.trajectory`, or of its variables some.
    strength : float or callable
        The true field at which the film breaks down, normalised by the relaxed critical field; or a
        function that returns it for an array of stretches, as `Material.strength`.
    rtol : float
        Relative error allowed in the results, from 1e-10 to 1e-3. Where the time depends on the strength so strongly
        that rounding would decide, right after the beginning and where a film that survives comes to rest, it is the
        time of a strength that differs by no more than that.

    Returns
    -------
    Dataset
        All of `ds`; ``first_limit`` (CF flags: 0 none, 1 instability, 2 breakdown, 3 unresolved); and, where
        breakdown comes first, ``time_to_breakdown``, ``breakdown_stretch`` and ``breakdown_field`` (nominal, over the
        relaxed critical field), NaN elsewhere. A film that breaks down at once does so while the field is switched on.
        No film breaks down later than at ``time_to_failure``, if `ds` has it. `rtol` is the attribute
        ``breakdown_rtol``.

    Raises
    ------
    TypeError, ValueError
        If something is of the wrong kind or out of bounds, or if ``strength(stretch)/stretch**2`` does not fall.

    Notes
    -----
    Some half a millisecond for each film that breaks down; the others cost as in `dea_maps.sweep`.

    Examples
    --------
    >>> import dea_maps as dm
    >>> ds = breakdown(dm.sweep(dm.Step(), field=[0.9, 1.2, 1.9], modulus_ratio=4.0), 3.2)
    >>> ds.first_limit.values.tolist(), ds.breakdown_stretch.values.round(4).tolist()
    ([0, 2, 1], [nan, 1.633, nan])
    """
    tight = tight_rtol(rtol)
    if not isinstance(ds, xr.Dataset):
        raise TypeError(f"ds must be a data set; got {brief(ds)}")
    try:
        program = program_of(ds.attrs)
    except ValueError:
        found_program = brief(ds.attrs.get("program"))
        raise ValueError(f"ds must be a map of a loading program; got the program {found_program}") from None
    check_served(program, "prestretch" in ds.coords or "stress" in ds.coords)
    grid = make_grid(program, **{name: ds[name] for name in (*program.parameters, "modulus_ratio")})
    cells = {name: values.ravel() for name, values in grid.parameters.items()}
    life = ds["time_to_failure"].transpose(*grid.dims).values.ravel() if "time_to_failure" in ds else None
    found = _limited(program, cells, life, strength_of(strength), tight)
    return with_limits(ds, grid.dims, {name: values.reshape(grid.shape) for name, values in found.items()}, rtol)


def check_served(program: Program, dead_load: bool) -> None:
    """Check that breakdown can be found: for free films under a field that only rises.

    Raises
    ------
    ValueError
        If not.
    """
    if shape_of(program) is None or dead_load:
        raise ValueError(
            "breakdown can be found for films without a dead load under a field that only rises, as of step, ramp and "
            f"ramp_hold; got {program.name}{' with a dead load' if dead_load else ''}"
        )


def with_limits(
    ds: xr.Dataset, dims: tuple[str, ...], found: Mapping[str, npt.NDArray[Any]], rtol: float
) -> xr.Dataset:
    """Return a map with what comes first in its cells, described.

    Parameters
    ----------
    ds : Dataset
        The map.
    dims : tuple of str
        The dimensions of its cells.
    found : mapping of str to ndarray
        ``first_limit`` and its companions, of the shape of the cells.
    rtol : float
        How accurate they are.
    """
    more = {"first_limit": flag_attributes(Limit)}
    maps = {
        name: xr.Variable(dims, values, {**cf_attributes(name), **more.get(name, {})}) for name, values in found.items()
    }
    return with_maps(ds, maps).assign_attrs(breakdown_rtol=rtol)


def rtol_of(choice: Choice) -> float:
    """Return how accurately the breakdown of a map is found: as the map, or by default, if its method has fixed steps.

    Raises
    ------
    ValueError
        If that is more accurate than it can be found.

    Examples
    --------
    >>> rtol_of(Choice("quadrature", "stretch", 1e-8, None)), rtol_of(Choice("rk4", "fold", None, 0.01))
    (1e-08, 1e-06)
    """
    rtol = RTOL if choice.rtol is None else choice.rtol
    try:
        tight_rtol(rtol)
    except ValueError:
        raise ValueError(
            f"rtol must be from {SMALLEST_RTOL} to {LARGEST_RTOL} with a breakdown strength; got {rtol}"
        ) from None
    return rtol


def solve_with_limits(
    program: Program,
    parameters: Mapping[str, Array],
    choice: Choice,
    strength: StrengthOf,
    *,
    on_cells: Callable[[int], object] | None = None,
    threads: int | None = None,
) -> dict[str, npt.NDArray[Any]]:
    """Compute every cell of a grid, and what comes first in it, some cells after the others.

    Parameters
    ----------
    program, parameters, choice, on_cells, threads
        As in `dea_maps.solve.solve`.
    strength : callable
        The true field at which the film breaks down, normalised by the relaxed critical field.

    Returns
    -------
    dict of str to ndarray
        The maps of a sweep and of `breakdown`, in the order of the cells.
    """
    tight = tight_rtol(rtol_of(choice))
    blocks = cut(parameters["modulus_ratio"].shape, BLOCK)
    found: list[dict[str, Any]] = []
    for number in range(blocks.count):
        cells = {name: np.atleast_1d(values[blocks.index(number)]).ravel() for name, values in parameters.items()}
        product = product_of(program, parameters, blocks.index(number)) if choice.shared else None
        solution = solve(program, cells, choice, product=product, threads=threads)
        maps: dict[str, Any] = solution.by_name()
        found.append(maps | _limited(program, cells, solution.time_to_failure, strength, tight))
        if on_cells is not None:
            on_cells(solution.outcome.size)
    return {name: np.concatenate([block[name] for block in found]) for name in found[0]}


def _limited(
    program: Program, cells: Cells, life: Array | None, strength: StrengthOf, tight: float
) -> dict[str, npt.NDArray[Any]]:
    """Return what comes first in cells, by the names of the variables; not after a time to failure that is known."""
    limit, results = _first_limits(program, cells, strength, tight)
    if life is not None:
        time = results["time_to_breakdown"]
        results["time_to_breakdown"] = np.where(time > life, life, time)
    found: dict[str, Any] = {"first_limit": limit, **results}
    return {name: found[name] for name in VARIABLES}


def _first_limits(
    program: Program, cells: Cells, strength: StrengthOf, tight: float
) -> tuple[npt.NDArray[np.int8], dict[str, Array]]:
    """Return the first limit of scattered films, and time, stretch and nominal field at breakdown."""
    found = solve_auto(program, cells, tight)
    survives = found.outcome == Outcome.SURVIVES
    stretch = np.where(survives, found.final_stretch, found.critical_stretch)
    held = field_at(program, cells, np.full((survives.size, 1), _LATE))[:, 0]
    field = np.where(survives, held, found.critical_field)
    check_strength(strength, stretch)
    exceeds = excess(strength, field, stretch) > 0.0
    cases = [found.outcome == Outcome.UNRESOLVED, exceeds, survives]
    limit = np.select(cases, [Limit.UNRESOLVED, Limit.BREAKDOWN, Limit.NONE], Limit.INSTABILITY).astype(np.int8)
    results = {name: np.full(survives.shape, np.nan) for name in _RESULTS}
    broken = limit == Limit.BREAKDOWN
    if broken.any():
        own = {name: values[broken] for name, values in cells.items()}
        life = np.where(survives, np.inf, found.time_to_failure)[broken]
        time, at = _first_passage(program, own, life, strength, tight)
        limit[broken] = np.where(np.isnan(time), Limit.UNRESOLVED, Limit.BREAKDOWN)
        for name, values in zip(results, (time, stretch_at(strength, at, stretch[broken]), at), strict=True):
            results[name][broken] = np.where(np.isnan(time), np.nan, values)
    return limit, results


def _first_passage(
    program: Program, cells: Cells, life: Array, strength: StrengthOf, tight: float
) -> tuple[Array, Array]:
    """Return time and nominal field at breakdown of films that do break down; NaN where they are not found."""

    def excess_at(log_time: Array, life: Array, *columns: Array) -> Array:
        own, time = dict(zip(cells, columns, strict=True)), np.exp(log_time)
        over = _excess_at(program, own, time, strength, tight)
        return np.where(np.isnan(over) & (time >= life * (1.0 - 10.0 * tight)), 1.0, over)  # failed, but broken before

    columns = (life, *cells.values())
    scale = np.where(np.isfinite(life) & (life > 0.0), life, 1.0 + loading_time(program, cells))
    first = np.log(_EARLIEST * scale)
    last = np.log(scale * np.where(np.isinf(life), _LATEST, 1.0 + 10.0 * tight))
    later = ~((field_at(program, cells, np.zeros((life.size, 1)))[:, 0] > 0.0) & (excess_at(first, *columns) > 0.0))
    log_time, _ = roots(excess_at, first, last, later, columns, xatol=10.0 * tight)
    time = np.where(later, np.exp(log_time), 0.0)
    field = field_at(program, cells, time[:, np.newaxis])[:, 0].copy()
    if not later.all():
        at_once = {name: values[~later] for name, values in cells.items()}
        field[~later] = _field_at_once(field[~later], at_once["modulus_ratio"], strength, tight)
    return time, field


def _field_at_once(field: Array, modulus_ratio: Array, strength: StrengthOf, tight: float) -> Array:
    """Return the field at which films break down while it is switched on, before they can flow."""

    def excess_at(field: Array, ratio: Array) -> Array:
        cells = {"field": field, "modulus_ratio": ratio}
        over = _excess_at(Step(), cells, np.zeros_like(field), strength, tight)
        return np.where(np.isnan(over), 1.0, over)

    top = np.minimum(field, np.sqrt(modulus_ratio))
    low, everywhere = np.zeros_like(top), np.ones(top.shape, np.bool_)
    found, reason = roots(excess_at, low, top, everywhere, (modulus_ratio,), xrtol=tight)
    return np.where(reason == Reason.ANSWERED, found, top)


def stretch_at(strength: StrengthOf, field: Array, farthest: Array) -> Array:
    """Return the stretch at which a nominal field breaks a film down: a question of the strength alone."""
    known = np.isfinite(field)
    found, reason = roots(
        lambda stretch, field: excess(strength, field, stretch),
        np.ones_like(field),
        farthest,
        known,
        (field,),
        xrtol=1e-15,
    )
    return np.where(reason == Reason.ANSWERED, found, farthest)


def _excess_at(program: Program, cells: Cells, time: Array, strength: StrengthOf, tight: float) -> Array:
    """Return by how much the true field exceeds the strength at a time of each film; NaN where it has failed."""
    stretch = trace(program, cells, time[:, np.newaxis], tight)[0][:, 0]
    return excess(strength, field_at(program, cells, time[:, np.newaxis])[:, 0], stretch)
