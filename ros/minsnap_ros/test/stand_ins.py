"""Stand-ins of the interfaces of ROS 2 that the node uses, with their names, fields and defaults.

Messages are delivered at once, in this process; who subscribes late is given the last one.  A clock is set by hand.
"""

from __future__ import annotations

import sys
from types import ModuleType, SimpleNamespace
from typing import Any

FIELDS: dict[str, dict[str, Any]] = {
    "builtin_interfaces.msg.Time": {"sec": 0, "nanosec": 0},
    "builtin_interfaces.msg.Duration": {"sec": 0, "nanosec": 0},
    "std_msgs.msg.Header": {"stamp": "builtin_interfaces.msg.Time", "frame_id": ""},
    "geometry_msgs.msg.Point": {"x": 0.0, "y": 0.0, "z": 0.0},
    "geometry_msgs.msg.Vector3": {"x": 0.0, "y": 0.0, "z": 0.0},
    "geometry_msgs.msg.Quaternion": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
    "geometry_msgs.msg.Pose": {"position": "geometry_msgs.msg.Point", "orientation": "geometry_msgs.msg.Quaternion"},
    "geometry_msgs.msg.PoseStamped": {"header": "std_msgs.msg.Header", "pose": "geometry_msgs.msg.Pose"},
    "geometry_msgs.msg.Transform": {
        "translation": "geometry_msgs.msg.Vector3",
        "rotation": "geometry_msgs.msg.Quaternion",
    },
    "geometry_msgs.msg.Twist": {"linear": "geometry_msgs.msg.Vector3", "angular": "geometry_msgs.msg.Vector3"},
    "nav_msgs.msg.Path": {"header": "std_msgs.msg.Header", "poses": []},
    "nav_msgs.srv.GetPlan": {},
    "nav_msgs.srv.GetPlan.Request": {
        "start": "geometry_msgs.msg.PoseStamped",
        "goal": "geometry_msgs.msg.PoseStamped",
        "tolerance": 0.0,
    },
    "nav_msgs.srv.GetPlan.Response": {"plan": "nav_msgs.msg.Path"},
    "sensor_msgs.msg.PointField": {"name": "", "offset": 0, "datatype": 0, "count": 0},
    "sensor_msgs.msg.PointCloud2": {
        "header": "std_msgs.msg.Header",
        "height": 0,
        "width": 0,
        "fields": [],
        "is_bigendian": False,
        "point_step": 0,
        "row_step": 0,
        "data": b"",
        "is_dense": False,
    },
    "std_srvs.srv.Trigger": {},
    "std_srvs.srv.Trigger.Request": {},
    "std_srvs.srv.Trigger.Response": {"success": False, "message": ""},
    "trajectory_msgs.msg.MultiDOFJointTrajectoryPoint": {
        "transforms": [],
        "velocities": [],
        "accelerations": [],
        "time_from_start": "builtin_interfaces.msg.Duration",
    },
    "trajectory_msgs.msg.MultiDOFJointTrajectory": {"header": "std_msgs.msg.Header", "joint_names": [], "points": []},
    "mavros_msgs.msg.State": {"connected": False, "armed": False, "guided": False, "mode": ""},
    "mavros_msgs.msg.PositionTarget": {
        "header": "std_msgs.msg.Header",
        "coordinate_frame": 0,
        "type_mask": 0,
        "position": "geometry_msgs.msg.Point",
        "velocity": "geometry_msgs.msg.Vector3",
        "acceleration_or_force": "geometry_msgs.msg.Vector3",
        "yaw": 0.0,
        "yaw_rate": 0.0,
    },
    "geometry_msgs.msg.PoseWithCovariance": {"pose": "geometry_msgs.msg.Pose"},
    "geometry_msgs.msg.TwistWithCovariance": {"twist": "geometry_msgs.msg.Twist"},
    "nav_msgs.msg.Odometry": {
        "header": "std_msgs.msg.Header",
        "pose": "geometry_msgs.msg.PoseWithCovariance",
        "twist": "geometry_msgs.msg.TwistWithCovariance",
    },
    "geometry_msgs.msg.TwistStamped": {"header": "std_msgs.msg.Header", "twist": "geometry_msgs.msg.Twist"},
    "ardupilot_msgs.msg.Status": {
        "header": "std_msgs.msg.Header",
        "vehicle_type": 0,
        "armed": False,
        "mode": 0,
        "flying": False,
        "external_control": False,
        "failsafe": [],
    },
    "ardupilot_msgs.msg.LocalPosition": {
        "header": "std_msgs.msg.Header",
        "type_mask": 0,
        "x": 0.0,
        "y": 0.0,
        "z": 0.0,
        "velocity": "geometry_msgs.msg.Twist",
        "acceleration_or_force": "geometry_msgs.msg.Twist",
        "yaw": 0.0,
        "yaw_rate": 0.0,
    },
    "px4_msgs.msg.OffboardControlMode": dict.fromkeys(
        ("position", "velocity", "acceleration", "attitude", "body_rate", "thrust_and_torque", "direct_actuator"), False
    )
    | {"timestamp": 0},
    "px4_msgs.msg.TrajectorySetpoint": dict.fromkeys(("position", "velocity", "acceleration", "jerk"), [0.0] * 3)
    | {"timestamp": 0, "yaw": 0.0, "yawspeed": 0.0},
    "px4_msgs.msg.VehicleLocalPosition": dict.fromkeys(("xy_valid", "z_valid", "v_xy_valid", "v_z_valid"), True)
    | dict.fromkeys(("x", "y", "z", "vx", "vy", "vz"), 0.0),
    "px4_msgs.msg.VehicleStatus": {"timestamp": 0, "nav_state": 0, "arming_state": 0},
}
TYPES: dict[str, type] = {}
TOPICS: dict[str, SimpleNamespace] = {}


