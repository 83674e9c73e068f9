"""How hypothesis runs, the same examples every time unless HYPOTHESIS_PROFILE is random; and how interrupts arrive."""

import os
import signal
import sys
from types import SimpleNamespace

import pytest
from hypothesis import HealthCheck, settings

COMMON = {"deadline": None, "max_examples": 30, "suppress_health_check": [HealthCheck.too_slow]}
settings.register_profile("random", print_blob=True, **COMMON)
settings.register_profile("repeatable", derandomize=True, **COMMON)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "repeatable"))

# A shell starts what it runs in the background with interrupts ignored, and processes pass that on to those they start:
# the tests that interrupt a process would wait for ever.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(items):
    """Let tests use numbers of any size: only the tests of the warning look at it."""
    for item in items:
        item.add_marker(pytest.mark.filterwarnings("ignore::minsnap.errors.MagnitudeWarning"))


@pytest.fixture(autouse=True)
def closed_figures():
    """Close what a test has drawn: pyplot warns of more than 20 figures, in whichever test draws the next one."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


@pytest.fixture
def call(tmp_path, capsys, monkeypatch):
    """Run the command in this process, in an empty folder."""
    from minsnap.cli import main

    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        with pytest.raises(SystemExit) as left:
            main([str(argument) for argument in arguments])
        printed = capsys.readouterr()
        return SimpleNamespace(returncode=left.value.code, stdout=printed.out, stderr=printed.err)

    return run
