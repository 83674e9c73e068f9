"""The last log of a vehicle, fetched by MAVLink's log messages (LOG_REQUEST_LIST, LOG_REQUEST_DATA)."""

from __future__ import annotations

import os
from collections.abc import Callable

from minsnap.basics.storage.atomic import atomic_write
from minsnap.errors import LinkError
from minsnap.flight.mavlink.link import Link
from minsnap.flight.mavlink.schedule import Clock
from minsnap.flight.mavlink.vehicle_messages import Message, load_dialect

PIECE = 90
"""Bytes of a log in one message (LOG_DATA)."""

REQUEST = 512 * PIECE
"""Bytes of one request."""

SILENCE, TRIES = 1.5, 5
"""How long an answer may take before the request is repeated [s], and how often it is."""

LARGEST = 2**31
"""Bytes of the largest log that is fetched."""


def download_log(
    link: Link, clock: Clock, path: str | os.PathLike[str], progress: Callable[[float], None] = lambda _: None
) -> None:
    """Fetch the newest log and write it; autopilots refuse while they fly.

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

    Raises
    ------
    LinkError
        If the vehicle tells of no log, or stops sending.
    """
    dialect, vehicle = load_dialect(), link.vehicle
    target = (vehicle.system, vehicle.component)
    entry = _newest(link, clock, dialect.MAVLink_log_request_list_message(*target, 0, 0xFFFF))
    content, missing = bytearray(entry.size), set(range(0, entry.size, PIECE))
    tries = 0
    while missing:
        first = min(missing)
        link.send(dialect.MAVLink_log_request_data_message(*target, entry.id, first, min(REQUEST, entry.size - first)))
        before = len(missing)
        _receive(link, clock, entry, content, missing, min(first + REQUEST, entry.size))
        progress(1.0 - len(missing) * PIECE / max(entry.size, 1))
        tries = 0 if len(missing) < before else tries + 1
        if tries == TRIES:
            raise LinkError(
                f"the vehicle stopped sending its log after {entry.size - len(missing) * PIECE} of {entry.size} bytes"
            )
    link.send(dialect.MAVLink_log_request_end_message(*target))
    with atomic_write(path, "wb") as file:
        file.write(bytes(content))


def _newest(link: Link, clock: Clock, request: Message) -> Message:
    """Return the entry of the newest log."""
    entries: dict[int, Message] = {}
    for _ in range(TRIES):
        link.send(request)
        last = clock.now()
        while clock.now() < last + SILENCE and not any(len(entries) >= entry.num_logs for entry in entries.values()):
            for message in link.pump(clock.now() + 0.1):
                if message.get_type() == "LOG_ENTRY":
                    entries[message.id], last = message, clock.now()
        if entries:
            break
    if not entries:
        raise LinkError("the vehicle does not tell of its logs (LOG_REQUEST_LIST): fetch the log by hand")
    newest = max(entries.values(), key=lambda entry: (entry.time_utc, entry.id))
    if newest.num_logs == 0 or not 0 < newest.size < LARGEST:
        raise LinkError("the vehicle has no log of this flight: turn its logging on")
    return newest


def _receive(link: Link, clock: Clock, entry: Message, content: bytearray, missing: set[int], end: int) -> None:
    """Take what comes of a log until all before ``end`` is there, or nothing has come for a while."""
    last = clock.now()
    while clock.now() < last + SILENCE and any(start < end for start in missing):
        for message in link.pump(clock.now() + 0.1):
            if message.get_type() != "LOG_DATA" or message.id != entry.id or message.ofs not in missing:
                continue
            count = min(PIECE, entry.size - message.ofs)
            if message.count < count:  # a piece that is cut short is requested again
                continue
            content[message.ofs : message.ofs + count] = bytes(message.data[:count])
            missing.discard(message.ofs)
            last = clock.now()
