"""The ramp in the area strain: right-hand side, event, start, against the paper's (23) and (26)."""

import math
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest

from dea_maps.kernels.forms import area_strain
from dea_maps.kernels.rising import state as area_lanes
from dea_maps.kernels.rising.explicit import make_explicit
from dea_maps.kernels.rising.radau import RADAU5
from dea_maps.kernels.rising.start import damping_for, prepare
from dea_maps.kernels.runge_kutta.tableaus import TABLEAUS

mp = mpmath.MPContext()
mp.dps = 50
U_STAR = mp.mpf(4) ** (-mp.mpf(1) / 3)
E_C = mp.mpf(3) / 4 * mp.mpf(4) ** (-mp.mpf(1) / 3)
METHODS = {"dop853": make_explicit(TABLEAUS["dop853"]), "dopri5": make_explicit(TABLEAUS["dopri5"]), "radau5": RADAU5}


def load(stretch, internal, p):
    """(23)."""
    return (1 + p / internal**2) / stretch**2 - (1 + p * internal**4) / stretch**8


def flow(stretch, internal):
    """(26): the rate of the internal stretch."""
    return stretch**2 / internal**3 - internal**3 / stretch**4


def load_slopes(stretch, internal, p):
    """Derivatives of (23) with respect to the two stretches, term by term."""
    by_stretch = -2 * (1 + p / internal**2) / stretch**3 + 8 * (1 + p * internal**4) / stretch**9
    by_internal = -2 * p / internal**3 / stretch**2 - 4 * p * internal**3 / stretch**8
    return by_stretch, by_internal


def along_ramp(v, y, p, k):
    """Everything at a state on a ramp of rate k, by implicit differentiation of (23) with (26).

    The load is e_C (k T)**2, so e' = 2 k sqrt(e_C e). Rates of change with v are quotients of those with time, both
    of them multiplied by de/dlambda, which vanishes at the instability.
    """
    v, y, p, k = map(mp.mpf, (v, y, p, k))
    stretch = mp.sqrt(1 + v * v)
    internal = stretch * mp.sqrt(1 - y)
    e = load(stretch, internal, p)
    by_stretch, by_internal = load_slopes(stretch, internal, p)
    load_rate = 2 * k * mp.sqrt(E_C * e)
    stretch_rate = load_rate - by_internal * flow(stretch, internal)  # times by_stretch
    y_rate = (
        2 * internal**2 / stretch**3 * stretch_rate - 2 * internal / stretch**2 * flow(stretch, internal) * by_stretch
    )
    v_rate = stretch / v * stretch_rate
    # D = -de/du with u = lambda**-2
    return SimpleNamespace(
        e=e, D=by_stretch * stretch**3 / 2, dy_dv=y_rate / v_rate, de_dv=load_rate * by_stretch / v_rate
    )


def states(count):
    """Random admissible states: load and stretch rising, xi between 1 and lambda; some hardly strained or relaxed."""
    rng = np.random.default_rng(20110301)
    p = 10.0 ** rng.uniform(-9, 3, count)
    k = 10.0 ** rng.uniform(-6, 5, count)
    v = 10.0 ** rng.uniform(-4, 0.6, count)
    largest = v * v / (1.0 + v * v)  # xi = 1
    y = largest * np.where(rng.random(count) < 0.5, rng.random(count), 10.0 ** rng.uniform(-9, 0, count))
    p[:10] = 0.0
    return zip(*(part.tolist() for part in (v, y, p, k)), strict=True)


def speed_of(k):
    return 2.0 * k * math.sqrt(float(E_C))


def test_rhs_is_that_of_the_paper():
    for v, y, p, k in states(400):
        expected = along_ramp(v, y, p, k).dy_dv
        found = area_strain.rhs(v, y, p, speed_of(k))
        # dy/dv changes sign: what cancels there is of the size of 2 v u z e' / (e' + ...) at most
        size = max(abs(expected), 2 * v * y)
        assert abs(found - expected) <= 1e-12 * size, (v, y, p, k)


@pytest.mark.parametrize("k", [1e-6, 1.0, 1e5])
@pytest.mark.parametrize("p", [0.0, 1e-12, 3.0, 999.0])
def test_rhs_of_the_unloaded_film(p, k):
    assert area_strain.rhs(0.0, 0.0, p, speed_of(k)) == 0.0
    # xi = 1 at first: y = 1 - lambda**-2, from v**2 on
    v = 1e-9 * min(k, 1.0)
    assert area_strain.rhs(v, v * v / (1 + v * v), p, speed_of(k)) == pytest.approx(2 * v, rel=1e-6)


def test_jacobian_is_the_derivative_of_the_rhs():
    for v, y, p, k in states(100):
        if y == 0.0:
            continue
        speed = speed_of(k)
        f = area_strain.rhs(v, y, p, speed)
        step = mp.mpf(y) / 10**20
        expected = (along_ramp(v, y + step, p, k).dy_dv - along_ramp(v, y - step, p, k).dy_dv) / (2 * step)
        size = max(abs(expected), abs(f / y))
        assert abs(area_strain.jacobian(v, y, f, p, speed) - expected) <= 1e-3 * size, (v, y, p, k)


