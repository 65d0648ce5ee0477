"""The studies: each runs small, says where it ran, and shows the figures that its page names."""

import ast
import doctest
import os
import re
import shutil
import subprocess
import sys
import tomllib
from importlib import import_module
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import dea_maps as dm
from dea_maps.limits.voltages import time_in_words
from dea_maps.materials.toml import material_of
from dea_maps.sweeps.methods import choose

STUDIES = Path(__file__).parents[2] / "studies"
sys.path.append(str(STUDIES))
from common.options import study_parser  # noqa: E402 -- found once the line above is read

SCRIPTS = sorted(STUDIES.rglob("*.py"))
INTERNALS = STUDIES / "common" / "internals.py"
RUNS = sorted(STUDIES.glob("*/run.py"))
PAGES = sorted(STUDIES.glob("*/README.md"))
FIGURE = re.compile(r"!\[[^\]]*\]\(([^)]+)\)")


def folder_name(path):
    return path.parent.name


@pytest.fixture(scope="module")
def copied(tmp_path_factory):
    """Return a copy of what the studies are run from."""
    root = tmp_path_factory.mktemp("checkout")
    shutil.copytree(STUDIES, root / "studies")
    (root / "tests").symlink_to(STUDIES.parent / "tests")
    return root


# A process that imports what the studies share, and then runs each that a line names in a fork of itself: four words,
# its run.py, the folder to be in, and the files that take what it prints.
RUNNER = """
import gc, os, runpy, sys
import matplotlib.pyplot, pandas, scipy.integrate, scipy.optimize
import common.internals, common.fast_limit, common.machine, common.options, common.programs
gc.freeze()  # no collection in a fork goes through what is imported
for line in sys.stdin:
    run, folder, out, err = line.rstrip("\\n").split("\\t")
    process = os.fork()
    if process == 0:
        for stream, name in enumerate((out, err), 1):
            os.dup2(os.open(name, os.O_WRONLY | os.O_CREAT), stream)
        os.chdir(folder)
        sys.argv = [run, "--quick"]
        sys.path[0] = os.path.dirname(run)
        break
    print(os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]), flush=True)
else:
    sys.exit()
runpy.run_path(run, run_name="__main__")
"""


@pytest.fixture(scope="module")
def run_small(copied):
    """Return a function that runs a study small in a folder, and returns its status, and what it said."""
    words = copied / "out.txt", copied / "err.txt"
    path = os.pathsep.join([str(copied / "studies"), str(STUDIES.parent), os.environ.get("PYTHONPATH", "")])
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen([sys.executable, "-c", RUNNER], env=os.environ | {"PYTHONPATH": path}, **pipes) as runner:

        def run(study, folder):
            for file in words:
                file.write_text("")
            print(copied / "studies" / study / "run.py", folder, *words, sep="\t", file=runner.stdin, flush=True)
            return int(runner.stdout.readline()), *(file.read_text(encoding="utf-8") for file in words)

        yield run
        runner.stdin.close()


def contents(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file() and path.suffix != ".pyc"}


