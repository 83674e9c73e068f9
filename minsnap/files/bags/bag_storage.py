"""Storage of bags: MCAP (mcap.dev, version 0), SQLite (``.db3``), and folders of such files as rosbag2 records them."""

from __future__ import annotations

import mmap
import sqlite3
import struct
import zlib
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from minsnap.basics.optional_packages import optional
from minsnap.basics.storage.text import LARGEST, FileName, check_regular, reading
from minsnap.errors import FileError

MCAP, SQLITE = ".mcap", ".db3"

ENDINGS = (MCAP, SQLITE)
"""Endings of the files of bags."""

_MAGIC = b"\x89MCAP0\r\n"
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 3, 4, 5, 6, 15
_HEAD, _CHUNK_HEAD, _MESSAGE_HEAD = struct.Struct("<BQ"), struct.Struct("<QQQI"), struct.Struct("<HIQQ")
_ZSTANDARD = b"\x28\xb5\x2f\xfd"


@dataclass
class Topic:
    """A topic of a bag.

    Parameters
    ----------
    name : str
    kind : str
        Type of its messages, such as ``nav_msgs/msg/Odometry``.
    definition : str
        Its definition, empty where the bag has none.
    rows : list of tuple
        When each message was received [ns], and its bytes; of those kinds alone that were asked for.
    """

    name: str
    kind: str
    definition: str = ""
    rows: list[tuple[int, bytes]] = field(default_factory=list)


def is_bag(path: FileName) -> bool:
    """Return whether a file is a bag by its ending, or a folder holds one."""
    place = Path(path)
    return place.suffix.lower() in ENDINGS or (place.is_dir() and bool(_files(place)))


def _files(folder: Path) -> list[Path]:
    return sorted(file for file in folder.iterdir() if {".mcap", ".db3"} & {each.lower() for each in file.suffixes})


def read_topics(path: FileName, kinds: Collection[str]) -> tuple[list[Topic], str | None]:
    """Read a bag.

    Parameters
    ----------
    path : str or path
        A ``.mcap`` or ``.db3`` file, or a folder of them.
    kinds : collection of str
        Types of the messages that are kept.

    Returns
    -------
    topics : list of Topic
        All of them, by name.
    damage : str or None
        What was wrong with a file of which the beginning could be read.

    Raises
    ------
    FileError
        If it cannot be read, or is compressed in a way that is not known.
    ImportError
        If it is compressed, and what decompresses it is not installed.
    """
    place = Path(path)
    check_regular(place)
    files = _files(place) if place.is_dir() else [place]
    if not files:
        raise FileError(f"{path} is a folder without a .mcap or .db3 file")
    topics: dict[str, Topic] = {}
    damage = None
    for file in files:
        if file.suffix.lower() not in ENDINGS:
            raise FileError(f"{file} is compressed as a whole: unpack it first (zstd -d)")
        read = _read_mcap if file.suffix.lower() == MCAP else _read_sqlite
        with reading(file, f"a bag ({file.suffix.lower()}) that makes sense"):
            damage = read(file, kinds, topics) or damage
    for topic in topics.values():
        topic.rows.sort(key=lambda row: row[0])
    return sorted(topics.values(), key=lambda topic: topic.name), damage


