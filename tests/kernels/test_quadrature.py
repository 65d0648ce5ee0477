"""The constant field as an integral: poles, residues, times, error estimates; and lanes that know nothing of others."""

import math
from functools import cache
from types import SimpleNamespace

import mpmath
import numba
import numpy as np
import pytest

from dea_maps.kernels import build, sweep
from dea_maps.kernels.hold import near_instant, quadrature
from dea_maps.kernels.hold.gauss_legendre import NODE_COUNTS

mp = mpmath.MPContext()
mp.dps = 40
U_STAR = mp.mpf(4) ** (-mp.mpf(1) / 3)
E_C = 3 * U_STAR / 4
ROUNDING = 4e-14
KERNELS = {"step": ("stretch", "quadrature"), "ramp": ("area", "dop853"), "ramp_hold": ("area", "dop853")}
FILMS = (1 + 1e-8, 1.01, 1.5, 4.0, 10.0, 100.0, 1000.0)


def fields_of(m):
    """Fields under which a film fails later, beside either limit and between."""
    top = math.sqrt(m)
    fields = [math.nextafter(1, 2), 1 + 1e-12, 1 + 1e-6, 1 + 1e-3, 0.5 * (1 + top)]
    fields += [top * (1 - gap) for gap in (1e-3, 1e-6, 1e-12)] + [math.nextafter(top, 0)]
    fields += [math.sqrt(m - (m - 1) * near_instant.LARGEST_GAP * share) for share in (1.01, 0.99, 1e-3)]
    return sorted({field for field in fields if field > 1 and mp.mpf(field) ** 2 < m})


ALL_POINTS = [(m, field) for m in FILMS for field in fields_of(m)]
POINTS = [(m, field) for m, field in ALL_POINTS if m - mp.mpf(field) ** 2 >= near_instant.LARGEST_GAP * (mp.mpf(m) - 1)]
NEXT_TO_A_LIMIT = sorted(set(ALL_POINTS) - set(POINTS))
NEXT_TO_A_LIMIT += [(1 + p, 1 + ulps * 2.0**-52) for p in (3e-6, 3e-5, 1e-3) for ulps in (1, 5, 20, 400)]


def zero_between(function, low, high):
    """The zero of a monotonic function in an interval, to working precision."""
    rising = function(high) > 0
    for _ in range(140):
        middle = (low + high) / 2
        low, high = (low, middle) if (function(middle) > 0) == rising else (middle, high)
    return (low + high) / 2


def branch_before(e, r, p):
    """u in equilibrium, A u - B u**4 = e, at xi**2 = r, on the branch before the instability."""
    A, B = 1 + p / r, 1 + p * r * r
    return zero_between(lambda u: A * u - B * u**4 - e, mp.cbrt(A / (4 * B)), mp.cbrt(A / B))


@cache
def exact(m, field):
    """Time to failure under a field from T = 0 on, without any device: dT = D du/(2 p u (1/r**2 + 2 r u**3) h)."""
    m, field = mp.mpf(m), mp.mpf(field)
    p, e = m - 1, E_C * field**2
    start = branch_before(e, mp.mpf(1), p)
    # the load is the largest that the film can carry: e = (3/4) A u at 4 B u**3 = A, both sides to the third power
    r_end = zero_between(lambda r: (1 + p / r) ** 4 - field**6 * (1 + p * r * r), mp.mpf(1), mp.mpf(10000))
    end = mp.cbrt((1 + p / r_end) / (4 * (1 + p * r_end**2)))
    excess = E_C * (field - 1) * (field + 1)
    width = mp.sqrt(excess / (6 * U_STAR**2))

    def integrand(theta):
        above = width * mp.sinh(theta)  # 1/h has poles beside u*
        u = U_STAR + above
        # e - u + u**4, the largest u - u**4 and what it exceeds another one by taken apart
        h = (excess + above**2 * (u * u + 2 * u * U_STAR + 3 * U_STAR**2)) / (p * u * u)
        z = mp.mpf(1)
        for _ in range(8):
            z -= (z**3 + h * z - 1) / (3 * z * z + h)
        r = z / u
        D = 4 * (1 + p * r * r) * u**3 - (1 + p / r)
        return D / (2 * p * u * (1 / r**2 + 2 * r * u**3) * h) * width * mp.cosh(theta)

    first, last = (mp.asinh((u - U_STAR) / width) for u in (end, start))
    with mp.workdps(22):
        pieces = mp.linspace(first, last, 2 + int((last - first) / 1.5))
        time = mp.quad(integrand, pieces, method="gauss-legendre", maxdegree=7)
    return SimpleNamespace(time=time, start=start, end=end, r_end=r_end)


