"""The command line where its streams are closed, broken or narrow, and where a signal or a full disk ends it."""

import errno
import os
import signal
import subprocess
import sys
import time
import warnings

import numpy as np
import pytest
import xarray as xr
from tqdm import tqdm

import dea_maps as dm
from dea_maps.cli import streams
from dea_maps.cli.main import main
from dea_maps.files import engines

SPEC = """
[program]
name = "step"
[grid]
field = { start = 0.8, stop = 2.2, num = 13 }
modulus_ratio = { start = 2.0, stop = 6.0, num = 7 }
"""
FILM = '[material]\npreset = "VHB"\nname = "Blåhaj \N{GREEK SMALL LETTER MU}"\nthickness = 1e-4\n'
COMMAND = f"{sys.executable} -m dea_maps"
FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return the current folder, with a specification, a map, and a map that NetCDF alone has made."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "spec.toml").write_text(SPEC)
    (tmp_path / "film.toml").write_text(SPEC + FILM, encoding="utf-8")
    assert main(["sweep", "film.toml", "-o", "map.nc", "--quiet"]) == 0
    return tmp_path


def shell(line, **environment):
    return subprocess.run(
        ["sh", "-c", line], capture_output=True, check=False, env={**os.environ, **environment}, timeout=120
    )


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&- >&- 2>&-"])
def test_closed_streams(folder, closed):
    run = shell(f"{COMMAND} sweep spec.toml -o new.nc {closed}")
    assert (run.returncode, run.stderr) == (0, b"")
    expected = dm.sweep(dm.Step(), field=np.linspace(0.8, 2.2, 13), modulus_ratio=np.linspace(2, 6, 7))
    xr.testing.assert_identical(xr.load_dataset("new.nc"), expected)


def test_bad_input_keeps_its_status_where_standard_error_is_closed(folder):
    assert shell(f"{COMMAND} info absent.nc 2>&-").returncode == 2


def test_a_reader_of_standard_error_that_has_gone(folder):
    read_end, write_end = os.pipe()
    os.close(read_end)
    with os.fdopen(write_end, "w") as closed:
        run = subprocess.run(f"{COMMAND} info absent.nc", shell=True, stderr=closed, check=False)
    assert run.returncode == 2


class Full:
    """A stream on a full disk."""

    def write(self, text):
        raise FULL

    def flush(self):
        raise FULL

    def fileno(self):
        raise OSError


def test_standard_output_that_cannot_be_written_is_said(folder, capsys, monkeypatch):
    monkeypatch.setattr(sys, "stdout", Full())
    assert main(["info", "map.nc"]) == 1
    assert capsys.readouterr().err == (
        "dea-maps: error: cannot write to standard output: [Errno 28] No space left on device\n"
    )


@pytest.mark.parametrize(
    "environment",
    [{"PYTHONIOENCODING": "ascii"}, {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}],
    ids=["ascii", "C"],
)
def test_streams_of_few_characters(folder, environment):
    run = shell(f"{COMMAND} info map.nc", **environment)
    assert (run.returncode, run.stderr) == (0, b"")
    assert b"Bl\\xe5haj \\u03bc, 100 um thick" in run.stdout
    (folder / "wrong.toml").write_text(SPEC.replace("step", "ſtep"), encoding="utf-8")
    run = shell(f"{COMMAND} sweep wrong.toml -o new.nc", **environment)
    assert run.returncode == 2
    assert b"got '\\u017ftep'" in run.stderr
    assert run.stderr.count(b"\n") == 1


