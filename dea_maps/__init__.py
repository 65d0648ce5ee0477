"""Phase diagrams of dielectric-elastomer actuators: when, and at what stretch, a film collapses.

Examples
--------
>>> import dea_maps as dm
>>> ds = dm.sweep(dm.Step(), field=[0.9, 1.2], modulus_ratio=4.0)
>>> [round(float(stretch), 6) for stretch in ds.critical_stretch]
[nan, 1.659355]
"""

from typing import TYPE_CHECKING

__all__ = ["Ramp", "RampHold", "Step", "__version__", "methods", "sweep", "sweep_to_netcdf", "trajectory"]

if TYPE_CHECKING:
    from .catalogue import methods
    from .programs import Ramp, RampHold, Step
    from .sweeping import sweep, sweep_to_netcdf
    from .trajectories import trajectory

    __version__: str
else:
    # Imported at first use: ``import dea_maps`` and ``dea-maps --help`` wait for no library.
    _HOME = {
        "Ramp": "programs",
        "RampHold": "programs",
        "Step": "programs",
        "methods": "catalogue",
        "sweep": "sweeping",
        "sweep_to_netcdf": "sweeping",
        "trajectory": "trajectories",
    }

    def __getattr__(name: str) -> object:
        """Return a public name, imported at its first use."""
        if name == "__version__":
            from importlib.metadata import version

            value = version("dea-maps")
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
