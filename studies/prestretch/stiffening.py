"""The instability of elastic films of Gent's network under an equal biaxial dead load, and until when there is one.

With ``I = 2 l**2 + l**-4 - 3`` the strain energy is ``-(J/2) ln(1 - I/J)``, in ``mu``; ``J`` infinite is neo-Hookean.
Under the dead load ``s`` a stretch ``l`` takes the load ``e = eps E**2/mu = ((l - l**-5)/(1 - I/J) - s)/l**3``. An
instability, det H = 0 at a fixed nominal stress, is a maximum of ``e(l)``. Where ``de/dl`` is positive up to the
stretch at which ``I = J``, there is none.
"""

import numpy as np
import xarray as xr
from common.internals import CRITICAL_FIELD
from numpy.typing import NDArray
from scipy.optimize import brentq

PRESTRETCH_LIMITS = (50.0, 100.0, 200.0, np.inf)
_PLACES = 20_001
_SHARE = 1.0 - 1e-6  # of the locking stretch: beyond, the stress is above 1e5
_FAR = 3.0  # times a pre-stretch: neo-Hookean films fail at 1.5 times theirs, the free one at 1.26


def locking_stretch(limit: float) -> float:
    """Return the stretch at which ``I = J``."""
    return float(brentq(lambda stretch: _invariant(stretch) - limit, 1.0, np.sqrt(limit) + 3.0))


def rate_of_load(stretch: NDArray | float, prestretch: float, limit: float) -> NDArray | float:
    """Return ``l**4 de/dl`` under the dead load of a pre-stretch."""
    force, stiffness = _network(stretch, limit)
    return stiffness * stretch - 3.0 * (force - _network(prestretch, limit)[0])


def instability(prestretch: float, limit: float) -> tuple[float, float]:
    """Return the stretch at the instability and the field there over ``Ec`` of the neo-Hookean film; NaN if none."""
    places = _places(prestretch, limit)
    falling = np.flatnonzero(rate_of_load(places, prestretch, limit) < 0.0)
    if not falling.size:
        return np.nan, np.nan
    ends = places[falling[0] - 1], places[falling[0]]
    stretch = float(brentq(rate_of_load, *ends, args=(prestretch, limit), xtol=1e-14))
    load = (_network(stretch, limit)[0] - _network(prestretch, limit)[0]) / stretch**3
    return stretch, float(np.sqrt(load)) / CRITICAL_FIELD


def last_prestretch(limit: float) -> float:
    """Return the pre-stretch beyond which there is no instability; NaN if there is none even without a load."""

    def least(prestretch: float) -> float:
        return float(np.min(rate_of_load(_places(prestretch, limit), prestretch, limit)))

    if least(1.0) > 0.0:
        return np.nan
    return float(brentq(least, 1.0, 0.9 * locking_stretch(limit), xtol=1e-10))


def prestretch_off(limit: float, share: float) -> float:
    """Return the pre-stretch at which the field is higher than the neo-Hookean one by a share of that."""

    def over(prestretch: float) -> float:
        return instability(prestretch, limit)[1] / instability(prestretch, np.inf)[1] - 1.0 - share

    return float(brentq(over, 1.0, last_prestretch(limit) - 1e-4, xtol=1e-6))


def frame_tension(prestretch: NDArray) -> NDArray:
    """Return the field over ``Ec`` at which a relaxed film held at a pre-stretch loses its tension."""
    return np.sqrt(prestretch**-2 - prestretch**-8) / CRITICAL_FIELD


def measure(prestretches: int, limits: int) -> xr.Dataset:
    """Return fields and stretches at the instability, by pre-stretch, and until when there is one, by ``J``.

    Returns
    -------
    Dataset
        ``gent_field``, ``gent_stretch`` (limit, gent_prestretch); ``last_prestretch`` (gent_limit); ``frame_field``
        (gent_prestretch), at which a film held by a frame loses its tension.
    """
    prestretch, limit = np.linspace(1.0, 4.0, prestretches), np.geomspace(10.0, 1000.0, limits)
    found = np.array([[instability(one, limit) for one in prestretch] for limit in PRESTRETCH_LIMITS])
    dims = ("limit", "gent_prestretch")
    last = np.array([last_prestretch(one) for one in limit])
    return xr.Dataset(
        {
            "gent_stretch": (dims, found[..., 0], {"long_name": "stretch at the instability", "units": "1"}),
            "gent_field": (dims, found[..., 1], {"long_name": "field at the instability, E/Ec", "units": "1"}),
            "last_prestretch": ("gent_limit", last, {"long_name": "pre-stretch beyond which there is no instability"}),
            "frame_field": (dims[1], frame_tension(prestretch), {"long_name": "tension lost in a frame, E/Ec"}),
        },
        {"limit": list(PRESTRETCH_LIMITS), "gent_prestretch": prestretch, "gent_limit": limit},
    )


def _places(prestretch: float, limit: float) -> NDArray:
    """Return stretches from the pre-stretch on, as far as an instability can lie."""
    end = _FAR * prestretch
    return np.linspace(prestretch, end if limit == np.inf else min(end, _SHARE * locking_stretch(limit)), _PLACES)


def _invariant(stretch: NDArray | float) -> NDArray | float:
    return 2.0 * stretch**2 + stretch**-4.0 - 3.0


def _network(stretch: NDArray | float, limit: float) -> tuple[NDArray | float, NDArray | float]:
    """Return the nominal stress of the network over ``mu`` and its derivative by the stretch."""
    gain = 1.0 / (1.0 - _invariant(stretch) / limit)
    plain, slope = stretch - stretch**-5.0, 1.0 + 5.0 * stretch**-6.0
    return plain * gain, slope * gain + 4.0 * plain**2 * gain**2 / limit
