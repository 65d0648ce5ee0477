"""Maps of the methods of dea_maps: status codes straight from the kernels."""

from dataclasses import dataclass

import numpy as np
from common.internals import TABLEAUS, lane_state, sweep_for
from numpy.typing import NDArray
from scenes import Cells, Scene
from verdicts import (
    BUDGET_SPENT,
    EVENT_MISSED,
    FIXED,
    NOT_FINITE,
    NOT_SERVED,
    STEP_COLLAPSED,
    TOLERANCES,
    errors,
    of_answers,
)

import dea_maps as dm

# Attempted steps of a cell.
BUDGET = 50_000
STATUS = {
    lane_state.BUDGET_SPENT: BUDGET_SPENT,
    lane_state.STEP_COLLAPSED: STEP_COLLAPSED,
    lane_state.NOT_FINITE: NOT_FINITE,
}


@dataclass(frozen=True)
class Case:
    """A method on a formulation."""

    method: str
    formulation: str
    programs: tuple[str, ...]

    @property
    def label(self) -> str:
        """Title of its maps."""
        return f"{self.method} on {self.formulation}"


def adaptive_cases() -> list[Case]:
    """Return every method that finds its own steps or nodes, on every formulation; "time" is met in falling.py."""
    entries = [entry for entry in dm.methods() if not entry.kind.endswith("fixed step")]
    cases = [
        Case(entry.name, form, programs)
        for entry in entries
        for form, programs in entry.serves.items()
        if form != "time"
    ]
    return sorted(cases, key=lambda case: ("rate", "fold").count(case.formulation))


def fixed_cases() -> list[Case]:
    """Return every explicit method on every formulation that can be stepped with a fixed length."""
    entries = [entry for entry in dm.methods() if entry.name in TABLEAUS]
    return [
        Case(entry.name, form, entry.serves[form])
        for form in ("rate", "fold")
        for entry in entries
        if form in entry.serves
    ]


def run(kernel, cells: Cells, tolerance: float, step: float, budget: int) -> tuple[NDArray, NDArray]:
    """Return status and (time, stretch, field) of cells."""
    count = cells.field.size
    status, result = np.empty(count, np.int8), np.empty((5, count))
    kernel(cells.field, cells.rate, cells.modulus_ratio, tolerance, step, budget, status, result)
    return status, result[[0, 1, 3]]


def verdicts(status: NDArray, found: NDArray, cells: Cells, allowed: float) -> NDArray[np.int8]:
    """Verdict on every cell from its status and results."""
    verdict = np.array([STATUS.get(int(code), NOT_SERVED) for code in status], np.int8)
    answered = status == lane_state.FAILED
    verdict[answered] = of_answers(found[:, answered], cells.truth[:, answered], np.array(allowed))
    return verdict


def adaptive_map(case: Case, scene: Scene, values: NDArray, tolerances: NDArray) -> tuple[NDArray, NDArray]:
    """Return verdicts and errors, (tolerances, values) each."""
    program = scene.program(case.programs)
    shape = (tolerances.size, values.size)
    if program is None:
        return np.full(shape, NOT_SERVED, np.int8), np.full(shape, np.nan)
    kernel = sweep_for(program, case.formulation, case.method)
    cells = scene.cells(program, values)
    rows = [run(kernel, cells, tolerance, 0.0, BUDGET) for tolerance in tolerances]
    kinds = [
        verdicts(status, found, cells, TOLERANCES * tolerance)
        for (status, found), tolerance in zip(rows, tolerances, strict=True)
    ]
    return np.array(kinds), np.array([errors(found, cells.truth) for _, found in rows])


def fixed_map(case: Case, scene: Scene, values: NDArray, steps: NDArray) -> tuple[NDArray, NDArray]:
    """Return verdicts and errors, (steps, values) each."""
    program = scene.program(case.programs)
    kernel = sweep_for(program, case.formulation, case.method, adaptive=False)
    cells = scene.cells(program, values)
    kinds, sizes = [], []
    for step in steps:
        status, found = run(kernel, cells, 0.0, step, BUDGET)
        kind = verdicts(status, found, cells, FIXED)
        if case.formulation == "rate":  # its steps are steps in time, so the time reached is known
            beyond = BUDGET * step > 1.5 * cells.truth[0]
            kind[(kind == BUDGET_SPENT) & beyond] = EVENT_MISSED
        kinds.append(kind)
        sizes.append(errors(found, cells.truth))
    return np.array(kinds), np.array(sizes)
