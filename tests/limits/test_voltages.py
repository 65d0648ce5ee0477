"""Design answers: held against forward sweeps, and their tables."""

import dataclasses

import numpy as np
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.limits.voltages import describe_design

STRONG = dataclasses.replace(dm.VHB, name="strong", breakdown_strength=lambda stretch: 30e6 * stretch**1.1)
TIMES = [1e-3, 1.0, 30.0, 3600.0, 1e6]
INSTABILITY, BREAKDOWN = 1, 2

SPEC = """
[[material]]
preset = "VHB"
thickness = { start = 50e-6, stop = 100e-6, num = 2 }
[[material]]
preset = "VHB"
name = "strong"
breakdown_strength = { at_rest = 30e6, exponent = 1.1 }
thickness = 50e-6
[design]
holding_time = [1e-3, 1.0, 30.0, 3600.0, 1e6]
"""


@pytest.fixture(scope="module")
def answers(tmp_path_factory):
    path = tmp_path_factory.mktemp("design") / "spec.toml"
    path.write_text(SPEC)
    return dm.read_design(path)


@pytest.mark.parametrize("material", [dm.VHB, STRONG], ids=lambda material: material.name)
@pytest.mark.parametrize("rtol", [1e-3, 1e-8])
def test_forward_sweeps_end_where_the_answers_say(material, rtol):
    ds = dm.design(material, 70e-6, TIMES, rtol=rtol).isel(film=0)
    ends = []
    for sign in (-1, 1):
        volts = ds.allowable_voltage.values * (1 + sign * rtol)
        film = dm.sweep(
            dm.Step(),
            field=volts / (70e-6 * material.critical_field),
            modulus_ratio=material.modulus_ratio,
            rtol=1e-12,
        )
        end = film.time_to_failure.fillna(np.inf)
        if material.breakdown_strength is not None:
            film = dm.breakdown(film, material.strength, rtol=1e-10)
            end = np.fmin(end, film.time_to_breakdown.fillna(np.inf))
        ends.append(end.values * material.relaxation_time)
    assert (ends[1] <= TIMES).all()
    assert (ends[0] >= TIMES).all()


def test_what_limits_and_how_far(answers):
    assert answers.film.values.tolist() == ["VHB, 50 um", "VHB, 100 um", "strong, 50 um"]
    assert answers.limit.values[:2].tolist() == [[INSTABILITY] * 5] * 2
    assert answers.limit.values[2].tolist() == [BREAKDOWN] * 3 + [INSTABILITY] * 2
    np.testing.assert_allclose(answers.allowable_voltage[1], 2 * answers.allowable_voltage[0], rtol=1e-14)
    np.testing.assert_allclose(answers.area_strain, answers.stretch**2 - 1.0)
    np.testing.assert_allclose(answers.true_field, answers.allowable_field * answers.stretch**2)
    broken = answers.sel(film="strong, 50 um").isel(holding_time=slice(3))
    np.testing.assert_allclose(broken.true_field, 30e6 * broken.stretch**1.1, rtol=1e-12)
    reached = dm.reachable_stretch(
        xr.DataArray(broken.allowable_field.values / dm.VHB.critical_field, dims="case"),
        xr.DataArray(broken.holding_time.values / 200.0, dims="case"),
        dm.VHB.modulus_ratio,
    )
    np.testing.assert_allclose(broken.stretch, reached.reachable_stretch, rtol=1e-5)
    fails = dm.sweep(
        dm.Step(), field=answers.allowable_field.values[0] / dm.VHB.critical_field, modulus_ratio=dm.VHB.modulus_ratio
    )
    np.testing.assert_allclose(answers.stretch[0], fails.critical_stretch, rtol=1e-5)


def test_for_good():
    ds = dm.design(dm.VHB, 1e-4, np.inf)
    assert ds.allowable_field.item() == pytest.approx(dm.VHB.critical_field)
    assert ds.stretch.item() == pytest.approx(2 ** (1 / 3))


