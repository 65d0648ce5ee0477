"""The free film as a form of a rising field: `forms/area_strain.py` with what a lane is given."""

from .._jit import device
from ..forms import area_strain
from .start import prepare
from .state import SPEED, Y_CEILING, Y_FLOOR, P, RisingForm


@device
def _rhs(w, i, v, y):
    return area_strain.rhs(v, y, w[P, i], w[SPEED, i])


@device
def _look(w, i, v, y):
    excess, h, u, d = area_strain.excess_and_flow(v, y, w[P, i])
    return excess, area_strain.stiffness(y, w[P, i], h, u, d)


@device
def _event(w, i, v, y, slope):
    return area_strain.event(v, y, slope, w[P, i], w[SPEED, i])


@device
def _sizes(w, i, v, y, slope):
    return min(max(y, w[Y_FLOOR, i]), w[Y_CEILING, i]), 1.0, 1.0


FREE = RisingForm(_rhs, _look, _event, prepare, _sizes, 1.0)
