"""Poses from motion capture (NatNet, JSON over UDP, a file), relayed to the autopilot as its estimator reads them."""

from __future__ import annotations

import json
import math
import threading
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.optional_packages import optional
from minsnap.basics.storage.table import read_table
from minsnap.basics.storage.text import FileName
from minsnap.errors import FileError, InputError, LinkError
from minsnap.files import COLUMNS, get_frame, map_quaternions, map_vectors, map_yaw
from minsnap.flight.mavlink._transports import bind_udp
from minsnap.flight.mavlink.link import Clock, Link, Schedule
from minsnap.flight.mavlink.setpoints import vehicle_frame
from minsnap.flight.mavlink.vehicle_messages import Message, load_dialect
from minsnap.trajectory import wrap

Quaternion = tuple[float, float, float, float]
QUATERNION = ("qw", "qx", "qy", "qz")
"""Columns of an attitude in a file."""

FARTHEST = 1e6
"""Coordinate beyond which a packet holds no pose of a room [m]."""

LEAST, MOST = 0.5, 1e6
"""Lengths of a quaternion; a shorter or longer one is refused."""


@dataclass(frozen=True)
class Pose:
    """A measured position and attitude of the vehicle.

    Parameters
    ----------
    received : float
        When word of it came, by our clock [s].
    position : tuple of 3
        In the source's frame [m].
    attitude : tuple of 4, or float
        Quaternion (w, x, y, z) of the body in the source's frame; or the yaw of a body that stays level, as that frame
        counts it [rad] (:mod:`minsnap.files.frames`).
    """

    received: float
    position: tuple[float, float, float]
    attitude: Quaternion | float


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
    quaternion where the body stays level; ``"body": name`` identifies one of several bodies, by a text or a number.

    Parameters
    ----------
    host, port : str, int
        Where to listen.
    body : str or None
        Take this body only; None keeps to the first of which a pose comes.
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
            body = _label(content.get("body"))
            if self._body in (None, body):
                turned = "quaternion" in content
                attitude = _quaternion(_numbers(content["quaternion"])) if turned else _numbers([content["yaw"]])[0]
                self._pose = _measured(self._clock.now(), _numbers(content["position"]), attitude)
                self._body = body
        except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError):
            self.rejected += 1


def _label(body: object) -> str:
    """Return the name of a body as text; a number without a fraction is named like the integer."""
    return str(int(body) if isinstance(body, float) and body.is_integer() else body)


def _numbers(values: object) -> list[float]:
    """Return a list of JSON numbers as floats; a text, an object or a truth value in their place is a TypeError."""
    if not isinstance(values, list) or not all(type(value) in (int, float) for value in values):
        raise TypeError("not a list of numbers")
    return [float(value) for value in values]


def _quaternion(numbers: Iterable[Any]) -> Quaternion:
    """Return (w, x, y, z) at unit length, or raise ValueError, TypeError or OverflowError."""
    w, i, j, k = (float(value) for value in numbers)
    length = math.hypot(w, i, j, k)
    if not LEAST < length <= MOST:
        raise ValueError(f"an attitude of length {length:.3g}: a unit quaternion (w, x, y, z) is one")
    return w / length, i / length, j / length, k / length


def _measured(now: float, position: Iterable[Any], attitude: Quaternion | float) -> Pose:
    """Return what a source says as a pose, or raise ValueError, TypeError or OverflowError."""
    x, y, z = (float(value) for value in position)
    if not (max(abs(x), abs(y), abs(z)) <= FARTHEST and math.isfinite(x + y + z)):
        raise ValueError("not a position")
    if isinstance(attitude, float) and not math.isfinite(attitude):
        raise ValueError("not a yaw")
    return Pose(now, (x, y, z), attitude)


class NatNetSource(PoseSource):
    """OptiTrack's Motive over NatNet, through the ``natnet`` package.

    Parameters
    ----------
    server : str
        Address of the computer that runs Motive; on the loopback the data comes by unicast.
    local : str
        Our address in its network.
    body : str or None
        Streaming id of the rigid body; None keeps to the first that is tracked.
    multicast : bool
        How Motive streams.
    clock : Clock
        By which poses are stamped.
    """

    def __init__(
        self, server: str, local: str, body: str | None, multicast: bool, clock: Clock, command_port: int = 1510
    ) -> None:
        natnet = optional("natnet", "NatNet needs the natnet package", "mocap")
        self._body, self._clock = None if body is None else int(body), clock
        self._client = natnet.NatNetClient(server, local, command_port=command_port, use_multicast=multicast)
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
                self._pose = _measured(self._clock.now(), body.pos, _quaternion((w, i, j, k)))
            except ValueError:
                self.rejected += 1
                continue
            self._body = body.id_num
            return


