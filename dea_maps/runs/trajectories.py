"""Trajectories: stretch, internal stretch, field and margin of films against time."""

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..materials.material import Material
from ..nomenclature import cf_attributes
from ..programs import Program
from ..sweeps.dataset import annotated
from ..sweeps.dead_load import margin
from ..sweeps.loading import field_at
from ..sweeps.parameters import ParameterLike, checked_times
from ..sweeps.ratios import in_ratios
from ..sweeps.solve import trace
from .maps import computed, of_film
from .request import Request


def trajectory(
    program: Program,
    *,
    time: npt.ArrayLike | xr.DataArray | None = None,
    time_seconds: npt.ArrayLike | xr.DataArray | None = None,
    modulus_ratio: ParameterLike | None = None,
    prestretch: ParameterLike | None = None,
    stress: ParameterLike | None = None,
    rtol: float = 1e-6,
    material: Material | None = None,
    thickness: float | None = None,
    **parameters: ParameterLike,
) -> xr.Dataset:
    """Follow films in time, up to their failure.

    Solves equations (23) and (26) of Zhao, Koh and Suo (2011) on a form that is regular at the instability.

    Parameters
    ----------
    program : Program
        The loading program.
    time : number, 1-D array or DataArray along one dimension
        When to look, in relaxation times since the loading began; at least 0. At the time of a jump, the state
        after it: at 0 the field of a step is on.
    time_seconds : number, 1-D array or DataArray along one dimension
        The same in s, for a film, instead of `time`.
    modulus_ratio, prestretch, stress, material, thickness, **parameters
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
    >>> film = dm.trajectory(dm.Step(), time_seconds=[0.0, 60.0], voltage=2000.0, material=dm.VHB, thickness=100e-6)
    >>> [f"{100.0 * strain:.1f} %" for strain in film.area_strain.values]
    ['7.9 %', '19.9 %']
    """
    given = {"modulus_ratio": modulus_ratio, "prestretch": prestretch, "stress": stress, **parameters}
    plan = Request(program, given, rtol, material=material, thickness=thickness).planned()
    grid, choice, film = plan
    asked = in_ratios({"time": "time"}, {"time": time, "time_seconds": time_seconds}, film)
    if not asked:
        raise ValueError("time is missing: when to look, in relaxation times")
    times = checked_times(asked["time"])
    if "time" in grid.dims:
        raise ValueError("time must be a name of its own; got a parameter with a dimension 'time'")
    ds = computed(plan)
    order = np.argsort(times.values, kind="stable")
    stretch, internal = (np.empty((*grid.shape, times.size)) for _ in range(2))
    stretch[..., order], internal[..., order] = trace(program, grid.parameters, times.values[order], rtol)
    applied = field_at(program, grid.parameters, times.values)
    after = times.values > ds.time_to_failure.values[..., np.newaxis]
    # A film that fails at a jump is not in equilibrium with the field after it.
    at_failure = times.values == ds.time_to_failure.values[..., np.newaxis]
    after |= at_failure & (np.abs(applied) > (1.0 + 2.0 * rtol) * ds.critical_field.values[..., np.newaxis])
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
    made: dict[str, str | float] = {"method": choice.method, "formulation": choice.formulation, "rtol": rtol}
    return of_film(annotated(ds, grid, made, "Trajectories"), plan)
