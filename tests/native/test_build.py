"""The build: compilers found, missing and failing; what an installation does with each."""

import shutil
import sys

import pytest

from minsnap.native import build


@pytest.fixture
def sources(tmp_path, monkeypatch):
    """A copy of the sources, built beside itself."""
    here = tmp_path / "native"
    shutil.copytree(build.SOURCES, here / "src")
    monkeypatch.setattr(build, "SOURCES", here / "src")
    monkeypatch.setattr(build, "LIBRARY", here / "_core.bin")
    monkeypatch.setattr(build, "STAMP", here / "_core.txt")
    for other in (here / "src").glob("*.cpp"):  # one unit is enough to see the build at work
        if other.name != "library.cpp":
            other.unlink()
    return here


def compiler_or_skip():
    try:
        return build.find_compiler()
    except build.NoCompilerError:
        pytest.skip("there is no C++ compiler")


def test_the_compiler_is_the_one_that_is_named(monkeypatch):
    monkeypatch.setenv("CXX", f"{sys.executable} -x")
    assert build.find_compiler() == [sys.executable, "-x"]
    monkeypatch.setenv("CXX", "no-such-compiler")
    with pytest.raises(build.NoCompilerError, match="CXX=no-such-compiler is not on the PATH"):
        build.find_compiler()


def test_no_compiler_on_the_path_is_said(monkeypatch, tmp_path):
    monkeypatch.delenv("CXX", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(build.NoCompilerError, match=r"none of c\+\+, g\+\+, clang\+\+ is on the PATH"):
        build.find_compiler()


def test_the_library_is_compiled_once_and_again_after_a_change(sources):
    compiler_or_skip()
    assert not build.is_current()
    assert build.build() and build.is_current() and not build.build()
    with open(build.SOURCES / "basics" / "status.hpp", "a", encoding="utf-8") as file:
        file.write("// changed\n")
    assert not build.is_current()
    assert build.build() and build.LIBRARY.stat().st_size > 0
    assert sorted(path.name for path in sources.iterdir()) == ["_core.bin", "_core.txt", "src"]


def test_a_broken_source_fails_and_leaves_no_stale_library(sources, capsys):
    compiler_or_skip()
    build.LIBRARY.write_bytes(b"stale")
    (build.SOURCES / "broken.cpp").write_text("int main( {", encoding="utf-8")
    with pytest.raises(build.CompilationError, match=r"broken\.cpp"):
        build.build()
    assert not build.LIBRARY.exists() and not build.is_current()
    assert build.main([]) == 1 and "the native core was not built" in capsys.readouterr().err


def test_a_library_can_be_built_elsewhere(sources, tmp_path, capsys):
    compiler_or_skip()
    target = tmp_path / "elsewhere" / "core.so"
    assert build.main(["--output", str(target)]) == 0 and target.stat().st_size > 0
    assert "built" in capsys.readouterr().out and not build.LIBRARY.exists()
