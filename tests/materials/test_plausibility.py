"""Slips of units: a warning names the value, and the scales of a film are said in all units."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.cli.main import main
from dea_maps.materials.uniaxial import uniaxial_stress

SPEC = """
[program]
name = "ramp_hold"
[grid]
voltage = [1500, 2200]
voltage_rate = 8
[material]
preset = "VHB"
thickness = 100e-6
"""
DESIGN = '[material]\npreset = "VHB"\nthickness = 100e-6\n[design]\nholding_time = [1, 3600]\n'


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


SLIPS = {
    "thickness in um": ("thickness = 100e-6", "thickness = 100", "thickness = 100 m is implausible"),
    "thickness in mm": ("thickness = 100e-6", "thickness = 0.1", "thickness = 0.1 m is implausible"),
    "thickness in km": ("thickness = 100e-6", "thickness = 1e-7", "thickness = 1e-07 m is implausible"),
    "voltage in kV": ("[1500, 2200]", "[1.5, 2.2]", "(VHB, 100 um, 2.2 V = 22 kV/m = 0.00137 Ec) is implaus"),
    "field in V/m": ("voltage = [1500, 2200]", "field = 22e6", "field = 2.2e+07 Ec is implausible, above 196.2 Ec"),
    "rate in MV/s": ("voltage_rate = 8", "voltage_rate = 1e-10", "rate = 1.243"),
    "modulus in kPa": ('"VHB"', '"VHB"\nrelaxed_modulus = 22.8', "relaxed_modulus = 22.8 Pa is implausible, below"),
    "modulus in mPa": ('"VHB"', '"VHB"\nunrelaxed_modulus = 9e8', "unrelaxed_modulus = 9e+08 Pa is implausible"),
    "time in ns": ('"VHB"', '"VHB"\nrelaxation_time = 2e11', "relaxation_time = 2e+11 s is implausible, above"),
    "strength in MV/m": ('"VHB"', '"VHB"\nbreakdown_strength = 40', "breakdown_strength = 40 V/m is implausible"),
    "permittivity": ('"VHB"', '"VHB"\nrelative_permittivity = 470', "relative_permittivity = 470 is implausible"),
}  # fmt: skip


@pytest.mark.parametrize("name", SLIPS)
def test_a_slip_of_units_is_said_once(folder, capsys, name):
    old, new, words = SLIPS[name]
    assert old in SPEC
    (folder / "spec.toml").write_text(SPEC.replace(old, new))
    assert main(["sweep", "spec.toml", "-o", "map.nc", "--dry-run"]) == 0
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == len(set(lines))
    (line,) = [line for line in lines if words in line]
    assert line.startswith("dea-maps: warning: ") and line.endswith("?")


def test_what_is_plausible_is_not_warned_of(folder, capsys):
    (folder / "spec.toml").write_text(SPEC)
    (folder / "design.toml").write_text(DESIGN)
    assert main(["sweep", "spec.toml", "-o", "map.nc"]) == 0
    assert main(["info", "map.nc"]) == 0
    assert main(["design", "design.toml"]) == 0
    assert capsys.readouterr().err == ""


def test_a_refusal_remains_one_line(folder, capsys):
    (folder / "spec.toml").write_text(SPEC.replace("100e-6", "100") + "[accuracy]\nrtol = 2\n")
    assert main(["sweep", "spec.toml", "-o", "map.nc"]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1 and "rtol must be" in err


def test_the_scales_are_said(folder, capsys):
    (folder / "spec.toml").write_text(SPEC)
    said = "VHB, 100 um, 1.5 to 2.2 kV = 15 to 22 MV/m = 0.932 to 1.37 Ec, 8 V/s = 80 kV/m/s = 0.994 Ec per 200 s"
    assert main(["sweep", "spec.toml", "-o", "map.nc", "--dry-run"]) == 0
    assert f"scales                     {said}\n" in capsys.readouterr().out
    assert main(["sweep", "spec.toml", "-o", "map.nc"]) == 0
    assert capsys.readouterr().out.splitlines()[0] == said
    assert main(["info", "map.nc"]) == 0
    assert f"scales                     {said}\n" in capsys.readouterr().out
    assert main(["sweep", "spec.toml", "-o", "map.nc", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def test_a_design_is_said_in_critical_fields_too(folder, capsys):
    (folder / "design.toml").write_text(DESIGN)
    assert main(["design", "design.toml"]) == 0
    head, first, _ = capsys.readouterr().out.splitlines()
    answers = dm.read_design("design.toml")
    ratio = answers.allowable_voltage.values[0, 0] / (100e-6 * dm.VHB.critical_field)
    assert "E/Ec" in head and f"{ratio:.3g} Ec" in first
    (folder / "design.toml").write_text(DESIGN.replace("100e-6", "100").replace("3600", "1e11"))
    assert main(["design", "design.toml"]) == 0
    lines = capsys.readouterr().err.splitlines()
    assert [line.split()[2] for line in lines] == ["thickness", "holding_time"]


def test_a_column_in_kilopascals(folder, capsys):
    stretch, rates = np.linspace(1.2, 4.0, 8), np.array([1e-3, 1e-2])
    stress = 22.8 * uniaxial_stress(stretch, rates * 200.0, 3.85)
    rows = [f"{k},{x},{s}" for k, line in zip(rates, stress, strict=True) for x, s in zip(stretch, line, strict=True)]
    (folder / "data.csv").write_text("\n".join(["stretch_rate,stretch,nominal_stress", *rows]))
    assert main(["fit", "data.csv"]) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert "nominal_stress = " in line and line.endswith("is implausible, below 1000 Pa: is the column in kPa or MPa?")


def test_python_warns_with_a_class_of_its_own():
    assert issubclass(dm.ImplausibleWarning, UserWarning)
    with pytest.warns(dm.ImplausibleWarning, match="field = 2.2e.07 Ec is implausible, above 200 Ec: is it in V"):
        ds = dm.sweep(dm.Step(), field=[1.2, 22e6], modulus_ratio=4.0)
    with pytest.warns(dm.ImplausibleWarning, match="thickness = 100 m"):
        dm.physical(ds, dm.VHB, 100)
    soft = replace(dm.VHB, unrelaxed_modulus=87.8, relaxed_modulus=22.8)
    with pytest.warns(dm.ImplausibleWarning) as caught:
        dm.design(soft, 1e-4, 1.0)
    assert [str(warning.message).split()[0] for warning in caught] == ["unrelaxed_modulus", "relaxed_modulus"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        dm.sweep(dm.Step(), field=xr.DataArray([199.0, 0.0], dims="x"), modulus_ratio=4.0)
        dm.sweep(dm.Step(), field=[], modulus_ratio=4.0)
