"""What Figs. 2, 4, 5(b) and 6(b)-(d) of Zhao, Koh and Suo (2011) show, and the claims of their text, computed."""

from typing import NamedTuple

import numpy as np
import xarray as xr

import dea_maps as dm

RATIO = 4.0  # of the paper's figures 5 and 6
HELD_STRETCHES = (1.5, 2.0, 3.0)
TENSION_RATES = (1e-4, 1e-3, 1e-2, 1e-1)  # per s
LARGEST_TENSION = 6.0
FIELDS = (0.5, 0.9, 1.0, 1.01, 1.05, 1.2, 1.5, 1.9)
LONGEST = 12.0
RTOL = 1e-10
JUST_ABOVE = 1e-9  # of a field, normalised by the relaxed critical field


class Claim(NamedTuple):
    """A sentence of the paper beside what its equations give."""

    where: str
    says: str
    computed: str
    holds: bool


def relaxation(nodes: int) -> xr.Dataset:
    """Fig. 2: stress at stretches that are held, uniaxial."""
    times = np.concatenate([[0.0], np.geomspace(1e-2, 5.0, nodes)])
    runs = [
        dm.general_trajectory(time=times, modulus_ratio=RATIO, stretch_1=stretch, rtol=RTOL).stress_1
        for stretch in HELD_STRETCHES
    ]
    along = xr.Variable("held_stretch", list(HELD_STRETCHES), {"long_name": "stretch that is held", "units": "1"})
    return xr.concat(runs, along).to_dataset(name="relaxation_stress").rename(time="relaxation_time")


def tension(nodes: int) -> xr.Dataset:
    """Fig. 4: nominal stress in kPa against stretch at constant stretch rates, uniaxial, the paper's VHB."""
    vhb = dm.VHB
    stretch = np.linspace(1.0, LARGEST_TENSION, nodes)
    curves = []
    for rate in TENSION_RATES:
        per_tau = rate * vhb.relaxation_time
        pull = dm.LoadHistory((0.0, (LARGEST_TENSION - 1.0) / per_tau), (1.0, LARGEST_TENSION))
        film = dm.general_trajectory(
            time=(stretch - 1.0) / per_tau, modulus_ratio=vhb.modulus_ratio, stretch_1=pull, rtol=RTOL
        )
        curves.append(film.stress_1.values * vhb.relaxed_modulus / 1e3)
    return xr.Dataset(
        {"tension_stress": (("stretch_rate", "tension_stretch"), np.array(curves), {"units": "kPa"})},
        {"stretch_rate": ("stretch_rate", list(TENSION_RATES), {"units": "s-1"}), "tension_stretch": stretch},
    )


def constant_field(nodes: int) -> xr.Dataset:
    """Fig. 5(b): stretch under fields that are switched on and held, with the failures."""
    times = np.linspace(0.0, LONGEST, nodes)
    film = dm.trajectory(dm.Step(), time=times, field=list(FIELDS), modulus_ratio=RATIO, rtol=RTOL)
    return film[["stretch", "outcome", "time_to_failure", "critical_stretch"]]


def ramps(count: int) -> xr.Dataset:
    """Fig. 6(b)-(d): field, time and stretch at failure against the ramp rate."""
    found = dm.sweep(dm.Ramp(), rate=np.geomspace(1e-3, 1e3, count), modulus_ratio=RATIO, rtol=RTOL)
    names = ("critical_field", "time_to_failure", "critical_stretch")
    return found[list(names)].rename({name: f"ramp_{name}" for name in names})


