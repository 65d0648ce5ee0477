"""A loading program as the kernels take it: a table of pieces whose arguments are multiples of columns.

A piece is linear, from a field to another one in a time, or a sine about a mean field. Every argument is a scale times
a column, which has a value for each cell; the first column is 1. The table does not grow with the cells, nor the
columns with the pieces of a waveform.
"""

import math
from collections.abc import Callable, Hashable, Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ..pieces import Argument, Hold, Jump, Linear, Piece, Share, Sine, Time
from ..programs import Program, Waveform, shape_of

LINEAR, SINE = 0, 1
"""Kinds of pieces; their arguments are start field, end field, duration, or mean field, amplitude, duration, period."""

Float = npt.NDArray[np.float64]
Parameters = Mapping[str, Float]


class Table(NamedTuple):
    """The pieces of a program.

    Attributes
    ----------
    kind : (pieces,) ndarray of int8
        `LINEAR` or `SINE`.
    scale : (pieces, 4) ndarray of float64
    source : (pieces, 4) ndarray of int64
        The arguments of a piece are ``scale * columns[source]``.
    columns : tuple of callable
        Each gives the values of a column, of the shape of the parameters, from them.
    repeats : int
        How often the pieces are gone through; `dea_maps.programs.ENDLESS` without end.
    once : int
        How many pieces, the first ones, make up the first repetition, where the others, which are the pieces after
        these, begin at another field than zero; else 0.
    endless : bool
        Whether the last piece stands for a rise without end: it ends where every film has failed.
    """

    kind: npt.NDArray[np.int8]
    scale: Float
    source: npt.NDArray[np.int64]
    columns: tuple[Callable[[Parameters], Any], ...]
    repeats: int
    once: int
    endless: bool


def table_of(program: Program) -> Table:
    """Return the pieces of a loading program as a table.

    Examples
    --------
    >>> from dea_maps.programs import Trapezoid
    >>> table = table_of(Trapezoid())
    >>> table.scale[1], len(table.columns)
    (array([1., 1., 1., 0.]), 5)
    """
    build = _Builder()
    if isinstance(program, Waveform):
        return _of_samples(program, build)
    rows, reached = build.rows(program.pieces, 0.0)
    once = 0
    if program.repeats != 1:
        again, _ = build.rows(program.pieces, reached)
        if again != rows:
            once = len(rows)
            rows += again
    kind = np.array([kind for kind, _ in rows], np.int8)
    scale = np.array([[argument.scale for argument in arguments] for _, arguments in rows])
    source = np.array([[argument.column for argument in arguments] for _, arguments in rows], np.int64)
    return Table(kind, scale, source, tuple(build.columns.values()), program.repeats, once, reached == math.inf)


Arrays = tuple[npt.NDArray[np.int8], Float, npt.NDArray[np.int64], Float, int, int]


def arrays_of(table: Table, given: Parameters) -> Arrays:
    """Return the table as the kernels take it, with the columns of some cells.

    Returns
    -------
    kind, scale, source, columns, repeats, once
        ``columns`` (columns, cells).
    """
    cells = given["modulus_ratio"].size
    columns = np.empty((len(table.columns), cells))
    for row, values in zip(columns, table.columns, strict=True):
        row[:] = values(given)
    return table.kind, table.scale, table.source, columns, table.repeats, table.once


def order_to_share(program: Program, parameters: Parameters) -> tuple[int, ...]:
    """Return the dimensions of a grid in the order that lets consecutive cells begin alike for longest.

    Those on which the film depends come first, then those of the first piece, and so on. The order is the grid's own
    where no cells have in common what takes time.

    Parameters
    ----------
    program : Program
        The loading program.
    parameters : mapping of str to ndarray
        Of one shape, with stride zero along dimensions on which they do not depend.

    Examples
    --------
    >>> from dea_maps.programs import Overdrive
    >>> from dea_maps.sweeps.grid import make_grid
    >>> grid = make_grid(Overdrive(), field=[0.8, 1.2], overdrive_field=[1.5, 2.0], overdrive_time=0.1,
    ...                  modulus_ratio=[3.0, 4.0])
    >>> list(grid.dims), order_to_share(grid.program, grid.parameters)
    (['field', 'overdrive_field', 'modulus_ratio'], (2, 1, 0))
    """
    pieces = () if isinstance(program, Waveform) else program.pieces
    first_use: dict[str, int] = {}
    for number, piece in enumerate(pieces):
        for name in piece.arguments():
            first_use.setdefault(name, number)
    lasting = next((number for number, piece in enumerate(pieces) if not isinstance(piece, Jump)), 0)
    shape = parameters["modulus_ratio"].shape
    uses = [
        min(
            (first_use.get(name, -1) for name, array in parameters.items() if size > 1 and array.strides[dim] != 0),
            default=-1,
        )
        for dim, size in enumerate(shape)
    ]
    natural = tuple(range(len(shape)))
    return tuple(sorted(natural, key=uses.__getitem__)) if max(uses, default=0) > lasting else natural


class _Multiple(NamedTuple):
    scale: float
    column: int = 0


