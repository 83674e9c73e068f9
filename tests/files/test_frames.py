"""Frames: hand-written cases, rotation matrices and SciPy's Rotation as the oracles."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from minsnap.errors import FrameError
from minsnap.files import frames
from minsnap.files.frames import FRAMES, map_quaternions, map_samples, map_vectors, map_yaw, map_yaw_rate
from minsnap.trajectory.samples import Samples

PAIRS = list(itertools.product(FRAMES, FRAMES))
ANGLES = st.floats(-3.0, 3.0)


def test_east_north_up_to_north_east_down():
    assert map_vectors([1.0, 2.0, 3.0], "enu", "ned").tolist() == [2.0, 1.0, -3.0]


def test_room_up_to_room_down():
    assert map_vectors([1.0, 2.0, 3.0], "flu", "frd").tolist() == [1.0, -2.0, -3.0]


def test_optitrack_to_z_down_as_in_the_thesis():
    """X to x, z to y, -y to z."""
    assert map_vectors([1.0, 2.0, 3.0], "optitrack", "frd").tolist() == [1.0, 3.0, -2.0]


def test_a_height_above_the_floor_is_z_in_the_world_and_y_in_optitrack():
    assert map_vectors([0.0, 1.5, 0.0], "optitrack", "flu").tolist() == [0.0, 0.0, 1.5]


@pytest.mark.parametrize(
    ("facing", "enu", "ned"), [("east", 0.0, math.pi / 2), ("north", math.pi / 2, 0.0), ("west", math.pi, -math.pi / 2)]
)
def test_headings_by_the_compass(facing, enu, ned):
    assert map_yaw(enu, "enu", "ned") == pytest.approx(ned, abs=1e-15), facing


def test_turning_left_is_negative_in_every_z_down_frame():
    assert map_yaw_rate(0.3, "enu", "ned") == -0.3
    assert map_yaw_rate([0.3, -0.1], "flu", "frd").tolist() == [-0.3, 0.1]
    assert map_yaw_rate(0.3, "optitrack", "flu") == 0.3


@pytest.mark.parametrize(("source", "target"), PAIRS)
def test_there_and_back_is_exact(source, target):
    vectors = np.random.default_rng(1).normal(size=(4, 5, 3))
    assert np.array_equal(map_vectors(map_vectors(vectors, source, target), target, source), vectors)


@pytest.mark.parametrize(("source", "target"), PAIRS)
def test_every_mapping_is_a_proper_rotation(source, target):
    columns = map_vectors(np.eye(3), source, target).T
    assert np.linalg.det(columns) == pytest.approx(1.0)
    assert np.array_equal(columns @ columns.T, np.eye(3))


@pytest.mark.parametrize("name", FRAMES)
def test_matrices_agree_with_the_vector_mapping(name):
    assert np.array_equal(FRAMES[name].matrix, map_vectors(np.eye(3), "enu", name).T)


@given(yaw=ANGLES, pitch=st.floats(-1.4, 1.4), roll=ANGLES)
@pytest.mark.parametrize("name", FRAMES)
def test_an_attitude_carries_its_body_vectors_along(name, yaw, pitch, roll):
    """A vector fixed in the body, mapped as a vector, is where the mapped attitude puts the mapped body vector."""
    attitude = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    w, x, y, z = map_quaternions(np.roll(attitude.as_quat(), 1), "flu", name)
    forward_left_up = np.array([0.3, -0.5, 0.8])
    body_there = FRAMES[name].body_matrix @ forward_left_up
    expected = map_vectors(attitude.apply(forward_left_up), "flu", name)
    np.testing.assert_allclose(Rotation.from_quat([x, y, z, w]).apply(body_there), expected, atol=1e-12)


@given(yaw=ANGLES)
def test_the_yaw_of_a_mapped_attitude_is_the_mapped_yaw(yaw):
    level = [math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)]
    for name in ("enu", "ned", "flu", "frd"):
        w, x, y, z = map_quaternions(level, "enu", name)
        heading = Rotation.from_quat([x, y, z, w]).as_euler("ZYX")[0]
        assert math.remainder(heading - float(map_yaw(yaw, "enu", name)), 2 * math.pi) == pytest.approx(0, abs=1e-12)


def test_quaternions_of_optitrack_swap_their_vector_part():
    """The PX4 manual's motion capture mapping of a quaternion: (w, x, z, -y)."""
    attitude = np.array([0.8, 0.2, 0.4, math.sqrt(1 - 0.84)])
    mapped = map_quaternions(attitude, "optitrack", "frd")
    np.testing.assert_allclose(mapped, attitude[[0, 1, 3, 2]] * [1, 1, 1, -1], atol=1e-15)


def test_quaternions_keep_their_shape_and_come_back():
    attitude = np.random.default_rng(2).normal(size=(2, 3, 4))
    attitude /= np.linalg.norm(attitude, axis=-1, keepdims=True) * np.sign(attitude[..., :1])
    back = map_quaternions(map_quaternions(attitude, "enu", "ned"), "ned", "enu")
    np.testing.assert_allclose(back, attitude, atol=1e-14)


def test_not_a_number_stays_in_its_own_coordinate():
    mapped = map_vectors([np.nan, 2.0, 3.0], "enu", "ned")
    assert np.isnan(mapped[1])
    assert mapped[[0, 2]].tolist() == [2.0, -3.0]


def test_zero_has_no_sign():
    assert not np.signbit(map_vectors(np.zeros(3), "enu", "ned")).any()


def test_samples_change_all_they_have_and_nothing_else():
    rng = np.random.default_rng(3)
    samples = Samples(np.arange(4.0), rng.normal(size=(4, 3)), velocity=rng.normal(size=(4, 3)), yaw=rng.normal(size=4))
    ned = map_samples(samples, "enu", "ned")
    assert np.array_equal(ned.velocity, samples.velocity[:, [1, 0, 2]] * [1, 1, -1])
    assert np.array_equal(ned.yaw, np.pi / 2 - samples.yaw)
    assert ned.acceleration is None and ned.yaw_rate is None
    assert map_samples(samples, "enu", "enu") is samples


def test_names_are_found_in_any_case_and_a_wrong_one_is_named():
    assert frames.get_frame("NED") is FRAMES["ned"]
    with pytest.raises(FrameError, match="'nwu'.*enu, ned, flu, frd, optitrack"):
        frames.get_frame("nwu")
    with pytest.raises(FrameError, match="None"):
        frames.get_frame(None)


@pytest.mark.parametrize("bad", [[1.0, 2.0], 3.0])
def test_vectors_need_three_coordinates(bad):
    with pytest.raises(FrameError, match="3 coordinates"):
        map_vectors(bad, "enu", "ned")


@pytest.mark.parametrize("bad", [[0, 0, 0, 0], [np.nan, 0, 0, 1], [1, 0, 0]])
def test_quaternions_must_be_quaternions(bad):
    with pytest.raises(FrameError):
        map_quaternions(bad, "enu", "ned")
