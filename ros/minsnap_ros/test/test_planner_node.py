"""The node, by its topics and services: plans, refusals, changes in flight, setpoints of PX4."""

import re
from pathlib import Path as Pathname

import numpy as np
import pytest
import rclpy
import yaml
from geometry_msgs.msg import PoseStamped
from minsnap_ros import planner_node
from minsnap_ros.messages import px4_topic
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


README = Pathname(__file__).parents[1] / "README.md"


def filled(kind, fields):
    """Return a message with fields of a mapping, as the command line of ROS 2 makes it."""
    message = kind()
    for name, value in fields.items():
        field = getattr(message, name)
        if isinstance(value, dict):
            setattr(message, name, filled(type(field), value))
        elif isinstance(value, list):
            setattr(message, name, [filled(PoseStamped, each) for each in value])
        else:
            assert type(value) is type(field), (name, value)
            setattr(message, name, value)
    return message


def test_the_first_plan_of_the_page_is_flown_as_it_says(started, tmp_path):
    text = README.read_text(encoding="utf-8")
    said = dict(re.findall(r"ros2 (?:topic pub --once|service call) (/planner/\w+) \S+ '(.*)'\n", text))
    rows = re.search(r"printf '(.*)' > course.csv", text)[1].replace("\\n", "\n")
    (tmp_path / "course.csv").write_text(rows, encoding="utf-8")
    node = started(course=str(tmp_path / "course.csv"), corridor=0.3, budget=1.0)
    assert node.flown.trajectory(node.flown.trajectory.duration) == pytest.approx([0.0, 3.0, 1.0])
    node.take_waypoints(filled(Path, yaml.safe_load(said["/planner/waypoints"])))
    assert node.flown.trajectory.legs == 2
    request = filled(GetPlan.Request, yaml.safe_load(said["/planner/replan"]))
    answer = node.replan(request, GetPlan.Response())
    assert vector(answer.plan.poses[-1].pose.position) == pytest.approx([8.0, 5.0, 2.0])
    explored = filled(PoseStamped, yaml.safe_load(said["/planner/explore"]))
    assert vector(explored.pose.position) == [24.0, 0.0, 1.5]
    assert node.plan_course(Trigger.Request(), Trigger.Response()).success


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


def test_a_course_is_changed_within_its_own_limits_and_tube(started, tmp_path):
    file = tmp_path / "course.yaml"
    file.write_text(
        "limits: {speed: 1, acceleration: 2}\ntube: 0.3\nwaypoints: [[0, 0, 1], [6, 0, 1], [6, 6, 1]]\n",
        encoding="utf-8",
    )
    node = started(course=str(file), budget=1.0)
    request = GetPlan.Request()
    request.goal = pose((6.0, 9.0, 1.0))
    assert node.replan(request, GetPlan.Response()).plan.poses
    changed = node.flown.then.trajectory
    assert minsnap.certify(changed, limits=minsnap.Limits(speed=1.0, acceleration=2.0)).ok
    x, y, _ = changed.sample(50.0).position.T
    assert np.minimum(np.abs(y), np.abs(x - 6.0)).max() <= 0.3
    boxes = "boxes: {lower: [[-1, -1, 0], [4, -1, 0]], upper: [[6, 1, 2], [6, 6, 2]]}"
    file.write_text(f"{boxes}\nstart: {{position: [0, 0, 1]}}\nend: {{position: [5, 5, 1]}}\n", encoding="utf-8")
    assert node.plan_course(Trigger.Request(), Trigger.Response()).success
    assert node.replan(request, GetPlan.Response()).plan.poses == []


def test_what_cannot_be_published_is_not_flown(started, tmp_path):
    node = started()
    node.take_waypoints(path_of(WAYPOINTS))
    before = node.flown
    other = path_of(WAYPOINTS)
    other.header.frame_id = "base_link"
    node.take_waypoints(other)
    assert node.flown is before
    node.take_waypoints(path_of(WAYPOINTS))
    assert node.flown is not before
    before = node.flown
    flat = tmp_path / "flat.csv"
    flat.write_text("0,0\n5,0\n5,5\n", encoding="utf-8")
    for values in ({"course": str(flat)}, {"course": ""}, {"rate": -1.0}):
        node.set_parameters([Parameter(name, value=value) for name, value in values.items()])
        assert not node.plan_course(Trigger.Request(), Trigger.Response()).success
        assert node.flown is before
    request = GetPlan.Request()
    request.goal = pose(WAYPOINTS[-1])
    assert node.replan(request, GetPlan.Response()).plan.poses == [] and node.flown is before


