"""The equations of a rising field on a film under a dead load, against (18) to (20) and (26) of the paper."""

import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from dea_maps.kernels.dead_load import creep
from dea_maps.kernels.dead_load.linearised import first_state
from dea_maps.kernels.dead_load.rise import UNDER_LOAD
from dea_maps.kernels.rising import state as lane

E_C = 0.75 * 4.0 ** (-1.0 / 3.0)


def state(p, sigma, w, r):
    """Return e, de/dw, de/dr and dr/dT."""

    def load(w, r):
        return (1 + p / r) * w**2 - (1 + p * r**2) * w**8 - sigma * w**3

    flow = 2 * (1 / (w * w * r) - (w * w * r) ** 2)
    return load(w, r), mp.diff(load, (w, r), (1, 0)), mp.diff(load, (w, r), (0, 1)), flow


def derivatives(prestretch, p, k, v, y, offset):
    """Return de/dv, dr/dv, e, r and D of the film at (v, y), from its equations over w and r, with dT eliminated."""
    s = 1 + v * v - offset
    w, r = 1 / (prestretch * s), (1 - y) * (prestretch * s) ** 2
    e, of_w, of_r, flow = state(p, prestretch - prestretch**-5, w, r)
    rate = 2 * k * mp.sqrt(E_C * e)
    # rate dT = of_w dw + of_r flow dT
    dw = -2 * v / (prestretch * s * s)
    time = of_w * dw / (rate - of_r * flow)
    return rate * time, flow * time, e, r, -of_w / w


@pytest.mark.parametrize(
    ("prestretch", "m", "k", "v", "y", "offset"),
    [
        (1.0, 4.0, 1.0, 0.3, 0.05, 0.0),
        (2.0, 4.0, 0.1, 0.6, 0.2, 0.0),
        (4.0, 40.0, 30.0, 0.5, 0.3, 0.0),
        (1.3, 1.01, 1e-4, 0.4, 1e-3, 0.0),
        (3.0, 5.0, 2.0, 0.4, 0.7, 0.3),
    ],
)
def test_equation_is_that_of_the_paper(prestretch, m, k, v, y, offset):
    p, c, square = m - 1.0, prestretch**-6.0, prestretch**2.0
    roots = np.roots([8, 0, 0, 0, 0, 3 * (prestretch - prestretch**-5), -2])
    (w_t,) = (root.real for root in roots if abs(root.imag) < 1e-9 and root.real > 0)
    w = np.zeros((lane.SLOPES, 1))
    w[lane.P], w[lane.SHAPE], w[lane.TOP], w[lane.OFFSET] = p / square, c, w_t * prestretch, offset
    w[lane.SPEED] = 2 * k * np.sqrt(E_C) * prestretch**3
    de, dr, e, r, D = (float(x) for x in derivatives(prestretch, p, k, v, y, offset))
    stretch = prestretch * (1 + v * v - offset)
    # y = 1 - r/lambda**2
    slope = 2 * r / stretch**3 * 2 * v * prestretch - dr / stretch**2
    assert UNDER_LOAD.rhs(w, 0, v, y) == pytest.approx(slope, rel=1e-9)
    top = w_t**2 - w_t**8 - (prestretch - prestretch**-5) * w_t**3
    excess, stiffness, change, K = UNDER_LOAD.event(w, 0, v, y, slope)
    assert (excess, stiffness) == pytest.approx(((e - top) * square, D), rel=1e-9)
    assert UNDER_LOAD.look(w, 0, v, y) == (excess, stiffness)
    assert K * stiffness == pytest.approx(de * square, rel=1e-9)
    step = 1e-5
    ahead, behind = (derivatives(prestretch, p, k, v + s, y + s * slope, offset)[4] for s in (step, -step))
    assert change == pytest.approx(float(ahead - behind) / (2 * step), rel=1e-5)


@pytest.mark.parametrize(
    ("m", "stress", "k", "w", "r"),
    [
        (4.0, 1.0, 1.0, 0.8, 1.1),
        (1.001, 5.0, 30.0, 0.17, 9.0),
        (300.0, 6.0, 1e-3, 0.97, 1.02),
        (4.0, 1e-6, 0.1, 0.9, 1.2),
    ],
)
def test_equation_of_creep_is_that_of_the_paper(m, stress, k, w, r):
    e, of_w, of_r, flow = state(m - 1.0, stress, w, r)
    f = float(mp.sqrt(e / E_C))
    lane_ = np.zeros((creep.SLOPES, 1))
    lane_[creep.P], lane_[creep.SIGMA], lane_[creep.SLOWNESS] = m - 1.0, stress, 1.0 / k
    lane_[creep.GUESS] = 1.05 * w
    assert creep._rhs(lane_, 0, f, r) == pytest.approx(float(flow / k), rel=1e-12)
    assert lane_[creep.GUESS, 0] == pytest.approx(w, rel=1e-13)
    # d(e_C f**2) = of_w dw + of_r dr
    expected = (2 * E_C * f - of_r * flow / k) / of_w
    assert creep.change_of_w(m - 1.0, stress, 1.0 / k, f, w, r) == pytest.approx(float(expected), rel=1e-10)


@pytest.mark.parametrize(
    ("prestretch", "m", "k", "allowed"),
    [(1.2, 400.0, 2e-4, 1e-12), (1.2, 400.0, 1e-2, 1e-11), (3.0, 5.0, 1.0, 1e-12), (2.0, 1.01, 1.0, 1e-13)],
)
def test_linearised_state_is_that_of_the_paper(prestretch, m, k, allowed):
    """v and y against the dashpot integrated in time, with the stretch of equilibrium, to the load of that state."""
    p, sigma = m - 1.0, prestretch - prestretch**-5.0
    v, y = first_state(prestretch, p, k, allowed)
    assert v > 0.0 and y > 0.0
    s = 1.0 + v * v
    time = float(mp.sqrt(state(p, sigma, 1.0 / (prestretch * s), (1.0 - y) * (prestretch * s) ** 2)[0] / E_C) / k)

    def stretch(time, r):
        def miss(w):
            return (1 + p / r) * w**2 - (1 + p * r**2) * w**8 - sigma * w**3 - E_C * (k * time) ** 2

        return 1.0 / brentq(miss, 0.9 / prestretch, 1.01 / prestretch, xtol=1e-16, rtol=1e-15)

    def flow(time, r):
        z = r[0] / stretch(time, r[0]) ** 2
        return [2.0 * (1.0 / z - z * z)]

    r = solve_ivp(flow, (0.0, time), [prestretch**2.0], method="DOP853", rtol=1e-12, atol=0.0).y[0, -1]
    found = stretch(time, r)
    rounding = 1e-14
    assert 1.0 - r / found**2 == pytest.approx(y, rel=0.0, abs=50.0 * allowed + rounding)
    assert found / prestretch - 1.0 == pytest.approx(v * v, rel=1e-3, abs=50.0 * allowed + rounding)
    assert y > 1000.0 * allowed
