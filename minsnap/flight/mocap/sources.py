"""Sources of motion-capture poses: NatNet, JSON over UDP, or a replayed file; only the newest pose is used."""

from __future__ import annotations

import ipaddress
import json
import math
import os
import threading
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.table import read_table
from minsnap.errors import FileError, LinkError
from minsnap.flight.mavlink._transports import bind_udp
from minsnap.flight.mavlink.schedule import Clock

Quaternion = tuple[float, float, float, float]

FARTHEST = 1e6
"""Coordinate beyond which a packet holds no pose of a room [m]."""

MOST = 1e6
"""Greatest length of a quaternion; a longer one is refused."""


@dataclass(frozen=True)
class Pose:
    """A measured position and attitude of the vehicle.

    Parameters
    ----------
    received : float
        When word of it came, by our clock [s].
    position : tuple of 3
        In the source's frame [m].
    attitude : tuple of 4
        Quaternion (w, x, y, z) of the body in the source's frame.
    """

    received: float
    position: tuple[float, float, float]
    attitude: Quaternion


class PoseSource:
    """A source of poses.

    Attributes
    ----------
    rejected : int
        Packets that held no usable pose.
    ended : bool
        True when nothing more will come.
    """

    rejected: int = 0
    ended: bool = False
    _pose: Pose | None = None

    def latest(self) -> Pose | None:
        """Return the newest pose, None before the first; the same pose is returned until a new one arrives."""
        return self._pose

    def close(self) -> None:
        """Release ports and threads."""


