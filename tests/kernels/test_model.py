"""The constitutive law against the printed equations of Zhao, Koh and Suo (2011) in 40 digits."""

import math
from fractions import Fraction

import numba
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

from dea_maps.kernels import model
from dea_maps.kernels._jit import FASTMATH

ULP = 2.0**-52

stretches = st.floats(1.0, 4.0)
internal_stretches = st.floats(1.0, 4.0)
excesses = st.one_of(st.just(0.0), st.floats(1e-9, 1e3))


@pytest.fixture(autouse=True)
def _digits():
    with mp.workdps(40):
        yield


def paper_load(stretch, xi, p):
    """Equation (23), normalised by the relaxed modulus."""
    return stretch**-2 - stretch**-8 + p * (stretch**-2 * xi**-2 - stretch**-8 * xi**4)


def paper_critical_stretch(xi, p):
    """Equation (25)."""
    return mp.cbrt(2) * ((1 + p * xi**4) / (1 + p * xi**-2)) ** (mpf(1) / 6)


def paper_flow(stretch, xi):
    """Equation (26), in relaxation times."""
    return stretch**2 * xi**-3 - stretch**-4 * xi**3


def polynomial(stretch, xi):
    """The variables of the kernels, exactly those that the rounded ones stand for."""
    u, r = float(mpf(stretch) ** -2), float(mpf(xi) ** 2)
    return u, r, 1 / mp.sqrt(u), mp.sqrt(r)


def close(found, exact, scale, ulps):
    """Whether a float is exact but for some units in the last place of the terms that it was summed from."""
    return abs(mpf(found) - exact) <= ulps * ULP * abs(scale)


@settings(deadline=None)
@given(stretches, internal_stretches, excesses)
def test_load_is_equation_23(stretch, internal, p):
    u, r, lam, xi = polynomial(stretch, internal)
    scale = lam**-2 * (1 + p / xi**2) + lam**-8 * (1 + p * xi**4)
    assert close(model.load(u, r, p), paper_load(lam, xi, mpf(p)), scale, 6)


@settings(deadline=None)
@given(stretches, internal_stretches)
def test_flow_is_equation_26(stretch, internal):
    u, r, lam, xi = polynomial(stretch, internal)
    # r = xi**2, so dr/dT = 2 xi dxi/dT, and flow is half of it
    assert close(model.flow(u, r), xi * paper_flow(lam, xi), 1 / (u * r) + (u * r) ** 2, 6)


@settings(deadline=None)
@given(stretches, internal_stretches, excesses)
def test_stiffness_is_the_derivative_of_the_load(stretch, internal, p):
    u, r, _, xi = polynomial(stretch, internal)
    slope = mp.diff(lambda v: paper_load(1 / mp.sqrt(v), xi, mpf(p)), mpf(u))
    scale = 4 * u**3 * (1 + p * r * r) + 1 + p / r
    assert close(model.stiffness(u, r, p), -slope, scale, 6)


@settings(deadline=None)
@given(internal_stretches, excesses)
def test_critical_state_is_equation_25(internal, p):
    _, r, _, xi = polynomial(1.0, internal)
    critical = paper_critical_stretch(xi, mpf(p))
    assert close(model.critical_u(r, p), critical**-2, critical**-2, 8)
    highest = paper_load(critical, xi, mpf(p))
    assert close(model.largest_load(r, p), highest, highest, 8)
    assert abs(mp.diff(lambda lam: paper_load(lam, xi, mpf(p)), critical)) < mpf("1e-12") * (1 + p)


@settings(deadline=None)
@given(internal_stretches, st.floats(1e-3, 1e3))
def test_largest_load_falls_as_the_film_relaxes(internal, p):
    r = internal**2
    assert model.largest_load(1.001 * r, p) < model.largest_load(r, p)
    assert model.lower_stiffness(r, p) >= model.upper_stiffness(r, p)


def test_constants():
    assert close(model.CRITICAL_U, mpf(4) ** (-mpf(1) / 3), 1, 0.5)
    assert pytest.approx(0.47247039371057746, rel=ULP) == model.CRITICAL_LOAD
    # a relaxed film (p = 0) and one that has not relaxed (r = 1) fail at the same stretch, under m times the load
    assert close(1 / math.sqrt(model.critical_u(1.0, 3.0)), mp.cbrt(2) ** mpf("1"), 1, 2)
    assert close(model.largest_load(1.0, 3.0), 4 * paper_load(mp.cbrt(2), mpf(1), 0), 2, 2)


# Plain Python, and as compiled into the kernels: with their options, in a loop that the compiler may vectorise.
def over_arrays(function):
    device = numba.njit(fastmath=FASTMATH, error_model="numpy")

    def one(x):
        out = np.empty_like(x)
        for i in range(x.size):
            out[i] = function(x[i])
        return out

    def two(x, y):
        out = np.empty_like(x)
        for i in range(x.size):
            out[i] = function(x[i], y[i])
        return out

    return device({1: one, 2: two}[function.__code__.co_argcount])


