"""Plans of fleets: certified, as fast as symmetry says, the same with any number of threads; refusals."""

import _thread

import numpy as np
import pytest
from oracles.fleet_bounds import faults
from random_fleets import certified_or_refused, random_fleet

import minsnap
from minsnap.errors import FleetError, InputError, TimingError, UnprovedError, YawError
from minsnap.fleet.first_guess import uniform

AXIS = minsnap.Limits(speed=1.5, acceleration=3.0, norm="axis")
APART = minsnap.Separation(0.3, downwash=2.0)


def antipodal(count, radius=2.0):
    """Return starts and goals on a circle, each opposite of the other, shape (count, 2, 3)."""
    angle = 2.0 * np.pi * np.arange(count) / count
    starts = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.ones(count)], axis=1)
    return np.stack((starts, starts * [-1.0, -1.0, 1.0]), axis=1)


def test_crossing_vehicles_are_certified_near_the_time_of_one_alone():
    limits, room = minsnap.Limits(speed=1.5, acceleration=3.0), ((-3.0, -3.0, 0.0), (3.0, 3.0, 2.0))
    fleet = minsnap.plan_fleet(antipodal(6), limits, APART, room=room)
    alone = minsnap.plan_fleet(antipodal(6)[:1], limits)
    found = minsnap.certify_fleet(fleet, limits=limits, room=room)
    assert found.ok
    assert fleet.report.method == "joint"
    assert fleet.report.bound <= alone.duration <= fleet.duration <= 1.08 * alone.duration
    ends = fleet([0.0, fleet.duration])
    assert ends == pytest.approx(antipodal(6), abs=1e-12)
    assert np.abs(fleet([0.0, fleet.duration], 1)).max() <= 1e-9
    assert all(minsnap.certify(curve).continuity >= 3 for curve in fleet)
    t = np.linspace(0.0, fleet.duration, 4001)
    places = fleet(t) * [1.0, 1.0, 0.5]
    sampled = min(np.sqrt(((places[i] - places[j]) ** 2).sum(axis=1)).min() for i in range(6) for j in range(i))
    assert found.least_distance <= sampled <= found.least_distance + 1e-3


def test_the_same_seed_gives_the_same_bits_with_any_number_of_threads():
    one, three = (minsnap.plan_fleet(antipodal(7), AXIS, APART, threads=threads) for threads in (1, 3))
    for a, b in zip(one, three, strict=True):
        assert (a.control_points == b.control_points).all()
        assert (a.durations == b.durations).all()


def test_permuted_and_mirrored_fleets_take_the_same_time():
    asked = antipodal(5)
    asked[2, 1] += [0.3, 0.2, 0.4]
    plain = minsnap.plan_fleet(asked, AXIS, APART)
    permuted = minsnap.plan_fleet(asked[[3, 0, 4, 1, 2]], AXIS, APART)
    mirrored = minsnap.plan_fleet(asked * [-1.0, 1.0, 1.0], AXIS, APART)
    assert permuted.duration == pytest.approx(plain.duration, rel=0.01)
    assert mirrored.duration == pytest.approx(plain.duration, rel=0.01)


def test_a_turned_mission_takes_the_same_time():
    limits, turn = (
        minsnap.Limits(speed=1.5, acceleration=3.0),
        np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]]),
    )
    plain, turned = (minsnap.plan_fleet(antipodal(5) @ each.T, limits, APART) for each in (np.eye(3), turn))
    assert turned.duration == pytest.approx(plain.duration, rel=0.01)


def test_the_fleet_of_one_vehicle_is_its_plan():
    fleet = minsnap.plan_fleet([LINE], AXIS, APART)
    assert (fleet[0].control_points == minsnap.plan(LINE, limits=AXIS).control_points).all()
    bend = [*LINE, (4.0, 3.0, 2.0)]
    assert minsnap.plan_fleet([bend], AXIS)[0].durations == pytest.approx(minsnap.plan(bend, limits=AXIS).durations)
    slow = minsnap.plan_fleet([LINE], total_time=9.0, room=((-1, -1, 0), (5, 1, 2)))
    assert slow.duration == pytest.approx(9.0)


