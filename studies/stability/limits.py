"""What theory says where explicit methods must fail: stability, the fold's law, the length of a life.

The Jacobian is that of the kernels' own right-hand sides, by complex steps, along the solution.
"""

import math
from typing import NamedTuple

import numpy as np
import xarray as xr
from common.internals import FORMULATIONS, Tableau, lane_state, model
from common.programs import PROGRAMS
from numpy.typing import NDArray
from scenes import Scene

import dea_maps as dm

COMPLEX_STEP = 1e-30
# The fold's law: a step of length h that ends at the instability may cost the stretch a share of c sqrt(h). It is drawn
# where that is 1 %, and for tolerances where h is the rounding of the time, shorter than which no step can be.
FOLD_SHARE = 0.01
EPSILON = float(np.finfo(float).eps)


class Path(NamedTuple):
    """A film's life: states at (times,) instants, and where it ends."""

    time: NDArray[np.float64]
    stretch: NDArray[np.float64]
    internal: NDArray[np.float64]
    end: tuple[float, float, float]  # time, stretch and internal stretch at failure
    excess: float
    field: float
    rate: float


def life(scene: Scene, program: str, value: float) -> Path:
    """Solution at one value along a scene's axis, at instants that crowd towards both ends."""
    cells = scene.cells(program, np.array([value]))
    shares = np.concatenate([np.geomspace(1e-9, 0.5, 60), 1.0 - np.geomspace(0.7, 1e-3, 80) ** 2])
    given = {"modulus_ratio": cells.modulus_ratio[0]}
    if program != "ramp":
        given["field"] = cells.field[0]
    if program != "step":
        given["rate"] = cells.rate[0]
    times = cells.truth[0, 0] * shares
    ds = dm.trajectory(PROGRAMS[program], time=times, rtol=1e-8, **given)
    alive = np.isfinite(ds.stretch.values)
    columns = (times[alive], ds.stretch.values[alive], ds.internal_stretch.values[alive])
    end = (cells.truth[0, 0], cells.truth[1, 0], float(ds.critical_internal_stretch))
    return Path(*columns, end, cells.modulus_ratio[0] - 1.0, cells.field[0], cells.rate[0])


def block(path: Path, formulation: str) -> NDArray[np.complex128]:
    """Lanes of a kernel, one an instant, with the states of a formulation and the load."""
    w = np.zeros((lane_state.SLOPES + lane_state.STATES, path.time.size), np.complex128)
    regular = formulation == "fold"
    w[lane_state.STATE] = path.time
    w[lane_state.STATE + 1] = path.stretch**-2 if regular else path.stretch
    w[lane_state.STATE + 2] = path.internal**2 if regular else path.internal
    w[lane_state.P] = path.excess
    w[lane_state.FIELD] = path.field
    w[lane_state.SLOPE] = path.rate
    return w


def jacobians(path: Path, formulation: str) -> NDArray[np.float64]:
    """Return (times, states, states) derivatives of the right-hand side by the states."""
    derivative = FORMULATIONS[formulation].derivative
    everywhere = slice(None)
    columns = []
    for state in range(lane_state.STATES):
        w = block(path, formulation)
        w[lane_state.STATE + state] += 1j * COMPLEX_STEP
        derivative(w, everywhere, lane_state.STATE, lane_state.SLOPES)
        columns.append(w[lane_state.SLOPES : lane_state.SLOPES + lane_state.STATES].imag / COMPLEX_STEP)
    return np.transpose(np.array(columns), (2, 1, 0))


def stability_function(tableau: Tableau) -> NDArray[np.float64]:
    """Coefficients of R(z) = 1 + z b (1 + z A + z**2 A**2 + ...) 1, ascending; explicit, so a polynomial."""
    stages = tableau.stages
    A = np.zeros((stages, stages))
    for stage, row in enumerate(tableau.rows):
        A[stage + 1, : len(row)] = row
    powers = [np.ones(stages)]
    for _ in range(stages - 1):
        powers.append(A @ powers[-1])
    return np.array([1.0, *(np.dot(tableau.weights, power) for power in powers)])


