"""The node ``planner``: waypoints or a course in, a certified plan out, and changes of it while it is flown."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from threading import Lock
from typing import Any

import numpy as np
import rclpy
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from nav_msgs.srv import GetPlan
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import Trigger
from trajectory_msgs.msg import MultiDOFJointTrajectory

import minsnap
from minsnap.files import offboard_control_mode, px4_setpoints
from minsnap.flight.mavlink.explored_stream import Exploration, Exploring
from minsnap.paths.missions.course import is_course
from minsnap_ros import ardupilot_vehicle as ap
from minsnap_ros.ardupilot_vehicle import ArdupilotVehicle
from minsnap_ros.explored_flight import ExploredFlight, points_of, turned
from minsnap_ros.flown_plan import FlownPlan
from minsnap_ros.mavros_vehicle import ODOMETRY, SETPOINT, STATE, MavrosVehicle, position_target
from minsnap_ros.messages import path_message, position_of, px4_topic, setpoint_message, trajectory_message
from minsnap_ros.px4_vehicle import Px4Vehicle
from minsnap_ros.vehicle import RULES, Vehicle

PARAMETERS = {
    "course": "",
    "corridor": 0.0,
    "max_speed": 3.0,
    "max_acceleration": 6.0,
    "rate": 20.0,
    "budget": 0.1,
    "frame_id": "map",
    "px4": True,
    "mavros": False,
    "clearance": 0.3,
    "sensing": 15.0,
    "resolution": 0.25,
    "lost": 1.0,
    "ardupilot": False,
}
SLOWEST = 2.0
"""Rate of setpoints below which PX4 leaves the offboard mode [Hz]."""

KEPT = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.RELIABLE)
SENSOR = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
PX4 = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.BEST_EFFORT)


QUIET = 0.2
"""How often the node looks whether a sensor is lost [s]."""

Send = Callable[[minsnap.Samples, float], None]
"""Sends what is to be flown now, one sample, at an instant of the node's clock [s]."""


def stamp_of(seconds: float) -> Time:
    """Return an instant of the node's clock [s] as a message."""
    nanoseconds = round(seconds * 1e9)
    return Time(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)


