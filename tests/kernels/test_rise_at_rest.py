"""The equation of a rising field on a film at rest under its load, against (18) to (20) and (26) of the paper."""

import mpmath as mp
import numpy as np
import pytest

from dea_maps.kernels.dead_load.rise import AT_REST
from dea_maps.kernels.rising import state as lane

E_C = 0.75 * 4.0 ** (-1.0 / 3.0)


def derivatives(prestretch, p, k, v, y):
    """Return de/dv, dr/dv, e, r and D of the film at (v, y), from its equations over w and r, with dT eliminated."""
    sigma = prestretch - prestretch**-5
    w, r = 1 / (prestretch * (1 + v * v)), (1 - y) * (prestretch * (1 + v * v)) ** 2

    def load(w, r):
        return (1 + p / r) * w**2 - (1 + p * r**2) * w**8 - sigma * w**3

    e, of_w, of_r = load(w, r), mp.diff(load, (w, r), (1, 0)), mp.diff(load, (w, r), (0, 1))
    flow = 2 * (1 / (w * w * r) - (w * w * r) ** 2)
    rate = 2 * k * mp.sqrt(E_C * e)
    # rate dT = of_w dw + of_r flow dT
    dw = -2 * v / (prestretch * (1 + v * v) ** 2)
    time = of_w * dw / (rate - of_r * flow)
    return rate * time, flow * time, e, r, -of_w / w


@pytest.mark.parametrize(
    ("prestretch", "m", "k", "v", "y"),
    [(1.0, 4.0, 1.0, 0.3, 0.05), (2.0, 4.0, 0.1, 0.6, 0.2), (4.0, 40.0, 30.0, 0.5, 0.3), (1.3, 1.01, 1e-4, 0.4, 1e-3)],
)
def test_equation_is_that_of_the_paper(prestretch, m, k, v, y):
    p, c, square = m - 1.0, prestretch**-6.0, prestretch**2.0
    roots = np.roots([8, 0, 0, 0, 0, 3 * (prestretch - prestretch**-5), -2])
    (w_t,) = (root.real for root in roots if abs(root.imag) < 1e-9 and root.real > 0)
    w = np.zeros((lane.SLOPES, 1))
    w[lane.P], w[lane.SHAPE], w[lane.TOP] = p / square, c, w_t * prestretch
    w[lane.SPEED] = 2 * k * np.sqrt(E_C) * prestretch**3
    de, dr, e, r, D = (float(x) for x in derivatives(prestretch, p, k, v, y))
    stretch = prestretch * (1 + v * v)
    # y = 1 - r/lambda**2
    slope = 2 * r / stretch**3 * 2 * v * prestretch - dr / stretch**2
    assert AT_REST.rhs(w, 0, v, y) == pytest.approx(slope, rel=1e-9)
    top = w_t**2 - w_t**8 - (prestretch - prestretch**-5) * w_t**3
    excess, stiffness, change, K = AT_REST.event(w, 0, v, y, slope)
    assert (excess, stiffness) == pytest.approx(((e - top) * square, D), rel=1e-9)
    assert AT_REST.look(w, 0, v, y) == (excess, stiffness)
    assert K * stiffness == pytest.approx(de * square, rel=1e-9)
    step = 1e-5
    ahead, behind = (derivatives(prestretch, p, k, v + s, y + s * slope)[4] for s in (step, -step))
    assert change == pytest.approx(float(ahead - behind) / (2 * step), rel=1e-5)
