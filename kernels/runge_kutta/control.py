"""Step-size control: what a lane does with its step length once an attempt and its error are known."""

from collections.abc import Callable
from typing import Any

from .._jit import device
from ..lane_state import ERROR, PREVIOUS_ERROR, STEP
from .tableaus import Tableau

# As usual (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.4).
SAFETY = 0.9
SMALLEST_FACTOR = 0.2
LARGEST_FACTOR = 8.0
# Errors below these count as these: where an estimate changes sign, its smallness does not make a long step.
SMALLEST_ERROR = 1e-10
SMALLEST_PREVIOUS_ERROR = 1e-4


@device
def fixed(w, i, length):
    """Keep the step length whatever the error."""


def make_pi(tableau: Tableau) -> Callable[..., Any]:
    """Make ``pi(w, i, length)``: proportional-integral control (Gustafsson 1991) of the next step length.

    Exponents 0.7/q and 0.4/q on the errors of this and of the last accepted step, q the order in the step size to
    which the estimate vanishes.
    """
    present = 0.7 / tableau.error_order
    past = 0.4 / tableau.error_order

    @device
    def pi(w, i, length):
        error = max(w[ERROR, i], SMALLEST_ERROR)
        if error <= 1.0:
            factor = SAFETY * error**-present * w[PREVIOUS_ERROR, i] ** past
            w[PREVIOUS_ERROR, i] = max(error, SMALLEST_PREVIOUS_ERROR)
        else:
            factor = SAFETY * error**-present if error < 1e300 else SMALLEST_FACTOR
            factor = min(factor, 1.0)
        w[STEP, i] = length * min(max(factor, SMALLEST_FACTOR), LARGEST_FACTOR)

    return pi
