"""The node, by its topics and services: plans, refusals, changes in flight, setpoints of PX4."""

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import PoseStamped
from minsnap_ros.planner_node import KEPT, PlannerNode
from nav_msgs.msg import Path
from nav_msgs.srv import GetPlan
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger
from trajectory_msgs.msg import MultiDOFJointTrajectory

import minsnap

WAYPOINTS = [(0.0, 0.0, 1.0), (4.0, 0.0, 1.0), (4.0, 3.0, 1.5), (0.0, 3.0, 1.0)]
LIMITS = minsnap.Limits(speed=3.0, acceleration=6.0)


@pytest.fixture
def started():
    """Start nodes; they end with the test."""
    rclpy.init()
    nodes = []

    def start(**values):
        values = {"px4": False} | values
        overrides = [Parameter(name, value=value) for name, value in values.items()]
        nodes.append(PlannerNode(parameter_overrides=overrides))
        return nodes[-1]

    yield start
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown()


def pose(point):
    stamped = PoseStamped()
    stamped.pose.position.x, stamped.pose.position.y, stamped.pose.position.z = point
    return stamped


def path_of(points):
    path = Path()
    path.poses = [pose(point) for point in points]
    return path


def vector(message):
    return [message.x, message.y, message.z]


def test_waypoints_are_planned_and_published_as_the_library_plans_them(started):
    node = started(corridor=0.3, rate=10.0, frame_id="odom")
    other, heard = Node("listener"), []
    waypoints = other.create_publisher(Path, "/planner/waypoints", 1)
    other.create_subscription(MultiDOFJointTrajectory, "/planner/trajectory", heard.append, KEPT)
    other.create_subscription(Path, "/planner/path", heard.append, KEPT)
    for _ in range(300):
        waypoints.publish(path_of(WAYPOINTS))
        rclpy.spin_once(node, timeout_sec=0.05)
        rclpy.spin_once(other, timeout_sec=0.05)
        if {type(message) for message in heard} == {MultiDOFJointTrajectory, Path}:
            break
    other.destroy_node()
    flown = next(message for message in heard if isinstance(message, MultiDOFJointTrajectory))
    shown = next(message for message in heard if isinstance(message, Path))
    expected = minsnap.plan(WAYPOINTS, limits=LIMITS, corridor=0.3).sample(10.0)
    assert flown.header.frame_id == shown.header.frame_id == "odom"
    assert [vector(point.transforms[0].translation) for point in flown.points] == expected.position.tolist()
    assert [vector(point.velocities[0].linear) for point in flown.points] == expected.velocity.tolist()
    assert [vector(stamped.pose.position) for stamped in shown.poses] == expected.position.tolist()
    last = flown.points[-1].time_from_start
    assert last.sec + 1e-9 * last.nanosec == pytest.approx(expected.t[-1], abs=1e-9)


def test_the_course_of_a_file_is_planned_when_the_node_starts_and_when_it_is_asked(started, tmp_path):
    course = tmp_path / "course.csv"
    course.write_text("".join(f"{x},{y},{z}\n" for x, y, z in WAYPOINTS), encoding="utf-8")
    node = started(course=str(course))
    first = node.flown.trajectory
    assert first(first.duration) == pytest.approx(WAYPOINTS[-1])
    course.write_text("0,0,1\n5,0,1\n", encoding="utf-8")
    answer = node.plan_course(Trigger.Request(), Trigger.Response())
    assert answer.success and answer.message == ""
    assert node.flown.trajectory(node.flown.trajectory.duration) == pytest.approx([5.0, 0.0, 1.0])
    course.write_text("0,0,1\n", encoding="utf-8")
    answer = node.plan_course(Trigger.Request(), Trigger.Response())
    assert not answer.success and "at least 2 waypoints" in answer.message
    assert node.flown.trajectory(node.flown.trajectory.duration) == pytest.approx([5.0, 0.0, 1.0])


COURSE = """
{limits}
takeoff: true
waypoints:
- [0, 0, 1]
- {{center: [3, 0, 1.2], heading_deg: 0, width: 1, height: 0.8}}
- {{x: 5, y: 2, z: 1.5, hold: 2}}
- [0, 3, 1]
"""


@pytest.mark.parametrize("limits", ["", "limits: {speed: 2, acceleration: 4}"])
def test_a_course_is_flown_as_its_file_says_and_else_as_the_parameters_do(started, tmp_path, limits):
    file = tmp_path / "course.yaml"
    node = started()
    file.write_text(COURSE.format(limits=limits), encoding="utf-8")
    node.set_parameters([Parameter("course", value=str(file))])
    answer = node.plan_course(Trigger.Request(), Trigger.Response())
    assert answer.success, answer.message
    course = minsnap.read_course(file)
    expected = minsnap.plan_mission(course if limits else course.changed(limits=LIMITS)).trajectory
    assert np.array_equal(node.flown.trajectory.control_points, expected.control_points)
    assert expected(0.0) == pytest.approx([0.0, 0.0, 0.0])
    file.write_text("waypoints: [[0, 0, 1], {hold: 2}]", encoding="utf-8")
    answer = node.plan_course(Trigger.Request(), Trigger.Response())
    assert not answer.success and "course.yaml" in answer.message
    assert np.array_equal(node.flown.trajectory.control_points, expected.control_points)


def test_a_change_in_flight_takes_over_where_the_plan_will_be(started):
    node = started(corridor=0.5, budget=1.0)
    request = GetPlan.Request()
    request.goal = pose((-1.0, 4.0, 2.0))
    assert node.replan(request, GetPlan.Response()).plan.poses == []
    node.take_waypoints(path_of(WAYPOINTS))
    before = node.flown
    answer = node.replan(request, GetPlan.Response())
    after = node.flown.then
    splice = after.began - before.began
    assert vector(answer.plan.poses[-1].pose.position) == pytest.approx([-1.0, 4.0, 2.0])
    for order in range(4):
        assert after.trajectory(0.0, order) == pytest.approx(before.trajectory(splice, order), abs=1e-6)
    assert node.flown.at(after.began - 1e-3).trajectory is before.trajectory
    assert node.flown.at(after.began).trajectory is after.trajectory
    assert minsnap.certify(after.trajectory, limits=LIMITS).ok


@pytest.mark.skipif(not hasattr(Node, "seconds"), reason="the clock is set by hand, and the setpoints are of stand-ins")
def test_setpoints_for_px4_begin_with_the_offboard_mode(started):
    from px4_msgs.msg import VehicleStatus

    node = started(px4=True, rate=50.0)
    sent = []
    node._setpoints.publish = sent.append
    ((period, tick),) = node.timers
    assert period == pytest.approx(0.02)
    tick()
    assert sent == []
    node.take_waypoints(path_of(WAYPOINTS))
    plan = node.flown.trajectory
    for seconds in (1.0, 7.0):
        Node.seconds = seconds
        tick()
        assert sent[-1].position == pytest.approx([0.0, 0.0, -1.0])
    node.take_status(VehicleStatus(nav_state=4))
    assert node.flown.began is None
    node.take_status(VehicleStatus(nav_state=14))
    for later in (0.0, 1.25, plan.duration, plan.duration + 9.0):
        Node.seconds = 7.0 + later
        tick()
        east, north, up = plan(min(later, plan.duration))
        assert sent[-1].position == pytest.approx([north, east, -up], abs=1e-5)
        assert sent[-1].timestamp == round(Node.seconds * 1e6)
        assert np.isfinite(sent[-1].velocity).all()
