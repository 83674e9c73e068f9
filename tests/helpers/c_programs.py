"""Programs in C and C++ that link the native core, built by the compiler that is here."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from minsnap.native.build import INCLUDE, LIBRARY

TESTS = Path(__file__).resolve().parent.parent / "cpp"
HEADERS = ("minsnap.h", "minsnap.hpp")
SANITIZED = ("-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")


def library() -> Path:
    """The library that the tests run with."""
    return Path(os.environ.get("MINSNAP_LIBRARY", "") or LIBRARY)


def link_flags() -> list[str]:
    """What a program needs that is linked with the library."""
    sanitized = "asan" in os.environ.get("LD_PRELOAD", "")  # as `make sanitize` runs the tests
    return [str(library()), f"-Wl,-rpath,{library().parent}", *SANITIZED * sanitized]


def compiler(language: str) -> str:
    """The compiler for C or C++; the test is skipped without one."""
    names = ("cc", "gcc", "clang") if language == "c" else ("c++", "g++", "clang++")
    found = next(filter(None, map(shutil.which, names)), None)
    if found is None:
        pytest.skip("there is no compiler")
    return found


def build(source: Path, target: Path, *flags: str) -> Path:
    """Compile a program; what the compiler says fails the test."""
    c = source.suffix == ".c"
    command = [compiler("c" if c else "cpp"), "-std=c11" if c else "-std=c++17", f"-I{INCLUDE}", str(source), *flags]
    done = subprocess.run([*command, "-o", str(target)], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and not done.stderr, done.stderr
    return target
