"""The tables that the page of the study quotes, printed as Markdown."""

from collections.abc import Iterable

import decision
import films
import numpy as np
import xarray as xr
from common.flags import flag, word
from common.internals import time_in_words

import dea_maps as dm

HOLDS = np.array([1.0, 10.0, 60.0, 600.0, 3600.0, 86400.0, 604800.0, np.inf])
MARGINS = (0.01, 0.02, 0.05, 0.10, 0.20)
STRAINS = np.array([0.2, 0.4, 0.6, 0.8, 1.0, 1.5])
RAMPS = np.array([0.1, 1.0, 10.0, 100.0, 1e3, 1e4])  # V/s


def table(title: str, heads: Iterable[str], rows: Iterable[Iterable[str]]) -> None:
    """Print a table."""
    heads = list(heads)
    print(f"{title}\n\n| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    for row in rows:
        print(f"| {' | '.join(row)} |")
    print()


def volts(field: float, thickness: float) -> str:
    """Return a nominal field in V/m as the voltage over a film."""
    return f"{field * thickness:.0f} V"


def per_cent(ratio: float, digits: int = 0) -> str:
    """Return a ratio in per cent."""
    return "-" if np.isnan(ratio) else f"{100.0 * ratio:.{digits}f} %"


def lost_after(seconds: float) -> str:
    """Return in words when a film is lost."""
    return time_in_words(seconds) if np.isfinite(seconds) else "never"


def borne(among: dict[str, dm.Material]) -> None:
    """Print the allowable voltages of films for some times, with each of the breakdown strengths."""
    found = {name: dm.design(material, [films.THIN, films.THICK], HOLDS) for name, material in among.items()}
    growing = found[films.GROWING]
    rows = [
        [
            time_in_words(hold),
            *(volts(float(growing.allowable_field[film, i]), (films.THIN, films.THICK)[film]) for film in (0, 1)),
            word(growing.limit[0, i]),
            per_cent(float(growing.area_strain[0, i])),
            *(volts(float(found[name].allowable_field[1, i]), films.THICK) for name in (films.FREE, films.CONSTANT)),
        ]
        for i, hold in enumerate(HOLDS)
    ]
    heads = ["held", "50 um", "100 um", "limited by", "area strain then", "100 um, no breakdown", "100 um, constant"]
    table("Allowable voltages", heads, rows)
    last = decision.crossover(among[films.GROWING], HOLDS[0], HOLDS[-2])
    print(f"with the growing strength, breakdown limits what is held for up to {time_in_words(last)}\n")


def margins(material: dm.Material) -> None:
    """Print the area strain in the end at some distances below the allowable voltage."""
    rows = []
    for hold in HOLDS[:-1]:
        limit = decision.allowable(material, hold)
        strains = [decision.strain(material, limit * (1.0 - margin), hold)[0] for margin in MARGINS]
        rows.append([time_in_words(hold), *(per_cent(strain) for strain in strains)])
    heads = ["held", *(f"{100 * margin:g} % below" for margin in MARGINS)]
    table("Area strain in the end, below the allowable voltage", heads, rows)


def haste(material: dm.Material) -> None:
    """Print what it takes to be fast."""
    ready = HOLDS[:5]
    fields = decision.needed([material], np.full(ready.shape, decision.STRAIN), ready)[0]
    rows = [
        [time_in_words(time), volts(field, films.THICK), volts(limit, films.THICK), per_cent(limit / field - 1.0, 1),
         lost_after(life)]
        for time, field, limit, life in zip(
            ready, fields, decision.allowable(material, ready), decision.lifetime(material, fields), strict=True
        )
    ]  # fmt: skip
    heads = ["reached within", "needs", "allowable for as long", "margin", "fails after"]
    table(f"{per_cent(decision.STRAIN)} of area strain, 100 um", heads, rows)


def ramps(material: dm.Material) -> None:
    """Print where ramps lead, and the fastest that lead far enough."""
    one = material.critical_field * films.THICK
    rate, ratio = RAMPS / one * material.relaxation_time, material.modulus_ratio
    ds = dm.breakdown(dm.sweep(dm.Ramp(), rate=rate, modulus_ratio=ratio), material.strength)
    ds = dm.physical(ds, material, films.THICK)
    lost = ds.first_limit == flag(ds.first_limit, "breakdown")
    voltage = ds.breakdown_voltage.where(lost, ds.critical_voltage)
    stretch = ds.breakdown_stretch.where(lost, ds.critical_stretch)
    time = ds.seconds_to_breakdown.where(lost, ds.seconds_to_failure)
    rows = [
        [
            f"{RAMPS[i]:g} V/s",
            f"{float(ds.critical_voltage[i]):.0f} V",
            per_cent(float(ds.critical_stretch[i]) ** 2 - 1.0),
            f"{float(voltage[i]):.0f} V",
            per_cent(float(stretch[i]) ** 2 - 1.0),
            lost_after(float(time[i])),
            word(ds.first_limit[i]),
        ]
        for i in range(RAMPS.size)
    ]
    heads = ["ramp", "without breakdown", "area strain", "with it", "area strain", "after", "what comes first"]
    table("Where ramps lead, 100 um", heads, rows)

    stretches = np.sqrt(1.0 + STRAINS)
    free = dm.allowable_rate(stretches, ratio)
    bound = dm.allowable_rate(stretches, ratio, strength=material.strength)
    words = {"always": "any", "never": "none"}
    rows = []
    for i, area_strain in enumerate(STRAINS):
        cells = [per_cent(area_strain)]
        for found in (free, bound):
            known = float(found.allowable_rate[i]) * one / material.relaxation_time
            cells.append(f"{known:.3g} V/s" if np.isfinite(known) else words[word(found.reason[i])])
        rows.append([*cells, word(bound.limit[i])])
    table("Fastest ramps to an area strain, 100 um", ["area strain", "no breakdown", "with it", "limited by"], rows)


def errors(material: dm.Material, decided: float) -> None:
    """Print what an error of each number does to the allowable voltage and to the one needed."""
    rows, holds = [], np.array([10.0, 60.0, 600.0, 3600.0, 86400.0])
    as_known = decision.allowable(material, holds)
    need = decision.needed([material], decision.STRAIN, decision.READY)[0]
    pairs = {name: [decision.changed(material, **{name: sign}) for sign in (-1, 1)] for name in decision.NUMBERS}
    pairs["breakdown_strength"] = [decision.stronger(material, sign) for sign in (-1, 1)]
    for name, pair in pairs.items():
        changes = [decision.allowable(one, holds) / as_known - 1.0 for one in pair]
        needs = decision.needed(pair, decision.STRAIN, decision.READY)[:, 0] / need - 1.0
        ends = [decision.strain(one, decided, decision.HOLD)[0] for one in pair]
        cells = [f"{100 * low:+.1f}, {100 * high:+.1f} %" for low, high in zip(*changes, strict=True)]
        cells += [f"{100 * needs[0]:+.1f}, {100 * needs[1]:+.1f} %", f"{per_cent(ends[0])}, {per_cent(ends[1])}"]
        rows.append([name.replace("_", " "), *cells])
    heads = ["5 % less, more", *(f"allowable, {time_in_words(hold)}" for hold in holds), "needed", "strain after 1 h"]
    table("What errors do", heads, rows)


def windows(ds: xr.Dataset) -> None:
    """Print the windows of voltages."""
    rows = [
        [
            per_cent(float(one.area_strain)),
            volts(float(one.needed), films.THIN),
            per_cent(float(ds.allowable / one.needed) - 1.0, 1),
            per_cent(float(one.strain_in_the_end)),
            volts(float(one.needed_at_most), films.THIN),
            f"{100.0 * (float(ds.allowable_at_least / one.needed_at_most) - 1.0):+.1f} %",
        ]
        for one in (ds.isel(area_strain=i) for i in range(ds.sizes["area_strain"]))
    ]
    heads = ["area strain", "needed, 50 um", "margin", "area strain after 1 h", "needed at worst", "margin at worst"]
    table("Windows: reached within 10 min, held until 1 h", heads, rows)
    print(
        f"allowable for 1 h, 50 um: {volts(float(ds.allowable), films.THIN)}, at worst "
        f"{volts(float(ds.allowable_at_least), films.THIN)}; indefinitely {volts(ds.critical_field, films.THIN)}\n"
    )


def decided(material: dm.Material, field: float) -> None:
    """Print the decision."""
    times = np.array([1.0, decision.READY, decision.HOLD])
    strains = decision.strain(material, field, times)
    uncertain = decision.corners(material)
    spread = np.array([decision.strain(one, field, times) for one in uncertain])
    holds = np.array([decision.HOLD, np.inf])
    (limit, for_good), (least, least_for_good) = (
        decision.allowable(material, holds),
        np.min([decision.allowable(one, holds) for one in uncertain], axis=0),
    )
    stretch = np.sqrt(1.0 + strains[-1])
    strength = float(material.strength(np.array([stretch]))[0]) * material.critical_field
    fields = {
        "voltage": field,
        "allowable for 1 h": limit,
        "allowable for 1 h, at worst": least,
        "allowable indefinitely": for_good,
        "allowable indefinitely, at worst": least_for_good,
    }
    rows = [[name, volts(value, films.THIN), volts(value, films.THICK)] for name, value in fields.items()]
    same = {
        "margin": per_cent(limit / field - 1.0, 1),
        "margin at worst": per_cent(least / field - 1.0, 1),
        "nominal field": f"{field / 1e6:.1f} MV/m",
        "normalised by the relaxed critical field": f"{field / material.critical_field:.3f}",
        "true field after 1 h": f"{field * stretch**2 / 1e6:.1f} MV/m",
        "breakdown strength there": f"{strength / 1e6:.1f} MV/m",
        **{
            f"area strain after {time_in_words(time)}": f"{per_cent(strain)} ({per_cent(low)} to {per_cent(high)})"
            for time, strain, low, high in zip(times, strains, spread.min(axis=0), spread.max(axis=0), strict=True)
        },
    }
    rows += [[name, value, "the same"] for name, value in same.items()]
    title = f"The decision: {per_cent(decision.STRAIN)} within 10 min, until 1 h (in brackets: at worst)"
    table(title, ["", "50 um", "100 um"], rows)


def after_fit(film: dm.Material, fitted: dm.Material) -> None:
    """Print what a design with the fitted material says, beside that with the one of the study."""
    fields = [
        [float(decision.allowable(one, 10.0)), float(decision.allowable(one, decision.HOLD)), decision.decided(one)]
        for one in (film, fitted)
    ]
    rows = [
        [words, *(volts(field, films.THIN) for field in pair), f"{100.0 * (pair[1] / pair[0] - 1.0):+.1f} %"]
        for words, pair in zip(
            ("allowable for 10 s", "allowable for 1 h", "the decision"), zip(*fields, strict=True), strict=True
        )
    ]
    table("After the fit, 50 um", ["", film.name, "fitted", "apart"], rows)


def agreement(ds: xr.Dataset) -> None:
    """Print the worst distances of answers from forward computations."""
    rows = []
    for name in ds.answer.values:
        one = ds.sel(answer=name)
        rows.append(
            [
                str(name),
                str(int(one.cells)),
                *("< 0.001" if value < 1e-3 else f"{value:.2g}" for value in one.worst.values),
            ]
        )
    table("Worst distance over rtol", ["answer", "cases", *(f"rtol {rtol:.0e}" for rtol in ds.rtol.values)], rows)
