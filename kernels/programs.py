"""Loading programs as pieces of linear field: E(T)/Ec = start + slope * (T - beginning) until the piece ends.

A program is data and two plain functions; a further one (pulse, triangle) adds an entry, no branch anywhere.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from ._jit import device


class Program(NamedTuple):
    """A loading program as the kernels see it.

    Attributes
    ----------
    name : str
        As in files.
    pieces : int
        Number of linear pieces; the last one has no end.
    piece : callable
        ``piece(index, field, rate) -> (start, slope, duration)``: field in Ec, slope in Ec per tau, duration in tau.
    peak : callable
        ``peak(field, rate)``: largest field ever applied, in Ec.
    begins_with_step : bool
        Whether the field jumps at T = 0, so that the film can fail at once.
    """

    name: str
    pieces: int
    piece: Callable[..., Any]
    peak: Callable[..., Any]
    begins_with_step: bool


@device
def _step_piece(index, field, rate):
    return field, 0.0, math.inf


@device
def _ramp_piece(index, field, rate):
    return 0.0, rate, math.inf


@device
def _ramp_hold_piece(index, field, rate):
    if index == 0:
        return 0.0, rate, field / rate
    return field, 0.0, math.inf


@device
def _given_field(field, rate):
    return field


@device
def _unbounded(field, rate):
    return math.inf


STEP = Program("step", 1, _step_piece, _given_field, True)
RAMP = Program("ramp", 1, _ramp_piece, _unbounded, False)
RAMP_HOLD = Program("ramp_hold", 2, _ramp_hold_piece, _given_field, False)

PROGRAMS = {program.name: program for program in (STEP, RAMP, RAMP_HOLD)}


def field_at(program: str, field: float, rate: float, time: float) -> float:
    """E/Ec at a time under a loading program, for one cell outside compiled code."""
    chosen = PROGRAMS[program]
    beginning = 0.0
    for index in range(chosen.pieces):
        start, slope, duration = chosen.piece(index, field, rate)
        if time <= beginning + duration:
            break
        beginning += duration
    return float(start + slope * (time - beginning))
