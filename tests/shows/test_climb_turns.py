"""Take-off and landing in turn, from homes that are nearer to each other than vehicles may be in flight."""

from dataclasses import replace

import numpy as np
import pytest

import minsnap
from minsnap.shows.show import Act, Show, fly

LIMITS = minsnap.Limits(speed=6.0, acceleration=3.0)


def grid(side, spacing, height=0.0):
    return np.array([(x * spacing, y * spacing, height) for x in range(side) for y in range(side)], dtype=float)


def dense(side=4, **more):
    apart = minsnap.Separation(3.0, downwash=1.5, ground=1.0)
    acts = (Act("above", grid(side, 5.0, 60.0), hold=1.0),)
    return Show(grid(side, 1.0), acts, apart, LIMITS, take_off=5.0, climb_speed=1.5, descent_speed=1.0, **more)


def brute_force(fleet, separation):
    """Return the least share of the separation at samples: all of it where both fly."""
    t = np.linspace(0.0, fleet.duration, 4001)
    places = separation.flat(fleet(t))
    starts, ends = places[:, :1], places[:, -1:]
    away = [np.linalg.norm(places - ends_, axis=2) > 0.06 for ends_ in (starts, ends)]
    since = [np.logical_or.accumulate(away[0], axis=1), np.logical_or.accumulate(away[1][:, ::-1], axis=1)[:, ::-1]]
    flies = since[0] & since[1]
    least = np.inf
    for i in range(len(fleet)):
        for j in range(i):
            apart = np.linalg.norm(places[i] - places[j], axis=1)
            asked = np.where(flies[i] & flies[j], separation.distance, separation.ground)
            least = min(least, float((apart / asked).min()))
    return least


def test_groups_climb_in_turn_and_are_proved_apart():
    show = dense()
    climbs = show.turns.climbs(show.home, replace(show.flown_limits, vertical_speed=1.5))
    assert minsnap.certify_fleet(climbs, show.separation, limits=show.flown_limits).ok
    assert brute_force(minsnap.Fleet(tuple(climbs)), show.separation) >= 1.0 - 1e-6
    assert np.ptp([curve.duration for curve in climbs]) < 1e-9
    assert np.abs([curve(curve.duration) for curve in climbs] - show.above).max() < 1e-9
    alone = [minsnap.plan([(0, 0, 0), (0, 0, top)], limits=replace(show.flown_limits, vertical_speed=1.5)) for top in
             sorted(set(show.turns.tops.tolist()))]  # fmt: skip
    assert climbs[0].duration < 0.5 * sum(climb.duration for climb in alone)
    assert climbs[0].duration < 1.3 * alone[-1].duration


def test_leaving_earlier_would_be_too_near():
    show = dense()
    early = replace(show.turns, below=0.9 * show.turns.below)
    assert not minsnap.certify_fleet(early.climbs(show.home, show.flown_limits), show.separation).ok


def test_a_show_from_dense_homes_is_apart_as_soon_as_two_fly():
    show = dense()
    flown = fly(show)
    certificate = minsnap.certify_fleet(flown.fleet)
    assert certificate.ok
    assert not minsnap.certify_fleet(flown.fleet, show.separation.aloft).ok
    assert brute_force(flown.fleet, show.separation) >= 1.0 - 1e-6
    assert "in turn" in flown.stages[0].method
    assert "in turn" in flown.stages[-1].method


def test_vehicles_that_fly_are_held_to_the_separation_whatever_the_ground_allows():
    one = minsnap.plan([(0, 0, 0), (0, 0, 9)], total_time=9.0)
    two = minsnap.plan([(1, 0, 0), (1, 0, 9)], total_time=9.0)
    assert not minsnap.certify_fleet([one, two], minsnap.Separation(2.0, ground=1.0)).ok
    stays = minsnap.Trajectory(np.tile([1.0, 0.0, 0.0], (1, 8, 1)), [9.0])
    assert minsnap.certify_fleet([one, stays], minsnap.Separation(2.0, ground=1.0)).ok
    assert not minsnap.certify_fleet([one, stays], minsnap.Separation(2.0, ground=1.1)).ok


def test_uneven_ground_counts():
    home = grid(3, 1.0)
    home[:, 2] = np.arange(9) * 0.3
    show = replace(dense(), home=home, acts=(Act("above", grid(3, 5.0, 60.0)),))
    assert minsnap.certify_fleet(show.turns.climbs(home, LIMITS), show.separation).ok


def test_the_same_is_asked_of_files(tmp_path):
    show = dense(3)
    flown = fly(show, to="skyc")
    minsnap.shows.write_fleet(flown.fleet, tmp_path / "show.skyc", lights=flown.lights)
    held = minsnap.shows.read_fleet(tmp_path / "show.skyc")
    assert minsnap.certify_fleet(held, show.separation).ok
    minsnap.shows.write_fleet(flown.fleet, tmp_path / "folder")
    assert minsnap.shows.read_fleet(tmp_path / "folder").separation.ground == 1.0


@pytest.mark.parametrize(("change", "said"), [
    ({"separation": minsnap.Separation(3.0)}, r"ground: 1\)"),
    ({"separation": minsnap.Separation(3.0, ground=1.2)}, "points 0 and 1 of home are 1.000 m apart"),
    ({"take_off": 0.0}, "give take_off a height"),
    ({"layer": -1.0}, "the layer of take_off is -1"),
])  # fmt: skip
def test_what_cannot_be_is_one_sentence(change, said):
    with pytest.raises(minsnap.errors.FleetError, match=said):
        fly(replace(dense(3), **change))


def test_a_distance_on_the_ground_is_positive():
    with pytest.raises(minsnap.errors.FleetError, match="on the ground is 0"):
        minsnap.Separation(1.0, ground=0.0)
