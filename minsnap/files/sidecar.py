"""What a setpoint CSV says of itself: its frame in a column, and its origin and its lead in a small file beside it.

A CSV in another frame than ENU has a last column ``frame_ned`` of ones, which stays with the numbers wherever they go
and which readers of columns by name, and of the first twelve, do not notice. Further data are in ``NAME.csv.meta``:
JSON with frame, units and rate, the origin where it is known, how much earlier than planned its rows are to be sent,
and a checksum of the CSV to which it belongs. A CSV that says nothing is in the frame that the reader names, by default
ENU.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from minsnap.basics.messages import shown
from minsnap.basics.storage.atomic import atomic_write
from minsnap.basics.storage.reading import check_regular, reading
from minsnap.basics.storage.text import read_text
from minsnap.errors import FileError, FrameError
from minsnap.files.frames import FRAMES, get_frame

ENDING = ".meta"
UNITS = "m, s, rad"
LARGEST = 10_000
"""Bytes of the largest such file."""

COLUMN = "frame_"
"""How the name of the column begins that says a frame."""

FRAME_COLUMNS = tuple(COLUMN + name for name in FRAMES)
"""The names of that column."""

_HEADER = 4096
"""Bytes of a CSV in which its header is sought."""


def note_frame(
    path: str | os.PathLike[str], frame: str, rate: float, origin: Sequence[float] | None = None, lead: float = 0.0
) -> None:
    """Write frame, origin and lead of a CSV that has just been written; where there is nothing to say remove a note.

    Parameters
    ----------
    path : str or path
    frame : str
    rate : float
        [Hz].
    origin : sequence of 3 float, optional
        WGS 84 latitude and longitude [degrees] and altitude [m] of the point (0, 0, 0).
    lead : float
        How much earlier than planned the rows are to be sent [s].
    """
    if not Path(path).is_file():
        return
    beside = _beside(path)
    if frame == "enu" and origin is None and not lead:
        with contextlib.suppress(OSError):  # a file with so long a name can have no note
            beside.unlink(missing_ok=True)
        return
    facts = {"frame": frame, "units": UNITS, "rate": rate, "crc32": _checksum(path)}
    if origin is not None:
        facts["origin"] = [float(value) for value in origin]
    if lead:
        facts["lead"] = lead
    with atomic_write(beside) as file:
        file.write(json.dumps(facts) + "\n")


def frame_of(path: str | os.PathLike[str], wanted: str | None = None) -> str:
    """Return the frame of a CSV: that of its header or its note, else the requested one, else ENU.

    Raises
    ------
    FrameError
        If the caller, the file and the note name different frames.
    FileError
        If the note is damaged, or the CSV was changed after it was written.
    """
    name = get_frame("enu" if wanted is None else wanted).name
    kept = said_frame(path) or name
    if wanted is not None and kept != name:
        where = "its header" if _headed(path) else _beside(path)
        raise FrameError(f"{path} is in {kept}, as {where} says, not in {name}: leave the frame out")
    return kept


def said_frame(path: str | os.PathLike[str]) -> str | None:
    """Return the frame that a CSV says in its header, or in its note; None where neither does.

    Raises
    ------
    FrameError
        If they say different ones.
    FileError
        If the note is damaged, or the CSV was changed after it was written.
    """
    inside, beside = _headed(path), _noted(path).get("frame")
    if inside is not None and beside is not None and inside != beside:
        raise FrameError(f"{path} is in {inside} as its header says, and in {beside} as {_beside(path)} says")
    return inside or beside


def _headed(path: str | os.PathLike[str]) -> str | None:
    """Return the frame that the header of a CSV says, or None; what is wrong with a file is said by its reader."""
    check_regular(path)
    try:
        if not Path(path).is_file():  # a pipe would be waited for
            return None
        with open(path, "rb") as file:
            header = file.readline(_HEADER).decode("utf-8", "replace")
    except (OSError, ValueError, TypeError):
        return None
    names = [cell.strip().strip('"') for cell in header.split(",")]
    return next((cell.removeprefix(COLUMN) for cell in names if cell in FRAME_COLUMNS), None)


def origin_of(path: str | os.PathLike[str]) -> tuple[float, ...] | None:
    """Return latitude and longitude [degrees] and altitude [m] of the origin of a CSV; None where its note has none.

    Raises
    ------
    FileError
        If the note is damaged, or the CSV was changed after it was written.
    """
    return _noted(path).get("origin")


def lead_of(path: str | os.PathLike[str]) -> float:
    """Return how much earlier than planned the rows of a CSV are to be sent [s]; 0 where its note does not say.

    Raises
    ------
    FileError
        If the note is damaged, or the CSV was changed after it was written.
    """
    return float(_noted(path).get("lead", 0.0))


def _noted(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return frame, origin and lead from the note of a CSV, as far as it has them; nothing without a note."""
    beside = _beside(path)
    try:
        if not beside.is_file():
            return {}
    except (OSError, ValueError):
        return {}
    with reading(beside, "a note on a setpoint file"):
        facts = json.loads(read_text(beside, LARGEST))
        facts_read: dict[str, Any] = {"frame": get_frame(facts["frame"]).name, "lead": float(facts.get("lead", 0.0))}
        if facts.get("origin") is not None:
            latitude, longitude, altitude = map(float, facts["origin"])
            facts_read["origin"] = (latitude, longitude, altitude)
        checksum, units = int(facts["crc32"]), facts.get("units")
    if not 0.0 <= facts_read["lead"] < math.inf:
        raise FileError(f"{beside} says a lead of {facts_read['lead']} s: it must be 0 or more")
    if units != UNITS or checksum != _checksum(path):
        raise FileError(f"{path} is not the file that {beside} was written for: write it again, or remove {beside}")
    return facts_read


def noted_beside(path: str | os.PathLike[str]) -> str | None:
    """Return the name of the note of a CSV, or None where it has none."""
    beside = _beside(path)
    return str(beside) if beside.is_file() else None


def _beside(path: str | os.PathLike[str]) -> Path:
    try:
        return Path(f"{os.fspath(path)}{ENDING}")
    except TypeError:
        raise FileError(f"{shown(path)} is no name of a file") from None


def _checksum(path: str | os.PathLike[str]) -> int:
    """Return the CRC-32 of a file."""
    total = 0
    with reading(path, "a file"), open(path, "rb") as file:
        while chunk := file.read(1 << 20):
            total = zlib.crc32(chunk, total)
    return total
