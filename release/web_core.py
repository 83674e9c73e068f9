"""Compile the native core to WebAssembly for the page of docs/play, by zig's compiler, as the wheels are.

``python release/web_core.py [TARGET]`` writes docs/play/minsnap.wasm, or TARGET, and beside it a digest of what it was
compiled from. What the compiler keeps lies in build/zig. The searches for other degrees and numbers of coordinates than
the public header takes are left out, and what the linker finds no use for.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
from pathlib import Path

from minsnap.native.build import INCLUDE, SOURCES

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "play"
TARGET = PAGE / "minsnap.wasm"
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
    *("-target", "wasm32-wasi", "-msimd128", "-O3", "-fno-exceptions", "-fno-rtti", "-fvisibility=hidden"),
    *("-fno-math-errno", "-ffp-contract=off", "-fno-sanitize=all", "-Wall", "-Wextra", "-Wno-psabi"),
)
"""Those of ``minsnap.native.build``; zig's own would add checks of undefined behaviour."""


def sources() -> list[Path]:
    """Return the sources that are compiled."""
    found = (path for path in SOURCES.rglob("*.cpp") if path.name not in SEARCHES)
    return sorted(path for path in found if path.relative_to(SOURCES).parts[0] not in LEFT_OUT)


def digest() -> str:
    """Return a digest of all that the core of the page is compiled from and with."""
    total = hashlib.sha256(" ".join((*FLAGS, *sorted(SMALL), OTHER_SEARCHES)).encode())
    used = [path for path in SOURCES.rglob("*.hpp") if path.relative_to(SOURCES).parts[0] not in LEFT_OUT]
    for path in sorted([*used, *sources(), INCLUDE / "minsnap.h", PAGE / "play.c"]):
        total.update(path.name.encode() + path.read_bytes())
    return total.hexdigest()


def is_current(target: Path = TARGET) -> bool:
    """Whether a core that was compiled is that of the sources."""
    stamp = target.with_suffix(".txt")
    return target.exists() and stamp.exists() and stamp.read_text(encoding="utf-8").strip() == digest()


def run(*arguments: object) -> None:
    """Run zig's compiler; end with its words where it fails."""
    caches = dict.fromkeys(("ZIG_GLOBAL_CACHE_DIR", "ZIG_LOCAL_CACHE_DIR"), str(ROOT / "build" / "zig"))
    command = [sys.executable, "-m", "ziglang", *map(str, arguments)]
    done = subprocess.run(command, env={**caches, **os.environ}, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"zig failed:\n{' '.join(command)}\n{done.stderr.strip()}")


def compile_core(target: Path) -> None:
    """Compile and link ``target``, written whole or not at all."""
    folder = ROOT / "build" / "web"
    folder.mkdir(parents=True, exist_ok=True)
    others = folder / "other_searches.cpp"
    others.write_text(OTHER_SEARCHES, encoding="utf-8")

    def compiled(source: Path) -> Path:
        made = folder / f"{source.stem}.o"
        language = ("cc", "-std=c11") if source.suffix == ".c" else ("c++", "-std=c++17")
        flags = [flag for flag in FLAGS if source.suffix != ".c" or flag not in ("-fno-rtti", "-Wno-psabi")]
        own = ["-Oz"] if source.name in SMALL else []
        run(*language, *flags, *own, f"-I{SOURCES}", f"-I{INCLUDE}", "-c", source, "-o", made)
        print(f"compiled {source.name}", file=sys.stderr, flush=True)
        return made

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        objects = list(pool.map(compiled, [*sources(), others, PAGE / "play.c"]))
    linked = folder / "minsnap.wasm"
    run("c++", "-target", "wasm32-wasi", "-mexec-model=reactor", "-O3", "-s", *objects, "-o", linked)
    os.replace(linked, target)
    target.with_suffix(".txt").write_text(digest() + "\n", encoding="utf-8")
    print(f"{target}: {target.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    wanted = Path(sys.argv[1]) if len(sys.argv) > 1 else TARGET
    if is_current(wanted):
        print(f"{wanted}: up to date")
    elif find_spec("ziglang") is None:
        raise SystemExit("the core of the page is compiled by zig: pip install ziglang")
    else:
        compile_core(wanted)
