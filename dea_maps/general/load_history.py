"""Loads that change with time in the general model: straight lines between points, and sudden changes."""

import math
import numbers
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

from ..checks import brief
from ..nomenclature import Kind


@dataclass(frozen=True)
class LoadHistory:
    """A stress, stretch or field that follows straight lines between points in time.

    Before the first time it has the first value, after the last time the last. A time given twice is a sudden
    change from the first of its values to the second.

    Parameters
    ----------
    times : sequence of float
        In relaxation times, at least 0, none less than the one before.
    values : sequence of float
        As many, in the units of what they prescribe.

    Raises
    ------
    TypeError
        If either is no sequence of real numbers.
    ValueError
        If their lengths differ or are zero, if a number is not finite, or if the times are not in order.

    Examples
    --------
    >>> ramp_and_hold = LoadHistory(times=(0.0, 2.0), values=(0.0, 1.2))
    >>> ramp_and_hold.after(1.0), ramp_and_hold.after(5.0)
    (0.6, 1.2)
    >>> sudden = LoadHistory((0.0, 3.0, 3.0), (0.5, 0.5, 1.0))
    >>> sudden.before(3.0), sudden.after(3.0)
    (0.5, 1.0)
    """

    times: Sequence[float]
    values: Sequence[float]

    def __post_init__(self) -> None:
        for name in ("times", "values"):
            object.__setattr__(self, name, _as_numbers(name, getattr(self, name)))
        if not self.times or len(self.times) != len(self.values):
            raise ValueError(
                f"times and values of a LoadHistory must be as many, at least one; got {len(self.times)} times "
                f"and {len(self.values)} values"
            )
        if self.times[0] < 0.0:
            raise ValueError(f"times of a LoadHistory must be at least 0; got {self.times[0]}")
        for index in range(1, len(self.times)):
            if self.times[index] < self.times[index - 1]:
                raise ValueError(
                    f"times of a LoadHistory must not go back; got {self.times[index]} after {self.times[index - 1]}"
                )
        for index in range(2, len(self.times)):
            if self.times[index] == self.times[index - 2]:
                raise ValueError(
                    f"times of a LoadHistory must not hold a time more than twice; got {self.times[index]} three times"
                )

    def after(self, time: float) -> float:
        """Return the value at a time, after any sudden change there.

        Parameters
        ----------
        time : float
            In relaxation times.
        """
        index = bisect_right(self.times, time)
        return self._between(index - 1, index, time)

    def before(self, time: float) -> float:
        """Return the value at a time, before any sudden change there.

        Parameters
        ----------
        time : float
            In relaxation times.
        """
        index = bisect_left(self.times, time)
        return self._between(index - 1, index, time)

    def first_below_zero(self) -> float:
        """Return the first time from which the value is negative, infinity if it never is.

        Examples
        --------
        >>> LoadHistory((0.0, 4.0), (1.0, -1.0)).first_below_zero()
        2.0
        """
        for index, (time, value) in enumerate(zip(self.times, self.values, strict=True)):
            if value < 0.0:
                if index == 0:
                    return 0.0
                before, positive = self.times[index - 1], self.values[index - 1]
                return before + (time - before) * (positive / (positive - value))
        return math.inf

    def _between(self, left: int, right: int, time: float) -> float:
        if left < 0:
            return self.values[0]
        if right >= len(self.times):
            return self.values[-1]
        start, end = self.times[left], self.times[right]
        share = (time - start) / (end - start)
        return self.values[left] * (1.0 - share) + self.values[right] * share


Load = float | LoadHistory
"""A number, applied suddenly at time 0 and held, or a history."""


def as_history(name: str, load: Load, bound: Kind) -> LoadHistory:
    """Check a load and return its history.

    Parameters
    ----------
    name : str
        Of the load, for error messages.
    load : float or LoadHistory
        What the caller gave.
    bound : Kind
        The smallest value allowed.

    Raises
    ------
    TypeError
        If it is neither a real number nor a LoadHistory.
    ValueError
        If a value is not finite or out of bounds.

    Examples
    --------
    >>> as_history("field", 1.2, Kind(0.0)).values
    (1.2,)
    """
    if isinstance(load, LoadHistory):
        history = load
    elif _is_real(load):
        if not math.isfinite(load):
            raise ValueError(f"{name} must be finite; got {load}")
        history = LoadHistory((0.0,), (float(load),))
    else:
        raise TypeError(f"{name} must be a real number or a LoadHistory; got {brief(load)}")
    for value in history.values:
        if not (value >= bound.lowest if bound.included else value > bound.lowest):
            raise ValueError(
                f"{name} must be {'at least' if bound.included else 'above'} {bound.lowest:g}; got {value}"
            )
    return history


def _as_numbers(name: str, given: object) -> tuple[float, ...]:
    try:
        values = tuple(given)  # type: ignore[arg-type, var-annotated]
    except TypeError:
        values = (None,)
    if isinstance(given, str) or not all(_is_real(value) for value in values):
        raise TypeError(f"{name} of a LoadHistory must be a sequence of real numbers; got {brief(given)}")
    for value in values:
        if not math.isfinite(value):
            raise ValueError(f"{name} of a LoadHistory must be finite; got {value}")
    return tuple(float(value) for value in values)


def _is_real(value: object) -> bool:
    return isinstance(value, numbers.Real) and not isinstance(value, bool)
