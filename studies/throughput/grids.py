"""The grids: a map of every program, of any number of cells; of ramps that are held also as scattered films."""

import numpy as np
import xarray as xr
from common.programs import PROGRAMS
from numpy.typing import NDArray

RATIOS = 10
SCATTERED = "ramp_hold scattered"
GRIDS = {**PROGRAMS, SCATTERED: PROGRAMS["ramp_hold"]}


def parameters(name: str, cells: int) -> dict[str, NDArray[np.float64] | xr.DataArray]:
    """Return a grid with 10 modulus ratios from 2 to 6; every film of it fails later, none survives, none at once."""
    if name == SCATTERED:
        columns = zip(("field", "rate", "modulus_ratio"), flat("ramp_hold", cells), strict=True)
        return {parameter: xr.DataArray(values, dims="film") for parameter, values in columns}
    return axes(name, cells)


def axes(program: str, cells: int) -> dict[str, NDArray[np.float64]]:
    """Return the values of every parameter of a grid."""
    ratio = np.linspace(2.0, 6.0, RATIOS)
    rest = max(cells // RATIOS, 1)
    if program == "step":
        return {"field": np.linspace(1.01, 1.4, rest), "modulus_ratio": ratio}
    if program == "ramp":
        return {"rate": np.geomspace(1e-3, 1e3, rest), "modulus_ratio": ratio}
    side = max(round(rest**0.5), 1)
    return {
        "field": np.linspace(1.01, 2.2, side),
        "rate": np.geomspace(1e-3, 1e3, max(rest // side, 1)),
        "modulus_ratio": ratio,
    }


def flat(program: str, cells: int) -> list[NDArray[np.float64]]:
    """Return field, rate and modulus ratio of every cell, as a kernel takes them: zero where there is none."""
    given = axes(program, cells)
    columns = dict(zip(given, (part.ravel() for part in np.meshgrid(*given.values(), indexing="ij")), strict=True))
    zero = np.zeros(columns["modulus_ratio"].size)
    return [np.ascontiguousarray(columns.get(name, zero)) for name in ("field", "rate", "modulus_ratio")]
