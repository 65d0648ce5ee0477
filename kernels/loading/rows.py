"""Rows of the block of lanes of `march.py`, and of what is kept of a passage between its phases."""

# Status of a passage.
READY = 0  # to be marched in time
NEAR = 1  # the instability is close: stiffness as the variable, see finish.py
ENDED = 2  # came to the end of the program
FELL = 3  # at the instability
JUMPED = 4  # met a jump to more than the film carries
SPENT = 5  # its attempts are used up
WAITING = 6  # for other passages of its cell
HOLDS = 7  # at the start of a held field under which it may fail: an integral, see held.py

# What is kept, one row each; a passage goes once through the pieces.
PIECE = 0
T = 1  # time within the piece; or one of the next two
OFFSET = 2  # time at the start of the piece, within the passage
BASE = 3  # r = xi**2 at the start of the passage
Y = 4  # r - BASE
X = 5  # unknown of the law of equilibrium
STEP = 6
ERROR = 7  # estimated error of r so far: those of the steps, carried on by the linearised equation
GAIN = 8  # derivative of r by the r at the start of the passage
LEAST = 9  # of the unknown on the way: the largest stretch
MOST = 10
DOUBT = 11  # largest error of the load that the film carries over the distance to it, where it got past that
BARRED = 12  # stiffness above which the finish is not to be tried (again)
TIGHTNESS = 13  # one over the relative error allowed in a step
COUNT = 14  # attempts so far
HELD = 15  # field held without end after the last piece
TIME_ERROR = 16  # estimated error of the time of failure
RESOLUTION = 17  # relative error allowed in extremes of the unknown
ROUNDING = 18  # variance of r by rounding so far, carried on like ERROR
UNTIL = 19  # piece before which the passage ends
SCALE = 20  # least change of r to which errors are relative: that of the cycle before
FIRST_STEP = 21  # that follows from the error of the first step accepted
PENDING = 22  # the same where the film last came closer: counts as soon as it gets past
LEAST_ERROR = 23  # relative, of the stretch at LEAST, and its change by the r at the start of the passage
LEAST_SLOPE = 24
REACH = 25  # least distance of r to that at which the load then would not have been carried, r and the unknown there
REACH_R = 26
REACH_X = 27
KEPT = 28

# Instead of a time: about to begin, X being the field before; between two pieces, X being that at the end of the first.
BEGINS = -1.0
BETWEEN = -2.0

# Of a lane: what follows from the above, and what it is given,
NEW = 28
TRIAL = 29
D = 30  # stiffness, N, Q = D dD/dT, dF/dr, dx/dT, at the start of the step
N = 31
Q = 32
GROWTH = 33
RATE_OF_X = 34
BAD = 35  # a stage without equilibrium
EVENT = 36
P = 37
SIGMA = 38
START = 39  # of the piece: field at the start, its slope, amplitude and frequency of the sine, duration
SLOPE = 40
AMPLITUDE = 41
FREQUENCY = 42
DURATION = 43
NEW_X = 44
LAST_LENGTH = 45  # of the step accepted before, and the eighth root of its error over the one allowed
LAST_ROOT = 46
TURN = 47  # a step of length s lasts s (1 + TURN s)
FLOW = 48  # dr/dT at the new state
HOLDING = 49  # whether the time to failure under a held field is asked for: 0 no, 1 of one without end, 2 of any
LONGEST = 50  # step: part of the period of the sine
ZERO = 51  # of the field of a sine, in turns: NaN where there is none
SLOPES = 52  # dr/ds, one row a stage, the one at the new state last
