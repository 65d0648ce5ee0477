"""Breakdown strength: the true field that a film withstands, as a function of its stretch."""

import numbers
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from ..checks import brief

Array = npt.NDArray[np.float64]
StrengthOf = Callable[[Array], Array]
Strength = float | Callable[[Array], Any]
"""The true field of breakdown, normalised by the relaxed critical field, or what returns it for stretches."""

# Stretches at which a strength is looked at.
_LOOKS = 257


def strength_of(strength: Strength) -> StrengthOf:
    """Return a strength as a function of stretches.

    Raises
    ------
    TypeError, ValueError
        If it is neither a number above 0 nor a function.

    Examples
    --------
    >>> strength_of(3.0)(np.array([1.0, 1.5])).tolist()
    [3.0, 3.0]
    """
    if callable(strength):
        return lambda stretch: np.asarray(strength(stretch), dtype=np.float64)
    if not isinstance(strength, numbers.Real) or isinstance(strength, bool):
        raise TypeError(f"strength must be a number or a function of the stretch; got {brief(strength)}")
    if not 0.0 < strength < np.inf:
        raise ValueError(f"strength must be finite and above 0; got {strength}")
    return lambda stretch: np.full(np.shape(stretch), float(strength))


def check_strength(strength: StrengthOf, stretch: Array) -> None:
    """Check that a strength is one up to the largest of some stretches, NaN not counted.

    Raises
    ------
    TypeError, ValueError
        If it does not return one number above 0 for each, or does not fall when divided by the stretch squared.

    Examples
    --------
    >>> check_strength(lambda stretch: stretch**3, np.array([1.3]))
    Traceback (most recent call last):
    ...
    ValueError: strength(stretch)/stretch**2 must fall with the stretch from 1 to 1.3; it rises at 1
    """
    most = max(1.001, float(np.nanmax(stretch, initial=1.0)))
    looks = np.linspace(1.0, most, _LOOKS)
    values = strength(looks)
    if values.shape != looks.shape:
        raise TypeError(f"strength must return a number for each of {_LOOKS} stretches; got the shape {values.shape}")
    good = np.isfinite(values) & (values > 0.0)
    if not good.all():
        at = looks[~good][0]
        raise ValueError(f"strength must be finite and above 0 at every stretch; got {values[~good][0]} at {at:.4g}")
    falls = np.diff(values / looks**2) < 0.0
    if not falls.all():
        at = looks[:-1][~falls][0]
        raise ValueError(
            f"strength(stretch)/stretch**2 must fall with the stretch from 1 to {most:.4g}; it rises at {at:.4g}"
        )


def excess(strength: StrengthOf, field: Array, stretch: Array) -> Array:
    """Return by how much the true field exceeds the strength, relatively; NaN where there is no film."""
    return np.asarray(field * stretch * stretch / strength(stretch) - 1.0)
