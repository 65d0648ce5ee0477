"""What error messages and checks of arguments share."""

import reprlib
from typing import Any


def brief(value: object) -> str:
    """Return a short representation of anything, on one line, for an error message.

    Examples
    --------
    >>> brief(list(range(1000)))
    '[0, 1, 2, 3, 4, 5, ...]'
    """
    return " ".join(reprlib.repr(value).split())


def in_units(name: str, value: Any, units: str) -> Any:
    """Return the numbers of a quantity that knows its units, as one of pint; anything else as it is.

    A list of quantities becomes a list of numbers; a DataArray of them, one of numbers.

    Parameters
    ----------
    name : str
        What it is called in messages.
    value : Any
        What the caller gave.
    units : str
        What it is converted to, in UDUNITS; "1" for a ratio.

    Raises
    ------
    ValueError
        If its units do not convert.

    Examples
    --------
    >>> import pint
    >>> in_units("voltage", pint.UnitRegistry().Quantity(2.0, "kV"), "V")
    2000.0
    """
    if isinstance(value, list | tuple) and any(map(_is_quantity, value)):
        return [in_units(name, item, units) for item in value]
    if _is_quantity(getattr(value, "data", None)) and hasattr(value, "dims"):
        return value.copy(data=in_units(name, value.data, units))
    if not _is_quantity(value):
        return value
    try:
        return value.to({"1": "dimensionless"}.get(units, units.replace(" s-1", "/s"))).magnitude
    except (AttributeError, TypeError, ValueError):
        wanted = "dimensionless" if units == "1" else f"in {units}, or in units that convert to it"
        raise ValueError(f"{name} must be {wanted}; got {brief(str(value))}") from None


def _is_quantity(value: object) -> bool:
    return all(hasattr(value, name) for name in ("to", "magnitude", "units"))