@pytest.mark.parametrize("study", [run.parent.name for run in RUNS])
def test_study_runs_small_and_changes_nothing_that_is_tracked(study, copied, run_small, tmp_path):
    before = contents(copied / "studies")
    status, out, err = run_small(study, tmp_path)
    assert status == 0, err
    ending = "\n".join(out.splitlines()[-6:]).lower()
    assert "machine" in ending and "versions" in ending
    kinds = {path.suffix for path in (copied / "out" / study).rglob("*.*")}
    assert kinds >= {".png", ".nc"}
    assert contents(copied / "studies") == before
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.relative_to(STUDIES).as_posix())
def test_what_is_not_public_comes_through_one_module(path):
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    modules = {node.module for node in nodes if isinstance(node, ast.ImportFrom)}
    modules |= {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    assert not any(str(name).startswith("dea_maps.") for name in modules) or path == INTERNALS


@pytest.mark.parametrize("name", sorted(path.stem for path in (STUDIES / "common").glob("*.py")))
def test_examples_of_what_studies_share(name):
    assert doctest.testmod(import_module(f"common.{name}")).failed == 0


def test_study_writes_where_it_is_told(tmp_path):
    parser = study_parser(str(RUNS[0]), None, quick="")
    assert f"default: out/{RUNS[0].parent.name} in the checkout" in " ".join(parser.format_help().split())
    options = parser.parse_args(["--output", str(tmp_path / "new" / "folder")])
    assert options.output == tmp_path / "new" / "folder"
    assert options.output.is_dir()


def test_a_folder_that_cannot_be_made_is_said(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    with pytest.raises(SystemExit, match="2"):
        study_parser(str(RUNS[0]), None, quick="").parse_args(["--output", str(tmp_path / "file" / "folder")])
    assert "argument --output: cannot make the folder" in capsys.readouterr().err


@pytest.mark.parametrize("page", PAGES, ids=folder_name)
def test_page_says_what_a_study_says(page):
    text = page.read_text(encoding="utf-8")
    assert all(f"**{part}" in text for part in ("Question.", "Command.", "What it shows."))
    for name in FIGURE.findall(text):
        assert (page.parent / name).stat().st_size < 300_000
    for path in page.parent.glob("*.nc"):
        assert path.stat().st_size < 1_000_000


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-12])
def test_auto_picks_by_the_rule_that_follows_from_the_studies(rtol):
    """See studies/tolerance/README.md."""
    rule = {dm.Step(): ("quadrature", "stretch"), dm.Ramp(): ("dop853", "area"), dm.RampHold(): ("dop853", "area")}
    for program, pick in rule.items():
        choice = choose(program, "auto", "auto", rtol, None)
        assert (choice.method, choice.formulation) == pick


def test_page_on_actuators_gives_the_allowable_voltages():
    page = (STUDIES / "actuator" / "README.md").read_text(encoding="utf-8")
    (table,) = re.findall(r"^\| held \| 50 um .*\n\|[-|]*\n((?:\|.*\n)+)", page, re.MULTILINE)
    said = [[cell.strip() for cell in row.strip("|").split("|")] for row in table.splitlines()]
    holds = [1.0, 10.0, 60.0, 600.0, 3600.0, 86400.0, 604800.0, np.inf]
    assert [row[0] for row in said] == [time_in_words(hold) for hold in holds]
    specification = STUDIES / "actuator" / "design.toml"
    tables = tomllib.loads(specification.read_text(encoding="utf-8"))["material"]
    free, growing, constant = (dm.design(material_of(one, ("thickness",)), [50e-6, 100e-6], holds) for one in tables)
    volts = [*growing.allowable_voltage, free.allowable_voltage[1], constant.allowable_voltage[1]]
    for column, found in zip((1, 2, 5, 6), volts, strict=True):
        np.testing.assert_allclose([float(row[column].removesuffix(" V")) for row in said], found, atol=0.51)
    assert [row[3] for row in said] == ["breakdown"] * 3 + ["instability"] * 5
    assert dm.read_design(specification).sizes == {"film": 5, "holding_time": 20}


def test_page_on_drive_gives_the_allowable_duties():
    page = (STUDIES / "drive" / "README.md").read_text(encoding="utf-8")
    (volts, seconds) = map(float, re.findall(r"\*\*(\d+) V for ([\d.]+) s of every minute", page)[0])
    rows = dict(re.findall(r"^\| (allowable duty|margin of the duty) \| (.*?) \|$", page, re.MULTILINE))
    said, margins = ([float(cell.rstrip(" %")) for cell in row.split(" | ")] for row in rows.values())
    curves = xr.Dataset.from_dataframe(pd.read_csv(STUDIES / "actuator" / "tension.csv"))
    fit = dm.fit_uniaxial(curves, noise="proportional").material
    for side, duty, margin in zip((0.0, -0.05, 0.05), said, margins, strict=True):
        film = dm.Material(
            fit.unrelaxed_modulus * (1.0 + side),
            fit.relaxed_modulus * (1.0 + side),
            fit.relaxation_time * (1.0 + side),
            4.7 * (1.0 - side),
            breakdown_strength=lambda stretch, side=side: 30.6e6 * (1.0 + side) * stretch**1.13,
        )
        pulses = {"voltage": volts, "period_seconds": 60.0, "prestretch": 1.5, "material": film, "thickness": 100e-6}
        found = float(dm.allowable(dm.PulseTrain(), "duty", rtol=1e-3, **pulses).allowable)
        assert 100.0 * found == pytest.approx(duty, abs=0.09)
        assert found / (seconds / 60.0) - 1.0 == pytest.approx(margin / 100.0, abs=0.006)
