"""Sweeps in memory: every cell of a grid solved."""

import os
from dataclasses import replace
from typing import NoReturn

import xarray as xr
from tqdm import tqdm

from ..notices import shown_notices
from ..plausibility import warn_implausible
from ..programs import Program
from .dataset import cell_bytes, make_dataset, provenance_of
from .dead_load import has_dead_load
from .grid import Grid, make_grid
from .loading import loading_time
from .methods import Choice, choose
from .parameters import ParameterLike
from .product import product_of
from .solve import Solution, sharing_pays, solve


def planned(
    program: Program,
    *,
    rtol: float = 1e-6,
    method: str = "auto",
    formulation: str = "auto",
    step: float | None = None,
    **parameters: ParameterLike | None,
) -> tuple[Grid, Choice]:
    """Return the grid of a sweep and how it would be solved, with everything checked and nothing computed.

    Parameters
    ----------
    program, rtol, method, formulation, step, **parameters
        As in `sweep`.

    Returns
    -------
    grid : Grid
    choice : Choice
        Shared if method and formulation are left to "auto", the sweep is a product grid, see
        `dea_maps.sweeps.product.product_of`, and `dea_maps.sweeps.solve.sharing_pays`.

    Raises
    ------
    TypeError, ValueError
        As in `sweep`.

    Examples
    --------
    >>> from dea_maps.programs import Step
    >>> grid, choice = planned(Step(), field=[0.9, 1.2], modulus_ratio=4.0, method="dopri5")
    >>> grid.cells, choice.method
    (2, 'dopri5')
    """
    grid = make_grid(program, **parameters)
    if program.repeats != 1 and grid.cells and not (loading_time(program, grid.parameters) > 0.0).all():
        raise ValueError(f"the repeated pieces of the program {program.name!r} must take time; got a duration of 0")
    dead_load = has_dead_load(grid.parameters)
    choice = choose(program, method, formulation, rtol, step, dead_load)
    if method == formulation == "auto" and grid.cells:
        product = product_of(program, grid.parameters)
        choice = replace(choice, shared=product is not None and sharing_pays(product, rtol))
    for name, kind in program.kinds.items() if grid.cells else ():
        if kind == "field":
            scale = float(grid.coords["modulus_ratio"].max()) ** 0.5
            warn_implausible("field", grid.coords[name].values, scale=scale)
    return grid, choice


def sweep(
    program: Program,
    *,
    modulus_ratio: ParameterLike,
    prestretch: ParameterLike | None = None,
    stress: ParameterLike | None = None,
    rtol: float = 1e-6,
    method: str = "auto",
    formulation: str = "auto",
    step: float | None = None,
    progress: bool = False,
    **parameters: ParameterLike,
) -> xr.Dataset:
    """Find whether, when and at what stretch a film fails, over all combinations of parameters.

    Solves equations (23), (25) and (26) of Zhao, Koh and Suo (2011) in every cell of the grid.

    Parameters
    ----------
    program : Program
        The loading program: ``Step()``, ``Ramp()``, ``RampHold()``, ...
    modulus_ratio : number, 1-D array or DataArray
        Unrelaxed over relaxed shear modulus, at least 1.
        A number has no dimension, a 1-D array a dimension of its own name; a DataArray broadcasts by the
        names of its dimensions, so that three of them on one dimension give scattered points.
    prestretch : number, 1-D array or DataArray, optional
        Stretch of at least 1 to which the film relaxed under its dead load before the voltage.
    stress : number, 1-D array or DataArray, optional
        Dead load applied to the fresh film with the voltage: equibiaxial nominal stress, normalised by the relaxed
        modulus, at least 0. At most one of `prestretch` and `stress`.
    rtol : float
        Relative error allowed in time to failure, critical stretch and critical field, from 1e-12 to 1e-3.
    method, formulation : str
        Names from `dea_maps.methods`; "auto" takes the fastest for the scene at this `rtol`. Cells of a product grid of
        many fields under a ramp and a hold then share integrations; the attribute ``sharing`` says so.
    step : float, optional
        Step of a method with fixed steps, in the formulation's independent variable; `rtol` is then not used.
    progress : bool
        Whether to draw a progress bar on standard error, and to say there when something is compiled first.
    **parameters : number, 1-D array or DataArray
        The parameters of the program by name, as ``field=``, ``rate=``: fields are normalised by the relaxed critical
        field, rates are in relaxed critical fields per relaxation time, times in relaxation times.

    Returns
    -------
    Dataset
        ``outcome`` (int8: 0 survives, 1 fails later, 2 fails at once, 3 unresolved), ``time_to_failure`` in
        relaxation times, ``critical_stretch``, ``critical_internal_stretch``, ``critical_field`` over the
        relaxed critical field, and ``final_stretch`` of what survives; NaN where a variable has no meaning.

    Raises
    ------
    TypeError, ValueError
        If a parameter is missing, not taken by the program, of the wrong kind or out of bounds; before
        computing.
    MemoryError
        If the result does not fit in memory.

    Warns
    -----
    ImplausibleWarning
        If a field is more than 100 times that at which films fail at once: it may be in V or V/m.

    Examples
    --------
    >>> import dea_maps as dm
    >>> ds = dm.sweep(dm.Step(), field=[1.05, 1.2, 1.5], modulus_ratio=4.0)
    >>> [f"{time:.5f}" for time in ds.time_to_failure.values]
    ['9.02824', '2.44363', '0.54638']
    """
    grid, choice = planned(
        program,
        modulus_ratio=modulus_ratio,
        prestretch=prestretch,
        stress=stress,
        rtol=rtol,
        method=method,
        formulation=formulation,
        step=step,
        **parameters,
    )
    return make_dataset(grid, _solved(grid, choice, progress), provenance_of(choice))


def progress_bar(grid: Grid) -> "tqdm[NoReturn]":
    """Draw cells done, rate and time left on standard error."""
    # nrows: where a terminal does not know its size, tqdm would show nothing.
    return tqdm(total=grid.cells, unit=" cells", unit_scale=True, desc=grid.program.name, nrows=2)


def _solved(grid: Grid, choice: Choice, progress: bool) -> Solution:
    """Solve all cells; a result that memory cannot hold is refused in one line."""
    size = grid.cells * cell_bytes(grid.program)
    refusal = f"the result of {grid.cells:,} cells needs {size / 2**30:,.1f} GiB of memory: more than there is"
    if size > _memory_of_machine():
        raise MemoryError(refusal)
    try:
        if not progress:
            return solve(grid.program, grid.parameters, choice, on_cells=None)
        with shown_notices(), progress_bar(grid) as bar:
            return solve(grid.program, grid.parameters, choice, on_cells=bar.update)
    except MemoryError as error:
        raise MemoryError(refusal) from error


def _memory_of_machine() -> float:
    """Return the bytes of memory; more may seem to be allocated, until the system ends the process."""
    if hasattr(os, "sysconf"):  # Windows has none, and allocates no more than there is
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return float("inf")
