"""Formats of other programs: read back exactly, and read as those programs read them."""

import json
import math
import struct

import numpy as np
import pytest
import yaml

import minsnap
from minsnap.errors import FileError, FrameError, YawError
from minsnap.files.crazyflie import read_crazyflie, write_crazyflie
from minsnap.files.mav_yaml import read_mav_yaml, write_mav_yaml
from minsnap.files.multidof import multidof, write_multidof
from minsnap.files.npz import read_npz, write_npz
from minsnap.files.px4 import offboard_control_mode, px4_setpoints, write_px4
from minsnap.files.tables import from_dataframe, read_parquet, to_dataframe, write_parquet
from minsnap.samples import Samples
from minsnap.trajectory import Trajectory
from minsnap.yaw import PlannedHeading


def curve(pieces=4, degree=7, dim=3, seed=1, turning=True):
    """Random pieces, joined in position; a planned heading that turns more than once round."""
    rng = np.random.default_rng(seed)
    durations = rng.uniform(0.5, 3.0, pieces)
    points = rng.normal(size=(pieces, degree + 1, dim))
    points[1:, 0] = points[:-1, -1]
    if not turning:
        return Trajectory(points, durations)
    angles = np.cumsum(rng.uniform(0, 0.5, pieces * (degree + 1))).reshape(pieces, degree + 1, 1)
    angles[1:, 0] = angles[:-1, -1]
    return Trajectory(points, durations, PlannedHeading(Trajectory(angles, durations)))


def same(first, second, tolerance=1e-9):
    t = np.linspace(0, min(first.duration, second.duration), 333)
    for order in (0, 1, 2):
        np.testing.assert_allclose(first(t, order), second(t, order), atol=tolerance * 50**order)
    np.testing.assert_allclose(first.yaw(t), second.yaw(t), atol=tolerance)


def as_crazyswarm_reads(path):
    """The reader of uav_trajectories and crazyswarm2: by position, never by name."""
    return np.loadtxt(path, delimiter=",", skiprows=1, usecols=range(33))


def test_crazyflie_pieces_evaluate_to_the_trajectory(tmp_path):
    trajectory, path = curve(), tmp_path / "cf.csv"
    write_crazyflie(trajectory, path)
    start = 0.0
    for row in as_crazyswarm_reads(path):
        for share in (0.0, 0.3, 1.0):
            local = share * row[0]
            now = min(start + local, trajectory.duration) if share < 1 else start + local
            if share == 1.0:
                now = min(now, trajectory.duration) - 1e-12
            values = [np.polyval(row[1 + 8 * k : 9 + 8 * k][::-1], local) for k in range(4)]
            np.testing.assert_allclose(values[:3], trajectory(now), atol=1e-9)
            np.testing.assert_allclose(values[3], trajectory.yaw(now), atol=1e-9)
        start += row[0]
    assert path.read_text().startswith("duration,x^0,x^1,") and path.read_text().splitlines()[0].count(",") == 32


def test_crazyflie_files_read_back_exactly(tmp_path):
    first, second = tmp_path / "a.csv", tmp_path / "b.csv"
    trajectory = curve()
    write_crazyflie(trajectory, first)
    back = read_crazyflie(first)
    same(trajectory, back)
    assert np.array_equal(back.durations, trajectory.durations)
    write_crazyflie(back, second)
    np.testing.assert_allclose(as_crazyswarm_reads(second), as_crazyswarm_reads(first), rtol=1e-9, atol=1e-9)


def test_a_planned_rectangle_survives_the_firmwares_float32(tmp_path):
    plan = minsnap.rectangle(width=6, length=4)
    path = tmp_path / "rect.csv"
    write_crazyflie(plan, path)
    rows = as_crazyswarm_reads(path)
    packed = b"".join(struct.pack("<33f", *row[1:], row[0]) for row in rows)
    assert len(packed) == 132 * len(rows) <= 4096
    single = np.frombuffer(packed, "<f4").reshape(-1, 33)
    for row, rough in zip(rows, single, strict=True):
        for k in range(3):
            exact = np.polyval(row[1 + 8 * k : 9 + 8 * k][::-1], row[0])
            assert np.polyval(rough[8 * k : 8 * k + 8][::-1], rough[32]) == pytest.approx(exact, abs=1e-3)


def test_a_lone_piece_becomes_two_rows(tmp_path):
    trajectory, path = curve(1), tmp_path / "cf.csv"
    write_crazyflie(trajectory, path)
    assert as_crazyswarm_reads(path).shape == (2, 33)
    same(trajectory, read_crazyflie(path))


