"""The flight and the setpoints of a bag, by the topics that say where a vehicle was and what it was to do."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.storage.text import FileName, reading
from minsnap.errors import FileError
from minsnap.files.bags.bag_storage import Topic, read_topics
from minsnap.files.bags.cdr_messages import decoder
from minsnap.files.bags.usual_definitions import DEFINITIONS
from minsnap.files.flight_log import FlightLog, flight_log
from minsnap.files.frames import map_samples
from minsnap.trajectory.samples import Samples

SYNCHRONOUS = 1.0
"""Up to which difference the stamps of a topic are taken for the recorder's clock [s]: beyond it, when a message was
received counts, as of a vehicle that stamps by the time since it was switched on."""

Message = dict[str, Any]
Point = tuple[float, float, float]

_NAN = (np.nan,) * 3
_MOTION = ("position", "velocity", "acceleration")


@dataclass(frozen=True)
class Row:
    """What one message says.

    Parameters
    ----------
    stamp : float
        Its own time [s]; not a number where it has none.
    position, velocity, acceleration : sequence of 3 float
        In axes of ``frame``; not a number where they are not known.
    yaw : float
        Counted as there [rad].
    """

    stamp: float
    position: Any
    velocity: Any = _NAN
    acceleration: Any = _NAN
    yaw: float = np.nan


@dataclass(frozen=True)
class MessageKind:
    """A type of messages.

    Parameters
    ----------
    row : callable
        From a decoded message to what it says.
    frame : str
        Of its axes.
    asked : bool
        Whether it says what the vehicle is to do, and not where it is.
    """

    row: Callable[[Message], Row]
    frame: str = "enu"
    asked: bool = False


def _stamp(message: Message) -> float:
    stamp = message["header"]["stamp"]
    return float(stamp["sec"]) + 1e-9 * float(stamp["nanosec"])


def _point(values: Message) -> Point:
    return float(values["x"]), float(values["y"]), float(values["z"])


def _turn(quaternion: Message) -> FloatArray:
    """Return the rotation from body to world, (3, 3); not a number for what is none."""
    x, y, z, w = (float(quaternion[name]) for name in "xyzw")
    size = np.sqrt(x * x + y * y + z * z + w * w)
    if not size > 0.5:
        return np.full((3, 3), np.nan)
    x, y, z, w = x / size, y / size, z / size, w / size
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _heading(turn: FloatArray) -> float:
    return float(np.arctan2(turn[1, 0], turn[0, 0]))


def _posed(message: Message, place: Message, turned: Message) -> Row:
    return Row(_stamp(message), _point(place), yaw=_heading(_turn(turned)))


def _pose_row(message: Message) -> Row:
    pose = message["pose"].get("pose", message["pose"])
    return _posed(message, pose["position"], pose["orientation"])


def _transform_row(message: Message) -> Row:
    return _posed(message, message["transform"]["translation"], message["transform"]["rotation"])


def _odometry_row(message: Message) -> Row:
    """Take an odometry, whose velocity is in the axes of the child frame."""
    row, speed = _pose_row(message), np.array(_point(message["twist"]["twist"]["linear"]))
    if message["child_frame_id"] != message["header"]["frame_id"]:
        speed = _turn(message["pose"]["pose"]["orientation"]) @ speed
    return replace(row, velocity=speed)


def _local_position_row(message: Message) -> Row:
    valid = bool(message["xy_valid"] and message["z_valid"])
    speed, push = ([message[name + axis] for axis in "xyz"] for name in "va")
    return Row(message["timestamp"] * 1e-6, _point(message) if valid else _NAN, speed, push, message["heading"])


_NED_FRAMES, _BODY_VELOCITY = (1, 2), 3


def _px4_odometry_row(message: Message) -> Row:
    w, x, y, z = (float(value) for value in message["q"])
    turn = _turn({"x": x, "y": y, "z": z, "w": w})
    speed = np.asarray(message["velocity"], dtype=np.float64)
    speed = turn @ speed if message["velocity_frame"] == _BODY_VELOCITY else speed
    known = message["pose_frame"] in _NED_FRAMES
    return Row(message["timestamp"] * 1e-6, message["position"] if known else _NAN, speed, yaw=_heading(turn))


def _px4_setpoint_row(message: Message) -> Row:
    place, speed, push = (message[name] for name in _MOTION)
    return Row(message["timestamp"] * 1e-6, place, speed, push, message["yaw"])


def _mavros_setpoint_row(message: Message) -> Row:
    """Take a setpoint of MAVROS in ENU; bits of its mask tell what the vehicle leaves out."""
    parts = (("position", 7), ("velocity", 7 << 3), ("acceleration_or_force", 7 << 6 | 1 << 9))
    mask = message["type_mask"]
    place, speed, push = (_NAN if mask & bits else _point(message[name]) for name, bits in parts)
    return Row(_stamp(message), place, speed, push, np.nan if mask & 1 << 10 else message["yaw"])


KINDS: Mapping[str, MessageKind] = {
    "nav_msgs/msg/Odometry": MessageKind(_odometry_row),
    "geometry_msgs/msg/PoseStamped": MessageKind(_pose_row),
    "geometry_msgs/msg/PoseWithCovarianceStamped": MessageKind(_pose_row),
    "geometry_msgs/msg/TransformStamped": MessageKind(_transform_row),
    "px4_msgs/msg/VehicleLocalPosition": MessageKind(_local_position_row, "ned"),
    "px4_msgs/msg/VehicleOdometry": MessageKind(_px4_odometry_row, "ned"),
    "px4_msgs/msg/TrajectorySetpoint": MessageKind(_px4_setpoint_row, "ned", asked=True),
    "mavros_msgs/msg/PositionTarget": MessageKind(_mavros_setpoint_row, asked=True),
}
"""Types that are read, by their names in ROS 2."""


def read_bag(path: FileName, topic: str | None = None, setpoints: str | None = None) -> FlightLog:
    """Read the flight of a bag of ROS 2, and the setpoints where it has any; ROS is not needed.

    Parameters
    ----------
    path : str or path
        A ``.mcap`` or ``.db3`` file, or a folder of them.
    topic : str, optional
        Of the vehicle's positions, where several topics have some.
    setpoints : str, optional
        Of its setpoints, where several topics have some; also one of poses.

    Returns
    -------
    FlightLog
        On the recorder's clock: a topic's own stamps if they are within a second of it, else when its messages were
        received.

    Raises
    ------
    FileError
        If it cannot be read, has no positions, or several topics with some and none is named; lists them.
    ImportError
        If it is compressed, and what decompresses it is not installed.
    """
    topics, damage = read_topics(path, KINDS)
    known = {each.name: each for each in topics if each.kind in KINDS and each.rows}
    if damage is not None and not known:
        raise FileError(f"{damage}, and no message of it can be read")
    asked = _chosen(path, known, setpoints, "setpoints", (each for each in known.values() if KINDS[each.kind].asked))
    places = (each for each in known.values() if each is not asked and not KINDS[each.kind].asked)
    flown = _chosen(path, known, topic, "topic", places)
    if flown is None:
        listed = f"its topics are {', '.join(each.name for each in topics)[:160]}" if topics else "it has no topic"
        raise FileError(f"{path} has no topic with positions of a type that is known: {listed}")
    with reading(path, "a bag of which the messages make sense"):
        began = min(stamp for each in (flown, asked) if each is not None for stamp, _ in each.rows)
        return flight_log(None if asked is None else _samples(asked, began), _samples(flown, began), damage, "enu")


def _chosen(
    path: FileName, known: Mapping[str, Topic], name: str | None, option: str, usual: Iterable[Topic]
) -> Topic | None:
    """Return the topic of that name, or the only usual one; None where there is none."""
    if name is not None:
        if name not in known:
            listed = ", ".join(f"{each.name} ({each.kind})" for each in known.values()) or "none"
            raise FileError(f"{path} has no messages of positions on {name[:80]!r}: its topics of them are {listed}")
        return known[name]
    there = list(usual)
    if len(there) > 1:
        what = "positions" if option == "topic" else "setpoints"
        listed = ", ".join(f"{each.name} ({each.kind.rsplit('/', 1)[-1]})" for each in there)
        raise FileError(f"{path} has several topics with {what}: choose one with --{option}: {listed}")
    return there[0] if there else None


def _samples(topic: Topic, began: int) -> Samples:
    """Return what a topic says, in z-up axes, in time since ``began`` [ns] of the recorder's clock."""
    kind = KINDS[topic.kind]
    decode = decoder(topic.kind, topic.definition or DEFINITIONS[topic.kind])
    rows = [kind.row(decode(raw)) for _, raw in topic.rows]
    received = np.array([stamp - began for stamp, _ in topic.rows], dtype=np.float64) * 1e-9
    own = np.array([row.stamp for row in rows]) - began * 1e-9
    synchronous = bool(np.abs(own - received).max(initial=0.0) <= SYNCHRONOUS)
    motion = [np.array([getattr(row, name) for row in rows], dtype=np.float64) for name in _MOTION]
    yaw = np.array([row.yaw for row in rows])
    parts = [None if not np.isfinite(part).any() else part for part in (*motion[1:], yaw)]
    samples = Samples(own if synchronous else received, motion[0], parts[0], parts[1], yaw=parts[2])
    return map_samples(samples, kind.frame, "enu")
