"""The medium of a vehicle: gravity and drag per mass."""

from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap import Limits
from minsnap.limits.vehicle_use import medium_of
from minsnap.vehicle import BodyDrag, Quadrotor, flatness_of


def test_drag_per_mass_has_the_mean_of_both_lateral_axes():
    drag = BodyDrag(linear=(0.1, 0.3, 0.5), quadratic=(0.01, 0.05, 0.02))
    vehicle = replace(Quadrotor.dji_f330(), drag=drag, mass=0.8)
    mass = 0.8
    expected = (vehicle.gravity, 0.2 / mass, 0.03 / mass, 0.3 / mass, -0.01 / mass)
    assert medium_of(vehicle).values == pytest.approx(expected)


@pytest.mark.parametrize("seed", [11, 23, 35, 37])
def test_samples_reach_what_a_rotor_gives_just_before_a_knot(seed):
    """Snap jumps at the knots of a plan in a corridor, and the largest thrust is often that just before one."""
    vehicle = replace(Quadrotor.dji_f330(), drag=BodyDrag((0.3, 0.2, 0.1)))
    points = np.cumsum(np.random.default_rng(seed).normal(size=(4, 3)), axis=0)
    path = minsnap.plan(points, [1.0, 0.8, 1.0], corridor=0.2)
    used = {entry.name: entry for entry in Limits.of(vehicle, reserve=0.0).utilisation(path)}
    t = np.unique(np.append(np.linspace(0.0, path.duration, 5001), path.breaks[1:] - 1e-9))
    thrusts = vehicle.thrusts(flatness_of(vehicle, path, t).rotor_speed)
    assert used["rotor_thrust"].value >= thrusts.max()
    assert used["min_rotor_thrust"].value <= thrusts.min()