def test_lower_degrees_and_constant_headings_fit(tmp_path):
    trajectory, path = curve(3, degree=5, turning=False), tmp_path / "cf.csv"
    write_crazyflie(trajectory, path)
    same(trajectory, read_crazyflie(path))
    assert "ConstantHeading" in repr(read_crazyflie(path).yaw)


def test_a_trailing_comma_as_in_crazyswarm2_is_read(tmp_path):
    path = tmp_path / "cf.csv"
    row = ",".join(["2.0", "1.5"] + ["0"] * 31)
    path.write_text("Duration,whatever\n" + f"{row},\n{row}\n")
    assert read_crazyflie(path)(3.0).tolist() == [1.5, 0, 0]


def test_what_a_crazyflie_cannot_hold(tmp_path):
    path = tmp_path / "cf.csv"
    with pytest.raises(FileError, match="32 pieces do not fit the Crazyflie's memory of 31"):
        write_crazyflie(curve(32), path)
    write_crazyflie(curve(32), path, max_pieces=None)
    assert len(read_crazyflie(path).durations) == 32
    with pytest.raises(FileError, match="degree 9, and this format holds 7"):
        write_crazyflie(curve(2, degree=9), path)
    with pytest.raises(FileError, match="3 coordinates, and the trajectory has 2"):
        write_crazyflie(curve(2, dim=2), path)
    sharp = Trajectory(curve(2).control_points, [1, 1], lambda t, order=0: np.sin(60 * np.asarray(t)))
    with pytest.raises(YawError, match="the heading of piece . is .* rad from any polynomial of degree 7"):
        write_crazyflie(sharp, path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("duration\n", "has no pieces"),
        ("duration\n1,2,3\n", "line 2: 3 numbers, but a piece has 33"),
        ("duration\n" + ",".join(["x"] * 33) + "\n", "line 2: not all of its cells are numbers"),
        ("duration\n" + ",".join(["0"] * 33) + "\n", "line 2: a duration must be positive"),
        ("duration\n" + ",".join(["1"] * 32 + ["nan"]) + "\n", "line 2: .* every coefficient finite"),
    ],
)
def test_bad_crazyflie_files(tmp_path, text, said):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(FileError, match=said):
        read_crazyflie(path)


@pytest.mark.parametrize("degree", [5, 7, 9])
def test_segments_are_plain_yaml_and_read_back(tmp_path, degree):
    trajectory, path = curve(3, degree), tmp_path / "t.yaml"
    write_mav_yaml(trajectory, path)
    said = yaml.safe_load(path.read_text())["segments"]
    assert [(s["N"], s["D"], type(s["time"])) for s in said] == [(degree + 1, 4, int)] * 3
    seconds = said[0]["time"] * 1e-9
    y = np.polyval(said[0]["coefficients"][1][::-1], seconds / 2)
    assert y == pytest.approx(trajectory(seconds / 2)[1], abs=1e-8)
    same(trajectory, read_mav_yaml(path), 1e-7)


def test_segments_without_yaw_have_three_dimensions(tmp_path):
    path = tmp_path / "t.yaml"
    write_mav_yaml(curve(2, turning=False), path)
    assert yaml.safe_load(path.read_text())["segments"][0]["D"] == 3
    same(curve(2, turning=False), read_mav_yaml(path), 1e-7)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("segments: []", "has no segments"),
        ("- 1", "has no segments"),
        ("segments: [{N: 2, D: 1}]", "segment 0: it needs numbers N, D, time"),
        ("segments: [{N: 3, D: 1, time: 5, coefficients: [[1, 2]]}]", r"segment 0: D and N are 1 and 3, .* \(1, 2\)"),
        ("segments: [{N: 2, D: 1, time: 0, coefficients: [[1, 2]]}]", "its time must be positive"),
        ("segments: [{N: 2, D: 1, time: 1, coefficients: [[1, .nan]]}]", "every coefficient finite"),
        ("segments: [{N: 2, D: 1, time: 1, coefficients: !!python/object:os.system [[1]]}]", "line 1"),
    ],
)
def test_bad_segments(tmp_path, text, said):
    path = tmp_path / "bad.yaml"
    path.write_text(text)
    with pytest.raises(FileError, match=said):
        read_mav_yaml(path)


def samples():
    return minsnap.circle(radius=2.0).sample(20.0)


