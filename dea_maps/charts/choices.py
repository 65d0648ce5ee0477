"""What a user may choose of a chart: its kind, its units, its size."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple

CHARTS = (
    "auto",
    "phase_diagram",
    "failure_curves",
    "stretch_chart",
    "cycles_chart",
    "trajectories",
    "hysteresis_loops",
    "program_chart",
    "design_chart",
)
"""Kinds of charts; "auto" is the one that suits the data set."""

UNITS = ("tau", "si")
"""Ratios and relaxation times, or volts and seconds."""


class Size(NamedTuple):
    """Size of a chart.

    Attributes
    ----------
    width, height : float
        Of a chart of one pair of axes, in inches.
    text : float
        Size of its words, in points.
    """

    width: float
    height: float
    text: float


SIZES: Mapping[str, Size] = MappingProxyType({"column": Size(3.5, 2.9, 8.0), "slide": Size(10.0, 5.625, 16.0)})
"""A column of a journal, and a slide of 16 to 9."""


def check_choice(name: str, value: object, allowed: Iterable[str]) -> None:
    """Check that an option has one of its values.

    Parameters
    ----------
    name : str
        Of the option.
    value : object
        What was given.
    allowed : iterable of str
        What it may be.

    Raises
    ------
    ValueError
        If it is something else.

    Examples
    --------
    >>> check_choice("size", "poster", SIZES)
    Traceback (most recent call last):
    ...
    ValueError: size must be one of column, slide; got 'poster'
    """
    allowed = tuple(allowed)
    if not isinstance(value, str) or value not in allowed:
        raise ValueError(f"{name} must be one of {', '.join(allowed)}; got {value!r}")
