"""Questions about one film that need no map: how long it lasts under a voltage, which voltage it sustains."""

import argparse
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..limits.allowable import allowable
from ..limits.voltages import time_in_words
from ..materials.material import Material
from ..materials.si_units import Film, check_film, one_in_si
from ..materials.toml import PRESETS, read_material
from ..outcomes import Limit, Outcome, Reason, words_of
from ..pieces import Hold, Jump, Linear, Piece
from ..plausibility import ImplausibleWarning
from ..programs import Sequence
from ..runs.maps import sweep
from ..sweeps.dead_load import film_of, largest_load
from ..toml_tables import unknown
from .quantities import at_most, volts_in_words

# Relative accuracy of a largest voltage, which is told with four digits.
_RTOL = 1e-4


@dataclass(frozen=True)
class Question:
    """What is asked: a film, and a voltage that rises, is held, falls and rests, perhaps repeatedly.

    Attributes
    ----------
    film : Film
        The film.
    voltage : float or None
        In V; None asks for the largest one.
    rate, rise : float or None
        In V/s or s, at most one: how the voltage is reached; by default at once.
    hold : float or None
        In s; by default without end.
    fall, rest : float or None
        In s, after the hold; by default the voltage ends at once.
    repeat : bool or int
        As of a `dea_maps.Sequence`.
    prestretch : float or None
        As in `dea_maps.sweep`.
    """

    film: Film
    voltage: float | None = None
    rate: float | None = None
    rise: float | None = None
    hold: float | None = None
    fall: float | None = None
    rest: float | None = None
    repeat: bool | int = False
    prestretch: float | None = None

    @property
    def program(self) -> Sequence:
        """The loading program, whose one parameter is the field."""
        one = one_in_si(*self.film)
        tau = one["time"]
        pieces: list[Piece] = [Jump("field")]
        if self.rate is not None:
            pieces = [Linear("field", rate=self.rate / one["rate"])]
        elif self.rise is not None:
            pieces = [Linear("field", time=self.rise / tau)]
        if self.hold is not None:
            pieces += [Hold(self.hold / tau), Jump(0.0) if self.fall is None else Linear(0.0, time=self.fall / tau)]
        if self.rest is not None:
            pieces += [Hold(self.rest / tau)]
        return Sequence(tuple(pieces), self.repeat)

    def loading_in_words(self) -> str:
        """Return how the voltage goes, without its value."""
        words = ["applied at once"]
        if self.rate is not None:
            words = [f"reached at {volts_in_words(self.rate)}/s"]
        elif self.rise is not None:
            words = [f"reached in {time_in_words(self.rise)}"]
        words.append("and held" if self.hold is None else f"held for {time_in_words(self.hold)}")
        if self.fall is not None:
            words.append(f"lowered to 0 in {time_in_words(self.fall)}")
        if self.rest is not None:
            words.append(f"off for {time_in_words(self.rest)}")
        if self.repeat is not False:
            words.append("repeated without end" if self.repeat is True else f"repeated {self.repeat} times")
        return ", ".join(words).replace(", and held", " and held")


def question_of(arguments: argparse.Namespace) -> Question:
    """Return what the arguments of the command line ask, once it is checked.

    Raises
    ------
    OSError, TypeError, ValueError
        If the material cannot be read, or the arguments do not go together.
    """
    if arguments.rate is not None and arguments.rise is not None:
        raise ValueError("--rate and --rise must not both be given: either says how the voltage is reached")
    if arguments.hold is None:
        for name in ("fall", "rest", "repeat"):
            if getattr(arguments, name) not in (None, False):
                raise ValueError(f"--{name} needs --hold: how long the voltage is held before it ends")
    material = _material(arguments.material)
    check_film(material, arguments.thickness)
    names = ("voltage", "rate", "rise", "hold", "fall", "rest", "repeat", "prestretch")
    return Question(Film(material, arguments.thickness), **{name: getattr(arguments, name) for name in names})


def _material(name: str) -> Material:
    """Return a preset, or what a file holds."""
    if name in PRESETS:
        return PRESETS[name]
    if Path(name).suffix.lower() != ".toml":
        raise ValueError(
            f"--material must be {', '.join(PRESETS)} or a file ending in .toml; got {unknown(name, PRESETS)}"
        )
    return read_material(name)