class UdpJsonSource(PoseSource):
    """Poses over UDP, one JSON object per datagram.

    ``{"position": [x, y, z], "quaternion": [w, x, y, z]}`` in metres, or ``"yaw": angle`` in radians instead of the
    quaternion where the body stays level; ``"body": name`` identifies one of several bodies.

    Parameters
    ----------
    host, port : str, int
        Where to listen.
    body : str or None
        Take this body only.
    clock : Clock
        By which poses are stamped.
    """

    def __init__(self, host: str, port: int, body: str | None, clock: Clock) -> None:
        self._body, self._clock = body, clock
        self._socket = bind_udp(host, port, f"udp:{host}:{port}")
        self._socket.settimeout(0.1)
        self.port = self._socket.getsockname()[1]
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop listening."""
        self.ended = True
        self._thread.join()
        self._socket.close()

    def _listen(self) -> None:
        while not self.ended:
            try:
                data = self._socket.recv(65535)
            except OSError:
                continue
            self._take(data)

    def _take(self, data: bytes) -> None:
        try:
            content = json.loads(data)
            if self._body is None or content.get("body") == self._body:
                self._pose = _measured(self._clock.now(), *_pose_numbers(content))
        except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError):
            self.rejected += 1


def _pose_numbers(content: dict[str, Any]) -> tuple[Iterable[Any], Iterable[Any]]:
    """Return position and attitude of a JSON pose, or raise KeyError, TypeError or ValueError."""
    if "quaternion" in content:
        return content["position"], content["quaternion"]
    half = float(content["yaw"]) / 2
    return content["position"], (math.cos(half), 0.0, 0.0, math.sin(half))


def _measured(now: float, position: Iterable[Any], attitude: Iterable[Any]) -> Pose:
    """Return what a source says as a pose, or raise ValueError, TypeError or OverflowError."""
    x, y, z = (float(value) for value in position)
    w, i, j, k = (float(value) for value in attitude)
    length = math.hypot(w, i, j, k)
    if not (max(abs(x), abs(y), abs(z)) <= FARTHEST and math.isfinite(x + y + z)):
        raise ValueError("not a position")
    if not 0.5 < length <= MOST:
        raise ValueError("not an attitude")
    return Pose(now, (x, y, z), (w / length, i / length, j / length, k / length))


class NatNetSource(PoseSource):
    """OptiTrack's Motive over NatNet, through the ``natnet`` package.

    Parameters
    ----------
    server : str
        Address of the computer that runs Motive; on the loopback the data comes by unicast.
    local : str
        Our address in its network.
    body : str or None
        Streaming id of the rigid body; None takes the first that is tracked.
    multicast : bool
        How Motive streams.
    clock : Clock
        By which poses are stamped.
    """

    def __init__(
        self, server: str, local: str, body: str | None, multicast: bool, clock: Clock, command_port: int = 1510
    ) -> None:
        try:
            from natnet import NatNetClient
        except ImportError:
            raise ImportError("NatNet needs the natnet package: pip install minsnap[mocap]") from None
        self._body, self._clock = None if body is None else int(body), clock
        self._client = NatNetClient(server, local, command_port=command_port, use_multicast=multicast)
        try:
            self._client.connect(timeout=3.0)
        except (TimeoutError, OSError):
            raise LinkError(f"no NatNet server answers at {server} within 3 s", address=server) from None
        self._client.on_data_frame_received_event.handlers.append(self._take)
        self._client.run_async()

    def close(self) -> None:
        """Leave the server."""
        self.ended = True
        self._client.shutdown()

    def _take(self, frame: Any) -> None:
        """Read the body's pose from a frame; NatNet's quaternions have the scalar last."""
        for body in frame.rigid_bodies:
            if self._body not in (None, body.id_num):
                continue
            try:
                if body.tracking_valid is False:
                    raise ValueError("not tracked")
                i, j, k, w = body.rot
                self._pose = _measured(self._clock.now(), body.pos, (w, i, j, k))
            except ValueError:
                self.rejected += 1
                continue
            return


class ReplaySource(PoseSource):
    """Poses of a comma-separated file at their times: columns t,x,y,z and yaw or qw,qx,qy,qz.

    Parameters
    ----------
    path : str or path
        The file; other columns, such as a setpoint file's, are passed over.
    clock : Clock
        Whose time it follows, from now on.

    Raises
    ------
    FileError
        If the columns are not there or not numbers.
    """

    def __init__(self, path: str | os.PathLike[str], clock: Clock) -> None:
        optional = ("vx", "vy", "vz", "ax", "ay", "az", "yaw", "yaw_rate", "qw", "qx", "qy", "qz")
        table = read_table(path, ("t", "x", "y", "z"), optional)
        self._t = table["t"] - table["t"][0]
        self._positions = np.stack([table[name] for name in "xyz"], axis=1)
        self._attitudes = _attitudes(path, table)
        self._clock, self._start = clock, clock.now()

    def latest(self) -> Pose | None:
        """Return the pose of the file for the present time."""
        elapsed = self._clock.now() - self._start
        row = int(np.searchsorted(self._t, elapsed, side="right")) - 1
        self.ended = row == len(self._t) - 1 and elapsed > self._t[-1] + 1.0
        x, y, z = self._positions[row].tolist()
        w, i, j, k = self._attitudes[row].tolist()
        return Pose(self._start + float(self._t[row]), (x, y, z), (w, i, j, k))


def _attitudes(path: str | os.PathLike[str], table: dict[str, FloatArray]) -> FloatArray:
    quaternion = ("qw", "qx", "qy", "qz")
    if all(name in table for name in quaternion):
        stacked = np.stack([table[name] for name in quaternion], axis=1)
        unit: FloatArray = stacked / np.linalg.norm(stacked, axis=1, keepdims=True)
        return unit
    if "yaw" not in table:
        raise FileError(f"{path}, line 1: no column yaw, nor qw,qx,qy,qz: a pose needs an attitude")
    half, zero = table["yaw"] / 2, np.zeros_like(table["yaw"])
    return np.stack([np.cos(half), zero, zero, np.sin(half)], axis=1)


def open_source(text: str, body: str | None, clock: Clock) -> PoseSource:
    """Open ``natnet:SERVER[,LOCAL]``, ``udp:[HOST:]PORT`` or ``csv:FILE``.

    Raises
    ------
    LinkError
        If it is none of them or nobody answers.
    """
    kind, _, rest = text.partition(":")
    if kind == "csv" and rest:
        return ReplaySource(rest, clock)
    if kind == "udp" and rest.rpartition(":")[2].isdecimal():
        host, _, port = rest.rpartition(":")
        return UdpJsonSource(host or "127.0.0.1", int(port), body, clock)
    if kind == "natnet" and rest:
        server, _, local = rest.partition(",")
        return NatNetSource(server, local or "127.0.0.1", body, not _is_loopback(server), clock)
    raise LinkError(f"cannot understand the source {text!r}: give natnet:SERVER, udp:PORT or csv:FILE", address=text)


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
