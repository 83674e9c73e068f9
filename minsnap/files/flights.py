"""Flights from files: setpoint CSV, the logs of PX4 and ArduPilot, bags of ROS 2, and the log of ``minsnap stream``."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from minsnap.basics.storage.text import FileName, beginning, read_text
from minsnap.basics.warn import warn_caller
from minsnap.errors import FileError
from minsnap.files.autopilot_logs import read_dataflash, read_ulog
from minsnap.files.bags.bag_log import read_bag
from minsnap.files.bags.bag_storage import ENDINGS as BAGS
from minsnap.files.bags.bag_storage import is_bag
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


ENDINGS = (".csv", ".ulg", ".bin", *BAGS)
"""Endings of the files that hold a flight."""


@dataclass(frozen=True)
class BagTopics:
    """Which topics of a bag are read.

    Parameters
    ----------
    positions, setpoints : str or None
        None for the only one that has some.
    """

    positions: str | None = None
    setpoints: str | None = None

    @property
    def named(self) -> bool:
        """Whether one is chosen."""
        return self.positions is not None or self.setpoints is not None


USUAL_TOPICS = BagTopics()
"""The only topics of their kinds that a bag has."""


def load_flight(
    path: FileName,
    frame: str | None = None,
    columns: Mapping[str, str] | None = None,
    topics: BagTopics = USUAL_TOPICS,
) -> Samples:
    """Read a flight.

    Parameters
    ----------
    path : str or path
        ``.csv`` as the library writes setpoints and simulated flights, ``.ulg`` as PX4 logs (extra ``logs``), ``.bin``
        as ArduPilot does, ``.mcap``, ``.db3`` or a folder of them as ROS 2 records (extra ``bags`` if compressed).
    frame : str or None
        Axes of a CSV, None for what it says itself; logs have theirs.
    columns : mapping of str to str, optional
        Of a CSV of another program, such as the logs of a Crazyflie, as :func:`minsnap.read_csv` takes them.
    topics : BagTopics, optional
        Of a bag with several.

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
    return _load(path, "flight", frame, columns, topics)


def load_reference(path: FileName, frame: str | None = None, topics: BagTopics = USUAL_TOPICS) -> Samples:
    """Read a reference: a setpoint CSV, or the setpoints of a log; otherwise as :func:`load_flight`."""
    return _load(path, "reference", frame, topics=topics)


def load_log(path: FileName, topics: BagTopics = USUAL_TOPICS) -> FlightLog | None:
    """Read a flight log: a ULog, a dataflash log, a bag, or the log of a stream; None for a table of samples.

    Warns and raises as :func:`load_flight`.
    """
    if not is_flight(path):
        raise FileError(f"{path} is no flight by its ending: it must be one of {', '.join(ENDINGS)}")
    log = read_log(path, topics=topics)
    if log is not None and log.damage is not None:
        warn_caller(log.damage)
    return log


def is_flight(path: FileName) -> bool:
    """Return whether a file holds a flight by its ending, or is the folder of a bag."""
    return Path(path).suffix.lower() in ENDINGS or is_bag(path)


def read_log(path: FileName, inertial: bool = False, topics: BagTopics = USUAL_TOPICS) -> FlightLog | None:
    """Read a log as :func:`load_log`, of any ending and without a warning; ``inertial``: what was felt too."""
    if is_bag(path):
        return read_bag(path, topics.positions, topics.setpoints)
    if topics.named:
        raise FileError(f"{path} is no bag of ROS 2: leave --topic and --setpoints out")
    ending = Path(path).suffix.lower()
    if ending in (".ulg", ".bin"):
        return (read_ulog if ending == ".ulg" else read_dataflash)(path, inertial)
    return read_stream_log(path) if is_stream_log(path) else None


def _load(
    path: FileName,
    part: str,
    frame: str | None,
    columns: Mapping[str, str] | None = None,
    topics: BagTopics = USUAL_TOPICS,
) -> Samples:
    log = load_log(path, topics)
    if columns is not None and log is not None:
        raise FileError(f"{path} is a log, whose columns are known: leave the names of columns out")
    samples: Samples | None = read_csv(path, frame, columns=columns) if log is None else getattr(log, part)
    if samples is None:
        missing = "setpoints" if part == "reference" else "position"
        raise FileError(f"{path} holds no {missing}: log them, or give a CSV")
    return samples


FORMATS = (Format("logs", "samples", reads=(".ulg", ".bin", *BAGS), read=load_flight),)
