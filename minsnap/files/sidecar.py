"""The frame of a setpoint CSV that is not in ENU, in a small file beside it.

The header of a setpoint CSV is fixed and its first line, so that any program can read it; further data are in
``NAME.csv.meta``: JSON with frame, units and rate, and a checksum of the CSV to which it belongs. A CSV without such a
file is in the frame given by the reader, by default ENU.
"""

from __future__ import annotations

import contextlib
import json
import os
import zlib
from pathlib import Path

from minsnap.errors import FileError, FrameError
from minsnap.frames import get_frame
from minsnap.storage.atomic import atomic_write
from minsnap.storage.budget import reading
from minsnap.storage.text import read_text

ENDING = ".meta"
UNITS = "m, s, rad"
LARGEST = 10_000
"""Bytes of the largest such file."""


def note_frame(path: str | os.PathLike[str], frame: str, rate: float) -> None:
    """Write the frame of a CSV that has just been written; for ENU remove an older note instead."""
    if not Path(path).is_file():
        return
    beside = _beside(path)
    if frame == "enu":
        with contextlib.suppress(OSError):  # a file with so long a name can have no note
            beside.unlink(missing_ok=True)
        return
    facts = {"frame": frame, "units": UNITS, "rate": rate, "crc32": _checksum(path)}
    with atomic_write(beside) as file:
        file.write(json.dumps(facts) + "\n")


def frame_of(path: str | os.PathLike[str], asked: str | None = None) -> str:
    """Return the frame of a CSV: that of its note, else the requested one, else ENU.

    Raises
    ------
    FrameError
        If another frame was asked for than the note says.
    FileError
        If the note is damaged, or the CSV was changed after it was written.
    """
    name = get_frame("enu" if asked is None else asked).name
    beside = _beside(path)
    try:
        noted = beside.is_file()
    except (OSError, ValueError):
        noted = False
    if not noted:
        return name
    with reading(beside, "a note on a setpoint file"):
        facts = json.loads(read_text(beside, LARGEST))
        kept, checksum, units = get_frame(facts["frame"]).name, int(facts["crc32"]), facts.get("units")
    if units != UNITS or checksum != _checksum(path):
        raise FileError(f"{path} is not what {beside} was written for: write it again, or remove {beside}")
    if asked is not None and kept != name:
        raise FrameError(f"{path} is in {kept}, as {beside} says, and was asked for in {name}: leave the frame out")
    return kept


def _beside(path: str | os.PathLike[str]) -> Path:
    return Path(f"{os.fspath(path)}{ENDING}")


def _checksum(path: str | os.PathLike[str]) -> int:
    """Return the CRC-32 of a file."""
    total = 0
    with reading(path, "a file"), open(path, "rb") as file:
        while chunk := file.read(1 << 20):
            total = zlib.crc32(chunk, total)
    return total
