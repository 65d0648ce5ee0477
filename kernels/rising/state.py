"""The block of lanes of a climb on the area-strain form: one local array, (rows, lanes), as in `lane_state.py`."""

from collections.abc import Callable
from typing import Any, NamedTuple

# Status of a lane, kept as a float among its rows.
CLIMBING = 0.0
TO_INSTABILITY = 1.0  # a step crossed the instability: landing on it
TO_LOAD = 2.0  # a step crossed the given load, or it lies before an instability already located: landing on it
AT_INSTABILITY = 3.0
AT_LOAD = 4.0
SPENT = 5.0

# Rows of the block: what changes on the way,
STATUS = 0
V = 1  # square root of the area strain
Y = 2  # 1 - (xi/lambda)**2
STEP = 3  # step length proposed for a climbing lane, aim of a landing one
TRIAL = 4  # step length of this attempt; zero in a lane that is done
NEW = 5  # state after this attempt
EVENT = 6  # what this attempt met
LOAD_EXCESS = 7  # e - e_C at the event
JACOBIAN = 8  # df/dy of dy/dv = f
GLOBAL_ERROR = 9  # estimated error of the state so far: those of the steps, carried on by the linearised equation
PREVIOUS = 10  # root of the estimated error of the last accepted step over what was allowed
COUNT = 11  # attempts so far
# what a lane is given;
P = 12  # modulus ratio - 1
SPEED = 13  # 2 k sqrt(e_C)
TARGET = 14  # e - e_C at which to stop; inf for none
INVERSE_TOLERANCE = 15  # one over the relative error allowed in a step
Y_CEILING = 16  # size of y against which its errors count, where y itself is larger
Y_FLOOR = 17  # size of y against which its errors count, where y itself is smaller
START_V = 18  # state to begin with, dy/dv and its Jacobian there, the first step
START_Y = 19
START_SLOPE = 20
START_JACOBIAN = 21
START_STEP = 22
RATE = 23  # k
FIELD = 24  # at which to stop, in Ec
SHAPE = 25  # of a film under a dead load: (w_p)**6, and w_t/w_p
TOP = 26
LANDING = 27  # share of the accuracy asked to which an event is met, where the solution bends sharply next to it
OFFSET = 28  # of a film under a dead load: v**2 less the strain
DECAY_2 = 29  # of such a film: a sixteenth of the decay of an error still to come, over d**2 and d**4
DECAY_4 = 30
STIFF = 31  # and the factor of the third power of J h in the error of a step
# and the derivatives, one row a stage, the one at the new state last.
SLOPES = 32

# What is left of a lane when it is done: rows of the result of a climb.
REACHED = (V, Y, SLOPES, STEP, LOAD_EXCESS)
REACHED_V, REACHED_Y, REACHED_SLOPE, REACHED_AIM, REACHED_LOAD_EXCESS = range(len(REACHED))


class RisingForm(NamedTuple):
    """A scalar equation dy/dv that is regular from the film without field to the instability and beyond.

    Attributes
    ----------
    rhs : callable
        ``rhs(w, i, v, y)``: dy/dv with what lane i is given.
    look : callable
        ``look(w, i, v, y)``: the load in excess of the largest one of a relaxed film, and the stiffness D.
    event : callable
        ``event(w, i, v, y, slope)``: excess, D, dD/dv along the solution, and K = (de/dv)/D, which is positive.
    prepare : callable
        ``prepare(w, i, rtol, tolerance_factor, damping)``: complete what a lane is given, see `start.prepare`.
    sizes : callable
        ``sizes(w, i, v, y, slope)``: at the end of a step, the size of y in the estimate of its error, a factor of that
        estimate, and the size over the one relative to which the error is bounded.
    after_rejection : float
        Root of the error, over that allowed, that counts as that of the step before, after one that was rejected.
    """

    rhs: Callable[..., Any]
    look: Callable[..., Any]
    event: Callable[..., Any]
    prepare: Callable[..., Any]
    sizes: Callable[..., Any]
    after_rejection: float


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
        ``root(x)``: the root of that error, in single precision, that gives the factor for the step length.
    late_start : bool
        Whether a slow ramp begins on the slow manifold: explicit methods would need some 1/k steps from the start.
    tolerance_factor : float
        Estimated error of a step in an elastic film over the accuracy asked of the results.
    last : int
        Row of the slope at the new state.
    rows : int
        Rows of the block.
    form : RisingForm
        The equation.
    """

    attempt: Callable[..., Any]
    error: Callable[..., Any]
    root: Callable[..., Any]
    late_start: bool
    tolerance_factor: float
    last: int
    rows: int
    form: RisingForm
