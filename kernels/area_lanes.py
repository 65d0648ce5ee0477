"""The block of lanes of a climb on the scalar form of `area.py`: one local array, (rows, lanes), as in `lanes.py`."""

from collections.abc import Callable
from typing import Any, NamedTuple

# Status of a lane, kept as a float among its rows.
CLIMBING = 0.0
TO_INSTABILITY = 1.0  # a step crossed the instability: landing on it
TO_LOAD = 2.0  # a step crossed the given load, or it lies before an instability already located: landing on it
AT_INSTABILITY = 3.0
AT_LOAD = 4.0
SPENT = 5.0

# Rows of the block.
STATUS = 0
V = 1  # square root of the area strain
Y = 2  # 1 - (xi/lambda)**2
P = 3  # modulus ratio - 1
SPEED = 4  # 2 k sqrt(e_C)
TARGET = 5  # load at which to stop; inf for none
STEP = 6  # step length proposed for a climbing lane, aim of a landing one
TRIAL = 7  # step length of this attempt; zero in a lane that is done
NEW = 8  # state after this attempt
EVENT = 9  # whether this attempt met an event
LOAD = 10  # load at the event
TOLERANCE = 11  # relative error allowed in a step
GROWTH = 12  # df/dy of dy/dv = f
GLOBAL = 13  # estimated error of the state so far: those of the steps, carried on by the linearised equation
RATE = 14  # k, for starting again
DAMPING = 15  # of the start of a slow ramp
SCALE = 16  # size of y against which its errors count, where y itself is larger
REFERENCE = 17  # size of y against which its errors count, where y itself is smaller
PREVIOUS = 18  # root of the estimated error of the last accepted step over what was allowed
SLOPES = 19  # derivatives, one row a stage, the one at the new state last


class AreaMethod(NamedTuple):
    """A way to take one step of dy/dv on a block of lanes.

    Attributes
    ----------
    attempt : callable
        ``attempt(w)``: from ``V``, ``Y``, the slope there and ``TRIAL``, the state ``NEW`` and, in row ``last``, the
        slope there.
    error : callable
        ``error(w, i, size)``: estimated error of the step over ``size``.
    root : callable
        ``root(x)``: the root by which that error is turned into a factor for the step length.
    late_start : bool
        Whether a slow ramp begins where the film has yet to forget the start: explicit methods cannot do without.
    share : float
        Share of the error allowed that a step may take in an elastic film, so that few lanes have to begin again.
    last : int
        Row of the slope at the new state.
    rows : int
        Rows of the block.
    """

    attempt: Callable[..., Any]
    error: Callable[..., Any]
    root: Callable[..., Any]
    late_start: bool
    share: float
    last: int
    rows: int
