"""Measured curves of uniaxial tension: from an xarray data set or a CSV file, checked."""

import math

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..atomic import PathLike
from ..checks import brief
from ..csv_tables import read_columns

COLUMNS = {"stretch_rate": "1/s", "stretch": "1", "nominal_stress": "Pa"}
"""What curves hold, and in which units."""

_PASCALS = {"": 1.0, "Pa": 1.0, "kPa": 1e3, "MPa": 1e6}
_LONG_NAMES = {
    "stretch_rate": "rate of stretch",
    "stretch": "stretch in the direction of tension",
    "nominal_stress": "nominal stress: force over undeformed area",
}
_FEWEST = 4
_RANGES = {"stretch_rate": (1e-12, 1e12), "stretch": (1.0, 1e3), "nominal_stress": (-1e15, 1e15)}
"""Beyond what any film does, and within what the fit can be computed for."""


def as_curves(curves: xr.Dataset) -> xr.Dataset:
    """Check curves and put their points in one row.

    Parameters
    ----------
    curves : Dataset
        With ``nominal_stress`` in Pa, or in kPa or MPa if its ``units`` say so, ``stretch`` and ``stretch_rate`` in
        1/s, as variables or coordinates that broadcast; a NaN in the stress is a gap.

    Returns
    -------
    Dataset
        The three along ``point``, stress in Pa.

    Raises
    ------
    TypeError
        If it is no Dataset.
    ValueError
        If a variable is missing, not finite or out of bounds, or there are too few points.

    Examples
    --------
    >>> stress = [[9.0, 14.0, 19.0], [10.0, 16.0, 22.0]]
    >>> table = xr.Dataset(
    ...     {"nominal_stress": (("stretch_rate", "stretch"), stress, {"units": "kPa"})},
    ...     {"stretch_rate": [0.001, 0.01], "stretch": [1.2, 1.4, 1.6]},
    ... )
    >>> as_curves(table).nominal_stress.values[:2]
    array([ 9000., 14000.])
    """
    if not isinstance(curves, xr.Dataset):
        raise TypeError(f"curves must be an xarray.Dataset; got {brief(curves)}")
    for name in COLUMNS:
        if name not in curves.variables:
            raise ValueError(f"curves must have the variables {', '.join(COLUMNS)}; {name} is missing")
        if curves[name].dtype.kind not in "iuf":
            raise ValueError(f"{name} must be made of real numbers; got values of type {curves[name].dtype}")
    units = curves["nominal_stress"].attrs.get("units", "")
    if units not in _PASCALS:
        raise ValueError(f"nominal_stress must be in Pa, kPa or MPa; got units {units!r}")
    arrays = xr.broadcast(*(curves[name].reset_coords(drop=True) for name in COLUMNS))
    columns = {name: array.values.astype(np.float64).ravel() for name, array in zip(COLUMNS, arrays, strict=True)}
    columns["nominal_stress"] = columns["nominal_stress"] * _PASCALS[units]
    kept = ~np.isnan(columns["nominal_stress"])
    return _checked({name: values[kept] for name, values in columns.items()})


def read_curves(path: PathLike) -> xr.Dataset:
    r"""Read curves from a CSV file.

    Parameters
    ----------
    path : str or path-like
        Its first line names the columns ``stretch_rate`` (1/s), ``stretch`` and ``nominal_stress`` (Pa), in any order;
        others are passed over. One line for each point; empty lines and lines that begin with # do not count.

    Returns
    -------
    Dataset
        As from `as_curves`.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is no such table, with its name and line.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> lines = ["stretch_rate,stretch,nominal_stress", *(f"0.01,{1 + i / 10},{3e4 * i}" for i in range(5))]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "data.csv")
    ...     _ = file.write_text("\n".join(lines))
    ...     read_curves(file).sizes["point"]
    5
    """
    columns = read_columns(path, tuple(COLUMNS))
    try:
        return _checked(columns)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _checked(columns: dict[str, npt.NDArray[np.float64]]) -> xr.Dataset:
    limits = {
        "stretch_rate": (0.0, "finite and above 0"),
        "stretch": (math.nextafter(1.0, 0.0), "finite and at least 1"),
        "nominal_stress": (-math.inf, "finite"),
    }
    for name, (above, words) in limits.items():
        wrong = ~(np.isfinite(columns[name]) & (columns[name] > above))
        if wrong.any():
            raise ValueError(f"{name} must be {words}; got {columns[name][wrong][0]}")
        low, high = _RANGES[name]
        beyond = (columns[name] < low) | (columns[name] > high)
        if beyond.any():
            raise ValueError(f"{name} must be from {low:g} to {high:g}; got {columns[name][beyond][0]}")
    count = int(np.count_nonzero(columns["stretch"] > 1.0))
    if count < _FEWEST:
        raise ValueError(f"curves must have at least {_FEWEST} points with a stretch above 1; got {count}")
    if not columns["nominal_stress"].max() > 0.0:
        raise ValueError(f"nominal_stress must be above 0 somewhere; got at most {columns['nominal_stress'].max()}")
    return xr.Dataset(
        {
            name: ("point", values, {"long_name": _LONG_NAMES[name], "units": COLUMNS[name].replace("1/s", "s-1")})
            for name, values in columns.items()
        }
    )