def test_topics_of_px4_hold_the_version_of_their_message():
    class TrajectorySetpoint:
        pass

    class VehicleStatus:
        MESSAGE_VERSION = 1

    assert px4_topic("in", TrajectorySetpoint) == "/fmu/in/trajectory_setpoint"
    assert px4_topic("out", VehicleStatus) == "/fmu/out/vehicle_status_v1"


STOOD_IN = pytest.mark.skipif(
    not hasattr(Node, "seconds"), reason="the clock is set by hand, and the setpoints are of stand-ins"
)


def status(nav_state, arming_state):
    from px4_msgs.msg import VehicleStatus

    return VehicleStatus(nav_state=nav_state, arming_state=arming_state)


def position(node, point, **others):
    """Say where the vehicle is, in ENU."""
    from px4_msgs.msg import VehicleLocalPosition

    east, north, up = point
    node.take_position(VehicleLocalPosition(**{"x": north, "y": east, "z": -up} | others))


def begin(node):
    """Let the vehicle follow, and be where the plan begins for long enough."""
    node.take_status(status(14, 2))
    for _ in range(2):
        Node.seconds += 1.1
        position(node, node.flown.trajectory(0.0).tolist())
    assert node.flown.began == pytest.approx(Node.seconds, abs=1e-6)


@STOOD_IN
def test_a_node_that_is_told_to_end_ends_without_a_traceback():
    planner_node.main()


@STOOD_IN
def test_setpoints_slower_than_px4_takes_them_are_refused(started):
    for rate in (0.0, 1.9, float("nan")):
        with pytest.raises(minsnap.InputError, match="below 2 Hz"):
            started(px4=True, rate=rate)


@STOOD_IN
def test_a_plan_begins_when_the_armed_vehicle_is_at_its_start_in_offboard_mode(started):
    node = started(px4=True, rate=50.0)
    sent = []
    node._setpoints.publish = sent.append
    ((period, tick),) = node.timers
    assert period == pytest.approx(0.02)
    for place in ((0.0, 5.0, 0.0), (0.0, 0.3, 0.0)):
        position(node, place)
        tick()
        node.take_waypoints(path_of(WAYPOINTS))
        tick()
        assert [one.position for one in sent] == [] if place[1] > 1.0 else [pytest.approx([0.0, 0.0, -1.0])]
    plan = node.flown.trajectory
    waiting = [
        (status(4, 2), (0.0, 0.0, 1.0), {}),
        (status(14, 1), (0.0, 0.0, 1.0), {}),
        (status(14, 2), (0.0, 0.0, 0.0), {}),
        (status(14, 2), (0.0, 0.0, 1.0), {"vz": -0.5}),
        (status(14, 2), (0.0, 0.0, 1.0), {"xy_valid": False}),
    ]
    for said, place, others in waiting:
        node.take_status(said)
        for _ in range(3):
            Node.seconds += 1.0
            position(node, place, **others)
        tick()
        assert node.flown.began is None and sent[-1].position == pytest.approx([0.0, 0.0, -1.0])
    begin(node)
    began = node.flown.began
    for later in (0.0, 1.25, plan.duration, plan.duration + 9.0):
        Node.seconds = began + later
        tick()
        east, north, up = plan(min(later, plan.duration))
        assert sent[-1].position == pytest.approx([north, east, -up], abs=1e-5)
        assert sent[-1].timestamp == round(Node.seconds * 1e6)
        assert np.isfinite(sent[-1].velocity).all()


@STOOD_IN
@pytest.mark.parametrize("taken", [(2, 2), (14, 1)])
def test_a_plan_that_the_pilot_ended_is_not_flown_again(started, taken):
    node = started(px4=True)
    sent = []
    node._setpoints.publish = sent.append
    node.take_waypoints(path_of(WAYPOINTS))
    begin(node)
    node.take_status(status(*taken))
    for state in ((14, 1), (14, 2)):
        node.take_status(status(*state))
        position(node, WAYPOINTS[0])
        node.send_setpoint()
    assert sent == [] and node.flown is None


