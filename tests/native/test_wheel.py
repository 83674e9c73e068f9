"""What pip installs: with a compiler, without one, with one that fails, and where no core is asked for."""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import zipfile

import pytest

import minsnap
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
    known = {n: v for n, v in os.environ.items() if n not in ("MINSNAP_CORE", "MINSNAP_PURE", "CXX", "LD_PRELOAD")}
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
    run = make_wheel(checkout, tmp_path, MINSNAP_CXXFLAGS="-O0")  # in a tenth of the time
    assert run.returncode == 0, run.stderr
    wheel, files = names(tmp_path)
    assert "-py3-none-" in wheel and "-any" not in wheel
    assert f"minsnap/native/{build.LIBRARY.name}" in files and "minsnap/native/src/basics/library.cpp" in files
    for name in ("include/minsnap.h", "include/minsnap.hpp", "cmake/minsnap-config.cmake", "CMakeLists.txt"):
        assert f"minsnap/native/{name}" in files
    assert not (checkout / "minsnap" / "native" / build.LIBRARY.name).exists()
    with zipfile.ZipFile(tmp_path / wheel) as archive:
        (core,) = json.loads(archive.read(next(name for name in files if "/sboms/" in name)))["components"]
        held = archive.read(core["name"])
    assert core["hashes"] == [{"alg": "SHA-256", "content": hashlib.sha256(held).hexdigest()}]


def test_two_builds_in_two_places_make_the_same_bytes(checkout, tmp_path):
    """The Python part alone; ``release/wheels.py --twice`` compares compiled ones."""
    made = []
    for place in ("here", "elsewhere"):
        copy = shutil.copytree(checkout, tmp_path / place, copy_function=shutil.copy)  # written now, not when it was
        run = make_wheel(copy, tmp_path / f"{place}_made", MINSNAP_PURE="1")
        assert run.returncode == 0, run.stderr
        (wheel,) = (tmp_path / f"{place}_made").glob("*.whl")
        made.append(wheel.read_bytes())
    assert made[0] == made[1]


def test_a_wheel_without_the_core_is_made_where_that_is_asked_for(checkout, tmp_path):
    run = make_wheel(checkout, tmp_path, CXX="no-such-compiler", MINSNAP_PURE="1")
    assert run.returncode == 0, run.stderr
    wheel, files = names(tmp_path)
    assert wheel.endswith("-py3-none-any.whl")
    assert f"minsnap/native/{build.LIBRARY.name}" not in files and "minsnap/native/src/basics/library.cpp" in files
    (path,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(path) as archive:
        bill = json.loads(archive.read(f"minsnap-{minsnap.__version__}.dist-info/sboms/minsnap.cdx.json"))
        assert bill["metadata"]["component"]["version"] == minsnap.__version__ and bill["components"] == []
        assert b"installed with MINSNAP_PURE=1" in archive.read("minsnap/native/_core.txt")


@pytest.mark.parametrize(
    ("compiler", "sentence"),
    [
        ("no-such-compiler", "CXX=no-such-compiler is not on the PATH: name another compiler"),
        ("false", "false failed: name another compiler in CXX, or set MINSNAP_PURE=1"),
        ("crashes", "crashes was ended by signal 11: name another compiler in CXX"),
    ],
)
def test_a_compiler_that_is_missing_fails_or_crashes_makes_no_wheel(checkout, tmp_path, compiler, sentence):
    crashing = tmp_path / "crashes"
    crashing.write_text("#!/bin/sh\nkill -SEGV $$\n", encoding="utf-8")
    crashing.chmod(0o755)
    run = make_wheel(checkout, tmp_path / "wheels", CXX=compiler, PATH=f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    assert run.returncode != 0 and sentence in run.stderr and "Traceback" not in run.stderr
    assert list(tmp_path.rglob("*.whl")) == []


def build_requires(checkout, **environment):
    """The packages that pip installs before it builds, as hatchling names them."""
    code = "import hatchling.build as build; print(build.get_requires_for_build_wheel())"
    known = {name: value for name, value in os.environ.items() if name not in ("CXX", "MINSNAP_PURE")}
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=checkout, env=known | environment, capture_output=True, text=True, check=True
    )
    return run.stdout


def test_a_compiler_is_asked_for_only_where_there_is_none(checkout, tmp_path):
    (tmp_path / "c++").write_text("#!/bin/sh\n", encoding="utf-8")
    (tmp_path / "c++").chmod(0o755)
    empty = tmp_path / "empty"
    empty.mkdir()
    assert "ziglang" in build_requires(checkout, PATH=str(empty))
    assert "ziglang" not in build_requires(checkout, PATH=str(empty), MINSNAP_PURE="1")
    assert "ziglang" not in build_requires(checkout, PATH=str(tmp_path))
    assert "ziglang" in build_requires(checkout, MINSNAP_PLATFORM="win_amd64")
