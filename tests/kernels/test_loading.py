"""The kernel of general loading programs against certified references, exact cases and the theorems."""

import itertools
import math
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

import dea_maps as dm
from dea_maps.kernels import lane_state as lanes
from dea_maps.kernels.loading import build, rows
from dea_maps.kernels.loading import cycles as many
from dea_maps.kernels.loading.finish import make_finish
from dea_maps.kernels.loading.law import FREE
from dea_maps.kernels.loading.march import make_march
from dea_maps.kernels.loading.pieces import ENDLESS, LINEAR, LINEAR_ONLY, SINE
from dea_maps.kernels.loading.results import (
    CRITICAL_FIELD,
    CRITICAL_INTERNAL_STRETCH,
    CRITICAL_STRETCH,
    CYCLES_TO_FAILURE,
    FINAL_STRETCH,
    LARGEST_STRETCH,
    RESULTS,
    STEADY_STRETCH_MAX,
    STEADY_STRETCH_MIN,
    TIME_TO_FAILURE,
)

SURVIVES, FAILED, AT_ONCE = lanes.SURVIVES, lanes.FAILED, lanes.FAILS_AT_ONCE
OUTCOMES = {"0": SURVIVES, "1": FAILED, "2": AT_ONCE}


def tables(pieces, parameters, cells):
    """Arrays of pieces whose arguments are numbers or (factor, name)."""
    names = list(parameters)
    kind = np.array([piece[0] for piece in pieces], np.int8)
    scale, source = np.zeros((len(pieces), 4)), np.zeros((len(pieces), 4), np.int64)
    for number, (_, *arguments) in enumerate(pieces):
        for slot, argument in enumerate(arguments):
            factor, name = argument if isinstance(argument, tuple) else (argument, None)
            scale[number, slot] = factor
            source[number, slot] = names.index(name) + 1 if name else 0
    columns = np.empty((len(names) + 1, cells))
    columns[0] = 1.0
    for row, values in enumerate(parameters.values(), 1):
        columns[row] = values
    return kind, scale, source, columns


def sweep(pieces, *, m, repeats=1, xi=1.0, sigma=0.0, rtol=1e-6, once=0, **parameters):
    """Status and result of cells whose parameters broadcast."""
    m, xi, sigma, *rest = np.broadcast_arrays(*(np.atleast_1d(x) for x in (m, xi, sigma, *parameters.values())))
    table = tables(pieces, dict(zip(parameters, rest, strict=True)), m.size)
    status, result = np.empty(m.size, np.int8), np.empty((RESULTS, m.size))
    kernel = build.sweep(any(piece[0] == SINE for piece in pieces), bool(np.any(sigma > 0)))
    films = (np.array(x, float).ravel() for x in (m, xi, sigma))
    kernel(*table, repeats, once, *films, rtol, status, result)
    return status, result


def hold(field, time):
    return LINEAR, field, field, time


FIELD = (1.0, "field")
PULSE_TRAIN = [hold(FIELD, (1.0, "on")), hold(0.0, (1.0, "off"))]
TRIANGLE_TRAIN = [(LINEAR, 0.0, FIELD, (0.5, "period")), (LINEAR, FIELD, 0.0, (0.5, "period"))]


# --- certified references


@pytest.fixture(scope="module")
def reference():
    """Import the module of the certified table, which is in no package."""
    folder = Path(__file__).parents[1] / "reference"
    sys.path.insert(0, str(folder))
    import loading

    yield loading
    sys.path.remove(str(folder))


def as_pieces(reference, row):
    """Pieces of a row, how often they are repeated, and how many of them make up the first repetition."""
    arguments = [float(row[name]) for name in "abcd" if row[name]]
    make, repeated = reference.PROGRAMS[row["program"]]
    first = reference.FIRST[row["program"]](*arguments) if row["program"] in reference.FIRST else []
    pieces = []
    for start, slope, amplitude, period, duration in [*first, *make(*arguments)]:
        if amplitude:
            pieces.append((SINE, start, amplitude, duration, period))
        else:
            pieces.append((LINEAR, start, start + slope * duration, duration))
    return pieces, ENDLESS if repeated else 1, len(first)


def test_table_is_complete(reference):
    rows = reference.read()
    for program in reference.PROGRAMS:
        mine = [row for row in rows if row["program"] == program]
        assert len(mine) >= 80
        assert {row["outcome"] for row in mine} >= {"0", "1"}
        assert sum(row["kind"] == "beside_threshold" for row in mine) >= 15
        assert sum(float(row["prestretch"]) > 1 for row in mine) >= 5
        assert max(float(row["modulus_ratio"]) for row in mine) > 200
        assert max(float(row["prestretch"]) for row in mine) > 4.5
    assert all(float(row["agreement"]) <= reference.REQUIRED for row in rows)


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-8, 1e-10])
def test_certified_table(reference, rtol):
    """Outcomes exact, results within rtol; what is unresolved lies next to a threshold."""
    rows, unresolved = reference.read(), 0
    for row in rows:
        pieces, repeats, once = as_pieces(reference, row)
        pre = float(row["prestretch"])
        status, result = sweep(
            pieces, m=float(row["modulus_ratio"]), xi=pre, sigma=pre - pre**-5, repeats=repeats, once=once, rtol=rtol
        )
        if status[0] not in OUTCOMES.values():
            assert row["kind"] == "beside_threshold", row
            unresolved += 1
            continue
        assert status[0] == OUTCOMES[row["outcome"]], row
        for name, number in (
            ("time_to_failure", TIME_TO_FAILURE),
            ("critical_stretch", CRITICAL_STRETCH),
            ("critical_internal_stretch", CRITICAL_INTERNAL_STRETCH),
            ("critical_field", CRITICAL_FIELD),
            ("final_stretch", FINAL_STRETCH),
            ("cycles_to_failure", CYCLES_TO_FAILURE),
        ):
            if row[name]:
                assert result[number, 0] == pytest.approx(float(row[name]), rel=rtol, abs=0), (name, row)
            else:
                assert math.isnan(result[number, 0]), (name, row)
    assert unresolved <= 0.05 * len(rows)


