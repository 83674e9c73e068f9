"""Build the source archive and the wheels of all platforms into dist/, by cross-compilation, and check each wheel.

``python release/wheels.py [PLATFORM ...]``: all platforms of :data:`minsnap.native.build.PLATFORMS`, or those named.
What the compiler keeps between them lies in build/zig. ``--twice`` builds each a second time, from a copy of the
checkout in another folder and by a compiler that remembers nothing, and ends with a sentence where the bytes differ.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from wheel_check import refuse_unfit

from minsnap.native.build import PLATFORMS

ROOT = Path(__file__).resolve().parents[1]
DIST = ROOT / "dist"


def hatch(kind: str, root: Path = ROOT, **environment: str) -> Path:
    """Build a wheel or a source archive of a checkout into its dist/, and return its path.

    Ends with hatchling's status if that fails.
    """
    dist = root / DIST.name
    dist.mkdir(exist_ok=True)
    code = f"import hatchling.build as hatch; print(hatch.build_{kind}({str(dist)!r}))"
    command = [sys.executable, "-c", code]
    caches = dict.fromkeys(("ZIG_GLOBAL_CACHE_DIR", "ZIG_LOCAL_CACHE_DIR"), str(root / "build" / "zig"))
    run = subprocess.run(
        command, cwd=root, env={**caches, **os.environ, **environment}, stdout=subprocess.PIPE, text=True, check=False
    )
    if run.returncode:
        sys.exit(run.returncode)
    return dist / run.stdout.splitlines()[-1]


def refuse_unlike(made: Path, kind: str, **environment: str) -> None:
    """Build once more, from a copy of the checkout, and end with a sentence where that makes other bytes."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "elsewhere"
        files = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
        for name in filter(None, files.split("\0")):
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, copy / name)
        caches = dict.fromkeys(("ZIG_GLOBAL_CACHE_DIR", "ZIG_LOCAL_CACHE_DIR"), f"{folder}/zig")
        if hatch(kind, copy, **caches, **environment).read_bytes() != made.read_bytes():
            sys.exit(f"{made.name} was built twice, and the two differ")


def main(arguments: list[str]) -> None:
    """Build and check."""
    platforms = [name for name in arguments if name != "--twice"]
    twice = len(platforms) < len(arguments)
    source = hatch("sdist")
    print(source.name)
    if twice:
        refuse_unlike(source, "sdist")
    for platform in platforms or PLATFORMS:
        wheel = hatch("wheel", MINSNAP_PLATFORM=platform)
        print(f"{wheel.name}: {refuse_unfit(wheel)}", flush=True)
        if twice:
            refuse_unlike(wheel, "wheel", MINSNAP_PLATFORM=platform)


if __name__ == "__main__":
    main(sys.argv[1:])
