"""Plans and replans among obstacles that move: certified at every instant, whatever else is asked."""

import numpy as np
import pytest

import minsnap
from minsnap.corridors.moving import Moving
from minsnap.corridors.way_around import Kept
from minsnap.corridors.way_in_time import way_in_time
from minsnap.errors import CorridorError, FleetError, UnprovedError
from minsnap.files.formats.polynomials import read_polynomials, write_polynomials

LIMITS = minsnap.Limits(speed=2.0, acceleration=4.0, jerk=20.0)
ENDS = [(0, 0, 1), (6, 0, 1)]
CROSSING = Moving([(0, 3, -3, 1), (4, 3, 3, 1)], 0.5)
PLAIN = [(p[0], p[1]) for p in ENDS]


@pytest.mark.parametrize(
    ("points", "avoid", "how"),
    [
        (ENDS, CROSSING, {"limits": LIMITS}),
        (ENDS, Moving([(0, 6, 0.1, 1), (4, 0, 0.1, 1)], 0.5), {"limits": LIMITS}),
        (PLAIN, Moving([(0, 3, -3), (4, 3, 3)], 0.5), {"limits": LIMITS, "corridor": 2.0}),
        (ENDS, Moving([(0, 3, 0.1, 1)], 0.3, growth=0.1), {"limits": LIMITS}),
        (ENDS, [CROSSING, minsnap.Cylinder((1.5, 0), 0.3)], {"limits": LIMITS}),
        ([(0, 0, 1), (2, 0, 1), (6, 0, 1)], CROSSING, {"total_time": 4.0}),
        ([(0, 0, 1), (2, 0, 1), (6, 0, 1)], CROSSING, {"durations": [1.5, 2.5]}),
        (ENDS, Moving(minsnap.plan([ENDS[1], ENDS[0]], total_time=5.0), 0.4), {"total_time": 6.0}),
    ],
)
def test_a_plan_keeps_out_of_what_moves_at_every_instant(points, avoid, how):
    curve = minsnap.plan(points, avoid=avoid, **how)
    limits, corridor = how.get("limits"), how.get("corridor")
    certificate = minsnap.certify(curve, points, limits=limits, corridor=corridor, avoid=avoid)
    assert certificate.ok and certificate.obstacle_margin >= 0.0 and curve.legs == len(points) - 1
    assert not minsnap.certify(minsnap.plan(points, **how), avoid=avoid).ok
    for each in avoid if isinstance(avoid, list) else [avoid]:
        if isinstance(each, Moving):
            instants = np.linspace(0.0, curve.duration, 2001)
            assert each.clearances(curve(instants), instants).min() >= 0.0
    if "total_time" in how:
        assert curve.duration == pytest.approx(how["total_time"], rel=1e-12)
    if "durations" in how:
        assert np.diff(curve.leg_breaks) == pytest.approx(how["durations"], rel=1e-12)


def test_what_is_not_in_the_way_changes_nothing():
    far = Moving([(0, 3, -3, 1), (60, 3, 3, 1)], 0.5)
    assert minsnap.plan(ENDS, limits=LIMITS, avoid=far).duration == minsnap.plan(ENDS, limits=LIMITS).duration


def test_a_way_waits_where_it_cannot_pass():
    gate = [minsnap.Cuboid((2, 0.6, -9), (4, 9, 9)), minsnap.Cuboid((2, -9, -9), (4, -0.6, 9))]
    walls = np.stack([each.numbers() for each in gate])
    comes = Moving([(0, 6, 0), (8, -1, 3)], 0.5)
    kept = Kept(walls, np.zeros((0, 2)), 0.1)
    through = Moving([(0, 5, 0), (2, 3, 0), (4, 1, 0), (5, 1, 4)], 0.5)
    way = way_in_time(kept, [through], np.array([(0.0, 0.0), (6.0, 0.0)]), 2.0)
    instants = np.linspace(0.0, way.times[-1], 500)
    places = np.stack([np.interp(instants, way.times, axis) for axis in way.points.T], axis=1)
    assert through.clearances(places, instants).min() > 0.0 and way.times[-1] > 4.0
    assert way_in_time(kept, [comes], np.array([(0.0, 0.0), (6.0, 0.0)]), 2.0, arrive=0.1) is None