@pytest.mark.slow
def test_waypoints_are_passed_when_it_is_best():
    """Two vehicles 50 m apart took up to 1.70 times as long as the slower one alone, and 1.17 in the median."""
    limits, shares = minsnap.Limits(speed=3.0, acceleration=5.0), []
    for seed in range(8):
        draw = np.random.default_rng(seed)
        count = int(draw.integers(3, 6))
        ways = [draw.uniform((-4, -4, 0), (4, 4, 4), (count, 3)) + [50 * i, 0, 0] for i in range(2)]
        alone = max(minsnap.plan(way, limits=limits, pieces=3).duration for way in ways)
        fleet = minsnap.plan_fleet(ways, limits, 0.4)
        shares.append(fleet.duration / alone)
        for way, curve in zip(ways, fleet, strict=True):
            assert all(min(np.linalg.norm(curve(curve.breaks) - point, axis=1)) < 1e-9 for point in way)
    assert max(shares) < 1.1 and np.median(shares) < 1.03, shares


def test_vehicles_whose_waypoints_are_near_pass_them_at_different_instants():
    fleet = minsnap.plan_fleet([np.array(way) + (0.0, 0.0, 0.3 * i) for i, way in enumerate(MEETING)], AXIS, 0.5)
    assert minsnap.certify_fleet(fleet, 0.5, AXIS).ok


def test_straight_lines_are_taken_where_they_are_apart():
    starts = np.array([(float(i), float(j), 1.0) for i in range(5) for j in range(5)])
    fleet = minsnap.plan_fleet(np.stack((starts, starts + [9.0, 2.0, 1.0]), axis=1), AXIS, APART)
    assert fleet.report.method == "straight"
    assert minsnap.certify_fleet(fleet, limits=AXIS).ok
    assert fleet.duration <= 1.05 * fleet.report.bound
    along = fleet(np.linspace(0.0, fleet.duration, 50)) - starts[:, None]
    assert np.abs(np.cross(along, [9.0, 2.0, 1.0])).max() <= 1e-9


def test_obstacles_waypoints_and_moving_starts():
    pillar = minsnap.Cylinder((1.0, 0.05), 0.4)
    over = minsnap.Ellipsoid((3.0, 2.0, 1.0), (0.3, 0.3, 0.5))
    box = minsnap.Cuboid((1.5, -2.0, 0.0), (2.5, -0.8, 2.0))
    ways = [
        [(0.0, 0.0, 1.0), (2.0, 0.0, 1.0), (4.0, 1.0, 1.0)],
        [(4.0, 0.0, 1.0), (0.0, -1.5, 1.0)],
        [(3.0, 3.0, 1.0), (3.0, 1.0, 1.2)],
    ]
    room = ((-1.0, -3.0, 0.2), (5.0, 4.0, 2.0))
    start = [None, {"velocity": (-0.5, 0.0, 0.0)}, None]
    avoid = [pillar, over, box]
    fleet = minsnap.plan_fleet(ways, AXIS, APART, room=room, avoid=avoid, start=start)
    assert minsnap.certify_fleet(fleet, limits=AXIS, room=room, avoid=avoid).ok
    assert fleet[1](0.0, 1) == pytest.approx([-0.5, 0.0, 0.0], abs=1e-12)
    assert np.abs(fleet[0](fleet[0].breaks) - [2.0, 0.0, 1.0]).sum(axis=1).min() <= 1e-12


