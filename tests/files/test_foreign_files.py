"""What the command line says of files that are damaged, foreign or changed: one line that names the file, and 2."""

import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.cli.main import main
from dea_maps.files import netcdf

VERBS = {"info": [], "plot": ["-o", "chart.svg"], "explore": ["-o", "page.html"]}
MUTATE = """
import contextlib, io, sys, warnings
import numpy as np
from dea_maps.cli.main import main
warnings.simplefilter("ignore")
data, rng = open("map.nc", "rb").read(), np.random.default_rng(int(sys.argv[1]))
for number in range(120):
    mutant, place = bytearray(data), rng.integers(len(data))
    if number % 3:
        mutant[place] ^= 1 << rng.integers(8)
    else:
        del mutant[place:]
    open("changed.nc", "wb").write(mutant)
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = main(["info", "changed.nc"])
    said = err.getvalue()
    refused = status == 2 and said.startswith("dea-maps: error: changed.nc ") and said.count("\\n") == 1
    whole = status == 0 and said == "" and "\\x1b" not in out.getvalue()
    print("refused" if refused else "whole" if whole else (number, status, said))
"""


def film():
    ds = dm.sweep(dm.RampHold(), field=[0.9, 1.2, 1.5], rate=[0.1, 1.0], modulus_ratio=4.0)
    return dm.physical(ds, dm.VHB, 1e-4)


def without(name):
    return lambda ds: ds.drop_attrs(deep=False).assign_attrs({key: ds.attrs[key] for key in ds.attrs if key != name})


CHANGES = {
    "a rate of zero": (
        lambda ds: ds.assign_coords(rate=ds.rate.copy(data=[0.0, 0.0])),
        "rate must be finite and above 0; got 0.0",
    ),
    "no flag": (
        lambda ds: ds.assign(outcome=ds.outcome.copy(data=ds.outcome.values + np.int8(7))),
        "an outcome is none of the flags",
    ),
    "no program": (without("program"), "it lacks 'program'"),
    "no accuracy": (without("rtol"), "it does not say how accurate it is"),
    "a program of numbers": (lambda ds: ds.assign_attrs(program=[1.0, 2.0]), "its attribute program must be a string"),
    "a thickness in words": (lambda ds: ds.assign_attrs(thickness_in_m="thin"), "could not convert string to float"),
    "half a film": (without("relaxation_time_in_s"), "it lacks 'relaxation_time_in_s'"),
    "no variables": (lambda ds: ds.drop_vars(ds.data_vars), "it does not hold the variables and attributes of a sweep"),
    "not of the package": (without("dea_maps_version"), "it does not hold the variables and attributes of a sweep"),
    "foreign": (lambda ds: xr.Dataset({"t": ("x", [1.0])}), "it does not hold the variables and attributes of a sweep"),
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def assert_refused(captured, verb, words):
    assert captured.out == ""
    assert captured.err.startswith("dea-maps: error: map.nc ") and captured.err.count("\n") == 1
    assert words in captured.err


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("name", CHANGES)
def test_a_changed_map_is_refused_by_every_verb(folder, capsys, name, verb):
    change, words = CHANGES[name]
    change(film()).to_netcdf("map.nc")
    assert main([verb, "map.nc", *VERBS[verb]]) == 2
    assert_refused(capsys.readouterr(), verb, words)
    assert [path.name for path in folder.iterdir()] == ["map.nc"]


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("content", [b"", b"a note\n" * 99, b"\x89HDF\r\n\x1a\n", b"CDF\x01" + bytes(40), b"half"])
def test_what_is_no_netcdf_is_refused(folder, capsys, verb, content):
    if content == b"half":
        film().to_netcdf("map.nc")
        content = (folder / "map.nc").read_bytes()
        content = content[: len(content) // 2]
    (folder / "map.nc").write_bytes(content)
    assert main([verb, "map.nc", *VERBS[verb]]) == 2
    assert_refused(capsys.readouterr(), verb, "map.nc is not a")


def test_any_error_of_the_library_names_the_file(folder, capsys, monkeypatch):
    film().to_netcdf("map.nc")

    def broken(*_, **__):
        raise RuntimeError("NetCDF: HDF error")

    monkeypatch.setattr(netcdf.xr, "open_dataset", broken)
    assert main(["info", "map.nc"]) == 2
    assert_refused(capsys.readouterr(), "info", "map.nc is damaged: NetCDF: HDF error")


@pytest.mark.parametrize("seed", [1, 2])
def test_mutants_are_refused_or_whole(folder, seed):
    film().to_netcdf("map.nc")
    done = subprocess.run([sys.executable, "-c", MUTATE, str(seed)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    verdicts = done.stdout.splitlines()
    assert len(verdicts) == 120
    assert set(verdicts) == {"refused", "whole"}


ESCAPES = "\x1b]0;title\x07\x1b[31mred $\\frac{a$ \x9b1m"


def test_control_characters_are_printed_escaped(folder, capsys):
    film().assign_attrs(title=ESCAPES, material=ESCAPES, method_version=ESCAPES).to_netcdf("map.nc")
    assert main(["info", "map.nc"]) == 0
    out = capsys.readouterr().out
    assert r"\u001b]0;title\u0007\u001b[31mred $\frac{a$ \u009b1m" in out
    assert all(character.isprintable() or character == "\n" for character in out)
    assert main(["info", "\x1b[31mred.nc"]) == 2
    assert capsys.readouterr().err == "dea-maps: error: there is no file \\u001b[31mred.nc\n"
    assert main(["info", "map.nc", "\x1b[31m"]) == 2
    assert "\x1b" not in capsys.readouterr().err


def test_a_name_is_drawn_as_it_is(folder, capsys):
    film().assign_attrs(material="5 $ \\frac{a$").to_netcdf("map.nc")
    assert main(["plot", "map.nc", "-o", "chart.svg"]) == 0
    assert main(["explore", "map.nc", "-o", "page.html"]) == 0
    assert capsys.readouterr() == ("", "")


def test_a_name_in_a_specification_is_printed_escaped(folder, capsys):
    table = '[material]\npreset = "VHB"\nthickness = 1e-4\nname = "\\u001b[31m $\\\\frac{a$"\n'
    (folder / "design.toml").write_text(table + "[design]\nholding_time = [1, 60]\n")
    assert main(["design", "design.toml", "-o", "chart.svg"]) == 0
    (folder / "spec.toml").write_text('[program]\nname = "step"\n[grid]\nvoltage = [1500, 2000]\n' + table)
    assert main(["sweep", "spec.toml", "-o", "map.nc", "--dry-run"]) == 0
    assert main(["sweep", "spec.toml", "-o", "map.nc"]) == 0
    out = capsys.readouterr().out
    assert out.count("\\u001b[31m") == 5 and "\x1b" not in out


def test_what_was_made_in_memory_is_refused_in_words(tmp_path):
    ds = film()
    with pytest.raises(ValueError, match=r"rate must be finite and above 0; got 0.0"):
        dm.explore(ds.assign_coords(rate=[0.0, 1.0]), tmp_path / "page.html")
