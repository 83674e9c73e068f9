"""How the documentation is built; warnings are errors (``make docs``)."""

from importlib.metadata import version as installed

project = "minsnap"
author = "the minsnap maintainers"
version = release = installed("minsnap")

extensions = ["sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon", "sphinx.ext.mathjax"]
templates_path = ["_templates"]
exclude_patterns = ["_build"]
html_theme = "alabaster"
html_theme_options = {"description": "Minimum-snap trajectories, certified and ready to fly", "page_width": "1080px"}
html_static_path: list[str] = []

autosummary_generate = True
autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_default_options = {"exclude-members": "set"}  # matplotlib writes one for every class derived from its own
napoleon_google_docstring = False
napoleon_use_param = False
napoleon_use_rtype = False
napoleon_preprocess_types = False
suppress_warnings = ["ref.python"]  # a word in a docstring that is the name of a field of several classes
