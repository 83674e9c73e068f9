"""Logs of an autopilot, fetched over MAVLink: by its file transfer where it answers, else by its messages of logs.

PX4 sends messages of logs at about 7 kB/s; files come in bursts, as quickly as the link takes them. A vehicle that
tells of no log by messages is asked for its folders: PX4 of April 2026 sends none of these messages in simulation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import PurePosixPath

from minsnap.basics.storage.atomic import write_file
from minsnap.basics.storage.text import FileName
from minsnap.errors import LinkError
from minsnap.flight.mavlink.file_transfer import FileTransfer
from minsnap.flight.mavlink.link import Clock, Link
from minsnap.flight.mavlink.vehicle_messages import PX4, Message, load_dialect

FOLDERS = {True: ("/fs/microsd/log", "/log"), False: ("/APM/LOGS", "/logs")}
"""Where PX4, and where ArduPilot, has its logs: on a card, and in simulation."""

ENDINGS = (".ulg", ".bin")


@dataclass(frozen=True)
class LogDownload:
    """How the log of a vehicle is fetched.

    Parameters
    ----------
    piece : int
        Bytes of a log in one message (LOG_DATA).
    request : int
        Bytes of one request.
    silence : float
        How long an answer may take before the request is repeated [s].
    tries : int
        How often a request is repeated.
    largest : int
        Bytes of the largest log.
    """

    piece: int = 90
    request: int = 512 * 90
    silence: float = 1.5
    tries: int = 5
    largest: int = 2**31


DOWNLOAD = LogDownload()


@dataclass(frozen=True)
class VehicleLog:
    """A log that a vehicle has.

    Parameters
    ----------
    size : int
        In bytes.
    number : int
        As messages of logs call it.
    time_utc : int
        When it was begun [s]; 0 where that is not told.
    path : str
        Of its file, where only files tell of it.
    """

    size: int
    number: int = 0
    time_utc: int = 0
    path: str = ""

    @property
    def told(self) -> tuple[int, str, int]:
        """What tells it from others, but for its number, which changes when older ones go."""
        return self.time_utc, self.path, self.size


def fresh_logs(link: Link, clock: Clock, before: Iterable[VehicleLog] = ()) -> list[VehicleLog]:
    """Return the logs of a flight, the newest first: an autopilot may split one.

    Parameters
    ----------
    link : Link
        With a vehicle that has been heard.
    clock : Clock
        The same as the link's.
    before : iterable of VehicleLog
        Logs that were there before the flight, as :func:`list_logs` told them: none of them is of it.

    Raises
    ------
    LinkError
        If the vehicle tells of no log, or of none that is new or has grown.
    """
    logs, known = list_logs(link, clock), {old.told for old in before}
    if not logs:
        raise LinkError("the vehicle does not tell of its logs (LOG_REQUEST_LIST, MAVLink FTP): fetch the log by hand")
    fresh = [log for log in logs if log.told not in known and 0 < log.size < DOWNLOAD.largest]
    if not fresh:
        raise LinkError("the vehicle has no log of this flight: turn its logging on")
    return sorted(fresh, key=lambda log: (log.time_utc, log.path, log.number), reverse=True)


def download_log(
    link: Link,
    clock: Clock,
    path: FileName,
    progress: Callable[[float], None] = lambda _: None,
    log: VehicleLog | None = None,
) -> None:
    """Fetch a log and write it; autopilots refuse while they fly.

    Parameters
    ----------
    link : Link
        With a vehicle that has been heard.
    clock : Clock
        The same as the link's.
    path : str or path
        Where to write.
    progress : callable
        Told the share that is there, from 0 to 1.
    log : VehicleLog, optional
        By default the newest.

    Raises
    ------
    LinkError
        If the vehicle tells of no log, or stops sending.
    """
    log = log or fresh_logs(link, clock)[0]
    whole = _from_files(link, clock, log, progress)
    if whole is None and log.path:
        raise LinkError(f"the vehicle stopped sending its log {log.path}")
    write_file(path, _from_messages(link, clock, log, progress) if whole is None else whole)


def _from_files(link: Link, clock: Clock, log: VehicleLog, progress: Callable[[float], None]) -> bytes | None:
    """Return a log by the vehicle's file transfer: the file of its size; None where that is not known for certain.

    ArduPilot writes blocks of 4096 bytes, so that logs of two flights of one plan have the same size, and a flight was
    learned from the one before it. Its files have the numbers of its logs.
    """
    files = FileTransfer(link, clock)
    if log.path:
        return files.read(log.path, log.size, progress)
    for folder in FOLDERS[link.vehicle.autopilot == PX4]:
        places = [place for place, size in files.files(folder, ENDINGS).items() if size == log.size]
        numbered = [place for place in places if PurePosixPath(place).stem.isdigit()]
        places = [place for place in numbered if int(PurePosixPath(place).stem) == log.number] if numbered else places
        if len(places) == 1:
            return files.read(places[0], log.size, progress)
    return None


def _from_messages(link: Link, clock: Clock, log: VehicleLog, progress: Callable[[float], None]) -> bytes:
    dialect, vehicle = load_dialect(), link.vehicle
    target = (vehicle.system, vehicle.component)
    content, missing = bytearray(log.size), set(range(0, log.size, DOWNLOAD.piece))
    tries = 0
    while missing:
        first, left = min(missing), len(missing)
        count = min(DOWNLOAD.request, log.size - first)
        link.send(dialect.MAVLink_log_request_data_message(*target, log.number, first, count))
        _receive(link, clock, log, content, missing, first + count)
        progress(1.0 - len(missing) * DOWNLOAD.piece / max(log.size, 1))
        tries = 0 if len(missing) < left else tries + 1
        if tries == DOWNLOAD.tries:
            come = log.size - len(missing) * DOWNLOAD.piece
            raise LinkError(f"the vehicle stopped sending its log after {come} of {log.size} bytes")
    link.send(dialect.MAVLink_log_request_end_message(*target))
    return bytes(content)


def list_logs(link: Link, clock: Clock) -> list[VehicleLog]:
    """Return what a vehicle tells of its logs, by messages or else by its folders; none where it does not answer."""
    entries = _entries(link, clock)
    if entries:
        return [VehicleLog(each.size, each.id, each.time_utc) for each in entries if each.num_logs]
    files = FileTransfer(link, clock)
    for folder in FOLDERS[link.vehicle.autopilot == PX4]:
        if found := files.files(folder, ENDINGS):
            return [VehicleLog(size, path=path) for path, size in found.items()]
    return []


def _entries(link: Link, clock: Clock) -> list[Message]:
    """Return what comes of messages LOG_ENTRY."""
    target = (link.vehicle.system, link.vehicle.component)
    request = load_dialect().MAVLink_log_request_list_message(*target, 0, 0xFFFF)
    entries: dict[int, Message] = {}
    for _ in range(DOWNLOAD.tries):
        link.send(request)
        last = clock.now()
        while clock.now() < last + DOWNLOAD.silence and not any(
            len(entries) >= entry.num_logs for entry in entries.values()
        ):
            for message in link.pump(clock.now() + 0.1):
                if message.get_type() == "LOG_ENTRY":
                    entries[message.id], last = message, clock.now()
        if entries:
            break
    return list(entries.values())


def _receive(link: Link, clock: Clock, log: VehicleLog, content: bytearray, missing: set[int], end: int) -> None:
    """Take what comes of a log until all before ``end`` is there, or nothing has come for a while."""
    last = clock.now()
    while clock.now() < last + DOWNLOAD.silence and any(start < end for start in missing):
        for message in link.pump(clock.now() + 0.1):
            if message.get_type() != "LOG_DATA" or message.id != log.number or message.ofs not in missing:
                continue
            count = min(DOWNLOAD.piece, log.size - message.ofs)
            if message.count < count:  # a piece that is cut short is requested again
                continue
            content[message.ofs : message.ofs + count] = bytes(message.data[:count])
            missing.discard(message.ofs)
            last = clock.now()
