"""Plugin of pytest (``-p library_alone``): the library as it is where its applications are not installed.

What a test, or a script of the repository that it runs, imports of an application skips the test, which then is none
of the library. What the library imports of one
is not found, so that the test fails.
"""

import sys
from importlib.abc import MetaPathFinder
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
APPLICATIONS = ("plot", "shows", "flight", "batch", "studio", "cli")
"""The rooms from ``plot`` on in docs/architecture.rst, as ``tests/test_import_order.py`` holds."""

HIDDEN = (*(f"minsnap.{room}" for room in APPLICATIONS), "matplotlib", "mpl_toolkits", "typer", "viser", "dask")
HANDED_ON = ("lazy_loader/__init__.py", "minsnap/__init__.py")
"""Ends of the files that import for who asks for a name of the root."""

DOOR = "_outside"
"""The function by which a path finds its figures and files: ``path.plot()`` is asked for by who has them."""


class Hidden(MetaPathFinder):
    """Finds no application: skips the test that asks for one, and tells the library that there is none."""

    def find_spec(self, fullname, path=None, target=None):
        """Refuse a hidden module, and pass on all others."""
        if not any(fullname == name or fullname.startswith(f"{name}.") for name in HIDDEN):
            return None
        frame = sys._getframe(1)
        while frame is not None and (
            frame.f_code.co_filename.endswith(HANDED_ON) or "importlib" in frame.f_code.co_filename
        ):
            frame = frame.f_back
        asking = "" if frame is None else frame.f_code.co_filename
        if (Path(asking).is_relative_to(ROOT) and not Path(asking).is_relative_to(ROOT / "minsnap")) or (
            frame is not None and frame.f_code.co_name == DOOR
        ):
            pytest.skip(f"{fullname} is an application", allow_module_level=True)
        raise ModuleNotFoundError(f"No module named {fullname!r}: the library is alone", name=fullname)


def pytest_configure(config):
    """Hide the applications before any test is read."""
    loaded = [name for name in sys.modules if name.split(".")[0] in HIDDEN or name.startswith(HIDDEN)]
    assert not loaded, loaded
    sys.meta_path.insert(0, Hidden())