def test_corridors_of_single_vehicles_are_kept():
    ways = [[(0.0, 0.0, 1.0), (3.0, 0.0, 1.0), (3.0, 3.0, 1.0)], [(3.0, 2.0, 1.0), (0.0, 0.3, 1.0)]]
    boxes = minsnap.Boxes([(-0.2, -0.2, 0.8), (2.8, -0.2, 0.8)], [(3.2, 0.2, 1.2), (3.2, 3.2, 1.2)])
    fleet = minsnap.plan_fleet(ways, AXIS, APART, corridors=[boxes, None])
    assert minsnap.certify_fleet(fleet, limits=AXIS).ok
    t = np.linspace(0.0, fleet.duration, 2001)
    places = fleet[0](t)
    corner = t[np.abs(places - [3.0, 0.0, 1.0]).sum(axis=1).argmin()]
    for inside, low, high in zip((t <= corner, t > corner), boxes.lower, boxes.upper, strict=True):
        assert (places[inside] >= low - 5e-3).all()
        assert (places[inside] <= high + 5e-3).all()


def test_fixed_vehicles_are_flown_around():
    flown = minsnap.plan([(0.0, -2.0, 1.0), (0.0, 2.0, 1.0)], total_time=4.0)
    fleet = minsnap.plan_fleet([[(-2.0, 0.0, 1.0), (2.0, 0.0, 1.0)]], AXIS, APART, fixed=[flown])
    assert len(fleet) == 2
    assert fleet[1] is flown
    assert minsnap.certify_fleet(fleet, APART).ok
    assert minsnap.certify_fleet([fleet[0]], limits=AXIS).ok


def test_a_given_time_is_kept_and_more_of_it_takes_less_snap():
    short, long = (minsnap.plan_fleet(antipodal(4), separation=APART, total_time=time) for time in (4.0, 6.0))
    assert short.duration == pytest.approx(4.0, rel=1e-12)
    assert minsnap.certify_fleet(short).ok
    assert sum(curve.cost() for curve in long) < 0.2 * sum(curve.cost() for curve in short)


def test_polish_takes_its_share_of_the_time_and_much_of_the_snap():
    fast = minsnap.plan_fleet(antipodal(4), AXIS, APART)
    smooth = minsnap.plan_fleet(antipodal(4), AXIS, APART, polish=0.05)
    assert minsnap.certify_fleet(smooth, limits=AXIS).ok
    assert smooth.duration == pytest.approx(1.05 * fast.duration, rel=1e-9)
    assert sum(curve.cost() for curve in smooth) < 0.2 * sum(curve.cost() for curve in fast)


def test_limits_radii_and_headings_of_their_own():
    limits = [minsnap.Limits(speed=1.0, acceleration=2.0), minsnap.Limits(speed=4.0, acceleration=4.0, tilt=0.3)]
    ways = [[(0.0, 0.0, 1.0), (4.0, 0.0, 1.0)], [(4.0, 0.1, 1.0), (0.0, 0.1, 1.0)]]
    separation = minsnap.Separation(radii=[0.2, 0.6])
    fleet = minsnap.plan_fleet(ways, limits, separation, yaw=[0.5, None], names=["slow", "fast"])
    assert minsnap.certify_fleet(fleet, limits=limits).ok
    assert fleet.name(1) == "fast"
    assert fleet[0].yaw(1.0) == pytest.approx(0.5)


def test_a_search_that_is_stopped_returns_the_best_certified():
    told = []

    def interrupt(step):
        told.append(step)
        if len(told) == 2:
            _thread.interrupt_main()

    fleet = minsnap.plan_fleet(antipodal(8), AXIS, APART, progress=interrupt)
    assert fleet.report.stopped == "Ctrl-C"
    assert fleet.duration == pytest.approx(min(step.time for step in told), rel=1e-12)
    assert minsnap.certify_fleet(fleet, limits=AXIS).ok


def test_a_deadline_ends_the_search_with_what_is_certified():
    try:
        fleet = minsnap.plan_fleet(antipodal(24), AXIS, APART, search=minsnap.Search(time_limit=0.3))
    except UnprovedError as error:  # on a slow machine
        assert "no fleet was found" in str(error)
    else:
        assert fleet.report.stopped in ("time_limit", "")
        assert minsnap.certify_fleet(fleet, limits=AXIS).ok


