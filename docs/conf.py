"""Configuration of the documentation; built by ``sphinx-build -W --keep-going -b html docs out/docs``."""

import sys
from pathlib import Path

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
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",
]
exclude_patterns = ["_build"]

myst_enable_extensions = ["amsmath", "deflist", "dollarmath", "smartquotes"]
myst_heading_anchors = 3

autodoc_typehints = "none"  # the docstrings say the types, with shapes and units
autodoc_member_order = "bysource"
autosummary_generate = False
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_preprocess_types = False
default_role = "code"  # single backquotes in docstrings are names

html_theme = "furo"
html_title = "dea_maps"
html_static_path: list[str] = []
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {"navigation_with_keys": True}
