"""Dense output of a climb by DOP853, all steps of a climb at a time: three stages more, and a polynomial of degree 7.

Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed., section II.10, and their code DOP853. The
derivatives of a step are rows of one array, a step a column: those of the 12 stages, at the new state, of three more stages.
"""

from collections.abc import Callable
from typing import Any

from .._jit import device
from ..area import slope

# Rows of the steps of a climb.
START = 0  # v and y at its beginning
VALUE = 1
LENGTH = 2
NEXT = 3  # y at its end
UNCERTAINTY = 4  # estimated error of y carried so far
DERIVATIVES = 5
STAGES = 13
MORE = 3
POLYNOMIAL = DERIVATIVES + STAGES + MORE
DEGREE = 7
ROWS = POLYNOMIAL + DEGREE

_STAGE_WEIGHTS = (
    (
        0.056167502283047954, 0.0, 0.0, 0.0, 0.0, 0.0, 0.25350021021662483, -0.2462390374708025, -0.12419142326381637,
        0.15329179827876568, 0.00820105229563469, 0.007567897660545699, -0.008298,
    ),
    (
        0.03183464816350214, 0.0, 0.0, 0.0, 0.0, 0.028300909672366776, 0.053541988307438566, -0.05492374857139099, 0.0,
        0.0, -0.00010834732869724932, 0.0003825710908356584, -0.00034046500868740456, 0.1413124436746325,
    ),
    (
        -0.42889630158379194, 0.0, 0.0, 0.0, 0.0, -4.697621415361164, 7.683421196062599, 4.06898981839711,
        0.3567271874552811, 0.0, 0.0, 0.0, -0.0013990241651590145, 2.9475147891527724, -9.15095847217987,
    ),
)  # fmt: skip
_NODES = (0.1, 0.2, 7.0 / 9.0)
_POLYNOMIAL_WEIGHTS = (
    (
        -8.428938276109013, 0.0, 0.0, 0.0, 0.0, 0.5667149535193777, -3.0689499459498917, 2.38466765651207,
        2.117034582445028, -0.871391583777973, 2.2404374302607883, 0.6315787787694688, -0.08899033645133331,
        18.148505520854727, -9.194632392478356, -4.436036387594894,
    ),
    (
        10.427508642579134, 0.0, 0.0, 0.0, 0.0, 242.28349177525817, 165.20045171727028, -374.5467547226902,
        -22.113666853125306, 7.733432668472264, -30.674084731089398, -9.332130526430229, 15.697238121770845,
        -31.139403219565178, -9.35292435884448, 35.81684148639408,
    ),
    (
        19.985053242002433, 0.0, 0.0, 0.0, 0.0, -387.0373087493518, -189.17813819516758, 527.8081592054236,
        -11.57390253995963, 6.8812326946963, -1.0006050966910838, 0.7777137798053443, -2.778205752353508,
        -60.19669523126412, 84.32040550667716, 11.99229113618279,
    ),
    (
        -25.69393346270375, 0.0, 0.0, 0.0, 0.0, -154.18974869023643, -231.5293791760455, 357.6391179106141,
        93.40532418362432, -37.45832313645163, 104.0996495089623, 29.8402934266605, -43.53345659001114,
        96.32455395918828, -39.17726165561544, -149.72683625798564,
    ),
)  # fmt: skip


def _make_sum(weights: tuple[float, ...]) -> Callable[..., Any]:
    """Make ``weighted(steps, k)`` of the derivatives of step k; zero weights cost nothing."""
    factors = tuple(weight for weight in weights if weight != 0.0)
    rows = tuple(DERIVATIVES + row for row, weight in enumerate(weights) if weight != 0.0)
    count = len(factors)

    @device
    def weighted(steps, k):
        total = factors[0] * steps[rows[0], k]
        for j in range(1, count):
            total += factors[j] * steps[rows[j], k]
        return total

    return weighted


def _make_stage(stage: int) -> Callable[..., Any]:
    """Make one of the stages that dense output takes beside those of the method."""
    weighted = _make_sum(_STAGE_WEIGHTS[stage])
    node = _NODES[stage]
    row = DERIVATIVES + STAGES + stage

    @device
    def one_stage(steps, count, p, speed):
        for k in range(count):
            length = steps[LENGTH, k]
            y = steps[VALUE, k] + length * weighted(steps, k)
            steps[row, k] = slope(steps[START, k] + node * length, y, p, speed)

    return one_stage


_first, _second, _third = (_make_stage(stage) for stage in range(MORE))
_f3, _f4, _f5, _f6 = (_make_sum(weights) for weights in _POLYNOMIAL_WEIGHTS)


@device
def prepare(steps, count, p, speed):
    """Complete the first ``count`` steps by their polynomials."""
    _first(steps, count, p, speed)
    _second(steps, count, p, speed)
    _third(steps, count, p, speed)
    for k in range(count):
        length = steps[LENGTH, k]
        rise = steps[NEXT, k] - steps[VALUE, k]
        at_start = length * steps[DERIVATIVES, k]
        at_end = length * steps[DERIVATIVES + STAGES - 1, k]
        steps[POLYNOMIAL, k] = rise
        steps[POLYNOMIAL + 1, k] = at_start - rise
        steps[POLYNOMIAL + 2, k] = 2.0 * rise - (at_end + at_start)
        steps[POLYNOMIAL + 3, k] = length * _f3(steps, k)
        steps[POLYNOMIAL + 4, k] = length * _f4(steps, k)
        steps[POLYNOMIAL + 5, k] = length * _f5(steps, k)
        steps[POLYNOMIAL + 6, k] = length * _f6(steps, k)


@device
def value(pieces, first, k, y, x):
    """State at the share x of a step that begins at y; its polynomial is in rows from ``first``, column k."""
    z = 1.0 - x
    total = pieces[first + 6, k] * x
    total = (total + pieces[first + 5, k]) * z
    total = (total + pieces[first + 4, k]) * x
    total = (total + pieces[first + 3, k]) * z
    total = (total + pieces[first + 2, k]) * x
    total = (total + pieces[first + 1, k]) * z
    return y + (total + pieces[first, k]) * x
