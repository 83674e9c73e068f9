"""The tests of this room are about the Python core, but for those of the hand-over between the cores."""

import pytest

from minsnap.native.library import using


@pytest.fixture(autouse=True)
def _python_core(request):
    if request.path.name == "test_native_solve.py":
        yield
        return
    with using("python"):
        yield
