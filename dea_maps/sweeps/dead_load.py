"""Films under a dead load: the load of a pre-stretch, the largest field sustained, and the relaxed threshold.

With ``w = 1/lambda``, ``A = 1 + p/xi**2``, ``B = 1 + p xi**4`` and the nominal stress ``sigma = s/mu_R`` in both
directions, equilibrium (18) to (20) of Zhao, Koh and Suo (2011) is ``e = A w**2 - B w**8 - sigma w**3``, and the film
is unstable at the maximum of ``e``, where ``8 B w**6 + 3 sigma w = 2 A``.
"""

from collections.abc import Iterable, Mapping

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_CRITICAL_LOAD = 0.75 * 4.0 ** (-1.0 / 3.0)


def film_of(given: Mapping[str, Array]) -> tuple[Array, Array, Array]:
    """Return modulus ratio, internal stretch at the start and dead load of films, from the parameters of a sweep.

    Examples
    --------
    >>> given = {"modulus_ratio": np.array([4.0]), "prestretch": np.array([2.0])}
    >>> [array.round(4).tolist() for array in film_of(given)]
    [[4.0], [2.0], [1.9688]]
    """
    ratio = np.asarray(given["modulus_ratio"])
    start = np.asarray(given.get("prestretch", np.ones_like(ratio)))
    load = load_of(start) if "prestretch" in given else given.get("stress", np.zeros_like(ratio))
    return ratio, start, np.asarray(load)


def has_dead_load(names: Iterable[str]) -> bool:
    """Return whether parameters, by their names, are those of films under a dead load.

    Examples
    --------
    >>> has_dead_load(["field", "modulus_ratio", "stress"])
    True
    """
    return not {"prestretch", "stress"}.isdisjoint(names)


def load_of(prestretch: Array) -> Array:
    """Return the nominal stress, normalised by the relaxed modulus, under which a relaxed film has a stretch."""
    return np.asarray(prestretch - prestretch**-5)


def critical_stretch(internal_stretch: Array, modulus_ratio: Array, stress: Array) -> Array:
    """Return the stretch at the instability, (25) under a dead load, at an internal stretch.

    Examples
    --------
    >>> one = np.ones(2)
    >>> critical_stretch(one, one, load_of(np.array([1.0, 2.0]))).round(4).tolist()
    [1.2599, 2.9704]
    """
    r, p = internal_stretch**2, modulus_ratio - 1.0
    A, B = 1.0 + p / r, 1.0 + p * r * r
    w = (0.25 * A / B) ** (1.0 / 6.0)  # the root without a load, above that with one
    falls = True
    while falls:  # Newton's method on a convex increasing function falls until rounding ends it
        fifth = B * (w * w) ** 2 * w
        below = w - ((8.0 * fifth + 3.0 * stress) * w - 2.0 * A) / (48.0 * fifth + 3.0 * stress)
        falls = bool((below < w).any())
        w = np.minimum(w, below)
    return np.asarray(1.0 / w)


def largest_load(internal_stretch: Array, modulus_ratio: Array, stress: Array) -> Array:
    """Return the largest load ``eps E**2/mu_R`` that a film carries at an internal stretch.

    Examples
    --------
    >>> round(float(np.sqrt(largest_load(np.ones(1), np.ones(1), np.array([0.9223]))[0] / 0.4724704)), 4)
    0.5521
    """
    r, p = internal_stretch**2, modulus_ratio - 1.0
    w = 1.0 / critical_stretch(internal_stretch, modulus_ratio, stress)
    return np.asarray(w * w * (1.0 + p / r - (1.0 + p * r * r) * w**6 - stress * w))


def largest_field(internal_stretch: Array, modulus_ratio: Array, stress: Array) -> Array:
    """Return the largest field, over that of the relaxed free film, that a film carries at an internal stretch.

    Examples
    --------
    >>> largest_field(np.ones(1), np.array([4.0]), np.zeros(1))
    array([2.])
    """
    return np.sqrt(largest_load(internal_stretch, modulus_ratio, stress) / _CRITICAL_LOAD)


def relaxed_threshold(stress: Array) -> Array:
    """Return the largest field, normalised by that of the free film, that a relaxed film sustains under a dead load.

    It does not depend on the modulus ratio: relaxed, the film is one of the relaxed modulus alone.

    Examples
    --------
    >>> relaxed_threshold(load_of(np.array([1.0, 2.0]))).round(4).tolist()
    [1.0, 0.2838]
    """
    one = np.ones_like(stress)
    return largest_field(one, one, stress)


def margin(field: Array, internal_stretch: Array, given: Mapping[str, Array]) -> Array:
    """Return ``1 - e/e_c(xi)``: zero at the instability, 1 without field.

    Parameters
    ----------
    field, internal_stretch : ndarray
        Of the shape of the parameters and one dimension more.
    given : mapping of str to ndarray
        Parameters of the films.
    """
    ratio, _, stress = (array[..., np.newaxis] for array in film_of(given))
    return np.asarray(1.0 - _CRITICAL_LOAD * field * field / largest_load(internal_stretch, ratio, stress))
