"""Proofs of contradictions and least widths are tested with the Python core, whose solver has other multipliers."""

import pytest

from minsnap.native.library import using

BY_PYTHON = ("test_contradiction.py", "test_infeasibility.py")


@pytest.fixture(autouse=True)
def _python_core(request):
    if request.path.name not in BY_PYTHON:
        yield
        return
    with using("python"):
        yield
