import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from minsnap.basics.arrays import GRAVITY
from minsnap.vehicle.attitude import body_rates, specific_thrust, tilt, tilt_rate


def attitudes(seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Thrusts, thrust rates and attitudes chosen first, so that acceleration and jerk follow from them."""
    random = np.random.default_rng(seed)
    attitude = Rotation.from_euler("ZXY", random.uniform(-1.2, 1.2, (50, 3)))
    return random.uniform(3, 20, 50), random.normal(size=50), attitude.as_matrix(), random.normal(size=(50, 3))


def test_thrust_and_tilt_of_an_attitude_come_back_from_its_acceleration() -> None:
    thrust, _, matrix, _ = attitudes()
    acceleration = thrust[:, None] * matrix[:, :, 2] - [0, 0, GRAVITY]
    np.testing.assert_allclose(specific_thrust(acceleration), thrust, rtol=1e-14)
    np.testing.assert_allclose(tilt(acceleration), np.arccos(matrix[:, 2, 2]), atol=1e-12)


def test_rates_of_an_attitude_come_back_from_acceleration_and_jerk() -> None:
    thrust, change, matrix, rates = attitudes()
    acceleration = thrust[:, None] * matrix[:, :, 2] - [0, 0, GRAVITY]
    turning = np.einsum("mij,mj->mi", matrix, np.stack([rates[:, 1], -rates[:, 0], 0 * rates[:, 0]], axis=-1))
    jerk = change[:, None] * matrix[:, :, 2] + thrust[:, None] * turning
    np.testing.assert_allclose(tilt_rate(acceleration, jerk), np.hypot(rates[:, 0], rates[:, 1]), atol=1e-12)
    yaw = Rotation.from_matrix(matrix).as_euler("ZXY")[:, 0]
    np.testing.assert_allclose(body_rates(acceleration, jerk, yaw)[:, :2], rates[:, :2], atol=1e-12)


def test_hover_needs_gravity_no_tilt_and_turns_with_yaw() -> None:
    assert specific_thrust([0, 0, 0]) == GRAVITY
    assert tilt([0, 0, 0]) == 0
    np.testing.assert_allclose(body_rates([[0, 0, 0]], [[0, 0, 0]], 0.3, 0.7), [[0, 0, 0.7]])


def test_free_fall_is_never_not_a_number() -> None:
    fall = np.array([[0, 0, -GRAVITY]])
    assert specific_thrust(fall) == 0 and tilt(fall) == 0
    assert np.all(body_rates(fall, [[1.0, 0, 0]]) == 0)
    assert tilt_rate(fall, [[0, 0, 0]]) == 0 and np.isposinf(tilt_rate(fall, [[1, 0, 0]]))


def test_plane_accelerations_are_level() -> None:
    np.testing.assert_array_equal(specific_thrust([[3.0, 4.0]]), specific_thrust([[3.0, 4.0, 0.0]]))


@pytest.mark.parametrize("shape", [(3,), (4, 3), (2, 5, 3)])
def test_shapes_follow_the_input(shape: tuple[int, ...]) -> None:
    assert specific_thrust(np.zeros(shape)).shape == tilt(np.zeros(shape)).shape == shape[:-1]