@pytest.fixture(scope="module")
def compiled_gap():
    return over_arrays(model.instant_gap)


@pytest.fixture(scope="module")
def compiled_relative_u():
    return over_arrays(model.relative_u)


def exact_relative_u(margin):
    """x - 1 of the physical root of x**4 - 4 x + 3 (1 - g) = 0, as y**2 (6 + 4 y + y**2) = 3 g."""
    target = mp.sqrt(3 * mpf(margin))
    y = min(target / mp.sqrt(6), mp.cbrt(4) - 1)
    return mp.findroot(lambda v: v * mp.sqrt(6 + 4 * v + v * v) - target, y, tol=mpf("1e-70"))


def check_relative_u(margins, found):
    assert found.shape == margins.shape
    for margin, y in zip(margins, found, strict=True):
        exact = exact_relative_u(margin)
        assert close(y, exact, exact, 2), f"margin {margin}: {y}, exactly {exact}"


MARGINS = np.concatenate([np.logspace(-300, -20, 15), np.logspace(-16, 0, 65), 1 - np.logspace(-15, -1, 8)])


def test_relative_u_is_accurate_to_its_last_digits(compiled_relative_u):
    assert model.relative_u(0.0) == 0.0
    assert model.relative_u(1.0) == pytest.approx(4 ** (1 / 3) - 1, rel=2 * ULP)
    check_relative_u(MARGINS, np.array([model.relative_u(margin) for margin in MARGINS]))
    check_relative_u(MARGINS, compiled_relative_u(MARGINS))


@settings(deadline=None)
@given(st.floats(1e-300, 1.0))
def test_relative_u_at_any_margin(margin):
    check_relative_u(np.array([margin]), np.array([model.relative_u(margin)]))


@settings(deadline=None)
@given(st.floats(1e-6, 1.0), internal_stretches, excesses)
def test_relative_u_solves_equation_23(margin, internal, p):
    r = internal**2
    u = mpf(model.critical_u(r, p)) * (1 + mpf(model.relative_u(margin)))
    reached = paper_load(1 / mp.sqrt(u), mp.sqrt(r), mpf(p))
    highest = paper_load(paper_critical_stretch(mp.sqrt(r), mpf(p)), mp.sqrt(r), mpf(p))
    assert abs(1 - reached / highest - margin) < 1e-14


def gap_error(field, ratio, found):
    """Error of the gap in units of its last place; infinite if the sign is wrong."""
    exact = Fraction(ratio) - Fraction(field) ** 2
    if exact == 0:
        return 0.0 if found == 0.0 else math.inf
    if (exact > 0) != (found > 0) or found == 0.0:
        return math.inf
    return float(abs(Fraction(found) - exact) / abs(exact)) / ULP


near_squares = st.tuples(st.floats(1.0, 1e6), st.integers(-40, 40)).map(
    lambda drawn: (drawn[0], max(1.0, drawn[0] ** 2 + drawn[1] * math.ulp(drawn[0] ** 2)))
)
anywhere = st.tuples(st.floats(0.0, 1e154), st.floats(1.0, 1e308))


@settings(max_examples=400, deadline=None)
@given(st.one_of(near_squares, anywhere))
@example((0.0, 1.0))
@example((1e-200, 1.0))
@example((1.0, 1.0))
@example((2.0, 4.0))
@example((math.sqrt(2.0), 2.0))
@example((math.nextafter(math.sqrt(2.0), 0.0), 2.0))
@example((1e150, 1e300))
@example((1e8 + 1.0, 1e16))
def test_instant_gap_is_exact(pair):
    field, ratio = pair
    assert gap_error(field, ratio, model.instant_gap(field, ratio)) <= 2


def test_compiled_instant_gap_is_exact(compiled_gap):
    rng = np.random.default_rng(7)
    field = rng.uniform(1.0, 40.0, 400)
    ratio = field * field + rng.integers(-20, 21, field.size) * np.spacing(field * field)
    ratio = np.maximum(ratio, 1.0)
    errors = [gap_error(*cell) for cell in zip(field, ratio, compiled_gap(field, ratio), strict=True)]
    assert max(errors) <= 2


@pytest.mark.parametrize("ratio", [1.0, 1e300, 1.7e308])
@pytest.mark.parametrize("field", [1.1e150, math.sqrt(1.7e308), math.nextafter(math.sqrt(1.7e308), 0), 1.7e308])
def test_instant_gap_where_the_square_overflows(field, ratio):
    exact, found = Fraction(ratio) - Fraction(field) ** 2, model.instant_gap(field, ratio)
    if abs(exact) < Fraction(1.7e308):
        assert gap_error(field, ratio, found) <= 2
    else:
        assert found == (math.inf if exact > 0 else -math.inf)


@settings(max_examples=200, deadline=None)
@given(st.floats(-1e140, 1e140).filter(lambda a: a == 0 or abs(a) > 1e-140))
def test_square_error_is_exact(a):
    assert Fraction(a) ** 2 - Fraction(a * a) == Fraction(model.square_error(a, a * a))
