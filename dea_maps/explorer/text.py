"""The words of the interactive page: how to read it, what was left out, from what it was made."""

import numpy as np

from .. import __version__
from ..charts.plane import BREAKS_DOWN
from ..nomenclature import quantity_of, si_name
from ..outcomes import Outcome
from ..programs import ENDLESS
from .cells import REPETITIONS, RTOL, Cells, fixed_parameters, plain_label, results

_MEANT = {
    Outcome.SURVIVES: ("final_", "largest_", "steady_"),
    Outcome.FAILS_LATER: ("time_to_failure", "seconds_to_failure", "cycles_", "critical_"),
    Outcome.FAILS_AT_ONCE: ("critical_",),
    BREAKS_DOWN: ("time_to_breakdown", "seconds_to_breakdown", "breakdown_"),
}
"""With what the names of the variables begin that have a meaning for an outcome."""


def heading(cells: Cells) -> str:
    """Return the loading program and what is the same in every cell."""
    fixed = [_equation(name, value) for name, value in fixed_parameters(cells).items()]
    return ", ".join([f"Phase diagram under the program {cells.program.name.replace('_', ' ')}", *fixed])


def _equation(name: str, value: float) -> str:
    return f"{plain_label(name)} = {value:.4g}"


def facts(cells: Cells, outcome: int) -> list[str]:
    """Return the names of the variables that say something of a film of an outcome, in SI units where there are any."""
    here = cells.ds["outcome"].values == outcome
    values = results(cells)
    return [
        name
        for name, array in values.items()
        if name.startswith(_MEANT.get(outcome, ())) and si_name(name) not in values and np.isfinite(array[here]).any()
    ]


def reading(cells: Cells) -> str:
    """Return how to read the page."""
    outcomes = cells.ds["outcome"].values
    sliders = [quantity_of(axis.name).label for axis in cells.across]
    drawn = [", up to failure (cross)"]
    if (outcomes == Outcome.SURVIVES).any():
        limit = "the stretches of the limit cycle" if "steady_stretch_max" in cells.ds else "its final stretch"
        drawn.append(f", or {'with' if _cut(cells) else 'until it has nearly'} {limit} (dashed)")
    parts = [
        "Every point of the line is a film" if cells.y is None else "Every cell of the map is a film",
        ": the line is" if cells.y is None else "; its colour is",
        " the time until it fails by electromechanical instability",
        ", or breaks down, which is hatched crosswise" if (outcomes == BREAKS_DOWN).any() else "",
        ". ",
        f"{'The slider changes' if len(sliders) == 1 else 'Sliders change'} the {' and the '.join(sliders)}. "
        if sliders
        else "",
        "Point at a film for its values. Click it, or choose it with the arrow keys in the map, for its field and "
        "stretch against time",
        *drawn,
        ".",
        f" Of a program that is repeated, the first {REPETITIONS} repetitions are drawn." if _cut(cells) else "",
        " Keep a film to compare it with others. The address of the page remembers what is shown.",
    ]
    return "".join(parts)


def _cut(cells: Cells) -> bool:
    return cells.program.repeats == ENDLESS or cells.program.repeats > REPETITIONS


def notes(cells: Cells, made_from: str) -> list[str]:
    """Return what the symbols mean, what was left out, and from what the page was made."""
    ds = cells.ds
    names = [
        *fixed_parameters(cells),
        *(axis.shown for axis in cells.axes[::-1]),
        cells.times_shown[Outcome.FAILS_LATER],
    ]
    symbols = [f"{plain_label(name)}: {ds[name].attrs.get('long_name', name.replace('_', ' '))}" for name in names]
    told = [f"In words: {'; '.join(symbols)}."]
    if cells.seconds is not None:
        told.append(
            f"In SI units for a film of {ds.attrs['material']}, {1e6 * ds.attrs['thickness_in_m']:.4g} µm thick before "
            f"deformation, with a relaxation time of {cells.seconds:.4g} s."
        )
    left_out = [
        f"{axis.number} of {axis.total} values of {quantity_of(axis.name).label}"
        for axis in cells.axes[::-1]
        if axis.number < axis.total
    ]
    if left_out:
        told.append(
            f"Thinned, so that this page stays small: shown are {', '.join(left_out)}, evenly spread from the first "
            "to the last. The map itself has all."
        )
    else:
        told.append(f"All {ds['outcome'].size:,} cells of the map are shown.")
    accuracy = ", ".join(f"{name} = {ds.attrs[name]:g}" for name in ("rtol", "step") if name in ds.attrs)
    told.append(
        f"Values as in the map ({accuracy}), rounded to single precision. Curves computed for this page: "
        f"{cells.points} points each, with a relative error of the stretch of at most {RTOL:g}."
    )
    told.append(f"Made by dea_maps {__version__} from {made_from or 'a map'}. {ds.attrs.get('history', '')}")
    return told


def sentences(cells: Cells) -> dict[str, object]:
    """Return what is said of a film that is chosen, with names of its values in braces.

    ``{end}``, ``{stretch}`` and ``{strain}`` are those at the end of its curve. Of an outcome there may be a sentence
    for a film with a curve that ends with it, with another curve, and without one.
    """
    unit = "τ" if cells.seconds is None else "s"
    cycles = " ({cycles_to_failure} repetitions completed)" if "cycles_to_failure" in cells.ds else ""
    reached = f"after {{end}} {unit}{cycles} at a stretch of {{stretch}}, an area strain of {{strain}}."
    fails = f"It fails after {{{cells.times_shown[Outcome.FAILS_LATER]}}} {unit}{cycles}"
    survives = "It survives"
    if "steady_stretch_max" in cells.ds:
        survives += ": in the end its stretch stays between {steady_stretch_min} and {steady_stretch_max}"
    no_curve = "no curve is drawn, as it takes much longer than the others, or to be as accurate as asked"
    broken = f" after {{{cells.times_shown[BREAKS_DOWN]}}} {unit}" if BREAKS_DOWN in cells.times_shown else " first"
    first = f"the first {REPETITIONS} repetitions are drawn"
    whole = {Outcome.FAILS_LATER: f"It fails {reached}", BREAKS_DOWN: f"It breaks down {reached}"}
    nearly = f"after {{end}} {unit} its stretch of {{stretch}}, an area strain of {{strain}}, is nearly the final one"
    part = {
        Outcome.SURVIVES: f"{survives}; {first}." if _cut(cells) else f"It survives: {nearly}.",
        Outcome.FAILS_LATER: f"{fails}; {first}.",
    }
    none = {
        Outcome.SURVIVES: f"{survives}; {no_curve}.",
        Outcome.FAILS_LATER: f"{fails}; {no_curve}.",
        Outcome.FAILS_AT_ONCE: "It fails at once, so that there is no curve.",
        BREAKS_DOWN: f"It breaks down{broken}; no curve is drawn.",
        Outcome.UNRESOLVED: "It is unresolved, which says nothing of the film: there is no curve.",
    }
    return {
        "nothing": "Click a film in the map, or choose one with the arrow keys: its field and stretch against time are "
        "drawn here.",
        **{
            kind: {str(outcome): words for outcome, words in by_outcome.items()}
            for kind, by_outcome in (("whole", whole), ("part", part), ("none", none))
        },
    }
