"""What is asked of a sweep, and the one checked way from there to a grid of cells and how it is solved."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..limits.breakdown import rtol_of
from ..materials.material import Material
from ..materials.scales import scales
from ..materials.si_units import Film, film_of, warn_film
from ..materials.strength import check_strength
from ..nomenclature import KINDS
from ..plausibility import warn_implausible
from ..programs import Program
from ..sweeps.dead_load import has_dead_load
from ..sweeps.grid import Grid, kinds_taken, make_grid
from ..sweeps.loading import loading_time
from ..sweeps.methods import Choice, choose
from ..sweeps.product import product_of
from ..sweeps.ratios import in_ratios
from ..sweeps.solve import sharing_pays

# To this stretch a breakdown strength is checked before computing; farther, as films get there.
_LOOKED_AT = np.array([2.0])


class Planned(NamedTuple):
    """A request that is checked: what will be computed, and how.

    Attributes
    ----------
    grid : Grid
        The cells.
    choice : Choice
        How they are solved; shared if method and formulation are left to "auto", the sweep is a product grid, see
        `dea_maps.sweeps.product.product_of`, and `dea_maps.sweeps.solve.sharing_pays`.
    film : Film or None
        The film whose volts and seconds are added.
    """

    grid: Grid
    choice: Choice
    film: Film | None


@dataclass(frozen=True, eq=False)
class Request:
    """What is asked of a sweep: the arguments that `sweep`, `trajectory` and `sweep_to_netcdf` have in common.

    Attributes
    ----------
    program : Program
        The loading program.
    parameters : mapping of str to number, array or DataArray
        Those of the program and the film by name, as ratios or, with a film, in SI units; None counts as left out.
    rtol, method, formulation, step
        As in `dea_maps.sweep`.
    material, thickness : Material and float, or None
        The film; both or none.
    """

    program: Program
    parameters: Mapping[str, Any]
    rtol: float = 1e-6
    method: str = "auto"
    formulation: str = "auto"
    step: float | None = None
    material: Material | None = None
    thickness: float | None = None

    def planned(self) -> Planned:
        """Return what will be computed, with everything checked and nothing computed.

        Raises
        ------
        TypeError, ValueError
            As in `dea_maps.sweep`.

        Examples
        --------
        >>> from dea_maps.programs import Step
        >>> plan = Request(Step(), {"field": [0.9, 1.2], "modulus_ratio": 4.0}, method="dopri5").planned()
        >>> plan.grid.cells, plan.choice.method
        (2, 'dopri5')
        """
        kinds = kinds_taken(self.program)
        film = film_of(self.material, self.thickness)
        ratios = in_ratios(kinds, self.parameters, film)
        if film is not None:
            ratios.setdefault("modulus_ratio", film.material.modulus_ratio)
            for name, kind in self.program.kinds.items():
                twin = KINDS[kind].twin(name)
                if name not in ratios and twin is not None:
                    raise ValueError(f"{name} or {twin} is missing for the program {self.program.name!r}")
        grid = make_grid(self.program, **ratios)
        endless = self.program.repeats != 1
        if endless and grid.cells and not (loading_time(self.program, grid.parameters) > 0.0).all():
            name = self.program.name
            raise ValueError(f"the repeated pieces of the program {name!r} must take time; got a duration of 0")
        dead_load = has_dead_load(grid.parameters)
        choice = choose(self.program, self.method, self.formulation, self.rtol, self.step, dead_load)
        if self.method == self.formulation == "auto" and grid.cells:
            product = product_of(self.program, grid.parameters)
            choice = replace(choice, shared=product is not None and sharing_pays(product, self.rtol))
        if film is not None and film.limited:
            rtol_of(choice)
            check_strength(film.material.strength, _LOOKED_AT)
        if grid.cells:
            _warn(grid, film)
        return Planned(grid, choice, film)


def _warn(grid: Grid, film: Film | None) -> None:
    """Warn of what is implausible in a sweep, and in volts for a film."""
    if film is not None:
        warn_film(*film)
    most = float(grid.coords["modulus_ratio"].values.max()) ** 0.5
    for name, kind in grid.program.kinds.items():
        values = grid.coords[name].values
        if kind == "field":
            warn_implausible("field", values, scale=most)
        if film is None:
            continue
        if kind == "field" and values.max() > 0.0:
            warn_implausible("voltage", values.max(), scales(*film, field=values.max()))
        elif kind == "rate":
            warn_implausible("rate", values, scales(*film, rate=values))