class Message:
    """A message with the fields of its table alone."""

    table: dict[str, Any] = {}

    def __init__(self, **values: Any) -> None:
        for name, default in self.table.items():
            value = TYPES[default]() if isinstance(default, str) and default in TYPES else default
            object.__setattr__(self, name, list(value) if isinstance(value, list) else value)
        for name, value in values.items():
            setattr(self, name, value)

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in self.table:
            raise AttributeError(f"{type(self).__name__} has no field {name}")
        default = self.table[name]
        kind = TYPES[default] if isinstance(default, str) and default in TYPES else type(default)
        if not isinstance(value, kind):
            raise AssertionError(f"{type(self).__name__}.{name} must be a {kind.__name__}: {value!r}")
        object.__setattr__(self, name, value)


class Node:
    """A node whose messages are delivered at once."""

    seconds = 0.0

    def __init__(self, name: str, *, parameter_overrides: Any = ()) -> None:
        self.name, self.services, self.timers, self.errors = name, {}, [], []
        self._overrides = {parameter.name: parameter.value for parameter in parameter_overrides}
        self._values: dict[str, Any] = {}

    def declare_parameter(self, name: str, value: Any) -> None:
        self._values[name] = self._overrides.get(name, value)

    def get_parameter(self, name: str) -> Any:
        return SimpleNamespace(value=self._values[name])

    def set_parameters(self, parameters: Any) -> None:
        self._values.update((one.name, one.value) for one in parameters)

    def _topic(self, name: str) -> SimpleNamespace:
        full = name.replace("~", f"/{self.name}")
        return TOPICS.setdefault(full, SimpleNamespace(last=None, hear=[]))

    def create_publisher(self, kind: type, topic: str, qos: Any) -> Any:
        place = self._topic(topic)

        def publish(message: Any) -> None:
            assert isinstance(message, kind)
            place.last = message
            for callback in place.hear:
                callback(message)

        return SimpleNamespace(publish=publish)

    def create_subscription(self, kind: type, topic: str, callback: Any, qos: Any, callback_group: Any = None) -> None:
        place = self._topic(topic)
        place.hear.append(callback)
        if place.last is not None:
            callback(place.last)

    def create_service(self, kind: type, name: str, callback: Any) -> None:
        self.services[name] = callback

    def create_timer(self, period: float, callback: Any, callback_group: Any = None) -> Any:
        self.timers.append((period, callback))
        return self.timers[-1]

    def get_clock(self) -> Any:
        return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=round(Node.seconds * 1e9)))

    def get_logger(self) -> Any:
        return SimpleNamespace(info=lambda text, **_: None, error=self.errors.append)

    def destroy_node(self) -> None:
        TOPICS.clear()


class Executor:
    """Ends as one does whose process is told to terminate."""

    def __init__(self, num_threads: int) -> None:
        self.nodes: list[Node] = []

    def add_node(self, node: Node) -> None:
        self.nodes.append(node)

    def spin(self) -> None:
        raise sys.modules["rclpy.executors"].ExternalShutdownException


class Parameter:
    def __init__(self, name: str, value: Any) -> None:
        self.name, self.value = name, value


def _add(path: str, value: Any) -> None:
    parts = path.split(".")
    if parts[-2][0].isupper():
        setattr(TYPES[".".join(parts[:-1])], parts[-1], value)
        return
    for count in range(1, len(parts)):
        name = ".".join(parts[:count])
        module = sys.modules.setdefault(name, ModuleType(name))
        if count > 1:
            setattr(sys.modules[".".join(parts[: count - 1])], parts[count - 1], module)
    setattr(sys.modules[".".join(parts[:-1])], parts[-1], value)


def install() -> None:
    """Put the stand-ins where the packages of ROS 2 are looked for."""
    for path, fields in FIELDS.items():
        TYPES[path] = type(path.rsplit(".", 1)[-1], (Message,), {"table": fields})
        _add(path, TYPES[path])
    kinds = SimpleNamespace(TRANSIENT_LOCAL=1, RELIABLE=1, BEST_EFFORT=2)
    for path, value in {
        "rclpy.node.Node": Node,
        "rclpy.parameter.Parameter": Parameter,
        "rclpy.callback_groups.MutuallyExclusiveCallbackGroup": SimpleNamespace,
        "rclpy.executors.ExternalShutdownException": type("ExternalShutdownException", (Exception,), {}),
        "rclpy.executors.MultiThreadedExecutor": Executor,
        "rclpy.qos.QoSProfile": SimpleNamespace,
        "rclpy.qos.DurabilityPolicy": kinds,
        "rclpy.qos.ReliabilityPolicy": kinds,
        "rclpy.init": lambda: None,
        "rclpy.try_shutdown": lambda: None,
        "rclpy.spin_once": lambda node, timeout_sec: None,
    }.items():
        _add(path, value)
