"""Compiled kernels of general loading programs, memoised."""

from functools import cache

from .._jit import Kernel
from ..runge_kutta.control import fixed, make_pi
from ..runge_kutta.tableaus import TABLEAUS
from .cells import make_sweep
from .forms import FORMS
from .law import FREE, LOADED
from .pieces import LINEAR_ONLY, WITH_SINES
from .record import make_record, make_within
from .stepped import make_stepped
from .trajectory import make_trajectory


@cache
def sweep(sine: bool, dead_load: bool) -> Kernel:
    """Compiled sweep, see the package: whether any piece is a sine, and any dead load not zero."""
    return make_sweep(LOADED if dead_load else FREE, WITH_SINES if sine else LINEAR_ONLY)


@cache
def trajectory(sine: bool, dead_load: bool) -> Kernel:
    """Compiled trajectories, see the package; arguments as of `sweep`."""
    return make_trajectory(LOADED if dead_load else FREE, WITH_SINES if sine else LINEAR_ONLY)


@cache
def record(sine: bool, dead_load: bool) -> Kernel:
    """Compiled record of passages step by step, see `record.py`; arguments as of `sweep`."""
    return make_record(LOADED if dead_load else FREE, WITH_SINES if sine else LINEAR_ONLY)


@cache
def within(sine: bool, dead_load: bool) -> Kernel:
    """Compiled states within recorded steps, see `record.py`; arguments as of `sweep`."""
    return make_within(LOADED if dead_load else FREE, WITH_SINES if sine else LINEAR_ONLY)


@cache
def stepped(formulation: str, method: str) -> Kernel:
    """Compiled sweep by a Runge-Kutta method on a formulation that serves for comparison; see `make_stepped`."""
    tableau = TABLEAUS[method]
    return make_stepped(FORMS[formulation], tableau, make_pi(tableau) if tableau.errors else fixed)
