"""(program, formulation, method) -> compiled sweep, composed from plain functions and memoised."""

from dataclasses import replace
from functools import cache

from . import lane_state as block
from . import solvers
from ._jit import Kernel
from .forms import FORMULATIONS
from .hold import quadrature
from .programs import PROGRAMS
from .rising.explicit import make_explicit
from .rising.radau import RADAU5
from .runge_kutta.control import fixed, make_pi
from .runge_kutta.driver import make_solve
from .runge_kutta.tableaus import TABLEAUS
from .sweep import LANES, in_blocks, make_sweep

AREA = "area"
QUADRATURE = "quadrature"
RADAU = "radau5"

# The stages of a step wait for one another: three vectors of AVX-512, or six of AVX2, hide that. Measured
# beside 16 lanes (dop853, rtol 1e-3 to 1e-12): with AVX-512 0.87 to 0.91 of the time of ramps, with AVX2 1.00 to 1.02.
CLIMB_LANES = 24


@cache
def sweep_for(program: str, formulation: str, method: str, adaptive: bool = True, lanes: int | None = None) -> Kernel:
    """Compiled sweep of a loading program by a method on a formulation; see `sweep.make_sweep`.

    ``adaptive=False`` keeps the step length of a method that could choose its own, whatever error it would estimate
    (to observe its order and its stability). Results have the same bits for any number of lanes.
    """
    chosen = PROGRAMS[program]
    if method == QUADRATURE:  # on the formulation "stretch"
        return make_sweep(chosen, in_blocks(solvers.solve_step, quadrature.ROWS, lanes or LANES))
    if formulation == AREA:
        stepper = RADAU5 if method == RADAU else make_explicit(TABLEAUS[method])
        make_solve_area = solvers.make_solve_ramp if program == "ramp" else solvers.make_solve_ramp_hold
        return make_sweep(chosen, make_solve_area(stepper, lanes or CLIMB_LANES))
    tableau = TABLEAUS[method]
    if not adaptive:
        tableau = replace(tableau, errors=(), error_order=0)
    control = make_pi(tableau) if tableau.errors else fixed
    solve = make_solve(chosen, FORMULATIONS[formulation], tableau, control)
    return make_sweep(chosen, in_blocks(solve, block.rows(tableau.stages), lanes or LANES))
