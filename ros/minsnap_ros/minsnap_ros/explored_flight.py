"""Flights through what a sensor sees: where it is and what it saw, and the plan of a node as something that changes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

import minsnap
from minsnap import Trajectory
from minsnap_ros.flown_plan import FlownPlan

if TYPE_CHECKING:
    from minsnap.replanning.memory import Change
    from minsnap_ros.planner_node import PlannerNode

FLOATS = {7: "f4", 8: "f8"}
"""Types of sensor_msgs/PointField that coordinates have: FLOAT32 and FLOAT64."""


def points_of(cloud: Any) -> np.ndarray:
    """Return the finite points of a sensor_msgs/PointCloud2, (n, 3) [m].

    Raises
    ------
    InputError
        If it has no coordinates as floating-point numbers, or fewer bytes than it says.
    """
    found = {field.name: field for field in cloud.fields}
    if not all(axis in found and found[axis].datatype in FLOATS for axis in "xyz"):
        raise minsnap.InputError("the cloud has no fields x, y and z of floating-point numbers")
    order, data = ">" if cloud.is_bigendian else "<", bytes(cloud.data)
    kinds = [order + FLOATS[found[axis].datatype] for axis in "xyz"]
    offsets = [found[axis].offset for axis in "xyz"]
    ends = max(offset + np.dtype(kind).itemsize for offset, kind in zip(offsets, kinds, strict=True))
    step, row = cloud.point_step, cloud.row_step or cloud.point_step * cloud.width
    if ends > step or step * cloud.width > row or row * cloud.height > len(data):
        raise minsnap.InputError("the cloud has fewer bytes than its points need")
    layout = np.dtype({"names": list("xyz"), "formats": kinds, "offsets": offsets, "itemsize": step})
    rows = [np.frombuffer(data, layout, cloud.width, line * row) for line in range(cloud.height)]
    values = np.concatenate(rows) if rows else np.zeros(0, layout)
    points = np.stack([values[axis].astype(np.float64) for axis in "xyz"], axis=1)
    return points[np.isfinite(points).all(axis=1)]


def turned(points: np.ndarray, pose: Any) -> np.ndarray:
    """Return points (n, 3) in a sensor's axes in those of its geometry_msgs/Pose."""
    q, place = pose.orientation, pose.position
    vector, scale = np.array([q.x, q.y, q.z]), q.w
    length = float(vector @ vector + scale * scale)
    if not length > 0.0:
        raise minsnap.InputError("the orientation of the sensor is no rotation: its quaternion is zero")
    across = np.cross(vector, points) / length
    return points + 2.0 * (scale * across + np.cross(vector, across)) + [place.x, place.y, place.z]


class ExploredFlight:
    """What a node flies, as an :class:`~minsnap.flight.mavlink.explored_stream.Exploration` changes it."""

    def __init__(self, node: PlannerNode) -> None:
        self._node = node

    @property
    def now(self) -> float | None:
        """Instant on the clock of the newest plan [s]; None unless it is flown."""
        newest = self._newest
        return None if newest is None or newest.began is None else self._node.seconds - newest.began

    @property
    def began(self) -> float:
        """Instant of the node's clock at which the newest plan has its time 0 [s]."""
        newest = self._newest
        return 0.0 if newest is None or newest.began is None else newest.began

    @property
    def _newest(self) -> FlownPlan | None:
        flown = self._node.flown
        return None if flown is None else flown.then or flown

    def change(self, change: Change) -> Trajectory:
        """Let the newest plan be followed by a change; return what is flown from its splice on."""
        before, newest = self._node.flown, self._newest
        chosen = change.trajectory if change.certified else change.stop
        if before is None or newest is None or newest.began is None or chosen is None:
            raise minsnap.FlightError("the vehicle does not fly, so there is nothing to change")
        splice, now = newest.began + change.splice, self._node.seconds
        if now > splice:
            raise minsnap.TimingError(f"the change takes over {now - splice:.3g} s ago: it is too late")
        held = before.at(now)
        self._node.take(before, replace(held, then=replace(held, trajectory=chosen, began=splice, then=None)))
        return chosen

    def stop(self) -> None:
        """Hold: what is flown ends at rest."""

    def finish(self) -> None:
        """Take no more of what a sensor sees."""
        self._node.exploration = None