def test_vehicles_that_cannot_pass_each_other_are_a_sentence():
    swap = [[(0.0, 0.0, 1.0), (2.0, 0.0, 1.0)], [(2.0, 0.0, 1.0), (0.0, 0.0, 1.0)]]
    with pytest.raises(UnprovedError, match="vehicles 0 and 1 came as near as .* of their separation"):
        minsnap.plan_fleet(swap, AXIS, APART, room=((-0.5, -0.05, 0.9), (2.5, 0.05, 1.1)))


def test_random_numbers_are_even_and_repeat():
    numbers = uniform(20000, 5)
    assert (numbers == uniform(20000, 5)).all()
    assert abs(numbers.mean()) < 0.02
    assert np.histogram(numbers, 10, (-1.0, 1.0))[0].min() > 1800
    assert uniform(3, 0).tolist() == uniform(9, 0)[:3].tolist()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_random_fleets_hold_by_an_oracle_of_its_own(seed):
    assert not isinstance(certified_or_refused(seed), str)


@pytest.mark.slow
def test_many_random_fleets_hold_or_are_refused_in_a_sentence():
    assert sum(not isinstance(certified_or_refused(seed), str) for seed in range(100, 120)) >= 19


@pytest.mark.slow
def test_the_oracle_sees_what_a_fleet_does_not_keep():
    asked, (ways, speed, acceleration, per_axis, radii, downwash, (low, high), _) = random_fleet(9)
    fleet = minsnap.plan_fleet(**asked, threads=1)

    def seen(speed=speed, radii=radii, room=(low, high), obstacles=(), fleet=fleet):
        return faults(fleet, ways, speed, acceleration, per_axis, radii, downwash, room, obstacles)

    on_the_way, half = fleet[3](0.5 * fleet.duration), np.full(3, 0.05)
    assert seen() == [] and "come too near" in seen(radii=2.0 * radii)[0]
    assert "breaks 1.3 in derivative 1" in seen(speed=1.3)[0]
    assert "leaves the room" in seen(room=(low, ways.min(axis=(0, 1))))[0]
    for obstacle in (("ellipsoid", on_the_way, half), ("cuboid", on_the_way - half, on_the_way + half)):
        assert any("is in a" in each for each in seen(obstacles=[obstacle]))
    assert "3 is in a cylinder" in seen(obstacles=[("cylinder", on_the_way[:2], 0.05)])
    assert "begins or ends elsewhere" in seen(fleet=[*fleet[:-1], fleet[0]])[0]


LINE = [(0.0, 0.0, 1.0), (4.0, 0.0, 1.0)]

MEETING = [[*LINE, (4.0, 4.0, 1.0)], [(8.0, 0.1, 1.0), (4.0, 0.1, 1.0), (4.0, -4.0, 1.0)]]
"""Two that pass places 0.1 m apart in the middle of their ways."""
NEAR = [(0.0, 0.1, 1.0), (4.0, 2.0, 1.0)]


