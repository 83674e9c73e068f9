"""Setpoints exchanged at a splice, against those of the trajectories themselves."""

import numpy as np
import pytest

import minsnap
from minsnap.errors import FlightError, InputError, TimingError
from minsnap.flight.mavlink.setpoints import ChangingTable, tabulate
from minsnap.replanning.splice import splice_of

POINTS = np.array([(0, 0, 1), (2, 0.5, 1), (4, 0, 1.2), (6, 1, 1)], dtype=float)
RATE = 20.0


@pytest.fixture
def flown():
    return minsnap.plan(POINTS, durations=[1.0, 1.2, 0.9], yaw=0.4)


def table_of(path, **options):
    return ChangingTable(tabulate(path.sample(RATE), frame="ned", **options))


def in_ned(position):
    return (position[1], position[0], -position[2])


def elsewhere(flown, splice):
    state = {name: flown(splice, order) for order, name in enumerate(("position", "velocity", "acceleration", "jerk"))}
    points = np.array([state["position"], (4.0, 1.0, 1.5), (5.0, 3.0, 1.5)])
    return minsnap.plan(points, durations=[1.5, 1.7], start=state, yaw=0.4)


@pytest.mark.parametrize("splice", [0.5, 0.523, 1.049])
def test_setpoints_are_those_of_the_new_trajectory_from_the_splice_on(flown, splice):
    table, change = table_of(flown), elsewhere(flown, splice)
    old = [table[k] for k in range(len(table))]
    table.exchange(table.prepare(change, splice), 0.4)
    for index in range(len(table) - 1):
        t = index / RATE
        path, at = (flown, t) if t < splice - 1e-9 else (change, min(t - splice, change.duration))
        assert table[index].position == pytest.approx(in_ned(path(at)), abs=1e-9)
        assert table[index].velocity == pytest.approx(in_ned(path(at, 1)), abs=1e-9)
    first = int(np.ceil(splice * RATE))
    assert [table[k] for k in range(first)] == old[:first]
    assert table[10**6].position == pytest.approx(in_ned(change(change.duration)), abs=1e-9)
    assert len(table) == pytest.approx(1 + np.ceil((splice + change.duration) * RATE), abs=1)


def test_changes_follow_each_other_on_their_own_clocks(flown):
    table = table_of(flown)
    first = elsewhere(flown, 0.5)
    table.exchange(table.prepare(first, 0.5), 0.0)
    rest = splice_of(first, 0.2, 0.1, 4).rest
    table.exchange(table.prepare(rest, 0.3), 0.6)
    assert table.began == pytest.approx(0.8)
    assert table[30].position == pytest.approx(in_ned(first(1.0)), abs=1e-8)


def test_what_is_late_is_refused_with_how_late(flown):
    table = table_of(flown)
    prepared = table.prepare(elsewhere(flown, 0.5), 0.5)
    with pytest.raises(TimingError, match=r"takes over at 0.5 s of the flight, 0.05 s ago: it is too late"):
        table.exchange(prepared, 0.55)
    assert table.began == 0.0


def test_only_one_of_two_changes_of_the_same_plan_is_taken(flown):
    table = table_of(flown)
    first, second = (table.prepare(elsewhere(flown, splice), splice) for splice in (0.5, 0.6))
    table.exchange(first, 0.0)
    with pytest.raises(FlightError, match="another change was taken over meanwhile"):
        table.exchange(second, 0.0)


def test_jumps_are_refused(flown):
    table, change = table_of(flown), elsewhere(flown, 0.5)
    with pytest.raises(FlightError, match=r"begins 0\.\d+ m from the setpoint at its splice"):
        table.prepare(change, 0.8)
    turned = minsnap.plan(
        np.array([flown(0.5), POINTS[2]]), durations=[2.0], start={"velocity": flown(0.5, 1) + [0.0, 0.5, 0.0]}
    )
    with pytest.raises(FlightError, match=r"begins 0\.5 m/s off the velocity flown then"):
        table.prepare(turned, 0.5)


def test_what_cannot_be_changed_is_refused(flown):
    flat = minsnap.plan(POINTS[:, :2], durations=[1.0, 1.2, 0.9])
    with pytest.raises(InputError, match="three coordinates, this trajectory has 2"):
        table_of(flown).prepare(flat, 0.5)
    with pytest.raises(TimingError, match="takes over at 9 s, after the flight ends at"):
        table_of(flown).prepare(flown, 9.0)
    lap = minsnap.plan(np.vstack((POINTS, POINTS[:1])), durations=[1.0, 1.2, 0.9, 2.0])
    with pytest.raises(InputError, match="2 laps are flown"):
        table_of(lap, laps=2).prepare(lap, 0.5)