class _SineEnd(NamedTuple):
    """The field that a sine reaches, where that is not its mean."""

    mean: "Argument | _SineEnd"
    amplitude: Argument
    cycles: Argument


_Field = Argument | _SineEnd
_Row = tuple[int, tuple[_Multiple, ...]]
_ZERO = _Multiple(0.0)


class _Builder:
    """Collects the columns that pieces need, each once."""

    def __init__(self) -> None:
        self.columns: dict[Hashable, Callable[[Parameters], Any]] = {"1": lambda given: 1.0}

    def rows(self, pieces: tuple[Piece, ...], reached: _Field) -> tuple[list[_Row], _Field]:
        """Return kind and arguments of every piece that begins at a field reached before, and the field reached."""
        rows: list[_Row] = []
        for piece in pieces:
            if isinstance(piece, Sine):
                arguments = self.value(piece.amplitude), self.cycles(piece), self.value(piece.period)
                rows.append((SINE, (self.value(reached), *arguments)))
                if isinstance(piece.cycles, str) or 2.0 * piece.cycles % 1.0:
                    reached = _SineEnd(reached, piece.amplitude, piece.cycles)
                continue
            start: _Field = reached
            end: _Field = reached
            if isinstance(piece, Hold):
                time = self.time(piece.time)
            elif isinstance(piece, Jump):
                start, end, time = piece.to, piece.to, _ZERO
            elif isinstance(piece, Linear):
                end = piece.to
                time = self.rise(start, end, piece.rate) if piece.rate is not None else self.time(piece.time)
            rows.append((LINEAR, (self.value(start), self.value(end), time, _ZERO)))
            reached = end
        return rows, reached

    def value(self, argument: _Field) -> _Multiple:
        """Return a number, a parameter, or the field that a sine reached."""
        if isinstance(argument, _SineEnd):
            return self.column(argument, lambda given: _of(argument, given))
        if not isinstance(argument, str):
            return self.column("beyond", _beyond) if argument == math.inf else _Multiple(float(argument))
        return self.column(argument, lambda given: given[argument])

    def time(self, time: Time | None) -> _Multiple:
        """Return a time, or a share of one."""
        if not isinstance(time, Share):
            return self.value(0.0 if time is None else time)
        share, of, rest = time.share, time.of, time.rest
        if isinstance(share, str):
            return self.column(time, lambda given: (1.0 - given[share] if rest else given[share]) * _of(of, given))
        whole = self.value(of)
        return _Multiple((1.0 - share if rest else share) * whole.scale, whole.column)

    def cycles(self, piece: Sine) -> _Multiple:
        """Return the duration of a sine."""
        if not isinstance(piece.cycles, str):
            period = self.value(piece.period)
            return _Multiple(float(piece.cycles) * period.scale, period.column)
        return self.column(piece, lambda given: _of(piece.cycles, given) * _of(piece.period, given))

    def rise(self, start: _Field, end: _Field, rate: Argument) -> _Multiple:
        """Return the time from one field to another at a rate."""
        if end == math.inf:
            return self.column(
                (start, end, rate), lambda given: np.maximum(_beyond(given) - _of(start, given), 0.0) / _of(rate, given)
            )
        if start == end:
            return _ZERO
        return self.column(
            (start, end, rate), lambda given: np.abs(np.subtract(_of(end, given), _of(start, given))) / _of(rate, given)
        )

    def column(self, key: Hashable, values: Callable[[Parameters], Any]) -> _Multiple:
        """Return a column of its own, made at its first use."""
        self.columns.setdefault(key, values)
        return _Multiple(1.0, list(self.columns).index(key))


def _of(argument: _Field, given: Parameters) -> Any:
    if isinstance(argument, _SineEnd):
        phase = 2.0 * math.pi * np.asarray(_of(argument.cycles, given))
        return np.add(_of(argument.mean, given), np.multiply(_of(argument.amplitude, given), np.sin(phase)))
    return given[argument] if isinstance(argument, str) else argument


def _beyond(given: Parameters) -> Any:
    """Return a field that no film sustains, the end of a rise without end: twice that of instant failure."""
    return 2.0 * np.sqrt(given["modulus_ratio"])


def _of_samples(program: Waveform, build: _Builder) -> Table:
    """Return the table of a waveform, a piece between every two samples; to its first value the field jumps."""
    (name,) = program.parameters
    pieces = program.times.size - 1
    scale = np.zeros((pieces, 4))
    scale[:, 0], scale[:, 1] = program.values[:-1], program.values[1:]
    scale[:, 2] = np.diff(program.times)
    source = np.zeros((pieces, 4), np.int64)
    source[:, :2] = build.value(name).column
    columns = tuple(build.columns.values())
    return Table(np.full(pieces, LINEAR, np.int8), scale, source, columns, program.repeats, 0, False)


