"""How close the kernels come to what one core does with their right-hand sides alone.

The limit is measured: evaluations per second of the slope of a ramp, and of the integrand of a constant field, in a
loop over a block of as many lanes as the kernel has that does nothing else. What a trajectory takes is counted, by the
kernels run as plain Python.
"""

import time
from collections.abc import Callable
from typing import Any

import grids
import numba
import numpy as np
from common.internals import (
    CLIMB_LANES,
    LANES,
    RESULTS,
    TABLEAUS,
    choose,
    gauss_legendre,
    integrate_nodes,
    integrate_pole_part,
    lane_state,
    make_explicit,
    quadrature,
    rhs,
    smooth_part,
    solvers,
    sweep_for,
)
from common.programs import PROGRAMS
from numpy.typing import NDArray

REPEATS = 5
STAGES = TABLEAUS["dop853"].stages
# Slopes in one attempt: at every stage but the first, at the new state, and one beside it for the growth of errors.
SLOPES = STAGES + 1
OPTIONS = {"error_model": "numpy", "fastmath": {"nsz"}}


@numba.njit(**OPTIONS)
def _slopes(blocks: int) -> float:
    w = np.empty((4 + STAGES, CLIMB_LANES))
    for i in range(CLIMB_LANES):
        w[0, i] = 0.3 + 0.01 * i  # v
        w[1, i] = 0.1 + 0.01 * i  # y
        w[2, i] = 1.0 + 0.3 * i  # p
        w[3, i] = 0.1 * (1.0 + i)  # speed
    for _ in range(blocks):
        for stage in range(STAGES):
            for i in range(CLIMB_LANES):
                w[4 + stage, i] = rhs(w[0, i] + 1e-3 * stage, w[1, i], w[2, i], w[3, i])
        for i in range(CLIMB_LANES):
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
                total[i] += smooth_part(w, i, node)[0]
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
    return blocks * STAGES * CLIMB_LANES / _best(lambda: _slopes(blocks))


def trajectories_per_second(program: str, cells: int, rtol: float) -> float:
    """Return what the kernel that "auto" picks does on one core."""
    columns = grids.flat(program, cells)
    size = columns[0].size
    status, result = np.empty(size, np.int8), np.empty((RESULTS, size))
    picked = choose(PROGRAMS[program], "auto", "auto", rtol, None)
    kernel = sweep_for(program, picked.formulation, picked.method)
    return size / _best(lambda: kernel(*columns, rtol, 0.0, 1_000_000, status, result))


def evaluations_per_trajectory(program: str, cells: int, rtol: float) -> float:
    """Count, on average over some cells, evaluations of the right-hand side or of the integrand."""
    columns = grids.flat(program, cells)
    size = columns[0].size
    status, result = np.full(size, lane_state.RUNNING), np.empty((RESULTS, size))
    count = 0
    method = make_explicit(TABLEAUS["dop853"])

    def attempt(w: NDArray[np.float64]) -> None:
        nonlocal count
        count += SLOPES
        method.attempt(w)

    with np.errstate(all="ignore"):
        if program == "step":
            return float(np.mean([nodes_of(field, ratio, rtol) for field, _, ratio in zip(*columns, strict=True)]))
        solvers.make_solve_ramp(method._replace(attempt=attempt), 1)(*columns, rtol, 0.0, 1, status, result)
    return count / size


def nodes_of(field: float, modulus_ratio: float, rtol: float) -> int:
    """Count the nodes that a film under a constant field takes: those of every rule up to the one that is accurate."""
    w, p = np.zeros((quadrature.ROWS, 1)), modulus_ratio - 1.0
    quadrature.prepare(w, 0, field, p, quadrature.start_of_step(field, p))
    integrate_pole_part(w)
    count = 0
    for rule in range(quadrature.first_rule(p, rtol), gauss_legendre.RULES):
        first, end = gauss_legendre.OFFSETS[rule : rule + 2]
        integrate_nodes(w, first, end)
        count += end - first
        if w[quadrature.ERROR, 0] <= rtol:
            break
    return count
