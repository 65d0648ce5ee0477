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


def _ours(program: str, method: str, form: str, fixed: bool) -> Callable[[Cases, float], tuple[Go, Read]]:
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


def _on_films(program: str, method: str, form: str, fixed: bool) -> Callable[[Films, float], tuple[Go, Read]]:
    def prepare(films: Films, accuracy: float) -> tuple[Go, Read]:
        loaded = "prestretch" in films.given
        step = accuracy if fixed else None
        picked = choose(OF_FILMS[program], method, form, 1e-6 if fixed else accuracy, step, loaded)
        rows, kernel, arguments = kernel_of(OF_FILMS[program], picked)
        status, result = np.empty(films.ratio.size, np.int8), np.empty((rows, films.ratio.size))

        def go() -> None:
            kernel(*arguments(films.given), status, result)

        def read() -> Answer:
            failed = status == lane_state.FAILED
            return np.where(failed, result[0], np.nan), np.where(failed, result[1], np.nan)

        return go, read

    return prepare


def ours(scene: Scene, quick: bool) -> list[Solver]:
    """Return "auto" and every method of `dea_maps` on every formulation that serves a scene."""
    films = isinstance(scene.cases(SIZES[0]), Films)
    program, make = scene.program, _on_films if films else _ours
    found = [Solver("auto", "dea_maps", False, RTOLS, make(program, "auto", "auto", False))]
    for method in dm.methods():
        for form, served in method.serves.items():
            # "time" is auto's own form of films under several pieces; others for comparison serve films as well
            serves = form == "rate" or (form == "time" and method.fixed_step) if films else program in served
            if not serves or (not films and form == "time") or (quick and (method.name, form) != ("dopri5", "fold")):
                continue
            accuracies = tuple(10.0 ** (-0.5 * power) for power in range(1, 8)) if method.fixed_step else RTOLS
            prepare = make(program, method.name, form, method.fixed_step)
            name, rate = f"{method.name}, {form}", form == "rate"
            found.append(Solver(name, "dea_maps", rate, accuracies, prepare, 256 if rate else 4096))
    return found
