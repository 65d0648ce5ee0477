"""What happened in a cell of the atlas."""

import numpy as np
from numpy.typing import NDArray

WORDS = (
    "accurate",
    "inaccurate",
    "event_missed",
    "wrong_branch",
    "not_finite",
    "step_collapsed",
    "budget_spent",
)
ACCURATE, INACCURATE, EVENT_MISSED, WRONG_BRANCH, NOT_FINITE, STEP_COLLAPSED, BUDGET_SPENT = range(len(WORDS))
NOT_SERVED = -1

# Allowed relative error of any result: this many tolerances, or, with a fixed step, this.
TOLERANCES = 10.0
FIXED = 1e-3
# A stretch at failure that is too large by more than this share lies on the branch beyond the fold.
BEYOND = 0.02


def errors(found: NDArray[np.float64], truth: NDArray[np.float64]) -> NDArray[np.float64]:
    """Largest relative error of time to failure, critical stretch and critical field, (3, cells) each."""
    return np.abs(found / truth - 1.0).max(axis=0)


def of_answers(
    found: NDArray[np.float64], truth: NDArray[np.float64], allowed: NDArray[np.float64]
) -> NDArray[np.int8]:
    """Verdicts on cells in which a failure was reported."""
    verdict = np.where(errors(found, truth) <= allowed, ACCURATE, INACCURATE)
    verdict = np.where(found[1] > (1.0 + BEYOND) * truth[1], WRONG_BRANCH, verdict)
    return np.where(np.isfinite(found).all(axis=0), verdict, NOT_FINITE).astype(np.int8)
