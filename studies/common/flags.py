"""Values of flags, by the words that a data set has for them."""

import xarray as xr


def flag(variable: xr.DataArray, word: str) -> int:
    """Return the value that stands for a word.

    Examples
    --------
    >>> import dea_maps as dm
    >>> flag(dm.sweep(dm.Step(), field=1.2, modulus_ratio=4.0).outcome, "fails_later")
    1
    """
    return int(variable.attrs["flag_values"][variable.attrs["flag_meanings"].split().index(word)])


def word(variable: xr.DataArray) -> str:
    """Return the word for the value of one cell.

    Examples
    --------
    >>> import dea_maps as dm
    >>> word(dm.sweep(dm.Step(), field=1.2, modulus_ratio=4.0).outcome)
    'fails_later'
    """
    words = zip(variable.attrs["flag_values"], variable.attrs["flag_meanings"].split(), strict=True)
    return next(text for value, text in words if value == variable)
