"""Notes where a path, which has no size, passes nearer than a vehicle's radius, or below the ground."""

import numpy as np
import pytest

import minsnap
from minsnap import Cylinder, Gate, Limits
from minsnap.native.library import core
from minsnap.vehicle import Quadrotor

pytestmark = pytest.mark.skipif(core().name != "native", reason="plans within limits need the native core")
LIMITS = Limits(speed=4.0, acceleration=8.0, jerk=60.0)


def course(margin=0.0):
    gates = [Gate((4, 0, 1), (1, 0.5, 0), 1.0, 1.0, margin=margin), Gate((9, 6, 1), (0, 1, 0), 1.0, 1.0, margin=margin)]
    return minsnap.plan([(0, 0, 1), gates[0], (8, 3, 1), gates[1], (9, 9, 1)], limits=LIMITS, pieces=1)


def test_a_gate_that_is_grazed_is_noted_unless_it_has_a_margin():
    """The edge of a gate was passed at 0.09 mm, and the report had nothing to say."""
    grazing = course()
    aside = np.abs(np.cross(grazing(grazing.leg_breaks[1]) - (4, 0, 1), (1, 0.5, 0))[2]) / np.hypot(1, 0.5)
    (note,) = grazing.report.notes
    assert 0.49 < aside <= 0.5 + 1e-9 and note.startswith("the path passes 2 gates, the nearest of them gate ")
    assert note.endswith("m from its edge, nearer than a vehicle's radius of 0.15 m: give gates a margin")
    assert course(margin=0.2).report.notes == ()
    straight = minsnap.plan([(0, 0, 1), Gate((2, 0, 1), (1, 0, 0), 1.0, 1.0), (4, 0, 1)], limits=LIMITS, pieces=1)
    assert straight.report.notes == ()


def test_a_pole_that_is_grazed_is_noted():
    poles = [Cylinder((9.0, 9.0), 0.2), Cylinder((4.0, 0.05), 0.3)]
    (note,) = minsnap.plan([(0, 0, 1), (8, 0, 1)], limits=LIMITS, avoid=poles).report.notes
    assert (
        note.startswith("the path passes obstacle 1 ") and "has room for the vehicle's radius, such as 0.15 m" in note
    )
    assert minsnap.plan([(0, 0, 1), (8, 0, 1)], limits=LIMITS, pieces=1, avoid=poles[:1]).report.notes == ()


def test_the_radius_is_that_of_the_vehicle_whose_limits_hold():
    vehicle = Quadrotor.crazyflie()
    way = [(0, 0, 1), Gate((2, 0, 1), (1, 0, 0), 0.2, 0.2), (4, 0, 1)]
    asked = {"corridor": 0.01, "yaw": 0.0, "pieces": 1}  # so that it passes the middle, 0.1 m from the edges
    ours, any_other = (minsnap.plan(way, limits=limits, **asked) for limits in (Limits.of(vehicle), LIMITS))
    assert vehicle.arm_length < 0.09 and not any("gate" in note for note in ours.report.notes)
    (note,) = any_other.report.notes
    assert note.startswith("the path passes gate 1 0.09") or note.startswith("the path passes gate 1 0.1 m")


def test_a_path_below_the_ground_is_noted_where_its_waypoints_are_above():
    """A race of published gates went down to z = -0.34 m without a word."""
    way = [(0, 0, 0.2), (3, 0, 2.0), (6, 0, 0.1), (9, 0, 2.5)]
    notes = minsnap.plan(way, [1.5, 1.5, 1.2]).report.notes
    lowest = minsnap.plan(way, [1.5, 1.5, 1.2])(np.linspace(0.0, 4.2, 20001))[:, 2].min()
    assert lowest < -0.01 and any(note.startswith(f"the path goes down to z = {lowest:.3g} m") for note in notes)
    above = minsnap.plan([(x, y, z + 2.0) for x, y, z in way], [1.5, 1.5, 1.2]).report.notes
    diving = minsnap.plan([*way, (10, 0, -1.0)], [1.5, 1.5, 1.2, 1.0]).report.notes
    assert not any("the path goes down" in note for note in (*above, *diving))
