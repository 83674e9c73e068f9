"""Compile the native core: ``python -m minsnap.native.build`` puts the library beside this file.

Nothing heavy is imported here: the module runs where minsnap is only being installed, without numpy. And what
compiling needs is imported where it is needed, since every process that plans loads this module for ``LIBRARY``.

Environment: ``CXX`` names the compiler, ``MINSNAP_CXXFLAGS`` adds flags (``-Werror`` in development, sanitizers),
``MINSNAP_PLATFORM`` is the platform of a wheel, one of ``PLATFORMS``, to compile for with the package ``ziglang``.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

HERE = Path(__file__).resolve().parent
SOURCES = HERE / "src"
INCLUDE = HERE / "include"
"""What C and C++ programs include."""

LIBRARY = HERE / "_core.bin"
"""The compiled library; with the ending ``.so`` it would pass for an extension module of Python."""

STAMP = HERE / "_core.txt"
"""What the library was compiled from and with, or why there is none; two lines."""

COMPILERS = ("c++", "g++", "clang++")
FLAGS = (
    *("-std=c++17", "-O3", "-fPIC", "-fvisibility=hidden", "-fno-exceptions", "-fno-rtti"),
    *("-fno-math-errno", "-ffp-contract=off", "-Wall", "-Wextra", "-Wno-psabi", "-pthread"),
    *("-fno-gcse", "-fno-gcse-after-reload", "-Wno-ignored-optimization-argument"),
)
"""Without contraction every machine rounds alike; the results do not depend on which instructions a processor has.

GCC's search for common subexpressions across blocks (-fgcse) takes a third of the time of compiling the searches and
gains them nothing; clang has none, and would warn of the flags.
"""

BRIEF: Mapping[str, tuple[str, ...]] = {
    "search_many.cpp": ("-O2",),
    "search_other.cpp": ("-O2", "-fpeel-loops"),
    "gathered_limits.cpp": ("-O2",),
}
"""Sources compiled in less than half of the time, with flags of their own: searches in five coordinates, which are
rare; with other degrees than 7, whose loops GCC unrolls for this flag; sums of limits, with vectors written out."""

PLATFORMS: Mapping[str, str] = {
    "manylinux2014_x86_64.manylinux_2_17_x86_64": "x86_64-linux-gnu.2.17",
    "manylinux2014_aarch64.manylinux_2_17_aarch64": "aarch64-linux-gnu.2.17",
    "musllinux_1_2_x86_64": "x86_64-linux-musl",
    "musllinux_1_2_aarch64": "aarch64-linux-musl",
    "macosx_10_13_x86_64": "x86_64-macos.10.13",
    "macosx_11_0_arm64": "aarch64-macos.11.0",
    "win_amd64": "x86_64-windows-gnu",
}
"""The platforms of the wheels that are released, as pip names them and as zig does."""

ADVICE = "install g++ or clang, or the package ziglang beside minsnap, and run python -m minsnap.native.build"

ROOM = "free some space on the disk; compiling the core takes 50 MB, and with zig's compiler 700 MB"


def get_include() -> str:
    """Return the folder of ``minsnap.h`` and ``minsnap.hpp``, which C and C++ programs include."""
    return str(INCLUDE)


def cmake_dir() -> str:
    """Return the folder in which CMake finds the package ``minsnap``, for ``CMAKE_PREFIX_PATH`` or ``minsnap_DIR``."""
    return str(HERE / "cmake")


class NoCompilerError(RuntimeError):
    """No C++ compiler is on the PATH, and the package ``ziglang`` is not installed."""


class CompilationError(RuntimeError):
    """A compiler was found and failed; the message holds what it printed."""


def find_compiler() -> list[str]:
    """Return the command of the C++ compiler: ``CXX``, the first of ``COMPILERS`` on the PATH, or that of ``ziglang``.

    Raises
    ------
    NoCompilerError
        If there is none.
    """
    named = os.environ.get("CXX", "")
    if "MINSNAP_PLATFORM" not in os.environ:
        command = _on_path(named)
        if command:
            return command
        if named:
            raise NoCompilerError(f"CXX={named} is not on the PATH: name another compiler, or none to have one chosen")
    command = _ziglang()
    if command:
        return command
    raise NoCompilerError(f"none of {', '.join(COMPILERS)} is on the PATH: {ADVICE}")


def _on_path(named: str) -> list[str]:
    import shlex
    import shutil

    for command in [shlex.split(named)] if named else [[name] for name in COMPILERS]:
        if command and shutil.which(command[0]):
            return command
    return []


def _ziglang() -> list[str]:
    """Return the command of zig's C++ compiler for a common processor of the platform; empty if it is not installed."""
    from importlib.util import find_spec

    if find_spec("ziglang") is None:
        return []
    return [sys.executable, "-m", "ziglang", "c++", "-target", _target()]