def _read_sqlite(path: Path, kinds: Collection[str], topics: dict[str, Topic]) -> None:
    if not path.is_file():
        raise FileError(f"{path} cannot be read: no such file")
    try:
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as base:
            tables = {name for (name,) in base.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
            texts: dict[str, str] = {}
            if "message_definitions" in tables:
                query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
                found = _typed_rows(base.execute(query), str, str, str)
                texts = {kind: text for kind, encoding, text in found if encoding == "ros2msg"}
            for number, name, kind in _typed_rows(base.execute("SELECT id, name, type FROM topics"), int, str, str):
                topic = topics.setdefault(name, Topic(name, kind, texts.get(kind, "")))
                if kind in kinds:
                    rows = base.execute("SELECT timestamp, data FROM messages WHERE topic_id = ?", (number,))
                    topic.rows += [(stamp, _unpacked(data, path)) for stamp, data in _typed_rows(rows, int, bytes)]
    except sqlite3.Error as error:
        raise FileError(f"{path} is no bag in SQLite: {error}") from None


def _typed_rows(rows: Iterable[tuple[Any, ...]], *types: type) -> list[tuple[Any, ...]]:
    """Return rows of a table; raise ValueError where a value is of another type, which SQLite lets any column hold."""
    found = list(rows)
    for row in found:
        for value, kind in zip(row, types, strict=True):
            if not isinstance(value, kind):
                raise ValueError(f"a table has {type(value).__name__} in the place of {kind.__name__}")
    return found


def _unpacked(data: bytes, path: Path) -> bytes:
    """Return a message that rosbag2 may have compressed by itself."""
    return data if not data.startswith(_ZSTANDARD) else _decompressed("zstd", data, LARGEST, path)


def _decompressed(how: str, data: bytes, size: int, path: Path) -> bytes:
    if size > LARGEST:
        raise FileError(f"{path} has a part of {size / 1e6:.0f} MB: they are read up to {LARGEST / 1e6:.0f} MB")
    need = f"{path} is compressed, and reading it needs"
    if how == "zstd":
        zstandard = optional("zstandard", f"{need} zstandard", "bags")
        return bytes(zstandard.ZstdDecompressor().decompressobj().decompress(data))
    if how == "lz4":
        return bytes(optional("lz4.frame", f"{need} lz4", "bags").decompress(data))
    raise FileError(f"{path} is compressed by {how[:20]!r}, which is not known")


class _Strings:
    """Reads the fields of a record one after another."""

    def __init__(self, data: memoryview) -> None:
        self._data, self._at = data, 0

    def number(self, code: str) -> int:
        (value,) = struct.unpack_from(f"<{code}", self._data, self._at)
        self._at += struct.calcsize(code)
        return int(value)

    def block(self, code: str = "I") -> bytes:
        length = self.number(code)
        start, self._at = self._at, self._at + length
        if self._at > len(self._data):
            raise ValueError("a record ends early")
        return bytes(self._data[start : self._at])

    def text(self) -> str:
        return self.block().decode()


def _read_mcap(path: Path, kinds: Collection[str], topics: dict[str, Topic]) -> str | None:
    with open(path, "rb") as file:
        if file.read(len(_MAGIC)) != _MAGIC:
            raise FileError(f"{path} is no MCAP file")
        whole = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
    return _McapReader(path, kinds, topics).read(whole)


class _McapReader:
    """Takes the records of a file in their order: definitions, topics, messages."""

    def __init__(self, path: Path, kinds: Collection[str], topics: dict[str, Topic]) -> None:
        self._path, self._kinds, self._topics = path, kinds, topics
        self._schemas: dict[int, tuple[str, str]] = {}
        self._channels: dict[int, Topic] = {}
        self._takes: dict[int, Callable[[memoryview], None]] = {
            _SCHEMA: self._schema,
            _CHANNEL: self._channel,
            _MESSAGE: self._message,
            _CHUNK: self._chunk,
        }

    def read(self, whole: memoryview) -> str | None:
        """Read a file, and return what is wrong with its end: a recorder that was killed writes none."""
        for code, content in _records(whole, len(_MAGIC)):
            if code == _DATA_END:
                return None
            self._take(code, content)
        return f"{self._path} ends early, as when its recorder was killed"

    def _take(self, code: int, content: memoryview) -> None:
        if code in self._takes:
            self._takes[code](content)

    def _schema(self, content: memoryview) -> None:
        record = _Strings(content)
        number, name, encoding, text = record.number("H"), record.text(), record.text(), record.block()
        self._schemas[number] = name, text.decode() if encoding == "ros2msg" else ""

    def _channel(self, content: memoryview) -> None:
        record = _Strings(content)
        number, schema, name, encoding = record.number("H"), record.number("H"), record.text(), record.text()
        kind, text = self._schemas.get(schema, ("", ""))
        self._channels[number] = self._topics.setdefault(name, Topic(name, kind if encoding == "cdr" else "", text))

    def _message(self, content: memoryview) -> None:
        number, _, received, _ = _MESSAGE_HEAD.unpack_from(content)
        topic = self._channels.get(number)
        if topic is not None and topic.kind in self._kinds:
            topic.rows.append((received, bytes(content[_MESSAGE_HEAD.size :])))

    def _chunk(self, content: memoryview) -> None:
        _, _, size, checksum = _CHUNK_HEAD.unpack_from(content)
        record = _Strings(content[_CHUNK_HEAD.size :])
        how, data = record.text(), record.block("Q")
        records = _decompressed(how, data, size, self._path) if how else data
        if checksum and zlib.crc32(records) != checksum:
            raise FileError(f"{self._path} is damaged: a part of it has another checksum")
        for code, part in _records(memoryview(records), 0):
            self._take(code, part)


def _records(data: memoryview, at: int) -> Iterator[tuple[int, memoryview]]:
    """Go through what is whole of records: their codes and contents."""
    while at + _HEAD.size <= len(data):
        code, length = _HEAD.unpack_from(data, at)
        at += _HEAD.size
        if length > len(data) - at:
            return
        yield code, data[at : at + length]
        at += length