def answer(question: Question) -> dict[str, Any]:
    """Return the answer: numbers in SI units by name, and in words under ``answer``, ``margin`` and ``cautions``.

    Examples
    --------
    >>> from dea_maps import VHB
    >>> answer(Question(Film(VHB, 100e-6), voltage=2000.0))["margin"]
    'The largest voltage that it sustains so is 1.608 kV, 20 % less.'
    """
    material = question.film.material
    name = material.name or "the material"
    film = f"a film of {name}, {1e6 * question.film.thickness:.4g} um thick"
    if question.prestretch is not None:
        film += f", pre-stretched by a dead load to {question.prestretch:g}"
    found: dict[str, Any] = {"material": name, "thickness_in_m": question.film.thickness}
    found["loading"] = question.loading_in_words()
    with _implausible() as cautions:
        most, limit = _largest_voltage(question)
        found |= {"allowable_voltage": most, "limited_by": limit}
        at = question.voltage if question.voltage is not None else most
        cell = None if at is None else _cell(question, at)
        indefinitely, at_once = _ends(question) if question.voltage is None else (None, None)
    found |= {} if cell is None else _numbers(cell)
    if at_once is not None:
        strain = found.get("largest_area_strain")
        far = "" if strain is None else f", with an area strain of at most {100.0 * strain:.3g} %"
        found["answer"] = (
            f"Of a voltage {question.loading_in_words()}, {film} sustains at most {_most_in_words(most)}{far}."
        )
        found |= {"voltage_sustained_indefinitely": indefinitely, "voltage_of_failure_at_once": at_once}
        less = "" if question.hold is None else _compared(indefinitely, most)
        found["margin"] = f"It sustains {_most_in_words(indefinitely)} indefinitely{less}, and fails at once "
        found["margin"] += f"under a sudden voltage of {volts_in_words(at_once)}."
    elif question.voltage is not None and cell is not None:
        how = f"Under {volts_in_words(question.voltage)}, {question.loading_in_words()}, {film}"
        found["answer"] = f"{how} {_fate(cell)}."
        found["voltage"] = question.voltage
        compared = _compared(most, question.voltage)
        found["margin"] = f"The largest voltage that it sustains so is {_most_in_words(most)}{compared}."
    found["cautions"] = [*cautions, *_cautions(question, found)]
    return found


def in_words(found: dict[str, Any]) -> str:
    """Return an answer as a few lines for a terminal."""
    return "\n".join([found["answer"], found["margin"], *(f"Caution: {words}" for words in found["cautions"])])


@contextmanager
def _implausible() -> Iterator[list[str]]:
    """Yield a list that gets what is implausible, each once."""
    said: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ImplausibleWarning)
        yield said
    said += dict.fromkeys(str(warning.message) for warning in caught)


def _asked(question: Question) -> dict[str, Any]:
    return {
        "material": question.film.material, "thickness": question.film.thickness, "prestretch": question.prestretch
    }  # fmt: skip


def _cell(question: Question, voltage: float) -> xr.Dataset:
    """Return what becomes of the film under a voltage."""
    return sweep(question.program, voltage=voltage, **_asked(question))


def _largest_voltage(question: Question) -> tuple[float | None, str]:
    """Return the largest voltage without failure, None where that is undetermined, and what limits it."""
    found = allowable(question.program, "voltage", rtol=_RTOL, **_asked(question))
    if int(found["reason"]) != Reason.ANSWERED:
        return None, "unresolved"
    limit = words_of(Limit)[int(found["limit"])] if "limit" in found else "instability"
    return float(found["allowable_voltage"]) * (1.0 - _RTOL), limit


def _ends(question: Question) -> tuple[float | None, float]:
    """Return the largest voltage that the film sustains without end, and that of failure at once."""
    held = Question(question.film, prestretch=question.prestretch)
    most = _largest_voltage(held)[0]
    start = 1.0 if question.prestretch is None else question.prestretch
    cells = {"modulus_ratio": np.array(question.film.material.modulus_ratio), "prestretch": np.array(start)}
    ratio, start_stretch, load = film_of(cells)
    carried = float(largest_load(start_stretch, ratio, load) / largest_load(np.ones(1), np.ones(1), np.zeros(1))[0])
    return most, carried**0.5 * one_in_si(*question.film)["field"]


