"""The documentation site: ``python -m sphinx -W docs docs/_build/html`` builds it offline."""

from __future__ import annotations

import gc
import logging
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "docs/_ext")]
gc.set_threshold(500_000, 20, 100)  # what a build makes stays: looking for what may go costs 1/5
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

project = PROJECT["name"]
author = "The go2_wbc authors"
project_copyright = author
release = version = PROJECT["version"]

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "call_graph",
    "import_graph",
    "mathml",
    "plain_docstrings",
    "quick_references",
    "reference_pages",
]
exclude_patterns = ["_build", "**/.ipynb_checkpoints"]
# Links to files that are no pages, and what GitHub shows with another anchor, fail the build too.
myst_enable_extensions = ["dollarmath", "amsmath", "deflist"]
myst_heading_anchors = 3
myst_dmath_double_inline = True
if not any(ROOT.glob("docs/notebooks/*.ipynb")):  # its list of pages is empty, and that is no fault
    logging.getLogger("sphinx.sphinx.directives.other").addFilter(
        lambda record: "toctree glob pattern" not in record.getMessage()
    )
nb_execution_mode = "off"  # the notebooks are committed with their outputs
highlight_language = "none"

# What needs ROS 2 or DDS is described by hand; its docstrings need neither.
autodoc_mock_imports = ["rclpy", "cyclonedds", "rerun"]
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autodoc_typehints_format = "short"
autodoc_use_type_comments = False  # there are none: looking for them is a thirtieth of a build
autoclass_content = "both"  # the class, then what its __init__ takes
napoleon_numpy_docstring = False
napoleon_custom_sections = [("Attributes", "params_style")]  # a list of fields without links
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88
add_module_names = False
toc_object_entries = False

html_theme = "furo"
html_title = f"go2-wbc {release}"
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sphinx = False
html_copy_source = False
html_search_scorer = str(ROOT / "docs/_ext/search_scorer.js")  # guides first
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#1d4ed8", "color-brand-content": "#1d4ed8"},
    "dark_css_variables": {"color-brand-primary": "#7dabff", "color-brand-content": "#7dabff"},
}
copybutton_exclude = ".linenos, .gp, .go"
