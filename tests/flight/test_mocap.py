"""Poses relayed to a receiver of pymavlink's: the right axes, fresh ones only, from every source."""

import json
import math
import socket
import struct
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
from clocks import SharedClock
from scipy.spatial.transform import Rotation
from standin import mavutil

from minsnap.errors import FileError, InputError, LinkError
from minsnap.files.frames import FRAMES, map_quaternions, map_yaw
from minsnap.flight import mocap
from minsnap.flight.mavlink.link import Clock, open_link
from minsnap.flight.mavlink.setpoints import vehicle_frame
from minsnap.flight.mocap import NatNetSource, Pose, PoseSource, Relay, UdpJsonSource, euler_angles, open_source

Y_UP = ((1.0, 2.0, 3.0), (math.cos(0.2), 0.0, math.sin(0.2), 0.0))
"""At (1, 2, 3) in OptiTrack's axes, turned by 0.4 rad to the left about its upward y."""


class Scripted(PoseSource):
    """Gives the poses of a list, one at a time, stamped with a given age."""

    def __init__(self, clock, count, age=0.0, every=1, pose=Y_UP):
        self._clock, self._left, self._age, self._every, self._pose = clock, count, age, every, pose
        self._given, self._last = 0, None

    def latest(self):
        self._given += 1
        if self._last is None or self._given % self._every == 0:
            self._left -= 1
            self.ended = self._left <= 0
            self._last = Pose(self._clock.now() - self._age, *self._pose)
        return self._last


@pytest.fixture
def receiver():
    link = mavutil.mavlink_connection("udpin:127.0.0.1:0")
    yield link
    link.close()


def relayed(receiver, source, clock, **options):
    link = open_link(f"udpout:127.0.0.1:{receiver.port.getsockname()[1]}", clock)
    try:
        report = Relay(source, link, clock, **options).run()
    finally:
        link.close()
    time.sleep(0.02)
    messages = []
    while (message := receiver.recv_msg()) is not None:
        messages.append(message)
    return report, [m for m in messages if m.get_type() != "HEARTBEAT"]


def test_the_thesis_message_in_its_axes(receiver):
    clock = SharedClock()
    _, messages = relayed(receiver, Scripted(clock, 5), clock, message="mocap")
    message = messages[-1]
    assert message.get_type() == "ATT_POS_MOCAP" and len(messages) == 5
    assert (message.x, message.y, message.z) == (1.0, 3.0, -2.0)
    assert message.q == pytest.approx([math.cos(0.2), 0, 0, -math.sin(0.2)])
    assert math.isnan(message.covariance[0])


def test_vision_has_the_angles_of_the_attitude(receiver):
    clock = SharedClock()
    _, messages = relayed(receiver, Scripted(clock, 2), clock)
    message = messages[-1]
    assert message.get_type() == "VISION_POSITION_ESTIMATE"
    assert (message.x, message.y, message.z) == (1.0, 3.0, -2.0)
    assert (message.roll, message.pitch, message.yaw) == pytest.approx((0, 0, -0.4), abs=1e-7)


def test_odometry_names_its_frames_and_knows_no_velocity(receiver):
    clock = SharedClock()
    _, messages = relayed(receiver, Scripted(clock, 2), clock, message="odometry", frame="enu")
    message = messages[-1]
    assert (message.frame_id, message.child_frame_id) == (1, 12)
    assert (message.x, message.y, message.z) == (2.0, 1.0, -3.0)
    assert math.isnan(message.vx) and message.estimator_type == 2, "vision: PX4's EKF2 fuses it"
    _, messages = relayed(receiver, Scripted(clock, 2), clock, message="odometry-mocap", frame="enu")
    assert messages[-1].estimator_type == 6
    _, messages = relayed(receiver, Scripted(clock, 2), clock, message="odometry", frame="optitrack")
    assert messages[-1].frame_id == 20


