"""ULog files written here by the published format, byte by byte, and read through pyulog."""

import numpy as np
import pytest
from ulog_bytes import fields, ulog

import minsnap
from minsnap.errors import FileError
from minsnap.files.autopilot_logs import read_ulog
from minsnap.files.flight_log import flight_log
from minsnap.files.flights import load_flight, load_reference
from minsnap.flight import compare
from minsnap.trajectory.samples import Samples

LOCAL = fields("float", "x y z vx vy vz ax ay az heading")
SETPOINT = fields("float[3]", "position velocity acceleration jerk") + "float yaw;float yawspeed;"
OLD = fields("float", "x y z yaw yawspeed vx vy vz") + "float[3] acceleration;"


def stamps(count, step, start=5_000_000):
    return [start + round(k * step * 1e6) for k in range(count)]


def local_rows(count=200):
    """North 0.5 t, east sin, down -1.5, turning through pi."""
    t = np.arange(count) * 0.02
    columns = [0.5 * t, np.sin(t), -1.5 + 0 * t, 0.5 + 0 * t, np.cos(t), 0 * t, 0 * t, -np.sin(t), 0 * t]
    heading = np.remainder(3.0 + t + np.pi, 2 * np.pi) - np.pi
    return [(s, *row) for s, row in zip(stamps(count, 0.02), np.stack([*columns, heading], 1).tolist(), strict=True)]


def setpoint_rows(count=80):
    t = np.arange(count) * 0.05
    nan = np.full_like(t, np.nan)
    columns = [0.5 * t, np.sin(t), -1.5 + 0 * t, 0.5 + 0 * t, np.cos(t), 0 * t, 0 * t, -np.sin(t), 0 * t, nan, nan, nan]
    columns += [0.25 + 0 * t, 0 * t]
    return [(s, *row) for s, row in zip(stamps(count, 0.05, 5_100_000), np.stack(columns, 1).tolist(), strict=True)]


POSITIONS = ("vehicle_local_position", LOCAL, local_rows())


def old_order(row):
    """Stamp, position, yaw, its rate, and the rest of a row."""
    return (row[0], *row[1:4], row[13], row[14], row[4:])


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "flight.ulg"
    path.write_bytes(ulog([POSITIONS, ("trajectory_setpoint", SETPOINT, setpoint_rows())]))
    return path


def test_positions_and_setpoints_are_on_one_clock_in_the_world(log):
    read = read_ulog(log)
    assert read.damage is None and read.start == 5.0
    assert len(read.flight) == 200 and len(read.reference) == 80
    t = read.flight.t
    np.testing.assert_allclose(t, np.arange(200) * 0.02, atol=1e-9)
    np.testing.assert_allclose(read.flight.position, np.stack([np.sin(t), 0.5 * t, 1.5 + 0 * t], 1), atol=1e-6)
    np.testing.assert_allclose(read.flight.velocity[:, 0], np.cos(t), atol=1e-6)
    np.testing.assert_allclose(read.flight.acceleration[:, 0], -np.sin(t), atol=1e-6)
    np.testing.assert_allclose(read.flight.yaw, read.flight.yaw[0] - t, atol=1e-5)
    assert read.reference.t[0] == pytest.approx(0.1)
    since = read.reference.t - 0.1
    np.testing.assert_allclose(read.reference.position[:, 0], np.sin(since), atol=1e-6)
    np.testing.assert_allclose(read.reference.yaw, np.pi / 2 - 0.25, atol=1e-6)


def test_a_clock_that_begins_again_is_said():
    """One of the two parts was left out without a word."""
    t = np.append(np.arange(200), np.arange(150))
    read = flight_log(None, Samples(t, np.zeros((350, 3))), None)
    assert len(read.flight) == 200 and "the clock of the log goes back: 150 of its rows are left out" in read.damage
    assert flight_log(None, Samples(np.arange(200).repeat(2), np.zeros((400, 3))), None).damage is None


def test_flights_are_loaded_by_their_ending(log):
    assert len(load_flight(log)) == 200
    assert len(load_reference(log)) == 80


def test_setpoints_that_ask_for_no_position_are_left_out(tmp_path):
    rows = [list(row) for row in setpoint_rows()]
    for row in rows[:30]:
        row[1:4] = [np.nan] * 3
    path = tmp_path / "flight.ulg"
    path.write_bytes(ulog([POSITIONS, ("trajectory_setpoint", SETPOINT, rows)]))
    assert len(read_ulog(path).reference) == 50


def test_older_logs_have_the_controllers_setpoints(tmp_path):
    rows = [(stamp, *place, yaw, 0.0, *rest[:6]) for stamp, *place, yaw, _, rest in map(old_order, setpoint_rows())]
    path = tmp_path / "flight.ulg"
    path.write_bytes(ulog([("vehicle_local_position_setpoint", OLD, rows)]))
    read = read_ulog(path)
    assert read.flight is None and len(read.reference) == 80
    np.testing.assert_allclose(read.reference.velocity[:, 1], 0.5, atol=1e-6)
    with pytest.raises(FileError, match="holds no position"):
        load_flight(path)


@pytest.mark.parametrize("share", [0.5, 0.9])
def test_a_log_cut_short_gives_what_there_is_and_says_so(tmp_path, log, share):
    raw = log.read_bytes()
    cut = tmp_path / "cut.ulg"
    cut.write_bytes(raw[: int(share * len(raw)) | 1])
    read = read_ulog(cut)
    assert 50 < len(read.flight) < 200
    assert f"{len(read.flight)} positions and {len(read.reference)} setpoints could be read, up to" in read.damage


def test_a_log_with_a_hole_gives_what_is_around_it(tmp_path, log):
    raw = bytearray(log.read_bytes())
    middle = len(raw) // 2
    raw[middle : middle + 300] = bytes(range(256)) + bytes(44)
    broken = tmp_path / "broken.ulg"
    broken.write_bytes(raw)
    read = read_ulog(broken)
    assert len(read.flight) > 50 and "is damaged; " in read.damage


@pytest.mark.parametrize("content", [b"", b"ULog", b"t,x,y,z\n0,0,0,0\n" * 4, b"\x00" * 100])
def test_what_is_no_ulog_is_named(tmp_path, content):
    path = tmp_path / "flight.ulg"
    path.write_bytes(content)
    with pytest.raises(FileError, match="is no ULog file"):
        read_ulog(path)


def test_a_missing_file_and_one_without_our_topics(tmp_path):
    with pytest.raises(FileError, match="cannot be read: No such file"):
        read_ulog(tmp_path / "none.ulg")
    path = tmp_path / "other.ulg"
    path.write_bytes(ulog([("battery_status", "uint64_t timestamp;float voltage_v;", [(1, 12.0)])]))
    with pytest.raises(FileError, match="holds neither vehicle_local_position nor trajectory_setpoint"):
        read_ulog(path)


def test_a_log_is_compared_with_the_file_that_was_flown(tmp_path, log):
    """The log's vehicle is where the file says, 0.2 m too high; its clock starts with its first position."""
    t = np.arange(80) * 0.05
    wanted = Samples(t, np.stack([np.sin(t), 0.5 * t, np.full(80, 1.3)], 1))
    minsnap.write_csv(wanted, tmp_path / "flown.csv")
    found = compare(load_reference(tmp_path / "flown.csv"), load_flight(log))
    assert found.rmse == pytest.approx([0, 0, 0.2], abs=2e-3)
    assert found.path_rmse == pytest.approx(0.2, abs=2e-3)