class ReplaySource(PoseSource):
    """Poses of a comma-separated file at their times: columns t,x,y,z and yaw or qw,qx,qy,qz.

    Parameters
    ----------
    path : str or path
        The file; other columns, such as a setpoint file's, are passed over.
    clock : Clock
        Whose time it follows, from when a pose is first asked for.

    Raises
    ------
    FileError
        If the columns are not there or not numbers, times go back, or a quaternion is far from unit length;
        says which line.
    """

    def __init__(self, path: FileName, clock: Clock) -> None:
        table = read_table(path, COLUMNS[:4], (*COLUMNS[4:], *QUATERNION))
        self._t = table["t"] - table["t"][0]
        back = np.flatnonzero(np.diff(self._t) < 0.0)
        if back.size:
            raise FileError(f"{path}, line {back[0] + 3}: t is before that of the line above: times must not go back")
        self._positions = np.stack([table[name] for name in "xyz"], axis=1)
        self._attitudes = _attitudes(path, table)
        self._clock = clock
        self._start: float | None = None

    def latest(self) -> Pose | None:
        """Return the pose of the file for the present time."""
        if self._start is None:
            self._start = self._clock.now()
        elapsed = self._clock.now() - self._start
        row = int(np.searchsorted(self._t, elapsed, side="right")) - 1
        self.ended = row == len(self._t) - 1 and elapsed > self._t[-1] + 1.0
        x, y, z = self._positions[row].tolist()
        return Pose(self._start + float(self._t[row]), (x, y, z), self._attitudes[row])


def _attitudes(path: FileName, table: dict[str, FloatArray]) -> Sequence[Quaternion | float]:
    if all(name in table for name in QUATERNION):
        rows = np.stack([table[name] for name in QUATERNION], axis=1).tolist()
        return [_attitude_at(f"{path}, line {line}", row) for line, row in enumerate(rows, 2)]
    if "yaw" not in table:
        raise FileError(f"{path}, line 1: no column yaw, nor qw,qx,qy,qz: a pose needs an attitude")
    yaws: list[float] = table["yaw"].tolist()
    return yaws


def _attitude_at(where: str, numbers: list[float]) -> Quaternion:
    try:
        return _quaternion(numbers)
    except ValueError as error:
        raise FileError(f"{where}: {error}") from None


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
        here = server == "localhost" or server.startswith("127.")
        return NatNetSource(server, local or "127.0.0.1", body, not here, clock)
    raise LinkError(f"cannot understand the source {text!r}: give natnet:SERVER, udp:PORT or csv:FILE", address=text)


_UNKNOWN = [math.nan] + [0.0] * 20  # a covariance whose first number is not one is unknown


def mocap_message(microseconds: int, position: list[float], attitude: list[float], frame: str) -> Message:
    """ATT_POS_MOCAP; PX4's default estimator does not read it."""
    return load_dialect().MAVLink_att_pos_mocap_message(microseconds, attitude, *position, _UNKNOWN)


def vision_message(microseconds: int, position: list[float], attitude: list[float], frame: str) -> Message:
    """VISION_POSITION_ESTIMATE, read by PX4's EKF2 and by ArduPilot."""
    numbers = (*position, *euler_angles(attitude), _UNKNOWN, 0)
    return load_dialect().MAVLink_vision_position_estimate_message(microseconds, *numbers)


def odometry_message(
    microseconds: int, position: list[float], attitude: list[float], frame: str, estimator: str = "VISION"
) -> Message:
    """ODOMETRY without velocities: as from vision, PX4's EKF2 fuses it; as from motion capture, it does not read it."""
    dialect, unknown = load_dialect(), [math.nan] * 6
    axes = getattr(dialect, f"MAV_FRAME_LOCAL_{frame.upper()}"), dialect.MAV_FRAME_BODY_FRD
    kind = getattr(dialect, f"MAV_ESTIMATOR_TYPE_{estimator}")
    numbers = (*position, attitude, *unknown, _UNKNOWN, _UNKNOWN)
    return dialect.MAVLink_odometry_message(microseconds, *axes, *numbers, 0, kind, 0)


MESSAGES: dict[str, Callable[..., Message]] = {"vision": vision_message, "odometry": odometry_message}
MESSAGES |= {"odometry-mocap": partial(odometry_message, estimator="MOCAP"), "mocap": mocap_message}
"""What a pose can be sent as."""

RECENT = 3000
"""Poses of which the rate and the latency are told: a minute of them."""