def _target() -> str:
    """Return the target as zig names it: that of ``MINSNAP_PLATFORM``, or of this machine."""
    import platform
    import sysconfig

    asked = os.environ.get("MINSNAP_PLATFORM")
    if asked is not None:
        if asked not in PLATFORMS:
            raise NoCompilerError(f"MINSNAP_PLATFORM is {asked!r}: it must be one of {', '.join(PLATFORMS)}")
        return PLATFORMS[asked]
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine().lower())
    if sys.platform == "win32":
        return f"{machine}-windows-gnu"
    if sys.platform == "darwin":
        return f"{machine}-macos"
    return f"{machine}-linux-{'musl' if 'musl' in str(sysconfig.get_config_var('HOST_GNU_TYPE')) else 'gnu'}"


def requirements() -> list[str]:
    """Return the packages that a build has to install first: zig's compiler where there is no other."""
    if os.environ.get("MINSNAP_PLATFORM") is None and (os.environ.get("CXX") or _on_path("")):
        return []
    return ["ziglang>=0.13"]


def flags(*more: str) -> list[str]:
    """Return the flags of a compilation with more of its own, those of ``MINSNAP_CXXFLAGS`` last."""
    import shlex

    return [*FLAGS, *more, *shlex.split(os.environ.get("MINSNAP_CXXFLAGS", ""))]


def _link_flags(compiler: list[str], target: Path) -> list[str]:
    """Return what links a library that has no symbols but its entry points, unless it is to be debugged.

    On Windows the compiler's runtime is inside; zig's is so everywhere, and ``-static`` would make it an archive.
    """
    platform, by_zig = os.environ.get("MINSNAP_PLATFORM", ""), "ziglang" in compiler
    on_mac = platform.startswith("macosx") if platform else sys.platform == "darwin"
    on_windows = platform.startswith("win") if platform else sys.platform == "win32"
    linking = ["-shared"]
    if not any(flag.startswith("-g") for flag in flags()):
        linking.append("-Wl,-x" if on_mac and not by_zig else "-s")
    if on_mac:
        return [*linking, f"-Wl,-install_name,@rpath/{target.name}"]
    if on_windows:
        return linking if by_zig else [*linking, "-static"]
    return [*linking, f"-Wl,--version-script={SOURCES / 'exports.map'}"]


def digest(*more: str) -> str:
    """Return a digest of all sources and flags, and of more flags: what decides whether a library is up to date."""
    import hashlib

    total = hashlib.sha256(" ".join(dict.fromkeys([*flags(), *more])).encode())
    for folder, pattern in ((SOURCES, "*.[ch]pp"), (INCLUDE, "*.h")):
        for path in sorted(folder.rglob(pattern)):
            total.update(path.relative_to(folder).as_posix().encode() + path.read_bytes())
    return total.hexdigest()


def is_current() -> bool:
    """Whether the library beside this file is that of the sources and flags, built with or without -Werror."""
    if not (LIBRARY.exists() and STAMP.exists()):
        return False
    return STAMP.read_text(encoding="utf-8").startswith((digest(), digest("-Werror")))


