"""Sweeps: every cell of a grid solved, in memory or to a file."""

import os
from collections.abc import Iterable
from typing import Literal

import xarray as xr
from tqdm import tqdm

from .catalogue import Choice, choose
from .dataset import CELL_BYTES, make_dataset, reduced
from .grid import Grid, make_grid
from .nomenclature import VARIABLES
from .parameters import ParameterLike, brief
from .programs import Program
from .solve import Solution, solve
from .storage import PathLike, check_writable, write_dataset

DTYPES = ("float64", "float32")
"""What the maps of a file may be stored as."""


def planned(
    program: Program,
    *,
    modulus_ratio: ParameterLike,
    field: ParameterLike | None = None,
    rate: ParameterLike | None = None,
    rtol: float = 1e-6,
    method: str = "auto",
    formulation: str = "auto",
    step: float | None = None,
) -> tuple[Grid, Choice]:
    """Return the grid of a sweep and how it would be solved, with everything checked and nothing computed.

    Parameters
    ----------
    program, modulus_ratio, field, rate, rtol, method, formulation, step
        As in `sweep`.

    Returns
    -------
    grid : Grid
    choice : Choice

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
    grid = make_grid(program, modulus_ratio=modulus_ratio, field=field, rate=rate)
    return grid, choose(program, method, formulation, rtol, step)


def sweep(
    program: Program,
    *,
    modulus_ratio: ParameterLike,
    field: ParameterLike | None = None,
    rate: ParameterLike | None = None,
    rtol: float = 1e-6,
    method: str = "auto",
    formulation: str = "auto",
    step: float | None = None,
    progress: bool = False,
) -> xr.Dataset:
    """Find whether, when and at what stretch a film fails, over all combinations of parameters.

    Solves equations (23), (25) and (26) of Zhao, Koh and Suo (2011) in every cell of the grid.

    Parameters
    ----------
    program : Program
        The loading program: ``Step()``, ``Ramp()``, ``RampHold()``, ...
    modulus_ratio : number, 1-D array or DataArray
        Unrelaxed over relaxed shear modulus, at least 1.
    field : number, 1-D array or DataArray
        Nominal field over the relaxed critical field, at least 0, where the program takes it.
    rate : number, 1-D array or DataArray
        Ramp rate in relaxed critical fields per relaxation time, above 0, where the program takes it.
        A number has no dimension, a 1-D array a dimension of its own name; a DataArray broadcasts by the
        names of its dimensions, so that three of them on one dimension give scattered points.
    rtol : float
        Relative error allowed in time to failure, critical stretch and critical field, from 1e-12 to 1e-3.
    method, formulation : str
        Names from `dea_maps.methods`; "auto" takes the fastest for the scene at this `rtol`.
    step : float, optional
        Step of a method with fixed steps, in the formulation's independent variable; `rtol` is then not used.
    progress : bool
        Whether to draw a progress bar on standard error.

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
        field=field,
        rate=rate,
        rtol=rtol,
        method=method,
        formulation=formulation,
        step=step,
    )
    given = {"rtol": choice.rtol, "step": choice.step}
    accuracy = {name: value for name, value in given.items() if value is not None}
    provenance: dict[str, str | float] = {
        "method": choice.method,
        "formulation": choice.formulation,
        **accuracy,
    }
    return make_dataset(grid, _solved(grid, choice, progress), provenance)


def sweep_to_netcdf(
    path: PathLike,
    program: Program,
    *,
    modulus_ratio: ParameterLike,
    field: ParameterLike | None = None,
    rate: ParameterLike | None = None,
    rtol: float = 1e-6,
    method: str = "auto",
    formulation: str = "auto",
    step: float | None = None,
    progress: bool = False,
    variables: Iterable[str] | None = None,
    dtype: Literal["float64", "float32"] = "float64",
    engine: str = "threads",
    scheduler: str | None = None,
    memory: str | int | None = None,
    fresh: bool = False,
) -> None:
    """Write the data set of a sweep to a NetCDF-4 file.

    The file is only ever absent, the old one or the complete new one.

    Parameters
    ----------
    path : str or path-like
        The file to write, in a folder that exists.
    program, modulus_ratio, field, rate, rtol, method, formulation, step, progress
        As in `sweep`.
    variables : iterable of str, optional
        Names of the variables to keep; by default all.
    dtype : {"float64", "float32"}
        What the maps are stored as; the coordinates stay float64.
    engine : {"threads"}
        What computes: threads of this process.
    scheduler, memory, fresh
        For engines to come; their defaults alone are allowed.

    Raises
    ------
    TypeError, ValueError
        As in `sweep`, and if an argument of this function is not allowed; before computing.
    OSError
        If the file cannot be written; what can be known beforehand, before computing.
    MemoryError
        If the result does not fit in memory.

    Examples
    --------
    >>> import dea_maps as dm, os, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     dm.sweep_to_netcdf(os.path.join(folder, "map.nc"), dm.Ramp(), rate=[0.1, 1.0], modulus_ratio=4.0)
    ...     os.listdir(folder)
    ['map.nc']
    """
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"path must be a string or path-like; got {brief(path)}")
    kept = _kept(variables)
    if dtype not in DTYPES:
        raise ValueError(f"dtype must be one of {', '.join(DTYPES)}; got {brief(dtype)}")
    if engine != "threads":
        raise ValueError(f"engine must be 'threads'; got {brief(engine)}")
    for name, value in {"scheduler": scheduler, "memory": memory, "fresh": fresh or None}.items():
        if value is not None:
            raise ValueError(f"{name} must keep its default with the engine 'threads'; got {brief(value)}")
    check_writable(path)
    ds = sweep(
        program,
        modulus_ratio=modulus_ratio,
        field=field,
        rate=rate,
        rtol=rtol,
        method=method,
        formulation=formulation,
        step=step,
        progress=progress,
    )
    write_dataset(reduced(ds, kept, dtype), path)


def _kept(variables: Iterable[str] | None) -> list[str]:
    """Return the names of the variables to keep, in the order of the data set."""
    if variables is None:
        return list(VARIABLES)
    if isinstance(variables, str) or not isinstance(variables, Iterable):
        raise TypeError(f"variables must be names in a list or the like; got {brief(variables)}")
    wanted = list(variables)
    if not wanted:
        raise ValueError("variables must name at least one variable; got none")
    for name in wanted:
        if name not in VARIABLES:
            raise ValueError(f"variables must be among {', '.join(VARIABLES)}; got {brief(name)}")
    return [name for name in VARIABLES if name in wanted]


def _solved(grid: Grid, choice: Choice, progress: bool) -> Solution:
    """Solve all cells; a result that memory cannot hold is refused in one line."""
    size = grid.cells * CELL_BYTES
    refusal = f"the result of {grid.cells:,} cells needs {size / 2**30:,.1f} GiB of memory: more than there is"
    if size > _memory_of_machine():
        raise MemoryError(refusal)
    try:
        if not progress:
            return solve(grid.program, grid.parameters, choice, on_cells=None)
        # nrows: where a terminal does not know its size, tqdm would show nothing.
        with tqdm(total=grid.cells, unit=" cells", unit_scale=True, desc=grid.program.name, nrows=2) as bar:
            return solve(grid.program, grid.parameters, choice, on_cells=bar.update)
    except MemoryError as error:
        raise MemoryError(refusal) from error


def _memory_of_machine() -> float:
    """Return the bytes of memory; more may seem to be allocated, until the system ends the process."""
    if hasattr(os, "sysconf"):
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return float("inf")
