"""Fast cycles replaced by their average: what that does to the time to failure and to the allowable peak."""

from collections.abc import Sequence

import numpy as np
import xarray as xr
from common import fast_limit

import dea_maps as dm

RATIO = 4.0
CASES = {
    "square, duty 0.5": (dm.PulseTrain(), {"duty": 0.5}, fast_limit.square(0.5)),
    "triangle": (dm.TriangleTrain(), {}, fast_limit.triangle()),
}


def fast_cycles(periods: Sequence[float], above: Sequence[float], rtol: float) -> xr.Dataset:
    """Return the errors of the flow averaged over a cycle, against the cycles themselves.

    Parameters
    ----------
    periods : sequence of float
        In relaxation times.
    above : sequence of float
        Peaks over the largest one that is survived in the limit of short periods, less 1.
    rtol : float
        Of the sweeps and of the allowable peaks.

    Returns
    -------
    Dataset
        ``error_lifetime`` (shape, above, period) and ``error_peak`` (shape, period), relative.
    """
    lifetimes, peaks = [], []
    for program, others, shape in CASES.values():
        limit = fast_limit.critical_peak(RATIO, shape)
        field = limit * (1.0 + np.asarray(above))
        given = {"modulus_ratio": RATIO, "period": np.asarray(periods), "rtol": rtol, **others}
        times = dm.sweep(program, field=field, **given).time_to_failure.transpose("field", "period").values
        averaged = np.array([fast_limit.lifetime(RATIO, peak, shape) for peak in field])
        lifetimes.append(np.abs(averaged[:, np.newaxis] / times - 1.0))
        peaks.append(np.abs(limit / dm.allowable(program, "field", **given).allowable.values - 1.0))
    return xr.Dataset(
        {"error_lifetime": (("shape", "above", "period"), lifetimes), "error_peak": (("shape", "period"), peaks)},
        coords={"shape": list(CASES), "above": list(above), "period": list(periods)},
    )