class PlannerNode(Node):
    """Plans, publishes and changes plans.

    Setpoints and the status of the vehicle have a thread of their own, so that they go on while a plan is made.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("planner", **options)
        for name, value in PARAMETERS.items():
            self.declare_parameter(name, value)
        self.flown: FlownPlan | None = None
        self._lock, self._vehicle = Lock(), Vehicle()
        self._trajectories = self.create_publisher(MultiDOFJointTrajectory, "~/trajectory", KEPT)
        self._paths = self.create_publisher(Path, "~/path", KEPT)
        self.create_subscription(Path, "~/waypoints", self.take_waypoints, 1)
        self.create_service(Trigger, "~/plan", self.plan_course)
        self.create_service(GetPlan, "~/replan", self.replan)
        self.exploration: Exploration | None = None
        self._sensor: Any = None
        self._watch: Any = None
        self.create_subscription(PoseStamped, "~/explore", self.take_goal, 1)
        self.create_subscription(PoseStamped, "~/sensor", self.take_sensor, SENSOR)
        self.create_subscription(PointCloud2, "~/points", self.take_points, SENSOR)
        ways = {"ardupilot": self._connect_ardupilot, "mavros": self._connect_mavros, "px4": self._connect_px4}
        chosen = [connect for name, connect in ways.items() if self._value(name)]
        self._followed = bool(chosen) and chosen[0]()
        if self._value("course"):
            self.plan_course(Trigger.Request(), Trigger.Response())

    def _value(self, name: str) -> Any:
        return self.get_parameter(name).value

    @property
    def seconds(self) -> float:
        """The node's clock [s]."""
        return float(self.get_clock().now().nanoseconds) * 1e-9

    def _asked(self) -> dict[str, Any]:
        limits = minsnap.Limits(speed=self._value("max_speed"), acceleration=self._value("max_acceleration"))
        return {"limits": limits, "corridor": self._value("corridor") or None}

    def _connect_px4(self) -> bool:
        """Publish setpoints where px4_msgs is installed; return whether it is."""
        try:
            from px4_msgs.msg import OffboardControlMode, TrajectorySetpoint, VehicleLocalPosition, VehicleStatus
        except ImportError:
            self.get_logger().info("px4_msgs is not installed: the plan is published, and no setpoints for PX4")
            return False
        mode, setpoint = (px4_topic("in", kind) for kind in (OffboardControlMode, TrajectorySetpoint))
        self._modes = self.create_publisher(OffboardControlMode, mode, PX4)
        self._setpoints = self.create_publisher(TrajectorySetpoint, setpoint, PX4)

        def send(state: minsnap.Samples, now: float) -> None:
            microseconds = round(now * 1e6)
            self._modes.publish(OffboardControlMode(**offboard_control_mode(microseconds)))
            self._setpoints.publish(setpoint_message(TrajectorySetpoint(), px4_setpoints(state)[0], microseconds))

        told = ((kind, px4_topic("out", kind), PX4) for kind in (VehicleStatus, VehicleLocalPosition))
        return self._follow(Px4Vehicle(), send, told)

    def _connect_mavros(self) -> bool:
        """Publish setpoints where mavros_msgs is installed; return whether it is."""
        try:
            from mavros_msgs.msg import PositionTarget, State
            from nav_msgs.msg import Odometry
        except ImportError:
            self.get_logger().error("mavros_msgs is not installed: the plan is published, and no setpoints for MAVROS")
            return False
        self._setpoints = self.create_publisher(PositionTarget, SETPOINT, SENSOR)

        def send(state: minsnap.Samples, now: float) -> None:
            target = position_target(PositionTarget(), state, self._value("frame_id"), stamp_of(now))
            self._setpoints.publish(target)

        return self._follow(MavrosVehicle(), send, ((State, STATE, SENSOR), (Odometry, ODOMETRY, SENSOR)))

    def _connect_ardupilot(self) -> bool:
        """Publish setpoints where ardupilot_msgs is installed; return whether it is."""
        try:
            import ardupilot_msgs.msg as ardupilot
            from geometry_msgs.msg import TwistStamped
        except ImportError:
            self.get_logger().error("ardupilot_msgs is not installed: the plan is published, and no setpoints for it")
            return False
        vehicle, whole = ArdupilotVehicle(), getattr(ardupilot, "LocalPosition", None)
        kind, topic = (TwistStamped, ap.VELOCITY) if whole is None else (whole, ap.SETPOINT)
        self._setpoints = self.create_publisher(kind, topic, SENSOR)

        def send(state: minsnap.Samples, now: float) -> None:
            if whole is not None:
                self._setpoints.publish(ap.local_setpoint(whole(), state, stamp_of(now)))
            else:
                self._setpoints.publish(ap.velocity_command(TwistStamped(), state, vehicle, stamp_of(now)))

        return self._follow(vehicle, send, ((ardupilot.Status, ap.STATUS, KEPT), (PoseStamped, ap.POSE, SENSOR)))

    def _follow(self, vehicle: Vehicle, send: Send, told: Iterable[tuple[type, str, QoSProfile]]) -> bool:
        """Listen to a vehicle's status and position, in this order, and send it setpoints by ``send``."""
        rate = self._value("rate")
        if not rate >= SLOWEST:
            raise minsnap.InputError(f"rate is {rate:g} Hz: PX4 leaves the offboard mode below {SLOWEST:g} Hz")
        self._vehicle, self._send = vehicle, send
        own = MutuallyExclusiveCallbackGroup()
        for (kind, topic, quality), take in zip(told, (self.take_status, self.take_position), strict=True):
            self.create_subscription(kind, topic, take, quality, callback_group=own)
        self.create_timer(1.0 / rate, self.send_setpoint, callback_group=own)
        return True

    def take_waypoints(self, path: Path) -> None:
        """Plan through a path's positions."""
        self._attempt(lambda: self._fly_waypoints(path))

    def take_goal(self, goal: PoseStamped) -> None:
        """Fly to a goal through what the sensor sees."""
        self._attempt(lambda: self._explore(goal))

    def take_sensor(self, pose: PoseStamped) -> None:
        """Keep where the sensor is, and its axes."""
        self._sensor = pose

    def take_points(self, cloud: PointCloud2) -> None:
        """Take what the sensor saw, and plan by it."""
        self._attempt(lambda: self._observe(cloud))

    def watch_sensor(self) -> None:
        """Fly the certified stop where nothing was seen for too long."""
        said = None if self.exploration is None else self.exploration.quiet()
        if said is not None:
            self.get_logger().error(said)

    def plan_course(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Plan the course of the file."""
        del request
        response.message = self._attempt(self._fly_course)
        response.success = not response.message
        return response

    def replan(self, request: GetPlan.Request, response: GetPlan.Response) -> GetPlan.Response:
        """Change the end of what is flown; the path is empty if that cannot be done."""

        def change() -> None:
            response.plan = self._change(request.goal)

        self._attempt(change)
        return response

    def _attempt(self, work: Callable[[], object]) -> str:
        """Do something, and return why it could not be done; nothing if it was."""
        try:
            work()
        except (minsnap.MinsnapError, OSError) as error:
            self.get_logger().error(str(error))
            return str(error)
        return ""

    def _explore(self, goal: PoseStamped) -> None:
        self._refuse_other_frames(goal)
        held = None if self.flown is None else self.flown.at(self.seconds)
        start = held.state(self.seconds).position[0] if held is not None and held.over(self.seconds) else self._place()
        names = ("clearance", "sensing", "resolution")
        options = {name: self._value(name) for name in names}
        limits, end = self._asked()["limits"], np.array(position_of(goal))
        how = Exploring(start, end, limits, lost=self._value("lost"), explorer=options)
        self._fly(how.flown, fixed=True)
        self.exploration = Exploration(ExploredFlight(self), how, lambda: self.seconds)
        self._watch = self._watch or self.create_timer(QUIET, self.watch_sensor)

    def _place(self) -> np.ndarray:
        """Return where the sensor is, or else the vehicle (3,) [m]."""
        if self._sensor is not None:
            self._refuse_other_frames(self._sensor)
            return np.array(position_of(self._sensor))
        if self._vehicle.position is None:
            raise minsnap.InputError("it is not known where the sensor is: publish its pose, or connect a vehicle")
        return self._vehicle.position

    def _observe(self, cloud: PointCloud2) -> None:
        if self.exploration is None:
            raise minsnap.InputError("points came, and no goal: publish one to explore")
        points, here = points_of(cloud), self._place()
        if cloud.header.frame_id not in ("", self._value("frame_id")):
            if self._sensor is None:
                self._refuse_other_frames(cloud)
            points = turned(points, self._sensor.pose)
        self.exploration.observe(here, points)
        answer = self.exploration.plan()
        if not answer.get("ok", True):
            self.get_logger().error(answer["error"])

    def _fly_waypoints(self, path: Path) -> None:
        self._refuse_other_frames(path, *path.poses)
        self._fly(minsnap.plan([position_of(pose) for pose in path.poses], **self._asked()))

    def _fly_course(self) -> None:
        """Plan a course as it says, and what it leaves open, or waypoints, as the parameters say."""
        file, asked = self._value("course"), self._asked()
        if not file:
            raise minsnap.InputError("the parameter course is empty: set it to a file of waypoints or a course")
        if not is_course(file):
            self._fly(minsnap.plan(minsnap.read_waypoints(file).points, **asked))
            return
        course = minsnap.read_course(file)
        said = {"limits": course.limits, "corridor": course.tube}
        own = {name: value for name, value in said.items() if value is not None}
        tube = None if course.boxes else course.tube or asked["corridor"]
        flown = course.changed(limits=course.limits or asked["limits"], tube=tube)
        self._fly(minsnap.plan_mission(flown).trajectory, own, fixed=bool(course.boxes or course.avoid))

    def _fly(self, plan: minsnap.Trajectory, own: Mapping[str, Any] | None = None, fixed: bool = False) -> None:
        if plan.dim != 3:
            raise minsnap.InputError(f"the plan has {plan.dim} coordinates: give x, y and z")
        before, now = self.flown, self.seconds
        if self._followed and before is not None and before.began is not None:
            held = before.at(now)
            if not (
                held.over(now) and np.linalg.norm(plan(0.0) - held.state(now).position[0]) <= RULES.settled_distance
            ):
                raise minsnap.InputError(
                    "the vehicle flies a plan: change it by the service replan, or plan from its end once it is there"
                )
        self.take(before, FlownPlan(plan, None if self._followed else now, own=own or {}, fixed=fixed))
        self.exploration = None

    def _change(self, goal: Any) -> Path:
        before = self.flown
        if before is None:
            raise minsnap.InputError("nothing was planned yet")
        self._refuse_other_frames(goal)
        now = self.seconds
        return self.take(before, before.at(now).changed(position_of(goal), now, self._value("budget"), self._asked()))

    def _refuse_other_frames(self, *stamped: Any) -> None:
        frame = self._value("frame_id")
        others = {message.header.frame_id for message in stamped} - {"", frame}
        if others:
            given = " and ".join(sorted(others))
            raise minsnap.InputError(f"positions in {given}, and plans in {frame}: transform them, or set frame_id")

    def take(self, before: FlownPlan | None, after: FlownPlan) -> Path:
        """Fly ``after`` in place of ``before``, publish it, and return its path; if that fails nothing is changed."""
        newest = after.then or after
        samples, frame = newest.trajectory.sample(self._value("rate")), self._value("frame_id")
        if not self._swap(before, after):  # first of all, since messages of many points take longer than some budgets
            raise minsnap.InputError("the vehicle came into offboard mode or left it while this was planned: try again")
        stamp = stamp_of(self.seconds if newest.began is None else newest.began)
        path = path_message(samples, stamp, frame)
        self._trajectories.publish(trajectory_message(samples, stamp, frame))
        self._paths.publish(path)
        return path

    def _swap(self, before: FlownPlan | None, after: FlownPlan | None) -> bool:
        """Replace what is flown, unless the other thread did so since; return whether it is replaced."""
        with self._lock:
            same = self.flown is before
            self.flown = after if same else self.flown
        return same

    def take_status(self, status: Any) -> None:
        """End the plan when the vehicle is not armed and in offboard mode any more."""
        self._vehicle.take_status(status)
        flown = self.flown
        if flown is None or flown.began is None or self._vehicle.follows:
            return
        if self._swap(flown, None):
            self.exploration = None
            self.get_logger().info("the vehicle does not follow setpoints any more: the flight is over, plan again")

    def take_position(self, message: Any) -> None:
        """Begin the plan when the vehicle is armed, in offboard mode, and at rest where the plan begins."""
        self._vehicle.take_position(message)
        flown, now = self.flown, self.seconds
        if flown is not None and flown.began is None and self._vehicle.settled(flown.trajectory(0.0), now):
            self._swap(flown, flown.begun(now))

    def send_setpoint(self) -> None:
        """Send the vehicle what is to be flown now."""
        flown = self.flown
        if flown is None:
            return
        if flown.began is None and not self._vehicle.follows:
            far = self._vehicle.far(flown.trajectory(0.0))
            if far:
                self.get_logger().info(far, throttle_duration_sec=5.0)
                return
        now = self.seconds
        self._send(flown.at(now).state(now), now)


def main() -> None:
    """Run the node until it is interrupted."""
    rclpy.init()
    try:
        node = PlannerNode()
        executor = MultiThreadedExecutor(num_threads=2)
        executor.add_node(node)
        executor.spin()
    except minsnap.MinsnapError as error:
        raise SystemExit(f"minsnap_ros: {error}") from None
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()
