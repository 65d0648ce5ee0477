"""Charts of data sets: phase diagrams, curves, trajectories and design charts, and their files.

Each function draws in the axes that it is given, or on a new figure of a size, and returns the axes. `draw` and `plot`
choose the one that suits a data set.
"""

from typing import TYPE_CHECKING

__all__ = [
    "CHARTS",
    "SIZES",
    "SUFFIXES",
    "check_chart_path",
    "cycles_chart",
    "design_chart",
    "draw",
    "failure_curves",
    "hysteresis_loops",
    "phase_diagram",
    "plot",
    "program_chart",
    "save",
    "stretch_chart",
    "trajectories",
]

if TYPE_CHECKING:
    from .choices import CHARTS, SIZES
    from .cycles import cycles_chart
    from .design import design_chart
    from .failures import failure_curves
    from .hysteresis import hysteresis_loops
    from .phase import phase_diagram
    from .program import program_chart
    from .select import SUFFIXES, check_chart_path, draw, plot, save
    from .stretches import stretch_chart
    from .time_curves import trajectories
else:

    def __getattr__(name: str) -> object:
        """Return a public name; Matplotlib is imported at its first use."""
        if name not in __all__:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        from . import select

        value = globals()[name] = getattr(select, name)
        return value
