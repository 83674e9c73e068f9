"""The node ``planner``: waypoints or a course in, a certified plan out, and changes of it while it is flown."""

from __future__ import annotations

from typing import Any

import rclpy
from builtin_interfaces.msg import Time
from nav_msgs.msg import Path
from nav_msgs.srv import GetPlan
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_srvs.srv import Trigger
from trajectory_msgs.msg import MultiDOFJointTrajectory

import minsnap
from minsnap.files.formats.robot_messages import offboard_control_mode, px4_setpoints
from minsnap.paths.missions.course import is_course
from minsnap_ros.flown_plan import FlownPlan
from minsnap_ros.messages import path_message, position_of, setpoint_message, trajectory_message

PARAMETERS = {
    "course": "",
    "corridor": 0.0,
    "max_speed": 3.0,
    "max_acceleration": 6.0,
    "rate": 20.0,
    "budget": 0.1,
    "frame_id": "map",
    "px4": True,
}
OFFBOARD = 14
"""NAVIGATION_STATE_OFFBOARD of px4_msgs/VehicleStatus."""

KEPT = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.RELIABLE)
PX4 = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.BEST_EFFORT)


class PlannerNode(Node):
    """Plans, publishes and changes plans."""

    def __init__(self, **options: Any) -> None:
        super().__init__("planner", **options)
        for name, value in PARAMETERS.items():
            self.declare_parameter(name, value)
        self.flown: FlownPlan | None = None
        self._trajectories = self.create_publisher(MultiDOFJointTrajectory, "~/trajectory", KEPT)
        self._paths = self.create_publisher(Path, "~/path", KEPT)
        self.create_subscription(Path, "~/waypoints", self.take_waypoints, 1)
        self.create_service(Trigger, "~/plan", self.plan_course)
        self.create_service(GetPlan, "~/replan", self.replan)
        self._px4 = self._value("px4") and self._connect_px4()
        if self._value("course"):
            self.plan_course(Trigger.Request(), Trigger.Response())

    def _value(self, name: str) -> Any:
        return self.get_parameter(name).value

    def _now(self) -> float:
        return float(self.get_clock().now().nanoseconds) * 1e-9

    def _asked(self) -> dict[str, Any]:
        limits = minsnap.Limits(speed=self._value("max_speed"), acceleration=self._value("max_acceleration"))
        return {"limits": limits, "corridor": self._value("corridor") or None}

    def _connect_px4(self) -> bool:
        """Publish setpoints where px4_msgs is installed; return whether it is."""
        try:
            from px4_msgs.msg import OffboardControlMode, TrajectorySetpoint, VehicleStatus
        except ImportError:
            self.get_logger().info("px4_msgs is not installed: the plan is published, and no setpoints for PX4")
            return False
        self._mode, self._setpoint = OffboardControlMode, TrajectorySetpoint
        self._modes = self.create_publisher(OffboardControlMode, "/fmu/in/offboard_control_mode", PX4)
        self._setpoints = self.create_publisher(TrajectorySetpoint, "/fmu/in/trajectory_setpoint", PX4)
        self.create_subscription(VehicleStatus, "/fmu/out/vehicle_status", self.take_status, PX4)
        self.create_timer(1.0 / self._value("rate"), self.send_setpoint)
        return True

    def take_waypoints(self, path: Path) -> None:
        """Plan through a path's positions."""
        points = [position_of(pose) for pose in path.poses]
        self._attempt(lambda: self._fly(minsnap.plan(points, **self._asked())))

    def plan_course(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Plan the course of the file."""
        del request
        response.message = self._attempt(self._fly_course)
        response.success = not response.message
        return response

    def replan(self, request: GetPlan.Request, response: GetPlan.Response) -> GetPlan.Response:
        """Change the end of what is flown; the path is empty if that cannot be done."""
        if not self._attempt(lambda: self._change(position_of(request.goal))):
            self._publish(response)
        return response

    def _attempt(self, work: Any) -> str:
        """Do something, and return why it could not be done; nothing if it was."""
        try:
            work()
        except (minsnap.MinsnapError, OSError) as error:
            self.get_logger().error(str(error))
            return str(error)
        return ""

    def _fly_course(self) -> None:
        """Plan a course as it says, and what it leaves open, or waypoints, as the parameters say."""
        file, asked = self._value("course"), self._asked()
        if not is_course(file):
            self._fly(minsnap.plan(minsnap.read_waypoints(file).points, **asked))
            return
        course = minsnap.read_course(file)
        tube = None if course.boxes else course.tube or asked["corridor"]
        flown = course.changed(limits=course.limits or asked["limits"], tube=tube)
        self._fly(minsnap.plan_mission(flown).trajectory)

    def _fly(self, plan: minsnap.Trajectory) -> None:
        self.flown = FlownPlan(plan, None if self._px4 else self._now())
        self._publish()

    def _change(self, goal: Any) -> None:
        if self.flown is None:
            raise minsnap.InputError("nothing was planned yet")
        now = self._now()
        self.flown = self.flown.at(now).changed(goal, now, self._value("budget"), **self._asked())

    def _publish(self, response: Any = None) -> None:
        """Publish what is flown, or what takes over from it; put it into a response too."""
        newest = self.flown.then or self.flown
        samples, frame = newest.trajectory.sample(self._value("rate")), self._value("frame_id")
        nanoseconds = round((self._now() if newest.began is None else newest.began) * 1e9)
        stamp = Time(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
        path = path_message(samples, stamp, frame)
        self._trajectories.publish(trajectory_message(samples, stamp, frame))
        self._paths.publish(path)
        if response is not None:
            response.plan = path

    def take_status(self, status: Any) -> None:
        """Begin the plan when the vehicle comes into offboard mode."""
        if self.flown is not None and self.flown.began is None and status.nav_state == OFFBOARD:
            self.flown = FlownPlan(self.flown.trajectory, self._now())

    def send_setpoint(self) -> None:
        """Send PX4 what is to be flown now."""
        if self.flown is None:
            return
        now = self._now()
        self.flown = self.flown.at(now)
        row = px4_setpoints(self.flown.state(now))[0]
        microseconds = round(now * 1e6)
        self._modes.publish(self._mode(**offboard_control_mode(microseconds)))
        self._setpoints.publish(setpoint_message(self._setpoint(), row, microseconds))


def main() -> None:
    """Run the node until it is interrupted."""
    rclpy.init()
    node = PlannerNode()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
