"""Which core is chosen, and that a library of other sources is never called."""

import os
import subprocess
import sys

import pytest

from minsnap.native import build, library
from minsnap.native.status import Status

HERE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def describe(**environment):
    return run_python("from minsnap.native.library import describe; print(describe())", **environment)


def run_python(code, **environment):
    known = {name: value for name, value in os.environ.items() if name not in ("MINSNAP_CORE", "LD_PRELOAD")}
    return subprocess.run(
        [sys.executable, "-c", code], cwd=HERE, env=known | environment, capture_output=True, text=True, check=False
    )


@pytest.mark.skipif("CI" not in os.environ, reason="a checkout may be used without its core")
def test_continuous_integration_tests_the_native_core():
    with library.using("native") as core:
        assert core.name == "native"


@pytest.mark.skipif(not build.LIBRARY.exists(), reason="there is no native core")
def test_the_library_was_compiled_from_these_sources(monkeypatch):
    monkeypatch.delenv("MINSNAP_CXXFLAGS", raising=False)
    assert build.is_current(), "run python -m minsnap.native.build"


@pytest.mark.skipif(not build.LIBRARY.exists(), reason="there is no native core")
def test_every_status_has_the_same_number_on_both_sides():
    with library.using("native") as core:
        names = [core.library.minsnap_status_name(status) for status in range(len(Status) + 1)]
    assert names == [status.name.encode() for status in Status] + [None]
    assert [int(status) for status in Status] == list(range(len(Status)))
    assert all(status.reason for status in Status)


def test_the_python_core_is_taken_where_it_is_asked_for():
    run = describe(MINSNAP_CORE="python")
    assert run.returncode == 0 and run.stdout == "python core: MINSNAP_CORE=python was asked for\n"


def test_an_unknown_core_is_refused():
    run = describe(MINSNAP_CORE="rust")
    assert run.returncode == 1 and "must be one of auto, native, python" in run.stderr


def test_a_missing_library_is_an_error_only_where_it_is_demanded(tmp_path):
    missing = str(tmp_path / "missing.so")
    assert f"MINSNAP_LIBRARY is {missing}, which does not exist" in describe(MINSNAP_LIBRARY=missing).stdout
    demanded = describe(MINSNAP_LIBRARY=missing, MINSNAP_CORE="native")
    assert demanded.returncode == 1 and "NativeCoreError: MINSNAP_CORE is native, but" in demanded.stderr


def of_another_machine():
    """The library as if it were of a processor that does not exist."""
    content = bytearray(build.LIBRARY.read_bytes())
    content[18:20] = b"\xff\xff"  # e_machine of an ELF file
    return bytes(content)


def cut():
    """A part of the library, as a full disk or a broken connection leaves it."""
    content = build.LIBRARY.read_bytes()
    return content[: len(content) // 4]


@pytest.mark.parametrize(
    ("stamp", "reason"),
    [
        (b"0123\nc++\n", "_core.bin is missing: run python -m minsnap.native.build"),
        (b"-\nno compiler\n", "no compiler: run python -m minsnap.native.build"),
        (b"-\nc++ failed: name another in CXX\n", "c++ failed: name another in CXX"),
        (b"\xff\xfe\n", "_core.bin is missing: run"),
        (None, "_core.bin is missing: run"),
    ],
)
def test_why_there_is_no_core_is_said(tmp_path, monkeypatch, stamp, reason):
    monkeypatch.delenv("MINSNAP_LIBRARY", raising=False)
    monkeypatch.setattr(library, "LIBRARY", tmp_path / "_core.bin")
    monkeypatch.setattr(library, "STAMP", tmp_path / "_core.txt")
    if stamp is not None:
        library.STAMP.write_bytes(stamp)
    said = library.loaded.__wrapped__().reason
    assert reason in said and said.count(": ") == 1


@pytest.mark.skipif(not build.LIBRARY.exists(), reason="there is no native core")
@pytest.mark.parametrize("content", [lambda: b"not a library", of_another_machine, cut, lambda: b""])
def test_what_is_no_library_of_this_machine_is_not_called(tmp_path, content):
    damaged = tmp_path / "damaged.so"
    damaged.write_bytes(content())
    assert "damaged or of another machine" in describe(MINSNAP_LIBRARY=str(damaged)).stdout
    limited = "import minsnap; minsnap.plan([(0, 0), (1, 1)], limits=minsnap.Limits(speed=1))"
    refused = run_python(limited, MINSNAP_LIBRARY=str(damaged)).stderr.splitlines()[-1]
    assert "plans within limits need the native core" in refused and "install minsnap again" in refused


def test_a_library_with_another_interface_is_not_called(monkeypatch):
    monkeypatch.setattr(library, "ABI", library.ABI + 1)
    library.loaded.cache_clear()
    try:
        found = library.loaded()
    finally:
        library.loaded.cache_clear()
    if build.LIBRARY.exists():
        assert found.library is None and f"not {library.ABI}" in found.reason


@pytest.mark.skipif(library.core().library is None, reason="there is no native core")
def test_a_library_of_older_sources_names_what_it_lacks_and_how_to_compile_it():
    with pytest.raises(library.NativeCoreError, match="no minsnap_of_tomorrow: .*python -m minsnap.native.build"):
        library.Entry("minsnap_of_tomorrow").function()


def test_using_puts_the_choice_back():
    before = library.core()
    with library.using("python") as core:
        assert library.core() is core and core.name == "python" and "was asked for" in core.reason
        assert library.Entry("minsnap_abi").function() is None
        assert library.Entry("minsnap_abi")() == Status.UNSUPPORTED
    assert library.core() is before