def test_px4_messages_are_in_ned_and_float32(tmp_path):
    given = samples()
    write_px4(given, tmp_path / "sp.npy")
    messages = np.load(tmp_path / "sp.npy", allow_pickle=False)
    assert messages.dtype.names == ("timestamp", "position", "velocity", "acceleration", "jerk", "yaw", "yawspeed")
    assert np.array_equal(messages["position"], given.position[:, [1, 0, 2]].astype("f4") * np.float32([1, 1, -1]))
    assert np.array_equal(messages["jerk"][:, 2], -given.jerk[:, 2].astype("f4"))
    assert messages["timestamp"][:3].tolist() == [0, 50_000, 100_000]
    assert np.abs(messages["yaw"]).max() <= np.float32(np.pi)


def test_px4_fields_that_are_not_there_are_not_controlled():
    bare = px4_setpoints(Samples(samples().t, samples().position))
    assert np.isnan(bare["velocity"]).all() and np.isnan(bare["yaw"]).all()
    assert offboard_control_mode(5) == {
        "timestamp": 5,
        "position": True,
        **dict.fromkeys(
            ["velocity", "acceleration", "attitude", "body_rate", "thrust_and_torque", "direct_actuator"], False
        ),
    }
    with pytest.raises(FrameError):
        px4_setpoints(Samples(samples().t, samples().position[:, :2]))


def test_multidof_points_have_one_element_an_array(tmp_path):
    given = samples()
    write_multidof(given, tmp_path / "m.json")
    said = json.loads((tmp_path / "m.json").read_text())
    assert said == multidof(given) and said["header"]["frame_id"] == "map"
    point = said["points"][21]
    assert point["time_from_start"] == {"sec": 1, "nanosec": 50_000_000}
    assert [point["velocities"][0]["linear"][axis] for axis in "xyz"] == given.velocity[21].tolist()
    turn = point["transforms"][0]["rotation"]
    assert 2 * math.atan2(turn["z"], turn["w"]) == pytest.approx(float(given.yaw[21]))
    bare = multidof(Samples(given.t, given.position))["points"][0]
    assert bare["velocities"] == bare["accelerations"] == []


@pytest.mark.parametrize("turning", [True, False])
def test_archives_keep_trajectories_to_the_last_bit(tmp_path, turning):
    path = tmp_path / "t.npz"
    write_npz(curve(turning=turning), path)
    back = read_npz(path)
    assert np.array_equal(back.control_points, curve().control_points)
    t = np.linspace(0, back.duration, 50)
    assert np.array_equal(back.yaw(t), curve(turning=turning).yaw(t))


def test_archives_keep_samples_to_the_last_bit(tmp_path):
    path = tmp_path / "s.npz"
    write_npz(samples(), path)
    back = read_npz(path)
    for name in ("t", "position", "snap", "yaw_rate"):
        assert np.array_equal(getattr(back, name), getattr(samples(), name))


def test_archives_never_unpickle(tmp_path):
    path = tmp_path / "evil.npz"
    np.savez(path, t=np.array([{}], dtype=object))
    with pytest.raises(FileError, match="is not a NumPy archive of numbers"):
        read_npz(path)
    path.write_bytes(b"no")
    with pytest.raises(FileError, match="is not a NumPy archive"):
        read_npz(path)
    np.savez(path, x=np.zeros(3))
    with pytest.raises(FileError, match="neither a trajectory"):
        read_npz(path)
    np.save(tmp_path / "lone.npy", np.zeros(3))
    (tmp_path / "lone.npy").rename(path)
    with pytest.raises(FileError, match="is not a NumPy archive"):
        read_npz(path)


@pytest.mark.parametrize("frame", ["enu", "ned"])
def test_tables_name_their_frame_and_come_back(tmp_path, frame):
    path = tmp_path / "t.parquet"
    write_parquet(samples(), path, frame)
    back = read_parquet(path)
    np.testing.assert_allclose(back.position, samples().position, rtol=0, atol=0)
    np.testing.assert_allclose(back.yaw, samples().yaw, atol=1e-15)
    table = to_dataframe(samples(), frame)
    assert list(table.columns)[:5] == ["t", "x", "y", "z", "vx"] and table.attrs["frame"] == frame
    with pytest.raises(FileError, match="no column z"):
        from_dataframe(table.drop(columns="z"))


def test_what_is_no_table(tmp_path):
    path = tmp_path / "t.parquet"
    path.write_text("no")
    with pytest.raises(FileError, match="is not a Parquet file"):
        read_parquet(path)
    with pytest.raises(FileError, match="cannot be read"):
        read_parquet(tmp_path / "none.parquet")
