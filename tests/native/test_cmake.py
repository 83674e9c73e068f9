"""find_package(minsnap) from what a wheel holds, and the examples in C++ that are built so; skipped without CMake."""

import shutil
import subprocess
from pathlib import Path

import pytest

from minsnap.native import build
from minsnap.native.library import core

ROOT = Path(__file__).parents[2]

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("cmake") is None, reason="there is no cmake"),
    pytest.mark.skipif(core().library is None, reason="there is no native core"),
]


def cmake(*arguments):
    """Run cmake; what it says of an error fails the test."""
    run = subprocess.run(["cmake", *map(str, arguments)], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    return run.stdout


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """The files of a wheel that CMake needs, at another place than the checkout's."""
    native = tmp_path_factory.mktemp("site") / "minsnap" / "native"
    for folder in ("include", "cmake"):
        shutil.copytree(build.HERE / folder, native / folder)
    shutil.copy(build.LIBRARY, native)
    return native


def test_examples_are_built_by_a_project_that_finds_the_package(package, tmp_path):
    cmake("-S", ROOT / "examples" / "cpp", "-B", tmp_path, f"-DCMAKE_PREFIX_PATH={package / 'cmake'}")
    cmake("--build", tmp_path)
    said = {
        name: subprocess.run([tmp_path / name], capture_output=True, text=True, check=True).stdout
        for name in ("plan", "replan", "corridor", "gates")
    }
    rows = said["plan"].splitlines()
    assert rows[0] == "t,x,y,z" and len(rows) > 150
    assert said["replan"].splitlines()[-1].startswith("at rest at ")
    assert said["corridor"].startswith("inside by ")
    lap, least = (float(said["gates"].split()[index]) for index in (3, 10))
    assert least <= lap < 1.2 * least


@pytest.mark.parametrize(("asked", "found"), [("0.2", True), ("", True), ("0.1", False), ("99.0", False)])
def test_a_version_that_is_not_compatible_is_refused(package, tmp_path, asked, found):
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.16)\nproject(asks LANGUAGES CXX)\n"
        f"find_package(minsnap {asked} QUIET)\nmessage(STATUS found=${{minsnap_FOUND}})\n"
    )
    said = cmake("-S", tmp_path, "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={package / 'cmake'}")
    assert f"found={1 if found else 0}" in said


def test_a_wheel_without_a_core_says_so(package, tmp_path):
    bare = tmp_path / "native"
    for folder in ("include", "cmake"):
        shutil.copytree(package / folder, bare / folder)
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.16)\nproject(asks LANGUAGES CXX)\nfind_package(minsnap REQUIRED)\n"
    )
    command = ["cmake", "-S", tmp_path, "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={bare / 'cmake'}"]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode != 0 and "this wheel of minsnap holds no compiled core" in " ".join(run.stderr.split())


def test_the_library_is_configured_from_its_own_folder(tmp_path):
    cmake("-S", build.HERE, "-B", tmp_path)
    assert (tmp_path / "minsnap.pc").read_text().count("Version: 0.2.0") == 1