@pytest.mark.parametrize(
    ("change", "error", "sentence"),
    [
        ({"waypoints": [LINE, NEAR]}, FleetError, "starts of vehicles 0 and 1 are 0.1 m apart, 0.2 m less"),
        ({"waypoints": [LINE, [(0.0, 2.0, 1.0), (4.0, 0.1, 1.0)]]}, FleetError, "goals of vehicles 0 and 1"),
        ({"room": ((-1, -1, 0), (3, 3, 2))}, FleetError, "waypoint 1 of vehicle 0.*outside of the room"),
        ({"avoid": minsnap.Cylinder((4.0, 0.0), 0.5)}, FleetError, "0.5 m inside obstacle 0"),
        ({"total_time": 1.0}, TimingError, "vehicle 0 alone needs"),
        ({"limits": None}, TimingError, "limits on the speed"),
        ({"limits": minsnap.Limits(jerk=20.0)}, TimingError, "limits on the speed"),
        ({"waypoints": [LINE[:1] * 2]}, TimingError, "no vehicle .* moves .*: give total_time"),
        ({"waypoints": [LINE[:1] * 2], "holds": [(2, 0)]}, TimingError, "no vehicle .* moves .*: give total_time"),
        ({"waypoints": [LINE[:1] * 2], "limits": None}, TimingError, "no vehicle .* moves .*: give total_time"),
        ({"waypoints": []}, FleetError, "for each vehicle"),
        ({"waypoints": [[(0.0, 0.0), (1.0, 1.0)]]}, FleetError, "x, y and z"),
        ({"waypoints": [[(0.0, 0.0, np.nan), (1.0, 1.0, 1.0)]]}, FleetError, "vehicle 0: waypoint 0"),
        ({"pieces": 1}, FleetError, "pieces"),
        ({"polish": -1.0}, FleetError, "polish"),
        ({"start": {"velocity": (1, 0, 0)}}, FleetError, "list of 1 states"),
        ({"fixed": [3]}, FleetError, "fixed vehicle"),
        (
            {"waypoints": MEETING, "pieces": 8},
            FleetError,
            "waypoint 1 of vehicle 0 and waypoint 1 of vehicle 1 are passed at one instant, 0.1 m apart",
        ),
        (
            {"fixed": [minsnap.plan([(0.0, 0.1, 1.0), (0.0, 3.0, 1.0)], total_time=3.0)]},
            FleetError,
            "starts of vehicles 0 and 1",
        ),
        ({"corridors": [None, None]}, FleetError, "list of 1 Boxes"),
        ({"corridors": [minsnap.Boxes([(0, 0, 0)], [(2, 2, 2)])]}, FleetError, "leg 0 of vehicle 0"),
        ({"yaw": [0.0, 1.0]}, FleetError, "2 yaws"),
        ({"seed": -1}, InputError, "seed"),
        ({"names": ["a", "b"]}, FleetError, "different names"),
    ],
)
def test_bad_input_is_one_sentence(change, error, sentence):
    asked = {"waypoints": [LINE], "limits": AXIS, "separation": APART, **change}
    with pytest.raises(error, match=sentence) as caught:
        minsnap.plan_fleet(**asked)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("asked", [{"names": ["a"]}, {"names": "ab"}, {"names": 2}, {"yaw": [0.0]}, {"yaw": "speed"}])
def test_names_and_yaws_are_refused_before_the_search(monkeypatch, asked):
    monkeypatch.setattr("minsnap.fleet.fleet_planner.TimeSearch", lambda *_: 1 / 0)
    with pytest.raises((FleetError, YawError), match="2 different names|1 yaws for 2|yaw is 'speed'"):
        minsnap.plan_fleet([LINE, [(0.0, 3.0, 1.0), (4.0, 3.0, 1.0)]], AXIS, APART, **asked)


STARTS = {
    "the start of vehicle 1 has speed 10, and its limit is 2: a fleet starts within": ({"velocity": (10, 0, 0)}, None),
    "the start of vehicle 1 has speed 2, and its limit is 2": ({"velocity": (2, 0, 0)}, None),
    "the start of vehicle 1 has climb_speed 1, and its limit is 0.5": ({"velocity": (0, 0, 1)}, None),
    "the start of vehicle 1 has acceleration 4, and its limit is 3": ({"acceleration": (0, 4, 0)}, None),
    "vehicle 1 starts moving and is to rest for 1 s at its first": ({"velocity": (1, 0, 0)}, [None, (1.0, 0.0)]),
}


@pytest.mark.parametrize("total_time", [None, 20.0])
@pytest.mark.parametrize("sentence", STARTS)
def test_starts_that_no_time_mends_are_refused_at_once(sentence, total_time):
    """A start above its limits, and one that moves where it is to rest, were searched for and then told to take more
    time."""
    start, holds = STARTS[sentence]
    limits = minsnap.Limits(speed=2.0, acceleration=3.0, climb_speed=0.5)
    aside = [(0.0, 3.0, 1.0), (4.0, 3.0, 1.0)]
    with pytest.raises(FleetError, match=sentence) as caught:
        minsnap.plan_fleet([LINE, aside], limits, APART, total_time=total_time, start=[None, start], holds=holds)
    assert caught.value.vehicle == 1