def test_angles_are_those_of_scipy_and_survive_a_nose_straight_up():
    for w, x, y, z in Rotation.random(50, random_state=5).as_quat():
        yaw, pitch, roll = Rotation.from_quat([x, y, z, w]).as_euler("ZYX")
        assert euler_angles([w, x, y, z]) == pytest.approx((roll, pitch, yaw), abs=1e-9)
    up = [math.sqrt(0.5), 0.0, math.sqrt(0.5) + 1e-16, 0.0]
    assert euler_angles(up)[1] == pytest.approx(math.pi / 2)


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("yaw", [0.5, -2.5, 7.0])
def test_a_yaw_is_the_heading_that_the_frame_counts(receiver, frame, yaw):
    """A yaw used to turn about the third axis of every frame, which made it a pitch where y points up."""
    clock = SharedClock()
    _, messages = relayed(receiver, Scripted(clock, 2, pose=((1.0, 2.0, 3.0), yaw)), clock, frame=frame)
    message = messages[-1]
    heading = map_yaw(yaw, frame, vehicle_frame(frame))
    assert (message.roll, message.pitch) == pytest.approx((0, 0), abs=1e-7)
    assert math.remainder(message.yaw - heading, math.tau) == pytest.approx(0, abs=1e-6)
    level = Rotation.from_euler("z", float(map_yaw(yaw, frame, "flu"))).as_quat(scalar_first=True)
    turned = Scripted(clock, 2, pose=((1.0, 2.0, 3.0), tuple(map_quaternions(level, "flu", frame))))
    assert relayed(receiver, turned, clock, frame=frame)[1][-1].yaw == pytest.approx(message.yaw, abs=1e-6)


def test_the_rate_is_kept_and_latency_told(receiver):
    clock = SharedClock()
    report, messages = relayed(receiver, Scripted(clock, 100, age=0.01), clock, rate=50.0)
    assert report.sent == len(messages) == 100
    assert report.rate == pytest.approx(50.0, rel=0.01)
    assert report.latency == pytest.approx(0.01) and report.latency_p99 == pytest.approx(0.01)


def test_stale_poses_are_dropped(receiver):
    clock = SharedClock()
    report, messages = relayed(receiver, Scripted(clock, 20, age=0.5), clock, max_age=0.1)
    assert (report.sent, messages, report.stale) == (0, [], 20)


def test_a_pose_that_gets_old_while_it_is_mapped_is_not_sent(receiver, monkeypatch):
    """The first was sent 1.7 s old on a busy machine, which imported what maps it."""
    clock, mapped = SharedClock(), mocap.map_quaternions

    def slowly(*given):
        clock.skip(0.5 * (clock.now() < 1.0))
        return mapped(*given)

    monkeypatch.setattr(mocap, "map_quaternions", slowly)
    report, messages = relayed(receiver, Scripted(clock, 20, age=0.05), clock, max_age=0.1)
    assert (report.sent, len(messages), report.stale) == (19, 19, 1) and report.latency_p99 < 0.1


def test_a_pose_is_sent_once(receiver):
    """A camera at a fifth of the rate: four slots in five have nothing new."""
    clock = SharedClock()
    report, messages = relayed(receiver, Scripted(clock, 10, every=5), clock)
    assert report.sent == len(messages) == 10 and report.stale >= 30


def wait_for(condition, timeout=60.0):
    deadline = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < deadline, "nothing came"
        time.sleep(0.005)


