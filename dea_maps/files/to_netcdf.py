"""Sweeps to files, larger than memory, that go on where they were interrupted."""

import os
import re
import shutil
from collections.abc import Iterable
from contextlib import nullcontext
from pathlib import Path
from typing import Literal

from ..atomic import PathLike, check_writable
from ..checks import brief
from ..materials.material import Material
from ..nomenclature import BREAKDOWN
from ..notices import shown_notices
from ..programs import Program
from ..runs.maps import progress_bar
from ..runs.request import Request
from ..sweeps.parameters import ParameterLike
from .checkpoints import check_parts
from .digits import DIGITS
from .engines import ENGINES, check_dask
from .netcdf import check_netcdf_name, write_dataset
from .stream import Plan, make_plan, stream

DTYPES = ("float64", "float32")
"""What the maps of a file may be stored as."""
DEFAULT_MEMORY = 2**30
SMALLEST_MEMORY = 2**24


def sweep_to_netcdf(
    path: PathLike,
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
    variables: Iterable[str] | None = None,
    dtype: Literal["float64", "float32"] = "float64",
    digits: Literal["auto"] | None = None,
    engine: Literal["threads", "dask"] = "threads",
    scheduler: str | None = None,
    memory: str | int | None = None,
    fresh: bool = False,
    material: Material | None = None,
    thickness: float | None = None,
    **parameters: ParameterLike,
) -> None:
    """Write the data set of a sweep to a NetCDF-4 file, of any size, in bounded memory.

    The same results, bit for bit, as ``sweep(...).to_netcdf(path)``, unless `digits` are rounded. The file is only ever
    absent, the old one or the complete new one, with the permissions of the old. Finished parts wait in
    ``<path>.parts/``; the same call after an interruption resumes from them. Threads of one process may write and open
    maps at once: one lock guards all calls of this package into netCDF4 and h5py, but not those of others, as
    ``Dataset.to_netcdf``.

    Parameters
    ----------
    path : str or path-like
        The file to write, in a folder that exists.
    program, modulus_ratio, prestretch, stress, rtol, method, formulation, step, progress, **parameters
        As in `sweep`.
    variables : iterable of str, optional
        Names of the variables to keep; by default all. With a breakdown strength, ``first_limit`` is kept always.
    dtype : {"float64", "float32"}
        What the maps are stored as; the coordinates stay float64. Rounding is the last thing done.
    digits : {"auto"}, optional
        Rounds numbers to the bits that `rtol` carries, by at most ``rtol / 8``, so that the file takes less room;
        counts stay. The attributes are those of CF-1.12. By default no bit is lost.
    engine : {"threads", "dask"}
        What computes: threads of this process, or a dask.distributed cluster (extra ``distributed``).
    scheduler : str, optional
        Address of the cluster, as ``"tcp://host:8786"``; by default one on this machine.
    memory : int or str, optional
        Bytes that may be used beside those of the interpreter and the parameters, as ``2**30`` or ``"1GiB"``, which is
        the default; at least 16 MiB. Where what the cells of a product grid share, some 0.3 kB for each pair of rate
        and modulus ratio, needs more than half of it, every part computes its own, which takes longer.
    fresh : bool
        Whether to begin anew even where finished parts are there.
    material, thickness : Material and float, optional
        The film, as in `sweep`. Parts computed with a strength given as a function are not used by a later call, unless
        the function is that of a specification, ``{at_rest, exponent}``.

    Raises
    ------
    TypeError, ValueError
        As in `sweep`, and if an argument of this function is not allowed; before computing.
    OSError
        If the file cannot be written, another sweep is writing it, ``<path>.parts`` is not the package's own, or there
        is too little room; what can be known beforehand, before computing. Parts that are finished stay.

    Warns
    -----
    UserWarning
        Names every part that is damaged or of another sweep; it is computed again.
    ImplausibleWarning
        As `sweep`, and names what is implausible of the film, or in volts for it.

    Examples
    --------
    >>> import dea_maps as dm, os, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     dm.sweep_to_netcdf(os.path.join(folder, "map.nc"), dm.Ramp(), rate=[0.1, 1.0], modulus_ratio=4.0)
    ...     os.listdir(folder)
    ['map.nc']
    """
    given = {"modulus_ratio": modulus_ratio, "prestretch": prestretch, "stress": stress, **parameters}
    request = Request(program, given, rtol, method, formulation, step, material, thickness)
    plan = planned_file(
        path,
        request,
        variables=variables,
        dtype=dtype,
        digits=digits,
        engine=engine,
        scheduler=scheduler,
        memory=memory,
    )
    write(plan, fresh, progress)