def test_starts_near_a_limit_and_holds_elsewhere_are_no_contradiction():
    start, aside = [{"velocity": (1.9, 0.0, 0.0)}, None], [(0.0, 3.0, 1.0), (4.0, 3.0, 1.0)]
    limits = minsnap.Limits(speed=2.0, acceleration=3.0)
    fleet = minsnap.plan_fleet([LINE, aside], limits, APART, start=start, holds=[(0.0, 0.5), (1.0, 0.0)])
    assert fleet[0](0.0, 1) == pytest.approx([1.9, 0.0, 0.0], abs=1e-12)
    assert np.abs(fleet[1](np.linspace(0.0, 1.0, 9), 1)).max() <= 1e-12


@pytest.mark.parametrize("total_time", [None, 4.0, 8.0])
def test_a_goal_where_a_fixed_vehicle_stays_is_refused_at_once(total_time):
    """It was searched for, and more time or another seed advised."""
    stays = minsnap.plan([(2.0, -3.0, 1.0), (4.0, 0.2, 1.0)], total_time=6.0)
    with pytest.raises(FleetError, match="the goals of vehicles 0 and 1 are 0.2 m apart") as caught:
        minsnap.plan_fleet([LINE], AXIS, APART, total_time=total_time, fixed=[stays])
    assert caught.value.pair == (0, 1)


@pytest.mark.parametrize("speed", [0.2, 1.0, 1.5])
def test_a_vehicle_that_already_flies_towards_its_goal_takes_hardly_longer_than_from_rest(speed):
    """The search stopped at twice the time where curves exceeded a limit by 0.4 % between two samples."""
    ways = [LINE, [(0.0, 5.0, 1.0), (4.0, 5.0, 1.0)]]
    limits = minsnap.Limits(speed=2.0, acceleration=4.0)
    moving = minsnap.plan_fleet(ways, limits, APART, start=[{"velocity": (speed, 0.0, 0.0)}, None])
    assert minsnap.certify_fleet(moving, limits=limits).ok
    assert moving.duration < 1.03 * minsnap.plan_fleet(ways, limits, APART).duration


@pytest.mark.parametrize("total_time", [None, 12.0])
def test_vehicles_start_late_rest_on_their_way_and_arrive_early_as_asked(total_time):
    ways = [*antipodal(3), [(-2.0, -3.0, 1.0), (0.0, -3.0, 1.0), (2.0, -3.0, 1.0)]]
    holds = [(2.0, 0.0), None, (0.0, 1.5), (0.5, 1.0, 0.0)]
    fleet = minsnap.plan_fleet(ways, AXIS, APART, total_time=total_time, holds=holds)
    assert minsnap.certify_fleet(fleet, limits=AXIS).ok
    assert total_time is None or fleet.duration == pytest.approx(total_time)
    for curve, way, own in zip(fleet, ways, holds, strict=True):
        places = curve(np.linspace(0.0, fleet.duration, 4001))
        for point, asked in zip(way, own or (0.0,) * len(way), strict=True):
            there = np.abs(places - point).max(axis=1) <= 1e-9
            assert there.sum() * fleet.duration / 4000 >= asked
    assert fleet.duration <= 12.001


def test_what_is_not_found_says_what_pressed_and_what_would_do():
    with pytest.raises(UnprovedError, match=r"vehicles 0 and 1 came as near as 0\.\d+ m .*; 90% of the separation did"):
        minsnap.plan_fleet([LINE, LINE[::-1]], AXIS, APART, room=((-1.0, -0.135, 0.9), (5.0, 0.135, 1.1)))


def test_a_wall_across_the_room_is_named_by_who_is_inside():
    wall = minsnap.Cuboid((-0.2, -4.0, -1.0), (0.2, 4.0, 4.0))
    with pytest.raises(UnprovedError, match=r"in .* s vehicle \d was 0\.\d+ m inside an obstacle"):
        ways = [[(-2.0, y, 1.0), (2.0, y, 1.0)] for y in (-1.0, 1.0)]
        minsnap.plan_fleet(ways, AXIS, APART, room=((-3, -3, 0), (3, 3, 2)), avoid=wall)


