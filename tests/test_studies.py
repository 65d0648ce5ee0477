"""The studies: each runs small, says where it ran, and shows the figures that its page names."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import dea_maps as dm
from dea_maps.catalogue import choose

STUDIES = Path(__file__).parents[1] / "studies"
RUNS = sorted(STUDIES.glob("*/run.py"))
PAGES = sorted(STUDIES.glob("*/README.md"))
FIGURE = re.compile(r"!\[[^\]]*\]\(([^)]+)\)")


def folder_name(path):
    return path.parent.name


@pytest.mark.parametrize("run", RUNS, ids=folder_name)
def test_study_runs_small(run, tmp_path):
    command = [sys.executable, str(run), "--quick", "--output", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    ending = "\n".join(done.stdout.splitlines()[-6:]).lower()
    assert "machine" in ending and "versions" in ending
    kinds = {path.suffix for path in tmp_path.rglob("*.*")}
    assert kinds >= {".png", ".nc"}


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