def test_json_over_udp():
    source = UdpJsonSource("127.0.0.1", 0, "drone", Clock())
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def send(data):
        sender.sendto(data if isinstance(data, bytes) else json.dumps(data).encode(), ("127.0.0.1", source.port))

    send({"body": "drone", "position": [1, 2, 3], "quaternion": [2, 0, 0, 0]})
    wait_for(source.latest)
    assert (source.latest().position, source.latest().attitude) == ((1, 2, 3), (1, 0, 0, 0))
    send({"body": "other", "position": [9, 9, 9], "yaw": 0})
    for bad in (b"\xff", b"[]", b"1", {"body": "drone"}, {"body": "drone", "position": [1, 2], "yaw": 0}, b"[" * 5000):
        send(bad)
    send({"body": "drone", "position": [1, 2, float("nan")], "yaw": 0})
    send({"body": "drone", "position": [1, 2, 3], "quaternion": [0, 0, 0, 0]})
    for huge in (10**400, 1e300, 1e7, -float("inf")):
        send({"body": "drone", "position": [1, 2, huge], "yaw": 0})
        send({"body": "drone", "position": [1, 2, 3], "quaternion": [huge, 0, 0, 0]})
    for no_numbers in ("123", {"1": 0, "2": 0, "3": 0}, [True, 2, 3], ["1", "2", "3"]):
        send({"body": "drone", "position": no_numbers, "yaw": 0})
    send({"body": "drone", "position": [4, 5, 6], "yaw": "0.5"})
    wait_for(lambda: source.rejected == 21)
    assert source.latest().position == (1, 2, 3)
    send({"body": "drone", "position": [4, 5, 6], "yaw": math.pi / 2})
    wait_for(lambda: source.latest().position == (4, 5, 6))
    assert source.latest().attitude == pytest.approx(math.pi / 2)
    source.close()
    sender.close()


def test_a_file_is_replayed_in_its_own_time(tmp_path, receiver):
    path = tmp_path / "poses.csv"
    t = np.arange(100) / 50 + 7.0
    rows = "".join(f"{a},{a - 7},0.5,1.5,0.25\n" for a in t)
    path.write_text("t,x,y,z,yaw\n" + rows)
    clock = SharedClock()
    report, messages = relayed(receiver, open_source(f"csv:{path}", None, clock), clock, frame="flu")
    norths = [m.x for m in messages]
    assert 60 <= len(norths) <= 100 and norths == sorted(norths)
    elapsed = np.array([m.usec for m in messages]) * 1e-6
    np.testing.assert_allclose(np.diff(norths), np.diff(elapsed), atol=1e-5)
    assert messages[3].yaw == pytest.approx(-0.25)


@pytest.mark.parametrize(
    ("rows", "wrong"),
    [
        (("0,1,0,0,0", "1,0,0,0,0"), "line 3: an attitude of length 0"),
        (("0,1,0,0,0", "2,1,0,0,0", "1,1,0,0,0"), "line 4: t is before that of the line above"),
    ],
)
def test_a_file_that_cannot_be_replayed_is_refused_when_it_is_opened(tmp_path, rows, wrong):
    """It used to end the relay at the row in question, or to skip rows without a word."""
    path = tmp_path / "poses.csv"
    lines = [f"{row.split(',', 1)[0]},0,0,0,{row.split(',', 1)[1]}\n" for row in rows]
    path.write_text("t,x,y,z,qw,qx,qy,qz\n" + "".join(lines))
    with pytest.raises(FileError, match=wrong):
        open_source(f"csv:{path}", None, Clock())


def test_a_file_without_an_attitude(tmp_path):
    path = tmp_path / "poses.csv"
    path.write_text("t,x,y,z\n0,0,0,0\n")
    with pytest.raises(FileError, match="no column yaw, nor qw,qx,qy,qz"):
        open_source(f"csv:{path}", None, Clock())


def quiet(kind, body):
    """A source without its port and thread."""
    source = kind.__new__(kind)
    source._body, source._clock = body, Clock()
    return source


def test_a_relay_without_a_body_keeps_to_the_first_of_which_a_pose_comes():
    """Poses of all bodies used to be passed on in turn, and those of another one when the first was lost."""
    source = quiet(UdpJsonSource, None)
    for body, x in (("a", "?"), ("b", 1), ("a", 2), (7, 3), ("b", 4), (None, 5)):
        source._take(json.dumps({"body": body, "position": [x, 0, 0], "yaw": 0}).encode())
    assert source.latest().position == (4.0, 0.0, 0.0)
    motive = quiet(NatNetSource, None)
    for tracked in ((False, True, True), (True, False, True), (True, True, True)):
        bodies = [
            SimpleNamespace(id_num=k, pos=(k, 0, 0), rot=(0, 0, 0, 1), tracking_valid=v) for k, v in enumerate(tracked)
        ]
        motive._take(SimpleNamespace(rigid_bodies=bodies))
        assert motive.latest().position == (1.0, 0.0, 0.0)


