"""Lines of one pixel, as a binary glTF: WebGL draws these itself, where viser's own lines are triangles per segment.

glTF 2.0, sections 3.7 and 4.4: a header, a JSON and a binary chunk, each padded to four bytes; colours are linear.
"""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray

KINDS = {"VEC3": 5126, "VEC4": 5121, "SCALAR": 5125}
"""Numbers of places (float32), of colours (uint8) and of indices (uint32), by their shapes."""


def thin_lines(points: FloatArray, colours: FloatArray) -> bytes:
    """Return lines through points as a binary glTF.

    Parameters
    ----------
    points : ndarray, shape (lines, n, 3)
        [m].
    colours : ndarray, shape (n, 3)
        Of the points of every line, as the screen has them, from 0 to 255.
    """
    count, each = points.shape[:2]
    places = points.reshape(-1, 3).astype("<f4")
    first = (each * np.arange(count)[:, None] + np.arange(each - 1)).ravel()
    pairs = np.stack([first, first + 1], axis=1).astype("<u4")
    linear = np.round(255.0 * _linear(np.clip(colours / 255.0, 0.0, 1.0)))
    shades = np.tile(np.column_stack([linear, np.full(each, 255)]).astype(np.uint8), (count, 1))
    parts = [places.tobytes(), shades.tobytes(), pairs.tobytes()]
    return _glb(_layout(places, pairs.size, [len(part) for part in parts]), b"".join(parts))


def _linear(colours: FloatArray) -> FloatArray:
    """Return the intensities of colours of sRGB (IEC 61966-2-1), both from 0 to 1."""
    low = colours / 12.92
    return np.asarray(np.where(colours <= 0.04045, low, ((colours + 0.055) / 1.055) ** 2.4))


def _layout(places: FloatArray, indices: int, sizes: list[int]) -> dict[str, Any]:
    """Return what the JSON chunk says of the binary one."""
    starts = [0, *np.cumsum(sizes).tolist()]
    views = [{"buffer": 0, "byteOffset": a, "byteLength": n} for a, n in zip(starts, sizes, strict=False)]
    box = {"min": places.min(axis=0).tolist(), "max": places.max(axis=0).tolist()}
    accessors: list[dict[str, Any]] = [
        {"count": len(places), "type": "VEC3", **box},
        {"count": len(places), "type": "VEC4", "normalized": True},
        {"count": indices, "type": "SCALAR"},
    ]
    for view, accessor in enumerate(accessors):
        accessor |= {"bufferView": view, "componentType": KINDS[accessor["type"]]}
    primitive = {"attributes": {"POSITION": 0, "COLOR_0": 1}, "indices": 2, "mode": 1}  # pairs of ends
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": starts[-1]}],
    }


def _glb(layout: dict[str, Any], content: bytes) -> bytes:
    head = json.dumps(layout, separators=(",", ":")).encode()
    head += b" " * (-len(head) % 4)
    chunks = struct.pack("<I4s", len(head), b"JSON") + head + struct.pack("<I4s", len(content), b"BIN\0") + content
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
