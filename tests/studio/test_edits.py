"""Edits keep as many widths, boxes, durations and headings as there are legs and waypoints."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from minsnap.durations.search_options import Search
from minsnap.errors import InputError, WaypointError
from minsnap.files.file_request import FileRequest
from minsnap.planning.planner import plan
from minsnap.studio import edits

CORNERS = ((0.0, 0.0, 1.0), (8.0, 0.0, 1.0), (8.0, 4.0, 1.0), (0.0, 4.0, 1.0))
FULL = edits.with_room(
    edits.with_boxes(FileRequest(CORNERS, (4.0, 2.0, 4.0), corridor=(0.3, 0.2, 0.1), yaw=(0.0, 0.1, 0.2, 0.3)), True),
    True,
)


def is_consistent(request):
    """Whether every list is as long as it must be, and every leg lies in its box and in the room."""
    legs = len(request.waypoints) - 1
    lists = (request.durations, request.corridor, request.boxes)
    if any(len(values) != legs for values in lists) or len(request.yaw) != legs + 1:
        return False
    ends = (np.array(request.waypoints[leg : leg + 2]) for leg in range(legs))
    return all((e >= low).all() and (e <= high).all() for e, (low, high) in zip(ends, request.boxes, strict=True))


STEPS = st.lists(st.tuples(st.sampled_from(["add", "delete", "earlier", "later"]), st.integers(0, 6)), max_size=8)


@given(STEPS)
def test_any_row_of_edits_leaves_a_consistent_request(steps):
    request = FULL
    for what, index in steps:
        at = min(index, len(request.waypoints) - 1)
        if what == "delete" and len(request.waypoints) == 2:
            continue
        request = {
            "add": lambda r, i: edits.insert_waypoint(r, i),
            "delete": lambda r, i: edits.delete_waypoint(r, i),
            "earlier": lambda r, i: edits.move_in_order(r, i, -1),
            "later": lambda r, i: edits.move_in_order(r, i, 1),
        }[what](request, at)
    assert is_consistent(request)


def test_a_waypoint_that_is_added_halves_its_leg():
    request = edits.insert_waypoint(FULL, 1)
    assert request.waypoints[2] == (8.0, 2.0, 1.0)
    assert request.durations == (4.0, 1.0, 1.0, 4.0)
    assert request.corridor == (0.3, 0.2, 0.2, 0.1)
    assert edits.insert_waypoint(FULL, 3).waypoints[-1] == (-4.0, 4.0, 1.0)
    assert plan(**request.request().arguments()).legs == 4


def test_a_waypoint_that_is_deleted_joins_its_legs():
    request = edits.delete_waypoint(FULL, 1)
    assert request.durations == (6.0, 4.0)
    assert request.corridor == (0.2, 0.1)
    assert edits.delete_waypoint(FULL, 0).durations == (2.0, 4.0)
    assert edits.delete_waypoint(FULL, 3).corridor == (0.3, 0.2)
    with pytest.raises(WaypointError, match="two"):
        edits.delete_waypoint(FileRequest(CORNERS[:2]), 0)


def test_the_ends_of_a_closed_lap_move_together():
    lap = FileRequest((*CORNERS, CORNERS[0]), closed=True)
    moved = edits.move_waypoint(lap, 4, (1.0, 1.0, 1.0))
    assert moved.waypoints[0] == moved.waypoints[4] == (1.0, 1.0, 1.0)
    assert edits.move_waypoint(FULL, 0, (1.0, 1.0, 1.0)).waypoints[1:] == CORNERS[1:]


def test_a_face_moves_alone_and_stops_at_the_opposite_one():
    box = ((0.0, 0.0, 0.0), (1.0, 2.0, 3.0))
    assert edits.move_face(box, 1, 1, 5.0) == ((0.0, 0.0, 0.0), (1.0, 5.0, 3.0))
    assert edits.move_face(box, 0, 0, 4.0) == ((1.0 - edits.THINNEST, 0.0, 0.0), (1.0, 2.0, 3.0))
    assert edits.move_face(box, 2, 1, -4.0)[1][2] == edits.THINNEST


def test_modes_of_time_exclude_each_other():
    limited = edits.with_time(FULL, "limits", FULL.durations, {"speed": 3.0})
    assert (limited.durations, limited.total_time, limited.limits) == (None, None, (("speed", 3.0),))
    whole = edits.with_time(limited, "total time", (1.0, 2.0, 3.0), {})
    assert (whole.durations, whole.total_time, whole.limits) == (None, 6.0, ())
    assert edits.with_time(whole, "durations", (1.0, 2.0, 3.0), {}).durations == (1.0, 2.0, 3.0)


def test_a_mode_of_time_takes_what_contradicts_it_out_of_the_search():
    asked = replace(FULL, search=Search(time_weight=5.0, on_interrupt="return"))
    for mode in ("total time", "durations"):
        assert edits.with_time(asked, mode, (1.0, 2.0, 3.0), {}).search == Search(on_interrupt="return")
    timed = replace(FULL, search=Search(split="distance", time_limit=3.0))
    assert edits.with_time(timed, "total time", (1.0, 2.0, 3.0), {}).search == Search(split="distance")
    assert edits.with_time(timed, "durations", (1.0, 2.0, 3.0), {}).search == Search(time_limit=3.0)


def test_the_last_limit_stays_where_it_gives_the_time():
    limited = edits.with_time(FULL, "limits", FULL.durations, {"speed": 3.0})
    both = edits.set_limit(limited, "acceleration", 6.0)
    assert dict(both.limits) == {"speed": 3.0, "acceleration": 6.0}
    assert dict(edits.set_limit(both, "speed", None).limits) == {"acceleration": 6.0}
    with pytest.raises(InputError, match="keep one"):
        edits.set_limit(limited, "speed", None)
