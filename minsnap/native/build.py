"""Compile the native core: ``python -m minsnap.native.build`` puts the library beside this file.

Nothing heavy is imported here: the module runs where minsnap is only being installed, without numpy. And what
compiling needs is imported where it is needed, since every process that plans loads this module for ``LIBRARY``.

Environment: ``CXX`` names the compiler, ``MINSNAP_CXXFLAGS`` adds flags (``-Werror`` in development, sanitizers).
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
SOURCES = HERE / "src"
LIBRARY = HERE / "_core.bin"
"""The compiled library; with the ending ``.so`` it would pass for an extension module of Python."""

STAMP = HERE / "_core.txt"
"""What the library was compiled from and with, or why there is none; two lines."""

COMPILERS = ("c++", "g++", "clang++")
FLAGS = (
    *("-std=c++17", "-O3", "-fPIC", "-fvisibility=hidden", "-fno-exceptions", "-fno-rtti"),
    *("-fno-math-errno", "-ffp-contract=off", "-Wall", "-Wextra", "-Wno-psabi", "-pthread"),
)
"""Without contraction every machine rounds alike; the results do not depend on which instructions a processor has."""


class NoCompilerError(RuntimeError):
    """No C++ compiler is on the PATH."""


class CompilationError(RuntimeError):
    """A compiler was found and failed; the message holds what it printed."""


def find_compiler() -> list[str]:
    """Return the command of the C++ compiler: ``CXX`` if set, else the first of ``COMPILERS`` on the PATH.

    Raises
    ------
    NoCompilerError
        If there is none.
    """
    import shlex
    import shutil

    named = os.environ.get("CXX", "")
    for command in [shlex.split(named)] if named else [[name] for name in COMPILERS]:
        if command and shutil.which(command[0]):
            return command
    missing = f"CXX={named} is not on the PATH" if named else f"none of {', '.join(COMPILERS)} is on the PATH"
    raise NoCompilerError(f"no C++ compiler was found: {missing}")


def flags() -> list[str]:
    """Return the flags of a compilation, those of ``MINSNAP_CXXFLAGS`` last."""
    import shlex

    return [*FLAGS, *shlex.split(os.environ.get("MINSNAP_CXXFLAGS", ""))]


def digest() -> str:
    """Return a digest of all sources and flags: what decides whether a library is up to date."""
    import hashlib

    total = hashlib.sha256(" ".join(flag for flag in flags() if flag != "-Werror").encode())
    for path in sorted(SOURCES.rglob("*.[ch]pp")):
        total.update(path.relative_to(SOURCES).as_posix().encode() + path.read_bytes())
    return total.hexdigest()


def is_current() -> bool:
    """Whether the library beside this file was compiled from the sources as they are, with the flags asked for."""
    return LIBRARY.exists() and STAMP.exists() and STAMP.read_text(encoding="utf-8").startswith(digest())


def compile_library(target: Path) -> str:
    """Compile all sources into ``target``, written whole or not at all; return the compiler's name.

    Raises
    ------
    NoCompilerError, CompilationError
        If there is no compiler, or if it fails.
    """
    import tempfile
    from concurrent.futures import ThreadPoolExecutor

    compiler = find_compiler()
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=target.parent) as folder:
        sources = sorted(SOURCES.rglob("*.cpp"))
        objects = [Path(folder) / f"{source.stem}.o" for source in sources]
        commands = [
            [*compiler, *flags(), f"-I{SOURCES}", "-c", str(s), "-o", str(o)]
            for s, o in zip(sources, objects, strict=True)
        ]
        with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
            list(pool.map(_run, commands))
        linked = Path(folder) / target.name
        _run([*compiler, *flags(), "-shared", *map(str, objects), "-o", str(linked)])
        os.replace(linked, target)
    return " ".join(compiler)


def _run(command: list[str]) -> None:
    import shlex
    import subprocess

    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError as error:
        raise CompilationError(f"{command[0]}: {error}") from None
    if done.returncode:
        raise CompilationError(f"{shlex.join(command)}\n{done.stderr.strip()}")


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
        LIBRARY.unlink(missing_ok=True)
        STAMP.write_text(f"-\n{str(error).splitlines()[0]}\n", encoding="utf-8")
        raise
    STAMP.write_text(f"{digest()}\n{compiler}\n", encoding="utf-8")
    return True


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
