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
from ..outcomes import Limit, Outcome, flag_attributes
from ..program_text import program_of
from ..programs import Program, shape_of
from ..sweeps.chunks import cut
from ..sweeps.dataset import with_maps
from ..sweeps.dead_load import has_dead_load
from ..sweeps.grid import make_grid
from ..sweeps.loading import field_at
from ..sweeps.methods import LARGEST_RTOL, Choice
from ..sweeps.product import product_of
from ..sweeps.solve import solve, solve_auto
from .answers import SMALLEST_RTOL, tight_rtol
from .passage import Ends, first_passage, peak_field

Array = npt.NDArray[np.float64]
Cells = dict[str, Array]

# When a field that is held in the end is held, in relaxation times.
_LATE = 1e200
_RESULTS = ("time_to_breakdown", "breakdown_stretch", "breakdown_field")

RTOL = 1e-6
"""Relative error allowed by default."""
BLOCK = 4096
"""Films of a map that are followed side by side: memory for more would not make them faster."""


def breakdown(ds: xr.Dataset, strength: Strength, rtol: float = RTOL) -> xr.Dataset:
    """Find which comes first in every cell of a map, electromechanical instability or electrical breakdown.

    A film breaks down when its true field, the nominal field times the stretch squared, first reaches its strength, at
    ``field = strength(stretch)/stretch**2``. That is sought along the loading, of any program and with or without a
    dead load: where the field jumps, at the end of every step of an integration in time and, where the true field may
    have a maximum there, within the step; its time is a root within a step. Under a program that is repeated without
    end the stretch rises from cycle to cycle, so that a film that survives breaks down if it does so in its limit
    cycle, or never. Stretches count from the unstretched film.

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
    Some tens of microseconds for each film that is followed, times the number of cycles until it breaks down; under
    the largest field of the program at the largest stretch of the film most films that do not break down are known not
    to, and cost as in `dea_maps.sweep`. What needs more than two million steps is unresolved.

    Examples
    --------
    >>> import dea_maps as dm
    >>> ds = breakdown(dm.sweep(dm.Step(), field=[0.9, 1.2, 1.9], modulus_ratio=4.0), 3.2)
    >>> ds.first_limit.values.tolist(), ds.breakdown_stretch.values.round(4).tolist()
    ([0, 2, 1], [nan, 1.633, nan])
    """
    tight_rtol(rtol)
    if not isinstance(ds, xr.Dataset):
        raise TypeError(f"ds must be a data set; got {brief(ds)}")
    try:
        program = program_of(ds.attrs)
    except ValueError:
        found_program = brief(ds.attrs.get("program"))
        raise ValueError(f"ds must be a map of a loading program; got the program {found_program}") from None
    loads = [name for name in ("prestretch", "stress") if name in ds.coords]
    grid = make_grid(program, **{name: ds[name] for name in (*program.parameters, "modulus_ratio", *loads)})
    cells = {name: values.ravel() for name, values in grid.parameters.items()}
    life = ds["time_to_failure"].transpose(*grid.dims).values.ravel() if "time_to_failure" in ds else None
    found = _limited(program, cells, life, strength_of(strength), rtol)
    return with_limits(ds, grid.dims, {name: values.reshape(grid.shape) for name, values in found.items()}, rtol)


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
    rtol = rtol_of(choice)
    blocks = cut(parameters["modulus_ratio"].shape, BLOCK)
    found: list[dict[str, Any]] = []
    for number in range(blocks.count):
        cells = {name: np.atleast_1d(values[blocks.index(number)]).ravel() for name, values in parameters.items()}
        product = product_of(program, parameters, blocks.index(number)) if choice.shared else None
        solution = solve(program, cells, choice, product=product, threads=threads)
        maps: dict[str, Any] = solution.by_name()
        found.append(maps | _limited(program, cells, solution.time_to_failure, strength, rtol))
        if on_cells is not None:
            on_cells(solution.outcome.size)
    return {name: np.concatenate([block[name] for block in found]) for name in found[0]}


def _limited(
    program: Program, cells: Cells, life: Array | None, strength: StrengthOf, rtol: float
) -> dict[str, npt.NDArray[Any]]:
    """Return what comes first in cells, by the names of the variables; not after a time to failure that is known."""
    limit, results = _first_limits(program, cells, strength, rtol)
    if life is not None:
        time = results["time_to_breakdown"]
        results["time_to_breakdown"] = np.where(time > life, life, time)
    found: dict[str, Any] = {"first_limit": limit, **results}
    return {name: found[name] for name in VARIABLES}


def _first_limits(
    program: Program, cells: Cells, strength: StrengthOf, rtol: float
) -> tuple[npt.NDArray[np.int8], dict[str, Array]]:
    """Return the first limit of scattered films, and time, stretch and nominal field at breakdown."""
    found = solve_auto(program, cells, tight_rtol(rtol))
    survives = found.outcome == Outcome.SURVIVES
    at_end = np.where(survives, found.final_stretch, found.critical_stretch)
    if shape_of(program) is not None and not has_dead_load(cells):  # the field only rises, and so does the stretch
        held = field_at(program, cells, np.full((survives.size, 1), _LATE))[:, 0]
        most, field = at_end, np.where(survives, held, found.critical_field)
    else:
        largest = found.largest_stretch
        most, field = at_end if largest is None else largest, peak_field(program, cells)
    check_strength(strength, most)
    known = found.outcome != Outcome.UNRESOLVED
    limit = np.select([~known, survives], [Limit.UNRESOLVED, Limit.NONE], Limit.INSTABILITY).astype(np.int8)
    results = {name: np.full(survives.shape, np.nan) for name in _RESULTS}
    may_break = known & (excess(strength, field, most) > 0.0)
    if may_break.any():
        own = {name: values[may_break] for name, values in cells.items()}
        ends = Ends(survives[may_break], at_end[may_break], found.critical_field[may_break])
        passage = first_passage(program, own, strength, ends, rtol)
        limit[may_break] = passage.limit
        for name, values in zip(results, passage[1:], strict=True):
            results[name][may_break] = values
    return limit, results
