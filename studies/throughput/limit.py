"""How close the kernels come to what one core does with their right-hand sides alone.

The limit is measured: evaluations per second of the slope of a ramp, and of the integrand of a constant field, in a
loop over a block of 16 lanes that does nothing else. What a trajectory takes is counted, by the kernels run as plain
Python.
"""

import time
from collections.abc import Callable
from typing import Any

import grids
import numba
import numpy as np
from numpy.typing import NDArray

from dea_maps.kernels import solvers
from dea_maps.kernels.build import sweep_for
from dea_maps.kernels.forms.area_strain import rhs
from dea_maps.kernels.hold import quadrature
from dea_maps.kernels.lane_state import RUNNING
from dea_maps.kernels.rising.explicit import make_explicit
from dea_maps.kernels.runge_kutta.tableaus import TABLEAUS
from dea_maps.kernels.sweep import LANES, RESULTS, in_blocks
from dea_maps.sweeps.methods import choose

REPEATS = 5
STAGES = TABLEAUS["dop853"].stages
# Slopes in one attempt: at every stage but the first, at the new state, and one beside it for the growth of errors.
SLOPES = STAGES + 1
OPTIONS = {"error_model": "numpy", "fastmath": {"nsz"}}


@numba.njit(**OPTIONS)
def _slopes(blocks: int) -> float:
    w = np.empty((4 + STAGES, LANES))
    for i in range(LANES):
        w[0, i] = 0.3 + 0.01 * i  # v
        w[1, i] = 0.1 + 0.01 * i  # y
        w[2, i] = 1.0 + 0.3 * i  # p
        w[3, i] = 0.1 * (1.0 + i)  # speed
    for _ in range(blocks):
        for stage in range(STAGES):
            for i in range(LANES):
                w[4 + stage, i] = rhs(w[0, i] + 1e-3 * stage, w[1, i], w[2, i], w[3, i])
        for i in range(LANES):
            w[1, i] += 1e-12 * w[4, i]
    return w.sum()


@numba.njit(**OPTIONS)
def _nodes(blocks: int, nodes: NDArray[np.float64]) -> float:
    w = np.zeros((quadrature.ROWS, LANES))
    total = np.zeros(LANES)
    for i in range(LANES):
        field = 1.05 + 0.03 * i
        quadrature.prepare(w, i, field, 3.0, quadrature.start_of_step(field, 3.0))
    for _ in range(blocks):
        for node in nodes:
            for i in range(LANES):
                total[i] += quadrature._smooth_part(w, i, node)[0]
        for i in range(LANES):
            w[quadrature.HALF, i] *= 1.0 + 1e-15
    return total.sum()


def _best(run: Callable[[], Any]) -> float:
    run()
    shortest = np.inf
    for _ in range(REPEATS):
        before = time.process_time()
        run()
        shortest = min(shortest, time.process_time() - before)
    return shortest


def evaluations_per_second(program: str, blocks: int) -> float:
    """Return what one core does with the right-hand side of a ramp, or the integrand of a constant field, alone."""
    if program == "step":
        nodes = np.polynomial.legendre.leggauss(STAGES)[0]
        return blocks * nodes.size * LANES / _best(lambda: _nodes(blocks, nodes))
    return blocks * STAGES * LANES / _best(lambda: _slopes(blocks))


def trajectories_per_second(program: str, cells: int, rtol: float) -> float:
    """Return what the kernel that "auto" picks does on one core."""
    columns = grids.flat(program, cells)
    size = columns[0].size
    status, result = np.empty(size, np.int8), np.empty((RESULTS, size))
    picked = choose(grids.PROGRAMS[program], "auto", "auto", rtol, None)
    kernel = sweep_for(program, picked.formulation, picked.method)
    return size / _best(lambda: kernel(*columns, rtol, 0.0, 1_000_000, status, result))


def evaluations_per_trajectory(program: str, cells: int, rtol: float) -> float:
    """Count, on average over some cells, evaluations of the right-hand side or of the integrand."""
    columns = grids.flat(program, cells)
    size = columns[0].size
    status, result = np.full(size, RUNNING), np.empty((RESULTS, size))
    count = 0
    method = make_explicit(TABLEAUS["dop853"])
    add_nodes = quadrature._integrate_nodes

    def attempt(w: NDArray[np.float64]) -> None:
        nonlocal count
        count += SLOPES
        method.attempt(w)

    def integrate_nodes(w: NDArray[np.float64], first: int, end: int) -> None:
        nonlocal count
        count += end - first
        add_nodes(w, first, end)

    with np.errstate(all="ignore"):
        if program == "step":
            quadrature._integrate_nodes = integrate_nodes
            try:
                in_blocks(solvers.solve_step, quadrature.ROWS, 1)(*columns, rtol, 0.0, 1, status, result)
            finally:
                quadrature._integrate_nodes = add_nodes
        else:
            solvers.make_solve_ramp(method._replace(attempt=attempt), 1)(*columns, rtol, 0.0, 1, status, result)
    return count / size
