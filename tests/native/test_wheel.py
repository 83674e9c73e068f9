"""What pip installs, with and without a compiler on the PATH, and with one that fails."""

import os
import shutil
import subprocess
import sys
import zipfile

import pytest

from minsnap.native import build

pytestmark = pytest.mark.slow
ROOT = build.HERE.parent.parent


@pytest.fixture(scope="module")
def checkout(tmp_path_factory):
    """A copy of what a wheel is made of, without anything compiled."""
    if not (ROOT / "pyproject.toml").exists():
        pytest.skip("not a checkout")
    copy = tmp_path_factory.mktemp("checkout")
    shutil.copytree(ROOT / "minsnap", copy / "minsnap", ignore=shutil.ignore_patterns("_core*", "__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE", ".gitignore"):
        shutil.copy(ROOT / name, copy / name)
    return copy


def make_wheel(checkout, folder, **environment):
    """Build a wheel as pip does; without the network, so with the hatchling that is installed."""
    command = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation", "--no-index", "--quiet"]
    known = {n: v for n, v in os.environ.items() if n not in ("MINSNAP_REQUIRE_NATIVE", "CXX", "LD_PRELOAD")}
    return subprocess.run(
        [*command, "--wheel-dir", str(folder), str(checkout)],
        env=known | environment,
        capture_output=True,
        text=True,
        check=False,
    )


def names(folder):
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        return wheel.name, archive.namelist()


def test_with_a_compiler_the_wheel_holds_the_library_for_every_python(checkout, tmp_path):
    try:
        build.find_compiler()
    except build.NoCompilerError:
        pytest.skip("there is no C++ compiler")
    run = make_wheel(checkout, tmp_path, MINSNAP_REQUIRE_NATIVE="1")
    assert run.returncode == 0, run.stderr
    wheel, files = names(tmp_path)
    assert "-py3-none-" in wheel and "-any" not in wheel
    assert f"minsnap/native/{build.LIBRARY.name}" in files and "minsnap/native/src/basics/library.cpp" in files
    assert not (checkout / "minsnap" / "native" / build.LIBRARY.name).exists()


def test_without_a_compiler_the_wheel_is_pure_and_says_why(checkout, tmp_path):
    run = make_wheel(checkout, tmp_path, CXX="no-such-compiler")
    assert run.returncode == 0, run.stderr
    wheel, files = names(tmp_path)
    assert wheel.endswith("-py3-none-any.whl")
    assert f"minsnap/native/{build.LIBRARY.name}" not in files and "minsnap/native/src/basics/library.cpp" in files
    (path,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(path) as archive:
        assert b"CXX=no-such-compiler is not on the PATH" in archive.read("minsnap/native/_core.txt")


@pytest.mark.parametrize("compiler", ["no-such-compiler", "false"])
def test_where_the_native_core_is_required_a_wheel_without_it_fails(checkout, tmp_path, compiler):
    run = make_wheel(checkout, tmp_path, CXX=compiler, MINSNAP_REQUIRE_NATIVE="1")
    assert run.returncode != 0 and compiler in run.stderr
    assert list(tmp_path.glob("*.whl")) == []


def test_a_compiler_that_fails_is_said_and_not_required(checkout, tmp_path):
    run = make_wheel(checkout, tmp_path, CXX="false")
    assert run.returncode == 0, run.stderr
    assert names(tmp_path)[0].endswith("-py3-none-any.whl")
