"""Feed-forward stated in files: written, read, checked, sent, simulated, and never part of the motion."""

from dataclasses import replace

import numpy as np
import pytest
from flying import PATH

import minsnap
from minsnap.errors import FileError, InputError
from minsnap.files.consistency import check_samples
from minsnap.files.convert import read_any, write_any
from minsnap.files.formats.robot_messages import px4_setpoints
from minsnap.flight import CascadeController, simulate
from minsnap.flight.mavlink.offboard import prepare
from minsnap.flight.mavlink.setpoints import FeedForward
from minsnap.flight.mavlink.stream_options import StreamOptions
from minsnap.vehicle import BodyDrag, Quadrotor

STATED = FeedForward(drag=0.4).stated(PATH)


@pytest.mark.parametrize("frame", ["enu", "ned", "frd"])
def test_columns_of_a_file_follow_those_of_the_motion(tmp_path, frame):
    minsnap.write_csv(STATED, tmp_path / "a.csv", frame=frame)
    header = (tmp_path / "a.csv").read_text().splitlines()[0]
    said = "" if frame == "enu" else f",frame_{frame}"
    assert header == "t,x,y,z,vx,vy,vz,ax,ay,az,yaw,yaw_rate,ffx,ffy,ffz" + said
    back = minsnap.read_csv(tmp_path / "a.csv")
    np.testing.assert_array_equal(back.feed_forward, 0.4 * PATH.velocity)
    np.testing.assert_array_equal(back.acceleration, PATH.acceleration)
    table = np.loadtxt(tmp_path / "a.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(table[:, 12:15], 0.4 * table[:, 4:7])


def test_a_file_without_it_stays_as_it_was(tmp_path):
    minsnap.write_csv(PATH, tmp_path / "a.csv")
    assert (tmp_path / "a.csv").read_text().splitlines()[0].endswith("yaw,yaw_rate")
    assert minsnap.read_csv(tmp_path / "a.csv").feed_forward is None


def test_part_of_the_columns_is_refused(tmp_path):
    (tmp_path / "a.csv").write_text("t,x,y,z,ffx,ffz\n0,0,0,1,0,0\n1,0,0,1,0,0\n")
    with pytest.raises(FileError, match="ffy missing; give ffx, ffy, ffz or none of them"):
        minsnap.read_csv(tmp_path / "a.csv")


@pytest.mark.parametrize("name", ["a.parquet", "a.npz", "a.csv"])
def test_other_formats_of_samples_keep_it(tmp_path, name):
    write_any(STATED, tmp_path / name)
    np.testing.assert_array_equal(read_any(tmp_path / name).feed_forward, STATED.feed_forward)
    write_any(replace(STATED, lead=0.17), tmp_path / f"led_{name}")
    assert read_any(tmp_path / name).lead == 0.0 and read_any(tmp_path / f"led_{name}").lead == 0.17


def test_messages_have_the_sum():
    east = px4_setpoints(STATED)["acceleration"][:, 1]
    np.testing.assert_allclose(east, PATH.acceleration[:, 0] + 0.4 * PATH.velocity[:, 0], rtol=1e-6, atol=1e-6)


def test_the_check_holds_the_motion_to_itself_and_states_the_rest():
    report = check_samples(STATED)
    assert report.ok and report.feed_forward == pytest.approx(0.4 * np.linalg.norm(PATH.velocity, axis=1).max())
    assert check_samples(PATH).feed_forward is None
    assert not check_samples(FeedForward(drag=3.0).stated(PATH).commanded()).ok
    wrong = FeedForward(drag=400.0).stated(PATH)
    assert "the feed-forward reaches" in check_samples(wrong).problems[0]


def test_what_is_sent_is_the_sum_at_any_rate(tmp_path):
    minsnap.write_csv(STATED, tmp_path / "a.csv")
    sent = prepare(tmp_path / "a.csv", StreamOptions()).rows
    same = prepare(PATH, StreamOptions(feed_forward=FeedForward(drag=0.4))).rows
    np.testing.assert_allclose(sent, same, atol=1e-12)
    np.testing.assert_allclose(
        sent[:, 6:9], prepare(PATH, StreamOptions()).rows[:, 6:9] + 0.4 * sent[:, 3:6], atol=1e-12
    )
    faster = prepare(tmp_path / "a.csv", StreamOptions(rate=40.0)).rows
    plain = prepare(PATH, StreamOptions(rate=40.0)).rows
    np.testing.assert_allclose(faster[:, :6], plain[:, :6], atol=1e-12)
    np.testing.assert_allclose(faster[::2, 6:9], sent[:, 6:9], atol=1e-9)


def test_it_is_not_added_twice(tmp_path):
    with pytest.raises(InputError, match="states its feed-forward already"):
        prepare(STATED, StreamOptions(feed_forward=FeedForward(drag=0.4)))
    with pytest.raises(InputError, match="samples state their feed-forward"):
        simulate(Quadrotor.px4_sih(), CascadeController(), STATED, compensation=BodyDrag((0.4, 0.4, 0.4)))


@pytest.mark.slow
def test_the_simulated_vehicle_follows_it():
    vehicle, still = Quadrotor.px4_sih(), minsnap.rectangle(8, 4, corridor=0.3, total_time=16.0).sample(20.0)
    stated = FeedForward(vehicle=vehicle).stated(still)
    one = simulate(vehicle, CascadeController(), stated)
    two = simulate(vehicle, CascadeController(), still, compensation=vehicle.drag)
    np.testing.assert_allclose(one.position, two.position, atol=1e-9)
    assert np.abs(one.error).max() < 0.7 * np.abs(simulate(vehicle, CascadeController(), still).error).max()
