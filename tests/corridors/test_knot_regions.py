"""Where the curve passes: waypoints, positions of the ends, and overlaps instead of waypoints."""

import numpy as np
import pytest

import minsnap
from minsnap import Boxes
from minsnap.basics.checks import check_position
from minsnap.corridors.given_waypoints import as_knots
from minsnap.corridors.knot_regions import _apart, place
from minsnap.errors import CorridorError, WaypointError

PAIR = Boxes([[0, 0], [2, 0]], [[3, 1], [5, 1]])


def test_nominal_points_are_the_centres_of_the_overlaps():
    placement = place(None, [PAIR], np.array((0.5, 0.5)), np.array((4.5, 0.2)))
    assert placement.points == pytest.approx(np.array([(0.5, 0.5), (2.5, 0.5), (4.5, 0.2)]))
    assert placement.lower + placement.points == pytest.approx(np.array([(0.5, 0.5), (2, 0), (4.5, 0.2)]))
    assert placement.upper + placement.points == pytest.approx(np.array([(0.5, 0.5), (3, 1), (4.5, 0.2)]))


def test_knots_are_named_by_what_they_are():
    found = place(None, [PAIR], np.array((0.5, 0.5)), np.array((4.5, 0.2)))
    assert [found.name(k) for k in range(3)] == [
        "the position of start, (0.5, 0.5),",
        "the overlap that leg 1 starts in, around (2.5, 0.5),",
        "the position of end, (4.5, 0.2),",
    ]
    given = place(as_knots([(0, 0), (1, 0), minsnap.Gate((2, 0), (1, 0), 0.5)], [0.0, 0.1, 0.0]), ())
    assert [given.name(k) for k in range(3)] == [
        "waypoint 0 at (0, 0)",
        "the box around waypoint 1 at (1, 0)",
        "the gate of waypoint 2 at (2, 0)",
    ]


def test_room_moves_nominal_points_inside():
    room = minsnap.Room((0.0, 0.0), (9.0, 0.3))
    placement = place(None, [PAIR, room], np.array((0.5, 0.1)), np.array((4.5, 0.2)))
    assert placement.points[1] == pytest.approx([2.5, 0.15])
    assert (placement.upper + placement.points)[1] == pytest.approx([3.0, 0.3])
    room = minsnap.Room((0.0, 0.6), (9.0, 0.9))
    placement = place(None, [PAIR, room], np.array((0.5, 0.7)), np.array((4.5, 0.7)))
    assert (placement.lower + placement.points)[1] == pytest.approx([2.0, 0.6])


def test_every_leg_has_a_length_though_a_path_starts_where_it_would_pass():
    placement = place(None, [PAIR], np.array((2.5, 0.5)), np.array((4.5, 0.2)))
    assert (np.diff(placement.points, axis=0) != 0.0).any(axis=1).all()
    ends = {"start": {"position": (2.5, 0.5)}, "end": {"position": (4.5, 0.2)}}
    traj = minsnap.plan(None, total_time=4, corridor=PAIR, search=minsnap.Search(split="distance"), **ends)
    assert traj.report.corridor_margin >= 0.0 and traj(0.0) == pytest.approx([2.5, 0.5])


def test_ends_have_derivatives_beside_their_positions():
    start = {"position": (0.5, 0.5), "velocity": (1.0, 0.0)}
    traj = minsnap.plan(None, [2, 2], corridor=PAIR, start=start, end={"position": (4.5, 0.5)})
    assert traj(0.0, 1) == pytest.approx([1.0, 0.0]) and traj(4.0, 1) == pytest.approx([0.0, 0.0], abs=1e-9)


