"""Flights through unknown forests, judged by a ray caster and by samples of what was known at each instant."""

import numpy as np
import pytest

import minsnap
from minsnap.errors import CorridorError, InfeasibleError, InputError, MinsnapError, TimingError, WaypointError

LIMITS = minsnap.Limits(speed=3.0, acceleration=6.0, jerk=30.0)
CLEARANCE, RANGE, STEP, BUDGET = 0.35, 6.0, 0.2, 0.1
GOAL = np.array([14.0, 0.0])


def trunks(seed: int) -> np.ndarray:
    """Return (x, y, radius) of trunks between the origin and the goal."""
    rng = np.random.default_rng(seed)
    found = np.column_stack((rng.uniform(1.5, 12.5, 18), rng.uniform(-4.0, 4.0, 18), rng.uniform(0.2, 0.45, 18)))
    return found[np.minimum(np.linalg.norm(found[:, :2], axis=1), np.linalg.norm(found[:, :2] - GOAL, axis=1)) > 1.6]


def ring(center: np.ndarray, radius: float) -> np.ndarray:
    angle = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    return np.column_stack((center + radius * np.stack((np.cos(angle), np.sin(angle)), axis=1), np.full(40, 0.3)))


def cast(place: np.ndarray, scene: np.ndarray, rays: int = 360) -> tuple[np.ndarray, np.ndarray]:
    """Return where rays meet a trunk first, by the quadratic formula, and the ends of those that meet none."""
    hits, ends = [], []
    for angle in np.arange(rays) * 2.0 * np.pi / rays:
        ray = np.array([np.cos(angle), np.sin(angle)])
        to = place - scene[:, :2]
        half, rest = to @ ray, (to**2).sum(axis=1) - scene[:, 2] ** 2
        root = half**2 - rest
        meets = (root >= 0.0) & (half < 0.0)
        length = (-half[meets] - np.sqrt(root[meets])).min(initial=np.inf)
        (hits if length <= RANGE else ends).append(place + min(length, RANGE) * ray)
    return np.array(hits).reshape(-1, 2), np.array(ends).reshape(-1, 2)


def gap(path: np.ndarray, scene: np.ndarray) -> float:
    return float((np.linalg.norm(path[:, None] - scene[:, :2], axis=2) - scene[:, 2]).min())


def explorer(**other) -> minsnap.routes.Explorer:
    """An Explorer whose clock stands still, so that every search ends by itself."""
    options = {"limits": LIMITS, "clearance": CLEARANCE, "sensing": RANGE, "clock": lambda: 0.0} | other
    return minsnap.routes.Explorer(options.pop("goal", GOAL), **options)


def assert_inside_known(found: minsnap.routes.Explorer, curve: minsnap.Trajectory, hits: np.ndarray) -> None:
    """Samples of a curve are away from all points seen, and circles around them in cells that are known."""
    angle = np.linspace(0.0, 2.0 * np.pi, 24)
    circle = (CLEARANCE - 1e-6) * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    places = curve(np.linspace(0.0, curve.duration, 300))
    cells = np.unique(np.floor((places[:, None] + circle).reshape(-1, 2) / found.known.size).astype(int), axis=0)
    assert (found.known.states[tuple((cells - found.known.first).T)] > 0).all()
    assert np.linalg.norm(places[:, None] - hits, axis=2).min(initial=np.inf) > CLEARANCE - 1e-6


def fly(found: minsnap.routes.Explorer, scene: np.ndarray, observe=lambda step: True):
    """Fly until the goal is reached or the vehicle is at rest with an error: the path, and the last error."""
    hits, ends = cast(np.zeros(2), scene)
    found.observe((0.0, 0.0), hits, ends)
    flown, now, path, last = found.replan(None, 0.0).trajectory, 0.0, [], None
    for step in range(150):
        place = flown(min(now, flown.duration))
        if observe(step):
            more, ends = cast(place, scene)
            found.observe(place, more, ends)
            hits = np.concatenate((hits, more))
        until, change = now + STEP, None
        try:
            change = found.replan(flown, now, BUDGET)
            until = change.splice
            for curve in (change.trajectory,) if change.stop is None else (change.trajectory, change.stop):
                if change.certified or curve is change.stop:
                    assert_inside_known(found, curve, hits)
        except MinsnapError as error:
            last = error
        path.append(flown(np.minimum(np.linspace(now, until, 20), flown.duration)))
        ended, now = now >= flown.duration, until
        if change is not None:
            safe = change.certified or change.stop is None
            flown, now = change.trajectory if safe else change.stop, 0.0
        elif ended:
            break
    return np.concatenate(path), last


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_forests_are_flown_without_a_collision_and_stops_are_inside_what_is_known(seed):
    scene = trunks(seed)
    path, _ = fly(explorer(), scene)
    np.testing.assert_allclose(path[-1], GOAL, atol=1e-6)
    assert gap(path, scene) > CLEARANCE - 0.1


