"""ULog files by the published format, byte by byte."""

import struct


def fields(kind, names):
    return "uint64_t timestamp;" + "".join(f"{kind} {name};" for name in names.split())


def message(kind, payload):
    return struct.pack("<HB", len(payload), ord(kind)) + payload


def ulog(topics):
    """Header, flag bits, formats, subscriptions, then data in the order of time."""
    head = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 1000)
    parts = [message("B", bytes(40))]
    parts += [message("F", f"{name}:{fields}".encode()) for name, fields, _ in topics]
    parts += [message("A", struct.pack("<BH", 0, k) + name.encode()) for k, (name, _, _) in enumerate(topics)]
    rows = [(row[0], k, row) for k, (_, _, table) in enumerate(topics) for row in table]
    for stamp, k, row in sorted(rows, key=lambda item: item[:2]):
        payload = struct.pack("<HQ", k, stamp) + struct.pack(f"<{len(row) - 1}f", *row[1:])
        parts.append(message("D", payload))
    return head + b"".join(parts)
