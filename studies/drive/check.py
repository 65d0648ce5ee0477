"""The limit cycle, found independently: equations (23) and (26) of the paper in time, by SciPy, pulse after pulse."""

import design
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import dea_maps as dm

_SETTLED, _MOST = 1e-9, 2000  # change of the stretch in a cycle; cycles
_LARGEST = 3.0  # no stretch of the film before its instability is larger


def limit_cycle(material: dm.Material, voltage: float, duty: float, prestretch: float) -> tuple[float, float, int]:
    """Return the largest and smallest area strain of the limit cycle, and the pulses that it took to get there.

    Equilibrium under a dead load is ``s = A lambda - B lambda**-5 - e lambda**3``, with ``A``, ``B`` and ``e`` of (23).
    """
    excess, load = material.modulus_ratio - 1.0, prestretch - prestretch**-5
    e_on = 0.75 * 4.0 ** (-1.0 / 3.0) * (voltage / design.THICKNESS / material.critical_field) ** 2
    period = design.PERIOD / material.relaxation_time

    def stretch(internal: float, e: float) -> float:
        A, B = 1.0 + excess * internal**-2, 1.0 + excess * internal**4

        def residual(lam: np.ndarray | float) -> np.ndarray | float:
            return A * lam - B * lam**-5 - e * lam**3 - load

        looks = np.linspace(1.0, _LARGEST, 401)
        first = int(np.argmax(residual(looks) >= 0.0))  # of two equilibria the one below instability
        return float(brentq(residual, looks[first - 1], looks[first], xtol=1e-14))

    def flow(_: float, state: np.ndarray, e: float) -> list[float]:
        (internal,) = state
        lam = stretch(internal, e)
        return [lam**2 * internal**-3 - lam**-4 * internal**3]

    internal, before = prestretch, 0.0
    for pulse in range(1, _MOST + 1):
        ends = []
        for e, share in ((e_on, duty), (0.0, 1.0 - duty)):
            found = solve_ivp(
                flow, (0.0, share * period), [internal], args=(e,), method="DOP853", rtol=1e-9, atol=1e-12
            )
            internal = float(found.y[0, -1])
            ends.append((stretch(internal, e) / prestretch) ** 2 - 1.0)
        if abs(ends[0] - before) < _SETTLED:
            return ends[0], ends[1], pulse
        before = ends[0]
    raise RuntimeError(f"no limit cycle within {_MOST} pulses")