def test_position_that_agrees_with_its_waypoint_is_welcome():
    traj = minsnap.plan([(0, 0), (1, 1)], [1], start={"position": (0, 0)})
    assert traj.cost() == pytest.approx(minsnap.plan([(0, 0), (1, 1)], [1]).cost())


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"corridor": PAIR}, WaypointError, "where to start: give start="),
        ({"corridor": PAIR, "start": {"position": (0.5, 0.5)}}, WaypointError, "where to end: give end="),
        (
            {"corridor": PAIR, "start": {"position": (1, 1, 1)}},
            WaypointError,
            "start has 3 coordinates and the corridor 2",
        ),
        ({"corridor": PAIR, "start": {"position": "here"}}, WaypointError, "position of start is 'here'"),
        ({"corridor": PAIR, "end": {"position": "here"}}, WaypointError, "position of end is 'here'"),
        ({"corridor": PAIR, "start": {"position": (np.nan, 0)}}, WaypointError, "one finite number per axis"),
        ({"corridor": PAIR, "start": {"position": [(0.5, 0.5)]}}, WaypointError, "one finite number per axis"),
        ({"corridor": PAIR, "start": {"position": ()}}, WaypointError, "one finite number per axis"),
        ({"corridor": 0.3, "start": {"position": (0, 0)}}, CorridorError, "needs a corridor of Boxes or Polytopes"),
        ({"start": {"position": (0, 0)}}, CorridorError, "needs a corridor of Boxes or Polytopes"),
        ({"corridor": PAIR, "waypoint_tolerance": 0.1}, WaypointError, "waypoint_tolerance needs waypoints"),
        (
            {"waypoints": [(0, 0), (1, 1)], "durations": [1], "start": {"position": (0, 0.1)}},
            WaypointError,
            r"start is at \(0, 0.1\) but its waypoint at \(0, 0\)",
        ),
        (
            {"waypoints": [(0, 0), (1, 1)], "durations": [1], "end": {"position": (0, 0.1)}},
            WaypointError,
            "end is at",
        ),
        (
            {"waypoints": [(0, 0), (1, 1), (3, 1)], "end": {"position": (1, 1)}},
            WaypointError,
            r"end is at \(1, 1\) but its waypoint at \(3, 1\)",
        ),
        (
            {"corridor": Boxes([[0, 0]], [[1, 1]]), "durations": [1], "closed": True, "start": {"position": (0, 0)}},
            WaypointError,
            "give neither start= nor end=",
        ),
    ],
)
def test_contradictions_and_gaps_are_named(arguments, error, message):
    with pytest.raises(error, match=message):
        minsnap.plan(**{"waypoints": None, "durations": [2, 2], **arguments})


def test_nominal_points_that_coincide_are_moved_apart_within_their_overlap():
    inside = np.array([(0.0, 0.0), (1.0, 1.0), (1.0, 1.0), (2.0, 2.0)])
    upper = np.array([(0.0, 0.0), (3.0, 5.0), (3.0, 5.0), (2.0, 2.0)])
    assert _apart(inside, upper).tolist() == [[0.0, 0.0], [1.5, 2.0], [1.0, 1.0], [2.0, 2.0]]
    start = _apart(inside[[1, 1, 3]], upper[[1, 1, 3]])
    assert start.tolist() == [[1.0, 1.0], [1.0 + 2.0 / 3.0, 1.0 + 4.0 / 3.0], [2.0, 2.0]]


@pytest.mark.parametrize("count", (2, 3, 4, 5, 6))
@pytest.mark.parametrize("ends", ((0.1, 0.8), (0.5, 0.5)))
def test_sets_that_overlap_alike_several_times_leave_every_leg_a_length(count, ends):
    start, end = (np.array((x, x)) for x in ends)
    alike = Boxes([[0.0, 0.0]] * count, [[1.0, 1.0]] * count)
    for found in (place(None, [alike], start, end), place(None, [alike], closed=True)):
        assert (np.diff(found.points, axis=0) != 0.0).any(axis=1).all()
        assert not found.points.flags.writeable
    assert (found.points[0] == found.points[-1]).all(), "closed"


def test_back_and_forth_between_two_boxes_is_a_closed_lap():
    for boxes in (PAIR, Boxes(PAIR.lower[::-1], PAIR.upper[::-1])):
        assert place(None, [boxes], closed=True).points[0] == pytest.approx([2.5, 0.5])
    lap = minsnap.plan(None, total_time=4.0, corridor=PAIR, closed=True)
    assert lap.report.corridor_margin >= 0.0 and lap(0.0) == pytest.approx(lap(lap.duration))


@pytest.mark.parametrize("turned", (1, -1))
def test_a_closed_lap_needs_its_first_set_to_meet_its_last(turned):
    row = Boxes([[0, 0], [2, 0], [4, 0]][::turned], [[3, 1], [5, 1], [7, 1]][::turned])
    with pytest.raises(CorridorError, match="closed"):
        place(None, [row], closed=True)


def test_neither_end_of_a_closed_lap_is_given():
    at = np.array((0.5, 0.5))
    for first, last in ((at, None), (None, at)):
        with pytest.raises(WaypointError, match="give neither start= nor end="):
            place(None, [PAIR], first, last, True)


@pytest.mark.parametrize("tolerance", (-0.1, "wide", [0.1, 0.1], [0.1, -0.1, 0.1]))
def test_tolerances_are_distances_one_for_each_waypoint_or_one_for_all(tolerance):
    give = r"^waypoint_tolerance is .*: give one finite number of 0 or more \[m\], or one for each of 3 waypoints$"
    with pytest.raises(WaypointError, match=give):
        as_knots([(0, 0), (1, 1), (2, 0)], tolerance)


def test_states_at_the_ends_are_kept_without_their_positions():
    start, end = {"position": (0.0, 0.0), "velocity": (1.0, 0.0)}, {"velocity": (0.0, 2.0)}
    position, rest = check_position(start, "start")
    assert position.tolist() == [0.0, 0.0] and rest == {"velocity": (1.0, 0.0)}
    assert check_position(end, "end") == (None, end) and check_position(None, "end") == (None, None)
