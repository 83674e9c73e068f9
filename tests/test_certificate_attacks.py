"""Certificates under attack: far walls, far origins, wrong tolerances, and numbers just inside and just outside."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.interpolate import PPoly

import minsnap
from minsnap.certificate import continuity
from minsnap.corridors.constraint import Walls
from minsnap.corridors.margins import margin_holds, nearest_wall
from minsnap.errors import MinsnapError
from minsnap.native.library import core, using
from minsnap.polynomials.rationals import derivative, is_never_negative
from minsnap.trajectory.trajectory import Trajectory

CORNERS = np.array([(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)], float)
DURATIONS = [4.0, 2.0, 4.0, 2.0]
CORES = pytest.mark.parametrize("choice", ("python", *(("native",) if core().library is not None else ())))


@CORES
@pytest.mark.parametrize("far", (1e3, 1e9, 1e12, 1e15))
def test_far_walls_do_not_hide_a_curve_below_the_floor(choice, far):
    points = [(0, 0, 1), (5, 0, 0.01), (5, 5, 1), (0, 5, 0.01), (0, 0, 1)]
    room = minsnap.Room((-far, -far, 0.0), (far, far, far))
    with using(choice):
        free = minsnap.plan(points, [2, 1, 2, 1])
        lowest = min(free(np.linspace(0.0, free.duration, 20_001))[:, 2])
        assert lowest < -1e-4, "without a floor the curve dips"
        certificate = minsnap.certify(free, corridor=room)
        assert not certificate.ok and certificate.corridor_margin <= lowest
        held = minsnap.plan(points, [2, 1, 2, 1], corridor=room)
        assert minsnap.certify(held, corridor=room).ok and held.extent((0, 0, 1))[0] >= 0.0


@CORES
@pytest.mark.parametrize("shift", (0.0, 1e3, 4.5e6))
@pytest.mark.parametrize("corridor", (minsnap.Tube(0.3), minsnap.RoundTube(0.3)))
def test_margins_are_the_lower_end_in_exact_rationals(choice, shift, corridor):
    points = CORNERS + shift
    traj = minsnap.plan(points, DURATIONS, corridor=corridor)
    with using(choice):
        assert minsnap.certify(traj, points, corridor).verify()


@CORES
def test_margins_to_slanted_planes_far_away_are_proved(choice):
    random = np.random.default_rng(8)
    for _ in range(60):
        normal, line = random.normal(size=3), Trajectory(1e6 * random.normal(size=(1, 3, 3)), [1.0])
        (wall,) = minsnap.HalfSpaces(normal, 3e6).walls(np.zeros((2, 3)))
        with using(choice):
            assert margin_holds(line, wall, nearest_wall(line, [wall]).value)


@pytest.mark.slow
@pytest.mark.parametrize("growth", (0.0, 0.3))
def test_margins_to_slanted_cylinders_and_cones_far_away_are_proved(growth):
    """By the Python core; every second time the curve is behind the apex of the cone."""
    random = np.random.default_rng(9)
    for number in range(150):
        along = random.normal(size=3)
        along /= np.linalg.norm(along)
        line = Trajectory(random.normal(size=3) * 1e6 + random.normal(size=(1, 3, 3)), [1.0])
        anchor = line.control_points[0, 0] + random.normal(size=3) + number % 2 * 130.0 * growth * along
        across = 0.999 * (np.eye(3) - np.outer(along, along))
        wall = Walls.balls([0], [across], [anchor], [3.0], slope=[growth * along] if growth else None)
        with using("python"):
            assert margin_holds(line, wall, nearest_wall(line, [wall]).value)


@CORES
def test_a_claim_that_is_too_good_is_not_verified(choice):
    traj = minsnap.plan(CORNERS, DURATIONS, corridor=0.3)
    with using(choice):
        certificate = minsnap.certify(traj, CORNERS, 0.3)
        missed = minsnap.certify(traj, CORNERS + np.linspace(0.0, 3.0, 5)[:, None])
    assert missed.verify()
    object.__setattr__(missed, "waypoint_error", missed.waypoint_error * (1.0 - 1e-9))
    assert not missed.verify()
    for name in ("corridor_margin", "max_speed", "max_jerk"):
        better = 1e-9 if name == "corridor_margin" else -1e-9 * getattr(certificate, name)
        object.__setattr__(certificate, name, getattr(certificate, name) + better)
        assert not certificate.verify(), name
        object.__setattr__(certificate, name, getattr(certificate, name) - 2.0 * better)
        assert certificate.verify(), name


@CORES
def test_the_other_half_of_a_double_cone_is_outside(choice):
    line = Trajectory([[[0.0, 0.0, -1.0], [0.0, 0.0, -2.0]]], [1.0])
    cone = Walls.balls([0], [[[1.0, 0, 0], [0, 1.0, 0]]], [[0.0, 0, 0]], [0.5], slope=[[0.0, 0.0, 1.0]])
    with using(choice):
        assert nearest_wall(line, [cone]).value <= -1.0


@pytest.mark.parametrize(("margin", "holds"), ((-0.0098, False), (-0.01, True)))
def test_a_margin_outside_of_a_cone_is_proved_near_its_apex(margin, holds):
    """The radius is a millimetre there, and 0.1 m from the axis the margin is -0.0099."""
    line = Trajectory([[[0.05, 0.0, -0.499], [0.1, 0.0, -0.499]]], [1.0])
    cone = Walls.balls([0], [[[1.0, 0, 0], [0, 1.0, 0]]], [[0.0, 0, 0]], [0.5], slope=[[0.0, 0.0, 1.0]])
    assert margin_holds(line, cone, margin) is holds


def test_an_infinite_margin_is_proved_only_where_there_are_no_walls():
    line = Trajectory([[[0.0, 0.0], [1.0, 0.0]]], [1.0])
    walls = [Walls.planes([0], [[1.0, 0.0]], [[0.0, 0.0]], [-np.inf], [upper], [1.0]) for upper in (np.inf, 9.0)]
    assert [margin_holds(line, wall, np.inf) for wall in walls] == [True, False]


@CORES
@pytest.mark.parametrize("width", (1.0, 4.0))
def test_a_distance_to_a_cone_is_verified_and_nothing_above_it(choice, width):
    """Also deep inside of it, where the distance counts as its radius at the anchor."""

    class Cone:
        def walls(self, waypoints):
            sides = np.eye(2, 3)[None]
            return [Walls.balls([0], sides, np.zeros((1, 3)), [0.5], slope=[[0.0, 0.0, 0.4]])]

    curve = Trajectory([[[0.1 * width, 0.2 * width, 1.0], [0.1, -0.3, 2.0], [0.2, 0.1, 1.0]]], [1.0])
    with using(choice):
        certificate = minsnap.certify(curve, corridor=Cone())
    assert certificate.ok and certificate.verify()
    for off, holds in ((1e-9, False), (-1e-9, True)):
        object.__setattr__(certificate, "corridor_margin", certificate.corridor_margin + off)
        assert certificate.verify() is holds


@CORES
@pytest.mark.parametrize(("off", "ok"), ((0.0, True), (0.9e-8, True), (1.1e-8, False)))
def test_waypoints_are_measured_by_the_extent_of_the_course(choice, off, ok):
    """What counts as met is 1e-9 of the distance from the first waypoint: here 8 m, so 8e-9 m."""
    traj = minsnap.plan(CORNERS, DURATIONS)
    moved = CORNERS.copy()
    moved[2, 1] += 8.0 / 9.0 * off
    with using(choice):
        certificate = minsnap.certify(traj, moved)
        assert certificate.ok is ok and certificate.waypoint_error >= abs(moved[2, 1] - CORNERS[2, 1])


@CORES
@pytest.mark.parametrize(("off", "ok"), ((0.9e-8, True), (1.1e-8, False)))
def test_the_extent_of_the_course_is_measured_from_its_first_waypoint(choice, off, ok):
    """From the middle one of these it would be half of 10 m."""
    points = np.array([(0.0, 0.0), (5.0, 0.0), (10.0, 0.0)])
    traj = minsnap.plan(points, [1.0, 1.0])
    points[1, 1] += off
    with using(choice):
        assert minsnap.certify(traj, points).ok is ok


@CORES
@pytest.mark.parametrize(("off", "ok"), ((2e-9, True), (1e-6, False), (4e-3, False)))
def test_far_from_the_origin_a_millimetre_is_still_seen(choice, off, ok):
    points = CORNERS + 4.5e6
    traj = minsnap.plan(points, DURATIONS)
    points[2, 1] += off
    with using(choice):
        assert minsnap.certify(traj, points).ok is ok


@CORES
@pytest.mark.parametrize(("steps", "ok"), ((4, True), (5, False)))
def test_a_waypoint_is_met_to_four_steps_of_far_positions(choice, steps, ok):
    """Positions of 2^30 m are stored to 2^-22 m; on a course of 1 m a billionth of its extent is far less."""
    line = Trajectory([[[2.0**30], [2.0**30 + 1.0]]], [1.0])
    with using(choice):
        assert minsnap.certify(line, [[2.0**30], [2.0**30 + 1.0 + steps * 2.0**-22]]).ok is ok


def test_a_waypoint_error_is_the_exact_one_rounded_upwards():
    random = np.random.default_rng(0)
    for ends, given in random.normal(size=(300, 2, 2, 3)):
        error = Fraction(minsnap.certify(Trajectory(ends[None], [1.0]), given).waypoint_error) ** 2
        exact = max(
            sum((Fraction(a) - Fraction(b)) ** 2 for a, b in zip(*pair, strict=True))
            for pair in zip(ends.tolist(), given.tolist(), strict=True)
        )
        assert exact <= error <= exact * Fraction(1.0 + 8e-15)


@CORES
@pytest.mark.parametrize(("backwards", "ok"), ((0.9e-9, True), (1.1e-9, False)))
def test_a_gate_is_crossed_in_its_direction_to_a_billionth_of_the_speed(choice, backwards, ok):
    line = Trajectory([[[-1.0, backwards], [0.0, 0.0]], [[0.0, 0.0], [1.0, -backwards]]], [0.5, 0.5])
    gate = minsnap.Gate((0.0, 0.0), (0.0, 1.0), 1.0, crossing=1)
    with using(choice):
        assert minsnap.certify(line, [(-1.0, backwards), gate, (1.0, -backwards)]).ok is ok


@CORES
def test_a_tube_is_around_the_waypoints_given_and_not_around_those_flown(choice):
    line = minsnap.plan([(0, 0), (1, 0), (2, 0)], [1.0, 1.0])
    with using(choice):
        certificate = minsnap.certify(line, [(0, 0), (1, 0.1), (2, 0)], 0.3, tolerance=0.1)
        assert certificate.ok and certificate.corridor_margin < 0.25


@CORES
def test_a_tolerance_is_a_box_around_inner_waypoints(choice):
    traj = minsnap.plan(CORNERS, DURATIONS)
    with using(choice):
        for axis, ok in (((0.1, 0.1, 0.1), True), ((0.11, 0.0, 0.0), False)):
            moved = CORNERS.copy()
            moved[2] += axis
            assert minsnap.certify(traj, moved, tolerance=0.1 * (1.0 + 1e-12)).ok is ok
        moved = CORNERS.copy()
        moved[0, 0] += 0.05
        assert not minsnap.certify(traj, moved, tolerance=0.1).ok, "the ends stay pinned"


@CORES
def test_a_curve_that_leaves_its_waypoint_on_one_side_misses_it(choice):
    jump = Trajectory([[[0.0, 0.0], [1.0, 0.0]], [[1.001, 0.0], [2.0, 0.0]]], [1.0, 1.0])
    with using(choice):
        for x in (1.0, 1.001):
            error = minsnap.certify(jump, [[0.0, 0.0], [x, 0.0], [2.0, 0.0]]).waypoint_error
            assert error == pytest.approx(1e-3, rel=1e-9)


@CORES
@pytest.mark.parametrize(("share", "ok"), ((1.0 + 0.9e-9, True), (1.0 + 1.1e-9, False), (1.0 + 1e-4, False)))
def test_a_limit_is_kept_to_a_billionth(choice, share, ok):
    traj = minsnap.plan(CORNERS, DURATIONS)
    speed = traj.max_norm(1)[0]
    with using(choice):
        assert minsnap.certify(traj, limits=minsnap.Limits(speed=speed / share)).ok is ok


@CORES
def test_limits_hold_from_the_first_instant_unless_told(choice):
    """The speed falls from 4 to 0 m/s in 2 s."""
    braking = Trajectory([[[0.0, 0.0], [4.0, 0.0], [4.0, 0.0]]], [2.0])
    with using(choice):
        for start, ok in ((None, False), (0.4, False), (0.6, True)):
            since = {} if start is None else {"limits_from": start}
            assert minsnap.certify(braking, limits=minsnap.Limits(speed=3.0), **since).ok is ok


@CORES
def test_walls_at_infinity_leave_any_margin(choice):
    nowhere = Walls.planes([0], [[1.0, 0.0]], [[0.0, 0.0]], [-np.inf], [np.inf], [1.0], name="fence")
    with using(choice):
        nearest = nearest_wall(Trajectory([[[0.0, 0.0], [1.0, 0.0]]], [1.0]), [nowhere])
    assert nearest is None


@CORES
@pytest.mark.parametrize(("margin", "ok"), ((0.0, True), (1e-15, False), (1e-9, False)))
def test_outside_is_outside_however_little(choice, margin, ok):
    line = Trajectory([[[0.0, 0.0], [1.0, 0.0]]], [1.0])
    with using(choice):
        assert minsnap.certify(line, corridor=minsnap.HalfSpaces((0.0, -1.0), -margin)).ok is ok


@CORES
@pytest.mark.parametrize("duration", (1.0, 3.0))
@pytest.mark.parametrize(("jump", "order"), ((0.9e-9, 1), (1.2e-9, 0)))
def test_continuity_is_judged_by_a_billionth_of_the_derivative(choice, jump, order, duration):
    """Velocities of 1 and 1 + jump meet at a knot; higher derivatives are zero."""
    traj = Trajectory([[[0.0], [1.0]], [[1.0], [1.0 + duration * (1.0 + jump)]]], [1.0, duration])
    with using(choice):
        assert continuity(traj) == order


@CORES
@pytest.mark.parametrize(("steps", "order"), ((6, 1), (7, -1)))
def test_the_rounding_of_far_positions_is_no_jump(choice, steps, order):
    """Positions of 2^22 m are stored to 2^-30 m: four steps are rounding, and two are a billionth of the 2 m flown."""
    here, jump = 2.0**22, steps * 2.0**-30
    traj = Trajectory([[[here], [here + 1.0]], [[here + 1.0 + jump], [here + 2.0 + jump]]], [1.0, 1.0])
    with using(choice):
        assert continuity(traj) == order


@CORES
@pytest.mark.parametrize(("steps", "continuous"), ((8, True), (9, False)))
def test_the_rounding_of_far_positions_is_no_jump_of_the_velocity(choice, steps, continuous):
    """Degree 3 at 2^22 m: control points are off by four steps of 2^-30 m, velocities by twice their threefold."""
    still = np.full((2, 4, 1), 2.0**22)
    still[1, 1:] += steps * 2.0**-30
    with using(choice):
        assert (continuity(Trajectory(still, [1.0, 1.0])) >= 1) is continuous


@CORES
def test_a_gate_may_be_the_last_waypoint_alone(choice):
    line = Trajectory([[[0.0, 0.0], [1.0, 0.1]]], [1.0])
    with using(choice):
        assert minsnap.certify(line, [(0.0, 0.0), minsnap.Gate((1.0, 0.0), (1.0, 0.0), 0.3)]).ok
        assert not minsnap.certify(line, [(0.0, 0.0), minsnap.Gate((1.0, 0.0), (1.0, 0.0), 0.1)]).ok


@CORES
def test_a_leg_of_degree_twenty_is_certified(choice):
    random = np.random.default_rng(0)
    traj = Trajectory(random.normal(size=(1, 21, 3)), [2.0])
    with using(choice):
        certificate = minsnap.certify(traj)
    grid = traj(np.linspace(0.0, 2.0, 5001), 1)
    assert np.linalg.norm(grid, axis=1).max() <= certificate.max_speed
    assert certificate.max_speed <= np.linalg.norm(grid, axis=1).max() * (1.0 + 1e-4)


@pytest.mark.skipif(core().library is None, reason="the native core is not in use")
@pytest.mark.parametrize("seed", range(6))
def test_both_cores_say_the_same(seed):
    random = np.random.default_rng(seed)
    points = np.cumsum(random.normal(size=(6, 3)), axis=0)
    traj = Trajectory(random.normal(size=(10, 6 + seed, 3)), random.uniform(0.3, 2.0, 10), pieces=2)
    corridors = (0.2, minsnap.RoundTube(0.3), minsnap.Room((-1, -1, -np.inf), (1, np.inf, 1)))
    for corridor in corridors:
        found = []
        for choice in ("native", "python"):
            with using(choice):
                found.append(minsnap.certify(traj, points, corridor))
        for name in ("corridor_margin", "waypoint_error", "max_speed", "max_acceleration", "max_jerk", "max_snap"):
            assert getattr(found[0], name) == pytest.approx(getattr(found[1], name), rel=1e-12, abs=1e-12)
        assert found[0].continuity == found[1].continuity and found[0].nearest.leg == found[1].nearest.leg
        assert found[0].nearest.instant == pytest.approx(found[1].nearest.instant, abs=1e-6)
        assert found[0].nearest.name == found[1].nearest.name


def test_exact_polynomials_know_their_sign():
    third = [Fraction(1, 9), Fraction(-2, 9), Fraction(4, 9)]  # (s - 1/3)^2 in control points
    above = [value + Fraction(1, 10**30) for value in third]
    below = [value - Fraction(1, 10**30) for value in third]
    assert is_never_negative(above) and not is_never_negative(below)
    assert is_never_negative([Fraction(0)] * 4) and not is_never_negative([Fraction(1), Fraction(0), Fraction(-1)])


def test_exact_derivatives_are_those_of_the_polynomial():
    cube, three_halves = [[Fraction(value) for value in (0, 0, 0, 1)]], Fraction(3, 2)
    expected = {1: [0, 0, three_halves], 2: [0, three_halves], 3: [Fraction(3, 4)], 4: [0]}
    assert {order: derivative(cube, Fraction(2), order)[0] for order in expected} == expected


def test_an_excess_between_samples_is_still_seen_by_verify():
    x, y = [0.0, 1.0, 0.0], [-100.0, 2.0 * 100.0 * 0.3712, 0.3 + 1e-4 - 100.0 * 0.3712**2]
    traj = Trajectory.from_ppoly(PPoly(np.stack((x, y), axis=1)[:, None, :], [0.0, 1.0]))
    certificate = minsnap.certify(traj, None, minsnap.HalfSpaces((0, 1), 0.3))
    assert certificate.verify() and certificate.corridor_margin < 0.0


def test_a_trajectory_of_too_many_coordinates_is_certified_in_python():
    traj = Trajectory(np.random.default_rng(0).normal(size=(2, 4, 11)), [1.0, 1.0])
    try:
        assert minsnap.certify(traj).max_speed > 0.0
    except MinsnapError as error:  # pragma: no cover
        pytest.fail(str(error))
