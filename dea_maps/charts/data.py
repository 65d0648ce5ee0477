"""What charts ask of a data set: its kind, its variables, which parameter varies along which dimension."""

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..checks import brief
from ..program_text import kinds_in

Floats = npt.NDArray[np.float64]


def check_variables(ds: xr.Dataset, *names: str, what: str = "a chart") -> None:
    """Check that a data set has what a chart shows.

    Parameters
    ----------
    ds : Dataset
        What is to be drawn.
    names : str
        Variables that it must have.
    what : str
        The chart, for the message.

    Raises
    ------
    TypeError, ValueError
        If it is no data set, or lacks one.
    """
    if not isinstance(ds, xr.Dataset):
        raise TypeError(f"ds must be a data set; got {brief(ds)}")
    for name in names:
        if name not in ds.variables:
            raise ValueError(f"{what} needs the variable {name}; the map lacks it")


def drawable(ds: xr.Dataset, *names: str, what: str = "a chart") -> xr.Dataset:
    """Return a map without its dimensions of length 1, after checking that it can be drawn.

    Parameters
    ----------
    ds : Dataset
        From a sweep.
    names : str
        Variables that it must have, beside ``outcome``.
    what : str
        The chart, for the messages.

    Raises
    ------
    TypeError, ValueError
        If it is no data set, lacks a variable, or has fewer than two cells.
    """
    check_variables(ds, *names, "outcome", what=what)
    if ds["outcome"].size < 2:
        raise ValueError(f"{what} needs two cells or more; got {ds['outcome'].size}")
    return ds.squeeze()


def parameters_along(ds: xr.Dataset) -> dict[str, str] | None:
    """Return which parameter varies along which dimension; None unless it is one along each.

    Examples
    --------
    >>> import dea_maps as dm
    >>> parameters_along(dm.sweep(dm.Step(), field=[1.1, 1.2], modulus_ratio=4))
    {'field': 'field'}
    """
    along: dict[str, str] = {}
    for name in varying(ds):
        dims = ds[name].dims
        if len(dims) > 1 or dims[0] in along:
            return None
        along[str(dims[0])] = name
    return along if along.keys() == set(ds["outcome"].dims) else None


def varying(ds: xr.Dataset) -> list[str]:
    """Return the parameters of more than one value."""
    return [name for name in kinds_in(ds.coords, ds.attrs) if float(ds[name].min()) < float(ds[name].max())]


def flagged(flags: xr.DataArray, meaning: str) -> npt.NDArray[np.bool_]:
    """Tell where flags, described as CF has it, have a meaning.

    Examples
    --------
    >>> flags = xr.DataArray([0, 1], attrs={"flag_values": [0, 1], "flag_meanings": "instability breakdown"})
    >>> flagged(flags, "breakdown").tolist()
    [False, True]
    """
    meanings = str(flags.attrs.get("flag_meanings", "")).split()
    values = np.atleast_1d(flags.attrs.get("flag_values", np.arange(len(meanings))))
    return np.isin(flags.values, [value for value, each in zip(values, meanings, strict=True) if each == meaning])


def sizes_in_words(ds: xr.Dataset) -> str:
    """Return the dimensions of a map with their lengths."""
    return ", ".join(f"{dim} {size}" for dim, size in ds["outcome"].sizes.items()) or "none"


def on_log_axis(values: Floats) -> bool:
    """Tell whether rising values suit a logarithmic axis: log-spaced, over a decade or more."""
    return log_spaced(values) and bool(values[-1] >= 10.0 * values[0])


def log_spaced(values: Floats) -> bool:
    """Tell whether the logarithms of rising values are more evenly spaced than the values."""
    if len(values) < 3 or values[0] <= 0:
        return False
    gaps, ratios = np.diff(values), np.diff(np.log(values))
    return bool(ratios.std() * gaps.mean() < gaps.std() * ratios.mean())


def cell_edges(values: Floats, log: bool) -> Floats:
    """Return where cells around rising centres meet: half way between them; the outer cells end at their centres.

    Parameters
    ----------
    values : (n,) ndarray
        The centres.
    log : bool
        Whether half way is on a logarithmic scale.

    Returns
    -------
    (n + 1,) ndarray

    Examples
    --------
    >>> cell_edges(np.array([1.0, 4.0, 16.0]), log=True).round(9).tolist()
    [1.0, 2.0, 8.0, 16.0]
    """
    scaled = np.log(values) if log else values
    between = 0.5 * (scaled[1:] + scaled[:-1])
    return np.concatenate([values[:1], np.exp(between) if log else between, values[-1:]])
