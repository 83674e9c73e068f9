"""Flights from files: setpoint CSV, PX4's ULog, ArduPilot's dataflash log, the log of a stream."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

from minsnap.errors import FileError
from minsnap.files.format import Format
from minsnap.files.logs.dataflash import read_dataflash
from minsnap.files.logs.flight_log import FlightLog
from minsnap.files.logs.stream_log_file import is_stream_log, read_stream_log
from minsnap.files.logs.ulog import read_ulog
from minsnap.files.setpoint_csv import read_csv
from minsnap.trajectory.samples import Samples

ENDINGS = (".csv", ".ulg", ".bin")
"""Endings of the files that hold a flight."""


def load_flight(path: str | os.PathLike[str], frame: str | None = None) -> Samples:
    """Read a flight.

    Parameters
    ----------
    path : str or path
        ``.csv`` as the library writes setpoints and simulated flights, ``.ulg`` as PX4 logs (extra ``logs``), ``.bin``
        as ArduPilot does.
    frame : str or None
        Axes of a CSV, None for what it says itself; logs have theirs.

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
    return _load(path, "flight", frame)


def load_reference(path: str | os.PathLike[str], frame: str | None = None) -> Samples:
    """Read a reference: a setpoint CSV, or the setpoints of a log; otherwise as :func:`load_flight`."""
    return _load(path, "reference", frame)


def load_log(path: str | os.PathLike[str]) -> FlightLog | None:
    """Read a flight log: a ULog, a dataflash log, or the log of a stream; None for a table of samples.

    Warns and raises as :func:`load_flight`.
    """
    if Path(path).suffix.lower() not in ENDINGS:
        raise FileError(f"{path} is no flight by its ending: it must be one of {', '.join(ENDINGS)}")
    log = read_log(path)
    if log is not None and log.damage is not None:
        warnings.warn(log.damage, stacklevel=3)
    return log


def read_log(path: str | os.PathLike[str], inertial: bool = False) -> FlightLog | None:
    """Read a log as :func:`load_log`, of any ending and without a warning; ``inertial``: what was felt too."""
    ending = Path(path).suffix.lower()
    if ending in (".ulg", ".bin"):
        return (read_ulog if ending == ".ulg" else read_dataflash)(path, inertial)
    return read_stream_log(path) if is_stream_log(path) else None


def _load(path: str | os.PathLike[str], part: str, frame: str | None) -> Samples:
    log = load_log(path)
    samples: Samples | None = read_csv(path, frame) if log is None else getattr(log, part)
    if samples is None:
        missing = "setpoints" if part == "reference" else "position"
        raise FileError(f"{path} holds no {missing}: log them, or give a CSV")
    return samples


FORMATS = (Format("logs", "samples", reads=(".ulg", ".bin"), read=load_flight),)
