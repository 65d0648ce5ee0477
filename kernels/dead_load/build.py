"""Compiled kernels of films under a dead load, memoised."""

from functools import cache

from .._jit import Kernel
from ..programs import PROGRAMS
from .sweep import make_sweep


@cache
def sweep(program: str) -> Kernel:
    """Compiled sweep of a loading program; see `sweep.make_sweep`."""
    return make_sweep(PROGRAMS[program])
