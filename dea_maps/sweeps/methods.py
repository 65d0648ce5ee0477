"""The methods and formulations on offer, which serves what, and the choice for a scene."""

import difflib
import math
import numbers
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from ..checks import brief
from ..programs import PROGRAMS, Program, Shape, shape_of

SMALLEST_RTOL = 1e-12
LARGEST_RTOL = 1e-3
SMALLEST_STEP = 1e-9
"""Of a method of fixed step: with a million steps, the bound on the work of a cell, it covers a thousandth of a tau."""


@dataclass(frozen=True)
class Method:
    """A method, as listed by `methods`.

    Attributes
    ----------
    name : str
        What ``method=`` takes.
    order : int
        Order of convergence of the results on a regular formulation; 0 for a quadrature, which converges
        faster than any power.
    kind : str
        What it is, in words.
    formulations : tuple of str
        What ``formulation=`` takes with it; "auto" takes the first that serves the program.
    region : str
        Where ``rtol`` is guaranteed.
    source : str
        Where the method comes from.
    fixed_step : bool
        Whether the step is the caller's.
    """

    name: str
    order: int
    kind: str
    formulations: tuple[str, ...]
    region: str
    source: str
    fixed_step: bool = False

    @property
    def serves(self) -> dict[str, tuple[str, ...]]:
        """Names of the loading programs that it serves, by formulation, for films without a dead load."""
        return {
            form: tuple(name for name in PROGRAMS if _serves_named(self.name, form, name)) for form in self.formulations
        }

    @property
    def programs(self) -> tuple[str, ...]:
        """Names of the loading programs that it serves, on one formulation or another."""
        return tuple(dict.fromkeys(name for names in self.serves.values() for name in names))


