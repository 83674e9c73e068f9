"""Flights of the node through what a sensor sees: clouds in, plans around what they show out, a stop without them."""

import struct

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import PoseStamped
from minsnap_ros.explored_flight import points_of, turned
from minsnap_ros.planner_node import PlannerNode
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import PointCloud2, PointField

import minsnap

STOOD_IN = pytest.mark.skipif(not hasattr(Node, "seconds"), reason="the clock is set by hand")
START, GOAL = np.array([0.0, 0.0, 1.5]), np.array([7.0, 0.0, 1.5])
POST = np.array([3.0, 0.0])


@pytest.fixture
def node():
    rclpy.init()
    values = {"px4": False, "sensing": 5.0, "max_speed": 1.5, "resolution": 0.3, "lost": 1.0}
    made = PlannerNode(parameter_overrides=[Parameter(name, value=value) for name, value in values.items()])
    yield made
    made.destroy_node()
    rclpy.try_shutdown()


def pose(point, quaternion=(0.0, 0.0, 0.0, 1.0)):
    stamped = PoseStamped()
    stamped.pose.position.x, stamped.pose.position.y, stamped.pose.position.z = map(float, point)
    for axis, value in zip("xyzw", quaternion, strict=True):
        setattr(stamped.pose.orientation, axis, value)
    return stamped


def cloud(points, frame="", big=False, kind="f", **other):
    """A cloud whose points have an intensity before their coordinates, and some bytes behind them."""
    size = struct.calcsize(kind)
    fields = [("intensity", 0), ("x", 4), ("y", 4 + size), ("z", 4 + 2 * size)]
    data = b"".join(struct.pack((">" if big else "<") + f"f3{kind}2x", 1.0, *point) for point in points)
    step = 6 + 3 * size
    made = PointCloud2(height=1, width=len(points), is_bigendian=big, point_step=step, row_step=step * len(points))
    types = {"intensity": 7, "x": 7 if kind == "f" else 8}
    types |= {"y": types["x"], "z": types["x"]}
    made.fields = [PointField(name=name, offset=at, datatype=types[name], count=1) for name, at in fields]
    made.data, made.header.frame_id = data, frame
    for name, value in other.items():
        setattr(made, name, value)
    return made


def scan(place):
    """Points of a post and its room: a wall of rays that meet nothing is told by points far away."""
    angle = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    rays = np.concatenate(
        [np.stack((np.cos(angle), np.sin(angle), np.full(200, rise)), axis=1) for rise in np.linspace(-0.5, 0.5, 41)]
    )
    to = POST - place[:2]
    along = rays[:, :2] @ to
    inside = 0.3**2 - to @ to + along**2
    far = np.where((inside >= 0.0) & (along > 0.0), along - np.sqrt(np.maximum(inside, 0.0)), 50.0)
    return place + far[:, None] * rays


@pytest.mark.parametrize(("big", "kind"), [(False, "f"), (True, "f"), (False, "d")])
def test_the_points_of_a_cloud_are_read_by_their_fields_and_those_not_finite_left_out(big, kind):
    points = np.array([(1.0, 2.0, 3.0), (np.nan, 0.0, 0.0), (4.5, -5.25, 6.0)])
    assert points_of(cloud(points, big=big, kind=kind)).tolist() == points[[0, 2]].tolist()
    assert points_of(cloud([])).shape == (0, 3)


@pytest.mark.parametrize("wrong", [{"fields": []}, {"data": b"\0" * 10}, {"point_step": 8}, {"height": 3}])
def test_a_cloud_that_does_not_hold_its_points_is_refused(wrong):
    with pytest.raises(minsnap.InputError, match="the cloud has"):
        points_of(cloud(np.ones((4, 3)), **wrong))


def test_points_in_a_sensor_s_axes_are_turned_by_its_pose():
    half = np.sqrt(0.5)
    upright = turned(np.array([(1.0, 0.0, 0.0)]), pose((1.0, 2.0, 3.0), (0.0, 0.0, half, half)).pose)
    np.testing.assert_allclose(upright, [(1.0, 3.0, 3.0)], atol=1e-12)
    with pytest.raises(minsnap.InputError, match="quaternion is zero"):
        turned(np.ones((1, 3)), pose((0, 0, 0), (0.0, 0.0, 0.0, 0.0)).pose)


@STOOD_IN
def test_a_goal_is_flown_to_around_what_clouds_show_and_without_them_the_stop(node):
    node.take_points(cloud(scan(START)))
    assert "no goal" in node.errors[-1]
    node.take_goal(pose(GOAL))
    assert "where the sensor is" in node.errors[-1] and node.exploration is None
    node.take_sensor(pose(START))
    node.take_goal(pose(GOAL))
    count, places = len(node.errors), []
    Node.seconds += 0.5
    for step in range(150):
        if node.exploration is None:
            break
        now = node.flown.at(Node.seconds)
        place = now.state(Node.seconds).position[0]
        places.append(place)
        node.take_sensor(pose(place))
        if step != 8:
            node.take_points(cloud(scan(place)))
        else:  # the sensor is lost, and comes back
            Node.seconds += 1.1
            node.watch_sensor()
            assert "nothing was observed for 1 s" in node.errors[-1]
            stop = node.flown.then or node.flown
            assert np.linalg.norm(stop.trajectory(stop.trajectory.duration, 1)) < 1e-9
            Node.seconds += stop.trajectory.duration + 1.0
            count += 1
        Node.seconds += 0.25
    assert node.exploration is None and len(node.errors) == count, node.errors
    np.testing.assert_allclose(places[-1], GOAL, atol=1e-6)
    assert (np.linalg.norm(np.array(places)[:, :2] - POST, axis=1) - 0.3).min() > 0.2


@STOOD_IN
def test_a_cloud_in_other_axes_needs_the_pose_of_the_sensor(node):
    node._vehicle.position = START
    node.take_goal(pose(GOAL))
    node.take_points(cloud(scan(START), frame="lidar"))
    assert "positions in lidar, and plans in map" in node.errors[-1]
    node.take_sensor(pose(START))
    node.take_points(cloud(scan(START) - START, frame="lidar"))
    assert len(node.errors) == 1 and node.exploration._explorer.known.states.size
