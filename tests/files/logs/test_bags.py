"""Bags of ROS 2: a recorded one (tests/recorded/led.mcap, written by rosbags 0.11.9) and its messages stored otherwise.

It holds the flight of led.ulg five times a second, as MAVROS and as PX4's bridge tell it; PX4's stamps are since boot.
"""

import sqlite3
from contextlib import closing

import numpy as np
import pytest
import zstandard
from bag_files import BAG, TOPICS, mcap_bag, sqlite_bag

from minsnap.errors import FileError
from minsnap.files.bags.bag_log import KINDS, read_bag
from minsnap.files.bags.usual_definitions import DEFINITIONS
from minsnap.files.flights import load_flight, read_log

LOG = read_log(BAG.with_suffix(".ulg"))
PLACES = {
    "/mavros/local_position/odom": "nav_msgs/msg/Odometry",
    "/mavros/local_position/pose": "geometry_msgs/msg/PoseStamped",
    "/fmu/out/vehicle_local_position": "px4_msgs/msg/VehicleLocalPosition",
    "/fmu/out/vehicle_odometry": "px4_msgs/msg/VehicleOdometry",
}
ASKED = {
    "/mavros/setpoint_raw/local": "mavros_msgs/msg/PositionTarget",
    "/fmu/in/trajectory_setpoint": "px4_msgs/msg/TrajectorySetpoint",
}


@pytest.mark.parametrize("place", PLACES)
def test_every_type_of_position_tells_the_flight(place):
    assert TOPICS[place].kind == PLACES[place]
    log = read_bag(BAG, place, "/mavros/setpoint_raw/local")
    assert np.allclose(log.flight.position, LOG.flight.position[::2], atol=1e-6)
    if log.flight.velocity is not None:  # in ENU, whether the message has it in the world or in the body
        assert np.allclose(log.flight.velocity, LOG.flight.velocity[::2], atol=1e-6)
    assert np.allclose(log.flight.yaw, 0.0, atol=1e-6)
    assert (log.flight.velocity is None) == place.endswith("pose")


@pytest.mark.parametrize("asked", ASKED)
def test_every_type_of_setpoint_tells_what_was_sent(asked):
    log = read_bag(BAG, "/mavros/local_position/odom", asked)
    for name in ("position", "velocity", "acceleration"):
        assert np.allclose(getattr(log.reference, name), getattr(LOG.reference, name), atol=1e-6), name
    lag = log.reference.t[0] - log.flight.t[0] - (LOG.reference.t[0] - LOG.flight.t[0])
    assert abs(lag) < 1e-6  # both by their stamps, and not late by what they took to arrive


def test_stamps_of_a_clock_of_its_own_are_left_out_for_when_messages_came():
    log = read_bag(BAG, "/fmu/out/vehicle_local_position", "/fmu/in/trajectory_setpoint")
    received = np.array([stamp for stamp, _ in TOPICS["/fmu/out/vehicle_local_position"].rows])
    assert np.allclose(np.diff(log.flight.t), np.diff(received) * 1e-9, atol=1e-9)


def test_topics_are_chosen_where_there_are_several():
    with pytest.raises(FileError, match="several topics with setpoints: choose one with --setpoints: .*TrajectorySetp"):
        read_bag(BAG)
    with pytest.raises(FileError, match="several topics with positions: choose one with --topic: .*odom .Odometry"):
        read_bag(BAG, setpoints="/mavros/setpoint_raw/local")
    with pytest.raises(FileError, match="no messages of positions on '/odom': its topics of them are /fmu/in"):
        read_bag(BAG, "/odom", "/mavros/setpoint_raw/local")
    poses = read_bag(BAG, "/mavros/local_position/odom", "/mavros/local_position/pose")
    assert np.allclose(poses.reference.position, poses.flight.position)


@pytest.mark.parametrize("place", PLACES)
def test_a_bag_in_sqlite_without_definitions_holds_the_same(place, tmp_path):
    known = read_bag(BAG, place, "/fmu/in/trajectory_setpoint")
    read = read_bag(sqlite_bag(tmp_path / "led_0.db3", [place, "/fmu/in/trajectory_setpoint"]))
    assert np.array_equal(read.flight.position, known.flight.position)
    assert np.array_equal(read.reference.acceleration, known.reference.acceleration)
    assert np.array_equal(read.flight.t, known.flight.t)


def test_a_folder_and_messages_that_are_compressed_each(tmp_path):
    names = ["/mavros/local_position/odom", "/mavros/setpoint_raw/local"]
    folder = tmp_path / "rosbag2_2026"
    folder.mkdir()
    for number, name in enumerate(names):  # a topic split over files is one topic
        sqlite_bag(folder / f"rosbag2_2026_{number}.db3", [name], zstandard.ZstdCompressor().compress)
    (folder / "metadata.yaml").write_text("rosbag2_bagfile_information: {version: 8}\n")
    assert np.array_equal(read_bag(folder).flight.position, read_bag(BAG, *names).flight.position)
    assert len(load_flight(folder)) == len(LOG.flight.t[::2])


