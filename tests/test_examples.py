"""The examples in the docstrings."""

import doctest
from importlib import import_module
from pkgutil import iter_modules

import pytest

import dea_maps as dm

MODULES = [
    "dea_maps",
    *(f"dea_maps.{module.name}" for module in iter_modules(dm.__path__) if not module.ispkg),
]


@pytest.mark.parametrize("name", MODULES)
def test_examples_give_what_they_say(name):
    assert doctest.testmod(import_module(name)).failed == 0
