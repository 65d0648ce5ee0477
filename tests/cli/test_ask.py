"""Questions of a designer on the command line: what is asked, what is answered, what is said of a wrong question."""

import dataclasses
import json
import math
import re

import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.cli.main import main

FILM = ["--thickness", "100um"]
EC = math.sqrt(0.75 * 4 ** (-1 / 3) * 22.8e3 / (4.7 * 8.8541878128e-12)) * 100e-6  # V, of VHB
AT_ONCE = EC * math.sqrt(87.8 / 22.8)


def asked(capsys, *words):
    """Return the answer to a question as JSON."""
    assert main(["ask", *FILM, *words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_how_long_at_a_voltage(capsys):
    found = asked(capsys, "--voltage", "2kV")
    ds = dm.sweep(dm.Step(), field=2000.0 / EC, modulus_ratio=87.8 / 22.8)
    assert found["outcome"] == "fails_later"
    assert found["seconds_to_failure"] == pytest.approx(200 * ds.time_to_failure.item(), rel=1e-5)
    assert found["critical_area_strain"] == pytest.approx(ds.critical_stretch.item() ** 2 - 1, rel=1e-5)
    assert found["allowable_voltage"] == pytest.approx(EC, rel=2e-4)
    assert main(["ask", *FILM, "--voltage", "2000"]) == 0
    out = capsys.readouterr().out
    for words in ("Under 2 kV, applied at once and held, a film of VHB, 100 um thick", "after 5.89 min", "20 % less"):
        assert words in out
    assert "Caution: no breakdown strength of VHB is known" in out


def test_the_largest_voltage_for_a_time(capsys):
    found = asked(capsys, "--hold", "10min")
    designed = dm.design(dm.VHB, 100e-6, 600.0).allowable_voltage.item()
    assert found["allowable_voltage"] == pytest.approx(designed, rel=2e-4)
    assert found["allowable_voltage"] <= designed
    assert found["voltage_sustained_indefinitely"] == pytest.approx(EC, rel=2e-4)
    assert found["voltage_of_failure_at_once"] == pytest.approx(AT_ONCE, rel=1e-9)


def test_a_ramp_that_is_held(capsys):
    found = asked(capsys, "--voltage", "2.2kV", "--rate", "50V/s")
    film = {"material": dm.VHB, "thickness": 100e-6}
    ds = dm.sweep(dm.RampHold(), voltage=2200.0, voltage_rate=50.0, **film)
    assert found["seconds_to_failure"] == pytest.approx(ds.seconds_to_failure.item(), rel=1e-5)


def test_a_cycle_once_and_again_and_again(capsys):
    cycle = ["--rise", "2s", "--hold", "60s", "--rest", "60s"]
    once = asked(capsys, "--voltage", "2.2kV", *cycle)
    assert once["outcome"] == "survives"
    assert once["allowable_voltage"] > 2200.0
    often = asked(capsys, "--voltage", "2.2kV", *cycle, "--repeat", "20")
    assert often["outcome"] == "fails_later"
    assert 5 <= often["cycles_to_failure"] < 20
    assert often["allowable_voltage"] < 2200.0
    assert f"in repetition {int(often['cycles_to_failure']) + 1}" in often["answer"]
    assert "reached in 2 s, held for 1 min, off for 1 min, repeated 20 times" in often["answer"]


def test_the_ends(capsys):
    low, high = asked(capsys, "--voltage", "1kV"), asked(capsys, "--voltage", "4kV")
    assert low["outcome"] == "survives" and low["largest_area_strain"] == pytest.approx(0.0756, rel=1e-2)
    assert high["outcome"] == "fails_at_once" and high["critical_voltage"] == pytest.approx(AT_ONCE, rel=1e-9)
    assert f"at once, at {1e-3 * AT_ONCE:.4g} kV" in high["answer"]
    loaded = asked(capsys, "--voltage", "400V", "--prestretch", "2")
    assert loaded["outcome"] == "survives" and loaded["allowable_voltage"] == pytest.approx(0.283797 * EC, rel=2e-4)


def test_a_film_of_ones_own_that_breaks_down(capsys, tmp_path):
    path = tmp_path / "film.toml"
    path.write_text('[material]\npreset = "VHB"\nname = "mine"\nbreakdown_strength = 22e6')
    found = asked(capsys, "--voltage", "2kV", "--material", str(path))
    assert found["first_limit"] == found["limited_by"] == "breakdown"
    assert found["breakdown_true_field"] == pytest.approx(22e6, rel=1e-5)
    assert "breaks down electrically after" in found["answer"]
    assert not any("no breakdown strength" in words for words in found["cautions"])
    below, above = (
        dm.sweep(
            dm.Step(),
            voltage=found["allowable_voltage"] * factor,
            material=dm.read_material(path),
            thickness=100e-6,
        ).first_limit.item()
        for factor in (1.0, 1.0002)
    )
    assert (below, above) == (0, 2)


def test_what_is_implausible_is_a_caution(capsys):
    assert main(["ask", "--thickness", "100", "--voltage", "2kV"]) == 0
    captured = capsys.readouterr()
    assert "Caution: thickness = 100 m is implausible, above 0.01 m: is it in um or mm?" in captured.out
    assert "warning" not in captured.err
    assert main(["ask", "--thickness", "100", "--hold", "1s"]) == 0
    captured = capsys.readouterr()
    assert captured.out.count("Caution: thickness") == 1
    assert "warning" not in captured.err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--voltage", "2kg"], "argument --voltage: must be a number above 0 in V, kV; got '2kg'"),
        (["--voltage", "-2"], "argument --voltage"),
        (["--hold", "0s"], "argument --hold: must be a number above 0 in s, ms, min, h, d; got '0s'"),
        (["--rate", "50"], None),
        (["--rate", "50", "--rise", "2"], "--rate and --rise must not both be given"),
        (["--rest", "2"], "--rest needs --hold"),
        (["--voltage", "2kV", "--repeat"], "--repeat needs --hold"),
        (
            ["--material", "vhb"],
            "--material must be VHB or a file ending in .toml; got 'vhb', to which 'VHB'",
        ),
        (["--material", "absent.toml"], "there is no file absent.toml"),
        (["--voltage", "2kV", "--prestretch", "0.5"], "prestretch must be finite and at least 1; got 0.5"),
        (["--hold", "2s", "--repeat", "0"], "repeat must be True, False or at least 1; got 0"),
    ],
)
def test_a_wrong_question_is_refused_in_one_line(words, message, capsys):
    status = main(["ask", *FILM, *words])
    captured = capsys.readouterr()
    if message is None:
        assert (status, captured.err) == (0, "")
        return
    assert status == 2 and captured.out == ""
    assert captured.err.startswith("dea-maps: error: ") and captured.err.count("\n") == 1
    assert message in captured.err