def test_compressed_bags_are_read_or_say_what_they_need(tmp_path, monkeypatch):
    name = "/mavros/local_position/odom"
    whole = mcap_bag(tmp_path / "a.mcap", name, "zstd", zstandard.ZstdCompressor().compress)
    assert len(read_bag(whole).flight) == len(LOG.flight.t[::2])
    monkeypatch.setitem(__import__("sys").modules, "lz4.frame", None)
    with pytest.raises(ImportError, match="is compressed, and reading it needs lz4: pip install 'minsnap.bags"):
        read_bag(mcap_bag(tmp_path / "b.mcap", name, "lz4"))
    with pytest.raises(FileError, match="is compressed by 'brotli', which is not known"):
        read_bag(mcap_bag(tmp_path / "c.mcap", name, "brotli"))
    (tmp_path / "d").mkdir()
    (tmp_path / "d" / "d_0.db3.zstd").write_bytes(b"")
    with pytest.raises(FileError, match="compressed as a whole: unpack it first"):
        read_bag(tmp_path / "d")


def test_a_bag_packed_by_lz4(tmp_path):
    frame = pytest.importorskip("lz4.frame")
    bag = mcap_bag(tmp_path / "a.mcap", "/mavros/local_position/odom", "lz4", frame.compress)
    assert len(read_bag(bag).flight) == len(LOG.flight.t[::2])


def test_damaged_bags(tmp_path):
    name = "/mavros/local_position/odom"
    killed = read_bag(mcap_bag(tmp_path / "killed.mcap", name, end=False))
    assert "as when its recorder was killed; 101 positions" in killed.damage
    with pytest.raises(FileError, match="a part of it has another checksum"):
        read_bag(mcap_bag(tmp_path / "sum.mcap", name, checksum=5))
    whole = BAG.read_bytes()
    for size in (0, 3, 8, 60, 400, 5000, len(whole) // 2):
        (tmp_path / "cut.mcap").write_bytes(whole[:size])
        with pytest.raises(FileError):
            read_bag(tmp_path / "cut.mcap")
    (tmp_path / "no.db3").write_bytes(b"SQLite format 3\0 or not")
    with pytest.raises(FileError, match="is no bag in SQLite"):
        read_bag(tmp_path / "no.db3")
    with pytest.raises(FileError, match="cannot be read"):
        read_bag(tmp_path / "missing.db3")
    empty = sqlite_bag(tmp_path / "empty.db3", [])
    with pytest.raises(FileError, match="no topic with positions of a type that is known: it has no topic"):
        read_bag(empty)


@pytest.mark.parametrize("name", [*PLACES, *ASKED])
def test_messages_that_are_cut_or_of_another_encoding_are_refused(name, tmp_path):
    for pack in (lambda raw: raw[: len(raw) // 3], lambda raw: b"\0\3" + raw[2:]):
        bag = sqlite_bag(tmp_path / "cut.db3", [name], pack)
        with pytest.raises(FileError, match="does not fit its definition|is not in CDR"):
            read_bag(bag, name)
        bag.unlink()


def test_definitions_are_there_for_every_type_that_is_read():
    assert set(DEFINITIONS) == set(KINDS)


def test_a_bag_is_compared_by_the_command(tmp_path, call):
    bag = sqlite_bag(tmp_path / "led.db3", ["/fmu/out/vehicle_local_position", "/fmu/in/trajectory_setpoint"])
    out = call("compare", str(BAG.with_suffix(".json")), str(bag)).stdout
    assert "led.db3" in out and float(out.splitlines()[-1].split()[4]) == pytest.approx(0.92, abs=0.01)
    asked = call("compare", str(BAG.with_suffix(".json")), str(BAG.with_suffix(".ulg")), "--topic", "/odom")
    assert asked.returncode == 2 and "choose topics of a bag of ROS 2, and none is given" in asked.stderr


@pytest.mark.parametrize("change", ["topics SET name = NULL", "topics SET type = x'03'", "messages SET timestamp = ''"])
def test_a_table_with_values_of_another_type_is_refused(tmp_path, change):
    """SQLite keeps any value in any column."""
    bag = sqlite_bag(tmp_path / "a.db3", ["/mavros/local_position/odom"])
    with closing(sqlite3.connect(bag)) as base, base:
        base.execute(f"UPDATE {change}")
    with pytest.raises(FileError, match="is not a bag"):
        read_bag(bag)
