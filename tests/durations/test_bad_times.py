"""Shortest times that cannot be: each refused in one sentence that says which, where and by how much."""

import pytest
from tasks import REFERENCE

import minsnap
from minsnap.corridors.boxes import Boxes
from minsnap.errors import CorridorError, DegreeError, LimitError, SolverError, WaypointError, YawError
from minsnap.limits.limits import Limits
from minsnap.planning.request import plan_arguments
from minsnap.trajectory.medium import Medium
from minsnap.trajectory.tilt_heading import TiltHeading
from minsnap.vehicle import Quadrotor

LIMITS = Limits(speed=3.0, acceleration=6.0)
GATES = [minsnap.Gate((4, 1, 1), (1, 0, 0), 1.0, 0.8), minsnap.Gate((8, -1, 1.5), (1, 0, 0), 1.0, 0.8)]


def test_limits_that_no_speed_keeps_are_named_with_their_value_and_place():
    """From 2.9 m/s to rest within 0.65 m: even a constant deceleration would be v^2 / 2d = 6.47 m/s^2."""
    box = Boxes([(-1, -1, -1)], [(0.65, 1, 1)])
    with pytest.raises(SolverError, match=r"acceleration reaches [\d.]+ on leg 0 at .* where 6 is allowed") as refused:
        minsnap.plan([(0, 0, 0), (0.5, 0, 0)], limits=LIMITS, corridor=box, start={"velocity": (2.9, 0, 0)})
    reached = float(str(refused.value).split("acceleration reaches ")[1].split()[0])
    assert reached > 2.9**2 / (2.0 * 0.65)


@pytest.mark.parametrize(
    ("second", "gate"), [((4.5, -3, 0), "gate of waypoint 1 at (4, 1, 1) is 0.5 m"), ((3, 0, 0), "gate of waypoint 2")]
)
def test_a_gate_behind_a_wall_is_named_with_the_wall(second, gate):
    boxes = Boxes([(-1, -3, 0), second, (7, -3, 0)], [(5, 3, 3), (9, 3, 3), (13, 3, 3)])
    with pytest.raises(CorridorError) as refused:
        minsnap.plan([(0, 0, 1), *GATES, (12, 0, 1)], limits=LIMITS, corridor=boxes)
    assert gate in str(refused.value) and "box of leg 1" in str(refused.value) and refused.value.leg == 1


def test_a_gate_twice_in_a_row_is_refused():
    with pytest.raises(WaypointError, match="waypoints 1 and 2 are both"):
        minsnap.plan([(0, 0, 1), GATES[0], GATES[0], (12, 0, 1)], limits=LIMITS)


@pytest.mark.parametrize("pieces", [0, -1, 1.5, "many"])
def test_pieces_are_at_least_one(pieces):
    with pytest.raises(DegreeError, match=f"pieces is {pieces!r}.*at least 1"):
        minsnap.plan(REFERENCE, limits=LIMITS, pieces=pieces)


@pytest.mark.parametrize(
    ("heading", "sentence"),
    [
        ({"yaw": "tilt", "hold_below": 0.3}, "hold_below=0.3 is for a heading along the velocity"),
        ({"yaw": 0.3, "yaw_rate": 1.0}, "yaw_rate=1.0 is for a heading along the velocity"),
        ({"yaw": [0.0, 1.0]}, "give one angle, or one for each of 5 waypoints"),
        ({"yaw": [0.0, 1.0, 2.0, 3.0, 1.0], "closed": True}, "begins at a yaw of 0 rad and ends at 1 rad"),
    ],
    ids=str,
)
def test_headings_that_contradict_themselves_are_refused(heading, sentence):
    with pytest.raises(YawError, match=sentence):
        minsnap.plan(REFERENCE, limits=LIMITS, **plan_arguments(heading))


def test_a_heading_from_the_tilt_of_another_planet_is_refused():
    limits = Limits.of(Quadrotor.dji_f330())
    path = minsnap.plan(REFERENCE, total_time=20.0)
    assert minsnap.certify(path.with_yaw(TiltHeading(path)), limits=limits).ok
    with pytest.raises(LimitError, match=r"gravity of 1.62 m/s\^2, the vehicle's is 9.80665"):
        minsnap.certify(path.with_yaw(TiltHeading(path, medium=Medium(1.62))), limits=limits)
