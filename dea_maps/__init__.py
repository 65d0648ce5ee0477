"""Phase diagrams of dielectric-elastomer actuators: when, and at what stretch, a film collapses.

Examples
--------
>>> import dea_maps as dm
>>> ds = dm.sweep(dm.Step(), field=[0.9, 1.2], modulus_ratio=4.0)
>>> [round(float(stretch), 6) for stretch in ds.critical_stretch]
[nan, 1.659355]
"""

from pathlib import Path
from typing import TYPE_CHECKING

# In a checkout the kernels lie beside this folder: they are found there whatever is installed, and if nothing is.
if (_beside := Path(__file__).parent.parent / "kernels" / "_jit.py").is_file():
    __path__.append(str(_beside.parent.parent))

# The one place of the version: the metadata of an installed copy are made from it.
__version__ = "0.1.0"

__all__ = [
    "VHB",
    "ImplausibleWarning",
    "LoadHistory",
    "Material",
    "Ramp",
    "RampHold",
    "Step",
    "__version__",
    "allowable_field",
    "allowable_rate",
    "breakdown",
    "charts",
    "design",
    "explore",
    "fit_uniaxial",
    "general_trajectory",
    "methods",
    "open",
    "physical",
    "reachable_stretch",
    "read_design",
    "read_material",
    "sweep",
    "sweep_to_netcdf",
    "trajectory",
]

if TYPE_CHECKING:
    from . import charts
    from .catalogue import methods
    from .designing import design, read_design
    from .disk import sweep_to_netcdf
    from .explorer import explore
    from .first_limit import breakdown
    from .fitting import fit_uniaxial
    from .general import general_trajectory
    from .inverse import allowable_field, allowable_rate, reachable_stretch
    from .load_history import LoadHistory
    from .material import VHB, Material
    from .material_table import read_material
    from .opening import open
    from .plausibility import ImplausibleWarning
    from .programs import Ramp, RampHold, Step
    from .si_units import physical
    from .sweeping import sweep
    from .trajectories import trajectory
else:
    # Imported at first use: ``import dea_maps`` and ``dea-maps --help`` wait for no library.
    _HOME = {
        "ImplausibleWarning": "plausibility",
        "LoadHistory": "load_history",
        "Material": "material",
        "Ramp": "programs",
        "RampHold": "programs",
        "Step": "programs",
        "VHB": "material",
        "allowable_field": "inverse",
        "allowable_rate": "inverse",
        "breakdown": "first_limit",
        "design": "designing",
        "explore": "explorer",
        "fit_uniaxial": "fitting",
        "general_trajectory": "general",
        "methods": "catalogue",
        "open": "opening",
        "physical": "si_units",
        "reachable_stretch": "inverse",
        "read_design": "designing",
        "read_material": "material_table",
        "sweep": "sweeping",
        "sweep_to_netcdf": "disk",
        "trajectory": "trajectories",
    }

    def __getattr__(name: str) -> object:
        """Return a public name, imported at its first use."""
        if name == "charts":
            from importlib import import_module

            value = import_module(".charts", __name__)
        elif name in _HOME:
            from importlib import import_module

            value = getattr(import_module(f".{_HOME[name]}", __name__), name)
        else:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        globals()[name] = value
        return value

    def __dir__() -> list[str]:
        """Return the public names, imported or not, beside the usual ones."""
        return sorted({*globals(), *__all__})
