"""Films under cycles that are short beside the relaxation time: the flow averaged over a cycle.

As the period goes to zero, the internal stretch stands still within a cycle, and ``r = xi**2`` follows
``dr/dT = mean of F(r, e)`` over the loads e of the cycle. The film fails where the peak load is the largest that it can
be in equilibrium with, (25) of Zhao, Koh and Suo (2011); it survives where the mean vanishes before.
"""

import numpy as np
import numpy.typing as npt
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar

Array = npt.NDArray[np.float64]
CRITICAL_LOAD = 0.75 * 4.0 ** (-1.0 / 3.0)
"""The load ``e`` at Ec."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS


def square(duty: float) -> tuple[Array, Array]:
    """Return the field over its peak in the parts of a cycle, and the share of each part."""
    return np.array([1.0, 0.0]), np.array([duty, 1.0 - duty])


def triangle() -> tuple[Array, Array]:
    """As `square`, of a field that is linear in time up to its peak and down to zero."""
    # Nodes close to the peak, where the stretch has the root of the distance to it at failure.
    return 1.0 - (1.0 - _NODES) ** 2, 2.0 * (1.0 - _NODES) * _WEIGHTS


def sine() -> tuple[Array, Array]:
    """As `square`, of a sine without a bias; the load goes with its square."""
    return np.sin(0.5 * np.pi * _NODES), _WEIGHTS


def biased_sine() -> tuple[Array, Array]:
    """As `square`, of a sine between zero and its peak."""
    return 0.5 - 0.5 * np.cos(np.pi * _NODES), _WEIGHTS


def _stiffness(r: Array, m: float) -> tuple[Array, Array]:
    return 1.0 + (m - 1.0) / r, 1.0 + (m - 1.0) * r * r


def largest_load(r: Array, m: float) -> Array:
    """Return the largest load at internal stretches, (25)."""
    a, b = _stiffness(r, m)
    return 0.75 * a * (0.25 * a / b) ** (1.0 / 3.0)


def mean_flow(r: npt.ArrayLike, m: float, peak: float, shape: tuple[Array, Array]) -> Array:
    """Return the mean of dr/dT over a cycle whose largest field is ``peak``, in Ec, for each r."""
    rows = np.atleast_1d(np.asarray(r, dtype=np.float64))[:, np.newaxis]
    a, b = _stiffness(rows, m)
    load = CRITICAL_LOAD * (peak * shape[0]) ** 2
    u = np.broadcast_to((a / b) ** (1.0 / 3.0), (rows.size, load.size))  # above the root, where the load is concave
    for _ in range(60):
        slope = 4.0 * b * u**3 - a
        change = np.where(slope > 0.0, (a * u - b * u**4 - load) / np.where(slope > 0.0, slope, 1.0), 0.0)
        u = u + np.minimum(change, 0.0)
        if change.min() > -1e-15:
            break
    z = rows * u
    return np.asarray((2.0 / z - 2.0 * z * z) @ shape[1])


def end_of_life(m: float, peak: float) -> float:
    """Return r where the peak is the largest load that the film is in equilibrium with."""
    load = CRITICAL_LOAD * peak * peak
    return float(brentq(lambda r: largest_load(r, m) - load, 1.0, 1e4 * m, xtol=1e-15, rtol=1e-14))


def least_flow(m: float, peak: float, shape: tuple[Array, Array]) -> float:
    """Return the smallest mean flow before failure; a film survives where it is not positive."""
    end = end_of_life(m, peak)
    shares = np.linspace(0.0, 1.0, 40)
    flows = mean_flow(1.0 + (end - 1.0) * shares, m, peak, shape)
    k = int(np.clip(flows.argmin(), 1, shares.size - 2))
    found = minimize_scalar(
        lambda share: mean_flow(1.0 + (end - 1.0) * share, m, peak, shape)[0],
        bounds=(shares[k - 1], shares[k + 1]),
        method="bounded",
        options={"xatol": 1e-7},
    )
    return min(float(found.fun), float(flows.min()))


def critical_peak(m: float, shape: tuple[Array, Array]) -> float:
    """Return the largest peak field, in Ec, that is survived in the limit of short periods."""
    margin = 1e-9
    return float(brentq(lambda peak: least_flow(m, peak, shape), 1.0 + margin, np.sqrt(m) * (1.0 - margin), rtol=1e-12))


def lifetime(m: float, peak: float, shape: tuple[Array, Array]) -> float:
    """Return the time to failure, in relaxation times, in the limit of short periods; a peak that is not survived."""
    end = end_of_life(m, peak)

    def time_per_share(share: float) -> float:
        # r = end - (end - 1) share**2: next to failure the mean flow has the root of the distance to it.
        return 2.0 * (end - 1.0) * share / mean_flow(end - (end - 1.0) * share * share, m, peak, shape)[0]

    return float(quad(time_per_share, 0.0, 1.0, epsabs=0.0, epsrel=1e-8, limit=400)[0])
