"""Drift off equation (23) along a long hold, where it is an invariant that no step restores.

The kernels' own steps, run as the plain Python that they are, so that every state on the way can be looked at.
"""

from collections.abc import Iterator

import numpy as np
import xarray as xr
from common.internals import (
    FORMULATIONS,
    KERNEL_PROGRAMS,
    SECOND,
    TABLEAUS,
    THIRD,
    lane_state,
    make_attempt,
    make_begin,
    make_error,
    make_pi,
    model,
)
from numpy.typing import NDArray

import dea_maps as dm

MODULUS_RATIO = 4.0
FIELDS = (0.95, 1.0 + 1e-4)
# A fixed step, in tau for "rate" and in s with dT = (D/m) ds for "fold", or a local tolerance.
STEPS = {"rate": 0.2, "fold": 0.1}
RTOL = 1e-6
SOLVERS = {"rk4": "fixed step", "dopri5": "tolerance 1e-6", "dop853": "tolerance 1e-6"}


def states(method: str, formulation: str, field: float, latest: float) -> Iterator[tuple[float, float, float]]:
    """Yield (time, second state, third state) after every step until the film fails or time is up."""
    tableau, form = TABLEAUS[method], FORMULATIONS[formulation]
    attempt, error = make_attempt(tableau, form.derivative), make_error(tableau)
    control = make_pi(tableau) if tableau.errors else None
    last = lane_state.SLOPES + lane_state.STATES * tableau.stages
    w = np.zeros((lane_state.rows(tableau.stages), 1))
    w[lane_state.P] = MODULUS_RATIO - 1.0
    make_begin(KERNEL_PROGRAMS["step"], form)(w, 0, 0, field, 0.0, 0.0 if control else STEPS[formulation])
    while form.distance(w, 0, lane_state.STATE) > 0.0:
        time = w[lane_state.STATE + lane_state.TIME, 0]
        yield time, w[lane_state.STATE + SECOND, 0], w[lane_state.STATE + THIRD, 0]
        if time > latest:
            return
        w[lane_state.TRIAL] = w[lane_state.STEP]
        attempt(w)
        error(w, form.tolerance_factor * RTOL)
        if control:
            control(w, 0, w[lane_state.TRIAL, 0])
        if w[lane_state.ERROR, 0] <= 1.0:
            states = slice(lane_state.STATE, lane_state.STATE + lane_state.STATES)
            w[states] = w[lane_state.NEW : lane_state.NEW + lane_state.STATES]
            w[lane_state.SLOPES : lane_state.SLOPES + lane_state.STATES] = w[last : last + lane_state.STATES]


def residual(method: str, formulation: str, field: float, times: NDArray[np.float64]) -> tuple[NDArray, float]:
    """Return |e(lambda, xi)/e - 1| at the steps next to given times, NaN after failure, and the time of failure."""
    path = np.array(list(states(method, formulation, field, times[-1])))
    time, second, third = path.T
    u, r = (second, third) if formulation == "fold" else (second**-2, third**2)
    off = np.abs(model.load(u, r, MODULUS_RATIO - 1.0) / (model.CRITICAL_LOAD * field**2) - 1.0)
    index = np.minimum(np.searchsorted(time, times), time.size - 1)
    alive = times <= time[-1]
    return np.where(alive, off[index], np.nan), float(time[-1]) if not alive[-1] else np.inf


def measure(latest: float, count: int) -> xr.Dataset:
    """Return ``residual`` (field, solver, formulation, time) and ``failure`` (field, solver, formulation)."""
    forms = list(FORMULATIONS)
    times = np.geomspace(0.1, latest, count)
    shape = (len(FIELDS), len(SOLVERS), len(forms))
    off, failure = np.empty((*shape, count)), np.empty(shape)
    for place in np.ndindex(shape):
        field, method, form = FIELDS[place[0]], list(SOLVERS)[place[1]], forms[place[2]]
        off[place], failure[place] = residual(method, form, field, times)
    truth = dm.sweep(dm.Step(), field=list(FIELDS), modulus_ratio=MODULUS_RATIO, rtol=1e-12).time_to_failure
    return xr.Dataset(
        {
            "residual": (
                ("field", "solver", "formulation", "time"),
                off.astype(np.float32),
                {"long_name": "relative residual of equation (23)", "units": "1"},
            ),
            "failure": (
                ("field", "solver", "formulation"),
                failure,
                {"long_name": "time of failure, inf where the film outlives the run", "units": "1"},
            ),
            "truth": ("field", truth.values, {"long_name": "time to failure, NaN where it survives", "units": "1"}),
        },
        coords={
            "field": list(FIELDS),
            "solver": list(SOLVERS),
            "formulation": forms,
            "time": ("time", times, {"long_name": "time", "units": "1"}),
        },
    )
