"""The tables of the study, as Markdown."""

from dataclasses import replace

import check
import design
import numpy as np
import xarray as xr
from common.flags import word

import dea_maps as dm


def table(title: str, heads: list[str], rows: list[list[str]]) -> None:
    """Print a table."""
    print(f"## {title}\n\n| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    print("\n".join(f"| {' | '.join(row)} |" for row in rows) + "\n")


def per_cent(value: float, digits: int = 0) -> str:
    """Return a share in per cent."""
    return f"{100.0 * value:.{digits}f} %" if np.isfinite(value) else "-"


def candidates(among: xr.Dataset) -> None:
    """Print, for each pre-stretch, the voltages that give at least the stroke asked for and the longest pulses."""
    rows = []
    for prestretch in among.prestretch.values:
        one = among.sel(prestretch=prestretch)
        enough = one.strain_most - one.strain_least >= design.STROKE
        if not enough.any():
            continue
        best = one.isel(share=int(one.duty_at_worst.where(enough).argmax("share")))
        rows.append(
            [
                f"{prestretch:g}",
                f"{float(best.voltage / best.share):.0f} V",
                f"{float(best.voltage):.0f} V",
                per_cent(float(best.duty), 1),
                per_cent(float(best.duty_at_worst), 1),
                f"{per_cent(float(best.strain_least))} to {per_cent(float(best.strain_most))}",
                per_cent(float(best.strain_most - best.strain_least)),
            ]
        )
    heads = [
        "pre-stretch", "held without end", "pulses of", "allowable duty", "at worst", "area strain in use", "stroke",
    ]  # fmt: skip
    table("Pre-stretch: the longest pulses that give the stroke", heads, rows)


def decision(nominal: dm.Material, weak: dm.Material, strong: dm.Material, point: tuple[float, float, float]) -> None:
    """Print the decision, for the film as fitted, at its weakest and at its strongest."""
    voltage, duty, prestretch = point
    films = (nominal, weak, strong)
    runs = [design.swept(one, np.array([voltage]), np.array([duty]), prestretch).isel(case=0) for one in films]
    duties = [float(design.allowable_duty(one, voltage, prestretch).allowable) for one in films]
    volts = [design.allowable_voltage(one, duty, prestretch) for one in films]
    pairs = list(zip(films, runs, strict=True))
    rows = [
        ["outcome", *(word(run.outcome) for run in runs)],
        ["first limit", *(word(run.first_limit) for run in runs)],
        ["largest area strain of the limit cycle", *(per_cent(float(run.steady_area_strain_max), 1) for run in runs)],
        ["smallest", *(per_cent(float(run.steady_area_strain_min), 1) for run in runs)],
        ["stroke", *(per_cent(float(run.steady_area_strain_max - run.steady_area_strain_min), 1) for run in runs)],
        ["allowable duty", *(per_cent(one, 1) for one in duties)],
        ["margin of the duty", *(per_cent(one / duty - 1.0, 1) for one in duties)],
        ["allowable voltage at this duty", *(f"{one:.0f} V" for one in volts)],
        ["margin of the voltage", *(per_cent(one / voltage - 1.0, 1) for one in volts)],
        ["true field over the strength, at most", *(per_cent(design.breakdown_share(*two, voltage)) for two in pairs)],
    ]
    title = f"The decision: pre-stretch {prestretch:g}, {voltage:.0f} V for {duty * design.PERIOD:g} s of every "
    table(f"{title}{design.PERIOD:g} s ({per_cent(duty)})", ["", "as fitted", "weakest", "strongest"], rows)


def agreement(material: dm.Material, point: tuple[float, float, float]) -> None:
    """Print the limit cycle, by the package and by SciPy."""
    voltage, duty, prestretch = point
    ds = design.swept(material, np.array([voltage]), np.array([duty]), prestretch).isel(case=0)
    most, least, pulses = check.limit_cycle(material, voltage, duty, prestretch)
    rows = [
        ["largest area strain", f"{float(ds.steady_area_strain_max):.7f}", f"{most:.7f}"],
        ["smallest", f"{float(ds.steady_area_strain_min):.7f}", f"{least:.7f}"],
    ]
    heads = ["limit cycle, as fitted", f"rtol {design.RTOL:g}", f"SciPy, {pulses} pulses"]
    table("Agreement", heads, rows)


def margins(ds: xr.Dataset) -> None:
    """Print the allowable duty with constants off."""
    nominal, used = float(ds.as_fitted), ds.attrs["duty"]
    rows = [["none", per_cent(nominal, 1), "", f"{100.0 * (nominal / used - 1.0):+.0f} %"]]
    for name in ds.error.values:
        least, most = ds.allowable_duty.sel(error=name).values
        rows.append([str(name), per_cent(least, 1), per_cent(most, 1), f"{100.0 * (least / used - 1.0):+.0f} %"])
    heads = ["error", "allowable duty, smallest", "largest", "margin of the smallest"]
    table(f"Errors: the allowable duty, of which {per_cent(used)} are used", heads, rows)


def beyond(material: dm.Material, point: tuple[float, float, float]) -> None:
    """Print what becomes of the film as fitted at and beyond its allowable duty: forward sweeps."""
    voltage, _, prestretch = point
    allowed = float(design.allowable_duty(material, voltage, prestretch).allowable)
    factors = np.array([1.0 - 2.0 * design.RTOL, 1.0 + 2.0 * design.RTOL, 1.01, 1.05, 1.2])
    ds = design.swept(material, np.array([voltage]), allowed * factors, prestretch)
    rows = [
        [
            f"{100.0 * (factor - 1.0):+.3g} %",
            per_cent(allowed * factor, 2),
            word(one.outcome),
            f"{float(one.cycles_to_failure):.0f}" if np.isfinite(one.cycles_to_failure) else "-",
            f"{float(one.seconds_to_failure) / 60.0:.1f} min" if np.isfinite(one.seconds_to_failure) else "-",
        ]
        for factor, one in ((factors[i], ds.isel(case=i)) for i in range(factors.size))
    ]
    heads = ["from the allowable duty", "duty", "outcome", "cycles completed", "fails after"]
    table("At and beyond the allowable duty, as fitted", heads, rows)


def strengths(material: dm.Material, point: tuple[float, float, float]) -> None:
    """Print the allowable duty with other breakdown strengths."""
    voltage, duty, prestretch = point
    choices = {
        "30.6 MV/m * stretch**1.13": material,
        "half of it": with_strength(material, 0.5 * design.STRENGTH, design.EXPONENT),
        "30.6 MV/m at every stretch": with_strength(material, design.STRENGTH, 0.0),
    }
    rows = []
    for name, one in choices.items():
        found = design.allowable_duty(one, voltage, prestretch)
        fate = design.swept(one, np.array([voltage]), np.array([duty]), prestretch).isel(case=0)
        after = f" after {float(fate.seconds_to_breakdown):.0f} s" if np.isfinite(fate.seconds_to_breakdown) else ""
        answered = word(found.reason) == "answered"
        allowed = [per_cent(float(found.allowable), 1), word(found.limit)] if answered else ["none", "breakdown"]
        rows.append([name, *allowed, f"{word(fate.first_limit)}{after}"])
    heads = ["breakdown strength", "allowable duty", "limited by", f"first limit at a duty of {per_cent(duty)}"]
    table("The doubtful constant", heads, rows)


def with_strength(material: dm.Material, strength: float, exponent: float) -> dm.Material:
    """Return a material of another breakdown strength."""
    return replace(material, breakdown_strength=lambda stretch: strength * stretch**exponent)