_REPORTED = (
    "seconds_to_failure", "critical_voltage", "critical_stretch", "critical_area_strain", "critical_true_field",
    "cycles_to_failure", "seconds_to_breakdown", "breakdown_voltage", "breakdown_stretch", "breakdown_area_strain",
    "breakdown_true_field", "final_stretch", "final_area_strain", "largest_stretch", "largest_area_strain",
    "steady_area_strain_max", "steady_area_strain_min",
)  # fmt: skip


def _numbers(cell: xr.Dataset) -> dict[str, Any]:
    """Return the results of a film that have a value, and words for its flags."""
    found: dict[str, Any] = {"outcome": words_of(Outcome)[int(cell["outcome"])]}
    if "first_limit" in cell:
        found["first_limit"] = words_of(Limit)[int(cell["first_limit"])]
    return found | {name: float(cell[name]) for name in _REPORTED if name in cell and np.isfinite(cell[name])}


def _fate(cell: xr.Dataset) -> str:
    """Return what becomes of a film, in words."""
    outcome, limit = int(cell["outcome"]), int(cell.get("first_limit", Limit.NONE))
    if limit == Limit.BREAKDOWN:
        return f"breaks down electrically {_when(cell, 'breakdown')}"
    if limit == Limit.UNRESOLVED or outcome == Outcome.UNRESOLVED:
        return "is undetermined at a relative accuracy of 1e-6"
    if outcome == Outcome.SURVIVES:
        if "steady_area_strain_max" in cell:
            ends = [100.0 * float(cell[f"steady_area_strain_{end}"]) for end in ("min", "max")]
            return "survives every repetition, with an area strain of {:.3g} to {:.3g} % in the end".format(*ends)
        return f"survives, with an area strain of at most {100.0 * float(cell['largest_area_strain']):.3g} %"
    return f"fails by electromechanical instability {_when(cell, 'failure')}"


def _when(cell: xr.Dataset, what: str) -> str:
    """Return when and at what stretch a film fails or breaks down."""
    at = "critical" if what == "failure" else what
    seconds = float(cell[f"seconds_to_{what}"])
    volts, stretch, strain = (float(cell[f"{at}_{name}"]) for name in ("voltage", "stretch", "area_strain"))
    when = "at once" if seconds == 0.0 else f"after {time_in_words(seconds)}"
    if what == "failure" and "cycles_to_failure" in cell:
        when += f", in repetition {int(cell['cycles_to_failure']) + 1:,}"
    return f"{when}, at {volts_in_words(volts)}, with a stretch of {stretch:.3f} (area strain {100.0 * strain:.0f} %)"


def _most_in_words(volts: float | None) -> str:
    return "an undetermined voltage" if volts is None else volts_in_words(at_most(volts))


def _compared(one: float | None, other: float | None) -> str:
    """Return how much less or more the one is than the other, behind a comma.

    Examples
    --------
    >>> _compared(1.6, 2.0), _compared(2.5, 2.0), _compared(None, 2.0)
    (', 20 % less', ', 25 % more', '')
    """
    if one is None or other is None:
        return ""
    change = 100.0 * (one / other - 1.0)
    return f", {abs(change):.2g} % {'less' if change < 0.0 else 'more'}"


def _cautions(question: Question, found: dict[str, Any]) -> list[str]:
    """Return what the user must know beside the answer."""
    material = question.film.material
    words = []
    if not question.film.limited:
        field = found.get("critical_true_field")
        if field is None and "largest_stretch" in found:
            nominal = (question.voltage or found["allowable_voltage"]) / question.film.thickness
            field = nominal * found["largest_stretch"] ** 2
        reached = "" if field is None else f" The true field reaches {1e-6 * field:.3g} MV/m."
        words.append(
            f"no breakdown strength of {material.name or 'the material'} is known, so that electrical breakdown, which "
            f"may come first, is left out.{reached}"
        )
    if material.name == "VHB" and material.source:
        words.append("the constants of VHB are a fit to one series of tests; a safety factor is the designer's choice.")
    return words
