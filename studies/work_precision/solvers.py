"""What a solver is to the measurement, and the solvers of `dea_maps` itself."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from common.internals import choose, kernel_of, lane_state, sweep_for
from common.programs import PROGRAMS
from numpy.typing import NDArray
from pieces import Films
from scenes import SIZES, Cases, Scene

import dea_maps as dm

RTOLS = tuple(float(f"1e-{decade}") for decade in range(3, 13))
TOLERANCES = tuple(float(f"1e-{decade}") for decade in range(3, 15))
ATTEMPTS = 20_000
OF_FILMS = PROGRAMS | {
    "overdrive": dm.Overdrive(),
    "trapezoid": dm.Trapezoid(),
    "triangle_train": dm.TriangleTrain(),
}

Answer = tuple[NDArray[np.float64], NDArray[np.float64]]
Go = Callable[[], object]
Read = Callable[[], Answer]


class Solver(NamedTuple):
    """A way to solve the cases of a scene.

    Attributes
    ----------
    name : str
        Library, method and formulation.
    library : str
        "dea_maps", or that of others.
    own_form : bool
        Whether it takes the paper's rate form.
    accuracies : sequence of float
        Settings: tolerances, steps or numbers of nodes.
    prepare : callable
        ``prepare(cases, accuracy) -> (go, read)``: ``go()`` is what is timed, and ``read()`` then gives time to
        failure and critical stretch, NaN where there is no answer.
    largest : int
        Number of cases, at most.
    """

    name: str
    library: str
    own_form: bool
    accuracies: Sequence[float]
    prepare: Callable[[Cases, float], tuple[Go, Read]]
    largest: int = 4096


def _of_package(program: str, method: str, form: str, fixed: bool) -> Callable[[Cases, float], tuple[Go, Read]]:
    def prepare(cases: Cases, accuracy: float) -> tuple[Go, Read]:
        picked = choose(PROGRAMS[program], method, form, 1e-6 if fixed else accuracy, accuracy if fixed else None)
        kernel = sweep_for(program, picked.formulation, picked.method)
        status, result = np.empty(cases.ratio.size, np.int8), np.empty((5, cases.ratio.size))

        def go() -> None:
            kernel(*cases, picked.rtol or 0.0, picked.step or 0.0, ATTEMPTS, status, result)

        def read() -> Answer:
            failed = status == lane_state.FAILED
            return np.where(failed, result[0], np.nan), np.where(failed, result[1], np.nan)

        return go, read

    return prepare


def _on_films(films: Films, accuracy: float) -> tuple[Go, Read]:
    program = OF_FILMS[films.program]
    picked = choose(program, "auto", "auto", accuracy, None, "prestretch" in films.given)
    rows, kernel, arguments = kernel_of(program, picked)
    status, result = np.empty(films.ratio.size, np.int8), np.empty((rows, films.ratio.size))

    def go() -> None:
        kernel(*arguments(films.given), status, result)

    def read() -> Answer:
        failed = status == lane_state.FAILED
        return np.where(failed, result[0], np.nan), np.where(failed, result[1], np.nan)

    return go, read


def of_package(scene: Scene, quick: bool) -> list[Solver]:
    """Return "auto" and, without several pieces or a dead load, all methods on every formulation that serves."""
    if isinstance(scene.cases(SIZES[0]), Films):
        return [Solver("auto", "dea_maps", False, RTOLS, _on_films)]
    program = scene.program
    found = [Solver("auto", "dea_maps", False, RTOLS, _of_package(program, "auto", "auto", False))]
    for method in dm.methods():
        fixed = method.fixed_step
        for form, served in method.serves.items():
            if program not in served or form == "time" or (quick and (method.name, form) != ("dopri5", "fold")):
                continue
            accuracies = tuple(10.0 ** (-0.5 * power) for power in range(1, 8)) if fixed else RTOLS
            prepare = _of_package(program, method.name, form, fixed)
            name, rate = f"{method.name}, {form}", form == "rate"
            found.append(Solver(name, "dea_maps", rate, accuracies, prepare, 256 if rate else 4096))
    return found