def test_a_name_that_is_not_utf_8(folder, capsys):
    odd = os.fsdecode(b"\xff.nc")
    assert main(["sweep", "spec.toml", "-o", odd]) == 2
    assert capsys.readouterr().err == "dea-maps: error: the name of a NetCDF file must be UTF-8; got \\xff.nc\n"
    os.rename("map.nc", odd)
    assert main(["info", odd]) == 2
    assert capsys.readouterr().err == "dea-maps: error: the name of a NetCDF file must be UTF-8; got \\xff.nc\n"
    toml = os.fsdecode(b"\xff.toml")
    os.rename("spec.toml", toml)
    assert main(["sweep", toml, "-o", "new.nc"]) == 0
    assert main(["sweep", os.fsdecode(b"\xfe.toml"), "-o", "new.nc"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


# A command line whose parts are small and slow.
SLOW = """
import sys, time
from dea_maps.cli.main import main
from dea_maps.files import engines, stream
stream.PART_CELLS = stream.CHUNK_CELLS = 7
real = engines.solve
def solve(*arguments, **options):
    time.sleep(0.05)
    return real(*arguments, **options)
engines.solve = solve
sys.exit(main(sys.argv[1:]))
"""


def test_terminated_as_by_hand(folder, capsys):
    command = [sys.executable, "-c", SLOW, "sweep", "spec.toml", "-o", "new.nc"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    parts = folder / "new.nc.parts"
    until = time.monotonic() + 60.0
    while len(list(parts.glob("*.npz"))) < 3 and time.monotonic() < until:
        time.sleep(0.01)
    process.send_signal(signal.SIGTERM)
    _, err = process.communicate(timeout=60)
    kept = len(list(parts.glob("*.npz")))
    assert process.returncode == 143
    assert err.startswith(f"dea-maps: error: terminated; {kept} of 13 parts are kept in ")
    assert err.endswith("to resume: dea-maps sweep spec.toml -o new.nc\n")
    assert err.count("\n") == 1


def test_finished_parts_are_said_beforehand(folder, capsys, monkeypatch):
    monkeypatch.setattr("dea_maps.files.stream.PART_CELLS", 7)
    monkeypatch.setattr("dea_maps.files.stream.CHUNK_CELLS", 7)
    real, calls = engines.solve, []

    def solve(*arguments, **options):
        calls.append(1)
        if len(calls) > 3:
            raise KeyboardInterrupt
        return real(*arguments, **options)

    monkeypatch.setattr(engines, "solve", solve)
    asked = ["sweep", "spec.toml", "-o", "new.nc"]
    assert main(asked) == 130
    capsys.readouterr()
    assert main([*asked, "--dry-run"]) == 0
    assert "parts                      13, of which 3 are finished\n" in capsys.readouterr().out
    assert main([*asked, "--dry-run", "--fresh"]) == 0
    assert "parts                      13\n" in capsys.readouterr().out
    (folder / "spec.toml").write_text(SPEC.replace("2.2", "2.1"))
    assert main([*asked, "--dry-run"]) == 0
    assert "parts                      13\n" in capsys.readouterr().out


def test_the_signal_is_left_as_it_was(folder, capsys):
    before = signal.getsignal(signal.SIGTERM)
    assert main(["info", "map.nc"]) == 0
    assert signal.getsignal(signal.SIGTERM) is before


def test_a_warning_is_a_line_of_its_own_above_the_bar(capsys):
    with streams.warnings_as_lines("dea-maps: warning:"), tqdm(total=3, file=sys.stderr) as bar:
        bar.update(1)
        warnings.warn("a part\nis damaged", stacklevel=1)
    err = capsys.readouterr().err
    line = next(line for line in err.split("\n") if "warning" in line)
    assert line.rsplit("\r", 1)[-1] == "dea-maps: warning: a part is damaged"


def test_one_cell(folder, capsys):
    (folder / "one.toml").write_text('[program]\nname = "step"\n[grid]\nfield = 0.5\nmodulus_ratio = 4')
    assert main(["sweep", "one.toml", "-o", "one.nc"]) == 0
    assert capsys.readouterr().out == ("one.nc: 1 cell: 1 survives, 0 fails later, 0 fails at once, 0 unresolved\n")


@pytest.mark.parametrize("name", ["map.xyz", "map", "map.nc.gz"])
def test_a_map_of_another_suffix_is_refused(folder, capsys, name):
    assert main(["sweep", "spec.toml", "-o", name]) == 2
    assert capsys.readouterr().err == f"dea-maps: error: a map must be a file ending in .nc; got {name}\n"
    assert not (folder / name).exists()


@pytest.mark.parametrize("verb", [["info"], ["plot", "-o", "c.png"], ["fit"], ["design"], ["sweep", "-o", "new.nc"]])
def test_a_missing_file_has_one_message(folder, capsys, verb):
    assert main([verb[0], "absent.file", *verb[1:]]) == 2
    assert capsys.readouterr().err == "dea-maps: error: there is no file absent.file\n"


def test_a_dry_run_says_volts(folder, capsys):
    (folder / "volts.toml").write_text(
        '[program]\nname = "step"\n[grid]\nvoltage = [1000, 2000]\n[material]\npreset = "VHB"\nthickness = 1e-4'
    )
    assert main(["sweep", "volts.toml", "-o", "volts.nc", "--dry-run"]) == 0
    assert "\nvoltage                    1000 to 2000 V\n" in capsys.readouterr().out
    assert main(["sweep", "volts.toml", "-o", "volts.nc", "--quiet"]) == 0
    assert main(["info", "volts.nc"]) == 0
    assert "\nvoltage                    1000 to 2000 V\n" in capsys.readouterr().out


def test_dask_that_is_absent_is_bad_input(folder, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(["sweep", "spec.toml", "-o", "new.nc", "--engine", "dask"]) == 2
    assert "engine 'dask' needs Dask, which comes with: pip install" in capsys.readouterr().err
    assert not list(folder.glob("new.nc*"))


def full(*_, **__):
    raise FULL


def test_a_full_disk_is_named(folder, capsys, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(np, "savez", full)
        assert main(["sweep", "spec.toml", "-o", "new.nc"]) == 1
    words = "new.nc.parts/000000.npz: No space left on device\n"
    assert capsys.readouterr().err.endswith(words)
    with monkeypatch.context() as patch:
        patch.setattr("matplotlib.figure.Figure.savefig", full)
        assert main(["plot", "map.nc", "-o", "chart.png"]) == 1
    assert capsys.readouterr().err == (
        f"dea-maps: error: cannot write {folder / 'chart.png'}: No space left on device\n"
    )
    assert not (folder / "chart.png").exists()
