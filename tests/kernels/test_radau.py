"""Radau IIA of order 5 on ramps: coefficients, stability, order, stiff steps, slow ramps."""

import importlib.util
import math
from pathlib import Path

import numba
import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

import dea_maps as dm
from dea_maps.kernels import solvers, sweep
from dea_maps.kernels.forms.area_strain import jacobian, rhs
from dea_maps.kernels.lane_state import FAILED, RUNNING
from dea_maps.kernels.rising import control, radau
from dea_maps.kernels.rising import state as lane

A = np.array(
    [
        [radau.A11, radau.A12, radau.A13],
        [radau.A21, radau.A22, radau.A23],
        [radau.A31, radau.A32, radau.A33],
    ]
)
NODES = np.array([radau.C1, radau.C2, 1.0])
WEIGHTS = A[2]
E_C = 0.75 * 4.0 ** (-1.0 / 3.0)


def stability(z):
    """R(z) = det(I - z A + z e b^T) / det(I - z A)."""
    above = np.eye(3) - z * A + z * np.outer(np.ones(3), WEIGHTS)
    return np.linalg.det(above) / np.linalg.det(np.eye(3) - z * A)


def test_row_sums():
    assert A.sum(axis=1) == pytest.approx(NODES, abs=1e-15)


@pytest.mark.parametrize("q", range(1, 6))
def test_quadrature_conditions(q):
    assert WEIGHTS @ NODES ** (q - 1) == pytest.approx(1 / q, abs=1e-15)


@pytest.mark.parametrize("q", range(1, 4))
def test_stage_conditions(q):
    assert A @ NODES ** (q - 1) == pytest.approx(NODES**q / q, abs=1e-15)


def test_nodes_are_those_of_radau():
    # the zeros of d**2/dx**2 (x**2 (x - 1)**3)
    assert np.polyval(np.polyder([1, -3, 3, -1, 0, 0], 2), NODES) == pytest.approx(0, abs=1e-13)


def test_stability():
    assert abs(stability(0.0) - 1) < 1e-15
    assert max(abs(stability(1j * y)) for y in np.logspace(-3, 6, 200)) <= 1 + 1e-12
    assert np.all(np.linalg.eigvals(A).real > 0)  # no poles in the left half plane: A-stable with the line above
    for z in (-1e3, -1e6, -1e9):
        assert abs(stability(z)) < 4 / abs(z)


def test_error_estimate_conditions():
    eigenvalues = np.linalg.eigvals(np.linalg.inv(A))
    assert eigenvalues[np.argmin(abs(eigenvalues.imag))].real == pytest.approx(radau.EIGENVALUE, rel=1e-14)
    weights = np.array([radau.E1, radau.E2, radau.E3])
    # for y' = t**(q-1) the increments of the stages are c**q/q: the estimate vanishes up to q = 3
    missed = [weights @ NODES**q / q + (q == 1) for q in range(1, 5)]
    assert missed[:3] == pytest.approx([0, 0, 0], abs=1e-15)
    assert abs(missed[3]) > 0.01


def block(m, k, v, y, length):
    """One lane at a state, about to take a step."""
    w = np.zeros((radau.RADAU5.rows, 1))
    w[lane.V], w[lane.Y], w[lane.P], w[lane.SPEED] = v, y, m - 1.0, 2 * k * math.sqrt(E_C)
    w[lane.TRIAL] = length
    set_slopes(w)
    return w


def set_slopes(w):
    state = [w[row, 0] for row in (lane.P, lane.SPEED)]
    w[lane.SLOPES] = rhs(w[lane.V, 0], w[lane.Y, 0], *state)
    w[lane.JACOBIAN] = jacobian(w[lane.V, 0], w[lane.Y, 0], w[lane.SLOPES, 0], *state)


def advance(m, k, v, y, until, steps):
    """Y at the end of steps of equal length."""
    w = block(m, k, v, y, (until - v) / steps)
    for _ in range(steps):
        radau.RADAU5.attempt(w)
        w[lane.V] += w[lane.TRIAL]
        w[lane.Y] = w[lane.NEW]
        set_slopes(w)
    return w[lane.Y, 0]


def share_slope(v, y, p, k):
    """dy/dv of a ramp from (23) and (26) in the stretch s and the internal stretch x."""
    s = math.sqrt(1 + v * v)
    x = s * math.sqrt(1 - y)
    load = (1 + p / x**2) / s**2 - (1 + p * x**4) / s**8
    by_s = -2 * (1 + p / x**2) / s**3 + 8 * (1 + p * x**4) / s**9
    by_x = -2 * p / x**3 / s**2 - 4 * p * x**3 / s**8
    x_rate = s**2 / x**3 - x**3 / s**4
    s_rate = 2 * k * math.sqrt(E_C * load) - by_x * x_rate  # times by_s
    return (2 * x**2 / s**3 - 2 * x / s**2 * x_rate * by_s / s_rate) * v / s