@pytest.fixture(scope="module")
def prepared():
    """The block of lanes with all points, prepared."""
    w = np.zeros((quadrature.ROWS, len(POINTS)))
    for i, (m, field) in enumerate(POINTS):
        quadrature.prepare(w, i, field, m - 1.0, quadrature.start_of_step(field, m - 1.0))
    return w


def lanes_of(w):
    return [(w[:, i], mp.mpf(m), mp.mpf(field)) for i, (m, field) in enumerate(POINTS)]


def by_rule(w, rule):
    """Times and estimated errors of all lanes by one rule."""
    rules = np.full(w.shape[1], rule)
    quadrature.integrate(w, rules, math.inf)
    assert np.all(rules == quadrature.DONE)
    return w[quadrature.FOUND].copy(), w[quadrature.ERROR].copy()


def poles(w):
    """q and c of the pair q +- i c of the roots of n."""
    return 1 + mp.mpf(w[quadrature.REAL]), mp.sqrt(mp.mpf(w[quadrature.SQUARE]))


def far_from_the_poles(w, point):
    """Whether the interval is so short, seen from the poles, that they stay in the integrand."""
    interval = (exact(*point).start - exact(*point).end) / U_STAR
    return interval < 1e-2 * mp.sqrt(mp.mpf(w[quadrature.SQUARE]))


def root_beside(guess, field):
    """Root of n = U**4 - 4 U + 3 field**2 that Newton's method finds from a guess, its imaginary part above 0."""
    U = mp.mpc(guess.real, abs(guess.imag))
    for _ in range(30):
        U -= (U**4 - 4 * U + 3 * field**2) / (4 * U**3 - 4)
    return U


def test_poles_are_roots(prepared):
    for w, _, field in lanes_of(prepared):
        distance = math.sqrt(0.5 * float((field - 1) * (field + 1)))
        rough = np.roots([1.0, 0.0, 0.0, -4.0, 3.0 * float(field) ** 2])
        guess = rough[np.argmax(rough.real)] if distance > 1e-3 else complex(1.0, distance)
        near, far = root_beside(guess, field), root_beside(rough[np.argmin(rough.real)], field)
        assert abs(w[quadrature.REAL] / (near.real - 1) - 1) <= 2e-15
        assert abs(w[quadrature.SQUARE] / near.imag**2 - 1) <= 4e-15
        assert abs(w[quadrature.PARTNER] / far.imag**2 - 1) <= 2e-15
        assert abs(near.real + far.real) <= mp.mpf(10) ** -35


def test_line_goes_through_the_rest_of_the_integrand_at_the_poles(prepared):
    for (w, m, _), point in zip(lanes_of(prepared), POINTS, strict=True):
        if far_from_the_poles(w, point):
            continue
        q, c = poles(w)
        C = mp.mpc(q, c)
        # there h = 0 and z = 1; n = Q R, and R = n'/Q' where Q vanishes
        R = (4 * C**3 - 4) / mp.mpc(0, 2 * c)
        expected = (C**3 - 1 + 3 * (m - 1) * U_STAR * C) / (3 * C * R)
        found = w[quadrature.LINE] + w[quadrature.LINE_SLOPE] * mp.mpc(0, c)
        assert abs(found / expected - 1) <= 8e-15