@pytest.mark.parametrize("body", [5, 5.0, "5"])
def test_a_number_is_the_name_of_a_body_too(body):
    """No pose of a body named by a number used to be taken, and none was counted as rejected."""
    source = quiet(UdpJsonSource, "5")
    source._take(json.dumps({"body": body, "position": [1, 2, 3], "yaw": 0}).encode())
    assert source.latest().position == (1.0, 2.0, 3.0)


class Motive(threading.Thread):
    """A NatNet 3.0 server as its manual describes the packets: answers a ping, then streams rigid bodies."""

    def __init__(self, bodies):
        super().__init__(daemon=True)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(0.02)
        self.port = self.socket.getsockname()[1]
        self.frame = self._frame(bodies)
        self.running = True

    @staticmethod
    def _packet(number, payload):
        return struct.pack("<HH", number, len(payload)) + payload

    def _frame(self, bodies):
        body = b"".join(struct.pack("<I3f4ffH", n, *place, *turn, 0.001, valid) for n, place, turn, valid in bodies)
        counts = struct.pack("<IIII", 7, 0, 0, len(bodies)) + body + struct.pack("<IIII", 0, 0, 0, 0)
        return self._packet(7, counts + struct.pack("<IIdQQQH", 0, 0, 1.5, 1, 2, 3, 0))

    def run(self):
        client = None
        while self.running:
            try:
                data, client = self.socket.recvfrom(1000)
                if data[:2] == b"\0\0":
                    name = b"Motive".ljust(256, b"\0")
                    self.socket.sendto(self._packet(1, name + bytes([3, 1, 0, 0, 3, 0, 0, 0])), client)
                    continue
            except OSError:
                pass
            if client:
                self.socket.sendto(self.frame, client)
        self.socket.close()


@pytest.mark.slow
def test_natnet_through_its_client(receiver):
    turn = (0.0, math.sin(0.2), 0.0, math.cos(0.2))
    motive = Motive([(4, (9.0, 9.0, 9.0), turn, 1), (5, (1.0, 2.0, 3.0), turn, 1), (6, (0.0, 0.0, 0.0), turn, 0)])
    motive.start()
    source = NatNetSource("127.0.0.1", "127.0.0.1", "5", False, Clock(), motive.port)
    wait_for(source.latest)
    pose = source.latest()
    assert pose.position == (1.0, 2.0, 3.0)
    assert pose.attitude == pytest.approx(Y_UP[1], abs=1e-7)
    source.close()
    lost = NatNetSource("127.0.0.1", "127.0.0.1", "6", False, Clock(), motive.port)
    wait_for(lambda: lost.rejected)
    assert lost.latest() is None
    lost.close()
    motive.running = False
    motive.join()


@pytest.mark.slow
def test_nobody_at_natnet():
    with pytest.raises(LinkError, match=r"no NatNet server answers at 127\.0\.0\.1"):
        NatNetSource("127.0.0.1", "127.0.0.1", None, False, Clock(), 9)


@pytest.mark.parametrize("text", ["natnet:", "udp:here", "csv:", "vrpn:tracker"])
def test_sources_that_do_not_exist(text):
    with pytest.raises(LinkError, match="cannot understand the source"):
        open_source(text, None, Clock())


@pytest.mark.parametrize("options", [{"message": "smoke"}, {"max_age": 0.0}])
def test_bad_relays(receiver, options):
    clock = Clock()
    with pytest.raises(InputError):
        relayed(receiver, Scripted(clock, 1), clock, **options)
