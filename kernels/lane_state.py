"""State of a block of lanes: one local array, (rows, lanes), that holds everything about the cells in them.

One array of known row numbers, rather than one array a quantity, lets the compiler see that nothing overlaps and
turn the loops over lanes into vector instructions.
"""

from ._jit import device

# States: time and two more whose meaning is the formulation's.
TIME = 0
STATES = 3

# Status of a lane.
RUNNING = 0  # stepping freely
LOCATING = 1  # a trial step crossed an event; its length is being adjusted
AT_END = 2  # reached the end of the piece
FAILED = 3  # reached the instability
BUDGET_SPENT = 4
STEP_COLLAPSED = 5
NOT_FINITE = 6
SURVIVES = 7
FAILS_AT_ONCE = 8

# Rows of the block.
STATE = 0  # time and the formulation's two states
NEW = STATE + STATES  # the same at the end of a trial step
INPUT = NEW + STATES  # the same at a stage
P = INPUT + STATES  # p = modulus ratio - 1
BEGINNING = P + 1  # of the piece: time, field, slope of the field, time of its end
FIELD = BEGINNING + 1
SLOPE = FIELD + 1
END = SLOPE + 1
AMPLITUDE = END + 1  # of a sine in the piece, and its frequency
FREQUENCY = AMPLITUDE + 1
SIGMA = FREQUENCY + 1  # dead load over the relaxed modulus
STEP = SIGMA + 1  # step length that the controller proposes
TRIAL = STEP + 1  # step length of this attempt; zero in a lane that is done
ERROR = TRIAL + 1  # estimated error of this attempt over what is allowed
PREVIOUS_ERROR = ERROR + 1  # the same of the last accepted step
EVENT = PREVIOUS_ERROR + 1  # event function at the end of this attempt
LOW = EVENT + 1  # bracket of the step length that ends on the event, event function at its ends
LOW_EVENT = LOW + 1
HIGH = LOW_EVENT + 1
HIGH_EVENT = HIGH + 1
SLOPES = HIGH_EVENT + 1  # derivatives: STATES rows a stage, those at the new state last


def rows(stages: int) -> int:
    """Rows of a block for a method with this many stages."""
    return SLOPES + STATES * (stages + 1)


@device
def next_cells(status, first, wanted, cells):
    """Numbers of the next cells with a wanted status, from ``first`` on, as many as ``cells`` takes.

    Where there are fewer, the last one is repeated.

    Returns
    -------
    count, next : int
        How many there are, and the first cell to look at next time.
    """
    count = 0
    while first < status.size and count < cells.size:
        if status[first] == wanted:
            cells[count] = first
            count += 1
        first += 1
    for i in range(count, cells.size):
        cells[i] = cells[max(count - 1, 0)]
    return count, first
