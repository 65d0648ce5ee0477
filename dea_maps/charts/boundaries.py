"""Exact boundaries between the outcomes of films, without a grid."""

import numpy as np
import numpy.typing as npt

from ..outcomes import Outcome

Floats = npt.NDArray[np.float64]
Outcomes = npt.NDArray[np.int8]

SURVIVES, FAILS_LATER, FAILS_AT_ONCE, UNRESOLVED = Outcome

PROGRAMS = ("step", "ramp_hold")
"""Loading programs whose field ends at a value, which decides."""

_ROUNDING = 1e-6


def outcome_in_theory(program: str, field: Floats, ratio: Floats) -> Outcomes:
    """Return the outcome of films.

    A film survives a field up to the relaxed critical one indefinitely, (23) with the dashpot relaxed; only an elastic
    film, of modulus ratio 1, fails at it. Under a sudden field of ``sqrt(ratio)`` or more it fails at once.

    Parameters
    ----------
    program : str
        One of `PROGRAMS`.
    field, ratio : ndarray
        Final field normalised by the relaxed critical field, and modulus ratio; they are broadcast.

    Examples
    --------
    >>> outcome_in_theory("step", np.array([1.0, 1.5, 2.0]), np.array(4.0)).tolist()
    [0, 1, 2]
    """
    survives = (field < 1.0) | ((field == 1.0) & (ratio > 1.0))
    at_once = (field >= np.sqrt(ratio)) & (program == "step")
    return np.select([survives, at_once], [SURVIVES, FAILS_AT_ONCE], FAILS_LATER).astype(np.int8)


def agrees(program: str, field: Floats, ratio: Floats, outcome: Outcomes) -> bool:
    """Tell whether the theory and a map say the same in every resolved cell.

    Parameters
    ----------
    program : str
        Any name.
    field, ratio : ndarray
        As in `outcome_in_theory`.
    outcome : ndarray of int8
        The map.
    """
    if program not in PROGRAMS:
        return False
    below, above = (outcome_in_theory(program, field * (1.0 + by), ratio) for by in (-_ROUNDING, _ROUNDING))
    return bool(((outcome == below) | (outcome == above) | (outcome == UNRESOLVED)).all())


def limits(program: str, ratio: Floats) -> list[Floats]:
    """Return the fields between one outcome and the next: the largest survived, and the least that fails at once.

    Parameters
    ----------
    program : str
        One of `PROGRAMS`.
    ratio : ndarray
        Modulus ratios.

    Returns
    -------
    list of ndarray
        Each of the shape of `ratio`.
    """
    return [np.ones_like(ratio), *([np.sqrt(ratio)] if program == "step" else [])]
