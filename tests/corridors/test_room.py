"""Rooms and half-spaces: bounds that hold on every leg, beside the corridor."""

import numpy as np
import pytest

import minsnap
from minsnap import HalfSpaces, Room, Tube
from minsnap.errors import CorridorError

CORNERS = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]
TIMES = [4, 2, 4, 2]
OPEN = np.inf


def test_room_holds_beside_the_corridor():
    room = ((-0.1, -0.1, 0.9), (8.1, 4.1, 2))
    traj = minsnap.plan(CORNERS, TIMES, corridor=[0.3, Room(*room)])
    assert minsnap.certify(traj, CORNERS, [Tube(0.3), Room(*room)]).ok
    assert minsnap.certify(minsnap.plan(CORNERS, TIMES, corridor=0.3), CORNERS, Room(*room)).corridor_margin < 0.0
    assert traj.cost() > 1557.01


def test_room_that_is_never_touched_costs_nothing():
    plain = minsnap.plan(CORNERS, TIMES, corridor=0.3).cost()
    assert minsnap.plan(CORNERS, TIMES, corridor=[0.3, minsnap.Room((-9, -9, 0), (9, 9, 6))]).cost() == pytest.approx(
        plain
    )


def test_ceiling_alone_is_a_half_space_too():
    points = [(0, 0, 1), (2, 0, 1.9), (4, 0, 1.9), (6, 0, 1)]
    room = minsnap.plan(points, [1, 1, 1], corridor=minsnap.Room((-OPEN, -OPEN, -OPEN), (OPEN, OPEN, 2.0)))
    half = minsnap.plan(points, [1, 1, 1], corridor=HalfSpaces((0, 0, 3), 6.0))
    assert minsnap.plan(points, [1, 1, 1]).extent((0, 0, 1))[1] > 2.0 >= room.extent((0, 0, 1))[1]
    assert half.cost() == pytest.approx(room.cost(), rel=1e-6)


def test_half_spaces_hold_on_the_legs_they_name():
    points = [(0, 0, 1), (2, 0, 1.9), (4, 0, 1.9), (6, 0, 1)]
    some = HalfSpaces((0, 0, 1), 2.0, legs=(0,))
    traj = minsnap.plan(points, [1, 1, 1], corridor=some)
    assert minsnap.certify(traj, points, some).ok
    assert traj.extent((0, 0, 1))[1] > 2.0 >= traj.between(0.0, 1.0).extent((0, 0, 1))[1]


def test_half_spaces_bound_the_velocity_too():
    points = [(0, 0), (4, 0), (8, 0)]
    slow = HalfSpaces((1, 0), 2.2, legs=(1,), order=1)
    traj = minsnap.plan(points, [2, 3], corridor=slow)
    assert minsnap.certify(traj, points, slow).ok
    fastest = [traj(np.linspace(*ends, 2001), 1)[:, 0].max() for ends in ((0, 2), (2, 5))]
    assert fastest[1] == pytest.approx(2.2, abs=1e-4) and fastest[0] > 2.2


def test_starting_on_the_floor_is_possible():
    traj = minsnap.plan(
        [(0, 0, 0), (4, 0, 1), (8, 0, 0)], [3, 3], corridor=minsnap.Room((-OPEN, -OPEN, 0), (OPEN, OPEN, 2))
    )
    assert traj.report.corridor_margin >= 0.0


def test_sliding_along_the_floor_is_possible():
    points = [(0, 0, 0), (2, 0, 0), (4, 0, 1), (8, 0, 0)]
    traj = minsnap.plan(points, [2, 3, 3], corridor=minsnap.Room((-OPEN, -OPEN, 0), (OPEN, OPEN, 2)))
    assert traj.report.corridor_margin >= 0.0
    beneath = minsnap.plan(points, [2, 3, 3], corridor=minsnap.Room((-OPEN, -OPEN, -1e-4), (OPEN, OPEN, 2))).cost()
    assert beneath <= traj.cost() <= 1.05 * beneath


def test_room_cuts_the_overlaps_of_boxes():
    boxes = minsnap.Boxes([[0, 0, 0], [2, 0, 0]], [[3, 1, 9], [5, 1, 9]])
    ends = {"start": {"position": (0.5, 0.5, 0.5)}, "end": {"position": (4.5, 0.5, 0.5)}}
    traj = minsnap.plan(None, [2, 2], corridor=[boxes, minsnap.Room((0, 0, 0), (9, 1, 1))], **ends)
    assert 0.0 <= traj.extent((0, 0, 1))[0] <= traj.extent((0, 0, 1))[1] <= 1.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Room((0, 0, 3), (1, 1, 2)), "the room runs from 3 to 2 along z"),
        (lambda: Room((0, 0, np.nan), (1, 1, 2)), "the room runs from nan to 2 along z"),
        (lambda: Room((0, 0, 1), (1, 1, 1)), "the room runs from 1 to 1 along z"),
        (lambda: Room((0, 0), (1, 1, 1)), r"shapes \(2,\) and \(3,\)"),
        (
            lambda: minsnap.plan(CORNERS, TIMES, corridor=minsnap.Room((0, 0), (9, 9))),
            "the room has 2 coordinates and the waypoints 3",
        ),
        (
            lambda: minsnap.plan(CORNERS, TIMES, corridor=minsnap.Room((0, 0, 0), (7, 4, 2))),
            "waypoint 1 at .* is 1 m outside the room",
        ),
        (lambda: minsnap.Replanner(room=3), "room must be a Room or two corners"),
        (lambda: HalfSpaces((0, 0, 1), 1, order=3), "the order of half-spaces is 3"),
        (lambda: HalfSpaces((0, 0, 0), 1), "row 0 of the half-spaces has a normal of zeros"),
        (lambda: HalfSpaces((0, 0, 1), (1, 2)), r"shape \(1, 3\) and the offsets \(2,\)"),
        (lambda: HalfSpaces((0, 0, 1), np.inf), "row 0 of the half-spaces is not finite"),
        (lambda: minsnap.plan(CORNERS, TIMES, corridor=HalfSpaces((0, 0, 1), 5, legs=(4,))), "legs 0 to 3"),
    ],
)
def test_bad_bounds_are_refused(make, message):
    with pytest.raises(CorridorError, match=message):
        make()


def test_a_room_owns_its_corners():
    upper = np.ones(2)
    room = minsnap.Room((0, 0), upper)
    upper[:] = 9.0
    for corner, value in ((room.lower, 0.0), (room.upper, 1.0)):
        assert (corner == value).all()
        with pytest.raises(ValueError, match="read-only"):
            corner[0] = 5.0
