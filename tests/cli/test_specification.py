"""Specifications: what a TOML file may say, and what is said about one that is wrong."""

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import dea_maps as dm
from dea_maps.cli.specification import read_specification
from dea_maps.sweeps.grid import make_grid

STUDIES = Path(__file__).parents[2] / "studies"

GOOD = """
[program]
name = "ramp_hold"
[grid]
field = { start = 0.8, stop = 2.2, num = 100 }
rate = { start = 1e-3, stop = 1e3, num = 7, spacing = "log" }
modulus_ratio = [2.0, 3.85, 10]
[accuracy]
rtol = 1e-8
"""


@pytest.fixture
def read(tmp_path):
    def read(text):
        path = tmp_path / "spec.toml"
        path.write_text(text)
        return read_specification(path)

    return read


def test_reads_every_table(read):
    spec = read(GOOD)
    assert spec.program == dm.RampHold()
    assert list(spec.parameters) == ["field", "rate", "modulus_ratio"]
    np.testing.assert_array_equal(spec.parameters["field"], np.linspace(0.8, 2.2, 100))
    np.testing.assert_allclose(spec.parameters["rate"], [1e-3, 1e-2, 1e-1, 1, 10, 100, 1000], rtol=1e-15)
    assert spec.parameters["modulus_ratio"] == [2.0, 3.85, 10]
    assert spec.accuracy == {"rtol": 1e-8}


def test_accuracy_is_optional_and_may_name_a_method(read):
    short = '[program]\nname = "step"\n[grid]\nfield = 1.2\nmodulus_ratio = 4'
    assert read(short).accuracy == {}
    assert read(short).parameters == {"field": 1.2, "modulus_ratio": 4}
    fixed = '\n[accuracy]\nmethod = "rk4"\nformulation = "fold"\nstep = 0.01'
    assert read(short + fixed).accuracy == {"method": "rk4", "formulation": "fold", "step": 0.01}


@given(st.floats(1e-6, 1e6), st.floats(1e-6, 1e6), st.integers(2, 50), st.sampled_from(["linear", "log"]))
def test_ends_of_ranges_are_exact(tmp_path_factory, start, stop, num, spacing):
    path = tmp_path_factory.getbasetemp() / "ends.toml"
    values = f'{{ start = {start!r}, stop = {stop!r}, num = {num}, spacing = "{spacing}" }}'
    path.write_text(f'[program]\nname = "ramp"\n[grid]\nrate = {values}\nmodulus_ratio = 4')
    rate = read_specification(path).parameters["rate"]
    assert (rate[0], rate[-1], len(rate)) == (start, stop, num)
    steps = np.diff(rate if spacing == "linear" else np.log(rate))
    np.testing.assert_allclose(steps, steps.mean(), rtol=1e-6, atol=1e-9 * np.abs(rate).max())


