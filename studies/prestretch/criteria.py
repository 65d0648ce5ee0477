"""The two criteria of instability under a dead load, for an elastic film with ``e = l**-2 - l**-8 - s l**-3``.

det H = 0 at a fixed nominal stress: ``ds/dl = 0`` at a fixed field, ``l**6 - (3/2) s l**5 - 4 = 0``, the maximum of
``e``. The tangent modulus of the true stress ``l s``: ``d(l s)/dl = s + l ds/dl = 0`` at a fixed field,
``l**6 - 2 s l**5 - 4 = 0``.
"""

import numpy as np
import xarray as xr
from common.internals import CRITICAL_FIELD
from films import dead_load
from scipy.optimize import brentq

import dea_maps as dm

WEIGHTS = {"nominal": 1.5, "true": 2.0}


def stretch_at(stress: float, weight: float) -> float:
    """Return the root of ``l**6 - weight s l**5 - 4``, beyond ``weight s``, from which on the left side rises."""
    return float(brentq(lambda l: l**5 * (l - weight * stress) - 4.0, weight * stress, weight * stress + 2.0))  # noqa: E741


def measure(prestretches: list[float]) -> xr.Dataset:
    """Return ``criterion_stretch`` and ``criterion_field`` (criterion, elastic_prestretch).

    Raises
    ------
    RuntimeError
        If the first criterion is not what `dm.sweep` gives for elastic films.
    """
    stress = dead_load(np.array(prestretches))
    stretch = np.array([[stretch_at(s, weight) for s in stress] for weight in WEIGHTS.values()])
    field = np.sqrt(stretch**-2 - stretch**-8 - stress * stretch**-3) / CRITICAL_FIELD
    ds = dm.sweep(dm.Step(), field=2.0, modulus_ratio=1.0, prestretch=prestretches)
    if not np.allclose([ds.critical_stretch, ds.critical_field], [stretch[0], field[0]], rtol=1e-12, atol=0.0):
        raise RuntimeError("the sweep of elastic films does not fail where det H = 0")
    dims = ("criterion", "elastic_prestretch")
    return xr.Dataset(
        {
            "criterion_stretch": (dims, stretch, {"long_name": "stretch of an elastic film there", "units": "1"}),
            "criterion_field": (dims, field, {"long_name": "field there, E/Ec", "units": "1"}),
        },
        {"criterion": list(WEIGHTS), "elastic_prestretch": prestretches},
    )
