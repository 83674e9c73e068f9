"""The tests of this room are about the Python core, but for those of what only the native one does."""

import pytest

from minsnap.native.library import core, using

NATIVE = ("test_native_solve.py", "test_contradiction.py", "test_infeasibility.py")


@pytest.fixture(autouse=True)
def _python_core(request):
    if request.path.name not in NATIVE:
        with using("python"):
            yield
        return
    with using("auto"):
        if core().library is None:
            pytest.skip("refusals are proved by the native core")
        yield