def test_one_value_needs_no_range(read):
    assert read(GOOD.replace("stop = 2.2, num = 100", "stop = 0.8, num = 1")).parameters["field"].tolist() == [0.8]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "[grid]",
            "[gird]",
            "the file may have the tables program, grid, accuracy, material; got 'gird', to which 'grid' is near",
        ),
        ("[accuracy]", "[acuracy]", "got 'acuracy', to which 'accuracy' is nearest"),
        (
            'name = "ramp_hold"',
            'nmae = "ramp_hold"',
            "program. may have the keys name; got 'nmae', to which 'name' is",
        ),
        ('name = "ramp_hold"', "", r"\[program\] must have the key 'name'; it is missing"),
        (
            '"ramp_hold"',
            '"ramphold"',
            "program.name must be one of step, .*; got 'ramphold', to which 'ramp_hold' is",
        ),
        ('"ramp_hold"', "3", "program.name must be one of step, ramp, ramp_hold, pulse, .*; got 3"),
        (
            "\nrate =",
            "\nrat =",
            "grid. may have the keys field, rate, modulus_ratio, prestretch, stress; got 'rat', to which 'rate' is",
        ),
        (
            "num = 100",
            "nmu = 100",
            "grid.field may have the keys start, stop, num, spacing; got 'nmu', to which 'num'",
        ),
        ("rtol", "tol", "accuracy. may have the keys rtol, .*; got 'tol', to which 'rtol' is nearest"),
        ("rtol = 1e-8", 'rtol = "small"', "accuracy.rtol must be a finite number; got 'small'"),
        ("rtol = 1e-8", "rtol = true", "accuracy.rtol must be a finite number; got True"),
        ("rtol = 1e-8", "method = 3", "accuracy.method must be a string; got 3"),
        ("rtol = 1e-8", "rtol = 1e-8\nstep = 0.1", "accuracy. must have rtol or step; got both"),
        ("start = 0.8, ", "", "grid.field must have the key 'start'; it is missing"),
        ("stop = 2.2, ", "", "grid.field must have the key 'stop'; it is missing"),
        (", num = 100", "", "grid.field must have the key 'num'; it is missing"),
        ("num = 100", "num = 0", "grid.field.num must be a whole number of at least 1; got 0"),
        ("num = 100", "num = 10.0", "grid.field.num must be a whole number of at least 1; got 10.0"),
        ("num = 100", "num = true", "grid.field.num must be a whole number of at least 1; got True"),
        ("num = 100", "num = 1", "grid.field.num must be at least 2 for start and stop to differ; got 1"),
        ("start = 0.8", "start = nan", "grid.field.start must be a finite number; got nan"),
        ("start = 0.8", "start = -1", "field must be finite and at least 0; got -1.0"),
        ("start = 0.8", 'start = "0.8"', "grid.field.start must be a finite number; got '0.8'"),
        (
            "num = 100",
            'num = 100, spacing = "lin"',
            "grid.field.spacing must be .*; got 'lin', to which 'linear' is",
        ),
        ("num = 100", "num = 100, spacing = 3", "grid.field.spacing must be one of linear, log; got 3"),
        (
            "start = 0.8, stop = 2.2, num = 100",
            'start = 0, stop = 2, num = 9, spacing = "log"',
            "above 0 for spacing",
        ),
        ("3.85", '"3.85"', r"grid.modulus_ratio\[1\] must be a finite number; got '3.85'"),
        (
            "[2.0, 3.85, 10]",
            "false",
            "grid.modulus_ratio must be a number, a list or {start, stop, num}; got False",
        ),
        ("[2.0, 3.85, 10]", "inf", "grid.modulus_ratio must be a finite number; got inf"),
        ("[2.0, 3.85, 10]", "1" + 400 * "0", "grid.modulus_ratio must be a finite number"),
        ('[program]\nname = "ramp_hold"', "program = 3", r"program must be a table, \[program\]; got 3"),
        ('[program]\nname = "ramp_hold"', "", "the file must have the table 'program'; it is missing"),
        ("[grid]", "[grid", r"is not TOML: .*line 4"),
        (
            '"ramp_hold"',
            '["ramp_hold"]',
            r"program.name must be one of step, ramp, ramp_hold, pulse, .*; got \['ramp_hold'\]",
        ),
        ("modulus_ratio =", "# modulus_ratio =", r"\[grid\] must have the key 'modulus_ratio'; it is missing"),
        ('"ramp_hold"', '"ramp"', "grid.field is not taken by the program 'ramp', but rate, modulus_ratio"),
        ("[2.0, 3.85, 10]", 5000 * "[" + 5000 * "]", "is not TOML that can be read: its values are nested too deeply"),
        ("[2.0, 3.85, 10]", "1" + 5000 * "0", "is not TOML: Exceeds the limit"),
        ("start = 0.8, stop = 2.2", "start = -1.7e308, stop = 1.7e308", "grid.field must have start and stop with fin"),
        ("rtol = 1e-8", "rtol = 1.0", "rtol must be from 1e-12 to 0.001; got 1.0"),
        ("rtol = 1e-8", 'method = "euler"', "method must be one of .*; got 'euler'"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(read, old, new, message):
    assert GOOD.count(old) == 1
    with pytest.raises(ValueError, match=message) as caught:
        read(GOOD.replace(old, new))
    assert "spec.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


IN_VOLTS = """
[program]
name = "ramp_hold"
[grid]
voltage = { start = 1000, stop = 3000, num = 5 }
voltage_rate = [1.0, 100.0]
[material]
preset = "VHB"
thickness = 100e-6
"""


def test_a_film_in_volts(read):
    spec = read(IN_VOLTS)
    assert (spec.material, spec.thickness) == (dm.VHB, 100e-6)
    assert list(spec.parameters) == ["field", "rate", "modulus_ratio"]
    one = dm.VHB.critical_field * 100e-6
    np.testing.assert_allclose(spec.parameters["field"], np.linspace(1000, 3000, 5) / one, rtol=1e-15)
    np.testing.assert_allclose(spec.parameters["rate"], np.array([1.0, 100.0]) * 200.0 / one, rtol=1e-15)
    assert spec.parameters["modulus_ratio"] == dm.VHB.modulus_ratio


def test_a_film_in_ratios(read):
    spec = read(GOOD + "[material]\npreset = 'VHB'\nthickness = 1e-4\nrelaxation_time = 100")
    assert spec.parameters["modulus_ratio"] == [2.0, 3.85, 10]
    assert spec.material.relaxation_time == 100.0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("thickness = 100e-6", "", r"\[material\] must have the key 'thickness'; it is missing"),
        ("thickness = 100e-6", "thickness = 0", "material.thickness must be above 0, in m; got 0"),
        ("thickness = 100e-6", "thickness = ['thin']", r"material.thickness\[0\] must be a finite number; got 'thin'"),
        ("thickness = 100e-6", "thickness = [1e-4, 0.0]", "material.thickness must be above 0, in m; got 0.0"),
        ("thickness = 100e-6", "thickness = []", "material.thickness must have at least one value; got none"),
        ("thickness = 100e-6", "thickness = [1e-4, 2e-4]", r"spec.toml: \[material\] must be of one film; got 2 films"),
        ('"VHB"', '"VBH"', "material.preset must be one of VHB; got 'VBH', to which 'VHB' is nearest"),
        ("preset", "presett", "may have the keys .*; got 'presett', to which 'preset' is nearest"),
        ('preset = "VHB"', "relaxed_modulus = 1e4", r"\[material\] must have the key 'unrelaxed_modulus'"),
        ('preset = "VHB"', 'preset = "VHB"\nrelaxed_modulus = 1e9', "material.unrelaxed_modulus must be at least"),
        ('preset = "VHB"', 'preset = "VHB"\nbreakdown_strength = "high"', "breakdown_strength must be a finite number"),
        (
            'preset = "VHB"',
            'preset = "VHB"\nbreakdown_strength = { at_rest = 3e7 }',
            "material.breakdown_strength must have the key 'exponent'; it is missing",
        ),
        (
            'preset = "VHB"',
            "unrelaxed_modulus = 2e4\nrelaxed_modulus = 1e4\nrelaxation_time = 1",
            "must have the key 'relative_permittivity'; it is missing",
        ),
        ("voltage_rate", "field = 1\nvoltage_rate", r"\[grid\] must have field or .*; got both"),
        ("start = 1000", "start = -1000", "voltage must be finite and at least 0; got -1000.0"),
        ("[1.0, 100.0]", "0", "voltage_rate must be finite and above 0; got 0.0"),
        ("[1.0, 100.0]", "5e-324", "voltage_rate as a rate must be finite and above 0; got 0.0"),
        ("voltage_rate", "field = 1\nvoltage_rate", r"\[grid\] must have field or voltage; got both"),
        ("voltage =", "# voltage =", r"\[grid\] must have the key 'field' or 'voltage'; it is missing"),
        ('"VHB"', '["VHB"]', r"material.preset must be one of VHB; got \['VHB'\]"),
    ],
)
def test_what_is_wrong_with_a_film_is_said(read, old, new, message):
    assert IN_VOLTS.count(old) == 1 or old == "voltage_rate"
    with pytest.raises(ValueError, match=message):
        read(IN_VOLTS.replace(old, new))


