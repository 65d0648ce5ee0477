"""The interface of the studies to what is not public, of the kernels and of the package around them.

A study that times a kernel, counts its steps or looks at its states needs more than `dea_maps` offers its users. What
is needed stands here and nowhere else; a study takes it as it is, and changes none of it.
"""

from dea_maps.charts.fit import draw_fit
from dea_maps.cli.specification import read_specification, thinned
from dea_maps.general.film import Loads, integrated
from dea_maps.general.free_energy import CRITICAL_FIELD, State, det_hessian, equations_of_state, hessian
from dea_maps.general.integrate import TIME
from dea_maps.kernels import lane_state, model, solvers
from dea_maps.kernels.build import CLIMB_LANES, sweep_for
from dea_maps.kernels.forms import FORMULATIONS
from dea_maps.kernels.forms.area_strain import rhs
from dea_maps.kernels.forms.formulation import SECOND, THIRD
from dea_maps.kernels.hold import gauss_legendre, quadrature
from dea_maps.kernels.hold.quadrature import _integrate_nodes as integrate_nodes
from dea_maps.kernels.hold.quadrature import _integrate_pole_part as integrate_pole_part
from dea_maps.kernels.hold.quadrature import _smooth_part as smooth_part
from dea_maps.kernels.programs import PROGRAMS as KERNEL_PROGRAMS
from dea_maps.kernels.rising.explicit import make_explicit
from dea_maps.kernels.runge_kutta.control import make_pi
from dea_maps.kernels.runge_kutta.driver import make_begin
from dea_maps.kernels.runge_kutta.step import make_attempt, make_error
from dea_maps.kernels.runge_kutta.tableaus import TABLEAUS, Tableau
from dea_maps.kernels.sweep import LANES, RESULTS
from dea_maps.limits.voltages import time_in_words
from dea_maps.materials.fit import UniaxialFit
from dea_maps.materials.tension_data import as_curves, read_curves
from dea_maps.materials.toml import material_of
from dea_maps.materials.uniaxial import uniaxial_stress
from dea_maps.sweeps.grid import make_grid
from dea_maps.sweeps.methods import choose
from dea_maps.sweeps.solve import _kernel as kernel_of
from dea_maps.sweeps.solve import solve

__all__ = [
    "CLIMB_LANES",
    "CRITICAL_FIELD",
    "FORMULATIONS",
    "KERNEL_PROGRAMS",
    "LANES",
    "RESULTS",
    "SECOND",
    "TABLEAUS",
    "THIRD",
    "TIME",
    "Loads",
    "State",
    "Tableau",
    "UniaxialFit",
    "as_curves",
    "choose",
    "det_hessian",
    "draw_fit",
    "equations_of_state",
    "gauss_legendre",
    "hessian",
    "integrate_nodes",
    "integrate_pole_part",
    "integrated",
    "kernel_of",
    "lane_state",
    "make_attempt",
    "make_begin",
    "make_error",
    "make_explicit",
    "make_grid",
    "make_pi",
    "material_of",
    "model",
    "quadrature",
    "read_curves",
    "read_specification",
    "rhs",
    "smooth_part",
    "solve",
    "solvers",
    "sweep_for",
    "thinned",
    "time_in_words",
    "uniaxial_stress",
]