SPEC = """
[program]
name = "step"
[grid]
voltage = [1500.0, 2000.0]
[material]
preset = "VHB"
thickness = 100e-6
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "spec.toml").write_text(SPEC)
    return tmp_path


def test_trajectories_go_into_files_and_charts(folder, capsys):
    expected = dm.trajectory(
        dm.Step(), time_seconds=[0.0, 200.0, 400.0], voltage=[1500.0, 2000.0], material=dm.VHB, thickness=100e-6
    )
    more = ["--until", "400", "--points", "3"]
    for output in ("a.nc", "a.csv", "a.png"):
        assert main(["trajectory", "spec.toml", "-o", output, *more]) == 0
    assert capsys.readouterr() == ("", "")
    xr.testing.assert_identical(xr.load_dataset("a.nc"), expected)
    head, *rows = (folder / "a.csv").read_text().splitlines()
    columns = head.split(",")
    assert {"field", "voltage", "time", "seconds", "stretch", "area_strain", "applied_voltage"} <= set(columns)
    table = [dict(zip(columns, row.split(","), strict=True)) for row in rows]
    assert [row["seconds"] for row in table] == ["0.0", "200.0", "400.0"] * 2
    assert table[5]["stretch"] == ""  # it has failed
    assert float(table[1]["stretch"]) == expected.stretch.values[0, 1]
    assert (folder / "a.png").read_bytes().startswith(b"\x89PNG")
    assert main(["plot", "a.nc", "-o", "b.svg"]) == 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ["-o", "a.txt", "--until", "1"],
            "must be a file ending in .nc, .csv, .png, .svg, .pdf; got a.txt",
        ),
        (["-o", "a.nc", "--until", "-1"], "--until must be finite and above 0; got -1.0"),
        (["-o", "a.nc", "--until", "1", "--points", "1"], "--points must be at least 2; got 1"),
        (["-o", "absent/a.nc", "--until", "1"], "cannot write absent/a.nc: there is no folder absent"),
        (["-o", "a.nc"], "required: --until"),
    ],
)
def test_what_is_wrong_with_trajectories_is_said(folder, words, message, capsys):
    assert main(["trajectory", "spec.toml", *words]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1 and message in captured.err
    assert [path.name for path in folder.iterdir()] == ["spec.toml"]


def test_trajectories_have_no_method_of_their_own(folder, capsys):
    (folder / "spec.toml").write_text(SPEC + '[accuracy]\nmethod = "dopri5"')
    assert main(["trajectory", "spec.toml", "-o", "a.nc", "--until", "1"]) == 2
    assert "[accuracy] must have rtol alone for trajectories; got 'method'" in capsys.readouterr().err


def test_info_as_json(folder, capsys):
    assert main(["sweep", "spec.toml", "-o", "map.nc", "--quiet"]) == 0
    assert main(["info", "map.nc", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["dimensions"] == {"field": 2}
    assert found["outcomes"] == {"survives": 1, "fails_later": 1, "fails_at_once": 0, "unresolved": 0}
    assert found["parameters"]["voltage"]["units"] == "V"
    assert found["variables"]["seconds_to_failure"]["least"] == pytest.approx(353.6, rel=1e-3)
    assert found["attributes"]["program"] == "step"


def test_version_and_completion(capsys):
    assert main(["-V"]) == 0
    assert capsys.readouterr().out == f"dea-maps {dm.__version__}\n"
    pytest.importorskip("shtab")
    assert main(["--print-completion", "bash"]) == 0
    out = capsys.readouterr().out
    assert "--thickness" in out and "trajectory" in out


@pytest.mark.parametrize("columns", [60, 100])
def test_help_wraps_and_shows_defaults(columns, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(columns))
    assert main(["sweep", "--help"]) == 0
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= columns
    assert "(default: float64)" in re.sub(r"\s+", " ", out) and "None" not in out
    assert main(["--help"]) == 0
    prose = [line for line in capsys.readouterr().out.splitlines() if not line.startswith(" ")]
    assert max(map(len, prose)) <= columns


def test_several_films_of_one_specification_have_a_map_each(folder, capsys):
    text = SPEC.replace("thickness = 100e-6", "thickness = [100e-6, 50e-6]").replace("[material]", "[[material]]")
    stiff = '[[material]]\npreset = "VHB"\nunrelaxed_modulus = 150e3\nthickness = 100e-6\n'
    (folder / "spec.toml").write_text(text + stiff)
    assert main(["sweep", "spec.toml", "-o", "map.nc"]) == 0
    assert [line.split(":")[0] for line in capsys.readouterr().out.splitlines()][1::2] == [
        "map_1.nc", "map_2.nc", "map_3.nc"
    ]  # fmt: skip
    films = [(dm.VHB, 100e-6), (dm.VHB, 50e-6), (dataclasses.replace(dm.VHB, unrelaxed_modulus=150e3), 100e-6)]
    for number, (material, thickness) in enumerate(films, 1):
        expected = dm.sweep(dm.Step(), voltage=[1500.0, 2000.0], material=material, thickness=thickness)
        xr.testing.assert_identical(xr.load_dataset(f"map_{number}.nc"), expected)
    assert main(["trajectory", "spec.toml", "-o", "a.nc", "--until", "1"]) == 2
    assert "[material] must be of one film; got 3 films" in capsys.readouterr().err