def test_volts_need_a_film(read):
    with pytest.raises(
        ValueError, match="may have the keys field, rate, modulus_ratio, prestretch, stress; got 'voltage', to which"
    ):
        read(IN_VOLTS.split("[material]", maxsplit=1)[0])


def test_a_range_beyond_memory_is_refused(read):
    with pytest.raises(MemoryError, match=r"grid\.field\.num asks for 1000000000000000000 values"):
        read(GOOD.replace("num = 100", "num = 1_000_000_000_000_000_000"))


def test_a_field_beside_a_voltage_is_refused_whichever_is_first(read):
    with pytest.raises(ValueError, match=r"\[grid\] must have field or voltage; got both"):
        read(IN_VOLTS.replace("[grid]", "[grid]\nfield = 1.0"))


def test_a_long_range_is_refused_before_it_is_made(read):
    tracemalloc.start()
    try:
        with pytest.raises(MemoryError, match=r"spec.toml: grid\.field\.num asks for 1000000000 values: more than the"):
            read(GOOD.replace("num = 100", "num = 1_000_000_000"))
        assert tracemalloc.get_traced_memory()[1] < 10_000_000
    finally:
        tracemalloc.stop()


def test_a_byte_order_mark_is_passed_over(tmp_path):
    (tmp_path / "spec.toml").write_bytes(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode())
    assert read_specification(tmp_path / "spec.toml").accuracy == {"rtol": 1e-8}


def test_unreadable_files_are_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"there is no file .*absent.toml"):
        read_specification(tmp_path / "absent.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ValueError, match=r"binary.toml is not TOML"):
        read_specification(tmp_path / "binary.toml")
    with pytest.raises(IsADirectoryError, match="is not a file"):
        read_specification(tmp_path)


def test_the_cube_of_the_studies_is_a_million_cells():
    spec = read_specification(STUDIES / "vhb_cube" / "ramp_hold.toml")
    grid = make_grid(spec.program, **spec.parameters)
    assert grid.shape == (100, 100, 100)
    assert spec.accuracy == {"rtol": 1e-6}