def test_what_the_poles_contribute(prepared):
    by_rule(prepared, 0)
    for w, point in zip(prepared.T, POINTS, strict=True):
        if far_from_the_poles(w, point):
            assert w[quadrature.POLE_PART] == 0.0
            continue
        q, c = poles(w)
        ends = [exact(*point).end / U_STAR, exact(*point).start / U_STAR]

        def antiderivative(U, w=w, q=q, c=c):
            logarithm = mp.log((U - q) ** 2 + c * c) / 2
            return w[quadrature.LINE_SLOPE] * logarithm + w[quadrature.LINE] / c * mp.atan((U - q) / c)

        expected = antiderivative(ends[1]) - antiderivative(ends[0])
        assert abs(w[quadrature.POLE_PART] / expected - 1) <= ROUNDING


def test_ends_of_the_integral(prepared):
    for w, point in zip(prepared.T, POINTS, strict=True):
        reference = exact(*point)
        y0, y1 = (mp.sqrt(U_STAR / u) for u in (reference.start, reference.end))
        assert w[quadrature.INTERNAL] == pytest.approx(float(reference.r_end), rel=1e-15)
        assert w[quadrature.HALF] == pytest.approx(float((y1 - y0) / 2), rel=1e-14)
        centre = float((y1 + y0) / 2 - 1)
        assert w[quadrature.CENTRE] == pytest.approx(centre, rel=2e-15, abs=1e-14 * w[quadrature.HALF])


@pytest.mark.parametrize("rule", range(len(NODE_COUNTS)))
def test_time_and_its_estimated_error(prepared, rule):
    times, errors = by_rule(prepared, rule)
    for point, time, error in zip(POINTS, times, errors, strict=True):
        true = abs(time / exact(*point).time - 1)
        assert true <= error + ROUNDING, (point, float(true), error)
        if true > ROUNDING:
            assert error <= 1e5 * true, (point, float(true), error)


def test_the_last_rule_leaves_nothing_but_rounding(prepared):
    _, errors = by_rule(prepared, len(NODE_COUNTS) - 1)
    assert np.all(errors <= 4e-13)  # of rounding, which is taken into account
    _, errors = by_rule(prepared, 0)
    assert np.count_nonzero(errors > 1e-7) > len(POINTS) / 4


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9, 1e-12])
def test_lanes_end_on_the_first_rule_that_is_accurate_enough(prepared, rtol):
    table = [by_rule(prepared, rule) for rule in range(len(NODE_COUNTS))]
    rules = np.array([quadrature.first_rule(m - 1.0, rtol) for m, _ in POINTS])
    begun = rules.copy()
    quadrature.integrate(prepared, rules, rtol)
    assert np.all(rules == quadrature.DONE)
    for i, found in enumerate(prepared[quadrature.FOUND]):
        rule = next(rule for rule in range(begun[i], len(NODE_COUNTS)) if table[rule][1][i] <= rtol)
        assert found == table[rule][0][i]


def test_what_is_not_accurate_enough_is_not_found(prepared):
    rules = np.zeros(len(POINTS), int)
    quadrature.integrate(prepared, rules, -1.0)
    assert np.all(rules != quadrature.DONE)
    assert np.all(np.isnan(prepared[quadrature.FOUND]))


@pytest.mark.parametrize("point", NEXT_TO_A_LIMIT, ids=str)
def test_a_film_next_to_a_limit(point):
    m, field = point
    status, result = np.empty(1, np.int8), np.empty((sweep.RESULTS, 1))
    columns = (np.array([field]), np.zeros(1), np.array([m]))
    build.sweep_for("step", *KERNELS["step"])(*columns, 1e-12, 0.0, 1, status, result)
    reference = exact(m, field)
    assert abs(result[sweep.TIME_TO_FAILURE, 0] / reference.time - 1) <= ROUNDING
    assert abs(result[sweep.CRITICAL_STRETCH, 0] * mp.sqrt(reference.end) - 1) <= 1e-15
    assert abs(result[sweep.CRITICAL_INTERNAL_STRETCH, 0] / mp.sqrt(reference.r_end) - 1) <= 1e-15


