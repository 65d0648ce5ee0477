"""Trajectories of the general model: films under any stresses, or stretches, and field."""

from math import inf

import numpy as np
import numpy.typing as npt
import scipy
import xarray as xr

from .. import __version__
from ..checks import brief
from ..nomenclature import KINDS, Kind, cf_attributes
from ..outcomes import GeneralLimit, Outcome, flag_attributes, words_of
from ..sweeps.parameters import check_values, checked_times
from .film import Loads, Result, integrated, sampled, tension_loss
from .free_energy import CRITICAL_FIELD, State, det_hessian, dissipation_rate, equations_of_state, free_energy
from .integrate import DISSIPATED, TIME, WORK
from .load_history import Load, as_history

_STRESS, _STRETCH = Kind(-inf), Kind(0.0, included=False)
_TIGHTEST, _LOOSEST = 1e-12, 1e-3


def general_trajectory(
    *,
    time: npt.ArrayLike | xr.DataArray,
    modulus_ratio: float,
    field: Load = 0.0,
    stress_1: Load | None = None,
    stress_2: Load | None = None,
    stretch_1: Load | None = None,
    stretch_2: Load | None = None,
    rtol: float = 1e-8,
) -> xr.Dataset:
    """Follow one film of the general model in time, up to its failure.

    Solves the rate equations (12) with the flow (21), (22) of Zhao, Koh and Suo (2011) for the free energy (17),
    from the reference state up to the time at which the determinant of the Hessian (13) vanishes, (14). In each
    direction of the plane either the nominal stress or the stretch is prescribed; by default there is no stress.
    Loads that change suddenly at the same time do so in proportion, while the dashpot stands still.

    Parameters
    ----------
    time : number, 1-D array or DataArray along one dimension
        When to look, in relaxation times since the loading began; at least 0. Where a load changes suddenly, the
        new load is on.
    modulus_ratio : float
        Unrelaxed over relaxed shear modulus, at least 1.
    field : float or LoadHistory
        Nominal field normalised by the relaxed critical field, at least 0. A number acts from time 0 on.
    stress_1, stress_2 : float or LoadHistory, optional
        Nominal stresses, dead loads, normalised by the relaxed shear modulus; negative where they compress.
    stretch_1, stretch_2 : float or LoadHistory, optional
        Stretches, above 0, where they are prescribed instead. Failure is then that of what is left free: the
        Hessian without the rows and columns of a prescribed stretch.
    rtol : float
        Relative error allowed in the results, from 1e-12 to 1e-3.

    Returns
    -------
    Dataset
        Along ``time``, NaN after failure: ``stretch_1``, ``stretch_2``, ``internal_stretch_1``,
        ``internal_stretch_2``, ``electric_displacement`` in ``sqrt(eps mu_R)``, ``stress_1`` and ``stress_2`` in
        ``mu_R``, ``applied_field`` in ``Ec``, ``det_hessian`` of the whole of (13) in ``mu_R**2/eps``,
        ``dissipation_rate`` (11) in ``mu_R/tau``, and ``stored_energy`` (17), ``work`` of the loads and
        ``dissipated_energy`` since the loading began, in ``mu_R`` per volume, of which by the first law the last
        two differ by the first. Without a dimension: ``outcome`` and ``time_to_failure`` as in `sweep`;
        ``critical_stretch_1``, ``critical_stretch_2``, ``critical_internal_stretch_1``,
        ``critical_internal_stretch_2``, ``critical_field`` at failure, NaN where there is none; and
        ``final_stretch_1``, ``final_stretch_2`` where the film survives: where its dashpot comes to rest in a
        stable state under loads that no longer change. What does neither in a bounded number of steps is
        unresolved, as is a film of which this accuracy cannot tell whether it becomes unstable before or after a
        load changes.

    Raises
    ------
    TypeError, ValueError
        If an argument is of the wrong kind or out of bounds, or both stress and stretch are given in one
        direction; before computing.

    Examples
    --------
    >>> import dea_maps as dm
    >>> ds = dm.general_trajectory(time=[0.0, 1.0, 3.0], field=1.2, modulus_ratio=4.0)
    >>> [f"{stretch:.3f}" for stretch in ds.stretch_2.values]
    ['1.034', '1.177', 'nan']
    >>> frame = dm.general_trajectory(time=1.0, field=0.5, stretch_1=1.0, stretch_2=1.0, modulus_ratio=4.0)
    >>> frame.first_limit.attrs["flag_meanings"].split()[int(frame.first_limit)]
    'tension_loss'
    >>> pull = dm.LoadHistory(times=(0.0, 10.0), values=(1.0, 3.0))  # stretched at 0.2 per relaxation time
    >>> ds = dm.general_trajectory(time=[5.0, 10.0], stretch_1=pull, modulus_ratio=4.0)
    >>> [f"{stress:.3f}" for stress in ds.stress_1.values]
    ['2.231', '3.316']
    """
    times = checked_times(time).values
    ratio = _number("modulus_ratio", modulus_ratio)
    check_values("modulus_ratio", np.array(ratio), KINDS["ratio"])
    tolerance = _number("rtol", rtol)
    if not _TIGHTEST <= tolerance <= _LOOSEST:
        raise ValueError(f"rtol must be from {_TIGHTEST:g} to {_LOOSEST:g}; got {tolerance:g}")
    given = ((stress_1, stretch_1), (stress_2, stretch_2))
    directions = []
    for number, (stress, stretch) in enumerate(given, start=1):
        if stretch is None:
            directions.append(as_history(f"stress_{number}", 0.0 if stress is None else stress, _STRESS))
        elif stress is None:
            directions.append(as_history(f"stretch_{number}", stretch, _STRETCH))
        else:
            raise ValueError(
                f"stress_{number} must not be given with stretch_{number}: one of them follows from the other; "
                f"got {brief(stress)}"
            )
    history = as_history("field", field, KINDS["field"])
    loads = Loads(directions[0], directions[1], history, (stretch_1 is not None, stretch_2 is not None))
    result = integrated(loads, ratio - 1.0, tolerance)
    ds = _dataset(result, times, ratio, tension_loss(result, loads, ratio - 1.0, tolerance))
    names = [f"{'stretch' if held else 'stress'}_{number}" for number, held in enumerate(loads.held, start=1)]
    prescribed = {name: str(load) for name, load in zip(names, directions, strict=True)} | {"field": str(history)}
    return _annotated(ds, {f"prescribed_{name}": load for name, load in prescribed.items()}, tolerance)


