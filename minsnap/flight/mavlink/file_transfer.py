"""Files of a vehicle, read by MAVLink's file transfer (mavlink.io, File Transfer Protocol): folders, and bursts."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from minsnap.flight.mavlink.link import Clock, Link
from minsnap.flight.mavlink.vehicle_messages import load_dialect

_HEAD, _DATA, _WHOLE = struct.Struct("<HBBBBBBI"), 239, 251
_TERMINATE, _RESET, _LIST, _OPEN, _BURST = 1, 2, 3, 4, 15
_ACK, _NAK = 128, 129


@dataclass(frozen=True)
class TransferSettings:
    """How long is waited for a vehicle's files.

    Parameters
    ----------
    silence : float
        How long an answer may take before the request is repeated [s].
    tries : int
        How often a request is sent, and how many bursts in a row may bring nothing.
    deepest : int
        Folders within folders in which a file is looked for.
    entries : int
        Entries of a folder that are looked at, at most.
    """

    silence: float = 0.7
    tries: int = 3
    deepest: int = 1
    entries: int = 2000


TRANSFER = TransferSettings()


@dataclass(frozen=True)
class _Answer:
    """What a vehicle answers: of which session, from which byte of a file, and whether its burst ends with it."""

    opcode: int
    session: int
    offset: int
    data: bytes
    last: bool


class FileTransfer:
    """Asks a vehicle for its files; what does not answer has none.

    Parameters
    ----------
    link : Link
        With a vehicle that has been heard.
    clock : Clock
        The same as the link's.
    """

    def __init__(self, link: Link, clock: Clock) -> None:
        self._link, self._clock, self._number, self._silent = link, clock, 0, False

    def files(self, folder: str, endings: Sequence[str], depth: int = 0) -> dict[str, int]:
        """Return the files of some endings in a folder and those within: their paths, and their bytes."""
        entries = sorted(self._entries(folder), reverse=True)
        found = {
            f"{folder}/{name}": size
            for kind, name, size in entries
            if kind == "F" and name.lower().endswith(tuple(endings))
        }
        within = [name for kind, name, _ in entries if kind == "D" and name not in (".", "..")]
        for name in within if depth < TRANSFER.deepest else ():
            found |= self.files(f"{folder}/{name}", endings, depth + 1)
        return found

    def _entries(self, folder: str) -> Iterator[tuple[str, str, int]]:
        """Yield what is in a folder: D or F, its name, and of a file its bytes."""
        count = 0
        while count < TRANSFER.entries:
            answer = self._ask(_LIST, offset=count, data=folder.encode())
            if answer is None or answer.opcode != _ACK:
                return
            texts = [text for text in answer.data.decode(errors="replace").split("\0") if text]
            if not texts:
                return
            count += len(texts)
            for text in texts:
                name, _, size = text[1:].partition("\t")
                yield text[0], name, int(size) if size.isdigit() else -1

    def read(self, path: str, size: int, progress: Callable[[float], None] = lambda _: None) -> bytes | None:
        """Return the content of a file of so many bytes, by bursts; None where it stops coming."""
        opened = self._ask(_OPEN, data=path.encode())
        if opened is None or opened.opcode != _ACK:
            return None
        content, here, idle = bytearray(size), bytearray(size), 0
        while (start := here.find(0)) >= 0:
            before = here.count(1)
            self._send(_BURST, opened.session, start, size=_DATA)
            for answer in self._answers(_BURST):
                part = answer.data[: max(0, size - answer.offset)] if answer.opcode == _ACK else b""
                content[answer.offset : answer.offset + len(part)] = part
                here[answer.offset : answer.offset + len(part)] = bytes([1]) * len(part)
                if answer.last or answer.opcode == _NAK:
                    break
            come = here.count(1)
            progress(come / size)
            idle = idle + 1 if come == before else 0
            if idle == TRANSFER.tries:
                return None
        self._ask(_TERMINATE, opened.session)
        return bytes(content)

    def _ask(self, opcode: int, session: int = 0, offset: int = 0, data: bytes = b"") -> _Answer | None:
        """Return the answer to a request; None where none comes, and for ever after."""
        for _ in range(TRANSFER.tries):
            if self._silent:
                break
            self._send(opcode, session, offset, data)
            for answer in self._answers(opcode):
                return answer
        self._silent = True
        return None

    def _send(self, opcode: int, session: int, offset: int = 0, data: bytes = b"", size: int | None = None) -> None:
        self._number = (self._number + 1) % 65536
        head = _HEAD.pack(self._number, session, opcode, len(data) if size is None else size, 0, 0, 0, offset)
        target = (0, self._link.vehicle.system, self._link.vehicle.component)
        payload = list((head + data).ljust(_WHOLE, b"\0"))
        self._link.send(load_dialect().MAVLink_file_transfer_protocol_message(*target, payload))

    def _answers(self, opcode: int) -> Iterator[_Answer]:
        """Yield what comes in answer to a request, until nothing has come for a while."""
        last = self._clock.now()
        while self._clock.now() < last + TRANSFER.silence:
            for message in self._link.pump(self._clock.now() + 0.05):
                if message.get_type() != "FILE_TRANSFER_PROTOCOL":
                    continue
                raw = bytes(message.payload)
                _, session, kind, size, asked, ends, _, offset = _HEAD.unpack_from(raw)
                if kind in (_ACK, _NAK) and asked == opcode:
                    last = self._clock.now()
                    data = raw[_HEAD.size : _HEAD.size + min(size, _DATA)]
                    yield _Answer(kind, session, offset, data, bool(ends))
