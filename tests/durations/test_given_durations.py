"""Limits that are no walls of the QP, in durations that are given: a search of the curve alone."""

import numpy as np
import pytest
from tasks import REFERENCE, random_legs, task_of

import minsnap
from minsnap import Limits
from minsnap.durations import within_limits
from minsnap.durations.strategy import Strategy
from minsnap.durations.timing import Timing
from minsnap.errors import UnprovedError
from minsnap.native.library import Core, core
from minsnap.optimisation.solve import solve
from minsnap.vehicle import Quadrotor

pytestmark = pytest.mark.skipif(core().name != "native", reason="there is no native core")

RATES = Limits(speed=4.0, body_rate=2.0, max_thrust=2.0, tilt=1.0)
ROTORS = Limits.of(Quadrotor.dji_f330(), speed=4.0)


@pytest.mark.parametrize("pieces", [1, 2])
@pytest.mark.parametrize("closed", [False, True])
def test_the_least_cost_is_found_as_by_the_qp(closed, pieces):
    """Of limits that are walls too: the search begins from the curve without them."""
    durations = np.repeat([2.9, 1.9, 2.9, 2.2], pieces) * (0.85 if closed else 1.2) / pieces
    limits = Limits(speed=3.6, acceleration=3.0)
    task, walled = (task_of(REFERENCE, limits=one, pieces=pieces, closed=closed) for one in (None, limits))
    free, least = solve(task, durations), solve(walled, durations)
    found = Strategy(task, Timing(durations, limits=limits)).cheapest_in_durations(free, durations)
    assert least.trajectory.cost() > 1.01 * free.trajectory.cost()
    assert found.inside and least.trajectory.cost() <= found.trajectory.cost() * (1 + 1e-9)
    assert found.trajectory.cost() <= 1.01 * least.trajectory.cost()


@pytest.mark.parametrize(
    "asked", [{"pieces": 1}, {"closed": True, "pieces": 1}, {"corridor": 0.6, "waypoint_tolerance": 0.2, "pieces": 3}]
)
@pytest.mark.parametrize("limits", [RATES, ROTORS], ids=["rates", "rotors"])
def test_durations_near_the_shortest_have_a_plan(limits, asked):
    points, _ = random_legs(3, 4)
    points = np.vstack((2.0 * points + [0, 0, 5], 2.0 * points[:1] + [0, 0, 5]))
    shortest = minsnap.plan(points, limits=limits, **asked)
    durations = 1.02 * np.diff(shortest.leg_breaks)
    path = minsnap.plan(points, durations, limits=limits, **asked)
    assert np.diff(path.leg_breaks) == pytest.approx(durations, rel=1e-14)
    assert minsnap.certify(path, limits=limits).ok
    assert path.cost() < shortest.stretched(1.02).cost()


def test_a_total_in_proportions_is_kept_too():
    split = minsnap.Search(split="distance")
    path = minsnap.plan(REFERENCE, total_time=7.0, limits=Limits(body_rate=2.0), search=split)
    assert path.report.solver == "interior point" and minsnap.certify(path, limits=Limits(body_rate=2.0)).ok


@pytest.mark.parametrize("limits", [Limits(body_rate=0.8), ROTORS], ids=["rate", "rotors"])
@pytest.mark.parametrize("pinned", [{"start": {"velocity": (1.5, 0.4, 0)}}, {"pins": {2: {"velocity": (-1, 0.3, 0)}}}])
def test_a_total_longer_than_the_shortest_is_kept_where_states_do_not_scale(pinned, limits):
    total = 1.05 * minsnap.plan(REFERENCE, limits=limits, pieces=1, **pinned).duration
    path = minsnap.plan(REFERENCE, total_time=total, limits=limits, **pinned)
    assert path.duration == pytest.approx(total) and minsnap.certify(path, limits=limits).ok


def test_what_a_search_in_held_durations_tells_is_in_the_report():
    asked = {"limits": Limits(body_rate=0.8), "start": {"velocity": (1.5, 0.4, 0.0)}}
    total, told = 1.05 * minsnap.plan(REFERENCE, pieces=1, **asked).duration, []
    path = minsnap.plan(REFERENCE, **asked, total_time=total, progress=told.append)
    assert path.report.solver == "interior point" and len(path.report.steps) == len(told) > 0
    assert not path.report.interrupted


def test_without_the_native_core_the_time_that_would_do_is_named(monkeypatch):
    monkeypatch.setattr(within_limits, "core", lambda: Core(None, "left out"))
    with pytest.raises(UnprovedError, match="s would do in these proportions"):
        minsnap.plan([(0, 0, 0), (2, 0, 0), (2, 2, 1)], [0.9, 1.0], limits=Limits(speed=5.0, body_rate=2.5))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pieces", "points"),
    [
        ("auto", [(1.38, 4.67, 3.83), (1.86, 5.77, 3.0), (0.67, 6.73, 3.55)]),
        (3, [(1.77, -2.01, 3.77), (-3.27, -0.07, 3.0), (-1.21, 0.87, 4.47)]),
    ],
)
def test_several_pieces_are_flown_where_their_search_finds_no_end(pieces, points):
    """Rotors near free fall. Plans with one piece a leg were returned, which take 13 and 22 % longer."""
    path, alone = (minsnap.plan(points, limits=ROTORS, pieces=one) for one in (pieces, 1))
    assert path.duration < 0.9 * alone.duration and minsnap.certify(path, limits=ROTORS).ok
