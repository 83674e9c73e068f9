"""Build the source archive and the wheels of all platforms into dist/, by cross-compilation, and check each wheel.

``python release/wheels.py [PLATFORM ...]``: all platforms of :data:`minsnap.native.build.PLATFORMS`, or those named.
What the compiler keeps between them lies in build/zig.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

from wheel_check import refuse_unfit

from minsnap.native.build import PLATFORMS

ROOT = Path(__file__).resolve().parents[1]
DIST = ROOT / "dist"


def hatch(kind: str, **environment: str) -> Path:
    """Build a wheel or a source archive, and return its path; end with hatchling's status if that fails."""
    DIST.mkdir(exist_ok=True)
    code = f"import hatchling.build as hatch; print(hatch.build_{kind}({str(DIST)!r}))"
    command = [sys.executable, "-c", code]
    caches = dict.fromkeys(("ZIG_GLOBAL_CACHE_DIR", "ZIG_LOCAL_CACHE_DIR"), str(ROOT / "build" / "zig"))
    run = subprocess.run(
        command, cwd=ROOT, env={**caches, **os.environ, **environment}, stdout=subprocess.PIPE, text=True, check=False
    )
    if run.returncode:
        sys.exit(run.returncode)
    return DIST / run.stdout.splitlines()[-1]


def main(platforms: Iterable[str]) -> None:
    """Build and check."""
    print(hatch("sdist").name)
    for platform in platforms or PLATFORMS:
        wheel = hatch("wheel", MINSNAP_PLATFORM=platform)
        print(f"{wheel.name}: {refuse_unfit(wheel)}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
