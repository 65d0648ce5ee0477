"""Whether equal stretches stay equal: the antisymmetric mode at random states, and films whose loads differ a little.

At equal stretches the Hessian (13) splits. The antisymmetric mode, one direction growing at the cost of the other, has
the stiffness ``W11 - W12 = A + F/lambda**2`` with ``A = mu_R + (mu_U - mu_R)/xi**2`` and
``F = lambda**-4 (mu_R + (mu_U - mu_R) xi**4 + D**2/eps)``: a sum of positive terms at every state, whatever the loads.
The symmetric mode is critical where ``D**2/eps`` reaches ``(A lambda**6 + 5 (mu_R + (mu_U - mu_R) xi**4))/3``.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr
from common.internals import State, det_hessian, hessian

import dea_maps as dm

Array = npt.NDArray[np.float64]
RATIO = 4.0


class Modes(NamedTuple):
    """What was found at random states.

    Attributes
    ----------
    states : int
        How many.
    smallest : float
        Antisymmetric stiffness over W11, the smallest of all.
    first : int
        At how many the antisymmetric mode was critical before the symmetric one.
    eigen : int
        At how many of those on the border the mode without stiffness, by an eigenvalue solver, was not symmetric.
    border : float
        Largest |det H| on the border, over the product of the diagonal.
    """

    states: int
    smallest: float
    first: int
    eigen: int
    border: float


def random_modes(count: int, *, dead_loads: bool, seed: int = 1) -> Modes:
    """Draw states that the symmetric mode allows and look at the antisymmetric one.

    Modulus ratios from 1 to 1000, stretches and internal stretches from 1/3 to 10, uniform in their logarithms.
    Without dead loads the electric displacement follows from equilibrium; with equal ones it is free.
    """
    rng = np.random.default_rng(seed)
    found: list[tuple[Array, Array]] = []
    worst, first, eigen, border, left = np.inf, 0, 0, 0.0, count
    while left:
        p = 10.0 ** rng.uniform(0.0, 3.0, left) - 1.0
        l, x = (np.exp(rng.uniform(np.log(1.0 / 3.0), np.log(10.0), left)) for _ in range(2))  # noqa: E741
        a, c = 1.0 + p / x**2, 1.0 + p * x**4
        critical = (a * l**6 + 5.0 * c) / 3.0
        # eps E**2/mu_R >= 0 in equilibrium, up to (25): outside there is no such state without loads.
        square = critical * rng.uniform(0.0, 1.0, left) if dead_loads else a * l**6 - c
        kept = (square >= 0.0) & (square <= critical)
        found.append((p[kept], l[kept]))
        left -= int(kept.sum())
        for d2, at_border in ((square[kept], False), (critical[kept], True)):
            stiffness, phi, matrix = _at(l[kept], x[kept], d2, p[kept])
            worst = min(worst, float(stiffness.min(initial=np.inf)))
            first += int((stiffness <= 0.0).sum())
            if at_border:
                border = max(border, float(np.abs(phi).max(initial=0.0)))
                eigen += int((~_symmetric_is_soft(matrix)).sum())
    return Modes(count, worst, first, eigen, border)


def _at(stretch: Array, xi: Array, square: Array, p: Array) -> tuple[Array, Array, Array]:
    """Return (W11 - W12)/W11, det H over its diagonal, and the matrices scaled to a unit diagonal."""
    state = State(stretch, stretch, np.sqrt(square), xi, xi)
    h = hessian(state, p)  # type: ignore[arg-type]
    roots = np.sqrt(np.stack([h.h11, h.h22, h.h33], axis=-1))
    rows = [[h.h11, h.h12, h.h13], [h.h12, h.h22, h.h23], [h.h13, h.h23, h.h33]]
    matrix = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    scaled = matrix / (roots[..., :, np.newaxis] * roots[..., np.newaxis, :])
    diagonal = h.h11 * h.h22 * h.h33
    return (h.h11 - h.h12) / h.h11, det_hessian(state, p) / diagonal, scaled  # type: ignore[arg-type]


def _symmetric_is_soft(matrix: Array) -> npt.NDArray[np.bool_]:
    """Return whether the softest mode has equal parts in the two stretches."""
    _, vectors = np.linalg.eigh(matrix)
    soft: Array = vectors[..., 0]
    return np.abs(soft[..., 0] - soft[..., 1]) < 1e-6


def unequal_loads(differences: list[float], rtol: float) -> xr.Dataset:
    """Compare films under stresses ``mean (+-) difference`` with the film under equal stresses.

    What they differ by at failure is what an equibiaxial model is wrong by.
    """
    ramp = dm.LoadHistory((0.0, 6.0), (0.0, 6.0))
    cases: dict[str, tuple[dm.LoadHistory | float, float]] = {
        "ramp at 1, no mean stress": (ramp, 0.0),
        "ramp at 1, mean stress 0.5": (ramp, 0.5),
        "step at 1.05, no mean stress": (1.05, 0.0),
    }
    shape = (len(cases), len(differences))
    of_time, of_stretch, apart = (np.full(shape, np.nan) for _ in range(3))
    for row, (field, mean) in enumerate(cases.values()):
        equal, *films = (
            dm.general_trajectory(
                time=0.0,
                modulus_ratio=RATIO,
                field=field,
                stress_1=mean + difference,
                stress_2=mean - difference,
                rtol=rtol,
            )
            for difference in (0.0, *differences)
        )
        for column, film in enumerate(films):
            of_time[row, column] = abs(float(film.time_to_failure / equal.time_to_failure) - 1.0)
            of_stretch[row, column] = abs(float(film.critical_stretch_1 / equal.critical_stretch_1) - 1.0)
            apart[row, column] = float(film.critical_stretch_1 / film.critical_stretch_2) - 1.0
    dims = ("case", "difference")
    return xr.Dataset(
        {"apart": (dims, apart), "error_stretch": (dims, of_stretch), "error_time": (dims, of_time)},
        {"case": list(cases), "difference": differences},
    )