def test_edges_of_blocks_are_kept_between_samples():
    assert not isinstance(certified_or_refused(506), str)


@pytest.mark.parametrize("holds", [[(1.0, -1.0)], [(1.0,)], [None, None], "1"])
def test_malformed_holds_are_one_sentence(holds):
    with pytest.raises(FleetError, match="holds"):
        minsnap.plan_fleet([LINE], AXIS, APART, holds=holds)


@pytest.mark.slow
def test_a_fleet_whose_waypoints_need_more_time_than_usual_is_given_it():
    """It was refused with the time that did, although none was asked for."""
    paths = [[(-2.0, 1.53, 0.53), (1.57, -2.37, 0.18), (-0.34, 0.59, -0.43), (-0.7, 0.98, -0.51)]]
    paths.append([(1.81, -0.42, -0.85), (0.18, -0.39, 1.03)])
    limits, separation = (
        minsnap.Limits(speed=1.43, acceleration=1.19),
        minsnap.Separation(downwash=2.0, radii=[0.21, 0.11]),
    )
    fleet = minsnap.plan_fleet(paths, limits=limits, separation=separation, seed=1)
    assert minsnap.certify_fleet(fleet, limits=limits, separation=separation).ok


LEGS = [[(-2, 0, 1), (0, 1, 1), (2, 0, 1)], [(2, 0, 1), (0, -1, 1), (-2, 0, 1)], [(0, 2, 1), (0, -2, 1)]]
FREE = minsnap.Limits(speed=2.0, acceleration=3.0)


@pytest.mark.parametrize(
    ("durations", "holds", "total"),
    [
        ([(2.0, 3.5), (3.0, 2.5), None], None, None),
        ([(2.0, 3.5), (3.0, 2.0), (3.0,)], [(0.5, 0, 0), (0, 0.7, 0), None], 8.0),
        ([(2.2, 2.2), None, None], None, 6.0),
    ],
)
def test_vehicles_are_at_their_waypoints_when_their_legs_say(durations, holds, total):
    fleet = minsnap.plan_fleet(LEGS, FREE, 0.3, durations=durations, holds=holds, total_time=total)
    for vehicle, (way, seconds) in enumerate(zip(LEGS, durations, strict=True)):
        if seconds is None:
            continue
        rests = np.zeros(len(way)) if holds is None or holds[vehicle] is None else np.array(holds[vehicle], float)
        arrives = np.append(0.0, np.cumsum(rests[:-1] + seconds))
        assert fleet[vehicle](arrives) == pytest.approx(np.array(way), abs=1e-9)
        stands = np.linspace(arrives[-1], fleet.duration, 20)
        assert fleet[vehicle](stands) == pytest.approx(np.tile(way[-1], (20, 1)), abs=1e-9)
        for at, rest, point in zip(arrives, rests, way, strict=True):
            assert np.abs(fleet[vehicle](np.linspace(at, at + rest, 9)) - point).max() < 1e-9
    room = (np.full(3, -99.0), np.full(3, 99.0))
    assert faults(fleet, LEGS, 2.0, 3.0, False, np.full(3, 0.15), 1.0, room, []) == []
    assert fleet.duration == pytest.approx(total or 5.5)


