"""The documentation: its examples give what they say, its scripts and commands run, its tables name what exists."""

import doctest
import re
import shlex
import subprocess
import sys
from pathlib import Path

import matplotlib
import pytest

from dea_maps.cli.main import main

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))


def name_of(path):
    return path.relative_to(DOCS).with_suffix("").as_posix()


def blocks(page, language):
    """Return the fenced blocks of a language on a page."""
    return re.findall(rf"^```{language}\n(.*?)^```$", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


def pages_with(language):
    return pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, language)], ids=name_of)


@pytest.fixture
def folder(tmp_path, monkeypatch, defines_programs):
    """Return an empty folder as the current one, where no window opens and programs that are defined are forgotten."""
    monkeypatch.chdir(tmp_path)
    matplotlib.use("Agg")
    return tmp_path


@pages_with("pycon")
def test_examples_give_what_they_say(page, folder):
    text = "\n".join(blocks(page, "pycon"))
    test = doctest.DocTestParser().get_doctest(text, {}, name_of(page), str(page), 0)
    assert doctest.DocTestRunner().run(test).failed == 0


@pages_with("toml")
def test_commands_work(page, folder, capsys):
    """The commands run on the specification that the page shows, by the name under which they expect it."""
    (spec,) = blocks(page, "toml")
    calls = [shlex.split(line, comments=True)[1:] for block in blocks(page, "sh") for line in block.splitlines()]
    assert calls
    Path(calls[0][1]).write_text(spec, encoding="utf-8")
    for arguments in calls:
        assert main(arguments) == 0, f"{arguments}: {capsys.readouterr().err}"


def test_job_array(folder, monkeypatch):
    """Its tasks, run one after the other, and merged, give the map of one sweep."""
    page = DOCS / "guide" / "clusters.md"
    part, merge, _ = blocks(page, "python")
    monkeypatch.setenv("SLURM_ARRAY_TASK_COUNT", "3")
    whole = {}
    for task in range(3):
        monkeypatch.setenv("SLURM_ARRAY_TASK_ID", str(task))
        exec(part, whole)
    exec(merge, whole)
    dm, np = whole["dm"], whole["np"]
    grid = {"field": np.linspace(0.8, 2.2, 20), "rate": np.geomspace(1e-3, 1e3, 20), "modulus_ratio": whole["ratios"]}
    expected = dm.sweep(dm.RampHold(), **grid)
    with dm.open("map.nc") as merged:
        assert merged.drop_attrs().identical(expected.drop_attrs())


@pages_with("python")
def test_scripts_are_python(page):
    for block in blocks(page, "python"):
        compile(block, str(page), "exec")


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_equations_can_be_drawn(page):
    """A number in an equation of several lines needs an environment that takes one; braces and environments close."""
    text = page.read_text(encoding="utf-8")
    for equation in re.findall(r"^ *\$\$\n(.*?)^ *\$\$$", text, re.MULTILINE | re.DOTALL):
        assert not ("\\tag" in equation and r"\\" in equation), equation
        assert equation.replace(r"\{", "").count("{") == equation.replace(r"\}", "").count("}"), equation
    assert sorted(re.findall(r"\\begin\{(\w+)", text)) == sorted(re.findall(r"\\end\{(\w+)", text))


def test_pages_are_in_a_table_of_contents():
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    for page in PAGES:
        if page.name != "index.md" or page.parent != DOCS:
            assert f"\n{name_of(page)}\n" in index, page


def test_links_lead_somewhere():
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{name_of(page)}: {target}"


def test_studies_are_all_there():
    listed = re.findall(r"^\| `(\w+)` \|", (DOCS / "studies.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(listed) == sorted(path.parent.name for path in ROOT.glob("studies/*/README.md"))


def test_site_is_built_without_a_warning(tmp_path):
    pytest.importorskip("sphinx")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", str(DOCS), str(tmp_path)]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    pages = [path.read_text(encoding="utf-8") for path in tmp_path.rglob("*.html")]
    assert len(pages) >= len(PAGES)
    outside = [link for page in pages for link in re.findall(r"""(?:src|href)="(https?://[^"]+)""", page)]
    assert not [link for link in outside if link.endswith((".js", ".css"))]


def test_answers_are_those_of_the_command_line(folder, capsys):
    """Every question of the page gets the answer that stands below it, whatever the line breaks."""
    page = DOCS / "guide" / "ask.md"
    text = page.read_text(encoding="utf-8")
    (film,) = re.findall(r"^```\{code-block\} toml\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    Path("film.toml").write_text(film, encoding="utf-8")
    asked = [block.split("\n", 1) for block in blocks(page, "console") if block.startswith("$ dea-maps ask")]
    assert len(asked) == 10
    for command, expected in asked:
        assert main(shlex.split(command)[2:]) == 0, command
        assert capsys.readouterr().out.split() == expected.split(), command
