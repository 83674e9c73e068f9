"""What the native core of a wheel needs of a system, and that every system that its tag names has it.

``python release/wheel_check.py WHEEL ...`` prints a line for each wheel, and ends with a sentence at the first that is
unfit.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import zipfile
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import lief

CORE = "minsnap/native/_core.bin"
GLIBC = ("libc.so.6", "libm.so.6", "libpthread.so.0", "libdl.so.2", "ld-linux-*.so.?")
PLATFORMS = {
    "manylinux": (lief.ELF.Binary, GLIBC),
    "musllinux": (lief.ELF.Binary, ("libc.so",)),
    "macosx": (lief.MachO.Binary, ("@rpath/_core.bin", "/usr/lib/libSystem.B.dylib")),
    "win": (lief.PE.Binary, ("KERNEL32.dll", "api-ms-win-crt-*.dll", "WS2_32.dll")),
}
"""By the beginning of a platform's tag: the form of its libraries, and those that every such system has."""

MACHINES = {"x86_64": ("X86_64",), "aarch64": ("AARCH64",), "arm64": ("ARM64",), "amd64": ("AMD64",)}
"""By the end of a platform's tag: how lief names the machine."""


class UnfitWheelError(Exception):
    """A wheel would not load, or not everywhere, on the platform of its tag."""


def needed(core: Any) -> list[str]:
    """Return the libraries that a core loads."""
    if isinstance(core, lief.PE.Binary):
        return [str(entry.name) for entry in core.imports]
    return [str(getattr(library, "name", library)) for library in core.libraries]


def exported(core: Any) -> list[str]:
    """Return the names that a core shows to others."""
    if isinstance(core, lief.PE.Binary):
        return [str(entry.name) for entry in core.get_export().entries]
    return [str(symbol.name) for symbol in core.exported_symbols]


def machine(core: Any) -> str:
    """Return the name of the processor that a core is for."""
    header = core.header
    for name in ("machine_type", "cpu_type", "machine"):
        if hasattr(header, name):
            return str(getattr(header, name)).rsplit(".", 1)[-1]
    raise UnfitWheelError("its core names no machine")


def refuse_unfit(wheel: Path) -> str:
    """Return what a wheel's core needs, in words.

    Raises
    ------
    UnfitWheelError
        If it holds no core, one of another platform, one that needs a library that not every such system has, or one
        without entry points or, but on macOS, with other names beside them.
    """
    platform = wheel.stem.split("-")[-1]
    kind, known = next(value for start, value in PLATFORMS.items() if platform.startswith(start))
    with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(wheel) as archive:
        core = lief.parse(archive.extract(CORE, folder)) if CORE in archive.namelist() else None
    if not isinstance(core, kind) or machine(core) not in _machines(platform):
        raise UnfitWheelError(f"{wheel.name} holds no core of {platform}")
    strange = [name for name in needed(core) if not any(fnmatch(name, pattern) for pattern in known)]
    if strange:
        raise UnfitWheelError(f"{wheel.name} needs {', '.join(strange)}, which not every such system has")
    entries = [name for name in exported(core) if name.lstrip("_").startswith("minsnap_")]
    others = len(exported(core)) - len(entries)
    if not entries or others and kind is not lief.MachO.Binary:
        raise UnfitWheelError(f"{wheel.name} shows {len(entries)} entry points and {others} other names")
    if platform.startswith("manylinux"):
        _refuse_by_auditwheel(wheel, platform.split(".")[-1])
    return f"{len(entries)} entry points, needs {', '.join(needed(core))}"


def _machines(platform: str) -> tuple[str, ...]:
    return next(names for end, names in MACHINES.items() if platform.endswith(end))


def _refuse_by_auditwheel(wheel: Path, platform: str) -> None:
    command = [sys.executable, "-m", "auditwheel", "show", str(wheel)]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    if f'"{platform}"' not in run.stdout:
        raise UnfitWheelError(f"auditwheel does not take {wheel.name} for {platform}: {run.stdout}{run.stderr}")


if __name__ == "__main__":
    for path in sys.argv[1:]:
        print(f"{path}: {refuse_unfit(Path(path))}")
