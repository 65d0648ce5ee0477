"""(program, formulation, method) -> compiled sweep, composed from plain functions and memoised."""

from functools import cache

from . import lanes as block
from . import quadrature, scenes
from ._jit import Kernel
from .area_explicit import make_explicit
from .area_implicit import RADAU5
from .control import fixed, make_pi
from .formulations import FORMULATIONS
from .integrate import make_solve
from .programs import PROGRAMS
from .sweep import LANES, in_blocks, make_sweep
from .tableaus import TABLEAUS
from .trace import make_trace

AREA = "area"
QUADRATURE = "quadrature"
RADAU = "radau5"


@cache
def sweep_for(
    program: str, formulation: str, method: str, adaptive: bool = True, lanes: int = LANES
) -> Kernel:
    """Compiled sweep of a loading program by a method on a formulation; see `sweep.make_sweep`.

    ``adaptive=False`` keeps the step length of a method that could choose its own (to observe its order).
    """
    chosen = PROGRAMS[program]
    if method == QUADRATURE:  # on the formulation "stretch"
        return make_sweep(chosen, in_blocks(scenes.solve_step, quadrature.ROWS, lanes))
    if formulation == AREA:
        stepper = RADAU5 if method == RADAU else make_explicit(TABLEAUS[method])
        make_solve_area = scenes.make_solve_ramp if program == "ramp" else scenes.make_solve_ramp_hold
        return make_sweep(chosen, make_solve_area(stepper, lanes))
    tableau = TABLEAUS[method]
    control = make_pi(tableau) if adaptive and tableau.errors else fixed
    solve = make_solve(chosen, FORMULATIONS[formulation], tableau, control)
    return make_sweep(chosen, in_blocks(solve, block.rows(tableau.stages), lanes))


@cache
def trajectory(program: str) -> Kernel:
    """Compiled trajectories under a loading program; see `trace.make_trace`."""
    tableau = TABLEAUS["dop853"]
    return make_trace(PROGRAMS[program], tableau, make_pi(tableau))