@STOOD_IN
def test_a_plan_made_in_flight_begins_where_the_vehicle_is_held(started):
    node = started(px4=True)
    node.take_waypoints(path_of(WAYPOINTS))
    begin(node)
    first = node.flown
    Node.seconds += 1.0
    node.take_waypoints(path_of(WAYPOINTS))
    assert node.flown is first
    Node.seconds += first.trajectory.duration
    node.take_waypoints(path_of(WAYPOINTS))
    assert node.flown is first
    node.take_waypoints(path_of(WAYPOINTS[::-1]))
    assert node.flown is not first
    assert node.flown.trajectory(0.0) == pytest.approx(WAYPOINTS[-1])


@STOOD_IN
def test_a_change_that_comes_after_the_pilot_took_over_is_not_flown(started, monkeypatch):
    node = started(px4=True, budget=1.0)
    node.take_waypoints(path_of(WAYPOINTS))
    begin(node)
    Node.seconds += 1.0
    real = minsnap.replan

    def interrupted(*arguments, **named):
        node.take_status(status(2, 2))
        return real(*arguments, **named)

    monkeypatch.setattr(minsnap, "replan", interrupted)
    request = GetPlan.Request()
    request.goal = pose((-1.0, 4.0, 2.0))
    assert node.replan(request, GetPlan.Response()).plan.poses == [] and node.flown is None


@STOOD_IN
@pytest.mark.parametrize("mode", ["OFFBOARD", "GUIDED"])
def test_mavros_flies_the_plan_of_px4_and_of_ardupilot(started, mode):
    """What is sent is in ENU, as MAVROS takes it, and begins where the armed vehicle is at the plan's start."""
    from mavros_msgs.msg import PositionTarget, State
    from nav_msgs.msg import Odometry

    node = started(mavros=True, rate=50.0, frame_id="map")
    other, sent = Node("mavros"), []
    other.create_subscription(PositionTarget, "/mavros/setpoint_raw/local", sent.append, 1)
    states = other.create_publisher(State, "/mavros/state", 1)
    odometry = other.create_publisher(Odometry, "/mavros/local_position/odom", 1)
    ((period, send),) = node.timers
    assert period == pytest.approx(0.02)

    def at(place, speed=0.0):
        message = Odometry()
        point, velocity = message.pose.pose.position, message.twist.twist.linear
        point.x, point.y, point.z = map(float, place)
        velocity.x = speed
        odometry.publish(message)

    node.take_waypoints(path_of(WAYPOINTS))
    send()
    assert sent == []
    start = node.flown.trajectory(0.0)
    at(start + 3.0)
    send()
    assert sent == [], "it would fly three metres to the start"
    at(start)
    send()
    assert vector(sent[-1].position) == start.tolist()
    states.publish(State(connected=True, armed=True, mode="LOITER"))
    states.publish(State(connected=True, armed=True, mode=mode))
    for _ in range(2):
        Node.seconds += 1.1
        at(start)
    Node.seconds += 2.0
    send()
    plan, last = node.flown.trajectory, sent[-1]
    t = Node.seconds - node.flown.began
    assert (last.coordinate_frame, last.type_mask, last.header.frame_id) == (1, 0, "map")
    assert vector(last.position) == pytest.approx(plan(t))
    assert vector(last.velocity) == pytest.approx(plan(t, 1))
    assert vector(last.acceleration_or_force) == pytest.approx(plan(t, 2))
    assert last.header.stamp.sec + 1e-9 * last.header.stamp.nanosec == pytest.approx(Node.seconds)
    states.publish(State(connected=True, armed=True, mode="LAND"))
    assert node.flown is None, "the pilot took over"


