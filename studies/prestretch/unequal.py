"""Films under two unequal dead loads by the general model, against the film under their mean by the equibiaxial one.

The loads act from the beginning and the film relaxes under them for `REST`; then the field comes on. Failure is
det H = 0 of the 3x3 Hessian (13).
"""

import numpy as np
import xarray as xr
from common.flags import word
from films import RATIO, dead_load, thresholds

import dea_maps as dm

PRESTRETCHES = (1.2, 1.5, 2.0, 3.0)
REST = 250.0
HELD = 1.05  # of the relaxed threshold
TOP = 6.0  # of a ramp, in Ec: beyond every failure
_RTOL = 1e-9


def measure(shares: list[float]) -> xr.Dataset:
    """Compare films whose stresses are ``s (1 +- share)`` with the film under ``s`` in both directions.

    Returns
    -------
    Dataset
        Relative and signed, (mean, share): ``field_error`` and ``stretch_error`` in a ramp that takes the field to the
        relaxed threshold in one relaxation time, ``time_error`` at `HELD`: what the equibiaxial film says over what
        the general film says, less 1; -1 where the latter survives. ``equal`` (mean): the largest of the three at equal
        stresses.
    """
    shape = (len(PRESTRETCHES), len(shares))
    errors = {name: np.full(shape, np.nan) for name in ("field_error", "stretch_error", "time_error")}
    equal = np.zeros(len(PRESTRETCHES))
    for row, (mean, threshold) in enumerate(zip(PRESTRETCHES, thresholds(np.array(PRESTRETCHES)), strict=True)):
        film = {"modulus_ratio": RATIO, "prestretch": mean, "rtol": 1e-10}
        ramp = dm.sweep(dm.Ramp(), rate=threshold, **film)
        held = dm.sweep(dm.Step(), field=HELD * threshold, **film)
        said = np.array([ramp.critical_field, ramp.critical_stretch, held.time_to_failure])
        equal[row] = np.abs(said / _general(mean, 0.0, threshold) - 1.0).max()
        for column, share in enumerate(shares):
            found = said / _general(mean, share, threshold) - 1.0
            for values, error in zip(errors.values(), found, strict=True):
                values[row, column] = error
    words = "equibiaxial over general model, less 1"
    dims = ("mean", "share")
    data = {name: (dims, values, {"long_name": words, "units": "1"}) for name, values in errors.items()}
    data["equal"] = ("mean", equal, {"long_name": "largest difference of the two models at equal stresses"})
    coords = {
        "mean": ("mean", list(PRESTRETCHES), {"long_name": "stretch of the relaxed film under the mean stress"}),
        "share": ("share", shares, {"long_name": "half the difference of the stresses over their mean"}),
    }
    return xr.Dataset(data, coords)


def _general(mean: float, share: float, threshold: float) -> np.ndarray:
    """Return field and stretch at failure in the ramp, and the time to failure under the held field."""
    ramp = dm.LoadHistory((0.0, REST, REST + TOP / threshold), (0.0, 0.0, TOP))
    held = dm.LoadHistory((0.0, REST, REST), (0.0, 0.0, HELD * threshold))
    rising, holding = (
        dm.general_trajectory(
            time=0.0,
            modulus_ratio=RATIO,
            field=field,
            stress_1=dead_load(mean) * (1.0 + share),
            stress_2=dead_load(mean) * (1.0 - share),
            rtol=_RTOL,
        )
        for field in (ramp, held)
    )
    stretch = np.sqrt(rising.critical_stretch_1 * rising.critical_stretch_2)  # that of the area
    time = np.inf if word(holding.outcome) == "survives" else holding.time_to_failure - REST
    return np.array([rising.critical_field, stretch, time])
