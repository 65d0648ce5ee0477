"""What a film does at failure, over one parameter, as in Figs. 5 and 6 of the paper."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from ..outcomes import Outcome
from ..sweeps.chunks import evenly
from ..sweeps.dead_load import has_dead_load
from .boundaries import boundary_of
from .choices import check_choice
from .data import drawable, on_log_axis, parameters_along, sizes_in_words
from .layout import add_heading, axes_for, line_width
from .plane import BREAKS_DOWN, regions_of
from .style import curve_style
from .units import Shown, shown, title_of, units_of

VARIABLES = ("time_to_failure", "critical_stretch", "critical_field")
"""What `failure_curves` can draw."""

_MOST_CURVES = 6
_SUDDEN = 2.0 ** (1.0 / 3.0)
"""Stretch at failure of a film whose dashpot has not moved, (25)."""


def failure_curves(
    ds: xr.Dataset,
    ax: Axes | None = None,
    *,
    variable: str = "time_to_failure",
    over: str | None = None,
    units: str | None = None,
    size: str = "column",
) -> Axes:
    r"""Draw what a film does at failure over one parameter, a curve for each of up to six values of another.

    Few computed values are points, joined by dotted lines only to guide the eye; many are curves. Where electrical
    breakdown comes first there is neither. Dashed lines are limits of the theory: the largest value that is survived,
    and without a dead load the stretch and the field at failure of very slow or very fast loading.

    Parameters
    ----------
    ds : Dataset
        From `dea_maps.sweep` or `dea_maps.physical`, with one or two dimensions longer than 1.
    ax, units, size
        As in `dea_maps.charts.phase_diagram`.
    variable : {"time_to_failure", "critical_stretch", "critical_field"}
        What to draw.
    over : str, optional
        Over which parameter; by default the first that varies.

    Returns
    -------
    Axes

    Raises
    ------
    TypeError, ValueError
        If the data set is not a map over one or two parameters, or lacks `variable` or ``outcome``; if an option is not
        one of those allowed.

    Examples
    --------
    >>> import dea_maps as dm, numpy as np
    >>> ds = dm.sweep(dm.Ramp(), rate=np.geomspace(1e-3, 1e3, 25), modulus_ratio=[2.0, 4.0])
    >>> failure_curves(ds, variable="critical_stretch").get_ylabel()
    'critical stretch $\\lambda$'
    """
    check_choice("variable", variable, VARIABLES)
    ds = drawable(ds, variable, what="a chart of failure curves")
    along = parameters_along(ds)
    if along is None or len(along) not in (1, 2):
        raise ValueError(
            "a chart of failure curves needs one or two dimensions, each along one parameter; got "
            f"{sizes_in_words(ds)}: select values with ds.sel or ds.isel"
        )
    names = list(along.values())
    if over is None:
        over = names[0]
    check_choice("over", over, names)
    units = units_of(ds, units)
    ax = axes_for(ax, size)
    ds = ds.sortby(over)
    x, y = shown(ds, over, units), shown(ds, variable, units)
    # At once is at time 0, which a logarithmic axis does not have.
    regions = ds["outcome"].copy(data=regions_of(ds))
    fails = regions == Outcome.FAILS_LATER if variable == "time_to_failure" else regions != BREAKS_DOWN
    values = y.values.where(fails)
    log = on_log_axis(np.unique(x.values))
    ax.set(xlabel=x.label, ylabel=y.label, xscale="log" if log else "linear")
    ax.set_xlim(float(x.values.min()), float(x.values.max()))
    if float(values.max()) > 10.0 * float(values.min()) > 0.0:
        ax.set_yscale("log")
    others = [name for name in names if name != over]
    heading = _draw_curves(ax, x, values, shown(ds, others[0], units) if others else None)
    _draw_limits(ax, ds, variable, over, x, y)
    handles = [line for line in ax.lines if not str(line.get_label()).startswith("_")]
    add_heading(ax, title_of(ds, units), handles, heading)
    return ax


def _draw_curves(ax: Axes, x: Shown, values: xr.DataArray, other: Shown | None) -> str:
    """Draw a curve for each of some values of the other parameter; return what a legend says of them."""
    if other is None:
        ax.plot(x.values, values, **curve_style(ax, 0, 1, x.values.size))
        return ""
    dim = str(other.values.dims[0])
    _, rising = np.unique(other.values, return_index=True)
    rising = rising[values.notnull().any(x.values.dims).values[rising]]
    chosen = rising[evenly(len(rising), _MOST_CURVES)]
    for number, index in enumerate(chosen):
        style = curve_style(ax, number, len(chosen), x.values.size)
        ax.plot(x.values, values.isel({dim: index}), label=f"{float(other.values[index]):.4g}", **style)
    return other.label


def _draw_limits(ax: Axes, ds: xr.Dataset, variable: str, over: str, x: Shown, y: Shown) -> None:
    """Draw the limits of the theory that lie on the chart, or near its edge."""
    look: dict[str, Any] = {"color": "0.35", "linewidth": line_width(ax, 1.0), "zorder": 1.5}
    along = parameters_along(ds)
    boundary = boundary_of(ds, tuple(along.values())) if along is not None else None
    if boundary is not None and boundary.parameter == over:
        words = "largest survived"
        for survived in np.unique((x.per(ds[over]) * boundary.limits.survived).round(12)):
            if ax.get_xlim()[0] < survived < ax.get_xlim()[1]:
                ax.axvline(survived, label=words, linestyle="-.", **look)
                words = "_"
    if has_dead_load(map(str, ds.coords)):
        return
    if variable == "critical_stretch":
        ax.axhline(_SUDDEN, label="sudden: $2^{1/3}$", linestyle="--", **look)
    if variable == "critical_field":
        critical = y.per(ds["critical_field"])
        ax.axhline(critical, label="slow: $E_c$", linestyle=":", **look)
        sudden = critical * np.sqrt(ds["modulus_ratio"])
        words = r"sudden: $E_c\sqrt{\mu_U/\mu_R}$"
        if over == "modulus_ratio":
            ax.plot(x.values, sudden, label=words, linestyle="--", **look)
            return
        levels = np.unique(sudden)
        for level in levels[evenly(len(levels), _MOST_CURVES)]:
            if level <= 1.1 * float(y.values.max()):
                ax.axhline(level, label=words, linestyle="--", **look)
                words = "_"
