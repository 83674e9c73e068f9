"""How the documentation is built; warnings are errors (``make docs``)."""

import sys
from importlib.metadata import version as installed
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

project = "minsnap"
author = "the minsnap maintainers"
copyright = "2026, the minsnap maintainers"
version = release = installed("minsnap")

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "mathml",
    "example_pages",
    "command_pages",
    "room_pages",
]
templates_path = ["_templates"]
exclude_patterns = ["_build"]
html_math_renderer = "mathml"
html_theme = "furo"
html_title = f"minsnap {release}"
html_static_path = ["_static"]
html_css_files = ["minsnap.css"]
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#8a1c3b", "color-brand-content": "#0067a0"},
    "dark_css_variables": {"color-brand-primary": "#e58aa3", "color-brand-content": "#6cb8ea"},
}
pygments_style = "friendly"

autosummary_generate = True
autosummary_imported_members = True
autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_default_options = {"exclude-members": "set"}  # matplotlib writes one for every class derived from its own
napoleon_google_docstring = False
napoleon_use_param = False
napoleon_use_rtype = False
napoleon_preprocess_types = False
toc_object_entries = False
add_module_names = False
suppress_warnings = ["ref.python"]  # a word in a docstring that is the name of a field of several classes
