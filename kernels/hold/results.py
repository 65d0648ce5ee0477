"""Results of a film that fails under a constant field."""

import math

import numpy as np

from .._jit import device
from ..lane_state import BUDGET_SPENT, FAILED
from ..sweep import CRITICAL_FIELD, CRITICAL_INTERNAL_STRETCH, CRITICAL_STRETCH, TIME_TO_FAILURE
from .quadrature import BEFORE, FOUND, INTERNAL


@device
def read_hold(w, i, stretch, field, cell, result):
    """Write what a lane found for a cell, whose stretch at failure is given; returns its status."""
    rest = w[FOUND, i]
    time = w[BEFORE, i] + (0.0 if rest < 0.0 else rest)  # rounding, where a hold begins at its end
    if not time < math.inf:  # not as accurate as asked, or beyond what a float can hold
        return BUDGET_SPENT
    result[TIME_TO_FAILURE, cell] = time
    result[CRITICAL_STRETCH, cell] = stretch
    result[CRITICAL_INTERNAL_STRETCH, cell] = np.sqrt(w[INTERNAL, i])
    result[CRITICAL_FIELD, cell] = field
    return FAILED
