"""Sweeps in memory: every cell of a grid solved."""

import os
import warnings
from collections.abc import Mapping
from typing import NoReturn

import xarray as xr
from tqdm import tqdm

from ..limits.breakdown import breakdown, rtol_of
from ..materials.material import Material
from ..materials.si_units import in_si
from ..notices import shown_notices
from ..programs import Program
from ..sweeps.dataset import cell_bytes, make_dataset, provenance_of
from ..sweeps.grid import Grid
from ..sweeps.methods import Choice
from ..sweeps.parameters import ParameterLike
from ..sweeps.solve import Solution, solve
from .request import Planned, Request


def sweep(
    program: Program,
    *,
    modulus_ratio: ParameterLike | None = None,
    prestretch: ParameterLike | None = None,
    stress: ParameterLike | None = None,
    rtol: float = 1e-6,
    method: str = "auto",
    formulation: str = "auto",
    step: float | None = None,
    progress: bool = False,
    material: Material | None = None,
    thickness: float | None = None,
    **parameters: ParameterLike,
) -> xr.Dataset:
    """Find whether, when and at what stretch a film fails, over all combinations of parameters.

    Solves equations (23), (25) and (26) of Zhao, Koh and Suo (2011) in every cell of the grid.

    Parameters
    ----------
    program : Program
        The loading program: ``Step()``, ``Ramp()``, ``RampHold()``, ...
    modulus_ratio : number, 1-D array or DataArray
        Unrelaxed over relaxed shear modulus, at least 1; by default that of the material, if there is one.
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
    material, thickness : Material and float, optional
        The film, of a thickness in m before deformation; both or none. Then parameters may be given in SI units, and
        the result has them too, as that of `dea_maps.physical`. If the material knows its breakdown strength, the
        result is also that of `dea_maps.breakdown`, to the same `rtol` (1e-6 with a method of fixed step).
    **parameters : number, 1-D array or DataArray
        The parameters of the program by name, as ``field=``, ``rate=``: fields are normalised by the relaxed critical
        field, rates are in relaxed critical fields per relaxation time, times in relaxation times. For a film, also by
        their names in SI units: ``voltage=`` for the field and ``x_voltage=`` for others (V), ``voltage_rate=`` (V/s),
        ``x_seconds=`` for a time ``x`` (s), ``nominal_stress=`` (Pa). Their dimensions have the names of the ratios.
        Quantities with units, as of pint, are converted.

    Returns
    -------
    Dataset
        ``outcome`` (int8: 0 survives, 1 fails later, 2 fails at once, 3 unresolved), ``time_to_failure`` in
        relaxation times, ``critical_stretch``, ``critical_internal_stretch``, ``critical_field`` over the
        relaxed critical field, and ``final_stretch`` of what survives; NaN where a variable has no meaning.

    Raises
    ------
    TypeError, ValueError
        If a parameter is missing, given twice, not taken by the program, of the wrong kind or out of bounds; if it is
        in SI units without a film; before computing.
    MemoryError
        If the result does not fit in memory.

    Warns
    -----
    ImplausibleWarning
        If a field is more than 100 times that at which films fail at once: it may be in V or V/m. Names what is
        implausible of the film, or in volts for it.
    UserWarning
        If a parameter is a dask array: it and the map are computed at once, in memory.

    Examples
    --------
    >>> import dea_maps as dm
    >>> ds = dm.sweep(dm.Step(), field=[1.05, 1.2, 1.5], modulus_ratio=4.0)
    >>> [f"{time:.5f}" for time in ds.time_to_failure.values]
    ['9.02824', '2.44363', '0.54638']
    >>> film = dm.sweep(dm.Step(), material=dm.VHB, thickness=100e-6, voltage=2000.0)
    >>> round(film.seconds_to_failure.item()), round(film.critical_area_strain.item(), 2)
    (354, 1.59)
    """
    given = {"modulus_ratio": modulus_ratio, "prestretch": prestretch, "stress": stress, **parameters}
    _warn_of_dask(given)
    plan = Request(program, given, rtol, method, formulation, step, material, thickness).planned()
    return of_film(computed(plan, progress), plan)


def computed(plan: Planned, progress: bool = False) -> xr.Dataset:
    """Return the map of what is planned, as ratios."""
    return make_dataset(plan.grid, _solved(plan.grid, plan.choice, progress), provenance_of(plan.choice))


def of_film(ds: xr.Dataset, plan: Planned) -> xr.Dataset:
    """Return a map or trajectories with what they mean for the film, if there is one: breakdown, volts and seconds."""
    if plan.film is None:
        return ds
    if plan.film.limited:
        ds = breakdown(ds, plan.film.material.strength, rtol_of(plan.choice))
    return in_si(ds, *plan.film)


def _warn_of_dask(given: Mapping[str, object]) -> None:
    """Say that parameters on dask are computed now, to users who expect a map that is not computed yet."""
    # What dask's own is_dask_collection asks; without dask nobody has such an array.
    lazy = [name for name, value in given.items() if getattr(value, "__dask_graph__", lambda: None)() is not None]
    if lazy:
        message = (
            f"{', '.join(lazy)} on dask: dm.sweep computes them and the whole map now, in memory; "
            'dm.sweep_to_netcdf(..., engine="dask") computes it in parts into a file'
        )
        warnings.warn(message, UserWarning, stacklevel=3)


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
