"""Chart of a fit: measured and fitted stress against stretch, a curve for each stretch rate."""

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure

from ..materials.uniaxial import uniaxial_stress
from .layout import add_heading, figure_of, new_axes

if TYPE_CHECKING:
    from ..materials.fit import UniaxialFit

_STYLES = (("#08306b", "o"), ("#d55e00", "s"), ("#4292c6", "^"), ("#7a3b00", "D"), ("#8a8a8a", "v"), ("#b2497a", "P"))
_NODES = 200


def draw_fit(fit: "UniaxialFit") -> Figure:
    """Draw measured points and fitted curves.

    Parameters
    ----------
    fit : UniaxialFit
        From `fit_uniaxial`.

    Returns
    -------
    Figure

    Examples
    --------
    >>> import dea_maps as dm, xarray as xr
    >>> stretch, rates = np.linspace(1.2, 4.0, 6), np.array([1e-3, 1e-2])
    >>> stress = 22.8e3 * uniaxial_stress(stretch, rates * 200.0, 3.85)
    >>> fit = dm.fit_uniaxial(xr.Dataset({"nominal_stress": (("stretch_rate", "stretch"), stress)},
    ...     {"stretch_rate": rates, "stretch": stretch}))
    >>> draw_fit(fit).axes[0].get_ylabel()
    'nominal stress (kPa)'
    """
    (ax,) = new_axes("column")
    material = fit.material
    rates = np.unique(fit.curves["stretch_rate"].values)
    stretch = np.linspace(1.0, float(fit.curves["stretch"].max()), _NODES)
    curves = material.relaxed_modulus * uniaxial_stress(
        stretch, rates * material.relaxation_time, material.modulus_ratio
    )
    handles: list[Artist] = []
    for index, (rate, curve) in enumerate(zip(rates, curves, strict=True)):
        colour, marker = _STYLES[index % len(_STYLES)]
        measured = fit.curves["stretch_rate"].values == rate
        reach = stretch <= fit.curves["stretch"].values[measured].max()
        ax.plot(stretch[reach], curve[reach] / 1e3, color=colour, lw=1.4)
        points = fit.curves.isel(point=measured)
        look: dict[str, Any] = {"ms": 4, "mfc": "white", "color": colour, "label": f"{rate:.3g}"}
        handles += ax.plot(points["stretch"], points["nominal_stress"] / 1e3, marker, **look)
    ax.set(xlabel=r"stretch $\lambda_1$", ylabel="nominal stress (kPa)")
    ax.grid(color="0.9", lw=0.5)
    ax.set_axisbelow(True)
    doubtful = [name.replace("_", " ") for name, known in fit.determined.items() if not known]
    title = [
        "points: measured",
        rf"lines: fit with $\mu_U$ = {material.unrelaxed_modulus / 1e3:.4g} kPa",
        rf"$\mu_R$ = {material.relaxed_modulus / 1e3:.4g} kPa",
        rf"$\tau$ = {material.relaxation_time:.4g} s",
        *([f"not determined: {', '.join(doubtful)}"] if doubtful else []),
    ]
    add_heading(ax, title, handles, "stretch rate (per s)")
    return figure_of(ax)
