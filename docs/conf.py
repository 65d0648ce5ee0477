"""Configuration of the documentation; built by ``sphinx-build -W --keep-going -b html docs out/docs``."""

import sys
from importlib import import_module
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.pycode import ModuleAnalyzer

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))  # the reference is made from the docstrings of this checkout

project = "dea_maps"
author = "The dea_maps developers"
copyright = "The dea_maps developers"
language = "en"

# MathJax comes with the package sphinx-mathjax-offline: neither the build nor a reader needs a network.
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",
    "numpydoc",
]
exclude_patterns = ["_build"]

myst_enable_extensions = ["amsmath", "deflist", "dollarmath"]
myst_heading_anchors = 3

autodoc_typehints = "none"  # the docstrings say the types, with shapes and units
numpydoc_show_class_members = False
default_role = "code"  # single backquotes in docstrings are names

html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["layout.css"]
html_title = "dea_maps"
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}


def _directive(module: str, name: str) -> str:
    """Return the directive that documents a public name from its docstring; of a constant, also its value."""
    value = getattr(import_module(module), name)
    if isinstance(value, type):
        return f".. autoclass:: {module}.{name}"
    if callable(value):
        return f".. autofunction:: {module}.{name}"
    homes = [ModuleAnalyzer.for_module(home) for home in (module, type(value).__module__) if home != "builtins"]
    said = [line for home in homes for line in home.find_attr_docs().get(("", name), [])]
    return "\n   ".join([f".. py:data:: {module}.{name}", f":value: {value!r}", "", *said])


def _public_names(app: Sphinx, page: str, source: list[str]) -> None:
    """Put the documentation of all public names where a page has the place for it."""
    for place, module in (("<!-- public names -->", "dea_maps"), ("<!-- names of charts -->", "dea_maps.charts")):
        names = [name for name in import_module(module).__all__ if name not in {"charts", "__version__"}]
        directives = "\n\n".join(_directive(module, name) for name in names)
        source[0] = source[0].replace(place, f"```{{eval-rst}}\n{directives}\n```")


def setup(app: Sphinx) -> None:
    """Connect what this file adds to Sphinx."""
    app.connect("source-read", _public_names)