def test_order():
    m, k, first, last, y = 4.0, 1.0, 0.4, 0.8, 0.1
    ends = solve_ivp(
        lambda v, y: [share_slope(v, y[0], m - 1, k)], (first, last), [y], "DOP853", rtol=3e-14, atol=1e-16
    )
    lengths = np.array([1, 2, 4, 8]) ** -1.0
    errors = [abs(advance(m, k, first, y, last, steps) - ends.y[0, -1]) for steps in (1, 2, 4, 8)]
    assert np.polyfit(np.log(lengths), np.log(errors), 1)[0] == pytest.approx(5, abs=0.2)
    assert errors[-1] < 1e-8


def test_order_of_the_estimate():
    lengths = 0.2 * 0.5 ** np.arange(5)
    estimates = []
    for length in lengths:
        w = block(4.0, 1.0, 0.4, 0.1, length)
        radau.RADAU5.attempt(w)
        estimates.append(radau.RADAU5.error(w, 0, 1.0))
    assert np.polyfit(np.log(lengths), np.log(estimates), 1)[0] == pytest.approx(4, abs=0.2)


def slow_manifold(v, k):
    """y that keeps pace with the load, to leading order: e' = 2 k sqrt(e_C e) = 6 u**2 (4 u**3 - 1) y."""
    u = 1 / (1 + v * v)
    return 2 * k * math.sqrt(E_C * (u - u**4)) / (6 * u * u * (4 * u**3 - 1))


@pytest.mark.parametrize("m", [1.01, 4.0, 100.0])
def test_a_stiff_step_damps(m):
    k, v, length = 1e-6, 0.4, 0.01
    ratios = []
    for factor in (1.0, 10.0):
        y = slow_manifold(v, k)
        w = np.hstack([block(m, k, v, y, factor * length), block(m, k, v, 1.01 * y, factor * length)])
        radau.RADAU5.attempt(w)
        stiffness = factor * length * w[lane.JACOBIAN, 0]
        assert stiffness < -100
        ratios.append(abs(w[lane.NEW, 1] - w[lane.NEW, 0]) / (0.01 * y))
        assert ratios[-1] < 3 * abs(stability(stiffness))
        assert w[lane.NEW, 0] == pytest.approx(slow_manifold(v + factor * length, k), rel=1e-3)
    assert ratios[1] < 0.3 * ratios[0]


def test_a_long_step_over_growing_errors_is_refused():
    # beyond the largest load of the relaxed film, u < u*, errors grow, and L-stability would damp them
    for length, refused in ((0.1, False), (0.4, True)):
        w = block(4.0, 1e-6, 0.75, slow_manifold(0.75, 1e-6), length)
        radau.RADAU5.attempt(w)
        here = [w[row, 0] for row in (lane.P, lane.SPEED)]
        f = rhs(0.75 + length, w[lane.NEW, 0], *here)
        assert (length * jacobian(0.75 + length, w[lane.NEW, 0], f, *here) > 0.7) == refused
        assert (radau.RADAU5.error(w, 0, 1.0) == math.inf) == refused


def attempts(m, k, rtol):
    """Attempted steps up a ramp that failed in the end."""
    count = 0

    def counted(w):
        nonlocal count
        count += 1
        radau.RADAU5.attempt(w)

    method = radau.RADAU5._replace(attempt=counted)
    cell = np.zeros(1), np.array([k]), np.array([m])
    status, result = np.array([RUNNING]), np.empty((sweep.RESULTS, 1))
    with np.errstate(all="ignore"):  # steps that are too long may give NaN
        solvers.make_solve_ramp(method, lanes=1)(*cell, rtol, 0.0, 1000, status, result)
    assert status[0] == FAILED
    assert count < control.ATTEMPTS
    return count


@pytest.mark.parametrize("m", [1.0, 4.0, 1000.0])
def test_a_ramp_a_thousand_times_slower_costs_less_than_twice_as_much(m):
    slow, slower = attempts(m, 1e-3, 1e-6), attempts(m, 1e-6, 1e-6)
    assert slower < 2 * slow < 600


def reference(program):
    """Read a reference table; its module is no part of a package."""
    path = Path(__file__).parents[1] / "reference" / "table.py"
    spec = importlib.util.spec_from_file_location("reference_table", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.load(program)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # without the compiler, idle lanes warn
@pytest.mark.parametrize("rtol", [1e-3, 1e-5, 1e-7])
@pytest.mark.parametrize("program", [dm.Ramp(), dm.RampHold()], ids=lambda program: program.name)
def test_slow_ramps_against_the_reference(program, rtol):
    table = reference(program.name)
    slow = np.flatnonzero(table["rate"] <= 1e-2)
    assert slow.size > 20
    slow = slow[:: 9 if numba.config.DISABLE_JIT else 1]
    parameters = {
        name: xr.DataArray(table[name][slow], dims="sample")
        for name in ("modulus_ratio", "field", "rate")
        if name in table
    }
    ds = dm.sweep(program, **parameters, rtol=rtol, method="radau5")
    assert np.array_equal(ds.outcome, table["outcome"][slow])
    for name, condition in (("time_to_failure", "time"), ("critical_stretch", "stretch"), ("critical_field", "field")):
        expected = table[name][slow]
        allowed = rtol + 4e-15 * np.nan_to_num(table[f"condition_{condition}"][slow])
        error = np.abs(ds[name].values / expected - 1)
        assert np.array_equal(np.isnan(error), np.isnan(expected))
        assert np.all(~(error > allowed)), (name, np.nanmax(error / allowed))
