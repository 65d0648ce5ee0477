"""How well the fold's and the bottleneck's laws tell where the maps on the rate form change colour."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from verdicts import ACCURATE, FIXED, INACCURATE, WRONG_BRANCH

ANSWERED = (ACCURATE, INACCURATE, WRONG_BRANCH)


def _along(x: NDArray[np.float64], known: xr.Dataset, name: str) -> NDArray[np.float64]:
    """Interpolate a law at places along an axis."""
    return np.exp(np.interp(np.log(x), np.log(known.value), np.log(known[name])))


def print_fold(fixed: xr.Dataset, theory: dict[str, xr.Dataset]) -> None:
    """Print how accurate the answers of fixed steps are on either side of the fold's law, as a Markdown table."""
    print("\nFixed steps on the rate form: answers within 1 % and within 0.1 %, by the side of the fold's law\n")
    print("| method | shorter: answers | within 1 % | within 0.1 % | longer: answers | within 1 % | within 0.1 % |")
    print("|---|---|---|---|---|---|---|")
    for case in (name for name in fixed.case.values if name.endswith("rate")):
        sides: tuple[list, list] = ([], [])
        for scene, known in theory.items():
            part = fixed.sel(case=case, scene=scene)
            shorter = part.accuracy.values[:, np.newaxis] < _along(part.place_value.values, known, "fold")
            answered = np.isin(part.verdict.values, ANSWERED)
            for side, where in zip(sides, (shorter, ~shorter), strict=True):
                side.extend(part.error.values[answered & where])
        cells = [f"{len(side)} | {np.mean(np.array(side) < 0.01):.0%} | {np.mean(np.array(side) < FIXED):.0%}"
                 for side in sides if side]  # fmt: skip
        print(f"| {case} |", " | ".join(cells), "|")


def print_silence(data: xr.Dataset, theory: dict[str, xr.Dataset]) -> None:
    """Print below which tolerance nothing is answered, over the fold's law, and accurate cells by the margin."""
    cases = [name for name in data.case.values if name.endswith("rate")]
    if not cases:
        return
    print("\nTolerance below which nothing is answered, over the fold's law; accurate cells under a constant field\n")
    print("| method | least | median | largest | tolerance above the margin | below |\n|---|---|---|---|---|---|")
    for case in cases:
        ratios = []
        for scene, known in theory.items():
            part = data.sel(case=case, scene=scene)
            law = _along(part.place_value.values, known, "collapse")
            answered = np.isin(part.verdict.values, ANSWERED)
            some = answered.any(axis=0)
            first = part.accuracy.values[answered.argmax(axis=0)]
            ratios.extend((first / law)[some & ~answered[0]])
        part = data.sel(case=case, scene="field")
        above = part.accuracy.values[:, np.newaxis] > 2.0 * part.place_value.values
        accurate = part.verdict.values == ACCURATE
        spread = [f"{value:.2g}" for value in np.quantile(ratios, (0.0, 0.5, 1.0))] if ratios else ["-"] * 3
        shares = [f"{accurate[where].mean():.0%} of {np.count_nonzero(where)}" for where in (above, ~above)]
        print(f"| {case} |", " | ".join(spread + shares), "|")