def write(plan: Plan, fresh: bool, progress: bool) -> None:
    """Compute what is planned, and write its file, see `sweep_to_netcdf`.

    Parameters
    ----------
    plan : Plan
        From `planned_file`.
    fresh, progress : bool
        As in `sweep_to_netcdf`.

    Raises
    ------
    OSError
        As in `sweep_to_netcdf`.
    """
    if plan.grid.cells == 0:
        write_dataset(plan.template(), plan.path)
        return
    with shown_notices(progress), progress_bar(plan.grid) if progress else nullcontext() as bar:
        stream(plan, fresh=fresh, on_cells=bar.update if bar else _nothing)


def planned_file(
    path: PathLike,
    request: Request,
    *,
    variables: Iterable[str] | None = None,
    dtype: str = "float64",
    digits: str | None = None,
    engine: str = "threads",
    scheduler: str | None = None,
    memory: str | int | None = None,
) -> Plan:
    """Return what `sweep_to_netcdf` would do, with everything checked and nothing computed.

    Parameters
    ----------
    path, variables, dtype, digits, engine, scheduler, memory
        As in `sweep_to_netcdf`.
    request : Request
        What is asked.

    Returns
    -------
    Plan

    Raises
    ------
    TypeError, ValueError, OSError
        As in `sweep_to_netcdf`.
    """
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"path must be a string or path-like; got {brief(path)}")
    for name, value, allowed in (("dtype", dtype, DTYPES), ("engine", engine, ENGINES)):
        if value not in allowed:
            raise ValueError(f"{name} must be one of {', '.join(allowed)}; got {brief(value)}")
    if digits is not None and digits not in DIGITS:
        raise ValueError(f"digits must be {' or '.join(map(repr, DIGITS))} or None; got {brief(digits)}")
    if scheduler is not None and engine != "dask":
        raise ValueError(f"scheduler must be left out with the engine {engine!r}; got {brief(scheduler)}")
    if engine == "dask":
        check_dask(scheduler)
    grid, choice, film = request.planned()
    if digits is not None and choice.rtol is None:
        raise ValueError(f"digits must be None with a method of fixed step, which has no rtol; got {brief(digits)}")
    results = grid.program.results
    kept = _kept(variables, (*results, *BREAKDOWN) if film is not None and film.limited else results)
    room = _bytes(memory)
    check_netcdf_name(path)
    target = check_writable(path)
    plan = make_plan(Path(path), grid, choice, kept, dtype, room, film, engine, scheduler, digits)
    _check_room(plan, target, check_parts(target))
    return plan


def _check_room(plan: Plan, target: Path, there: int) -> None:
    """Check that the map may fit on the disk, which holds it once, in its parts: more is not known beforehand."""
    # Compression halves a map; one of which little fails, and all is NaN, becomes smaller still.
    needed = plan.template().nbytes // 4 - there
    free = shutil.disk_usage(target.parent).free
    if free < needed:
        raise OSError(
            f"cannot write {plan.path}: the map needs at least {needed / 2**20:,.1f} MiB, "
            f"and {free / 2**20:,.1f} MiB are free in {target.parent}"
        )


def _nothing(cells: int) -> None:
    """Draw no progress."""


def _bytes(memory: str | int | None) -> int:
    """Return an amount of memory in bytes."""
    if memory is None:
        return DEFAULT_MEMORY
    allowed = "memory must be a number of bytes or a string as '2GiB', at least 16 MiB"
    if isinstance(memory, str):
        match = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*([kMGT]i?)?B?\s*", memory)
        if match is None:
            raise ValueError(f"{allowed}; got {brief(memory)}")
        unit = match[2] or ""
        size = int(float(match[1]) * (1024 if unit.endswith("i") else 1000) ** " kMGT".index(unit[:1] or " "))
    elif isinstance(memory, int) and not isinstance(memory, bool):
        size = memory
    else:
        raise TypeError(f"{allowed}; got {brief(memory)}")
    if size < SMALLEST_MEMORY:
        raise ValueError(f"{allowed}; got {brief(memory)}")
    return size


def _kept(variables: Iterable[str] | None, known: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of the variables to keep, in the order of the data set."""
    if variables is None:
        return known
    if isinstance(variables, str) or not isinstance(variables, Iterable):
        raise TypeError(f"variables must be names in a list or the like; got {brief(variables)}")
    wanted = list(variables)
    if not wanted:
        raise ValueError("variables must name at least one variable; got none")
    for name in wanted:
        if name not in known:
            raise ValueError(f"variables must be among {', '.join(known)}; got {brief(name)}")
    return tuple(name for name in known if name in wanted or name == "first_limit")
