"""Bags of ROS 2 with messages of a recorded one (tests/recorded/led.mcap), stored in the ways that bags have."""

import sqlite3
import struct
import zlib
from contextlib import closing
from pathlib import Path

from minsnap.files.bags.bag_log import KINDS
from minsnap.files.bags.bag_storage import read_topics

BAG = Path(__file__).parents[1] / "recorded" / "led.mcap"
TOPICS = {topic.name: topic for topic in read_topics(BAG, KINDS)[0]}


def sqlite_bag(path, names, pack=bytes):
    """Store messages as rosbag2 of ROS 2 Humble does, without definitions."""
    with closing(sqlite3.connect(path)) as base, base:
        base.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)")
        base.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
        for number, name in enumerate(names, 1):
            base.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr')", (number, name, TOPICS[name].kind))
            rows = [(number, stamp, pack(raw)) for stamp, raw in TOPICS[name].rows]
            base.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", rows)
    return path


def text(value):
    return struct.pack("<I", len(value)) + value.encode()


def record(code, content):
    return struct.pack("<BQ", code, len(content)) + content


def mcap_bag(path, name, how="", pack=bytes, end=True, checksum=None):
    """Store the messages of one topic in a chunk, as the format's specification has it."""
    topic = TOPICS[name]
    definition = topic.definition.encode()
    schema = struct.pack("<H", 1) + text(topic.kind) + text("ros2msg") + struct.pack("<I", len(definition)) + definition
    channel = struct.pack("<HH", 1, 1) + text(name) + text("cdr") + struct.pack("<I", 0)
    rows = [struct.pack("<HIQQ", 1, k, stamp, stamp) + raw for k, (stamp, raw) in enumerate(topic.rows)]
    inside = record(3, schema) + record(4, channel) + b"".join(record(5, row) for row in rows)
    checksum = zlib.crc32(inside) if checksum is None else checksum
    packed = pack(inside)
    head = struct.pack("<QQQI", 0, 1, len(inside), checksum) + text(how) + struct.pack("<Q", len(packed))
    records = record(1, text("ros2") + text("test")) + record(6, head + packed) + (record(15, bytes(4)) if end else b"")
    path.write_bytes(b"\x89MCAP0\r\n" + records)
    return path
