"""Ways to come to rest: against every member of the family on a fine grid, and damaged polynomials."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from minsnap import Boxes, Limits, RoundTube, Trajectory, Tube
from minsnap.corridors.constraint import Walls
from minsnap.native.library import core, using
from minsnap.native.stops import StopFamily

pytestmark = pytest.mark.skipif(core().name != "native", reason="there is no native core")

LIMITS = Limits(speed=3.0, acceleration=6.0)
WAYPOINTS = np.array([(0.0, 0.0, 1.0), (1.2, 0.3, 1.0), (2.5, -0.4, 1.3)])
FINE = np.linspace(0.0, 1.0, 801)


def walls_of(seed):
    """Boxes, balls, or a tube of either kind."""
    random = np.random.default_rng(seed)
    room, middle = random.uniform(0.25, 0.9, size=(2, 2, 3)), (WAYPOINTS[:-1] + WAYPOINTS[1:]) / 2.0
    low, high = np.minimum(WAYPOINTS[:-1], WAYPOINTS[1:]), np.maximum(WAYPOINTS[:-1], WAYPOINTS[1:])
    return (
        Boxes(low - room[0], high + room[1]).walls(WAYPOINTS),
        [Walls.balls([0, 1], [np.eye(3)] * 2, middle, random.uniform(0.9, 1.4, 2))],
        Tube(0.4).walls(WAYPOINTS),
        RoundTube(0.5).walls(WAYPOINTS),
    )[seed % 4]


def start(seed, half):
    """On its way along the first leg."""
    random = np.random.default_rng(seed)
    state = random.normal(size=(half, 3)) * np.array([0.02, 0.3, 0.6, 2.0, 10.0])[:half, None]
    leg = WAYPOINTS[1] - WAYPOINTS[0]
    state[0] += WAYPOINTS[0] + random.uniform(0.0, 0.95) * leg
    state[1] += random.uniform(0.2, 1.8) * leg
    return state


def stops_of(state, walls, unit, limits=LIMITS):
    groups = [wall.record for wall in walls], [wall.record for wall in limits.walls(WAYPOINTS[:2])]
    return StopFamily(state, WAYPOINTS, *groups, unit)


def members(state, unit):
    """Yield duration and polynomials in t / T of the family: least integrals by three places of the end."""
    half = len(state)
    for duration in 0.6 * unit * 1.1192072 ** np.arange(24):
        known = state * duration ** np.arange(half)[:, None]
        ends = []
        for axis in known.T:
            costs = [effort(to_rest(axis, axis[0] + e), half) for e in (-1.0, 0.0, 1.0)]
            ends.append(axis[0] + 0.5 * (costs[0] - costs[2]) / (costs[0] + costs[2] - 2.0 * costs[1]))
        for reach in (0.0, -0.12, 0.12):
            yield duration, [to_rest(axis, end + reach * axis[1]) for axis, end in zip(known.T, ends, strict=True)]


def to_rest(axis, end):
    """Polynomial on [0, 1] from derivatives (k,) to rest at a place."""
    half = len(axis)
    rows = []
    for s in (0.0, 1.0):
        for order in range(half):
            basis = [Polynomial.basis(j).deriv(order)(s) if order else Polynomial.basis(j)(s) for j in range(2 * half)]
            rows.append(basis)
    return Polynomial(np.linalg.solve(np.array(rows), np.concatenate((axis, [end], np.zeros(half - 1)))))


def effort(polynomial, half):
    square = polynomial.deriv(half) ** 2
    return square.integ()(1.0) - square.integ()(0.0)


def depths(polynomials, duration, walls):
    """How far inside the walls of each leg a member is on the fine grid, (2, m), negative outside."""
    depth = np.full((2, len(FINE)), np.inf)
    for wall in walls:
        curves = [p.deriv(wall.order) if wall.order else p for p in polynomials]
        values = np.stack([p(FINE) for p in curves], axis=1) / duration**wall.order
        for leg in (0, 1):
            own = wall.leg == leg
            if own.any():
                depth[leg] = np.minimum(depth[leg], wall.slack(values[None])[own].min(axis=0))
    return depth


@pytest.mark.parametrize("seed", range(24))
@pytest.mark.parametrize("half", [4, 5])
def test_the_first_stop_is_inside_and_no_shorter_member_was_clearly_inside(seed, half):
    walls, state, unit = walls_of(seed), start(seed, half), 0.5
    bounds = LIMITS.walls(WAYPOINTS[:2])
    found = next(stops_of(state, walls, unit).members(), None)
    for duration, polynomials in members(state, unit):
        if found is not None and duration > found.durations.sum() * (1.0 - 1e-9):
            break
        if depths(polynomials, duration, bounds)[0].min() < 0.01:
            continue
        assert seed % 4 > 1 or depths(polynomials, duration, walls)[0].min() <= 0.01, "tubes end beyond the waypoint"
    if found is None:
        return
    curve, t = Trajectory(found.points, found.durations), FINE * found.durations.sum()
    for order in range(half):
        assert curve(0.0, order) == pytest.approx(state[order], rel=1e-9, abs=1e-9)
        assert order == 0 or np.abs(curve(curve.duration, order)).max() < 1e-6
    for leg, (points, duration) in enumerate(zip(found.points, found.durations, strict=True)):
        part = Trajectory(points[None], np.array([duration]))
        for wall in walls:
            own = wall.leg == leg
            assert (wall.slack(part(FINE * duration, wall.order)[None])[own] >= -1e-12).all()
    fastest, strongest = (np.linalg.norm(curve(t, order), axis=1).max() for order in (1, 2))
    assert found.limited == (fastest <= 3.0 * (1.0 + 2e-9) and strongest <= 6.0 * (1.0 + 2e-9))


def test_stops_of_one_leg_and_of_two_and_none_are_among_these():
    kinds = set()
    for seed in range(24):
        found = next(stops_of(start(seed, 4), walls_of(seed), 0.5).members(), None)
        kinds.add(None if found is None else len(found.points))
    assert kinds == {None, 1, 2}


@pytest.mark.parametrize("place", [0, 1, 2, 3, -2, -4])
def test_a_polynomial_that_begins_elsewhere_or_does_not_rest_is_no_stop(place):
    state = start(1, 4)
    stops = stops_of(state, [], 0.5)
    stop = next(stops.members())
    duration, points = float(stop.durations[0]), stop.points[0] - state[0]
    assert stops.proved(duration, points).points == pytest.approx(stop.points, abs=1e-12)
    points[place] += 1e-5
    assert stops.proved(duration, points) is None


def test_a_polynomial_that_leaves_a_wall_is_no_stop_and_one_beyond_a_limit_is_said_to_be():
    state = start(1, 4)
    stop = next(stops_of(state, [], 0.5).members())
    duration, points = float(stop.durations[0]), stop.points[0] - state[0]
    curve = Trajectory(stop.points, stop.durations)
    low, high = (np.array([curve.extent(axis)[side] for axis in np.eye(3)]) for side in (0, 1))
    for room, kept in ((1e-6, True), (-1e-6, False)):
        walls = Boxes([low - room] * 2, [high + room] * 2).walls(WAYPOINTS)
        assert (stops_of(state, walls, 0.5).proved(duration, points) is not None) == kept
        slower = Limits(speed=curve.max_norm(1)[0] + room)
        assert stops_of(state, [], 0.5, slower).proved(duration, points).limited == kept


def test_there_are_none_without_the_native_core_or_for_what_is_no_number():
    state = start(1, 4)
    with using("python"):
        assert list(stops_of(state, [], 0.5).members()) == []
    state[1, 0] = np.nan
    assert list(stops_of(state, [], 0.5).members()) == []
    assert list(stops_of(start(1, 4), [], 0.0).members()) == []