def test_plan_files_keep_what_moves(tmp_path):
    curve = minsnap.plan(ENDS, limits=LIMITS, avoid=CROSSING)
    for name in ("plan.json", "plan.yaml"):
        write_polynomials(curve, tmp_path / name, waypoints=ENDS, limits=LIMITS, avoid=[CROSSING])
        again = read_polynomials(tmp_path / name)
        assert again.proof.ok and again.proof.obstacle_margin == minsnap.certify(curve, avoid=CROSSING).obstacle_margin


def test_a_replan_keeps_out_of_what_begins_to_move():
    flown, clock = minsnap.plan(ENDS, limits=LIMITS), 0.0
    replanner = minsnap.Replanner(LIMITS, clock=lambda: 0.0)
    for _ in range(4):
        change = replanner.replan(flown, 0.2, [ENDS[1]], 0.1, avoid=CROSSING.after(clock))
        assert change.certified and change.splice == pytest.approx(0.3)
        clock, flown = clock + change.splice, change.trajectory
        for curve in (flown, change.stop):
            assert curve is None or minsnap.certify(curve, avoid=CROSSING.after(clock), limits=LIMITS).ok
    assert flown(flown.duration) == pytest.approx(ENDS[1])


def test_a_stop_that_leads_into_an_obstacle_is_none():
    flown = minsnap.plan(ENDS, limits=LIMITS)
    ahead = Moving([(0.0, float(flown(1.6)[0]), 0.0, 1.0)], 0.2)
    change = minsnap.replan(flown, 1.4, [ENDS[1]], 0.1, limits=LIMITS, avoid=ahead)
    assert change.stop is None and "an obstacle is in the way" in change.no_stop and not change.certified


def test_an_explorer_keeps_out_of_what_moves():
    explorer = minsnap.routes.Explorer((6, 0), limits=LIMITS, sensing=8.0, clock=lambda: 0.0)
    angle = np.linspace(0.0, 2.0 * np.pi, 400)
    explorer.observe((0, 0), [], 8.0 * np.stack((np.cos(angle), np.sin(angle)), axis=1))
    crossing = Moving([(0, 3, -3), (4, 3, 3)], 0.5)
    first = explorer.replan(None, 0.0, avoid=crossing).trajectory
    assert minsnap.certify(first, avoid=crossing, limits=LIMITS).ok
    change = explorer.replan(first, 0.3, 0.2, avoid=crossing)
    assert change.certified and minsnap.certify(change.trajectory, avoid=crossing.after(0.5)).ok


def test_what_has_no_way_is_refused():
    with pytest.raises(CorridorError, match=r"waypoint 0, .*, is 0.5 m inside obstacle 0 at 0 s: begin elsewhere, or"):
        minsnap.plan(ENDS, limits=LIMITS, avoid=Moving([(0, 0, 0, 1)], 0.5))
    with pytest.raises(UnprovedError, match=r"no plan was found among the moving obstacles; without them the path is"):
        minsnap.plan(ENDS, limits=LIMITS, avoid=Moving([(0, 6, 0, 1)], 0.5))
    with pytest.raises(CorridorError, match=r"obstacle 0 moves: plan takes it; a fleet has it as a vehicle of fixed="):
        minsnap.plan_fleet([ENDS], limits=LIMITS, avoid=CROSSING)
    with pytest.raises((CorridorError, FleetError), match="obstacle 0 moves"):
        minsnap.certify_fleet([minsnap.plan(ENDS, limits=LIMITS)], avoid=CROSSING)
    with pytest.raises(CorridorError, match="obstacle 0 moves"):
        minsnap.routes.plan_through([CROSSING], (0, 0, 1), (6, 0, 1))
