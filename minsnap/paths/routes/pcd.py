"""Point clouds in PCD, the format of the Point Cloud Library (.PCD v0.7), and the LZF blocks in them."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.text import FileName, read_bytes, reading
from minsnap.errors import FileError

MOST_POINTS = 100_000_000


def decompress(block: bytes, size: int) -> bytes:
    """Return the content of an LZF block.

    A control byte below 32 is followed by that many bytes and one more as they are; another one holds, in its upper 3
    bits, the length of a repetition less 2 (7: a byte to add follows) and, in its lower 5 and the next byte, its
    distance back less 1.

    Parameters
    ----------
    block : bytes
    size : int
        Bytes of the content.

    Raises
    ------
    ValueError
        If the block is damaged.
    """
    output, at = bytearray(), 0
    while at < len(block) and len(output) <= size:
        control = block[at]
        at += 1
        if control < 32:
            output += block[at : at + control + 1]
            at += control + 1
            continue
        length = control >> 5
        if length == 7:
            length += block[at]
            at += 1
        back = ((control & 31) << 8) + block[at] + 1
        at += 1
        _repeat(output, back, length + 2)
    if len(output) != size:
        raise ValueError("a block of another size than it should have")
    return bytes(output)


def _repeat(output: bytearray, back: int, length: int) -> None:
    """Append bytes from some way back; the repetition may run into itself."""
    start = len(output) - back
    if start < 0:
        raise ValueError("a reference to data before the block")
    piece = bytes(output[start : start + length])
    output += (piece * (length // len(piece) + 1))[:length]


def read_pcd(path: FileName) -> FloatArray:
    """Return the coordinates of a PCD file: (n, 3) [m].

    Raises
    ------
    FileError
        If it cannot be read, or is not such a file with fields x, y and z.
    """
    with reading(path, "a point cloud in PCD"):
        header, body = _split(path, read_bytes(path))
        layout = _layout(header)
        count = int(header["POINTS"][0])
        if not 0 <= count <= MOST_POINTS or not {"x", "y", "z"} <= set(layout.names or ()):
            raise FileError(f"{path} has no fields x, y and z, or too many points")
        rows = _rows(header["DATA"][0], body, layout, count)
        return np.stack([np.asarray(rows[axis], dtype=np.float64) for axis in "xyz"], axis=-1)


def _split(path: FileName, content: bytes) -> tuple[dict[str, list[str]], bytes]:
    """Return the entries of the header, and the rest of the file."""
    entries: dict[str, list[str]] = {}
    at = 0
    while "DATA" not in entries:
        end = content.find(b"\n", at)
        if end < 0 or at > 10_000:
            raise FileError(f"{path} has no line DATA: it is no point cloud in PCD")
        words = content[at:end].decode("ascii").split("#")[0].split()
        entries |= {words[0]: words[1:]} if words else {}
        at = end + 1
    return entries, content[at:]


def _layout(header: Mapping[str, list[str]]) -> np.dtype[Any]:
    """Return the type of a point; fields of several numbers are kept, those without a name get one."""
    names = [name if name != "_" else f"_{i}" for i, name in enumerate(header["FIELDS"])]
    counts = [int(count) for count in header.get("COUNT", ["1"] * len(names))]
    kinds = [f"<{kind.lower()}{int(size)}" for kind, size in zip(header["TYPE"], header["SIZE"], strict=True)]
    fields = zip(names, kinds, counts, strict=True)
    return np.dtype([(name, kind, (count,)) if count > 1 else (name, kind) for name, kind, count in fields])


def _rows(data: str, body: bytes, layout: np.dtype[Any], count: int) -> Mapping[str, Any]:
    names = layout.names or ()
    if data == "ascii":
        places = np.cumsum([0] + [int(np.prod(layout[name].shape)) for name in names])
        values = np.array(body.split(), dtype=np.float64).reshape(count, places[-1])
        return {name: values[:, place] for name, place in zip(names, places, strict=False)}
    if data == "binary":
        return np.frombuffer(body, dtype=layout, count=count)  # type: ignore[return-value]
    if data != "binary_compressed":
        raise FileError(f"DATA is {data[:20]!r}: it is ascii, binary or binary_compressed")
    packed, size = struct.unpack("<II", body[:8])
    if size != count * layout.itemsize:
        raise ValueError("a block of another size than its points need")
    block, ends = decompress(body[8 : 8 + packed], size), count * np.cumsum([layout[name].itemsize for name in names])
    starts = [0, *ends.tolist()]
    return {name: np.frombuffer(block, layout[name], count, at) for name, at in zip(names, starts, strict=False)}
