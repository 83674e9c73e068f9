"""Ways of fleets of autopilots: proved apart from where the vehicles stand before anything is sent, or refused."""

import numpy as np
import pytest

import minsnap
from minsnap.cli.flight_commands import _say_unproved
from minsnap.flight.mavlink.fleet_ways import judge_of_ways
from minsnap.flight.mavlink.offboard import prepare
from minsnap.flight.mavlink.stream_options import StreamOptions

APART = minsnap.Separation(1.0, downwash=2.0)


def lines(starts, goals, separation=APART):
    ways = [np.array(ends, dtype=float) for ends in zip(starts, goals, strict=True)]
    return minsnap.Fleet([minsnap.plan(way, [4.0]) for way in ways], ("left", "right"), separation)


def judged(fleet, places, land=False):
    """What is said of vehicles that stand at places, heights upwards."""
    tables = [prepare(curve, StreamOptions(trigger="now", frame="enu")) for curve in fleet]
    north = [(y, x, -z) for x, y, z in places]
    return judge_of_ways(fleet.separation, tables, fleet.names, land=land)(north)


BESIDE = lines([(0, 0, 2), (1.5, 0, 2)], [(0, 3, 2), (1.5, 3, 2)])


@pytest.mark.parametrize(
    ("places", "near"),
    [
        ([(0, 0, 0), (1.5, 0, 0)], None),
        ([(0.4, 0, 0), (1.9, 0, 0)], None),
        ([(0.9, 0, 0), (1.1, 0, 0)], "0.2"),
        ([(0, 0.9, 0), (0.9, 0.9, 0)], "0.9"),
        ([(0.4, 0.1, 0), (1.2, 0, 0)], "0.8062"),
        ([(1.4, 0, 2), (0.1, 0, 2)], "0"),
    ],
)
def test_ways_from_where_they_stand_are_judged(places, near):
    said = judged(BESIDE, places)
    if near is None:
        assert said is None
    else:
        assert said.startswith(
            f"left and right would come as near as {near} m, and 1 m are asked, on their ways to their"
        )


def test_ends_above_each_other_are_not_landed_on():
    stacked = lines([(0, 0, 2), (3, 0, 5)], [(2, 2, 2), (2, 2, 5)])
    places = [(0, 0, 0), (3, 0, 0)]
    assert judged(stacked, places) is None
    assert "come as near as 0 m, and 1 m are asked, as they land below their ends" in judged(stacked, places, land=True)
    assert judged(minsnap.Fleet(stacked.trajectories, stacked.names), places, land=True) is None, "nothing is asked"


@pytest.mark.parametrize(("options", "words"), [
    ({"on_abort": "rtl"}, "--on-abort rtl) is not proved apart"),
    ({"relative": True}, "if they stand as their paths begin"),
    ({"on_abort": "land"}, "left and right come within 0 m, seen from above"),
    ({}, None),
])  # fmt: skip
def test_what_is_not_proved_is_said(options, words):
    crossing, told = lines([(0, 0, 2), (3, 0, 5)], [(3, 0, 2), (0, 0, 5)]), []
    _say_unproved(crossing, StreamOptions(trigger="now", **options), told.append)
    assert (told == []) if words is None else words in told[0]
