"""Numbers with units on the command line, as 2kV or 10min; and numbers in the words of an answer."""

import argparse
import math
import re
from collections.abc import Mapping
from decimal import Decimal
from types import MappingProxyType

_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")

_MICRO = ("um", "\u00b5m", "\u03bcm")
UNITS: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "voltage": {"V": "1", "kV": "1000"},
        "rate": {"V/s": "1", "kV/s": "1000"},
        "time": {"s": "1", "ms": "0.001", "min": "60", "h": "3600", "d": "86400"},
        "thickness": {"m": "1", "mm": "0.001", **dict.fromkeys(_MICRO, "0.000001")},
    }
)
"""What each unit is worth in SI units, which a bare number is in; in decimals, as the numbers are."""


class Quantity:
    """Reads a positive number with a unit of some kind, a key of `UNITS`, for argparse.

    Examples
    --------
    >>> Quantity("voltage")("2.2kV"), Quantity("time")("10 min"), Quantity("thickness")("100um")
    (2200.0, 600.0, 0.0001)
    """

    def __init__(self, kind: str) -> None:
        self._kind = kind

    def __call__(self, text: str) -> float:
        """Return the number in SI units."""
        units = UNITS[self._kind]
        match = _NUMBER.fullmatch(text)
        unit = match[2] if match else ""
        value = float(Decimal(match[1]) * Decimal(units.get(unit, "1"))) if match else math.nan
        if not (0.0 < value < math.inf) or (unit and unit not in units):
            allowed = ", ".join(unit for unit in units if unit.isascii())
            raise argparse.ArgumentTypeError(f"must be a number above 0 in {allowed}; got {text!r}")
        return value


def volts_in_words(volts: float) -> str:
    """Return a voltage with four digits.

    Examples
    --------
    >>> volts_in_words(1609.02), volts_in_words(804.5)
    ('1.609 kV', '804.5 V')
    """
    return f"{volts / 1e3:.4g} kV" if volts >= 1e3 else f"{volts:.4g} V"


def at_most(volts: float) -> float:
    """Return a voltage rounded down to four digits, as the largest one that is allowed.

    Examples
    --------
    >>> at_most(1863.97)
    1863.0
    """
    digits = 10.0 ** (math.floor(math.log10(volts)) - 3)
    return float(f"{math.floor(volts / digits) * digits:.4g}")
