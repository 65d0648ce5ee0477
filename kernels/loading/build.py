"""Compiled kernels of general loading programs, memoised."""

from collections.abc import Callable
from functools import cache
from typing import Any

from .cells import make_sweep
from .law import FREE, LOADED
from .pieces import LINEAR_ONLY, WITH_SINES


@cache
def sweep(sine: bool, dead_load: bool) -> Callable[..., Any]:
    """Compiled sweep, see the package: whether any piece is a sine, and any dead load not zero."""
    return make_sweep(LOADED if dead_load else FREE, WITH_SINES if sine else LINEAR_ONLY)
