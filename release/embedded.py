"""Compile tests/cpp/from_c.c with the core into static programs for small machines, and run them where qemu is.

``python release/embedded.py [MACHINE ...]`` writes build/embedded/MACHINE/from_c, for aarch64 and 32-bit ARM or for
those named. The program plans a rectangle in its corridor and plans anew in flight; its digest must be that of the
core here.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Iterable

from small_core import INCLUDE, ROOT, compiled, run

from minsnap.native.build import LIBRARY

TARGETS = {"aarch64": "aarch64-linux-musl", "arm": "arm-linux-musleabihf"}
FOR_SIZE = ("-Os", "-ffunction-sections", "-fdata-sections")
MOST = 2_000_000
"""Bytes that a program may have."""

PROGRAM = ROOT / "tests" / "cpp" / "from_c.c"


def said_here() -> str:
    """Return what the program says with the core of this machine, its digests included."""
    program = ROOT / "build" / "embedded" / "from_c"
    library = program.with_name("libminsnap.so")  # zig goes by the ending
    shutil.copy(LIBRARY, library)
    run("cc", "-std=c11", f"-I{INCLUDE}", PROGRAM, library, f"-Wl,-rpath,{library.parent}", "-o", program)
    return subprocess.run([program], capture_output=True, text=True, check=True).stdout


def build(machine: str) -> str:
    """Compile, link and run the program of a machine; return a sentence on it."""
    folder = ROOT / "build" / "embedded" / machine
    target = ("-target", TARGETS[machine], *FOR_SIZE)
    program = folder / "from_c"
    objects = compiled(folder, target, PROGRAM)
    run("c++", *target, "-static", "-s", "-Wl,--gc-sections", *objects, "-o", program)
    size = program.stat().st_size
    if size > MOST:
        raise SystemExit(f"{program} has {size / 1e6:.2f} MB, and may have {MOST / 1e6:g}")
    emulator = shutil.which(f"qemu-{machine}") or shutil.which(f"qemu-{machine}-static")
    if emulator is None:
        return f"{machine}: {size / 1e6:.2f} MB, not run: there is no qemu-{machine}"
    done = subprocess.run([emulator, program], capture_output=True, text=True, check=False)
    if done.returncode or done.stdout.splitlines()[0] != said_here().splitlines()[0]:
        raise SystemExit(f"{program} ends with {done.returncode} and says: {done.stdout}{done.stderr}")
    return f"{machine}: {size / 1e6:.2f} MB, with the bits of this machine"


def main(machines: Iterable[str]) -> None:
    """Build and run."""
    for machine in machines or TARGETS:
        if machine not in TARGETS:
            raise SystemExit(f"no machine is called {machine}: choose of {', '.join(TARGETS)}")
        print(build(machine), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
