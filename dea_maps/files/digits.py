"""Rounding of maps to the bits that their accuracy carries, said in the attributes of CF-1.12, section 8.4."""

import math
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .. import __version__
from ..sweeps.dataset import with_storage

DIGITS = ("auto",)
"""What may be asked for."""
BITS = "quantization_nsb"
"""Attribute of a variable: how many bits of its fractions are kept."""
_INFO = "quantization_info"
# What a count is rounded to is no count.
_EXACT = {"cycles_to_failure"}


def bits_of(rtol: float) -> int:
    """Return how many bits of the fraction are kept: rounding changes a value by at most ``rtol / 8`` of itself.

    A number is ``(1 + f) 2**e`` with the fraction ``0 <= f < 1``; of which ``b`` bits are kept, it changes by at most
    ``2**-(b + 1) 2**e``.

    Examples
    --------
    >>> bits_of(1e-6), bits_of(1e-3)
    (22, 12)
    """
    return math.ceil(math.log2(4.0 / rtol))


def described(ds: xr.Dataset, rtol: float) -> xr.Dataset:
    """Say in the attributes of a map how its variables are rounded: those that have more bits than are kept.

    Parameters
    ----------
    ds : Dataset
        The map.
    rtol : float
        Its accuracy.

    Returns
    -------
    Dataset
        With a variable more, which describes the rounding, if there is something to round.
    """
    ds, bits = ds.copy(), bits_of(rtol)
    rounds = [name for name, array in ds.data_vars.items() if name not in _EXACT and _has_more(array.dtype, bits)]
    if not rounds:
        return ds
    for name in rounds:
        ds[name].attrs |= {"quantization": _INFO, BITS: np.int32(bits)}
    attributes = {"algorithm": "bitround", "implementation": f"dea_maps version {__version__}"}
    info = xr.Dataset({_INFO: ((), np.array(b"", "S1"), attributes)})
    ds[_INFO] = with_storage(info)[_INFO]
    ds.attrs["Conventions"] = str(ds.attrs["Conventions"]).replace("CF-1.11", "CF-1.12")
    return ds


def _has_more(dtype: np.dtype[Any], bits: int) -> bool:
    return dtype.kind == "f" and np.finfo(dtype).nmant > bits


def rounded(values: NDArray[Any], bits: int) -> NDArray[Any]:
    """Return numbers rounded to the nearest of so many bits, of two that are as near to the one that ends in 0.

    NaN, infinities and numbers below the normal ones stay, as what would become infinite. M. Klower et al. (2021),
    Nature Computational Science 1, 713-724, show how far such numbers can be compressed.

    Parameters
    ----------
    values : ndarray of float32 or float64
    bits : int
        Of the fraction; fewer than the numbers have.

    Returns
    -------
    ndarray

    Examples
    --------
    >>> rounded(np.array([1.2, 1.3125, 1e-320, np.inf, np.nan]), 3).tolist()
    [1.25, 1.25, 1e-320, inf, nan]
    """
    limits = np.finfo(values.dtype)
    kind = np.dtype(f"u{values.dtype.itemsize}").type
    drop = limits.nmant - bits
    whole = values.view(kind)
    last = (whole >> kind(drop)) & kind(1)
    near = ((whole + (kind(2 ** (drop - 1) - 1) + last)) & ~kind(2**drop - 1)).view(values.dtype)
    size = np.abs(values)
    return np.where((size >= limits.tiny) & (size <= limits.max) & np.isfinite(near), near, values)