class CopterOverDds:
    """ArduCopter led by velocities: they are reached with a lag, a wind pushes, and poses come thirty a second."""

    STEP, LAG, WIND = 1.0 / 30.0, 0.3, np.array([0.08, -0.05, 0.0])

    def __init__(self, place):
        self.place, self.speed, self.asked, self.yaw, self.turning = (
            np.array(place, dtype=float),
            np.zeros(3),
            None,
            0.4,
            0.0,
        )
        self.node, self.frames = Node("ap"), set()
        self.statuses = self.node.create_publisher(messages_of("Status"), "/ap/status", 1)
        self.poses = self.node.create_publisher(PoseStamped, "/ap/pose/filtered", 1)

    def take(self, message):
        self.frames.add(message.header.frame_id)
        self.asked, self.turning = np.array(vector(message.twist.linear)), message.twist.angular.z

    def fly(self):
        wanted = self.asked if self.asked is not None else np.zeros(3)
        self.speed += (wanted - self.speed) * self.STEP / self.LAG
        self.place += (self.speed + self.WIND) * self.STEP
        self.yaw += self.turning * self.STEP
        Node.seconds += self.STEP
        message = pose(self.place.tolist())
        message.header.stamp.sec, message.header.stamp.nanosec = int(Node.seconds), int(Node.seconds % 1 * 1e9)
        message.pose.orientation.w, message.pose.orientation.z = (
            float(np.cos(self.yaw / 2)),
            float(np.sin(self.yaw / 2)),
        )
        self.poses.publish(message)

    def say(self, mode=4, armed=True):
        self.statuses.publish(messages_of("Status")(vehicle_type=2, armed=armed, mode=mode, external_control=True))


def messages_of(name):
    import ardupilot_msgs.msg

    return getattr(ardupilot_msgs.msg, name)


@STOOD_IN
def test_ardupilot_is_led_along_the_plan_by_velocities_where_it_takes_nothing_else(started, monkeypatch):
    import ardupilot_msgs.msg
    from geometry_msgs.msg import TwistStamped

    monkeypatch.delattr(ardupilot_msgs.msg, "LocalPosition")
    node = started(ardupilot=True, rate=30.0)
    copter = CopterOverDds(np.array(WAYPOINTS[0]) + (0.1, -0.1, -0.4))
    copter.node.create_subscription(TwistStamped, "/ap/cmd_vel", copter.take, 1)
    node.take_waypoints(path_of(WAYPOINTS))
    ((_, send),) = node.timers
    send()
    assert copter.asked is None, "nothing is known of its place"
    copter.say()
    missed = []
    for _ in range(30 * 60):
        copter.fly()
        send()
        if node.flown.began is not None:
            missed.append(np.linalg.norm(copter.place - node.flown.state(Node.seconds).position[0]))
            if node.flown.over(Node.seconds):
                break
    assert node.flown.over(Node.seconds) and copter.frames == {"map"}
    assert max(missed) < 1.1 and missed[-1] < 0.4, "it lags by its speed, 3 m/s, times 0.3 s"
    assert abs(copter.yaw - node.flown.state(Node.seconds).yaw[0]) < 0.05
    copter.say(mode=9)
    assert node.flown is None, "the pilot took over"


@STOOD_IN
def test_ardupilot_is_given_all_of_the_plan_where_it_takes_it(started):
    node = started(ardupilot=True)
    copter, sent = CopterOverDds(WAYPOINTS[0]), []
    copter.WIND = np.zeros(3)
    copter.node.create_subscription(messages_of("LocalPosition"), "/ap/cmd_loc_pose", sent.append, 1)
    node.take_waypoints(path_of(WAYPOINTS))
    copter.say()
    for _ in range(90):
        copter.fly()
    node.send_setpoint()
    plan, t, last = node.flown.trajectory, Node.seconds - node.flown.began, sent[-1]
    assert (last.type_mask, last.header.frame_id) == (0, "map") and t > 0.0
    assert vector(last) == pytest.approx(plan(t))
    assert vector(last.velocity.linear) == pytest.approx(plan(t, 1))
    assert vector(last.acceleration_or_force.linear) == pytest.approx(plan(t, 2))


@STOOD_IN
@pytest.mark.parametrize("wrong", [{"mode": 5}, {"armed": False}])
def test_a_plan_waits_for_guided_and_for_motors(started, wrong):
    node = started(ardupilot=True)
    copter = CopterOverDds(WAYPOINTS[0])
    copter.WIND = np.zeros(3)
    node.take_waypoints(path_of(WAYPOINTS))
    copter.say(**wrong)
    for _ in range(90):
        copter.fly()
    assert node.flown.began is None
