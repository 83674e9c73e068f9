"""Users import routes as ``minsnap.routes``, as a module, by its names, and as an attribute."""

import importlib

import pytest

import minsnap
from minsnap.paths import routes


@pytest.mark.parametrize("name", routes.__all__)
def test_each_name_is_imported_from_the_short_module(name):
    module = importlib.import_module("minsnap.routes")
    assert module is minsnap.routes and getattr(module, name) is getattr(routes, name)
    assert name in dir(module) and name in module.__all__


def test_what_is_not_there_is_told():
    with pytest.raises(ImportError, match="cannot import name 'explorer_of'"):
        from minsnap.routes import explorer_of  # noqa: F401
