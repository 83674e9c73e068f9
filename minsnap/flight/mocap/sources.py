"""Sources of motion-capture poses: NatNet, JSON over UDP, or a replayed file; only the newest pose is used."""

from __future__ import annotations

import json
import math
import threading
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from minsnap.errors import LinkError
from minsnap.flight.mavlink._udp import bind_udp
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


class PoseSource(ABC):
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

    @abstractmethod
    def latest(self) -> Pose | None:
        """Return the newest pose, None before the first; the same pose is returned until a new one arrives."""

    def close(self) -> None:  # noqa: B027 - a file has nothing to let go of
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
        self._pose: Pose | None = None
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def latest(self) -> Pose | None:
        """Return the newest pose."""
        return self._pose

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
        self._pose: Pose | None = None
        self._client = NatNetClient(server, local, command_port=command_port, use_multicast=multicast)
        try:
            self._client.connect(timeout=3.0)
        except (TimeoutError, OSError):
            raise LinkError(f"no NatNet server answers at {server} within 3 s", address=server) from None
        self._client.on_data_frame_received_event.handlers.append(self._take)
        self._client.run_async()

    def latest(self) -> Pose | None:
        """Return the newest pose."""
        return self._pose

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
