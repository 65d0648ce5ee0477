"""Phase diagrams of dielectric-elastomer actuators: when, and at what stretch, a film loses its stability.

The public names; every other module is private::

    Step, Ramp, RampHold, Pulse, Trapezoid, Overdrive         loading programs
    PulseTrain, TriangleTrain, BiasedSine, Waveform           loading programs that may be repeated
    Sequence of Hold, Linear, Jump, Sine; Share               programs of one's own, from pieces
    sweep, sweep_to_netcdf, open, merge                       maps, in memory and in files
    trajectory, general_trajectory, LoadHistory               films in time, also under unequal stresses
    methods                                                   how a sweep is computed
    allowable, allowable_field, allowable_rate                inverse questions
    reachable_stretch                                         how far a film gets
    breakdown                                                 electrical breakdown beside the instability
    Material, VHB, read_material, fit_uniaxial                materials
    physical, ImplausibleWarning                              volts and seconds, values of the wrong unit
    design, read_design                                       allowable voltages
    charts, explore                                           figures, interactive HTML pages

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

# What `help` shows; it also lists the folders, as pydoc does of every package.
__all__ = [
    "VHB",
    "BiasedSine",
    "Hold",
    "ImplausibleWarning",
    "Jump",
    "Linear",
    "LoadHistory",
    "Material",
    "Overdrive",
    "Pulse",
    "PulseTrain",
    "Ramp",
    "RampHold",
    "Sequence",
    "Share",
    "Sine",
    "Step",
    "Trapezoid",
    "TriangleTrain",
    "Waveform",
    "__version__",
    "allowable",
    "allowable_field",
    "allowable_rate",
    "breakdown",
    "charts",
    "design",
    "explore",
    "fit_uniaxial",
    "general_trajectory",
    "merge",
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
    from .explorer.export import explore
    from .files.to_netcdf import sweep_to_netcdf
    from .files.verify import open
    from .general.load_history import LoadHistory
    from .general.run import general_trajectory
    from .limits.allowable import allowable
    from .limits.breakdown import breakdown
    from .limits.inverse import allowable_field, allowable_rate, reachable_stretch
    from .limits.voltages import design, read_design
    from .materials.fit import fit_uniaxial
    from .materials.material import VHB, Material
    from .materials.si_units import physical
    from .materials.toml import read_material
    from .pieces import Hold, Jump, Linear, Share, Sine
    from .plausibility import ImplausibleWarning
    from .programs import (
        BiasedSine,
        Overdrive,
        Pulse,
        PulseTrain,
        Ramp,
        RampHold,
        Sequence,
        Step,
        Trapezoid,
        TriangleTrain,
        Waveform,
    )
    from .runs.maps import sweep
    from .runs.merge import merge
    from .runs.trajectories import trajectory
    from .sweeps.methods import methods
else:
    # Imported at first use: ``import dea_maps`` and ``dea-maps --help`` wait for no library.
    _HOME = {
        "BiasedSine": "programs",
        "Hold": "pieces",
        "Jump": "pieces",
        "Linear": "pieces",
        "Overdrive": "programs",
        "Pulse": "programs",
        "PulseTrain": "programs",
        "Sequence": "programs",
        "Share": "pieces",
        "Sine": "pieces",
        "Trapezoid": "programs",
        "TriangleTrain": "programs",
        "Waveform": "programs",
        "ImplausibleWarning": "plausibility",
        "LoadHistory": "general.load_history",
        "Material": "materials.material",
        "Ramp": "programs",
        "RampHold": "programs",
        "Step": "programs",
        "VHB": "materials.material",
        "allowable": "limits.allowable",
        "allowable_field": "limits.inverse",
        "allowable_rate": "limits.inverse",
        "breakdown": "limits.breakdown",
        "design": "limits.voltages",
        "explore": "explorer.export",
        "fit_uniaxial": "materials.fit",
        "general_trajectory": "general.run",
        "merge": "runs.merge",
        "methods": "sweeps.methods",
        "open": "files.verify",
        "physical": "materials.si_units",
        "reachable_stretch": "limits.inverse",
        "read_design": "limits.voltages",
        "read_material": "materials.toml",
        "sweep": "runs.maps",
        "sweep_to_netcdf": "files.to_netcdf",
        "trajectory": "runs.trajectories",
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
