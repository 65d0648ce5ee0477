"""A field that falls: fixed steps and the paper's own form against steps in time that end on the stiffness.

A trapezoid without a hold, in two scenes. In the first the field is a little above that which the film survives, under
which it would touch the instability while the field falls, D = N = 0, a folded singularity. In the second the field is
1 % above, and the rate at which it falls varies.
"""

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from verdicts import WORDS

import dea_maps as dm

MODULUS_RATIO = 4.0
RISE = 20.0
SCENES = {
    "gap": ("field over that which is survived - 1", 1e-7, 0.1),
    "fall": ("rate of the fall (E/Ec per tau), 1 % above", 1e-3, 1.0),
}
FIXED = {"rk4 on rate": "rate", "rk4 on time": "time"}
ADAPTIVE = {
    "dopri5 on rate": {"method": "dopri5", "formulation": "rate"},
    "dop853 on rate": {"method": "dop853", "formulation": "rate"},
    "dop853 on time": {"method": "dop853", "formulation": "time"},
}
RESULTS = ("time_to_failure", "critical_stretch", "critical_field")
SURVIVES, FAILS_LATER, UNRESOLVED = 0, 1, 3
# As in the other maps: accurate within ten tolerances, or within 0.1 % with a fixed step.
TOLERANCES, FIXED_ERROR = 10.0, 1e-3
FALL, GAP = 0.2, 0.01


def films(scene: str, values: NDArray) -> dict[str, xr.DataArray]:
    """Return the parameters of the films along an axis."""
    fall = values if scene == "fall" else np.full_like(values, FALL)
    gap = values if scene == "gap" else np.full_like(values, GAP)
    one = {"modulus_ratio": MODULUS_RATIO, "rate": RISE, "hold_time": 0.0}
    known = {rate: dm.allowable(dm.Trapezoid(), "field", fall_rate=rate, rtol=1e-10, **one) for rate in set(fall)}
    survived = np.array([float(known[rate].allowable) for rate in fall])
    arrays = {"field": survived * (1.0 + gap), "fall_rate": fall}
    return {**{name: xr.DataArray(column, dims="film") for name, column in arrays.items()}, **one}


def verdicts(ds: xr.Dataset, truth: xr.Dataset, allowed: float) -> NDArray[np.int8]:
    """Return a verdict for every film."""
    error = np.max([np.abs(ds[name].values / truth[name].values - 1.0) for name in RESULTS], axis=0)
    kinds = np.where(error <= allowed, WORDS.index("accurate"), WORDS.index("inaccurate"))
    kinds[ds.outcome.values == SURVIVES] = WORDS.index("event_missed")
    kinds[ds.outcome.values == UNRESOLVED] = WORDS.index("step_collapsed")
    return kinds.astype(np.int8)


def measure(places: int, accuracies: int) -> xr.Dataset:
    """Return ``verdict`` (case, scene, accuracy, place), with ``step`` and ``tolerance`` along ``accuracy``."""
    steps, tolerances = np.geomspace(1e-5, 0.3, accuracies), np.geomspace(1e-9, 1e-3, accuracies)
    cases = [*FIXED, *ADAPTIVE]
    kinds = np.empty((len(cases), len(SCENES), accuracies, places), np.int8)
    axes = np.array([np.geomspace(low, high, places) for _, low, high in SCENES.values()])
    for j, name in enumerate(SCENES):
        given = films(name, axes[j])
        truth = dm.sweep(dm.Trapezoid(), **given, rtol=1e-10)
        if not (truth.outcome == FAILS_LATER).all():
            raise RuntimeError("a film of the scene does not fail, or is unresolved")
        for k in range(accuracies):
            for i, form in enumerate(FIXED.values()):
                ds = dm.sweep(dm.Trapezoid(), **given, method="rk4", formulation=form, step=steps[k])
                kinds[i, j, k] = verdicts(ds, truth, FIXED_ERROR)
            for i, how in enumerate(ADAPTIVE.values(), len(FIXED)):
                ds = dm.sweep(dm.Trapezoid(), **given, **how, rtol=tolerances[k])
                kinds[i, j, k] = verdicts(ds, truth, TOLERANCES * tolerances[k])
    flags = {"flag_values": np.arange(len(WORDS), dtype=np.int8), "flag_meanings": " ".join(WORDS)}
    return xr.Dataset(
        {
            "verdict": (("case", "scene", "accuracy", "place"), kinds, {"long_name": "what happened", **flags}),
            "place_value": (("scene", "place"), axes, {"long_name": "place along the axis of the scene"}),
            "step": ("accuracy", steps, {"long_name": "step of the fixed methods", "units": "1"}),
            "tolerance": ("accuracy", tolerances, {"long_name": "tolerance of the adaptive methods", "units": "1"}),
        },
        coords={"case": cases, "scene": list(SCENES)},
    )
