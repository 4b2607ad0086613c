"""Settings of Sphinx for the documentation."""

import sys
import tomllib
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))  # docstrings.py, quicker.py

_project = tomllib.loads((HERE.parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
project = _project["name"]
author = copyright = _project["authors"][0]["name"]
version = release = _project["version"]

extensions = ["sphinx.ext.autodoc", "sphinx.ext.napoleon", "myst_parser", "docstrings", "quicker"]
source_suffix = {".rst": "restructuredtext", ".md": "markdown"}
myst_heading_anchors = 3

autodoc_default_options = {"members": True, "member-order": "bysource"}
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
autodoc_use_type_comments = False  # there are none; looking for them parses every function once more
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 90
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
add_module_names = False
toc_object_entries_show_parents = "hide"

nitpicky = True
# Of other projects, whose inventories would have to be fetched; and type variables.
nitpick_ignore_regex = [
    (
        r"py:.*",
        r"(?!spherical_wrist\b)([a-z_]\w*|PIL)(\.\w+)+",
    ),
    (r"py:class", r"NDArray|void|u?(float|int|complex)\d+"),
    (r"py:exc", r"CancelledError|ResetNeeded"),
    (r"py:class", r"spherical_wrist\..*\.(Item|Made|Result|Shown|Task|Value)"),
    (
        r"py:class",
        r"Figure|Path|PathLike|TyperException|PPoly|CubicSpline|ViewerClient|tuple\[float",
    ),  # written as text, because importing them takes time
]

html_theme = "furo"
html_title = f"{project} {version}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
