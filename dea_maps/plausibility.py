"""Values that are allowed, but most likely in another unit than the one asked for: a warning says so."""

import warnings
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import numpy.typing as npt


class ImplausibleWarning(UserWarning):
    """A value is allowed, but so far from those of real films that its unit is most likely another one."""


class Range(NamedTuple):
    """What is plausible.

    Attributes
    ----------
    least, greatest : float
        Both included.
    unit : str
        The unit that is asked for.
    hint : str
        What the user may have done.
    """

    least: float
    greatest: float
    unit: str
    hint: str


PLAUSIBLE: Mapping[str, Range] = MappingProxyType(
    {
        # Films of actuators have 10 um to 2 mm; submicron films are deposited and hardly stretch, blocks are no films.
        "thickness": Range(1e-6, 10e-3, "m", "is it in um or mm?"),
        # From the softest gels, some kPa, to thermoplastic elastomers, some ten MPa; harder ones do not fail this way.
        "unrelaxed_modulus": Range(1e3, 100e6, "Pa", "is it in kPa or MPa?"),
        "relaxed_modulus": Range(1e3, 100e6, "Pa", "is it in kPa or MPa?"),
        # Below a ms inertia, which the model leaves out, counts more; above some months it is no longer measured.
        "relaxation_time": Range(1e-3, 1e7, "s", "is it in ms, min or h?"),
        # Elastomers have 2 to 10, filled ones some tens; water has 80.
        "relative_permittivity": Range(1.0, 100.0, "1", "is it relative to vacuum?"),
        # Air has 3 MV/m; thin films of elastomers have up to some hundred.
        "breakdown_strength": Range(1e6, 5e9, "V/m", "is it in MV/m or V/um?"),
        # Over the square root of the modulus ratio: one is failure at once, tests go to a few.
        "field": Range(0.0, 100.0, "Ec", "is it in V or V/m?"),
        # The largest of a sweep: (1e-2)^2 of the critical load stretches a film by some 1e-5.
        "voltage": Range(1e-2, np.inf, "Ec", "is it in kV, or the thickness in um?"),
        # From a jump within the time in which films are charged, over a ms, to a ramp over some years.
        "rate": Range(1e-8, 1e8, "Ec/tau", "is it in kV/s or V/s, or the time in ms?"),
        # The largest of a measurement: elastomers carry at least some kPa before they have twice their length.
        "nominal_stress": Range(1e3, 1e9, "Pa", "is the column in kPa or MPa?"),
        # No elastomer reaches twenty times its length.
        "stretch": Range(1.0, 20.0, "1", "is the column a strain in %?"),
        # From the fastest testing machines to creep.
        "stretch_rate": Range(1e-8, 1e4, "1/s", "is the column in %/s or mm/s?"),
        # From a pulse to a century.
        "holding_time": Range(1e-6, 4e9, "s", "is it in s?"),
    }
)
"""What values of real films are, the one place for these limits."""


def warn_implausible(name: str, values: npt.ArrayLike, shown: str = "", scale: float = 1.0) -> None:
    """Warn if a value lies outside what is plausible; of several, the farthest one is named, on one line.

    Parameters
    ----------
    name : str
        A key of `PLAUSIBLE`.
    values : number or array
        In its unit; NaN and infinity do not count.
    shown : str
        What else to say of it, as what it is in other units.
    scale : float
        What the limits are multiplied by.

    Warns
    -----
    ImplausibleWarning

    Examples
    --------
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     warn_implausible("thickness", 100.0)
    >>> str(caught[0].message)
    'thickness = 100 m is implausible, above 0.01 m: is it in um or mm?'
    """
    array = np.asarray(values, dtype=np.float64).ravel()
    array = array[np.isfinite(array)]
    if not array.size:
        return
    limit = PLAUSIBLE[name]
    unit = "" if limit.unit == "1" else f" {limit.unit}"
    low, high = float(array.min()), float(array.max())
    for value, out, words in (
        (low, low < scale * limit.least, f"below {scale * limit.least:.4g}"),
        (high, high > scale * limit.greatest, f"above {scale * limit.greatest:.4g}"),
    ):
        if out:
            also = f" ({shown})" if shown else ""
            message = f"{name} = {value:.6g}{unit}{also} is implausible, {words}{unit}: {limit.hint}"
            warnings.warn(message, ImplausibleWarning, stacklevel=4)
