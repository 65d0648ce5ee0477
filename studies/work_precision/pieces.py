"""Films under programs of linear pieces and a dead load, as the truth and the other solvers take them.

``w = 1/lambda``, ``r = xi**2``, ``p = m - 1``, ``A = 1 + p/r``, ``B = 1 + p r**2``, dead load ``sigma``: equilibrium is
``e = A w**2 - B w**8 - sigma w**3``, stable while ``D = 8 B w**6 + 3 sigma w - 2 A > 0``.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

CRITICAL_LOAD = 0.75 * 4.0 ** (-1.0 / 3.0)
NEWTON = 100
Array = NDArray[np.float64]


class Films(NamedTuple):
    """What is to be found out for: parameters of a program of `dea_maps` and of films, (cases,) arrays by name."""

    scene: str
    program: str
    given: Mapping[str, Array]

    @property
    def ratio(self) -> Array:
        """Modulus ratio."""
        return self.given["modulus_ratio"]


class Pieces(NamedTuple):
    """Fields at the start, slopes and durations, (pieces, cases), of a program, and whether it is repeated."""

    start: Array
    slope: Array
    duration: Array
    repeated: bool


def pieces_of(films: Films) -> Pieces:
    """Return the pieces of a program; the last one of a program that ends lasts for ever."""
    given = films.given
    zero = np.zeros_like(films.ratio)
    field = given["field"]
    held = (field, zero, zero + np.inf)
    if films.program == "step":
        rows = [held]
    elif films.program == "ramp_hold":
        rows = [(zero, given["rate"], field / given["rate"]), held]
    elif films.program == "overdrive":
        rows = [(given["overdrive_field"], zero, given["overdrive_time"]), held]
    elif films.program == "trapezoid":
        fall = given["fall_rate"]
        rows = [
            (zero, given["rate"], field / given["rate"]),
            (field, zero, given["hold_time"]),
            (field, -fall, field / fall),
        ]
    else:  # a train of triangles
        half = 0.5 * given["period"]
        rows = [(zero, field / half, half), (field, -field / half, half)]
    start, slope, duration = (np.array(column) for column in zip(*rows, strict=True))
    return Pieces(start, slope, duration, films.program == "triangle_train")


def film_of(films: Films) -> tuple[Array, Array, Array]:
    """Return p, xi**2 at the start and the dead load."""
    stretch = films.given.get("prestretch", np.ones_like(films.ratio))
    return films.ratio - 1.0, stretch * stretch, stretch - stretch**-5.0


def critical(r: Array, p: Array, sigma: Array) -> tuple[Array, Array]:
    """Return w at the instability and the load there."""
    A, B = 1.0 + p / r, 1.0 + p * r * r
    w = (A / B) ** (1.0 / 6.0)  # above the root, as the function is convex and rises
    for _ in range(NEWTON):
        change = (8.0 * B * w**6 + 3.0 * sigma * w - 2.0 * A) / (48.0 * B * w**5 + 3.0 * sigma)
        w = w - change
        if np.all(np.abs(change) < 1e-16):
            break
    return w, w * w * (A - B * w**6 - sigma * w)


def equilibrium(field: Array, r: Array, p: Array, sigma: Array) -> Array:
    """Return w of a film in stable equilibrium, by Newton's method from above, where e(w) is concave and falls."""
    A, B, e = 1.0 + p / r, 1.0 + p * r * r, CRITICAL_LOAD * field * field
    w = (A / B) ** (1.0 / 6.0)
    for _ in range(NEWTON):
        u = w * w
        change = (u * (A - B * u * u * u - sigma * w) - e) / (w * (8.0 * B * u * u * u + 3.0 * sigma * w - 2.0 * A))
        w = w + change
        if np.all(np.abs(change) < 2e-16):
            break
    return w
