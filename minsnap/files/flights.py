"""Flights from files: setpoint CSV, the logs of PX4 and ArduPilot, and that of ``minsnap stream``, in z-down axes."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from minsnap.basics.storage.text import FileName, beginning, read_text
from minsnap.basics.warn import warn_caller
from minsnap.errors import FileError
from minsnap.files.autopilot_logs import read_dataflash, read_ulog
from minsnap.files.convert import Format
from minsnap.files.flight_log import FlightLog, flight_log
from minsnap.files.setpoint_csv import COLUMNS, read_csv, samples_of
from minsnap.trajectory.samples import Samples

START = "time,kind,"
"""How the first line of such a log begins."""


Row = Mapping[str, str]


def is_stream_log(path: FileName) -> bool:
    """Return whether a file begins like the log of a stream; false for a file that cannot be read."""
    return beginning(path).startswith(START)


def read_stream_log(path: FileName) -> FlightLog:
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


ENDINGS = (".csv", ".ulg", ".bin")
"""Endings of the files that hold a flight."""


def load_flight(path: FileName, frame: str | None = None, columns: Mapping[str, str] | None = None) -> Samples:
    """Read a flight.

    Parameters
    ----------
    path : str or path
        ``.csv`` as the library writes setpoints and simulated flights, ``.ulg`` as PX4 logs (extra ``logs``), ``.bin``
        as ArduPilot does.
    frame : str or None
        Axes of a CSV, None for what it says itself; logs have theirs.
    columns : mapping of str to str, optional
        Of a CSV of another program, such as the logs of a Crazyflie, as :func:`minsnap.read_csv` takes them.

    Returns
    -------
    Samples

    Warns
    -----
    UserWarning
        If a log is damaged; what could be read of it is returned.

    Raises
    ------
    FileError
        If the ending is not known, or the file is missing or too damaged to be read.
    ImportError
        If a log needs an extra that is not installed.
    """
    return _load(path, "flight", frame, columns)


def load_reference(path: FileName, frame: str | None = None) -> Samples:
    """Read a reference: a setpoint CSV, or the setpoints of a log; otherwise as :func:`load_flight`."""
    return _load(path, "reference", frame)


def load_log(path: FileName) -> FlightLog | None:
    """Read a flight log: a ULog, a dataflash log, or the log of a stream; None for a table of samples.

    Warns and raises as :func:`load_flight`.
    """
    if Path(path).suffix.lower() not in ENDINGS:
        raise FileError(f"{path} is no flight by its ending: it must be one of {', '.join(ENDINGS)}")
    log = read_log(path)
    if log is not None and log.damage is not None:
        warn_caller(log.damage)
    return log


def read_log(path: FileName, inertial: bool = False) -> FlightLog | None:
    """Read a log as :func:`load_log`, of any ending and without a warning; ``inertial``: what was felt too."""
    ending = Path(path).suffix.lower()
    if ending in (".ulg", ".bin"):
        return (read_ulog if ending == ".ulg" else read_dataflash)(path, inertial)
    return read_stream_log(path) if is_stream_log(path) else None


def _load(path: FileName, part: str, frame: str | None, columns: Mapping[str, str] | None = None) -> Samples:
    log = load_log(path)
    if columns is not None and log is not None:
        raise FileError(f"{path} is a log, whose columns are known: leave the names of columns out")
    samples: Samples | None = read_csv(path, frame, columns=columns) if log is None else getattr(log, part)
    if samples is None:
        missing = "setpoints" if part == "reference" else "position"
        raise FileError(f"{path} holds no {missing}: log them, or give a CSV")
    return samples


FORMATS = (Format("logs", "samples", reads=(".ulg", ".bin"), read=load_flight),)
