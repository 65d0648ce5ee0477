"""The films of the study: from its specification or from a tensile fit, and their allowable voltages."""

import csv
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr
from common.internals import as_curves, material_of, read_specification, thinned, uniaxial_stress

import dea_maps as dm

HERE = Path(__file__).resolve().parent
FREE, GROWING, CONSTANT = "no breakdown", "growing strength", "constant strength"
THIN, THICK = 50e-6, 100e-6  # m
SCATTER, SEED = 0.03, 2011
KEPT = ("first_limit", "seconds_to_failure", "seconds_to_breakdown", "critical_voltage", "critical_stretch")
"""What the file of the map keeps of it."""
_FITTED = ("unrelaxed_modulus", "relaxed_modulus", "relaxation_time")


def materials(fitted: dm.Material | None) -> dict[str, dm.Material]:
    """Return the materials of design.toml by name, with the moduli and the relaxation time of a fit if there is one."""
    tables = tomllib.loads((HERE / "design.toml").read_text(encoding="utf-8"))["material"]
    found = [material_of(table, ("thickness",)) for table in tables]
    if fitted is not None:
        found = [as_fitted(material, fitted) for material in found]
    return {material.name: material for material in found}


def as_fitted(material: dm.Material, fitted: dm.Material) -> dm.Material:
    """Return a material with the moduli and the relaxation time of another."""
    return replace(material, **{name: getattr(fitted, name) for name in _FITTED})


def write_tension(path: Path) -> None:
    """Write tensile curves of the preset, computed, with a scatter: a stand-in for measured ones."""
    stretch, rates = np.linspace(1.25, 5.0, 16), np.array([1e-3, 1e-2, 1e-1])
    vhb = dm.VHB
    stress = vhb.relaxed_modulus * uniaxial_stress(stretch, rates * vhb.relaxation_time, vhb.modulus_ratio)
    stress *= 1.0 + SCATTER * np.random.default_rng(SEED).standard_normal(stress.shape)
    curves = as_curves(
        xr.Dataset(
            {"nominal_stress": (("stretch_rate", "stretch"), stress)}, {"stretch_rate": rates, "stretch": stretch}
        )
    )
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["stretch_rate", "stretch", "nominal_stress"])
        columns = (curves[name].values for name in ("stretch_rate", "stretch", "nominal_stress"))
        table.writerows(
            [f"{rate:g}", f"{stretch:g}", f"{stress:.0f}"] for rate, stretch, stress in zip(*columns, strict=True)
        )


def borne(among: dict[str, dm.Material], times: np.ndarray) -> xr.Dataset:
    """Return the allowable voltages of films of each material: both thicknesses, the thick one at constant strength."""
    thick = {CONSTANT: [THICK]}
    sets = [dm.design(material, thick.get(name, [THIN, THICK]), times) for name, material in among.items()]
    return xr.concat(sets, "film", combine_attrs="override")


def ramp_map(material: dm.Material, most: int) -> tuple[xr.Dataset, xr.Dataset]:
    """Return the map of ramp_hold.toml in volts and seconds for a material, without and with breakdown."""
    spec = read_specification(HERE / "ramp_hold.toml")
    thin = thinned(spec.parameters, most)
    # The file means volts: its own material turned them into ratios.
    field = np.asarray(thin["field"]) * spec.material.critical_field / material.critical_field
    per_tau = spec.material.relaxation_time / material.relaxation_time
    rate = np.asarray(thin["rate"]) * spec.material.critical_field / material.critical_field / per_tau
    ds = dm.sweep(spec.program, field=field, rate=rate, modulus_ratio=material.modulus_ratio, **spec.accuracy)
    broken = dm.breakdown(ds, material.strength, rtol=1e-4)
    return tuple(dm.physical(one, material, spec.thickness) for one in (ds, broken))


def ramps(material: dm.Material, count: int) -> xr.Dataset:
    """Return what ramps of the thick film lead to, in volts and seconds, with breakdown."""
    per_second = material.critical_field * THICK / material.relaxation_time
    rate = np.geomspace(0.1, 1e4, count) / per_second
    ds = dm.sweep(dm.Ramp(), rate=rate, modulus_ratio=material.modulus_ratio)
    return dm.physical(dm.breakdown(ds, material.strength), material, THICK)