def compile_library(target: Path) -> str:
    """Compile all sources into ``target``, written whole or not at all; return the compiler's name.

    What is done is printed to standard error, a line for each source.

    Raises
    ------
    NoCompilerError, CompilationError
        If there is no compiler, or if it fails.
    """
    import tempfile
    from concurrent.futures import ThreadPoolExecutor

    compiler = find_compiler()
    with _said(target):
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent) as folder:
            sources = sorted(SOURCES.rglob("*.cpp"), reverse=True)  # the longest are then among the first
            _say(f"compiling the native core with {' '.join(compiler)}: {len(sources)} files, a few minutes")
            with ThreadPoolExecutor(_processors()) as pool:
                objects = list(pool.map(lambda source: _compile(compiler, source, Path(folder)), sources))
            linked = Path(folder) / target.name
            _run(
                [*compiler, *flags(), *map(str, objects), *_link_flags(compiler, target), "-o", str(linked)],
                Path(folder),
            )
            os.replace(linked, target)
    return " ".join(compiler)


def _compile(compiler: list[str], source: Path, folder: Path) -> Path:
    import time

    began = time.monotonic()
    made = folder / source.relative_to(SOURCES).with_suffix(".o")
    made.parent.mkdir(parents=True, exist_ok=True)
    _run(
        [
            *compiler,
            *flags(*BRIEF.get(source.name, ())),
            f"-I{SOURCES}",
            f"-I{INCLUDE}",
            "-c",
            str(source),
            "-o",
            str(made),
        ],
        folder,
    )
    _say(f"compiled {source.relative_to(SOURCES)} in {time.monotonic() - began:.0f} s")
    return made


def _processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _say(text: str) -> None:
    print(f"minsnap: {text}", file=sys.stderr, flush=True)


@contextmanager
def _said(target: Path) -> Iterator[None]:
    """Turn what the system refuses while ``target`` is written into one sentence."""
    import errno

    try:
        if target.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        yield
    except OSError as error:
        advice = "compile elsewhere with --output, and name that file in MINSNAP_LIBRARY"
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            advice = ROOM
        raise CompilationError(f"{target} cannot be written ({error.strerror}): {advice}") from None


def _run(command: list[str], folder: Path) -> None:
    """Run a compiler that keeps what it caches in ``folder``."""
    import errno
    import shlex
    import subprocess

    caches = dict.fromkeys(("ZIG_GLOBAL_CACHE_DIR", "ZIG_LOCAL_CACHE_DIR"), str(folder / "cache"))
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, env={**caches, **os.environ})
    except OSError as error:
        raise CompilationError(f"{command[0]}: {error}") from None
    if done.returncode:
        ended = f"was ended by signal {-done.returncode}" if done.returncode < 0 else "failed"
        full = os.strerror(errno.ENOSPC) in done.stderr
        advice = ROOM if full else "name another compiler in CXX, or set MINSNAP_PURE=1 to do without"
        raise CompilationError(f"{command[0]} {ended}: {advice}\n{shlex.join(command)}\n{done.stderr.strip()}")


def build(force: bool = False) -> bool:
    """Compile the library beside this file unless it is up to date; return whether anything was done.

    A library that cannot be compiled anew is removed, so that none is ever loaded that is not of these sources.

    Raises
    ------
    NoCompilerError, CompilationError
        If there is no compiler, or if it fails.
    """
    if is_current() and not force:
        return False
    try:
        compiler = compile_library(LIBRARY)
    except (NoCompilerError, CompilationError) as error:
        with _said(LIBRARY):
            leave_out(str(error).splitlines()[0])
        raise
    STAMP.write_text(f"{digest()}\n{compiler}\n", encoding="utf-8")
    return True


def leave_out(reason: str) -> None:
    """Remove the library beside this file, and note why there is none."""
    LIBRARY.unlink(missing_ok=True)
    STAMP.write_text(f"-\n{reason}\n", encoding="utf-8")


def main(arguments: list[str] | None = None) -> int:
    """Build and say what was done; the exit status is 1 if it failed."""
    import argparse

    parser = argparse.ArgumentParser(prog="python -m minsnap.native.build", description="Compile the native core.")
    parser.add_argument("--force", action="store_true", help="compile even if the library is up to date")
    parser.add_argument("--output", type=Path, help="compile into this file instead, which MINSNAP_LIBRARY may name")
    chosen = parser.parse_args(arguments)
    try:
        done = bool(compile_library(chosen.output.resolve()) if chosen.output else build(chosen.force))
    except (NoCompilerError, CompilationError) as error:
        print(f"the native core was not built: {error}", file=sys.stderr)
        return 1
    print(f"{chosen.output or LIBRARY}: {'built' if done else 'up to date'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
