"""The words of the interactive page: how to read it, what was left out, from what it was made."""

from .. import __version__
from ..charts.boundaries import FAILS_AT_ONCE, FAILS_LATER, SURVIVES, UNRESOLVED
from ..charts.plane import BREAKS_DOWN
from ..nomenclature import quantity_of
from .cells import POINTS, Cells, fixed_parameters, plain_label
from .curves import RTOL


def heading(cells: Cells) -> str:
    """Return the loading program and what is the same in every cell."""
    fixed = [f"{plain_label(name)} = {value:.4g}" for name, value in fixed_parameters(cells).items()]
    return ", ".join([f"Phase diagram under the program {cells.program.name.replace('_', ' ')}", *fixed])


def reading(cells: Cells) -> str:
    """Return how to read the page."""
    outcomes = cells.ds["outcome"].values
    looks = {
        SURVIVES: "light grey: it survives indefinitely",
        FAILS_AT_ONCE: "hatched: it fails at once",
        UNRESOLVED: "black: unresolved, that is undetermined at this rtol",
        BREAKS_DOWN: "cross-hatched: it breaks down first",
    }
    met = "; ".join(words for outcome, words in looks.items() if (outcomes == outcome).any())
    parts = [
        "Every point of the line is a film" if cells.y is None else "Every cell of the map is a film",
        ": the line is" if cells.y is None else "; its colour is",
        " the time until it fails by electromechanical instability",
        f" ({met}). " if met else ". ",
        f"The slider changes the {quantity_of(cells.across.name).label}. " if cells.across is not None else "",
        "Point at a film for its values; click it for its stretch against time, up to failure (cross)",
        ", or until it has nearly its final stretch (dashed)." if (outcomes == SURVIVES).any() else ".",
    ]
    return "".join(parts)


def notes(cells: Cells, made_from: str) -> list[str]:
    """Return what the symbols mean, what was left out, and from what the page was made."""
    ds = cells.ds
    names = [*fixed_parameters(cells), *(axis.name for axis in cells.axes[::-1]), "time_to_failure"]
    symbols = [f"{plain_label(name)}: {quantity_of(name).long_name}" for name in names]
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
        f"Values as in the map ({accuracy}), rounded to single precision. Curves computed for this page: {POINTS} "
        f"points each, with a relative error of the stretch of at most {RTOL:g}."
    )
    told.append(f"Made by dea_maps {__version__} from {made_from or 'a map'}. {ds.attrs.get('history', '')}")
    return told


def sentences(cells: Cells) -> dict[str, object]:
    """Return what is said of a film when it is clicked; ``{end}`` and ``{stretch}`` are those of its curve."""
    unit = "τ" if cells.seconds is None else "s"
    curve = {
        str(SURVIVES): f"It survives: after {{end}} {unit} its stretch of {{stretch}} is nearly the final one.",
        str(FAILS_LATER): f"It fails after {{end}} {unit} at a stretch of {{stretch}}.",
        str(BREAKS_DOWN): f"It breaks down after {{end}} {unit} at a stretch of {{stretch}}.",
    }
    return {
        "nothing": "Click a film in the map, and its stretch against time is drawn here.",
        "curve": curve,
        "no_curve": "It has no curve here: it takes much longer than the others, or to be as accurate as asked.",
        str(FAILS_AT_ONCE): "It fails at once, so that there is no curve.",
        str(BREAKS_DOWN): "It breaks down while the field is switched on, so that there is no curve.",
        str(UNRESOLVED): "It is unresolved, that is undetermined at this rtol: there is no curve.",
    }
