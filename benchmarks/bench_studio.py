"""Latency of the studio: from the message of a drag to the message with the new curve, over a websocket.

Ten legs with a corridor, with a total time and within limits; a browser adds one frame for drawing. Run it with
``python benchmarks/bench_studio.py``; it needs ``minsnap[studio]``.
"""

from __future__ import annotations

import asyncio
import struct
import time
from tempfile import TemporaryDirectory
from typing import Any

import msgspec
import numpy as np
import viser
import websockets
import zstandard

from minsnap.files.file_request import FileRequest
from minsnap.studio import Studio

LEGS = 10
DRAGS = 200
PAUSE = 0.03
"""Seconds between the curve and the next drag."""

CURVE = "/plan/path"


def course() -> tuple[tuple[float, ...], ...]:
    """Waypoints of ten legs of 1 to 5 m."""
    steps = np.random.default_rng(3).uniform(-3.0, 3.0, (LEGS + 1, 3))
    steps[:, 2] *= 0.2
    return tuple(tuple(row) for row in (np.cumsum(steps, axis=0) + [0.0, 0.0, 5.0]).tolist())


def scenes() -> dict[str, FileRequest]:
    points = course()
    tube = (0.3,) * LEGS
    limits = (("speed", 3.0), ("acceleration", 6.0))
    return {
        "total time, corridor": FileRequest(points, total_time=30.0, corridor=tube),
        "limits, corridor": FileRequest(points, limits=limits, corridor=tube),
    }


def drag(position: np.ndarray) -> bytes:
    """The message that a browser sends while waypoint 5 is dragged."""
    told = {"name": "/waypoints/5", "wxyz": (1.0, 0.0, 0.0, 0.0), "position": position.tolist(), "owner": ""}
    return msgspec.msgpack.encode({"type": "TransformControlsUpdateMessage", **told})


async def received(socket: Any) -> list[dict[str, Any]]:
    """Return the messages of one frame of the server."""
    raw = await socket.recv()
    size, packed = struct.unpack("<QQ", raw[:16])
    body = zstandard.ZstdDecompressor().decompress(raw[16 : 16 + packed], max_output_size=size)
    return msgspec.msgpack.decode(body)["messages"]


def is_curve(message: dict[str, Any]) -> bool:
    return message.get("name") == CURVE and "points" in message.get("updates", {})


async def quiet(socket: Any, seconds: float) -> None:
    """Read until nothing has come for so long."""
    try:
        while True:
            await asyncio.wait_for(received(socket), seconds)
    except TimeoutError:
        pass


async def latencies(url: str, start: Any) -> list[float]:
    """Return the times from drag to curve [ms]."""
    protocol = [f"viser-v{viser.__version__}"]
    found = []
    async with websockets.connect(url.replace("http", "ws"), subprotocols=protocol, max_size=None) as socket:
        await quiet(socket, 2.0)
        for i in range(1, DRAGS + 1):
            position = np.array(start) + 0.3 * np.array([np.sin(0.1 * i), 1.0 - np.cos(0.1 * i), 0.0])
            began = time.perf_counter()
            await socket.send(drag(position))
            while not any(map(is_curve, await asyncio.wait_for(received(socket), 30.0))):
                pass
            found.append(1e3 * (time.perf_counter() - began))
            await asyncio.sleep(PAUSE)
    return found


def main() -> None:
    for name, request in scenes().items():
        with TemporaryDirectory() as folder:
            studio = Studio(request, folder, port=0)
            studio.wait(60.0)
            times = asyncio.run(latencies(studio.url, request.waypoints[5]))
            studio.close()
        least, half, most = np.percentile(times, [0, 50, 95])
        print(
            f"{name:24} {LEGS} legs, {len(times)} drags: least {least:.0f}, median {half:.0f}, 95 % below {most:.0f} ms"
        )


if __name__ == "__main__":
    main()