def longest_steps(tableau: Tableau, eigenvalues: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Longest step with |R(h J)| <= 1 for each decaying eigenvalue; inf where nothing decays."""
    coefficients = stability_function(tableau)
    radii = np.linspace(0.02, 15.0, 1500)
    size = np.abs(eigenvalues)
    decaying = eigenvalues.real < -1e-12 * size.max(axis=-1, keepdims=True)
    directions = np.where(decaying, eigenvalues / np.where(decaying, size, 1.0), -1.0)
    amplification = np.abs(np.polynomial.polynomial.polyval(radii * directions[..., np.newaxis], coefficients))
    first = np.argmax(amplification > 1.0 + 1e-12, axis=-1)
    return np.where(decaying, radii[first] / np.where(decaying, size, 1.0), np.inf)


def stable_step(path: Path, formulation: str, tableau: Tableau) -> float:
    """Longest step that is stable all along a solution."""
    eigenvalues = np.linalg.eigvals(jacobians(path, formulation)).astype(np.complex128)
    return float(longest_steps(tableau, eigenvalues).min())


def extent(path: Path, formulation: str) -> float:
    """Length of a life in the independent variable: tau, or s with dT = (D/m) ds."""
    if formulation == "rate":
        return float(path.time[-1])
    u, r = path.stretch**-2, path.internal**2
    slope = (1.0 + path.excess) / model.stiffness(u, r, path.excess)
    half = path.time <= 0.5 * path.time[-1]
    early = np.trapezoid(slope[half] * path.time[half], np.log(path.time[half]))
    left = np.sqrt(np.maximum(path.time[-1] - path.time[~half], 0.0))  # ds is regular in the root of the time left
    late = -np.trapezoid(2.0 * slope[~half] * left, left)
    return float(early + late)


def fold_factor(path: Path) -> float:
    """Return c of ``(lambda_c - lambda)/lambda_c = c sqrt(T_f - T)``, which holds close to failure.

    ``c = u**-2/2 sqrt(G/(6 B))`` with ``G = de/dT + 2 p u h (1/r**2 + 2 r u**3)``.
    """
    time, stretch, internal = path.end
    u, r, p = stretch**-2, internal**2, path.excess
    load_rate = 2.0 * model.CRITICAL_LOAD * (path.field + path.rate * time) * path.rate
    growth = load_rate + 2.0 * p * u * model.flow(u, r) * (1.0 / r**2 + 2.0 * r * u**3)
    return 0.5 * u**-2 * math.sqrt(growth / (6.0 * model.lower_stiffness(r, p)))


def lines(scene: Scene, values: NDArray[np.float64], tableaus: dict[str, Tableau], budget: int) -> xr.Dataset:
    """Limits of the step length along a scene's axis.

    Returns
    -------
    Dataset
        ``stable`` (solver, formulation, value), ``spent`` (formulation, value), ``fold`` and ``collapse`` (value).
    """
    program = scene.preferred[0]
    forms = list(FORMULATIONS)
    stable = np.empty((len(tableaus), len(forms), values.size))
    spent = np.empty((len(forms), values.size))
    factor, time = np.empty(values.size), np.empty(values.size)
    for k, value in enumerate(values):
        path = life(scene, program, value)
        factor[k], time[k] = fold_factor(path), path.end[0]
        for j, form in enumerate(forms):
            spent[j, k] = extent(path, form) / budget
            for i, tableau in enumerate(tableaus.values()):
                stable[i, j, k] = stable_step(path, form, tableau)
    return xr.Dataset(
        {
            "stable": (("solver", "formulation", "value"), stable, {"long_name": "longest step with |R(h J)| <= 1"}),
            "spent": (("formulation", "value"), spent, {"long_name": "step at which a life takes the whole budget"}),
            "fold": ("value", (FOLD_SHARE / factor) ** 2, {"long_name": "step in time that costs the stretch 1 %"}),
            "collapse": ("value", factor * np.sqrt(EPSILON * time), {"long_name": "what the shortest step costs"}),
        },
        coords={"solver": list(tableaus), "formulation": forms, "value": values},
    )