def test_event_is_that_of_the_paper():
    for v, y, p, k in states(100):
        here = along_ramp(v, y, p, k)
        excess, D, change, over_D = area_strain.event(v, y, float(here.dy_dv), p, speed_of(k))
        step = mp.mpf(v) / 10**20
        ahead, behind = (along_ramp(v + s, y + s * here.dy_dv, p, k) for s in (step, -step))
        numeric = (ahead.D - behind.D) / (2 * step)
        terms = 1 + p * (1 + v * v)  # D is a difference of terms of this size
        assert excess == pytest.approx(float(here.e - E_C), rel=1e-13, abs=1e-15 * p)
        assert abs(D - here.D) <= 1e-14 * terms
        assert abs(change - numeric) <= 1e-12 * (abs(numeric) + terms * v + p * abs(here.dy_dv))
        assert over_D == pytest.approx(float(here.de_dv / here.D), rel=1e-11)
        assert over_D > 0


def test_excess_and_flow_are_those_of_the_paper():
    for v, y, p, _ in states(100):
        stretch = mp.sqrt(1 + mp.mpf(v) ** 2)
        internal = stretch * mp.sqrt(1 - mp.mpf(y))
        excess, h, u, d = area_strain.excess_and_flow(v, y, p)
        assert u == pytest.approx(float(stretch**-2), rel=1e-15)
        assert d == pytest.approx(float(stretch**-2 - U_STAR), rel=1e-15, abs=1e-15)
        # h is half the rate of xi**2
        assert h == pytest.approx(float(internal * flow(stretch, internal)), rel=1e-14)
        relaxing = float(p * stretch**-4 * internal * flow(stretch, internal))
        assert excess == pytest.approx(float(load(stretch, internal, mp.mpf(p)) - E_C), rel=1e-14, abs=1e-14 * relaxing)


@pytest.mark.parametrize("p", [1e-15, 1e-12, 1e-6])
def test_excess_of_a_film_that_hardly_relaxes(p):
    """Within p of its largest load, where the load itself would be rounded."""
    for distance in (-1e-9, 0.0, 3e-9):
        v, y = math.sqrt(float(1 / U_STAR - 1)) + distance, 0.3
        stretch = mp.sqrt(1 + mp.mpf(v) ** 2)
        internal = stretch * mp.sqrt(1 - mp.mpf(y))
        expected = load(stretch, internal, mp.mpf(p)) - E_C
        assert area_strain.excess_and_flow(v, y, p)[0] == pytest.approx(float(expected), rel=1e-14, abs=1e-24)


def relaxation_rate(stretch, p):
    """Rate at which a film near xi = lambda returns to it under a constant load: (26) linearised along (23)."""
    by_stretch, by_internal = load_slopes(stretch, stretch, p)
    h = mp.mpf(10) ** -20
    flow_by_stretch = (flow(stretch + h, stretch) - flow(stretch - h, stretch)) / (2 * h)
    flow_by_internal = (flow(stretch, stretch + h) - flow(stretch, stretch - h)) / (2 * h)
    return -(flow_by_internal - flow_by_stretch * by_internal / by_stretch)


def relaxations_left(v, p, k):
    """Integral of that rate over the time from a relaxed state with area strain v**2 to the largest relaxed load."""
    p, k = mp.mpf(p), mp.mpf(k)

    def integrand(stretch):
        e = load(stretch, stretch, mp.mpf(0))
        by_stretch = -2 / stretch**3 + 8 / stretch**9
        return relaxation_rate(stretch, p) * by_stretch / (2 * k * mp.sqrt(E_C * e))

    return mp.quad(integrand, [mp.sqrt(1 + mp.mpf(v) ** 2), mp.mpf(2) ** (mp.mpf(1) / 3)], maxdegree=4)


def start(name, m, k, rtol):
    """Return the lane of a film that is about to climb without end."""
    method = METHODS[name]
    w = np.zeros((method.rows, 1))
    damping = damping_for(rtol) if method.late_start else math.inf
    w[area_lanes.RATE], w[area_lanes.FIELD], w[area_lanes.P] = k, math.inf, m - 1.0
    with np.errstate(all="ignore"):  # where no entry exists, a NaN is computed, and not used
        prepare(w, 0, rtol, method.tolerance_factor, damping)
    return w


@pytest.mark.parametrize("rtol", [1e-3, 1e-12])
@pytest.mark.parametrize("m", [1.0, 1.01, 4.0, 1000.0])
def test_a_slow_ramp_begins_where_errors_of_its_start_have_decayed(m, rtol):
    late = 0
    for k in (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1):
        w = start("dop853", m, k, rtol)
        v, y = w[area_lanes.START_V, 0], w[area_lanes.START_Y, 0]
        if v == 0.0:
            assert y == 0.0
            continue
        late += 1
        asked = damping_for(rtol)
        assert asked >= -math.log(rtol)
        left = relaxations_left(v, m - 1.0, k)
        assert left >= asked
        assert left <= 4 * asked  # or the start of the ramp would cost more the slower it is
        # to leading order, y on the slow manifold keeps pace with v: D e' = ... gives y = e'/(6 u**2 D)
        stretch = mp.sqrt(1 + mp.mpf(v) ** 2)
        e = load(stretch, stretch, mp.mpf(0))
        leading = 2 * k * mp.sqrt(E_C * e) / (6 / stretch**4 * (4 / stretch**6 - 1))
        assert y == pytest.approx(float(leading), rel=1e-6)
    assert late >= 2


@pytest.mark.parametrize("m", [1.01, 4.0, 1000.0])
def test_other_climbs_begin_with_the_unloaded_film(m):
    for w in (
        start("dop853", m, 1.0, 1e-6),
        start("dop853", m, 1e5, 1e-12),
        start("radau5", m, 1e-6, 1e-6),
    ):
        assert w[area_lanes.START_V, 0] == 0.0
        assert w[area_lanes.START_Y, 0] == 0.0
        assert w[area_lanes.START_STEP, 0] > 0.0
