"""What a cell costs on a product grid, whose ramps and holds are integrated once for all cells that share them."""

from dataclasses import replace

import measure
import numpy as np
from common.internals import choose, make_grid, solve
from scenes import Cases
from truth import ramp_hold

import dea_maps as dm

RTOLS = (1e-6, 1e-10)
SAMPLE = 200


def show(quick: bool) -> None:
    """Print time per cell of ramps that hold, shared and each by itself, and the error on a sample of the cells."""
    side = 3 if quick else 10
    fields, rates = np.linspace(1.02, 2.2, 40 if quick else 1000), np.geomspace(1e-2, 1e2, side)
    ratios = np.geomspace(1.5, 10.0, side)
    grid = make_grid(dm.RampHold(), field=fields, rate=rates, modulus_ratio=ratios)
    given = {name: values.ravel() for name, values in grid.parameters.items()}
    which = np.linspace(0, given["field"].size - 1, SAMPLE).astype(int)
    true, _ = ramp_hold(Cases(*(given[name][which] for name in ("field", "rate", "modulus_ratio"))))
    print(f"\nramp_hold on {fields.size} x {side} x {side} cells, field x rate x modulus_ratio; one thread\n")
    print("| rtol | shared, µs a cell | each by itself | ratio | error of the shared, on a sample |")
    print("|---|---|---|---|---|")
    for rtol in RTOLS:
        choice = choose(grid.program, "auto", "auto", rtol, None)
        seconds = []
        for shared in (True, False):

            def go(choice: object = replace(choice, shared=shared)) -> object:
                return solve(grid.program, grid.parameters, choice, threads=1)

            found = go()  # which may compile
            seconds.append(min(measure.seconds_of(go) for _ in range(measure.REPEATS)) / given["field"].size)
            if shared:
                error = np.max(np.abs(found.time_to_failure.ravel()[which] / true - 1.0))
        times = " | ".join(f"{1e6 * second:.3f}" for second in seconds)
        print(f"| {rtol:.0e} | {times} | {seconds[1] / seconds[0]:.1f} | {error:.1e} |")
    print()