@pytest.mark.parametrize("times", ["inf", "[inf]", "[3600, inf, 1.0]", "3600", "{ start = 1, stop = 60, num = 3 }"])
def test_specified_times_may_be_infinite(times, tmp_path):
    path = tmp_path / "spec.toml"
    path.write_text(f'[material]\npreset = "VHB"\nthickness = 50e-6\n[design]\nholding_time = {times}')
    known = {"inf": [np.inf], "[inf]": [np.inf], "[3600, inf, 1.0]": [3600.0, 1.0, np.inf], "3600": [3600.0]}
    assert dm.read_design(path).holding_time.values.tolist() == known.get(times, [1.0, 30.5, 60.0])


def test_describes_itself(answers, tmp_path):
    assert answers.allowable_voltage.attrs["units"] == "V"
    assert answers.limit.attrs["flag_meanings"] == "none instability breakdown unresolved"
    assert all({"long_name", "units"} <= set(answers[name].attrs) for name in answers.data_vars)
    answers.to_netcdf(tmp_path / "design.nc")
    xr.testing.assert_identical(xr.load_dataset(tmp_path / "design.nc"), answers)
    lines = describe_design(answers).splitlines()
    assert len(lines) == 16
    assert lines[-1].split("  ")[0] == "strong, 50 um"
    assert [line.rsplit(maxsplit=1)[1] for line in lines[-5:]] == ["breakdown"] * 3 + ["instability"] * 2


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        (("VHB", 1e-4, 1.0), TypeError, "material must be a Material; got 'VHB'"),
        ((dm.Material(2e4, 1e4, 1.0), 1e-4, 1.0), ValueError, "relative_permittivity must be known"),
        ((dm.VHB, 0.0, 1.0), ValueError, "thickness must be finite and above 0, in m; got 0.0"),
        ((dm.VHB, -1.0, 1.0), ValueError, "thickness must be finite and at least 0; got -1.0"),
        ((dm.VHB, 1e-4, 0.0), ValueError, "holding_time must be above 0, in s; got 0.0"),
        ((dm.VHB, 1e-4, [[1.0]]), ValueError, "holding_time must be a number, a 1-D array or a DataArray; got"),
        ((dm.VHB, 1e-4, "long"), TypeError, "holding_time must be made of real numbers; got 'long'"),
        ((dm.VHB, 1e-4, 1.0, 1e-12), ValueError, "rtol must be from 1e-10 to 0.001; got 1e-12"),
    ],
)
def test_bad_input_is_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        dm.design(*arguments)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[design]", "[desing]", "the file may have the tables material, design; got 'desing', to which 'design' is"),
        ("holding_time =", "hold_time =", r"\[design\] may have the keys holding_time, .*rtol.*; got 'hold_time', to"),
        ("30.0, 3600.0", "30.0, -3600.0", "holding_time must be a number at least 0; got -3600.0"),
        ("30.0, 3600.0", "30.0, nan", r"design.holding_time\[3\] must be a finite number; got nan"),
        ("thickness = 50e-6", "", r"\[material\] must have the key 'thickness'; it is missing"),
        ("thickness = 50e-6", "thickness = true", "material.thickness must be a number, a list or"),
        ("[1e-3, 1.0, 30.0, 3600.0, 1e6]", "1.0\nrtol = 'small'", "design.rtol must be a finite number; got 'small'"),
        ("[1e-3, 1.0, 30.0, 3600.0, 1e6]", "1.0\nrtol = 1", "rtol must be from 1e-10 to 0.001; got 1"),
    ],
)
def test_what_is_wrong_with_a_specification_is_said(tmp_path, old, new, message):
    assert SPEC.count(old) == 1
    path = tmp_path / "spec.toml"
    path.write_text(SPEC.replace(old, new))
    with pytest.raises(ValueError, match=message) as caught:
        dm.read_design(path)
    assert "spec.toml" in str(caught.value)
