"""Arrays, messages, archives and tables: exact where they can be, and never a pickle."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from curves import curve

import minsnap
from minsnap.errors import FileError, FrameError
from minsnap.files.formats.robot_messages import (
    multidof,
    offboard_control_mode,
    px4_setpoints,
    write_multidof,
    write_px4,
)
from minsnap.files.formats.tables import from_dataframe, read_npz, read_parquet, to_dataframe, write_npz, write_parquet
from minsnap.trajectory.samples import Samples


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


def test_a_yaw_that_accelerates_says_so():
    """Its acceleration was 0 in every point."""
    t = np.arange(41) / 20.0
    turning = Samples(t, np.zeros((41, 3)), np.zeros((41, 3)), np.zeros((41, 3)), yaw=0.3 * t**2, yaw_rate=0.6 * t)
    points = multidof(turning)["points"]
    assert [point["accelerations"][0]["angular"]["z"] for point in points] == pytest.approx([0.6] * 41)
    assert points[7]["velocities"][0]["angular"] == {"x": 0.0, "y": 0.0, "z": pytest.approx(0.6 * t[7])}
    assert multidof(turning[:1])["points"][0]["accelerations"][0]["angular"]["z"] == 0.0


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


def test_messages_have_the_same_accelerations():
    """The feed-forward was added to those of PX4 alone."""
    given = replace(samples(), feed_forward=np.full((len(samples()), 3), [0.5, -0.25, 0.125]))
    linear = [list(point["accelerations"][0]["linear"].values()) for point in multidof(given)["points"]]
    assert np.array_equal(linear, given.acceleration + given.feed_forward)
    ned = px4_setpoints(given)["acceleration"]
    np.testing.assert_allclose(np.array(linear)[:, [1, 0, 2]] * [1, 1, -1], ned, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("turning", [True, False])
def test_archives_keep_trajectories_to_the_last_bit(tmp_path, turning):
    path = tmp_path / "t.npz"
    write_npz(curve(turning=turning), path)
    back = read_npz(path)
    assert np.array_equal(back.control_points, curve().control_points)
    t = np.linspace(0, back.duration, 50)
    assert np.array_equal(back.yaw(t), curve(turning=turning).yaw(t))


def test_archives_keep_the_pieces_of_each_leg(tmp_path):
    """A plan of two legs of two pieces was read back as four legs; archives of one piece a leg are as they were."""
    plan = minsnap.plan([(0, 0, 1), (3, 0, 1), (3, 3, 2)], [1.5, 2.0], pieces=2)
    write_npz(plan, tmp_path / "t.npz")
    back = read_npz(tmp_path / "t.npz")
    assert back.pieces == 2 and back.legs == 2 and np.array_equal(back.leg_breaks, plan.leg_breaks)
    write_npz(curve(), tmp_path / "t.npz")
    assert "pieces_per_leg" not in np.load(tmp_path / "t.npz") and read_npz(tmp_path / "t.npz").pieces == 1


@pytest.mark.parametrize("pieces", [0, 3, -2, math.inf, [1, 1], "two"])
def test_archives_of_no_whole_number_of_legs_are_refused(tmp_path, pieces):
    numbers = {"control_points": curve().control_points, "durations": curve().durations}
    np.savez(tmp_path / "t.npz", **numbers, yaw_angle=0.0, frame="enu", pieces_per_leg=np.array(pieces))
    with pytest.raises(FileError, match=r"t\.npz"):
        read_npz(tmp_path / "t.npz")


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
