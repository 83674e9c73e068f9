import numpy as np
import pytest

from minsnap.errors import FitError, OutsideRangeWarning, VehicleError
from minsnap.flight.thesis import (
    PUBLISHED_PARASITIC,
    PUBLISHED_PARASITIC_LINEAR,
    PUBLISHED_PARASITIC_REDUCED,
    PUBLISHED_PROPELLER,
    consistent_parasitic_drag,
    consistent_r_squared,
    consistent_rotor_drag,
    published_drag,
)
from minsnap.vehicle import RPM, BodyDrag, Drag, RotorSpeedDrag, SumOfDrags, linear_rotor_drag


def parasitic(pitch, v):
    """Section 3.3.2, typed anew."""
    return -0.1069 - 0.01293 * pitch - 0.01856 * v + 0.001505 * pitch**2 + 0.001185 * pitch * v + 0.008744 * v**2


def propeller(pitch, v, rpm):
    """Section 3.4.2, typed anew."""
    return (
        0.36891
        - 0.041098 * pitch
        + 0.041432 * v
        - 0.00024171 * rpm
        + 1.8526e-5 * pitch * rpm
        - 1.1287e-11 * pitch * rpm**2
    )


def test_published_surfaces_are_as_printed() -> None:
    pitch, v = np.meshgrid(np.linspace(-20, 20, 9), np.linspace(7, 28, 8))
    np.testing.assert_allclose(PUBLISHED_PARASITIC(pitch_deg=pitch, velocity=v), parasitic(pitch, v), rtol=1e-12)
    np.testing.assert_allclose(PUBLISHED_PARASITIC_REDUCED(velocity=v), parasitic(0, v), rtol=1e-12)
    np.testing.assert_allclose(PUBLISHED_PARASITIC_LINEAR(velocity=v), -0.1069 - 0.01856 * v, rtol=1e-12)
    tilt, speed, rpm = np.meshgrid([0.0, 30, 90], [0.0, 5, 15], [3000.0, 7000])
    values = PUBLISHED_PROPELLER(pitch_deg=tilt, velocity=speed, speed_rpm=rpm)
    np.testing.assert_allclose(values, propeller(tilt, speed, rpm), rtol=1e-10)


def test_reduced_published_forms_push_forward_below_4_7_metres_a_second() -> None:
    for name in ("reduced", "linear"):
        assert published_drag(name).force([3.0, 0, 0])[0] > 0
    assert published_drag("reduced").force([4.6, 0, 0])[0] > 0 > published_drag("reduced").force([4.8, 0, 0])[0]


def test_published_forces_act_along_x_and_y_and_take_pitch_and_rotor_speed() -> None:
    air = np.array([[9.0, 8.0, 7.0]])
    force = published_drag("surface").force(air, pitch=np.array([0.1]))
    expected = -parasitic(np.degrees(0.1), air[0])
    np.testing.assert_allclose(force, [[expected[0], expected[1], 0]])
    force = published_drag("propeller").force(air, pitch=np.array([0.1]), rotor_speed=np.full((1, 4), 6000 * RPM))
    np.testing.assert_allclose(force[0, 0], -4 * propeller(np.degrees(0.1), 9.0, 6000), rtol=1e-12)


def test_evaluating_outside_the_measured_range_warns() -> None:
    with pytest.warns(OutsideRangeWarning, match="velocity from 7 to 28, not at 3"):
        PUBLISHED_PARASITIC_LINEAR(velocity=3.0)
    with pytest.raises(FitError, match="speed_rpm"):
        PUBLISHED_PROPELLER(pitch_deg=0.0, velocity=1.0)
    with pytest.raises(VehicleError, match="'cubic'.*linear"):
        published_drag("cubic")


MODELS = [
    consistent_parasitic_drag(),
    consistent_rotor_drag(),
    linear_rotor_drag(0.5, 0.4, 0.1),
    BodyDrag((0.1, 0.2, 0.3), (0.4, 0.5, 0.6)),
    RotorSpeedDrag((1e-4, 1e-4, 2e-4)),
]


@pytest.mark.parametrize("model", MODELS)
def test_consistent_models_are_odd_zero_at_rest_and_oppose_motion(model) -> None:
    air = np.random.default_rng(0).normal(size=(200, 3)) * 8
    force = model.force(air, rotor_speed=500.0)
    np.testing.assert_array_equal(model.force(-air, rotor_speed=500.0), -force)
    assert not model.force(np.zeros(3), rotor_speed=500.0).any()
    assert (np.einsum("ij,ij->i", force, air) < 0).all()
    assert isinstance(model, Drag)


def test_the_consistent_model_is_as_close_to_the_surface_as_the_surface_was_to_the_data() -> None:
    model = consistent_parasitic_drag()
    assert consistent_r_squared() > 0.99
    pitch, speed = np.meshgrid(np.radians(np.linspace(-20, 20, 21)), np.linspace(7, 28, 22))
    body = np.stack([speed * np.cos(pitch), 0 * speed, speed * np.sin(pitch)], axis=-1)
    along = -np.einsum("...i,...i", model.force(body), body) / speed
    published = parasitic(np.degrees(pitch), speed)
    assert np.sqrt(np.mean((along - published) ** 2)) < 0.1 * published.std()


def test_one_unit_of_drag_by_hand() -> None:
    np.testing.assert_allclose(BodyDrag((1, 2, 3), (0.1, 0.2, 0.3)).force([3.0, 4.0, 0.0]), [-4.5, -12.0, 0.0])


def test_models_add_up() -> None:
    air = np.random.default_rng(1).normal(size=(5, 3))
    one, two = BodyDrag((0.1, 0.1, 0), (0, 0, 0.2)), BodyDrag((0, 0.3, 0), (0.4, 0, 0))
    np.testing.assert_allclose((one + two).force(air), one.force(air) + two.force(air))
    np.testing.assert_allclose(SumOfDrags((one, two)).force(air), (one + two).force(air))
    with pytest.raises(TypeError):
        one + 3  # noqa: B018


def test_rotors_that_stand_still_have_no_drag_at_their_hubs() -> None:
    force, torque = RotorSpeedDrag((1e-4, 2e-4, 0)).wrench((1.0, 2.0, 3.0), (0.1, 0.2, 0.3), np.eye(3))
    assert not force.any() and not torque.any()


def test_rotor_drag_grows_with_rotor_speed_and_is_linear_at_one() -> None:
    model = RotorSpeedDrag((1e-4, 2e-4, 0))
    air = np.array([3.0, -2.0, 1.0])
    np.testing.assert_allclose(model.force(air, rotor_speed=[100, 200, 300, 400]), [-0.3, 0.4, 0])
    np.testing.assert_allclose(model.at(500.0).force(air), model.force(air, rotor_speed=500.0))


@pytest.mark.parametrize("bad", [(1, 2), (-1, 0, 0), (np.nan, 0, 0)])
def test_negative_or_malformed_coefficients_are_named(bad) -> None:
    with pytest.raises(VehicleError, match="quadratic drag"):
        BodyDrag(quadratic=bad)
    with pytest.raises(VehicleError, match="rotor drag"):
        RotorSpeedDrag(bad)
