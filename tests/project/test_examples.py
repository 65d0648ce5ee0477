"""The examples in the docstrings."""

import doctest
from importlib import import_module
from pathlib import Path

import pytest

import dea_maps as dm

FOLDER = Path(dm.__file__).parent
MODULES = [
    ".".join(("dea_maps", *path.relative_to(FOLDER).with_suffix("").parts)).removesuffix(".__init__")
    for path in sorted(FOLDER.rglob("*.py"))
]


def test_modules_are_found_in_every_room():
    rooms = {name.split(".")[1] for name in MODULES if name.count(".") > 1}
    assert rooms == {path.name for path in FOLDER.iterdir() if (path / "__init__.py").exists()}
    assert len(MODULES) > 70


@pytest.mark.parametrize("name", MODULES)
def test_examples_give_what_they_say(name):
    assert doctest.testmod(import_module(name)).failed == 0
