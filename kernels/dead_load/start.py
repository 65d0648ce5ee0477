"""Where the climb of a film under a dead load begins: on the slow manifold, or soon after the field begins to rise."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .._jit import device
from ..rising.start import FIRST_STEP, LARGEST_FIRST_STEP, LARGEST_FLOOR
from .film import LOAD_T, W_T, stable_side
from .linearised import first_state
from .slow_manifold import cube_root, damping_from, damping_of, distance_at, slow_manifold

# Rows of what a climb begins with: stretch of the relaxed film without field, state, bound of the first step, factor of
# one over the tolerance, y_floor, by how much v**2 exceeds the strain, and a sixteenth of the decay of an error that
# is still to come, over d**2 and d**4.
REST, FIRST_V, FIRST_Y, LONGEST, CAUTION, FLOOR, SHIFT, OF_SQUARE, OF_FOURTH = range(9)
STARTS = 9
# On the slow manifold: no entry where y is larger, nor so close to the film at rest without field, nor, of a film at
# rest, whose other start costs little, where the search for it has ended with less of the damping asked.
LARGEST_Y = 0.05
LATEST = 0.9
ENOUGH_DAMPING = 0.75
# y_floor, of which the cost alone depends, is y where a damping of 1 is left, no farther than this share of the way to
# the film without field.
FLOOR_SHARE = 0.5
# Of the error allowed, that of the linearised equations, less a constant.
LINEARISED_SHARE = 0.02

# Rows of a block: of one array, whose rows the compiler knows not to overlap.
(
    _W_T,
    _LOAD_T,
    _SIGMA,
    _P,
    _RATE,
    _REST,
    _TARGET,
    _MOVES,
    _ENTRY,
    _DECAY,
    _NEARER,
    _FLOOR,
    _EARLY_V,
    _EARLY_Y,
    _V,
    _Y,
    _LONGEST,
    _OF_SQUARE,
    _OF_FOURTH,
) = range(19)


@device
def is_at_rest(start, sigma):
    """Whether a film is in equilibrium with its load before the field rises: pre-stretched by it, or free."""
    return start > 1.0 or sigma == 0.0


@device
def caution_of(p):
    """Return how much smaller the error of a step is to be for a modulus ratio: measured, few films begin again."""
    return 1.5 * np.sqrt(np.sqrt(1.0 + p))


@device
def sixteenth_power(x):
    """Return x**16."""
    x = x * x
    x = x * x
    x = x * x
    return x * x


@device
def _search(b, damping):
    """Fill in the entry to the slow manifold, the decay from there, and y_floor."""
    lanes = b.shape[1]
    for j in range(lanes):
        relaxed = 1.0 / b[_REST, j] - b[_W_T, j]
        entry = distance_at(b[_W_T, j], b[_SIGMA, j], b[_P, j], b[_LOAD_T, j], relaxed, b[_RATE, j], damping)
        decay = damping_from(b[_W_T, j], b[_SIGMA, j], b[_P, j], b[_LOAD_T, j], entry) / b[_RATE, j]
        b[_ENTRY, j] = min(entry * cube_root(damping / decay), relaxed)
    for j in range(lanes):
        b[_DECAY, j] = damping_from(b[_W_T, j], b[_SIGMA, j], b[_P, j], b[_LOAD_T, j], b[_ENTRY, j]) / b[_RATE, j]
    for j in range(lanes):
        relaxed = 1.0 / b[_REST, j] - b[_W_T, j]
        b[_NEARER, j] = distance_at(b[_W_T, j], b[_SIGMA, j], b[_P, j], b[_LOAD_T, j], relaxed, b[_RATE, j], 1.0)
    for j in range(lanes):
        relaxed = 1.0 / b[_REST, j] - b[_W_T, j]
        nearer = min(b[_NEARER, j], FLOOR_SHARE * relaxed)
        floor, _, _, _, _ = slow_manifold(b[_W_T, j], b[_SIGMA, j], b[_LOAD_T, j], b[_RATE, j], nearer)
        b[_FLOOR, j] = min(LARGEST_FLOOR, floor)


@device
def _choose(b, damping, rtol):
    """Fill in the state, the bound of the first step, and the decay over d**2 and d**4."""
    lanes = b.shape[1]
    for j in range(lanes):
        allowed = b[_FLOOR, j] * sixteenth_power(1.0 + 0.0625 * b[_DECAY, j]) * LINEARISED_SHARE * rtol
        b[_EARLY_V, j], b[_EARLY_Y, j] = first_state(b[_REST, j], b[_P, j], b[_RATE, j], allowed / caution_of(b[_P, j]))
    for j in range(lanes):
        w_t, p, entry, decay = b[_W_T, j], b[_P, j], b[_ENTRY, j], b[_DECAY, j]
        relaxed = 1.0 / b[_REST, j] - w_t
        y, u, _, _, G = slow_manifold(w_t, b[_SIGMA, j], b[_LOAD_T, j], b[_RATE, j], entry)
        z = 1.0 - y
        excess = p * u * u * y * (1.0 + z + z * z) / z - entry * entry * G
        late = (entry < LATEST * relaxed) & (decay > ENOUGH_DAMPING * damping * b[_MOVES, j])
        late = late & (y < LARGEST_Y) & (excess < b[_TARGET, j])
        early_v, early_y = b[_EARLY_V, j] * b[_MOVES, j], b[_EARLY_Y, j] * b[_MOVES, j]
        b[_V, j] = np.sqrt((relaxed - entry) / (w_t + entry)) if late else early_v
        b[_Y, j] = y if late else early_y
        first = max(min(LARGEST_FIRST_STEP, FIRST_STEP * np.sqrt(b[_FLOOR, j])), early_v)
        b[_LONGEST, j] = math.inf if late else first
        square, nearer = entry * entry, b[_NEARER, j] * b[_NEARER, j]
        # The decay from the entry, and that of 1 from nearer.
        fourth = (1.0 - square / (decay * nearer)) / (1.0 - nearer / square + 1e-9)
        fourth = min(max(fourth, 0.0), 1.0)
        b[_OF_SQUARE, j] = 0.0625 * decay * (1.0 - fourth) / square
        b[_OF_FOURTH, j] = 0.0625 * decay * fourth / (square * square)


def make_starts_of(target_of: Callable[..., Any], lanes: int) -> Callable[..., Any]:
    """Make ``starts_of(film, rate, modulus_ratio, start, sigma, rtol, starts)``, which fills in (STARTS, cells).

    It returns the number of films that are not at rest without field: v = 0 stands for their states, which are yet to
    be found, unless on the slow manifold.
    ``target_of(film, cell, p)`` is e - e_t at which the climb ends.
    """

    @device
    def starts_of(film, rate, modulus_ratio, start, sigma, rtol, starts):
        damping = damping_of(rtol)
        fresh = 0
        for cell in range(start.size):
            starts[REST, cell] = start[cell]
            fresh += not is_at_rest(start[cell], sigma[cell])
        if fresh > 0:
            for cell in range(start.size):
                w_t = film[W_T, cell]
                rest = 1.0 / (w_t + stable_side(film[LOAD_T, cell], w_t, 1.0, 1.0, sigma[cell]))
                starts[REST, cell] = start[cell] if is_at_rest(start[cell], sigma[cell]) else rest
        b = np.empty((_OF_FOURTH + 1, lanes))
        for first in range(0, start.size, lanes):
            for j in range(lanes):
                cell = min(first + j, start.size - 1)
                b[_W_T, j] = film[W_T, cell]
                b[_LOAD_T, j] = film[LOAD_T, cell]
                b[_SIGMA, j] = sigma[cell]
                b[_P, j] = modulus_ratio[cell] - 1.0
                b[_RATE, j] = rate[cell]
                b[_REST, j] = starts[REST, cell]
                b[_TARGET, j] = min(target_of(film, cell, modulus_ratio[cell] - 1.0), 1e300)
                b[_MOVES, j] = 1.0 if is_at_rest(start[cell], sigma[cell]) else 0.0
            _search(b, damping)
            _choose(b, damping, rtol)
            for j in range(min(lanes, start.size - first)):
                cell = first + j
                starts[FIRST_V, cell] = b[_V, j]
                starts[FIRST_Y, cell] = b[_Y, j]
                starts[LONGEST, cell] = b[_LONGEST, j]
                starts[CAUTION, cell] = caution_of(b[_P, j])
                starts[FLOOR, cell] = b[_FLOOR, j]
                starts[SHIFT, cell] = 0.0
                starts[OF_SQUARE, cell] = b[_OF_SQUARE, j]
                starts[OF_FOURTH, cell] = b[_OF_FOURTH, j]
        return fresh

    return starts_of
