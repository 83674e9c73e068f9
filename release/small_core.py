"""The core compiled by zig for programs that ask for nothing but the public header: what is left out, and how.

What the compiler keeps lies in build/zig. The searches for other degrees and numbers of coordinates than the public
header takes are left out, and what the linker finds no use for.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
from pathlib import Path

from minsnap.native.build import INCLUDE, SOURCES

ROOT = Path(__file__).resolve().parents[1]
LEFT_OUT = ("sender", "fleet", "maps", "stopping")
"""Folders that the planner of the public header does not call."""

SEARCHES = ("search_other.cpp", "search_many.cpp")
"""Sources of searches that it never asks for."""

SMALL = frozenset(
    {"exchange_extended.cpp", "chain_high.cpp", "extended.cpp", "closed.cpp", "durations.cpp", "least_slack.cpp"}
)
"""Sources compiled for size: what they do is seldom wanted, or takes no time. The bits are the same."""

OTHER_SEARCHES = """#include "shortest_time/searches.hpp"
namespace minsnap {
Status search_other(const ShortestRequest &, ShortestAnswer &) { return Status::unsupported; }
Status search_many(const ShortestRequest &, ShortestAnswer &) { return Status::unsupported; }
}  // namespace minsnap
"""

FLAGS = (
    *("-fno-exceptions", "-fno-rtti", "-fvisibility=hidden", "-fno-math-errno", "-ffp-contract=off"),
    *("-fno-sanitize=all", "-Wall", "-Wextra", "-Wno-psabi"),
)
"""Those of ``minsnap.native.build``; zig's own would add checks of undefined behaviour."""


def sources() -> list[Path]:
    """Return the sources that are compiled."""
    found = (path for path in SOURCES.rglob("*.cpp") if path.name not in SEARCHES)
    return sorted(path for path in found if path.relative_to(SOURCES).parts[0] not in LEFT_OUT)


def headers() -> list[Path]:
    """Return the headers that they may include."""
    found = (path for path in SOURCES.rglob("*.hpp") if path.relative_to(SOURCES).parts[0] not in LEFT_OUT)
    return [*found, INCLUDE / "minsnap.h"]


def run(*arguments: object) -> None:
    """Run zig's compiler; end with its words where it fails."""
    if find_spec("ziglang") is None:
        raise SystemExit("this is compiled by zig: pip install ziglang")
    caches = dict.fromkeys(("ZIG_GLOBAL_CACHE_DIR", "ZIG_LOCAL_CACHE_DIR"), str(ROOT / "build" / "zig"))
    command = [sys.executable, "-m", "ziglang", *map(str, arguments)]
    done = subprocess.run(command, env={**caches, **os.environ}, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"zig failed:\n{' '.join(command)}\n{done.stderr.strip()}")


def compiled(folder: Path, flags: Sequence[str], program: Path) -> list[Path]:
    """Compile the core and a source in C that calls it into a folder, with flags of a target; return the objects."""
    folder.mkdir(parents=True, exist_ok=True)
    others = folder / "other_searches.cpp"
    others.write_text(OTHER_SEARCHES, encoding="utf-8")

    def made(source: Path) -> Path:
        target = folder / f"{source.stem}.o"
        in_c = source.suffix == ".c"
        language = ("cc", "-std=c11") if in_c else ("c++", "-std=c++17")
        shared = [flag for flag in FLAGS if not in_c or flag not in ("-fno-rtti", "-Wno-psabi")]
        own = ["-Oz"] if source.name in SMALL else []
        run(*language, *flags, *shared, *own, f"-I{SOURCES}", f"-I{INCLUDE}", "-c", source, "-o", target)
        print(f"compiled {source.name}", file=sys.stderr, flush=True)
        return target

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(made, [*sources(), others, program]))
