"""Trajectories: stretch, internal stretch, field and margin of films against time."""

from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..checks import brief
from ..nomenclature import cf_attributes
from ..programs import Program
from .dataset import annotated
from .dead_load import margin
from .loading import field_at
from .parameters import ParameterLike
from .run import planned, sweep
from .solve import trace


def trajectory(
    program: Program,
    *,
    time: npt.ArrayLike | xr.DataArray,
    modulus_ratio: ParameterLike,
    prestretch: ParameterLike | None = None,
    stress: ParameterLike | None = None,
    rtol: float = 1e-6,
    **parameters: ParameterLike,
) -> xr.Dataset:
    """Follow films in time, up to their failure.

    Solves equations (23) and (26) of Zhao, Koh and Suo (2011) on a form that is regular at the instability.

    Parameters
    ----------
    program : Program
        The loading program.
    time : number, 1-D array or DataArray along one dimension
        When to look, in relaxation times since the loading began; at least 0. At 0 the field of a step is on.
    modulus_ratio, prestretch, stress, **parameters : number, 1-D array or DataArray
        As in `sweep`.
    rtol : float
        Relative error allowed in the stretches, from 1e-12 to 1e-3.

    Returns
    -------
    Dataset
        ``stretch``, ``internal_stretch``, ``applied_field`` normalised by the relaxed critical field and ``margin``,
        ``1 - e/e_c(xi)``, zero at failure, with ``time`` as the last dimension, NaN after failure, and where the
        accuracy cannot be reached, as may be in ramps slower than 1e-5 at a small `rtol`; and the variables of `sweep`.

    Raises
    ------
    TypeError, ValueError
        As in `sweep`, and if `time` is not made of finite numbers of at least 0.

    Examples
    --------
    >>> import dea_maps as dm
    >>> ds = dm.trajectory(dm.Step(), time=[0.0, 1.0, 3.0], field=1.2, modulus_ratio=4.0)
    >>> [f"{stretch:.3f}" for stretch in ds.stretch.values]
    ['1.034', '1.177', 'nan']
    """
    times = checked_times(time)
    given: dict[str, Any] = {"modulus_ratio": modulus_ratio, "prestretch": prestretch, "stress": stress, **parameters}
    grid, choice = planned(program, rtol=rtol, **given)
    if "time" in grid.dims:
        raise ValueError("time must be a name of its own; got a parameter with a dimension 'time'")
    ds = sweep(program, rtol=rtol, **given)
    order = np.argsort(times.values, kind="stable")
    stretch, internal = (np.empty((*grid.shape, times.size)) for _ in range(2))
    stretch[..., order], internal[..., order] = trace(program, grid.parameters, times.values[order], rtol)
    applied = field_at(program, grid.parameters, times.values)
    after = times.values > ds.time_to_failure.values[..., np.newaxis]
    after |= (ds.time_to_failure.values == 0.0)[..., np.newaxis]
    results = {
        "stretch": stretch,
        "internal_stretch": internal,
        "applied_field": applied,
        "margin": margin(applied, internal, grid.parameters),
    }
    dims = (*grid.dims, "time")
    for name, values in results.items():
        ds[name] = (dims, np.where(after, np.nan, values), cf_attributes(name))
    ds = ds.assign_coords(time=("time", times.values, cf_attributes("time")))
    return annotated(
        ds, grid, {"method": choice.method, "formulation": choice.formulation, "rtol": rtol}, "Trajectories"
    )


def checked_times(time: npt.ArrayLike | xr.DataArray) -> xr.Variable:
    """Check the times, and put them on the dimension ``time``."""
    values = np.atleast_1d(np.asarray(time))
    if values.ndim != 1:
        raise ValueError(f"time must be a number or have one dimension; got an array of shape {values.shape}")
    if values.dtype.kind not in "iuf":
        raise TypeError(f"time must be made of real numbers; got {brief(time)}")
    allowed = np.isfinite(values) & (values >= 0.0)
    if not allowed.all():
        raise ValueError(f"time must be finite and at least 0; got {values[~allowed].flat[0]}")
    return xr.Variable("time", values.astype(np.float64))