class MethodTable(tuple[Method, ...]):
    """Methods in a tuple that prints as a table."""

    __slots__ = ()

    def __str__(self) -> str:
        """Return a table: a line a method, without regions and sources."""
        rows = [("method", "order", "kind", "formulations", "programs")]
        for entry in self:
            order = str(entry.order or "any")
            rows.append((entry.name, order, entry.kind, ", ".join(entry.formulations), ", ".join(entry.programs)))
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = ("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in rows)
        return "\n".join(line.rstrip() for line in lines)


@dataclass(frozen=True)
class Choice:
    """What a sweep is computed with.

    One of ``rtol`` and ``step`` is a number; whether the films carry a dead load; whether what cells have in common is
    integrated once for them all, see `dea_maps.runs.request.Planned`.
    """

    method: str
    formulation: str
    rtol: float | None
    step: float | None
    dead_load: bool = False
    shared: bool = False


TIME = "time"
"""The formulation that serves every program: one equation for the internal stretch, in time."""
RATE = "rate"
"""The equations as the paper prints them, for comparison: they serve every program as well."""
_SHAPES: Mapping[str, tuple[str, ...]] = {
    "stretch": ("step",),
    "area": ("ramp", "ramp_hold"),
    "fold": ("step", "ramp", "ramp_hold"),
}
"""Shapes of programs that a formulation serves, see `dea_maps.programs.Shape`; one that is not here serves all."""
_DEAD_LOAD: Mapping[str, str] = {"stretch": "quadrature", "area": "dop853"}
"""The method that serves films under a dead load, by the formulation in `_SHAPES`."""


def _serves(method: str, form: str, shape: Shape | None, dead_load: bool) -> bool:
    """Return whether a method on a formulation serves programs of a shape, or of none."""
    if form not in _SHAPES:
        return True
    return shape is not None and shape.name in _SHAPES[form] and (not dead_load or _DEAD_LOAD.get(form) == method)


def _serves_named(method: str, form: str, name: str) -> bool:
    """Return whether a method on a formulation serves every program of a name, for films without a dead load."""
    made_of_pieces = isinstance(PROGRAMS[name].__dict__.get("pieces"), tuple)
    return form not in _SHAPES or (made_of_pieces and _serves(method, form, shape_of(PROGRAMS[name]()), False))


_WHOLE_REGION = (
    "modulus_ratio from 1 to 1000, field from 0 to 1.5 sqrt(modulus_ratio), rate from 1e-6 to 1e5, every rtol; "
    "beyond, the result is as accurate as asked or unresolved"
)
_FOLD_REGION = (
    "'fold': modulus_ratio from 1 to 10, field - 1 from 1e-2 and field below 0.99 sqrt(modulus_ratio), rate from "
    "1e-2 to 1e2, rtol from 1e-10"
)

_TIME_REGION = (
    "modulus_ratio from 1 to 1000, durations and periods from 1e-3 to 1e3, any number of cycles, rtol from 1e-10, "
    "prestretch or stress to 6; beyond, the result is as accurate as asked or unresolved"
)

_DEAD_LOAD_REGION = (
    "prestretch from 1 to 6 or stress from 0 to 6, modulus_ratio from 1 to 1000, rate from 1e-6 to 1e5, rtol from "
    "1e-10; beyond, the result is as accurate as asked or unresolved"
)

_METHODS = (
    Method(
        "rk4",
        4,
        "explicit, fixed step",
        ("fold", TIME, RATE),
        "none: the step is the caller's",
        "Kutta 1901",
        fixed_step=True,
    ),
    Method(
        "dopri5",
        5,
        "explicit, adaptive",
        ("area", "fold", RATE),
        f"'area': {_WHOLE_REGION}; rtol from 1e-9; {_FOLD_REGION}; 'rate': none",
        "Dormand and Prince 1980",
    ),
    Method(
        "dop853",
        8,
        "explicit, adaptive",
        ("area", "fold", TIME, RATE),
        f"'area': {_WHOLE_REGION}; with a dead load: {_DEAD_LOAD_REGION}; 'time': {_TIME_REGION}; {_FOLD_REGION}; "
        "'rate': none",
        "Hairer, Norsett and Wanner 1993, section II.10",
    ),
    Method(
        "radau5",
        5,
        "implicit, L-stable, adaptive",
        ("area",),
        f"{_WHOLE_REGION}; rtol from 1e-7",
        "Radau IIA; Hairer and Wanner 1996, section IV.8",
    ),
    Method(
        "quadrature",
        0,
        "integral over the stretch, adaptive number of nodes",
        ("stretch",),
        f"{_WHOLE_REGION}; with prestretch from 1 to 6 or stress from 0 to 6",
        "Gauss and Legendre after subtraction of the poles",
    ),
)
_AUTOMATIC = ("quadrature", "dop853")
"""Methods that "auto" tries, in this order: the first that serves the program, on its first formulation that does."""


def methods() -> MethodTable:
    """List the methods: name, order, kind, formulations, programs served and where ``rtol`` is guaranteed.

    Returns
    -------
    MethodTable
        A tuple of `Method`, in order of appearance in the documentation; ``print`` shows it as a table.

    Examples
    --------
    >>> print(methods())  # doctest: +ELLIPSIS, +NORMALIZE_WHITESPACE
    method      order  kind                     formulations      programs
    rk4         4      explicit, fixed step     fold, time, rate        step, ramp, ramp_hold, pulse, ...
    ...
    >>> [method.name for method in methods()]
    ['rk4', 'dopri5', 'dop853', 'radau5', 'quadrature']
    """
    return MethodTable(_METHODS)


def choose(
    program: Program, method: str, formulation: str, rtol: float, step: float | None, dead_load: bool = False
) -> Choice:
    """Check what is asked of a sweep, and fill in what is left to "auto".

    Parameters
    ----------
    program : Program
        The loading program.
    method, formulation : str
        Names, or "auto".
    rtol : float
        Relative error of the results; not used by a method of fixed step.
    step : float or None
        Step length of a method of fixed step, in the formulation's independent variable.
    dead_load : bool
        Whether the films carry a dead load.

    Returns
    -------
    Choice

    Raises
    ------
    TypeError, ValueError
        If something is of the wrong kind, out of range, unknown, or does not serve the program.

    Examples
    --------
    >>> from dea_maps.programs import Ramp
    >>> choose(Ramp(), "rk4", "auto", 1e-6, 0.01)
    Choice(method='rk4', formulation='fold', rtol=None, step=0.01, dead_load=False, shared=False)
    """
    _check_number("rtol", rtol)
    if not SMALLEST_RTOL <= rtol <= LARGEST_RTOL:
        raise ValueError(f"rtol must be from {SMALLEST_RTOL} to {LARGEST_RTOL}; got {brief(rtol)}")
    shape = shape_of(program)
    served = {
        entry.name: [form for form in entry.formulations if _serves(entry.name, form, shape, dead_load)]
        for entry in _METHODS
    }
    known = {entry.name: entry for entry in _METHODS if served[entry.name]}
    forms = {form for names in served.values() for form in names}
    _check_name("method", method, known)
    _check_name("formulation", formulation, sorted(forms))
    if method == "auto":
        if step is not None:
            fixed = " or ".join(repr(name) for name, entry in known.items() if entry.fixed_step)
            raise ValueError(f"step = {brief(step)} needs a method of fixed step: method must be {fixed}; got 'auto'")
        candidates = [known[name] for name in _AUTOMATIC if name in known]
        entry = next(entry for entry in candidates if formulation == "auto" or formulation in served[entry.name])
    else:
        entry = known[method]
    form = served[entry.name][0] if formulation == "auto" else formulation
    if form not in served[entry.name]:
        raise ValueError(
            f"formulation must be one of {', '.join(map(repr, served[entry.name]))} with the method {method!r} and the "
            f"program {program.name!r}; got {form!r}"
        )
    if not entry.fixed_step:
        if step is not None:
            raise ValueError(
                f"step must be left out with the method {entry.name!r}, which finds its own; got {brief(step)}"
            )
        return Choice(entry.name, form, float(rtol), None, dead_load)
    if step is None:
        raise ValueError(f"step is missing for the method {entry.name!r}: a length above 0")
    _check_number("step", step)
    if not 0.0 < step < math.inf:
        raise ValueError(f"step must be above 0 and finite; got {brief(step)}")
    if step < SMALLEST_STEP:
        raise ValueError(f"step must be at least {SMALLEST_STEP:g}: smaller ones lead nowhere; got {brief(step)}")
    return Choice(entry.name, form, None, float(step), dead_load)


def _check_number(name: str, value: object) -> None:
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Real):
        raise TypeError(f"{name} must be a number; got {brief(value)}")


def _check_name(name: str, value: object, known: Iterable[str]) -> None:
    """Refuse a name that is neither "auto" nor known, naming the nearest one."""
    allowed = ["auto", *known]
    if not isinstance(value, str):
        raise TypeError(f"{name} must be a string; got {brief(value)}")
    if value not in allowed:
        near = difflib.get_close_matches(value, allowed, 1)
        hint = f" (nearest: {near[0]!r})" if near else ""
        raise ValueError(f"{name} must be one of {', '.join(map(repr, allowed))}; got {value!r}{hint}")
