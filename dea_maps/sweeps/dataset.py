"""The data set of a sweep: variables, CF attributes and how they are stored."""

from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from .. import __version__
from ..nomenclature import BREAKDOWN, cf_attributes
from ..outcomes import Outcome, flag_attributes
from ..program_text import attributes_of
from ..programs import Program
from .grid import Grid
from .methods import Choice

if TYPE_CHECKING:
    from .solve import Solution


def cell_bytes(program: Program) -> int:
    """Return the bytes per cell of a data set in memory: outcome in one, every other variable in eight.

    Examples
    --------
    >>> from dea_maps.programs import Step
    >>> cell_bytes(Step())
    41
    """
    return 1 + 8 * (len(program.results) - 1)


LIMIT_BYTES = 1 + 8 * (len(BREAKDOWN) - 1)
"""The same of what a limit on the true field adds."""

_COMPRESSION = {"zlib": True, "complevel": 1, "shuffle": True, "fletcher32": True}
_PAPER = (
    "Zhao, Koh, Suo (2011): Nonequilibrium thermodynamics of dielectric elastomers, "
    "International Journal of Applied Mechanics 3(2), 203-217"
)


def provenance_of(choice: Choice) -> dict[str, str | float]:
    """Return how a sweep is computed, as global attributes of its data set."""
    given = {"rtol": choice.rtol, "step": choice.step}
    accuracy = {name: value for name, value in given.items() if value is not None}
    sharing = {"sharing": "product grid"} if choice.shared else {}
    return {"method": choice.method, "formulation": choice.formulation, **accuracy, **sharing}


def make_dataset(grid: Grid, solution: "Solution", provenance: Mapping[str, str | float]) -> xr.Dataset:
    """Wrap what a sweep found as a data set that describes itself, following CF-1.11 and ACDD-1.3.

    Parameters
    ----------
    grid : Grid
        The cells.
    solution : Solution
        One array of ``grid.shape`` per variable; they are wrapped, not copied.
    provenance : mapping of str to str or float
        How it was computed: ``method``, ``formulation``, and ``rtol`` or ``step``.

    Returns
    -------
    Dataset

    Examples
    --------
    >>> from dea_maps.programs import Step
    >>> from dea_maps.sweeps.grid import make_grid
    >>> from dea_maps.sweeps.solve import Solution
    >>> grid = make_grid(Step(), field=[0.8, 0.9], modulus_ratio=4.0)
    >>> nan = np.full(2, np.nan)
    >>> found = Solution(np.zeros(2, np.int8), nan, nan, nan, nan, np.array([1.05, 1.08]))
    >>> ds = make_dataset(grid, found, {"method": "quadrature", "formulation": "reduced", "rtol": 1e-6})
    >>> ds.outcome.attrs["flag_meanings"]
    'survives fails_later fails_at_once unresolved'
    """
    variables = {name: (grid.dims, values, _variable_attributes(name)) for name, values in solution.by_name().items()}
    return annotated(xr.Dataset(variables, grid.coords), grid, provenance, "Phase diagram")


def annotated(ds: xr.Dataset, grid: Grid, provenance: Mapping[str, str | float], kind: str) -> xr.Dataset:
    """Give a data set its global attributes and say how every variable is stored.

    Parameters
    ----------
    ds : Dataset
        Changed in place.
    grid : Grid
        The cells that it is about.
    provenance : mapping of str to str or float
        How it was computed, one attribute each.
    kind : str
        What it is, the first words of its title.

    Returns
    -------
    Dataset
        `ds` itself.
    """
    release = __version__
    program = grid.program.name
    # No date: the same sweep gives the same file, byte for byte.
    calls = [f"{name}={_in_words(grid.coords[name].values)}" for name in grid.parameters]
    calls += [f"{name}={value}" for name, value in provenance.items()]
    ds.attrs = {
        "Conventions": "CF-1.11, ACDD-1.3",
        "title": f"{kind} of a dielectric-elastomer actuator under the loading program {program}",
        "summary": "Electromechanical instability of a viscoelastic dielectric-elastomer film under equal "
        "biaxial stretch; fields normalised by the relaxed critical field, times by the relaxation time",
        "keywords": "dielectric elastomer, actuator, electromechanical instability, viscoelasticity",
        "source": f"dea_maps {release}, numerical integration of the model of the reference",
        "references": _PAPER,
        "history": f"dea_maps {release}: {program}, {', '.join(calls)}",
        **attributes_of(grid.program),
        **provenance,
        "dea_maps_version": release,
        "numba_version": _release("numba"),
        "numpy_version": np.__version__,
    }
    return with_storage(ds)


@cache
def _release(package: str) -> str:
    """Return the version of a package; reading it from the disk takes as long as a sweep of few cells."""
    return version(package)


def with_storage(ds: xr.Dataset) -> xr.Dataset:
    """Say how every variable of a data set is stored, in place, and return it.

    Examples
    --------
    >>> with_storage(xr.Dataset({"x": ("cell", [1.0, 2.0])})).x.encoding["zlib"]
    True
    """
    for name, variable in ds.variables.items():
        storage = _storage(variable)
        variable.encoding = {**storage, "_FillValue": None} if name in ds.coords else storage
    return ds


def with_maps(ds: xr.Dataset, maps: Mapping[str, xr.Variable]) -> xr.Dataset:
    """Return a data set with further maps, stored as its own are.

    Examples
    --------
    >>> ds = with_maps(xr.Dataset(), {"twice": xr.Variable("x", [2.0, 4.0])})
    >>> ds.twice.encoding["zlib"]
    True
    """
    added = ds.assign(maps)
    for name in maps:
        added[name].encoding = _storage(added[name].variable)
    return added


def _storage(variable: xr.Variable) -> dict[str, Any]:
    """Return how a map is stored."""
    kind = variable.dtype.kind
    fill = {"_FillValue": np.nan if kind == "f" else None}
    return {**fill, **(_COMPRESSION if variable.ndim > 0 and kind in "iuf" else {})}


def reduced(ds: xr.Dataset, variables: list[str], dtype: str) -> xr.Dataset:
    """Return the data set of a sweep with some of its variables, its maps in another precision.

    Parameters
    ----------
    ds : Dataset
        From `make_dataset`.
    variables : list of str
        The variables to keep.
    dtype : {"float64", "float32"}
        Type of the maps; ``outcome`` and the coordinates keep their types.

    Returns
    -------
    Dataset

    Examples
    --------
    >>> import dea_maps as dm
    >>> ds = dm.sweep(dm.Ramp(), rate=[0.1, 1.0], modulus_ratio=4.0)
    >>> reduced(ds, ["time_to_failure"], "float32").time_to_failure.dtype
    dtype('float32')
    """
    kept = ds[variables].copy(deep=False)
    for name, variable in kept.data_vars.items():
        if variable.dtype.kind == "f":
            kept[name] = variable.astype(dtype, copy=False).assign_attrs(variable.attrs)
            kept[name].encoding = variable.encoding
        if "outcome" not in kept:
            kept[name].attrs.pop("ancillary_variables", None)
    return kept


def _in_words(values: npt.NDArray[np.float64]) -> str:
    if values.size <= 1:
        return str(values.ravel().tolist()[0]) if values.size else "none"
    return f"{values.size} values from {values.min()} to {values.max()}"


def _variable_attributes(name: str) -> dict[str, Any]:
    if name != "outcome":
        return {**cf_attributes(name), "ancillary_variables": "outcome"}
    return {**cf_attributes(name), "standard_name": "status_flag", **flag_attributes(Outcome)}
