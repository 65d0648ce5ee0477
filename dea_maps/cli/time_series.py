"""Films of a specification followed in time: when to look, and tables of what is seen."""

from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..atomic import PathLike, replacing
from ..runs.trajectories import trajectory
from .specification import Specification

TABLE_SUFFIX = ".csv"


def times_of(until: float, points: int) -> npt.NDArray[np.float64]:
    """Return evenly spaced times from 0 to the last.

    Raises
    ------
    ValueError
        If the last one is not above 0, or there are fewer than two.

    Examples
    --------
    >>> times_of(2.0, 3).tolist()
    [0.0, 1.0, 2.0]
    """
    if not 0.0 < until < np.inf:
        raise ValueError(f"--until must be finite and above 0; got {until}")
    if points < 2:
        raise ValueError(f"--points must be at least 2; got {points}")
    return np.linspace(0.0, until, points)


def trajectories_of(spec: Specification, times: npt.NDArray[np.float64]) -> xr.Dataset:
    """Return the trajectories of the films of a specification; times are in s for a film, else in relaxation times.

    Raises
    ------
    ValueError
        If the specification names a method, or something else that is of sweeps alone.
    """
    for key in spec.accuracy:
        if key != "rtol":
            raise ValueError(f"[accuracy] must have rtol alone for trajectories; got {key!r}")
    given: dict[str, Any] = {**spec.parameters, **spec.accuracy}
    if spec.material is None:
        return trajectory(spec.program, time=times, **given)
    return trajectory(spec.program, time_seconds=times, material=spec.material, thickness=spec.thickness, **given)


def write_table(ds: xr.Dataset, path: PathLike) -> None:
    """Write trajectories as a CSV file, a line for each film and time; a value that is not there is empty.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    with replacing(path) as temporary:
        ds.to_dataframe().reset_index().to_csv(temporary, index=False)
