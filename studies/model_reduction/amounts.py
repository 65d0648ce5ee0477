"""The same films with more and with less model: what each amount answers at failure, and what it costs."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from time import perf_counter

import numpy as np
import numpy.typing as npt
import xarray as xr
from common.internals import CRITICAL_FIELD, TIME, Loads, State, equations_of_state, integrated
from scipy.integrate import solve_ivp

import dea_maps as dm

RATIO = 4.0
SCENES: dict[str, dict[str, float]] = {
    "step at 1.01": {"field": 1.01},
    "step at 1.2": {"field": 1.2},
    "step at 1.9": {"field": 1.9},
    "ramp at 0.01": {"rate": 0.01},
    "ramp at 1": {"rate": 1.0},
    "ramp at 100": {"rate": 100.0},
    "ramp at 2, hold at 1.2": {"rate": 2.0, "field": 1.2},
}
AMOUNTS = (
    "five states",
    "equibiaxial, same integrator",
    "equibiaxial, rate form",
    "scalar, regular form",
    "quadrature",
    "closed form",
)
BATCHES = {"equibiaxial, rate form": 2_000, "scalar, regular form": 20_000, "quadrature": 100_000}
_SECONDS = 0.05

Answer = tuple[float, float, float]  # time to failure, stretch and field there
Array = npt.NDArray[np.float64]


def program_of(scene: dict[str, float]) -> dm.Step | dm.Ramp | dm.RampHold:
    """Return the loading program that takes these parameters."""
    return dm.RampHold() if len(scene) == 2 else dm.Ramp() if "rate" in scene else dm.Step()


def full(scene: dict[str, float], rtol: float) -> Answer:
    """Solve with the general model: five states, det H = 0; without the data set of `dm.general_trajectory`."""
    none = dm.LoadHistory((0.0,), (0.0,))
    end = integrated(Loads(none, none, _history(scene), (False, False)), RATIO - 1.0, rtol).end.tolist()
    field = equations_of_state(State(*end[:TIME]), RATIO - 1.0)[2] / CRITICAL_FIELD
    return end[TIME], end[0], field


def reduced_by_scipy(scene: dict[str, float], rtol: float) -> Answer:
    """Solve (23), (24) and (26) with the integrator of the general model, in the time dT = D ds."""
    history, p = _history(scene), RATIO - 1.0
    times = [*history.times, np.inf]
    rows = np.array([1.0, 1.0, 0.0])
    unit = CRITICAL_FIELD
    load = (history.after(0.0) * unit) ** 2
    if load > 0.0:  # the root of (23) at xi = 1
        u = 1.0
        for _ in range(60):
            u -= (u - u**4 - load / RATIO) / (1.0 - 4.0 * u**3)
        rows[0] = u
    for start, stop in pairwise(times):
        slope = 0.0 if stop == np.inf else (history.before(stop) - history.after(start)) / (stop - start)

        def rates(_: float, y: Array, first: float = start, slope: float = slope) -> list[float]:
            u, r, t = y.tolist()
            a, b, z = 1.0 + p / r, 1.0 + p * r * r, u * r
            h = 1.0 / z - z * z
            rise = 2.0 * unit**2 * (history.after(first) + slope * (t - first)) * slope
            d = 4.0 * b * u**3 - a
            return [-(rise + 2.0 * p * u * (1.0 / r**2 + 2.0 * r * u**3) * h), 2.0 * h * d, d]

        def fold(_: float, y: Array) -> float:
            u, r, _t = y.tolist()
            return float(4.0 * (1.0 + p * r * r) * u**3 - 1.0 - p / r)

        def corner(_: float, y: Array, stop: float = stop) -> float:
            return float(stop - y[2])

        fold.terminal = corner.terminal = True  # type: ignore[attr-defined]
        events = [fold, corner] if stop < np.inf else [fold]
        run = solve_ivp(
            rates, (0.0, 1e5), rows, method="DOP853", rtol=max(0.02 * rtol, 2.5e-14), atol=2.5e-14, events=events
        )
        rows = run.y[:, -1]
        if run.t_events[0].size:
            break
    u, _, time = rows.tolist()
    return time, u**-0.5, history.after(start) + slope * (time - start)


def library(method: str, formulation: str) -> Callable[[dict[str, float], float], Answer]:
    """Return what solves with a method of `dea_maps.sweep`."""

    def solve(scene: dict[str, float], rtol: float) -> Answer:
        ds = dm.sweep(
            program_of(scene), modulus_ratio=RATIO, rtol=rtol, method=method, formulation=formulation, **scene
        )
        return float(ds.time_to_failure), float(ds.critical_stretch), float(ds.critical_field)

    return solve


def closed_form(scene: dict[str, float], _: float) -> Answer:
    """Return the leading terms of the limits: just above Ec for a step, k to 0 or to infinity for a ramp."""
    p = RATIO - 1.0
    slow = relaxed_limit(p)
    if "rate" not in scene:
        field = scene["field"]
        return np.pi * p / (3.0 * np.sqrt(field - 1.0)), slow, field
    if len(scene) == 2:  # as the step, after the time that the ramp takes less half of it
        field = scene["field"]
        return np.pi * p / (3.0 * np.sqrt(field - 1.0)) + 0.5 * field / scene["rate"], slow, field
    k = scene["rate"]
    return (1.0 / k, slow, 1.0) if k < 1.0 else (np.sqrt(RATIO) / k, 2.0 ** (1.0 / 3.0), np.sqrt(RATIO))


def relaxed_limit(p: float) -> float:
    """Return the stretch at which a film fails just above Ec: e_c(xi) = e at Ec, (23) at (25)."""
    low, high = 1.0, 1e6  # of r = xi**2
    for _ in range(200):
        r = 0.5 * (low + high)
        a, b = 1.0 + p / r, 1.0 + p * r * r
        low, high = (r, high) if a**4 / b > 1.0 else (low, r)
    return float(2.0 ** (1.0 / 3.0) * (b / a) ** (1.0 / 6.0))


def solver_of(amount: str, scene: dict[str, float]) -> Callable[[dict[str, float], float], Answer] | None:
    """Return what solves a scene with an amount of model, None where there is none."""
    if amount == "quadrature":
        return None if "rate" in scene else library("quadrature", "stretch")
    form = "area" if "rate" in scene else "fold"
    return {
        "five states": full,
        "equibiaxial, same integrator": reduced_by_scipy,
        "equibiaxial, rate form": library("dop853", "rate"),
        "scalar, regular form": library("dop853", form),
        "closed form": closed_form,
    }[amount]


def cost_of(amount: str, scene: dict[str, float], rtol: float) -> float:
    """Return seconds per film: of a batch, for what the library solves in compiled batches."""
    solve = solver_of(amount, scene)
    assert solve is not None
    if amount in BATCHES:
        method = "quadrature" if amount == "quadrature" else "dop853"
        regular = "area" if "rate" in scene else "fold"
        form = {"quadrature": "stretch", "scalar, regular form": regular}.get(amount, "rate")
        given = {"modulus_ratio": np.full(BATCHES[amount], RATIO), **scene}
        whole = _timed(lambda: dm.sweep(program_of(scene), rtol=rtol, method=method, formulation=form, **given))
        return whole / BATCHES[amount]
    return _timed(lambda: solve(scene, rtol))


def measure(rtols: list[float], scenes: list[str], amounts: Sequence[str]) -> xr.Dataset:
    """Return errors at failure against the five states at 1e-12, and seconds per film."""
    shape = (len(scenes), len(amounts), len(rtols))
    error, seconds = np.full(shape, np.nan), np.full(shape, np.nan)
    for row, scene in enumerate(SCENES[name] for name in scenes):
        truth = np.array(full(scene, 1e-12))
        for column, amount in enumerate(amounts):
            solve = solver_of(amount, scene)
            if solve is None:
                continue
            for layer, rtol in enumerate(rtols):
                error[row, column, layer] = np.abs(np.array(solve(scene, rtol)) / truth - 1.0).max()
                seconds[row, column, layer] = cost_of(amount, scene, rtol)
    dims = ("scene", "amount", "rtol")
    words = "largest relative error of time, stretch and field at failure, against five states at rtol 1e-12"
    return xr.Dataset(
        {
            "error": (dims, error, {"long_name": words, "units": "1"}),
            "seconds": (dims, seconds, {"long_name": "time per film", "units": "s"}),
        },
        {"scene": scenes, "amount": list(amounts), "rtol": rtols},
    )


def _history(scene: dict[str, float]) -> dm.LoadHistory:
    if "rate" not in scene:
        return dm.LoadHistory((0.0,), (scene["field"],))
    top = scene.get("field", 1.5 * RATIO**0.5)
    return dm.LoadHistory((0.0, top / scene["rate"]), (0.0, top))


def _timed(call: Callable[[], object]) -> float:
    """Return the shortest time of a few calls."""
    call()
    best, spent = np.inf, 0.0
    while spent < _SECONDS:
        start = perf_counter()
        call()
        taken = perf_counter() - start
        best, spent = min(best, taken), spent + taken
    return float(best)