@pytest.mark.slow
def test_lost_and_late_observations_delay_the_flight_alone():
    scene = trunks(1)
    path, _ = fly(explorer(), scene, lambda step: step % 4 == 3)
    np.testing.assert_allclose(path[-1], GOAL, atol=1e-6)
    assert gap(path, scene) > CLEARANCE - 0.1


@pytest.mark.slow
def test_false_observations_lead_to_longer_flights_or_rest_and_never_to_what_is_not_known():
    """Points where nothing is are seen now and then, and rays that pass a trunk; what was seen occupied stays so."""
    scene, rng, found = trunks(2), np.random.default_rng(5), explorer()
    observe = found.observe

    def falsified(position, points, rays):
        ghosts = np.asarray(position) + rng.uniform(2.0, 5.0) * np.array([[1.0, rng.uniform(-1.0, 1.0)]])
        through = np.asarray(points)[:3] + 0.5 * (np.asarray(points)[:3] - position)
        observe(position, np.concatenate((points, ghosts[: int(rng.random() < 0.15)])), np.concatenate((rays, through)))

    found.observe = falsified
    path, error = fly(found, scene)
    assert gap(path, scene) > CLEARANCE - 0.1
    arrived = np.linalg.norm(path[-1] - GOAL) < 1e-6
    assert arrived or (error is not None and np.linalg.norm(path[-1] - path[-2]) < 1e-9)


@pytest.mark.slow
def test_a_goal_that_is_closed_off_is_said_and_the_vehicle_rests():
    scene = ring(np.array([7.0, 0.0]), 2.5)
    path, error = fly(explorer(goal=(7.0, 0.0)), scene)
    assert isinstance(error, InfeasibleError)
    assert "m" in str(error)
    np.testing.assert_allclose(path[-1], path[-2], atol=1e-9)
    assert gap(path, scene) > CLEARANCE - 0.1


def test_nothing_in_sight_leads_straight_on():
    found = explorer(goal=(4.0, 0.0), unknown="free")
    found.observe((0.0, 0.0), [])
    change = found.replan(None, 0.0)
    np.testing.assert_allclose(change.trajectory(change.trajectory.duration), (4.0, 0.0), atol=1e-9)
    assert minsnap.certify(change.trajectory, limits=LIMITS).ok


def test_without_free_rays_nothing_is_known_and_nothing_flown():
    found = explorer()
    found.observe((0.0, 0.0), [])
    with pytest.raises(InfeasibleError, match=r"no more is seen of a way"):
        found.replan(None, 0.0)


def test_the_end_of_a_plan_is_where_to_observe_next():
    found = explorer()
    found.observe((0.0, 0.0), *cast(np.zeros(2), trunks(0)[:0]))
    flown = found.replan(None, 0.0).trajectory
    with pytest.raises(InfeasibleError, match=r"fly there, and observe"):
        found.replan(flown, flown.duration, BUDGET)
    end = flown(flown.duration)
    found.observe(end, *cast(end, trunks(0)[:0]))
    onwards = found.replan(None, 0.0).trajectory
    np.testing.assert_allclose(onwards(0.0), end, atol=1e-9)
    assert onwards(onwards.duration)[0] > end[0] + 2.0


def test_in_space_a_pillar_is_passed_inside_what_is_known():
    found = explorer(goal=(3.0, 0.0, 1.0), resolution=0.3, sensing=4.0)
    rng = np.random.default_rng(0)
    rays = rng.normal(size=(3000, 3))
    ends = np.array([0.0, 0.0, 1.0]) + 4.0 * rays / np.linalg.norm(rays, axis=1, keepdims=True)
    post = np.array([(1.5, y, z) for y in (-0.1, 0.1) for z in np.arange(0.0, 2.0, 0.1)])
    found.observe((0.0, 0.0, 1.0), post, ends)
    curve = found.replan(None, 0.0).trajectory
    apart = np.linalg.norm(curve(np.linspace(0.0, curve.duration, 300))[:, None] - post, axis=2)
    assert apart.min() > CLEARANCE
    cells = np.floor(curve(np.linspace(0.0, curve.duration, 300)) / found.known.size).astype(int)
    assert (found.known.states[tuple((cells - found.known.first).T)] == 1).all()
    assert curve(curve.duration)[0] > 1.0


def test_a_goal_beside_what_was_seen_is_refused():
    found = explorer(goal=(3.0, 0.0), unknown="free")
    found.observe((0.0, 0.0), [(3.1, 0.0)])
    with pytest.raises(InfeasibleError, match=r"closed off"):
        found.replan(None, 0.0)


def test_occupied_wins_over_free_whichever_comes_first():
    for order in (1, -1):
        found = explorer()
        for points, rays in [([(2.1, 0.1)], []), ([], [(5.0, 0.1)])][::order]:
            found.observe((0.1, 0.1), points, rays)
        assert [found.known.window(np.array([x, 0]), np.array([x + 1, 1])).item() for x in (7, 8)] == [1, 2]


