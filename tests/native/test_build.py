"""The build: compilers found, missing and failing; what an installation does with each."""

import ctypes
import importlib.machinery
import os
import shutil
import sys
import types

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
    for other in (here / "src").rglob("*.cpp"):  # one unit is enough to see the build at work
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


def test_no_compiler_at_all_is_said(monkeypatch, tmp_path):
    monkeypatch.delenv("CXX", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "ziglang", None)
    with pytest.raises(build.NoCompilerError, match=r"none of c\+\+, g\+\+, clang\+\+ is on the PATH: install"):
        build.find_compiler()


def test_without_another_compiler_that_of_ziglang_is_taken(monkeypatch, tmp_path):
    monkeypatch.delenv("CXX", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    package = types.ModuleType("ziglang")
    package.__spec__ = importlib.machinery.ModuleSpec("ziglang", None)
    monkeypatch.setitem(sys.modules, "ziglang", package)
    command = build.find_compiler()
    assert command[:5] == [sys.executable, "-m", "ziglang", "c++", "-target"]
    assert command[5].split("-")[1] in ("linux", "macos", "windows")
    for platform, target in build.PLATFORMS.items():
        monkeypatch.setenv("MINSNAP_PLATFORM", platform)
        assert build.find_compiler()[5] == target
    monkeypatch.setenv("MINSNAP_PLATFORM", "amiga")
    with pytest.raises(build.NoCompilerError, match="MINSNAP_PLATFORM is 'amiga': it must be one of manylinux"):
        build.find_compiler()


@pytest.mark.skipif(not os.path.isdir("/sys/kernel"), reason="there is no folder in which nobody may write")
def test_a_folder_that_cannot_be_written_is_said(sources, capsys):
    compiler_or_skip()
    assert build.main(["--output", "/sys/kernel/core.bin"]) == 1
    assert " cannot be written (" in (said := capsys.readouterr().err) and "compile elsewhere with --output" in said


def test_a_folder_in_place_of_the_file_is_said_before_anything_is_compiled(sources, tmp_path, capsys):
    compiler_or_skip()
    assert build.main(["--output", str(tmp_path)]) == 1
    assert "cannot be written (" in (said := capsys.readouterr().err) and "compiling" not in said


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no device that is always full")
def test_a_full_disk_is_said(sources, tmp_path, monkeypatch, capsys):
    compiler = tmp_path / "compiler"
    compiler.write_text('#!/bin/sh\ncat "$0" > /dev/full\n', encoding="utf-8")
    compiler.chmod(0o755)
    monkeypatch.setenv("CXX", str(compiler))
    monkeypatch.setenv("LC_ALL", "C")
    assert build.main([]) == 1
    assert "compiler failed: free some space on the disk" in capsys.readouterr().err


def test_what_is_done_is_said(sources, tmp_path, capsys):
    compiler_or_skip()
    assert build.main(["--output", str(tmp_path / "core.bin")]) == 0
    said = capsys.readouterr().err
    assert "compiling the native core with" in said and "compiled basics" in said


def test_the_library_is_compiled_once_and_again_after_a_change(sources):
    compiler_or_skip()
    assert not build.is_current()
    assert build.build() and build.is_current() and not build.build()
    with open(build.SOURCES / "basics" / "status.hpp", "a", encoding="utf-8") as file:
        file.write("// changed\n")
    assert not build.is_current()
    assert build.build() and build.LIBRARY.stat().st_size > 0
    assert sorted(path.name for path in sources.iterdir()) == ["_core.bin", "_core.txt", "src"]


def test_a_library_that_may_have_warnings_is_compiled_anew_where_there_must_be_none(sources, monkeypatch):
    compiler_or_skip()
    assert build.build()
    monkeypatch.setenv("MINSNAP_CXXFLAGS", "-Werror")
    assert build.build() and not build.build()
    monkeypatch.delenv("MINSNAP_CXXFLAGS")
    assert not build.build()


def test_sources_of_equal_names_in_two_folders_are_both_compiled(sources, tmp_path):
    compiler_or_skip()
    for folder in ("one", "two"):
        (build.SOURCES / folder).mkdir()
        source = f'extern "C" __attribute__((visibility("default"))) int minsnap_{folder}() {{ return 7; }}\n'
        (build.SOURCES / folder / "same.cpp").write_text(source, encoding="utf-8")
    assert build.main(["--output", str(tmp_path / "core.bin")]) == 0
    library = ctypes.CDLL(str(tmp_path / "core.bin"))
    assert library.minsnap_one() == library.minsnap_two() == 7


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