def test_rows_of_the_table_are_found_again(reference):
    pytest.importorskip("heyoka")
    rows = reference.read()
    assert all(reference.confirmed(row) for row in rows[:: len(rows) // 8])


# --- the three programs that have kernels of their own


@pytest.mark.parametrize("rtol", [1e-4, 1e-8, 1e-12])
def test_step_ramp_and_hold_agree_with_their_own_kernels(rtol):
    random = np.random.default_rng(3)
    m = np.exp(random.uniform(0.05, math.log(1000.0), 60))
    field = 1.0 + (np.sqrt(m) - 1.0) * random.uniform(0.01, 0.99, 60)
    rate = 10.0 ** random.uniform(-2.0, 2.0, 60)
    for number in range(m.size):
        case = {"modulus_ratio": m[number], "field": field[number], "rate": rate[number]}
        cases = (
            (dm.Step(), ("field",), [hold(FIELD, 0.7)]),
            (dm.Ramp(), ("rate",), [(LINEAR, 0.0, 40.0, (40.0, "over_rate"))]),
            (dm.RampHold(), ("field", "rate"), [(LINEAR, 0.0, FIELD, (1.0, "rise")), hold(FIELD, 0.0)]),
        )
        for program, names, pieces in cases:
            expected = dm.sweep(program, modulus_ratio=m[number], rtol=1e-12, **{name: case[name] for name in names})
            given = {"field": field[number], "over_rate": 1.0 / rate[number], "rise": field[number] / rate[number]}
            status, result = sweep(pieces, m=m[number], rtol=rtol, **given)
            assert status[0] == FAILED
            for name, row in (("time_to_failure", TIME_TO_FAILURE), ("critical_stretch", CRITICAL_STRETCH)):
                assert result[row, 0] == pytest.approx(float(expected[name]), rel=1.01 * rtol)


# lambda of u - u**4 = 0.25 e_C, its root beside 1, by bisection in exact fractions
RELAXED_AT_HALF = 1.0221972414806


def test_step_at_the_boundaries_of_its_outcomes():
    field = [0.0, 0.5, 1.0, math.nextafter(2.0, 0.0), 2.0, 3.0]
    status, result = sweep([hold(FIELD, 1.0)], m=4.0, field=field)
    assert list(status) == [SURVIVES, SURVIVES, SURVIVES, FAILED, AT_ONCE, AT_ONCE]
    assert list(result[TIME_TO_FAILURE, 4:]) == [0.0, 0.0]
    assert list(result[CRITICAL_FIELD, 4:]) == [2.0, 2.0]
    assert result[FINAL_STRETCH, :3] == pytest.approx([1.0, RELAXED_AT_HALF, 2 ** (1 / 3)], rel=1e-9)


# --- dead loads

PRESTRETCHED = {
    1.25: (1.6813, 0.5521),
    1.5: (2.1413, 0.4023),
    2.0: (2.9704, 0.2838),
    3.0: (4.4960, 0.1869),
    4.0: (5.9991, 0.1400),
}


@pytest.mark.parametrize("prestretch", PRESTRETCHED)
def test_elastic_film_under_a_dead_load(prestretch):
    """It fails where the largest load of the relaxed film is met, whatever the rate."""
    stretch, field = PRESTRETCHED[prestretch]
    pieces = [(LINEAR, 0.0, 2.0, (1.0, "time"))]
    load = prestretch - prestretch**-5
    status, result = sweep(pieces, m=1.0, xi=prestretch, sigma=load, time=[0.1, 10.0], rtol=1e-8)
    assert list(status) == [FAILED, FAILED]
    assert result[CRITICAL_STRETCH] == pytest.approx([stretch, stretch], abs=5.1e-5)
    assert result[CRITICAL_FIELD] == pytest.approx([field, field], abs=5.1e-5)
    assert result[TIME_TO_FAILURE] == pytest.approx(result[CRITICAL_FIELD] * np.array([0.05, 5.0]), rel=1e-8)


@pytest.mark.parametrize(("prestretch", "ratio"), [(1.0, 2.0), (1.5, 2.146), (2.0, 1.801), (3.0, 1.410), (4.0, 1.243)])
def test_sudden_field_on_a_film_relaxed_under_its_dead_load(prestretch, ratio):
    """Instant over relaxed threshold, m = 4: where failing at once begins, over where surviving ends."""
    load = prestretch - prestretch**-5
    edges = []
    for outcome in (AT_ONCE, SURVIVES):
        low, high = 0.05, 2.5
        for _ in range(24):
            middle = 0.5 * (low + high)
            status, _ = sweep([hold(FIELD, 1.0)], m=4.0, xi=prestretch, sigma=load, field=middle, rtol=1e-3)
            below = status[0] != AT_ONCE if outcome == AT_ONCE else status[0] == SURVIVES
            low, high = (middle, high) if below else (low, middle)
        edges.append(low)
    assert edges[0] / edges[1] == pytest.approx(ratio, abs=6e-4)


# --- outcomes by the theorems


def test_hold_below_the_critical_field_kills_a_film_that_an_overdrive_stretched_too_far():
    """xi_u = 1.445 at 0.95: left at xi = 1.5 the film fails, left before it survives."""
    pieces = [hold((1.0, "over"), (1.0, "time")), hold(FIELD, 0.0)]
    time = np.linspace(4.0, 9.0, 26)
    status, result = sweep(pieces, m=4.0, over=1.05, field=0.95, time=time, rtol=1e-8)
    assert set(status) == {SURVIVES, FAILED}
    first = int(np.argmax(status == FAILED))
    assert np.all(status[:first] == SURVIVES) and np.all(status[first:] == FAILED)
    late = result[TIME_TO_FAILURE, first:] > time[first:]
    assert late.any()  # under the hold
    # lambda_c and xi_c at a held load depend on load and m alone
    assert np.ptp(result[CRITICAL_INTERNAL_STRETCH, first:][late]) < 1e-8


def test_jump_to_more_than_the_film_carries():
    pieces = [hold(0.9, 2.0), hold(FIELD, 1.0)]
    status, result = sweep(pieces, m=4.0, field=[1.0, 1.6, 1.7, 1.8, 5.0], rtol=1e-8)
    assert status[0] == SURVIVES and np.all(status[1:] == FAILED)
    at_jump = result[TIME_TO_FAILURE] == 2.0
    assert list(at_jump) == [False, False, False, True, True]
    xi = result[CRITICAL_INTERNAL_STRETCH, 3]
    A, B = 1 + 3 / xi**2, 1 + 3 * xi**4
    assert result[CRITICAL_FIELD, 3:] == pytest.approx(math.sqrt(A ** (4 / 3) * B ** (-1 / 3)), rel=1e-8)


@pytest.mark.parametrize("width", [0.1, 0.5, 0.9])
def test_pulse_fails_exactly_if_it_is_longer_than_the_time_to_failure_of_the_step(width):
    step = dm.sweep(dm.Step(), field=np.linspace(1.05, 1.95, 19), modulus_ratio=4.0, rtol=1e-10)
    pieces = [hold(FIELD, width), hold(0.0, 0.0)]
    status, result = sweep(pieces, m=4.0, field=step.field.values, rtol=1e-9)
    fails = step.time_to_failure.values <= width
    assert np.array_equal(status == FAILED, fails) and fails.any() and not fails.all()
    assert result[TIME_TO_FAILURE, fails] == pytest.approx(step.time_to_failure.values[fails], rel=1e-9)


def test_pulse_far_longer_than_the_time_to_failure():
    """A first step in time that is longer than the film lasts leads to states that mean nothing."""
    m = np.append(4.057396300874038, np.linspace(2.0, 8.0, 999))
    field = np.append(1.379634921994639, 0.685 * np.sqrt(m[1:]))
    status, result = sweep([hold(FIELD, 2076.2044441280686), hold(0.0, 0.0)], m=m, field=field, rtol=1e-3)
    films = {"field": xr.DataArray(field, dims="film"), "modulus_ratio": xr.DataArray(m, dims="film")}
    step = dm.sweep(dm.Step(), **films)
    fails = step.time_to_failure.values < 2000.0
    assert np.array_equal(status == FAILED, fails)
    assert result[TIME_TO_FAILURE, fails] == pytest.approx(step.time_to_failure.values[fails], rel=1e-3)


@pytest.mark.parametrize(("duty", "peak"), [(0.1, 1.788), (0.25, 1.548), (0.5, 1.28519), (0.75, 1.117), (0.9, 1.042)])
def test_fast_square_waves_fail_where_the_averaged_flow_does(duty, peak):
    period = 1e-2
    near = 10.0 ** -(len(str(peak)) - 2)
    field = np.array([peak - near, peak + near])
    status, _ = sweep(PULSE_TRAIN, m=4.0, field=field, on=duty * period, off=(1 - duty) * period, repeats=ENDLESS)
    assert list(status) == [SURVIVES, FAILED]


def bisected(pieces, low, high, width, **given):
    """Return the field between survival and failure."""
    while high - low > width:
        field = np.linspace(low, high, 17)
        status, _ = sweep(pieces, field=field, repeats=ENDLESS, rtol=1e-8, **given)
        first = int(np.argmax(status != SURVIVES))
        low, high = field[first - 1], field[first]
    return high


def test_cycles_beside_the_loss_of_a_limit_cycle_at_a_border():
    """Triangle, m = 2, period 0.1: cycles ~ log(1/delta)."""
    at = bisected(TRIANGLE_TRAIN, 1.30, 1.31, 2e-9, m=2.0, period=0.1)
    field = at * (1.0 + 10.0 ** -np.arange(2.0, 7.0))
    status, result = sweep(TRIANGLE_TRAIN, m=2.0, field=field, period=0.1, repeats=ENDLESS, rtol=1e-8)
    assert np.all(status == FAILED)
    assert list(result[CYCLES_TO_FAILURE]) == [10, 23, 37, 52, 67]


def test_cycles_beside_the_loss_of_a_limit_cycle_at_a_tangent():
    """Square, m = 4, duty 0.5, period 1: cycles ~ delta**-1/2.

    By the series of tests/reference/loading.py the least change of r over a cycle is -6.4e-13 at the field below.
    """
    at = 1.2798579709421
    field = at * (1.0 + 10.0 ** -np.arange(2.0, 7.0))
    for rtol in (1e-3, 1e-6, 1e-9):
        status, result = sweep(
            PULSE_TRAIN, m=4.0, field=[at * (1.0 - 1e-9), *field], on=0.5, off=0.5, repeats=ENDLESS, rtol=rtol
        )
        assert list(status) == [SURVIVES] + 5 * [FAILED]
        assert list(result[CYCLES_TO_FAILURE, 1:]) == [15, 61, 208, 674, 2146]


# --- many cycles from few


def points_of(choice, width, curve):
    return width * many.place(many.POINTS[choice, : many.COUNTS[choice]], curve)


@pytest.mark.parametrize("choice", range(len(many.COUNTS)))
@pytest.mark.parametrize("curve", [0.0, 0.5, 0.98])
@pytest.mark.parametrize(
    ("least", "bend", "width", "at"),
    [(1e-3, 1.0, 0.3, 0.15), (1e-4, 1.0, 0.01, 0.0), (2e-6, 1.0, 0.3, 0.15), (1e-5, 1e-3, 0.5, 0.2)],
)
def test_cycles_are_counted_as_by_iteration(least, bend, width, at, curve, choice):
    """d = least + bend (s - at)**2 (1 + 0.3 s), by direct iteration with compensated sums, to the last known cycle."""

    def change(s):
        return least + bend * (s - at) ** 2 * (1.0 + 0.3 * s)

    points = points_of(choice, width, curve)
    s = lost = 0.0
    cycles, slopes = 0, 1.0
    while True:
        step = change(s) - lost
        following = s + step
        if following >= points[-1]:
            break
        slopes *= 1.0 + bend * (s - at) * (2.0 * (1.0 + 0.3 * s) + 0.3 * (s - at))
        s, lost, cycles = following, (following - s) - step, cycles + 1
    series = np.zeros((3, many.NODES))
    left = many.fit(change(points), choice, series)
    found, counted, grown, gathered, _ = many.advance(series, choice, width, curve, 0.0, math.inf)
    assert left < 1e-15
    assert counted == cycles
    assert abs(found - s) <= 1e-16 * gathered + 1e-11 * change(s)
    assert grown == pytest.approx(slopes, rel=1e-2)
    assert many.advance(series, choice, width, curve, 0.0, cycles - 5.0)[1] == cycles - 5.0
    if at > 0.0:  # not beyond where d is too small to be counted on
        stop, counted, _, _, _ = many.advance(series, choice, width, curve, 1.5 * least, math.inf)
        assert counted < cycles and stop < at and least <= change(stop) <= 1.5 * least


@pytest.mark.parametrize("choice", range(len(many.COUNTS)))
@pytest.mark.parametrize("wrong", [-0.05, -1e-2, -1e-3, 0.0, 1e-3, 5e-3, 1e-2])
@pytest.mark.parametrize("room", [0.02, 0.08])
def test_what_a_series_leaves_out_next_to_the_last_cycle_survived(wrong, room, choice):
    """d has a term in (R - s)**1.5; the ranges leave ``room`` of the way to R + ``wrong``, where R is supposed."""

    def change(s):
        return 1e-2 + 0.05 * np.exp(-s) + 0.05 * np.maximum(1.0 - s, 0.0) ** 1.5

    width, curve = (1.0 - room) * (1.0 + wrong), 1.0 - room
    series = np.zeros((3, many.NODES))
    left = many.fit(change(points_of(choice, width, curve)), choice, series)
    s = np.linspace(0.0, points_of(choice, width, curve)[-1], 301)
    missed = max(abs(many.change_at(series, choice, width, curve, x) - change(x)) for x in s)
    assert missed <= left + 1e-16
    if abs(wrong) <= 1e-3:  # and much less than in r itself
        assert left < 0.1 * many.fit(change(points_of(choice, width, 0.0)), choice, series)


def cycles_of_triangles(m, field, period, most):
    """Cycles that films survive, by steps of order 4 in the cube root of the time to or from the peak."""
    p, half, count, load = m - 1.0, 0.5 * period, 40, 0.75 * 4.0 ** (-1.0 / 3.0)
    r, x, alive, cycles = np.ones_like(field), np.ones_like(field), np.ones(field.size, bool), np.zeros(field.size)
    taus = np.linspace(0.0, 1.0, count + 1)

    def slope(r, tau):
        nonlocal x, alive
        a, b, c = 1.0 + p / r, 1.0 + p * r**2, load * (field * (1.0 - tau**3)) ** 2
        top = (a / (4.0 * b)) ** (1.0 / 3.0)
        alive = alive & (0.75 * a * top > c)
        for _ in range(4):
            x = np.maximum(x - (a * x - b * x**4 - c) / (a - 4.0 * b * x**3), top * (1.0 + 1e-6))
        return half * 6.0 * tau**2 * (1.0 / (r * x) - (r * x) ** 2)

    with np.errstate(all="ignore"):
        for _ in range(most):
            for tau, end in (*itertools.pairwise(taus[::-1]), *itertools.pairwise(taus)):
                step, middle = abs(end - tau), 0.5 * (tau + end)
                one = slope(r, tau)
                two = slope(r + 0.5 * step * one, middle)
                three = slope(r + 0.5 * step * two, middle)
                r = r + step * (one + 2.0 * two + 2.0 * three + slope(r + step * three, end)) / 6.0
            cycles += alive
    return cycles


def test_cycles_of_triangles_that_end_in_failure_are_those_of_steps_of_order_four():
    """Most of them are counted in one range, next to the last one that is survived."""
    random = np.random.default_rng(31)
    m, share, cycles = random.uniform(2.5, 12.0, 30), random.uniform(0.3, 1.0, 30), random.uniform(10.0, 40.0, 30)
    field, period = np.sqrt(m) * (0.76 + 0.1 * share), 1.0 / cycles
    expected = cycles_of_triangles(m, field, period, 100)
    assert np.sum((expected > 20) & (expected < 100)) > 15
    for rtol in (1e-3, 1e-6, 1e-10):
        status, result = sweep(TRIANGLE_TRAIN, m=m, field=field, period=period, repeats=ENDLESS, rtol=rtol)
        failed = status == FAILED
        assert np.all(failed[expected < 100])
        np.testing.assert_array_equal(np.minimum(result[CYCLES_TO_FAILURE, failed], 100), expected[failed])


def test_films_that_hardly_relax_survive_triangles_below_the_critical_field():
    """The load that they carry hardly depends on r, and so says nothing of the last cycle that would be survived."""
    random = np.random.default_rng(5)
    m, period = 1.0 + 10.0 ** random.uniform(-5.0, -1.0, 200), 10.0 ** random.uniform(-3.0, 3.0, 200)
    field = random.uniform(0.5, 0.95, 200)
    status, _ = sweep(TRIANGLE_TRAIN, m=m, field=field, period=period, repeats=ENDLESS, rtol=1e-6)
    assert np.all(status == SURVIVES)


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize(
    ("film", "cycles"),
    [
        # Counted by steps of 1e-10 and of 1e-8 alike; the last of them are not known to be survived beforehand.
        ({"modulus_ratio": 174.5001932637738, "prestretch": 3.522148369640674,
          "field": 0.4953143378237533, "period": 0.0022417146110758628}, 50911),
        ({"modulus_ratio": 14.161551535905991, "stress": 4.343686162006723,
          "field": 0.19679385190847407, "period": 0.00033184880157908223}, 165483),
    ],
)  # fmt: skip
def test_the_last_of_many_cycles_is_not_passed_over(film, cycles, rtol):
    found = dm.sweep(dm.TriangleTrain(), rtol=rtol, **film)
    assert found.cycles_to_failure == cycles


def averaged_life(m, field, duty):
    """Time to failure of a film under infinitely fast square waves: the integral of dr over the mean flow."""
    e = 0.75 * 4 ** (-1 / 3) * field**2

    def u_of(r, e):
        A, B = 1 + (m - 1) / r, 1 + (m - 1) * r * r
        u = (A / B) ** (1 / 3)
        for _ in range(60):
            u = u - (e - A * u + B * u**4) / (4 * B * u**3 - A)
        return u

    def flow(r):
        on, off = (r * u_of(r, load) for load in (e, 0.0))
        return 2 * (duty * (1 / on - on**2) + (1 - duty) * (1 / off - off**2))

    def margin(r):
        A, B = 1 + (m - 1) / r, 1 + (m - 1) * r * r
        return 0.75 * 4 ** (-1 / 3) * A ** (4 / 3) * B ** (-1 / 3) - e

    end = brentq(margin, 1.0, 1e4, xtol=1e-14)
    # Regular at the end in the root of the distance to it.
    return quad(lambda s: 2 * s / flow(end - s * s), 0.0, math.sqrt(end - 1.0), epsrel=1e-10, limit=400)[0]


@pytest.mark.parametrize(("m", "field", "period"), [(4.0, 1.2856, 1e-4), (4.0, 1.28525, 1e-3), (1000.0, 1.4137, 1e-4)])
def test_hundreds_of_thousands_of_fast_cycles_last_as_long_as_the_averaged_flow(m, field, period):
    status, result = sweep(PULSE_TRAIN, m=m, field=field, on=0.5 * period, off=0.5 * period, repeats=ENDLESS)
    assert status[0] == FAILED
    life = averaged_life(m, field, 0.5)
    assert result[TIME_TO_FAILURE, 0] == pytest.approx(life, rel=2e-3)
    assert result[CYCLES_TO_FAILURE, 0] == math.floor(result[TIME_TO_FAILURE, 0] / period)
    assert result[CYCLES_TO_FAILURE, 0] > 2e4


def test_many_repetitions_end_as_their_number_says():
    """Under a finite number: failed after fewer, or the same as without end."""
    given = {"m": 4.0, "field": [1.2, 1.29, 1.4], "on": 5e-4, "off": 5e-4, "rtol": 1e-8}
    status, result = sweep(PULSE_TRAIN, repeats=ENDLESS, **given)
    assert list(status) == [SURVIVES, FAILED, FAILED]
    cycles = result[CYCLES_TO_FAILURE]
    for repeats in (300, 30_000, 10_000_000):
        found, finite = sweep(PULSE_TRAIN, repeats=repeats, **given)
        fails = cycles < repeats  # NaN where it survives
        assert np.array_equal(found == FAILED, fails)
        assert finite[TIME_TO_FAILURE, fails] == pytest.approx(result[TIME_TO_FAILURE, fails], rel=1e-8)
        assert np.all(finite[CYCLES_TO_FAILURE, fails] == cycles[fails])
        assert finite[FINAL_STRETCH, ~fails] == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(
    ("pieces", "m", "peak"),
    [
        ([(SINE, 0.0, FIELD, 1e-3, 1e-3)], 4.0, 1.333083),
        ([(SINE, (0.5, "field"), (0.5, "field"), 1e-3, 1e-3)], 4.0, 1.463888),
        ([(LINEAR, 0.0, FIELD, 5e-4), (LINEAR, FIELD, 0.0, 5e-4)], 4.0, 1.556751),
        ([(LINEAR, 0.0, FIELD, 5e-4), (LINEAR, FIELD, 0.0, 5e-4)], 2.0, 1.307688),
    ],
    ids=["|sin|", "(1 - cos)/2", "triangle, m 4", "triangle, m 2"],
)
def test_fast_waves_fail_where_the_averaged_flow_does(pieces, m, peak):
    status, _ = sweep(pieces, m=m, field=[peak - 1e-5, peak + 1e-5], repeats=ENDLESS)
    assert list(status) == [SURVIVES, FAILED]


def test_internal_stretch_rises_from_cycle_to_cycle():
    """Iterates of the map are monotone: of a film that fails in the end, r after 1, 2, ... repetitions."""
    _, ends = sweep(PULSE_TRAIN, m=4.0, field=1.283, on=0.5, off=0.5, repeats=ENDLESS)
    count = int(ends[CYCLES_TO_FAILURE, 0])
    times = np.arange(1.0, count + 1.0)
    _, internal = trajectory([hold(1.283, 0.5), hold(0.0, 0.5)], times, m=4.0, repeats=ENDLESS)
    assert count > 20 and np.all(np.diff(internal) > 0.0)


# --- repetitions that begin at another field than zero

RATCHET = [
    (LINEAR, 0.0, FIELD, 0.5), hold(FIELD, 0.3), (LINEAR, FIELD, (0.5, "field"), 0.4),
    (LINEAR, (0.5, "field"), FIELD, 0.5), hold(FIELD, 0.3), (LINEAR, FIELD, (0.5, "field"), 0.4),
]  # fmt: skip


def test_repetitions_begin_where_the_one_before_ended():
    """A number of repetitions, against the same pieces written out."""
    field = np.linspace(0.6, 1.7, 23)
    written = RATCHET + RATCHET[3:] * 4
    expected_status, expected = sweep(written, m=4.0, field=field, rtol=1e-9)
    status, result = sweep(RATCHET, m=4.0, field=field, repeats=6, once=3, rtol=1e-9)
    assert np.array_equal(status, expected_status) and set(status) == {SURVIVES, FAILED}
    for row in (TIME_TO_FAILURE, CRITICAL_STRETCH, CRITICAL_FIELD, FINAL_STRETCH, LARGEST_STRETCH):
        np.testing.assert_allclose(result[row], expected[row], rtol=2e-9)
    later = (status == FAILED) & (result[TIME_TO_FAILURE] < 7.2)
    assert np.array_equal(result[CYCLES_TO_FAILURE, later], np.floor(result[TIME_TO_FAILURE, later] / 1.2))


def test_a_limit_cycle_that_is_reached_from_above():
    """A first repetition at a higher field: the film comes back to the limit cycle of the others."""
    first = [hold(1.3, 1.0)]
    steady = [hold(0.9, 1.0), hold(0.5, 1.0)]
    status, result = sweep([*first, *steady], m=4.0, repeats=ENDLESS, once=1, rtol=1e-9)
    _, other = sweep(steady, m=4.0, repeats=ENDLESS, rtol=1e-9)
    assert status[0] == SURVIVES
    for row in (STEADY_STRETCH_MAX, STEADY_STRETCH_MIN):
        assert result[row, 0] == pytest.approx(other[row, 0], rel=1e-8)
    assert result[LARGEST_STRETCH, 0] > other[LARGEST_STRETCH, 0]


# --- slow failure under a held load


@pytest.mark.parametrize("rtol", [1e-6, 1e-10, 1e-12])
def test_slow_failure_under_the_load_held_at_the_end(rtol):
    """T -> pi (m - 1)/(3 sqrt(field - 1)) from a fresh film, and the quadrature of the step."""
    field = 1.0 + 10.0 ** -np.arange(8.0, 13.0)
    for m in (1.5, 4.0, 1000.0):
        status, result = sweep([hold(FIELD, 0.0)], m=m, field=field, rtol=rtol)
        assert np.all(status == FAILED)
        limit = math.pi * (m - 1.0) / (3.0 * np.sqrt(field - 1.0))
        assert result[TIME_TO_FAILURE, -1] == pytest.approx(limit[-1], rel=1e-5)
        own = dm.sweep(dm.Step(), modulus_ratio=m, field=field, rtol=1e-12)
        assert result[TIME_TO_FAILURE] == pytest.approx(own.time_to_failure.values, rel=1.01 * rtol + 1e-12)


def time_under_a_load_held(r, m, sigma, field):
    """Integral of dr/F from r to the instability, regular in the root of the distance to it."""
    p, e = m - 1.0, 0.75 * 4.0 ** (-1.0 / 3.0) * field**2

    def load(w, r):
        return w**2 * (1.0 + p / r - (1.0 + p * r * r) * w**6 - sigma * w)

    def peak(r):
        return brentq(
            lambda w: 8.0 * (1 + p * r * r) * w**6 + 3.0 * sigma * w - 2.0 * (1 + p / r), 1e-3, 2.0, xtol=1e-15
        )

    def flow(r):
        z = r * brentq(lambda w: load(w, r) - e, peak(r), 2.0, xtol=1e-15) ** 2
        return 2.0 * (1.0 / z - z * z)

    end = brentq(lambda r: load(peak(r), r) - e, r, 20.0, xtol=1e-15)
    return quad(lambda y: 2.0 * y / flow(end - y * y), 1e-5, math.sqrt(end - r), epsrel=1e-10)[0], end


@pytest.mark.parametrize(
    ("xi", "sigma", "field"), [(1.2, 0.0, 1.1), (1.05, 0.0, 1.6), (1.4, 1.3683, 0.5), (1.6, 1.3683, 0.6)]
)
def test_failure_under_a_load_held_from_any_state(xi, sigma, field):
    """As a last piece, and as one in which the film fails, or just not."""
    time, end = time_under_a_load_held(xi * xi, 4.0, sigma, field)
    given = {"m": 4.0, "xi": xi, "sigma": sigma, "field": field, "rtol": 1e-10}
    for pieces in ([hold(FIELD, 0.0)], [hold(FIELD, 1.001 * time), hold(0.0, 0.0)]):
        status, result = sweep(pieces, **given)
        assert status[0] == FAILED
        assert result[TIME_TO_FAILURE, 0] == pytest.approx(time, rel=1e-8)  # what the integral above leaves out
        assert result[CRITICAL_INTERNAL_STRETCH, 0] == pytest.approx(math.sqrt(end), rel=1e-12)
        assert result[CRITICAL_FIELD, 0] == pytest.approx(field, rel=1e-12)
    status, _ = sweep([hold(FIELD, 0.999 * time), hold(0.0, 0.0)], **given)
    assert status[0] == SURVIVES


def test_failure_soon_after_a_long_slow_rise():
    """The time that the film holds is a small part of the whole; against the kernel of ramps that are held."""
    field = xr.DataArray([1.0008165427517637, 1.0018471891215375, 1.0006488472073922, 1.0023635406909148], dims="film")
    up = xr.DataArray([4796.416243800624, 5556.855238650617, 13932.424770321097, 4404.863594798258], dims="film")
    ratio = xr.DataArray([1.2532062005191908, 1.8122490258723287, 1.44085547057772, 1.8965006472423636], dims="film")
    pieces = [dm.Linear("field", time="up"), dm.Hold(20.0), dm.Linear(0.3, rate=0.02)]
    expected = dm.sweep(dm.RampHold(), field=field, rate=field / up, modulus_ratio=ratio, rtol=1e-11)
    for rtol in (1e-4, 1e-6, 1e-8):
        ds = dm.sweep(dm.Sequence(pieces, repeat=True), field=field, up=up, modulus_ratio=ratio, rtol=rtol)
        assert np.all(ds.cycles_to_failure == 0)
        np.testing.assert_allclose(ds.time_to_failure, expected.time_to_failure, rtol=rtol)
        np.testing.assert_allclose(ds.critical_stretch, expected.critical_stretch, rtol=rtol)


def test_limit_cycle_is_where_cycling_leads():
    """The stretches of the limit cycle, against fifty repetitions of a film that forgets in three."""
    given = {"m": 3.0, "field": [0.5, 0.9, 1.05], "on": 2.0, "off": 3.0}
    status, result = sweep(PULSE_TRAIN, repeats=ENDLESS, rtol=1e-9, **given)
    assert np.all(status == SURVIVES)
    _, many = sweep(PULSE_TRAIN, repeats=50, rtol=1e-9, **given)
    assert result[STEADY_STRETCH_MAX] == pytest.approx(many[LARGEST_STRETCH], rel=1e-8)
    assert result[LARGEST_STRETCH] == pytest.approx(many[LARGEST_STRETCH], rel=1e-8)
    assert np.all(result[STEADY_STRETCH_MIN] < result[STEADY_STRETCH_MAX])


# --- orderings, for any program


@pytest.mark.parametrize("seed", range(4))
def test_larger_fields_and_larger_internal_stretches_fail_no_later(seed):
    random = np.random.default_rng(seed)
    values = random.uniform(-1.0, 1.0, 7)
    times = 10.0 ** random.uniform(-1.5, 0.8, 6)
    ends = [(float(value), "field") for value in values]
    pieces = [(LINEAR, 0.0, ends[0], 0.0)]
    pieces += [(LINEAR, a, b, float(t)) for a, b, t in zip(ends[:-1], ends[1:], times, strict=True)]
    field = np.linspace(0.8, 3.0, 45)
    for repeats in (1, ENDLESS):
        _, result = sweep(pieces, m=5.0, field=field, repeats=repeats, rtol=1e-8)
        life = np.nan_to_num(result[TIME_TO_FAILURE], nan=math.inf)
        assert np.all(life[1:] <= life[:-1] * (1 + 2e-8)) and np.isfinite(life).any()
        start = np.linspace(1.0, 1.4, 21)
        _, result = sweep(pieces, m=5.0, field=1.3, xi=start, repeats=repeats, rtol=1e-8)
        life = np.nan_to_num(result[TIME_TO_FAILURE], nan=math.inf)
        assert np.all(life[1:] <= life[:-1] * (1 + 2e-8))


# --- what must not matter


def test_cutting_pieces_and_turning_signs_change_nothing():
    field = np.array([0.7, 1.1, 1.5, 1.9])
    whole = [(LINEAR, 0.0, FIELD, 0.5), hold(FIELD, 0.75), (LINEAR, FIELD, 0.0, 1.5)]
    half = (0.5, "field")
    cut = [(LINEAR, 0.0, half, 0.25), (LINEAR, half, FIELD, 0.25), hold(FIELD, 0.25), hold(FIELD, 0.0)]
    cut += [hold(FIELD, 0.5), (LINEAR, FIELD, half, 0.75), (LINEAR, half, 0.0, 0.75), hold(0.0, 0.0)]
    status, result = sweep(whole, m=4.0, field=field, rtol=1e-10)
    assert set(status) == {SURVIVES, FAILED}
    for pieces, sign in ((cut, 1.0), (whole, -1.0), (cut, -1.0)):
        other_status, other = sweep(pieces, m=4.0, field=sign * field, rtol=1e-10)
        assert np.array_equal(other_status, status)
        np.testing.assert_allclose(other, result, rtol=2e-10)


def test_a_cell_depends_on_itself_alone():
    random = np.random.default_rng(8)
    given = {"m": random.uniform(1.5, 9.0, 40), "field": random.uniform(0.8, 2.0, 40), "on": 0.5, "off": 0.7}
    status, result = sweep(PULSE_TRAIN, repeats=ENDLESS, **given)
    for cell in (0, 13, 39):
        own = {name: (x if np.ndim(x) == 0 else x[cell]) for name, x in given.items()}
        own_status, own_result = sweep(PULSE_TRAIN, repeats=ENDLESS, **own)
        assert own_status[0] == status[cell]
        np.testing.assert_array_equal(own_result[:, 0], result[:, cell])


def test_a_finish_that_waits_for_others_stays_as_it_is():
    """The estimated errors, too, which decide whether a cell begins anew."""
    kind, scale, source, columns = tables([(LINEAR, 0.0, 9.0, (1.0, "up"))], {"up": np.array([90.0, 9.0, 0.09])}, 3)
    film = np.array([3.0, 5.0, 1.0]), np.zeros(3), np.arange(3)
    kept, status = np.zeros((rows.KEPT, 3)), np.full(3, rows.READY, np.int8)
    kept[rows.UNTIL] = kept[rows.BASE] = 1.0
    kept[rows.T], kept[rows.HELD] = rows.BEGINS, -1.0
    kept[rows.TIGHTNESS] = 3e10
    kept[[rows.RESOLUTION, rows.LEAST, rows.MOST]] = math.inf
    with np.errstate(all="ignore"):
        make_march(FREE, LINEAR_ONLY, 3)(kind, scale, source, columns, *film, status, kept, 2.0)
        assert np.all(status == rows.NEAR)
        alone, alone_status = kept.copy(), status.copy()
        make_finish(FREE, LINEAR_ONLY, 3)(kind, scale, source, columns, *film, status, kept)
        make_finish(FREE, LINEAR_ONLY, 1)(kind, scale, source, columns, *film, alone_status, alone)
    assert np.all(status == rows.FELL)
    assert kept.tobytes() == alone.tobytes()


def test_elastic_films_fail_exactly_when_the_field_reaches_the_critical_one():
    pieces = [(LINEAR, 0.0, FIELD, 2.0), (LINEAR, FIELD, 0.0, 2.0)]
    status, result = sweep(pieces, m=1.0, field=[0.999, 1.001, 1.5], repeats=ENDLESS, rtol=1e-10)
    assert list(status) == [SURVIVES, FAILED, FAILED]
    assert result[TIME_TO_FAILURE, 1:] == pytest.approx(2.0 / np.array([1.001, 1.5]), rel=1e-10)
    assert result[CRITICAL_STRETCH, 1:] == pytest.approx(2 ** (1 / 3), rel=1e-10)


@pytest.mark.parametrize("rtol", [1e-3, 1e-10])
@pytest.mark.parametrize("repeats", [1, ENDLESS])
def test_elastic_films_whose_ramp_ends_at_the_critical_field(repeats, rtol):
    """They fail at its end, whatever rounding makes of its slope."""
    up = np.array([0.01, 1.0 / 3.0, 0.7, 1.0, 10.0 / 7.0, 3.0, 7.0, 100.3])
    pieces = [(LINEAR, 0.0, 1.0, (1.0, "up")), hold(1.0, 1.0), (LINEAR, 1.0, 0.0, (1.0, "up"))]
    status, result = sweep(pieces, m=1.0, repeats=repeats, up=up, rtol=rtol)
    assert np.all(status == FAILED)
    assert np.array_equal(result[TIME_TO_FAILURE], up)
    assert result[CRITICAL_FIELD] == pytest.approx(1.0, rel=1e-15)


def test_waveform_of_many_samples():
    """A sine sampled a hundred thousand times: near the sine."""
    count = 100_000
    times = np.linspace(0.0, 20.0, count + 1)
    values = 1.3 * np.sin(2 * np.pi * times / 10.0)
    pieces = [(LINEAR, (a, "field"), (b, "field"), 20.0 / count) for a, b in itertools.pairwise(values)]
    status, result = sweep(pieces, m=4.0, field=1.0, rtol=1e-6)
    _, sine = sweep([(SINE, 0.0, 1.3, 20.0, 10.0)], m=4.0, field=1.0, rtol=1e-6)
    assert status[0] == FAILED
    assert result[TIME_TO_FAILURE, 0] == pytest.approx(sine[TIME_TO_FAILURE, 0], rel=1e-5)


# --- trajectories


def trajectory(pieces, times, *, m, repeats=1, xi=1.0, sigma=0.0, rtol=1e-8, once=0):
    table = tables(pieces, {}, 1)
    stretch, internal = np.empty((2, 1, len(times)))
    kernel = build.trajectory(any(piece[0] == SINE for piece in pieces), sigma > 0)
    films = (np.array([x], float) for x in (m, xi, sigma))
    kernel(*table, repeats, once, *films, rtol, np.array([times], float), np.array([len(times)]), stretch, internal)
    return stretch[0], internal[0]


def test_trajectory_of_a_ramp_and_hold():
    """Against the flow in time, (26), with the equilibrium (23) solved anew at every call, until failure."""
    times = np.linspace(0.0, 12.0, 61)
    stretch, internal = trajectory([(LINEAR, 0.0, 1.1, 1.1 / 0.3), hold(1.1, 0.0)], times, m=4.0)

    def flow(t, xi):
        A, B, e = 1 + 3 / xi[0] ** 2, 1 + 3 * xi[0] ** 4, 0.75 * 4 ** (-1 / 3) * min(0.3 * t, 1.1) ** 2
        u = max(root.real for root in np.roots([-B, 0, 0, A, -e]) if abs(root.imag) < 1e-9)
        return [1 / (u * xi[0] ** 3) - u**2 * xi[0] ** 3]

    alive = np.isfinite(stretch)
    _, result = sweep([(LINEAR, 0.0, 1.1, 1.1 / 0.3), hold(1.1, 0.0)], m=4.0, field=0.0, rtol=1e-8)
    assert np.array_equal(alive, times < result[TIME_TO_FAILURE, 0]) and not alive.all()
    given = {"rtol": 1e-11, "atol": 1e-13, "max_step": 0.1}
    expected = solve_ivp(flow, (0, times[alive][-1]), [1.0], "DOP853", times[alive], **given)
    np.testing.assert_allclose(internal[alive], expected.y[0], rtol=3e-8)


def test_trajectory_obeys_equilibrium_and_repeats():
    times = np.sort(np.concatenate([np.linspace(0.0, 60.0, 500), 60.0 + np.linspace(0.0, 1.0, 30)]))
    pieces = [(SINE, 0.4, 0.35, 1.0, 1.0)]
    pre = 1.2
    load = pre - pre**-5
    stretch, internal = trajectory(pieces, times, m=4.0, repeats=ENDLESS, xi=pre, sigma=load)
    field = 0.4 + 0.35 * np.sin(2 * np.pi * times)
    A, B, w = 1 + 3 / internal**2, 1 + 3 * internal**4, 1 / stretch
    e = 0.75 * 4 ** (-1 / 3) * field**2
    np.testing.assert_allclose(A * w**2 - B * w**8 - load * w**3, e, atol=1e-12)
    again, _ = trajectory(pieces, times[-30:] - 1.0, m=4.0, repeats=ENDLESS, xi=pre, sigma=load)
    np.testing.assert_allclose(stretch[-30:], again, rtol=2e-8)


def test_trajectory_follows_jumps_and_rests():
    times = np.array([0.0, 0.5, 1.0, 1.5, 500.0, 1e4])
    stretch, internal = trajectory([hold(0.9, 1.0), hold(0.5, 0.0)], times, m=4.0)
    A, B, w = 1 + 3 / internal**2, 1 + 3 * internal**4, 1 / stretch
    field = np.where(times < 1.0, 0.9, 0.5)  # at the jump, what holds after it
    np.testing.assert_allclose(A * w**2 - B * w**8, 0.75 * 4 ** (-1 / 3) * field**2, rtol=1e-12)
    _, result = sweep([hold(0.5, 1.0)], m=4.0, field=0.0)
    assert stretch[4:] == pytest.approx(result[FINAL_STRETCH, 0], rel=1e-9)
