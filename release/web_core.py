"""Compile the native core to WebAssembly for the page of docs/play, by zig's compiler, as the wheels are.

``python release/web_core.py [TARGET]`` writes docs/play/minsnap.wasm, or TARGET, and beside it a digest of what it was
compiled from.
"""

from __future__ import annotations

import hashlib
import os
import sys
from pathlib import Path

from small_core import FLAGS, OTHER_SEARCHES, ROOT, SMALL, compiled, headers, run, sources

PAGE = ROOT / "docs" / "play"
TARGET = PAGE / "minsnap.wasm"
WEB = ("-target", "wasm32-wasi", "-msimd128", "-O3")


def digest() -> str:
    """Return a digest of all that the core of the page is compiled from and with."""
    total = hashlib.sha256(" ".join((*WEB, *FLAGS, *sorted(SMALL), OTHER_SEARCHES)).encode())
    for path in sorted([*headers(), *sources(), PAGE / "play.c"]):
        total.update(path.name.encode() + path.read_bytes())
    return total.hexdigest()


def is_current(target: Path = TARGET) -> bool:
    """Whether a core that was compiled is that of the sources."""
    stamp = target.with_suffix(".txt")
    return target.exists() and stamp.exists() and stamp.read_text(encoding="utf-8").strip() == digest()


def compile_core(target: Path) -> None:
    """Compile and link ``target``, written whole or not at all."""
    folder = ROOT / "build" / "web"
    objects = compiled(folder, WEB, PAGE / "play.c")
    linked = folder / "minsnap.wasm"
    run("c++", "-target", "wasm32-wasi", "-mexec-model=reactor", "-O3", "-s", *objects, "-o", linked)
    os.replace(linked, target)
    target.with_suffix(".txt").write_text(digest() + "\n", encoding="utf-8")
    print(f"{target}: {target.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    wanted = Path(sys.argv[1]) if len(sys.argv) > 1 else TARGET
    if is_current(wanted):
        print(f"{wanted}: up to date")
    else:
        compile_core(wanted)
