"""What the README and the other files for readers say: its code runs, its commands exist, its tables are true."""

import contextlib
import io
import re
import shlex
import tomllib
from pathlib import Path

import pytest

import dea_maps as dm
from dea_maps.cli.main import main
from dea_maps.outcomes import Outcome, words_of

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = [ROOT / "README.md", ROOT / "studies" / "vhb_cube" / "README.md"]


def name_of(path):
    return str(path.relative_to(ROOT))


def blocks(text, language):
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def rows(heading):
    """Return the cells of the table under a heading, without code marks."""
    section = README.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    table = [line for line in section.splitlines() if line.startswith("|")]
    return [[cell.strip().replace("`", "") for cell in line.strip("|").split("|")] for line in table[2:]]


def command_under(marker):
    """Return the one line in the block under a marker."""
    (line,) = re.findall(rf"^<!-- command: {marker} -->\n```sh\n(.*)\n```$", README, re.MULTILINE)
    return line


def tool_calls(text):
    """Return the arguments of every call of the command line in a text, in order."""
    calls = [part for block in blocks(text, "sh") for line in block.splitlines() for part in line.split("&&")]
    words = [shlex.split(call, comments=True) for call in calls]
    return [call[1:] for call in words if call and Path(call[0]).name == "dea-maps"]


@pytest.fixture
def small_checkout(tmp_path, monkeypatch):
    """Return a folder with the specifications of the studies, cut to a few cells, as the current one."""
    for path in (ROOT / "studies").glob("*/*.toml"):
        copy = tmp_path / path.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text(re.sub(r"num = \d+", "num = 4", path.read_text()))
    (tmp_path / "out").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_readers_get_two_commands_of_one_line_each():
    assert README.count("<!-- command:") == 2
    sweep, plot = tool_calls(f"```sh\n{command_under('main')}\n```")
    assert (sweep[0], plot[0]) == ("sweep", "plot")
    spec = tomllib.loads((ROOT / sweep[1]).read_text())
    assert [spec["grid"][name]["num"] for name in ("field", "rate", "modulus_ratio")] == [100, 100, 100]
    assert command_under("tests").endswith(".venv/bin/python -m pytest")


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_commands_work(page, small_checkout, capsys):
    calls = tool_calls(page.read_text())
    assert len(calls) >= 3
    for arguments in calls:
        assert main(arguments) == 0, f"{arguments}: {capsys.readouterr().err}"


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_code_prints_what_its_comments_say(page, small_checkout):
    (block,) = blocks(page.read_text(), "python")
    promised = re.findall(r"^ *print\(.*\)  # (.+)$", block, re.MULTILINE)
    assert len(promised) == block.count("print("), "every print is followed by a comment: what it prints"
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(block, {})
    assert printed.getvalue().splitlines() == promised


def test_python_in_ten_lines():
    (block,) = blocks(README, "python")
    assert len(block.strip().splitlines()) <= 10


def test_the_specification_is_one(small_checkout):
    (spec,) = blocks(README, "toml")
    Path("spec.toml").write_text(spec)
    assert main(["sweep", "spec.toml", "-o", "map.nc", "--dry-run"]) == 0


def test_variables_are_those_of_a_data_set():
    ds = dm.sweep(dm.Step(), field=1.2, modulus_ratio=4.0)
    table = rows("The data set")
    assert [row[:2] for row in table] == [[name, str(ds[name].dtype)] for name in dm.RampHold().results]
    assert list(ds.data_vars) == list(dm.RampHold().results)
    assert table[0][2] == ", ".join(f"{value} {word}" for value, word in enumerate(words_of(Outcome)))


def test_methods_are_those_on_offer():
    offered = [
        [method.name, str(method.order or "any"), method.kind, ", ".join(method.formulations)]
        for method in dm.methods()
    ]
    lines = "\n".join("| " + " | ".join([f"`{name}`", *rest]) + " |" for name, *rest in offered)
    assert rows("Accuracy") == offered, f"the table of README.md should hold\n{lines}"


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_somewhere(page):
    targets = re.findall(r"\]\(([^)#]+)\)", page.read_text())
    assert targets
    for target in targets:
        assert (page.parent / target).exists(), target


def test_versions_agree():
    version = dm.__version__
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()
    newest = re.search(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert newest is not None
    assert newest[1] == version