def test_start_of_a_step():
    for m, field in ALL_POINTS:
        found = quadrature.start_of_step(field, m - 1.0)
        # relative to itself: U - 1 vanishes with m - field**2
        assert abs(found / (exact(m, field).start / U_STAR - 1) - 1) <= 4e-15, (m, field)


@pytest.mark.parametrize("share", [0.0, 1e-6, 0.1, 0.5, 0.9, 1 - 1e-6, 1 - 1e-12])
def test_start_of_a_hold(share):
    for m, field in POINTS:
        r = float(exact(m, field).r_end ** share)
        p, e, tiny = mp.mpf(m) - 1, E_C * mp.mpf(field) ** 2, mp.mpf(10) ** -25
        if r >= exact(m, field).r_end:
            continue
        expected = branch_before(e, mp.mpf(r), p) / U_STAR
        condition = sum(
            abs(one / U_STAR - expected) / tiny
            for one in (branch_before(e, r * (1 - tiny), p), branch_before(e * (1 - tiny), mp.mpf(r), p))
        )
        found = quadrature.start_of_hold(field, m - 1.0, r)
        # far from the instability, e << e_c, less will do: the film leaves such a state at once
        share = e / (0.75 * mp.cbrt((1 + p / r) ** 4 / (4 * (1 + p * mp.mpf(r) ** 2))))
        allowed = 4e-15 * (1 + condition) + 1e-16 / share**2
        assert abs(1 + mp.mpf(found) - expected) <= allowed, (m, field, r)


def test_a_hold_that_starts_beyond_the_instability_starts_at_it():
    for m, field in POINTS:
        r = float(exact(m, field).r_end * (1 + mp.mpf(10) ** -12))
        p = mp.mpf(m) - 1
        expected = mp.cbrt((1 + p / r) / (4 * (1 + p * mp.mpf(r) ** 2))) / U_STAR - 1
        assert quadrature.start_of_hold(field, m - 1.0, r) == pytest.approx(float(expected), abs=1e-15)


def cells(count):
    """Cells of every outcome and far apart in cost, for any program."""
    rng = np.random.default_rng(26)
    m = 10.0 ** rng.uniform(0, 3, count)
    m[::7] = 1.0 + 10.0 ** rng.uniform(-12, -1, m[::7].size)
    field = 10.0 ** rng.uniform(-0.02, 1.05 * np.log10(np.sqrt(m)))
    field[1::5] = 1.0 + 10.0 ** rng.uniform(-15, -2, field[1::5].size)
    return field, 10.0 ** rng.uniform(-6, 5, count), m


CELLS = cells(11 if numba.config.DISABLE_JIT else 203)


def run(program, columns, rtol, lanes=None):
    """All rows of the result of a compiled sweep over cells, the status last."""
    kernel = build.sweep_for(program, *KERNELS[program], lanes=lanes)
    status = np.empty(columns[0].size, np.int8)
    result = np.empty((sweep.RESULTS, status.size))
    kernel(*columns, rtol, 0.0, 1_000_000, status, result)
    return np.vstack([result, status])


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # without the compiler, idle lanes warn
@pytest.mark.parametrize("rtol", [1e-4, 1e-11])
@pytest.mark.parametrize("program", KERNELS)
def test_cells_know_nothing_of_others(program, rtol):
    whole = run(program, CELLS, rtol)
    count = CELLS[0].size
    assert len(set(whole[-1])) > 1 or program == "ramp"
    order = np.random.default_rng(4).permutation(count)
    permuted = run(program, [column[order] for column in CELLS], rtol)
    assert np.array_equal(permuted, whole[:, order], equal_nan=True)
    part = order[: count // 2 + 1]
    assert np.array_equal(run(program, [column[part] for column in CELLS], rtol), whole[:, part], equal_nan=True)
    for cell in order[:5]:
        alone = run(program, [column[[cell]] for column in CELLS], rtol)
        assert np.array_equal(alone, whole[:, [cell]], equal_nan=True)
    for lanes in (1, 4):
        assert np.array_equal(run(program, CELLS, rtol, lanes), whole, equal_nan=True)
