"""The three axes of the atlas, the program that each method meets on them, and the truth."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from common.programs import PROGRAMS
from numpy.typing import NDArray

import dea_maps as dm

MODULUS_RATIO = 4.0
RATE = 1.0


@dataclass(frozen=True)
class Cells:
    """Parameters of the cells along an axis, and what becomes of them.

    Attributes
    ----------
    program : str
        Loading program.
    field, rate, modulus_ratio : (cells,) ndarray
        As a kernel takes them: zero where the program has no such parameter.
    truth : (3, cells) ndarray
        Time to failure, critical stretch, critical field.
    """

    program: str
    field: NDArray[np.float64]
    rate: NDArray[np.float64]
    modulus_ratio: NDArray[np.float64]
    truth: NDArray[np.float64]


@dataclass(frozen=True)
class Scene:
    """An axis of the atlas.

    Attributes
    ----------
    name : {"rate", "field", "modulus"}
        What varies: the rate of a ramp, field - 1 of a constant field, modulus ratio - 1.
    label : str
        Of the axis.
    lowest, highest : float
        Ends of the axis, which is logarithmic.
    preferred : tuple of str
        Programs in which to meet a method, the first that it serves.
    """

    name: str
    label: str
    lowest: float
    highest: float
    preferred: tuple[str, ...]

    def values(self, count: int) -> NDArray[np.float64]:
        """Values along the axis."""
        return np.geomspace(self.lowest, self.highest, count)

    def program(self, served: Sequence[str]) -> str | None:
        """Name of the program in which a method is met that serves these."""
        return next((name for name in self.preferred if name in served), None)

    def cells(self, program: str, values: NDArray[np.float64]) -> Cells:
        """Cells at values along the axis, with the truth by the method that picks itself, at rtol 1e-12."""
        nothing = np.zeros(values.size)
        ratio = 1.0 + values if self.name == "modulus" else nothing + MODULUS_RATIO
        rate = values if self.name == "rate" else nothing + RATE
        # Where the modulus ratio varies, a constant field halfway, in logarithms, between critical and instant failure.
        field = 1.0 + values if self.name == "field" else ratio**0.25
        given = {"modulus_ratio": ratio}
        if program != "ramp":
            given["field"] = field
        if program != "step":
            given["rate"] = rate
        arrays = {name: xr.DataArray(column, dims="cell") for name, column in given.items()}
        ds = dm.sweep(PROGRAMS[program], rtol=1e-12, **arrays)
        truth = np.array([ds[name].values for name in ("time_to_failure", "critical_stretch", "critical_field")])
        return Cells(program, given.get("field", nothing), given.get("rate", nothing), ratio, truth)


SCENES = (
    Scene("rate", "ramp rate (E/Ec per tau)", 1e-6, 1e5, ("ramp",)),
    Scene("field", "constant field - 1 (E/Ec)", 1e-12, 0.9, ("step", "ramp_hold")),
    Scene("modulus", "modulus ratio - 1", 1e-6, 999.0, ("ramp", "step")),
)
