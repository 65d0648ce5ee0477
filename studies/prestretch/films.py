"""Films under equal dead loads: fields at failure in ramps, times to failure under held fields."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

import dea_maps as dm

RATIO = 4.0
PRESTRETCHES = (1.0, 1.5, 2.0, 3.0)
RTOL = 1e-8
_EXCESS = "field over the relaxed threshold, less 1"


def dead_load(prestretch: NDArray | float) -> NDArray | float:
    """Return the nominal stress over ``mu_R`` that holds a relaxed film at a stretch."""
    return prestretch - prestretch**-5


def thresholds(prestretches: NDArray) -> NDArray:
    """Return the relaxed threshold over ``Ec`` of films under the loads of these pre-stretches."""
    return dm.sweep(dm.Step(), field=1.0, modulus_ratio=RATIO, prestretch=prestretches).relaxed_threshold.values


def ramp_map(prestretches: int, rates: int) -> xr.Dataset:
    """Return ``map_field``, ``map_stretch`` (map_prestretch, map_rate) at failure, and both limits of the field."""
    given = {"prestretch": np.linspace(1.0, 4.0, prestretches), "rate": np.geomspace(1e-3, 1e3, rates)}
    ds = dm.sweep(dm.Ramp(), modulus_ratio=RATIO, rtol=RTOL, **given)
    at_once = dm.sweep(dm.Step(), field=9.0, modulus_ratio=RATIO, prestretch=given["prestretch"])
    dims = ("map_prestretch", "map_rate")
    ds = ds.transpose("prestretch", "rate")
    return xr.Dataset(
        {
            "map_field": (dims, ds.critical_field.values, {"long_name": "field at failure, E/Ec", "units": "1"}),
            "map_stretch": (dims, ds.critical_stretch.values, {"long_name": "stretch at failure", "units": "1"}),
            "map_relaxed": (dims[0], thresholds(given["prestretch"]), {"long_name": "relaxed threshold, E/Ec"}),
            "map_instant": (dims[0], at_once.critical_field.values, {"long_name": "instant threshold, E/Ec"}),
        },
        {"map_prestretch": given["prestretch"], "map_rate": ("map_rate", given["rate"], {"long_name": "Ec per tau"})},
    )


def relaxed_and_fresh(rates: int, excesses: int) -> xr.Dataset:
    """Return what becomes of films that relaxed under a load, and of films that are loaded together with the field.

    Returns
    -------
    Dataset
        ``start_field`` (start, prestretch, rate) at failure in a ramp, ``start_time`` (start, prestretch, excess) to
        failure under a held field, 0 where it fails at once.
    """
    loaded = np.array(PRESTRETCHES[1:])
    rate, excess = np.geomspace(1e-3, 1e3, rates), np.geomspace(1e-3, 3.0, excesses)
    held = xr.DataArray(np.outer(thresholds(loaded), 1.0 + excess), dims=("load", "excess"))
    fields, times = [], []
    for name, values in (("prestretch", loaded), ("stress", dead_load(loaded))):
        given = {name: xr.DataArray(values, dims="load"), "modulus_ratio": RATIO, "rtol": RTOL}
        ramp = dm.sweep(dm.Ramp(), rate=rate, **given)
        fields.append(ramp.critical_field.transpose("load", "rate").values)
        times.append(dm.sweep(dm.Step(), field=held, **given).time_to_failure.transpose("load", "excess").values)
    return xr.Dataset(
        {
            "start_field": (("start", "load", "rate"), fields, {"long_name": "field at failure, E/Ec", "units": "1"}),
            "start_time": (("start", "load", "excess"), times, {"long_name": "time to failure, tau", "units": "1"}),
        },
        {
            "start": ["relaxed", "fresh"],
            "load": ("load", loaded, {"long_name": "stretch to which the load stretches a relaxed film"}),
            "rate": ("rate", rate, {"long_name": "ramp rate, Ec per tau"}),
            "excess": ("excess", excess, {"long_name": _EXCESS}),
        },
    )


def lifetimes(excesses: int) -> xr.Dataset:
    """Return ``life_time`` (prestretch, life_excess), NaN from the field on at which the film fails at once."""
    prestretch, excess = np.array(PRESTRETCHES), np.geomspace(1e-4, 2.0, excesses)
    threshold = thresholds(prestretch)
    held = xr.DataArray(np.outer(threshold, 1.0 + excess), dims=("prestretch", "excess"))
    ds = dm.sweep(dm.Step(), field=held, prestretch=prestretch, modulus_ratio=RATIO, rtol=RTOL)
    ds = ds.transpose("prestretch", "excess")
    at_once = dm.sweep(dm.Step(), field=9.0, prestretch=prestretch, modulus_ratio=RATIO).critical_field.values
    dims = ("prestretch", "life_excess")
    time = ds.time_to_failure.where(ds.time_to_failure > 0.0)
    return xr.Dataset(
        {
            "life_time": (dims, time.values, {"long_name": "time to failure, tau", "units": "1"}),
            "life_stretch": (dims, ds.critical_stretch.values, {"long_name": "stretch at failure", "units": "1"}),
            "relaxed_threshold": ("prestretch", threshold, {"long_name": "relaxed threshold, E/Ec", "units": "1"}),
            "instant_threshold": ("prestretch", at_once, {"long_name": "instant threshold, E/Ec", "units": "1"}),
        },
        {"prestretch": prestretch, "life_excess": ("life_excess", excess, {"long_name": _EXCESS})},
    )
