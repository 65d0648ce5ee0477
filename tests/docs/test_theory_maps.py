"""The tables at the end of the theory pages: every module, function and test that they name exists."""

import re
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = sorted(path for path in (ROOT / "docs" / "theory").glob("*.md") if path.name != "index.md")
ROW = re.compile(r"^\| (.+) \| `([\w.]+)` \| `(\w+)` \| `(test_\w+)` \|$", re.MULTILINE)
TESTS = {
    name
    for path in (ROOT / "tests").rglob("test_*.py")
    for name in re.findall(r"^def (test_\w+)", path.read_text(encoding="utf-8"), re.MULTILINE)
}


def table(page):
    """Return the rows of the table of a page: equation, module, function, test."""
    section = page.read_text(encoding="utf-8").split("\n## Where it is in the code\n")[1]
    lines = [line for line in section.splitlines() if line.startswith("| ")]
    assert lines[0] == "| equation | module | function | test |"
    rows = ROW.findall(section)
    assert len(rows) == len(lines) - 1, f"a row of {page.name} is of another form"
    return rows


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_what_a_table_names_exists(page):
    missing = []
    for equation, module, function, test in table(page):
        try:
            found = hasattr(import_module(f"dea_maps.{module}"), function)
        except ModuleNotFoundError:
            found = False
        missing += [] if found else [f"{equation}: {module}.{function}"]
        missing += [] if test in TESTS else [f"{equation}: {test}"]
    assert not missing


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_equations_of_a_table_are_on_its_page(page):
    """Those with a number of the page's own, as (2.4), carry it as a tag there."""
    text = page.read_text(encoding="utf-8")
    tags = set(re.findall(r"\\tag\{(\d\.\d)\}", text))
    assert len(tags) == len(re.findall(r"\\tag\{\d\.\d\}", text)), "a number is given twice"
    own = {number.split(".")[0] for number in tags}
    assert len(own) == 1
    for equation, *_ in table(page):
        for number in re.findall(r"\((\d\.\d)\)", equation):
            assert number in tags or number.split(".")[0] not in own, equation


def test_equations_that_are_referred_to_exist():
    texts = {page.stem: page.read_text(encoding="utf-8") for page in [*PAGES, *(ROOT / "docs").rglob("*.md")]}
    tags = {tag for text in texts.values() for tag in re.findall(r"\\tag\{([\d.]+)\}", text)}
    for name, text in texts.items():
        for number in re.findall(r"(?<![\w`)])\((\d\.\d)\)", text):
            assert number in tags, f"{name}: ({number})"
