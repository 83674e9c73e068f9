"""The medium of a vehicle: gravity and drag per mass."""

from dataclasses import replace

import pytest

from minsnap.limits.vehicle_use import medium_of
from minsnap.vehicle import BodyDrag, Quadrotor


def test_drag_per_mass_has_the_mean_of_both_lateral_axes():
    drag = BodyDrag(linear=(0.1, 0.3, 0.5), quadratic=(0.01, 0.05, 0.02))
    vehicle = replace(Quadrotor.dji_f330(), drag=drag, mass=0.8)
    mass = 0.8
    expected = (vehicle.gravity, 0.2 / mass, 0.03 / mass, 0.3 / mass, -0.01 / mass)
    assert medium_of(vehicle).values == pytest.approx(expected)