def test_a_false_observation_ahead_is_flown_around():
    found = explorer(goal=(5.0, 0.0))
    found.observe((0.0, 0.0), *cast(np.zeros(2), trunks(0)[:0]))
    flown = found.replan(None, 0.0).trajectory
    found.observe((0.0, 0.0), [(3.0, 0.0)])
    change = found.replan(flown, 0.3, BUDGET)
    assert not change.kept
    assert (
        np.linalg.norm(change.trajectory(np.linspace(0, change.trajectory.duration, 500)) - (3.0, 0.0), axis=1).min()
        > CLEARANCE
    )
    assert_inside_known(found, change.stop, np.array([(3.0, 0.0)]))


@pytest.mark.parametrize(
    ("position", "points", "rays", "words"),
    [
        ((np.nan, 0.0), [], None, "position of the sensor"),
        ((0.0, 0.0, 0.0), [], None, "position of the sensor"),
        ((0.0, 0.0), [(1.0, 1.0), (np.nan, 1.0)], None, r"point 1 of the points is \(nan, 1\): give finite"),
        ((0.0, 0.0), [(1.0, 1.0), (1e300, 1.0)], None, r"point 1 of the points is \(1e\+300, 1\)"),
        ((0.0, 0.0), [(1.0, 1.0, 1.0)], None, "points are"),
        ((0.0, 0.0), [], [(np.inf, 0.0), (0.0, np.nan)], r"point 0 of the ends of rays is \(inf, 0\), and 1 more"),
    ],
)
def test_malformed_observations_are_refused_whole(position, points, rays, words):
    found = explorer()
    with pytest.raises(InputError, match=words):
        found.observe(position, points, rays)
    assert not found.known.states.size


def test_the_first_replan_needs_an_observation():
    with pytest.raises(InputError, match="nothing was observed"):
        explorer().replan(None, 0.0)


def test_time_that_goes_back_is_refused():
    found = explorer(goal=(5.0, 0.0))
    found.observe((0.0, 0.0), *cast(np.zeros(2), trunks(0)[:0]))
    flown = found.replan(None, 0.0).trajectory
    found.replan(flown, 0.4, BUDGET)
    with pytest.raises(TimingError, match="0.2 s after 0.4 s"):
        found.replan(flown, 0.2, BUDGET)


@pytest.mark.parametrize(
    ("wrong", "error"),
    [({"goal": (1.0,)}, WaypointError), ({"unknown": "?"}, InputError), ({"sensing": 0.0}, InputError)],
)
def test_malformed_arguments_are_refused(wrong, error):
    with pytest.raises(error):
        explorer(**wrong)


def test_a_vehicle_that_rests_too_near_to_what_it_sees_flies_on():
    """A point is seen late beside the place where the plan ended, nearer than the clearance to its cell."""
    found = explorer(clearance=0.3, sensing=8.0)
    angle = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    around = 8.0 * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    found.observe((0.1, 0.1), [(0.28, 0.1)], (0.1, 0.1) + around)
    first = found.replan(None, 0.0).trajectory
    away = np.linalg.norm(first(np.linspace(0.0, first.duration, 500)) - (0.28, 0.1), axis=1)
    assert away.min() >= 0.18 - 1e-6 and away[-1] > 0.3
    with pytest.raises(InfeasibleError, match="nothing is known to be free by"):
        found.observe((0.1, 0.1), [(0.1, 0.1)], [])
        found.replan(None, 0.0)


def test_what_is_kept_is_certified_by_its_distance_to_what_was_seen():
    found = explorer(clearance=0.3, sensing=8.0)
    angle = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    around = 8.0 * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    found.observe((0.0, 0.0), [], around)
    first = found.replan(None, 0.0).trajectory
    place = first(2.0)
    for beside, certified in ((0.45, True), (0.2, False)):
        found.observe(first(0.2), [place + (0.0, beside)], first(0.2) + around)
        with_points = found.known.boxes(place - 1.0, place + 1.0, True)
        assert len(with_points)
        change = found.replan(first, 0.2, BUDGET)
        kept = minsnap.certify(change.trajectory, avoid=[minsnap.Cylinder(place + (0.0, beside), 0.3 - 1e-6)])
        assert change.certified and (kept.ok or not certified)


def test_an_observation_that_is_refused_leaves_all_as_it_was():
    found = explorer()
    found.observe((0.0, 0.0), *cast(np.zeros(2), trunks(0)[:0]))
    known = found.known.states.copy()
    with pytest.raises(CorridorError, match="what was observed spans more than"):
        found.observe((1e8, 0.0), [], [(1e8 + 1.0, 0.0)])
    assert (found.known.states == known).all()
    assert found.replan(None, 0.0).trajectory(0.0) == pytest.approx([0.0, 0.0])