def euler_angles(attitude: list[float]) -> tuple[float, float, float]:
    """Roll, pitch and yaw (about z, then y, then x) of a unit quaternion (w, x, y, z) [rad]."""
    w, x, y, z = attitude
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    return roll, pitch, math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


@dataclass(frozen=True)
class RelayReport:
    """Statistics of a relay.

    Parameters
    ----------
    sent : int
        Poses passed on.
    stale : int
        Slots in which the newest pose was too old, or had been sent already.
    rejected : int
        Packets that held no usable pose.
    rate : float
        Poses passed on a second, of the last ``RECENT`` [Hz].
    latency, latency_p99 : float
        From a pose's arrival to its departure, of the same, median and 99th percentile [s].
    """

    sent: int
    stale: int
    rejected: int
    rate: float
    latency: float
    latency_p99: float


class Relay:
    """Poses from a source to a link, at a fixed rate.

    Parameters
    ----------
    source : PoseSource
        Where poses come from.
    link : Link
        Where they go; it sends our heartbeat as well.
    clock : Clock
        The same as the link's and the source's.
    message : str
        ``vision``, ``odometry``, ``odometry-mocap`` or ``mocap``.
    frame : str
        Of the source; poses leave in NED for compass frames, else in the room's forward-right-down.
    rate : float
        Poses a second at most [Hz].
    max_age : float
        A pose older than this is not sent [s].

    Raises
    ------
    InputError
        If there is no such message or the age is not positive.
    """

    def __init__(
        self,
        source: PoseSource,
        link: Link,
        clock: Clock,
        message: str = "vision",
        frame: str = "optitrack",
        rate: float = 50.0,
        max_age: float = 0.1,
    ) -> None:
        if message not in MESSAGES:
            raise InputError(f"no pose message is called {message!r}: choose {', '.join(MESSAGES)}")
        if not max_age > 0:
            raise InputError(f"the largest age is {max_age} s: it must be positive")
        self._source, self._link, self._clock = source, link, clock
        self._build, self._frame, self._target = MESSAGES[message], get_frame(frame).name, vehicle_frame(frame)
        self._message(Pose(0.0, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)))  # what is imported for it delays no pose
        self._max_age, self._schedule = max_age, Schedule(rate, clock.now())
        self._last = -math.inf
        self._sent: deque[tuple[float, float]] = deque(maxlen=RECENT)
        self._count = self._stale = 0
        self._stopped = False

    def stop(self) -> None:
        """Request the end, from any thread or signal handler."""
        self._stopped = True

    def run(self, on_report: Callable[[RelayReport], None] | None = None) -> RelayReport:
        """Relay poses until stopped or until the source ends; ``on_report`` is called once per second."""
        last_line = self._clock.now()
        while not (self._stopped or self._source.ended):
            for _ in self._link.pump(self._schedule.due):
                pass
            now = self._clock.now()
            self._schedule.take(now)
            self._pass_on(self._source.latest(), now)
            if on_report is not None and now - last_line >= 1.0:
                last_line = now
                on_report(self.report())
        return self.report()

    def _pass_on(self, pose: Pose | None, now: float) -> None:
        """Send a pose if it is new and not too old."""
        if pose is None or pose.received <= self._last or now - pose.received > self._max_age:
            self._stale += pose is not None
            return
        self._last, message = pose.received, self._message(pose)
        if self._clock.now() - pose.received > self._max_age:
            self._stale += 1
            return
        self._link.send(message)
        self._count += 1
        self._sent.append((now, self._clock.now() - pose.received))

    def _message(self, pose: Pose) -> Message:
        position = map_vectors(pose.position, self._frame, self._target).tolist()
        return self._build(max(0, round(pose.received * 1e6)), position, self._attitude(pose.attitude), self._target)

    def _attitude(self, attitude: Quaternion | float) -> list[float]:
        """Return an attitude in the frame that poses leave in; its z points down, and its yaw turns about that."""
        if isinstance(attitude, tuple):
            mapped: list[float] = map_quaternions(attitude, self._frame, self._target).tolist()
            return mapped
        half = float(wrap(map_yaw(attitude, self._frame, self._target))) / 2
        return [math.cos(half), 0.0, 0.0, math.sin(half)]

    def report(self) -> RelayReport:
        """Return the statistics so far."""
        if not self._sent:
            return RelayReport(0, self._stale, self._source.rejected, 0.0, 0.0, 0.0)
        when, late = np.array(self._sent).T
        rate = (len(when) - 1) / (when[-1] - when[0]) if len(when) > 1 else 0.0
        median, p99 = np.percentile(late, [50, 99])
        return RelayReport(self._count, self._stale, self._source.rejected, float(rate), float(median), float(p99))
