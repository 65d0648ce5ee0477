"""The command line: what it prints, and how it ends."""

import os
import subprocess
import sys

import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.cli.main import main
from dea_maps.files import engines

SPEC = """
[program]
name = "step"
[grid]
field = [0.9, 1.2, 1.5, 2.5]
modulus_ratio = { start = 2.0, stop = 4.0, num = 3 }
[accuracy]
rtol = 1e-5
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return the current folder, with a specification and nothing else in it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "spec.toml").write_text(SPEC)
    return tmp_path


@pytest.fixture
def made(folder, capsys):
    assert main(["sweep", "spec.toml", "-o", "map.nc"]) == 0
    capsys.readouterr()
    return folder


def assert_one_line_error(captured, words):
    assert captured.out == ""
    assert captured.err.startswith("dea-maps: error: ")
    assert captured.err.count("\n") == 1
    assert words in captured.err


def test_sweep_writes_the_map_and_one_line(folder, capsys):
    expected = dm.sweep(dm.Step(), field=[0.9, 1.2, 1.5, 2.5], modulus_ratio=[2, 3, 4], rtol=1e-5)  # also compiles
    assert main(["sweep", "spec.toml", "-o", "map.nc"]) == 0
    captured = capsys.readouterr()
    assert captured.out == "map.nc: 12 cells: 3 survives, 5 fails later, 4 fails at once, 0 unresolved\n"
    assert captured.err == ""
    xr.testing.assert_identical(xr.load_dataset("map.nc"), expected)


def test_quiet_prints_nothing(folder, capsys, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    assert main(["sweep", "spec.toml", "-o", "map.nc", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def test_dry_run_says_how_large_and_does_nothing(folder, capsys, monkeypatch):
    monkeypatch.setattr(engines, "solve", None)
    assert main(["sweep", "spec.toml", "-o", "map.nc", "--dry-run"]) == 0
    out = capsys.readouterr().out
    for words in ("step", "field 4, modulus_ratio 3", "cells                      12\n", "492", "rtol 1e-05"):
        assert words in out
    assert os.listdir(folder) == ["spec.toml"]


def test_info_says_how_and_what(made, capsys):
    assert main(["info", "map.nc"]) == 0
    lines = {line[:27].strip(): line[27:] for line in capsys.readouterr().out.splitlines()}
    assert lines["program"] == "step"
    assert lines["method"].endswith("rtol 1e-05")
    assert lines["dimensions"] == "field 4, modulus_ratio 3"
    assert lines["cells"] == "12"
    assert lines["field"] == "0.9 to 2.5"
    assert [lines[word] for word in ("survives", "fails later", "fails at once", "unresolved")] == [
        "3",
        "5",
        "4",
        "0",
    ]
    assert lines["time_to_failure"].startswith("0 to ")


def test_info_of_part_of_a_map(folder, capsys):
    dm.sweep_to_netcdf("map.nc", dm.Step(), field=0.5, modulus_ratio=4, variables=["time_to_failure"])
    assert main(["info", "map.nc"]) == 0
    out = capsys.readouterr().out
    assert "time_to_failure            no value in any cell" in out
    assert "field                      0.5\n" in out
    assert "outcome" not in out


def test_plot_draws(made, capsys):
    assert main(["plot", "map.nc", "-o", "chart.png"]) == 0
    assert capsys.readouterr() == ("", "")
    assert (made / "chart.png").read_bytes().startswith(b"\x89PNG")


FILM = """
[material]
preset = "VHB"
thickness = 50e-6
"""


def test_a_film_in_the_specification_adds_volts_and_seconds(folder, capsys):
    (folder / "spec.toml").write_text(SPEC + FILM)
    assert main(["sweep", "spec.toml", "-o", "map.nc", "--dry-run"]) == 0
    assert "film                       VHB, 50 um thick" in capsys.readouterr().out
    assert main(["sweep", "spec.toml", "-o", "map.nc", "--quiet"]) == 0
    ds = dm.sweep(dm.Step(), field=[0.9, 1.2, 1.5, 2.5], modulus_ratio=[2, 3, 4], rtol=1e-5)
    xr.testing.assert_identical(xr.load_dataset("map.nc"), dm.physical(ds, dm.VHB, 50e-6))
    assert main(["info", "map.nc"]) == 0
    out = capsys.readouterr().out
    assert "seconds_to_failure         0 to " in out
    assert " V s-1" not in out
    assert " V\n" in out


@pytest.mark.parametrize("chart", ["phase_diagram", "failure_curves", "stretch_chart"])
def test_plot_draws_the_chart_that_is_asked_for(made, capsys, chart):
    assert main(["plot", "map.nc", "-o", f"{chart}.svg", "--chart", chart, "--size", "slide"]) == 0
    assert (made / f"{chart}.svg").read_text().startswith("<?xml")


def test_design_prints_a_table_and_draws_it(folder, capsys):
    (folder / "design.toml").write_text(
        FILM.replace("50e-6", "[50e-6, 100e-6]") + "[design]\nholding_time = [1, 3600, inf]"
    )
    assert main(["design", "design.toml", "-o", "design.pdf"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split("  ")[0] == "film"
    assert [line[:12].strip() for line in lines[1:]] == ["VHB, 50 um"] * 3 + ["VHB, 100 um"] * 3
    assert [word in line for word, line in zip(("1 s", "1 h", "indefinitely"), lines[1:4], strict=True)] == [True] * 3
    assert lines[1].endswith("instability")
    assert (folder / "design.pdf").read_bytes().startswith(b"%PDF")


def test_explore_makes_a_page(made, capsys):
    pytest.importorskip("bokeh")
    dm.trajectory(dm.Step(), time=0.0, field=1.2, modulus_ratio=4.0)  # compiles, if need be, which would be said
    assert main(["explore", "map.nc", "-o", "page.html"]) == 0
    assert capsys.readouterr() == ("", "")
    assert (made / "page.html").read_text().lstrip().startswith("<!DOCTYPE html>")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "required: VERB"),
        (["sweeep"], "invalid choice: 'sweeep'"),
        (["sweep", "spec.toml"], "required: -o/--output"),
        (["sweep", "spec.toml", "-o", "map.nc", "--wet-run"], "unrecognized arguments: --wet-run"),
        (["sweep", "absent.toml", "-o", "map.nc"], "there is no file absent.toml"),
        (["sweep", "wrong.toml", "-o", "map.nc"], "wrong.toml: [grid] may have the keys"),
        (["sweep", "bounds.toml", "-o", "map.nc"], "modulus_ratio must be finite and at least 1; got 0.5"),
        (["sweep", "method.toml", "-o", "map.nc"], "method"),
        (
            ["sweep", "spec.toml", "-o", "absent/map.nc"],
            "cannot write absent/map.nc: there is no folder absent",
        ),
        (["sweep", "spec.toml", "-o", "spec.toml"], "cannot write spec.toml: it is the specification itself"),
        (["info", "absent.nc"], "there is no file absent.nc"),
        (["info", "spec.toml"], "spec.toml is not a NetCDF file"),
        (["plot", "spec.toml", "-o", "chart.png"], "spec.toml is not a NetCDF file"),
        (
            ["plot", "map.nc", "-o", "chart.gif"],
            "a chart must be a file ending in .png, .svg, .pdf; got chart.gif",
        ),
        (["plot", "point.nc", "-o", "chart.png"], "a chart needs two cells or more; got 1"),
        (["plot", "point.nc", "-o", "chart.png", "--chart", "pie"], "invalid choice: 'pie'"),
        (["explore", "point.nc", "-o", "page.pdf"], "a page must be a file ending in .html; got page.pdf"),
        (["explore", "absent.nc", "-o", "page.html"], "there is no file absent.nc"),
        (["design", "spec.toml"], "spec.toml: the file may have the tables material, design; got 'program'"),
        (["design", "spec.toml", "-o", "chart.gif"], "a chart must be a file ending in .png, .svg, .pdf; got"),
    ],
)
def test_bad_input_ends_with_2_and_one_line(folder, capsys, arguments, words):
    (folder / "wrong.toml").write_text(SPEC.replace("field", "filed"))
    (folder / "bounds.toml").write_text(SPEC.replace("start = 2.0", "start = 2.0").replace("stop = 4.0", "stop = 0.5"))
    (folder / "method.toml").write_text(SPEC + 'method = "euler"')
    dm.sweep(dm.Step(), field=1.2, modulus_ratio=4).to_netcdf("point.nc")
    before = sorted(os.listdir(folder))
    assert main(arguments) == 2
    assert_one_line_error(capsys.readouterr(), words)
    assert sorted(os.listdir(folder)) == before
    assert (folder / "spec.toml").read_text() == SPEC


@pytest.mark.parametrize(
    ("failure", "status", "words"),
    [
        (KeyboardInterrupt(), 130, "interrupted"),
        (MemoryError("no room"), 1, "no room"),
        (OSError("the disk\nis full"), 1, "the disk is full"),
        (
            ZeroDivisionError("division by zero"),
            1,
            "cells 0 to 11 could not be computed: ZeroDivisionError: division by zero",
        ),
    ],
)
def test_what_cannot_finish_ends_with_one_line_and_the_old_file(folder, capsys, monkeypatch, failure, status, words):
    def fail(*_, **__):
        raise failure

    (folder / "map.nc").write_text("old")
    monkeypatch.setattr(engines, "solve", fail)
    assert main(["sweep", "spec.toml", "-o", "map.nc"]) == status
    assert capsys.readouterr() == ("", f"dea-maps: error: {words}\n")
    assert (folder / "map.nc").read_text() == "old"
    assert sorted(os.listdir(folder)) == ["map.nc", "spec.toml"]


def test_a_grid_beyond_memory_ends_with_1(folder, capsys):
    (folder / "spec.toml").write_text(SPEC.replace("num = 3", "num = 100_000_000_000_000"))
    assert main(["sweep", "spec.toml", "-o", "map.nc"]) == 1
    assert_one_line_error(capsys.readouterr(), "grid.modulus_ratio.num asks for 100000000000000 values")


def test_help_says_all_that_is_needed_to_start(capsys):
    assert main(["--help"]) == 0
    out = capsys.readouterr().out
    for words in (
        "dea-maps sweep SPEC.toml -o OUT.nc",
        "dea-maps plot",
        "dea-maps info",
        "[program]",
        "[grid]",
        "rtol",
    ):
        assert words in out


def test_the_example_of_the_help_works(folder, capsys):
    main(["--help"])
    lines = capsys.readouterr().out.splitlines()
    first = next(number for number, line in enumerate(lines) if "[program]" in line)
    last = next(number for number, line in enumerate(lines) if "rtol =" in line)
    (folder / "example.toml").write_text("\n".join(lines[first : last + 1]))
    assert main(["sweep", "example.toml", "-o", "map.nc", "--dry-run"]) == 0
    assert "30,000" in capsys.readouterr().out


def test_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"dea-maps {dm.__version__}\n"


# Without PYTHONUNBUFFERED, which would write at once what usually waits for the end of the process.
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
RUN = [sys.executable, "-c", "import sys; from dea_maps.cli.main import main; sys.exit(main())"]


def test_the_status_reaches_the_shell(folder):
    run = subprocess.run([*RUN, "info", "absent.nc"], capture_output=True, text=True, check=False)
    assert run.returncode == 2
    assert run.stderr == "dea-maps: error: there is no file absent.nc\n"


def test_a_reader_that_has_gone_is_no_error(made):
    read_end, write_end = os.pipe()
    os.close(read_end)
    with os.fdopen(write_end, "w") as closed:
        run = subprocess.run(
            [*RUN, "info", "map.nc"], stdout=closed, stderr=subprocess.PIPE, env=ENVIRONMENT, text=True, check=False
        )
    assert run.returncode == 1
    assert run.stderr == ""


def test_progress_is_shown_on_a_terminal(folder):
    pty = pytest.importorskip("pty")
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "wb", buffering=0) as terminal:
        run = subprocess.run(
            [*RUN, "sweep", "spec.toml", "-o", "map.nc"], stdout=subprocess.PIPE, stderr=terminal, check=True
        )
        shown = os.read(ours, 10_000).decode()
    os.close(ours)
    assert "100%" in shown
    assert "12.0/12.0" in shown
    assert run.stdout.decode().startswith("map.nc: 12 cells")