def _number(name: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        raise TypeError(f"{name} must be a real number; got {brief(value)}")
    return float(value)


def _dataset(result: Result, times: npt.NDArray[np.float64], ratio: float, slack: float) -> xr.Dataset:
    """Return the states of a film at times, its outcome, and the time of its loss of tension."""
    rows, p = sampled(result, times), ratio - 1.0
    state = State(*rows[:TIME])
    stress_1, stress_2, field = equations_of_state(state, p)
    along = {
        "stretch_1": state.stretch_1,
        "stretch_2": state.stretch_2,
        "internal_stretch_1": state.internal_stretch_1,
        "internal_stretch_2": state.internal_stretch_2,
        "electric_displacement": state.electric_displacement,
        "stress_1": stress_1,
        "stress_2": stress_2,
        "applied_field": field / CRITICAL_FIELD,
        "det_hessian": det_hessian(state, p),
        "dissipation_rate": dissipation_rate(state, p),
        "stored_energy": free_energy(state, p),
        "work": rows[WORK],
        "dissipated_energy": rows[DISSIPATED],
    }
    end, outcome = result.end, words_of(Outcome)[result.outcome]
    failed = outcome.startswith("fails")
    last = State(*end[:TIME].tolist())
    at_failure = {
        "time_to_failure": end[TIME],
        "critical_stretch_1": last.stretch_1,
        "critical_stretch_2": last.stretch_2,
        "critical_internal_stretch_1": last.internal_stretch_1,
        "critical_internal_stretch_2": last.internal_stretch_2,
        "critical_field": equations_of_state(last, p)[2] / CRITICAL_FIELD,
    }
    at_rest = {"final_stretch_1": last.stretch_1, "final_stretch_2": last.stretch_2}
    at_limit = {"survives": "none", "unresolved": "unresolved"}.get(outcome, "instability")
    limit = words_of(GeneralLimit).index(at_limit if np.isnan(slack) else "tension_loss")
    numbers = {name: value if failed else np.nan for name, value in at_failure.items()}
    numbers |= {name: value if outcome == "survives" else np.nan for name, value in at_rest.items()}
    described = {**cf_attributes("outcome"), "standard_name": "status_flag", **flag_attributes(Outcome)}
    numbers["time_to_tension_loss"] = slack
    coords = {
        "time": ("time", times, cf_attributes("time")),
        "modulus_ratio": ((), ratio, cf_attributes("modulus_ratio")),
    }
    return xr.Dataset(
        {
            "outcome": ((), np.int8(result.outcome), described),
            "first_limit": ((), np.int8(limit), {**cf_attributes("first_limit"), **flag_attributes(GeneralLimit)}),
            **{name: ("time", values, cf_attributes(name)) for name, values in along.items()},
            **{name: ((), np.float64(value), cf_attributes(name)) for name, value in numbers.items()},
        },
        coords,
    )


def _annotated(ds: xr.Dataset, prescribed: dict[str, str], rtol: float) -> xr.Dataset:
    """Give a data set its global attributes and say how every variable is stored."""
    release = __version__
    loads = ", ".join(f"{name}={load}" for name, load in prescribed.items())
    ds.attrs = {
        "Conventions": "CF-1.11, ACDD-1.3",
        "title": "Trajectory of a dielectric-elastomer film under prescribed stresses or stretches and field",
        "summary": "Viscoelastic dielectric-elastomer film at unequal stretches up to electromechanical instability; "
        "stresses normalised by the relaxed shear modulus, fields by the relaxed critical field, times by the "
        "relaxation time",
        "keywords": "dielectric elastomer, actuator, electromechanical instability, viscoelasticity",
        "source": f"dea_maps {release}, numerical integration of the general model of the reference",
        "references": "Zhao, Koh, Suo (2011): Nonequilibrium thermodynamics of dielectric elastomers, "
        "International Journal of Applied Mechanics 3(2), 203-217, sections 2 to 4",
        "history": f"dea_maps {release}: general_trajectory, {loads}, rtol={rtol}",
        **prescribed,
        "rtol": rtol,
        "dea_maps_version": release,
        "numpy_version": np.__version__,
        "scipy_version": scipy.__version__,
    }
    for variable in ds.variables.values():
        variable.encoding = {"_FillValue": None}
    for array in ds.data_vars.values():
        if array.dtype.kind == "f":
            array.encoding["_FillValue"] = np.nan
    return ds
