"""The log of ``minsnap stream``: sent setpoints and received positions in the vehicle's local z-down frame."""

from __future__ import annotations

import csv
import os
from collections.abc import Mapping, Sequence

import numpy as np

from minsnap.basics.storage.reading import check_regular
from minsnap.basics.storage.text import read_text
from minsnap.errors import FileError
from minsnap.files.logs.flight_log import FlightLog, flight_log
from minsnap.files.setpoint_csv import COLUMNS, samples_of
from minsnap.trajectory.samples import Samples

START = "time,kind,"
"""How the first line of such a log begins."""


Row = Mapping[str, str]


def is_stream_log(path: str | os.PathLike[str]) -> bool:
    """Return whether a file begins like the log of a stream; false for a file that cannot be read."""
    check_regular(path)
    try:
        with open(path, encoding="utf-8", errors="replace") as file:
            return file.readline().startswith(START)
    except OSError:
        return False


def read_stream_log(path: str | os.PathLike[str]) -> FlightLog:
    """Read the log of ``minsnap stream``.

    Parameters
    ----------
    path : str or path
        What ``--log`` wrote; a last line that was cut off is left out.

    Returns
    -------
    FlightLog
        Its reference are the setpoints that were sent, those before and after the flight included, with their lead.

    Raises
    ------
    FileError
        If the file cannot be read, is no such log, or names no frame.
    """
    lines = read_text(path).splitlines()
    if not lines or not lines[0].startswith(START):
        raise FileError(f"{path} is no log of a stream: its first line does not begin with {START}")
    names = lines[0].split(",")
    rows = [dict(zip(names, cells, strict=True)) for cells in csv.reader(lines[1:]) if len(cells) == len(names)]
    frame, lead = _noted(rows, "frame"), _noted(rows, "lead")
    if frame not in ("ned", "frd"):
        raise FileError(f"{path} does not say in which frame it is")
    sent = [row for row in rows if row["kind"] == "setpoint"]
    heard = [row for row in rows if row["kind"] == "position" and row["x"]]
    try:
        return flight_log(_samples(sent, float(lead or 0.0)), _samples(heard), None, frame)
    except ValueError:
        raise FileError(f"{path} has an entry that is not a number") from None


def _noted(rows: Sequence[Row], name: str) -> str | None:
    start = f"{name}="
    return next((row["text"][len(start) :] for row in rows if row.get("text", "").startswith(start)), None)


def _samples(rows: Sequence[Row], lead: float = 0.0) -> Samples | None:
    """Return the rows of one kind, with the quantities that are not empty."""
    if not rows:
        return None
    known = {"t": "time"} | {name: name for name in COLUMNS[1:] if rows[0].get(name)}
    return samples_of({name: np.array([float(row[key]) for row in rows]) for name, key in known.items()}, lead)