def claims(ramp: xr.Dataset) -> list[Claim]:
    """Set the numbers and sentences of section 5 beside what (17) to (26) give."""
    steady = dm.LoadHistory((0.0, 2.0), (0.0, 2.0))
    elastic = dm.general_trajectory(time=0.0, modulus_ratio=1.0, field=steady, rtol=RTOL)
    unit = (0.75 * 4.0 ** (-1.0 / 3.0)) ** 0.5
    stretch = float(elastic.critical_stretch_1)
    edges = [0.999, 1.0, 1.0 + JUST_ABOVE, 1.999, 2.0]
    step = dm.sweep(dm.Step(), field=edges, modulus_ratio=RATIO, rtol=RTOL)
    words = step.outcome.attrs["flag_meanings"].split()
    outcomes = [words[int(code)].replace("_", " ") for code in step.outcome]
    largest = float(step.critical_stretch[2])
    held = dm.general_trajectory(time=[1.0], field=1.2, modulus_ratio=RATIO, rtol=RTOL)
    printed = dm.sweep(dm.Step(), field=0.69 / unit, modulus_ratio=RATIO, rtol=RTOL)
    falling = dm.sweep(dm.Step(), field=np.linspace(1.01, 1.99, 50), modulus_ratio=RATIO, rtol=RTOL)
    lower_longer = bool((falling.time_to_failure.diff("field") < 0).all())
    lower_wider = bool((falling.critical_stretch.diff("field") < 0).all())
    rising = bool((ramp.ramp_critical_field.diff("rate") > 0).all())
    wider = bool((ramp.ramp_critical_stretch.diff("rate") < 0).all())
    after_tau, at_failure = float(held.stretch_1[0]), float(held.critical_stretch_1)
    return [
        Claim("text", "an elastic film fails at a stretch of 1.26", f"{stretch:.5f}", round(stretch, 2) == 1.26),
        Claim("text", "an elastic film fails at 0.69 sqrt(mu/eps)", f"{unit:.7f}", round(unit, 2) == 0.69),
        Claim("text", "a film below Ec never fails", f"at 0.999 Ec: {outcomes[0]}", outcomes[0] == "survives"),
        Claim("text", "a film at Ec fails after some time", f"at Ec: {outcomes[1]}", outcomes[1] == "fails later"),
        Claim(
            "text",
            "from Ec to sqrt(mu_U/mu_R) Ec a film fails after some time",
            f"just above Ec: {outcomes[2]}; at 1.999 Ec: {outcomes[3]}",
            outcomes[2] == outcomes[3] == "fails later",
        ),
        Claim(
            "text",
            "at sqrt(mu_U/mu_R) Ec and above it fails at once",
            f"at 2 Ec: {outcomes[4]}",
            outcomes[4] == "fails at once",
        ),
        Claim("Fig. 5(b)", "a stretch up to 1.85 before failure", f"{largest:.4f}", round(largest, 2) == 1.85),
        Claim(
            "Fig. 5(b)",
            "a lower field gives a longer time to failure and a higher stretch",
            f"longer: {lower_longer}, higher: {lower_wider}",
            lower_longer and lower_wider,
        ),
        Claim(
            "text",
            "1.2 Ec held for tau gives a stretch of 1.65",
            f"{after_tau:.4f}; {at_failure:.4f} at failure, at {float(held.time_to_failure):.3f} tau",
            round(after_tau, 2) == 1.65,
        ),
        Claim("Fig. 6(b)", "a lower rate gives a lower field at failure", f"{rising}", rising),
        Claim("Fig. 6(d)", "a lower rate gives a higher stretch", f"{wider}", wider),
        Claim(
            "text",
            "Ec = 0.69 sqrt(mu_R/eps), below which no film fails",
            f"at 0.69 as printed: fails, at {float(printed.time_to_failure):.1f} tau",
            bool(printed.outcome == 0),
        ),
    ]


def full_against_reduced(fields: tuple[float, ...]) -> float:
    """Return the largest relative difference of the five-state model from the equibiaxial one, at failure."""
    worst = 0.0
    for field in fields:
        full = dm.general_trajectory(time=0.0, field=field, modulus_ratio=RATIO, rtol=1e-12)
        one = dm.sweep(dm.Step(), field=field, modulus_ratio=RATIO, rtol=1e-12)
        pairs = ((full.time_to_failure, one.time_to_failure), (full.critical_stretch_2, one.critical_stretch))
        worst = max(worst, *(abs(float(a / b) - 1.0) for a, b in pairs))
    return worst
