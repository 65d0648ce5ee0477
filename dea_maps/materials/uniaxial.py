"""Uniaxial tension at constant stretch rates: the general model where one direction is free and there is no field.

With ``s2 = 0`` and ``E = 0``, (18) and (19) of Zhao, Koh and Suo (2011) give the free stretch in closed form,

    lambda_2**4 = lambda_1**-2 (1 + p xi_1**2 xi_2**2)/(1 + p xi_2**-2),

so that only the two internal stretches are left to integrate, (21) and (22), over ``lambda_1 = 1 + rate t``.
"""

import warnings

import numpy as np
import numpy.typing as npt
from scipy.integrate import ODEintWarning, odeint

Array = npt.NDArray[np.float64]

_TOLERANCE = 1e-8
_STEPS = 5000


def free_stretch_squared(stretch: Array | float, xi_1: Array, xi_2: Array, p: float) -> Array:
    """Return the square of the stretch in the free direction, (19) with ``s2 = 0``.

    Parameters
    ----------
    stretch : ndarray or float
        In the direction of tension.
    xi_1, xi_2 : ndarray
        Internal stretches, of the same shape.
    p : float
        Modulus ratio less one.
    """
    squared: Array = np.sqrt((1.0 + p * (xi_1 * xi_2) ** 2) / (1.0 + p / xi_2**2)) / stretch
    return squared


def uniaxial_stress(stretch: Array, rates: Array, modulus_ratio: float) -> Array:
    """Return the nominal stress normalised by the relaxed shear modulus, at some stretches and stretch rates.

    Parameters
    ----------
    stretch : ndarray of shape (n,)
        In the direction of tension, at least 1, rising.
    rates : ndarray of shape (k,)
        Rates of stretch per relaxation time, above 0.
    modulus_ratio : float
        Unrelaxed over relaxed shear modulus, at least 1.

    Returns
    -------
    ndarray of shape (k, n)
        NaN where the integration failed.

    Examples
    --------
    >>> uniaxial_stress(np.array([2.0, 3.0]), np.array([0.2]), 4.0).round(3)
    array([[2.231, 3.316]])
    """
    p, count = modulus_ratio - 1.0, rates.size
    slowness = 1.0 / rates

    def flow(xi: Array, x: float) -> Array:
        xi_1, xi_2 = xi[:count], xi[count:]
        b = free_stretch_squared(x, xi_1, xi_2, p)
        thickness = xi_1 * xi_2 / (x * x * b)
        rate_1 = (x * x / xi_1**3 - thickness * xi_2) * slowness
        rate_2 = (b / xi_2**3 - thickness * xi_1) * slowness
        return np.concatenate([rate_1, rate_2])

    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore", ODEintWarning)
        nodes = np.concatenate([[1.0], stretch])
        xi, info = odeint(
            flow, np.ones(2 * count), nodes, rtol=_TOLERANCE, atol=_TOLERANCE, mxstep=_STEPS, full_output=True
        )
        if info["message"] != "Integration successful.":
            return np.full((count, stretch.size), np.nan)
    xi_1, xi_2 = xi[1:, :count].T, xi[1:, count:].T
    b = free_stretch_squared(stretch, xi_1, xi_2, p)
    thickness = (1.0 + p * (xi_1 * xi_2) ** 2) / (stretch**2 * b)
    stress: Array = stretch * (1.0 + p / xi_1**2) - thickness / stretch
    return stress