@pytest.mark.parametrize("seed", [71, 74, 83])
def test_random_missions_with_times_of_their_legs_keep_limits_that_bind_on_some_legs(seed):
    """Curves at a limit between two samples were refused as a whole: 2 of 29 such missions."""
    random, ways = np.random.default_rng(seed), []
    count = int(random.integers(2, 7))
    while len(ways) < count:
        way = random.uniform(-4, 4, (int(random.integers(2, 5)), 3))
        if all(min(np.linalg.norm(way[0] - one[0]), np.linalg.norm(way[-1] - one[-1])) > 0.8 for one in ways):
            ways.append(way)
    durations = [
        None
        if random.random() < 0.25
        else np.maximum(np.linalg.norm(np.diff(way, axis=0), axis=1), 2.0) * random.uniform(1, 1.4, len(way) - 1)
        for way in ways
    ]
    total = 1.05 * max([each.sum() for each in durations if each is not None] + [14])
    fleet = minsnap.plan_fleet(ways, FREE, 0.4, durations=durations, total_time=total)
    room = (np.full(3, -99.0), np.full(3, 99.0))
    assert faults(fleet, ways, 2.0, 3.0, False, np.full(count, 0.2), 1.0, room, []) == []
    for curve, way, seconds in zip(fleet, ways, durations, strict=True):
        if seconds is not None:
            assert curve(np.append(0.0, np.cumsum(seconds))) == pytest.approx(way, abs=1e-9)


def test_one_vehicle_with_times_of_its_legs_is_its_plan():
    (one,) = minsnap.plan_fleet(LEGS[:1], FREE, durations=[(2.0, 3.5)])
    plan = minsnap.plan(LEGS[0], durations=(2.0, 3.5), limits=FREE, pieces="auto")
    assert (one.control_points == plan.control_points).all() and (one.durations == plan.durations).all()


@pytest.mark.parametrize(
    ("durations", "total", "sentence"),
    [
        ([(0.5, 3), None, None], None, "leg 0 of vehicle 0 is to last 0.5 s, .* takes 1.451 s at least: give it more"),
        ([(2, 3), (1, 2)], None, "durations must be a list of 3, of each vehicle the seconds of its legs, or None"),
        ([(2, 3), (1,), None], None, "the durations of vehicle 1 are .*: give 2 positive numbers"),
        ([(2, -3), None, None], None, "the durations of vehicle 0 are .*: give 2 positive numbers"),
        ([(2, np.nan), None, None], None, "the durations of vehicle 0 are .*: give 2 positive numbers"),
        ([(2, 9), None, None], 6.0, "the legs and holds of vehicle 0 last 11 s, and the total time is 6 s"),
        ([None, None, (2.4,)], None, "leg 0 of vehicle 2 is to last 2.4 s, .* takes 2.667 s at least"),
    ],
)
def test_times_of_legs_that_cannot_be_are_refused(durations, total, sentence):
    with pytest.raises(InputError, match=sentence):
        minsnap.plan_fleet(LEGS, FREE, 0.3, durations=durations, total_time=total)


def test_waypoints_that_meet_at_given_instants_are_refused():
    ways = [LEGS[0], [(2, 0, 1), (0, 1, 1.1), (-2, 0, 1)]]
    with pytest.raises(FleetError, match=r"passed at one instant, 0\.1 m apart: move one, or give one other durations"):
        minsnap.plan_fleet(ways, FREE, 0.3, durations=[(2, 3), (2, 3)])
    assert minsnap.plan_fleet(ways, FREE, 0.3, durations=[(2, 3), (3, 2)]).duration == pytest.approx(5.0)


@pytest.mark.parametrize("norm", ["euclidean", "axis"])
@pytest.mark.parametrize("jerk", [None, 2.0, 20.0])
def test_no_flight_is_shorter_than_the_bound_and_some_come_near(norm, jerk):
    limits = minsnap.Limits(speed=2.0, acceleration=3.0, jerk=jerk, norm=norm)
    random = np.random.default_rng(3)
    for scale, legs in ((0.2, 1), (3.0, 1), (20.0, 1), (4.0, 3)):
        points = scale * random.normal(size=(legs + 1, 3))
        alone = minsnap.plan_fleet([points], limits, pieces=8)
        share = alone.duration / alone.report.bound
        assert 1.0 - 1e-9 <= share <= (1.02 if legs == 1 and norm == "euclidean" else 1.4), (scale, legs, share)
        assert alone.report.longer == pytest.approx(max(share - 1.0, 0.0))
    assert str(alone.report).endswith("longer than any flight of vehicle 0")
