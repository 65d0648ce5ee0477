"""Landing on an event of a climb: the instability, or a given load beside it, however close."""

import math
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import dea_maps as dm
from dea_maps.kernels import solvers
from dea_maps.kernels.lane_state import AT_END, FAILED, RUNNING
from dea_maps.kernels.rising import driver as ramp
from dea_maps.kernels.rising import state as area_lanes
from dea_maps.kernels.rising.explicit import make_explicit
from dea_maps.kernels.rising.radau import RADAU5
from dea_maps.kernels.runge_kutta.tableaus import TABLEAUS

E_C = 0.75 * 4.0 ** (-1.0 / 3.0)
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


def climbed(name, m, k, fields, rtol):
    """Take every field up a ramp of rate k by a method: where it got to, and the status there."""
    count = len(fields)
    climb = ramp.make_climb(METHODS[name], lambda field, modulus_ratio: field, lanes=count)
    status, reached = np.full(count, RUNNING, np.int8), np.empty((len(area_lanes.REACHED), count))
    with np.errstate(all="ignore"):  # steps that are too long may give NaN, and idle lanes anything
        climb(np.array(fields), np.full(count, k), np.full(count, m), rtol, status, reached)
    return status, reached


def equilibrium(e, internal, p):
    """Stretch under a load at an internal stretch, (23), on the branch before the instability."""
    A, B = 1 + p / internal**2, 1 + p * internal**4
    highest = (0.25 * A / B) ** (1 / 3)
    u = brentq(lambda u: A * u - B * u**4 - e, highest, (A / B) ** (1 / 3), xtol=1e-15, rtol=1e-15)
    for _ in range(2):
        u -= (A * u - B * u**4 - e) / (A - 4 * B * u**3)
    return u**-0.5


@cache
def reference_of(m, k):
    return Ramp(m, k)


class Ramp:
    """A ramp integrated anew: (26) in time with (23) solved for the stretch, then over the stretch to the instability.

    Attributes
    ----------
    field, stretch, internal : float
        At the instability.
    """

    def __init__(self, m, k):
        p, half, unit = m - 1.0, 0.9, E_C

        def in_time(time, internal):
            return flow(equilibrium(unit * (k * time) ** 2, internal, p), internal)

        def over_stretch(stretch, internal):
            by_stretch, by_internal = load_slopes(stretch, internal, p)
            rate = flow(stretch, internal)
            return rate * by_stretch / (2 * k * math.sqrt(unit * load(stretch, internal, p)) - by_internal * rate)

        def instability(stretch, internal):
            return load_slopes(stretch, internal[0], p)[0]

        instability.terminal = True
        accuracy = {"method": "DOP853", "rtol": 3e-14, "atol": 1e-16}
        internal = solve_ivp(lambda t, x: [in_time(t, x[0])], (0.0, half / k), [1.0], **accuracy).y[0, -1]
        self.start = equilibrium(unit * half**2, internal, p)
        found = solve_ivp(
            lambda s, x: [over_stretch(s, x[0])],
            (self.start, 40.0),
            [internal],
            events=instability,
            dense_output=True,
            **accuracy,
        )
        self.stretch, self.internal = found.t_events[0][0], found.y_events[0][0][0]
        self.internal_of = lambda stretch: found.sol(stretch)[0]
        self.field_of = lambda stretch: math.sqrt(load(stretch, self.internal_of(stretch), p) / unit)
        self.field = self.field_of(self.stretch)

    def internal_at(self, field):
        """Internal stretch at a field before the failure."""
        return self.internal_of(brentq(lambda s: self.field_of(s) - field, self.start, self.stretch, xtol=1e-14))


def end_of_climb(status, reached, i):
    """Field and xi where a climb ended: a state close to the end, and a fraction of the slope there."""
    fraction = 1.0 if status[i] == AT_END else 0.5
    field = math.sqrt(1 + reached[area_lanes.REACHED_LOAD_EXCESS, i] / E_C)
    return field, math.sqrt(solvers._square_of_internal(reached, i, fraction))


@pytest.mark.parametrize(("m", "k"), [(1.01, 0.01), (4.0, 0.01), (4.0, 1.0), (4.0, 100.0), (100.0, 0.3)])
@pytest.mark.parametrize(("name", "rtol"), [("dop853", 1e-11), ("dop853", 1e-5), ("dopri5", 1e-7), ("radau5", 1e-7)])
def test_landing_on_a_load_beside_that_of_failure(name, rtol, m, k):
    reference = reference_of(m, k)
    gaps = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9]
    fields = [reference.field * (1 + sign * 0.5 * gap) for sign in (-1, 1) for gap in gaps]  # gaps of the load
    status, where = climbed(name, m, k, [*fields, math.inf], rtol)
    for i, field in enumerate(fields):
        below, gap = field < reference.field, abs(field / reference.field - 1)
        allowed = rtol * min(1.0, m - 1.0) + 1e-13
        if gap > allowed:  # closer loads may be taken for either
            assert status[i] == (AT_END if below else FAILED), (field, gap)
        reached, internal = end_of_climb(status, where, i)
        assert reached == pytest.approx(min(field, reference.field), rel=allowed)
        expected = reference.internal_at(field) if below else reference.internal
        assert internal == pytest.approx(expected, rel=rtol + 1e-12)
    reached, internal = end_of_climb(status, where, -1)
    assert status[-1] == FAILED
    assert reached == pytest.approx(reference.field, rel=rtol + 1e-13)
    assert internal == pytest.approx(reference.internal, rel=rtol + 1e-12)


# Films that hardly relax, held within a few units of rounding of the field at which they fail at once: modulus ratio,
# field, rate, and the time to failure by tests/reference/taylor.py.
HARDLY_RELAXING = [
    (1.000000000000015, 1.0000000000000073, 51.64918975507468, 0.022151540826647758),
    (1.0000000000033424, 1.0000000000016709, 3551.026322730167, 0.0002816087263562811),
    (1.0000000000000009, 1.0000000000000002, 44533.023923836925, 0.16312206689020217),
    (1.0000000000000009, 1.0000000000000004, 4005.919980302824, 0.0002496305480181874),
    (1.0000000000012448, 1.0000000000006222, 5795.017831397105, 0.00021566949020377876),
    (1.0000000000000138, 1.0000000000000067, 132.11866154231612, 0.013120913126940865),
    (1.0000000000029554, 1.0000000000014766, 2809.2463143079244, 0.00044817557861113447),
    (1.0000000000000013, 1.0000000000000004, 17862.353982494347, 0.09216816783722327),
]


@pytest.mark.parametrize("rtol", [1e-4, 1e-8, 1e-10, 1e-12])
def test_films_that_hardly_relax(rtol):
    for ratio, field, rate, expected in HARDLY_RELAXING:
        ds = dm.sweep(dm.RampHold(), modulus_ratio=ratio, field=field, rate=rate, rtol=rtol)
        assert ds.outcome == 1
        assert ds.time_to_failure.item() == pytest.approx(expected, rel=max(rtol, 2e-8))