def field_at(program: Program, parameters: Parameters, times: Float) -> Float:
    """Return E/Ec at given times.

    Parameters
    ----------
    program : Program
        The loading program.
    parameters : mapping of str to ndarray
        Of one shape.
    times : (..., times) ndarray
        In tau, ascending; broadcasts against the shape of the parameters and one dimension more.

    Returns
    -------
    ndarray
        Of the shape of the parameters and one dimension more; at the time of a jump, the field after it.
    """
    shape = shape_of(program)
    if shape is not None:
        held = np.inf if shape.name == "ramp" else _along(shape.field, parameters)
        rising = np.inf if shape.name == "step" else _along(shape.rate, parameters) * times
        return np.minimum(held, rising) + 0.0 * times
    table = table_of(program)
    sizes = np.broadcast_shapes(*(array.shape for array in parameters.values()))
    columns = [np.broadcast_to(column(parameters), sizes).ravel() for column in table.columns]
    grid = np.broadcast_to(times, (*sizes, times.shape[-1])).reshape(-1, times.shape[-1])
    found = np.empty(grid.shape)
    for cell in range(grid.shape[0]):
        values = table.scale * np.array([column[cell] for column in columns])[table.source]
        found[cell] = _field_of_cell(table, values, grid[cell])
    return found.reshape(*sizes, times.shape[-1])


def _along(argument: Argument | None, parameters: Parameters) -> Float:
    """Return the values of a number or a parameter, for broadcasting against times."""
    values = parameters["modulus_ratio"] * 0.0 + _of(0.0 if argument is None else argument, parameters)
    return np.asarray(values)[..., np.newaxis]


def _field_of_cell(table: Table, values: Float, times: Float) -> Float:
    """Return the field of one cell, ``values`` being the arguments of its pieces."""
    ends = np.cumsum(values[:, 2])
    first = ends[table.once - 1] if table.once else 0.0  # from here on all repetitions are the same
    cycle = ends[-1] - first if ends.size else 0.0
    cycles = np.zeros(times.shape)
    if table.repeats != 1 and cycle > 0.0:
        most = math.inf if table.repeats < 0 else table.repeats - 1.0 - (table.once > 0)
        cycles = np.clip(np.floor((times - first) / cycle), 0.0, most)
    local = times - cycles * cycle
    piece = np.minimum(np.searchsorted(ends, local, side="right"), len(ends) - 1)
    one, other, duration, period = values[piece].T
    elapsed = local - (ends[piece] - duration)
    part = elapsed / np.where(duration > 0.0, duration, 1.0)
    linear = part if table.endless else np.minimum(part, 1.0)
    rising = one + (other - one) * np.where(duration > 0.0, linear, 1.0)
    sine = one + other * np.sin(2.0 * math.pi * np.minimum(elapsed, duration) / np.where(period > 0.0, period, 1.0))
    return np.asarray(np.where(table.kind[piece] == SINE, sine, rising))


def loading_time(program: Program, parameters: Parameters) -> Float:
    """Return the time after which the field is held, or that of one repetition; zero where it never is.

    Examples
    --------
    >>> from dea_maps.programs import RampHold
    >>> loading_time(RampHold(), {"field": np.array([1.2]), "rate": np.array([0.5]), "modulus_ratio": np.array([4.0])})
    array([2.4])
    """
    table = table_of(program)
    first, later = _durations(table, parameters)
    if table.once:
        return first + later * max(table.repeats - 1, 1)
    return first * max(table.repeats, 1)


def repetition_starts(program: Program, parameters: Parameters, completed: Float) -> Float:
    """Return the time at which a repetition starts, by the number of those before it.

    Examples
    --------
    >>> from dea_maps.programs import TriangleTrain
    >>> given = {"field": np.array([1.2]), "period": np.array([0.5]), "modulus_ratio": np.array([4.0])}
    >>> repetition_starts(TriangleTrain(), given, np.array([3.0]))
    array([1.5])
    """
    first, later = _durations(table_of(program), parameters)
    return np.where(completed > 0.0, first + (completed - 1.0) * later, 0.0)


def repetitions_before(program: Program, parameters: Parameters, time: Float) -> Float:
    """Return how many repetitions of a repeated program are completed by a time.

    Examples
    --------
    >>> from dea_maps.programs import TriangleTrain
    >>> given = {"field": np.array([1.2]), "period": np.array([0.5]), "modulus_ratio": np.array([4.0])}
    >>> repetitions_before(TriangleTrain(), given, np.array([1.7]))
    array([3.])
    """
    first, later = _durations(table_of(program), parameters)
    return np.maximum(np.floor((time - (first - later)) / later), 0.0)


def _durations(table: Table, parameters: Parameters) -> tuple[Float, Float]:
    """Return the duration of the first repetition, and of each one that follows; zero of a field without an end."""
    columns = [np.broadcast_to(column(parameters), parameters["modulus_ratio"].shape) for column in table.columns]
    duration = [np.zeros_like(parameters["modulus_ratio"]) for _ in range(2)]
    if table.endless:
        return duration[0], duration[1]
    for piece, (scale, source) in enumerate(zip(table.scale[:, 2], table.source[:, 2], strict=True)):
        later = table.once <= piece
        duration[later] = duration[later] + scale * columns[source]
    return (duration[0], duration[1]) if table.once else (duration[1], duration[1])
