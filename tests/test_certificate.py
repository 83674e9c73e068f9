"""certify against dense grids and roots, on curves made otherwise than by plan."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles.curves import offsets
from scipy.interpolate import CubicSpline, PPoly, make_interp_spline

import minsnap
from minsnap.basics.cards import BAD, GOOD, card
from minsnap.certificate import _continuity, continuity
from minsnap.corridors.knot_regions import STORED
from minsnap.corridors.margins import Margin, nearest_wall
from minsnap.errors import CorridorError, InputError, WaypointError
from minsnap.trajectory.report import path_drawings
from minsnap.trajectory.trajectory import Trajectory

CORNERS = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]
DURATIONS = [4.0, 2.0, 4.0, 2.0]


def wild(seed, legs=3, dim=3):
    """A random spline through random points: nothing that plan would make."""
    random = np.random.default_rng(seed)
    points, times = random.normal(size=(legs + 1, dim)), np.cumsum(random.uniform(0.5, 2.0, legs + 1))
    return points, Trajectory.from_ppoly(CubicSpline(times, points))


@given(st.integers(0, 10_000), st.floats(0.01, 3.0))
def test_the_margin_is_never_above_that_of_a_dense_grid_and_close_to_it(seed, width):
    points, traj = wild(seed)
    reach = np.abs(offsets(traj, points, 2000)).max()
    margin = minsnap.certify(traj, points, width).corridor_margin
    assert margin <= width - reach + 1e-12
    assert margin >= width - reach - 1e-4 * (1.0 + reach)


@given(st.integers(0, 10_000), st.floats(0.01, 3.0))
def test_the_margin_of_a_round_tube_is_that_of_the_distance(seed, radius):
    points, traj = wild(seed)
    reach = np.linalg.norm(offsets(traj, points, 2000), axis=2).max()
    margin = minsnap.certify(traj, points, minsnap.RoundTube(radius)).corridor_margin
    assert margin <= radius - reach + 1e-9
    assert margin >= radius - reach - 1e-4 * (1.0 + reach)


@given(st.integers(0, 10_000))
def test_the_nearest_place_is_where_the_margin_is_taken(seed):
    points, traj = wild(seed)
    nearest = minsnap.certify(traj, points, 0.7).nearest
    step = points[nearest.leg + 1] - points[nearest.leg]
    unit = step / np.linalg.norm(step)
    instant = np.clip(nearest.instant, traj.breaks[nearest.leg], traj.breaks[nearest.leg + 1])
    relative = traj(instant) - points[nearest.leg]
    assert np.abs(relative - relative @ unit * unit).max() == pytest.approx(0.7 - nearest.value, abs=1e-6)
    assert nearest.name == "corridor"


@given(st.integers(0, 10_000))
def test_maxima_are_those_of_the_roots(seed):
    _, traj = wild(seed, dim=1)
    certificate = minsnap.certify(traj)
    for order, found in ((1, certificate.max_speed), (2, certificate.max_acceleration), (3, certificate.max_jerk)):
        ppoly = PPoly(traj.to_ppoly().c[:, :, 0], traj.breaks).derivative(order)
        roots = ppoly.derivative().roots(extrapolate=False) if order < 3 else np.zeros(0)
        ends = traj.derivative(order).control_points[:, [0, -1], 0].reshape(-1)
        values = np.concatenate((ppoly(roots[np.isfinite(roots)]), ends))
        assert found == pytest.approx(np.abs(values).max(), rel=1e-9)
    assert certificate.max_snap == 0.0


def test_the_largest_snap_is_that_of_samples():
    traj = minsnap.plan(CORNERS, DURATIONS)
    snap = np.linalg.norm(traj(np.linspace(0.0, traj.duration, 20_001), 4), axis=1).max()
    assert snap <= minsnap.certify(traj).max_snap <= snap * (1.0 + 1e-6)


def test_limits_are_asked_for_from_an_instant_before_the_end():
    traj, limits = minsnap.plan(CORNERS, DURATIONS), minsnap.Limits(speed=2.0)
    with pytest.raises(InputError, match="limits_from is 12.0: give an instant from 0 to below 12 s"):
        minsnap.certify(traj, limits=limits, limits_from=traj.duration)
    certificate = minsnap.certify(traj, limits=limits, limits_from=traj.duration - 1e-3)
    assert certificate.ok and 0.0 < certificate.limits_from < traj.duration


def test_what_a_plan_keeps_is_confirmed():
    traj = minsnap.plan(CORNERS, DURATIONS, corridor=0.3)
    certificate = minsnap.certify(traj, CORNERS, 0.3)
    assert certificate.ok
    assert 0.0 <= certificate.corridor_margin <= 1e-4
    assert certificate.waypoint_error == 0.0
    assert certificate.continuity == 3
    assert certificate.corridor_margin == pytest.approx(traj.report.corridor_margin, abs=1e-15)


def test_without_questions_it_tells_maxima_alone():
    certificate = minsnap.certify(minsnap.plan(CORNERS, DURATIONS))
    assert certificate.ok
    assert certificate.corridor_margin is certificate.nearest is certificate.waypoint_error is None
    assert certificate.continuity >= 6


@pytest.mark.parametrize(("width", "ok"), ((0.3, True), (0.2999, False), (0.31, True)))
def test_a_corridor_narrower_than_planned_is_seen(width, ok):
    traj = minsnap.plan(CORNERS, DURATIONS, corridor=0.3)
    certificate = minsnap.certify(traj, CORNERS, width)
    assert certificate.ok is ok
    assert certificate.corridor_margin == pytest.approx(width - 0.3, abs=1e-5)


def test_an_excess_of_a_nanometre_is_seen():
    traj = minsnap.plan(CORNERS, DURATIONS, corridor=0.3)
    reach = 0.3 - minsnap.certify(traj, CORNERS, 0.3).corridor_margin
    assert minsnap.certify(traj, CORNERS, reach + 1e-9).ok
    assert not minsnap.certify(traj, CORNERS, reach - 1e-9).ok


def test_an_excess_between_samples_is_seen():
    # a parabola of 0.1 mm above the wall and 2 mm across, far from any grid point of a check at 20 Hz
    x, y = [0.0, 1.0, 0.0], [-100.0, 2.0 * 100.0 * 0.3712, 0.3 + 1e-4 - 100.0 * 0.3712**2]
    traj = Trajectory.from_ppoly(PPoly(np.stack((x, y), axis=1)[:, None, :], [0.0, 1.0]))
    points = [(0.0, 0.0), (1.0, 0.0)]
    margin = minsnap.certify(traj, None, minsnap.HalfSpaces((0, 1), 0.3)).corridor_margin
    assert margin == pytest.approx(-1e-4, rel=1e-9)
    assert (traj(np.linspace(0.0, 1.0, 21))[:, 1] < 0.3).all()
    assert not minsnap.certify(traj, points, minsnap.HalfSpaces((0, 1), 0.3)).ok


def test_missed_waypoints_are_seen():
    traj = minsnap.plan(CORNERS, DURATIONS)
    moved = np.array(CORNERS, float)
    moved[2] += (3e-3, 4e-3, 0.0)
    certificate = minsnap.certify(traj, moved)
    assert not certificate.ok
    assert certificate.waypoint_error == pytest.approx(5e-3)
    assert minsnap.certify(traj, moved, tolerance=5e-3).ok


@pytest.mark.parametrize(("degree", "expected"), ((1, 0), (3, 2), (5, 4), (7, 6)))
def test_continuity_is_counted(degree, expected):
    random = np.random.default_rng(1)
    times, points = np.arange(13.0), random.normal(size=13)
    ppoly = PPoly.from_spline(make_interp_spline(times, points, k=degree))
    real = np.diff(ppoly.x) > 0.0
    traj = Trajectory.from_ppoly(PPoly(ppoly.c[:, real], np.unique(ppoly.x)))
    assert minsnap.certify(traj).continuity == expected


def test_a_jump_in_position_is_counted_as_none():
    assert minsnap.certify(Trajectory([[[0.0], [1.0]], [[1.5], [2.0]]], [1.0, 1.0])).continuity == -1


@pytest.mark.parametrize("judge", (continuity, _continuity))
@pytest.mark.parametrize(("share", "expected"), ((0.9, 1), (1.1, 0)))
def test_a_jump_of_the_velocity_is_judged_by_the_legs_beside_it(judge, share, expected):
    """Far away a velocity is known to the rounding of the positions over the shorter of two legs."""
    durations = np.array([1.0, 1.0, 0.01, 0.01, 1.0, 1.0])
    velocity = np.array([1.0, 1.0, 1.0, 1.0, 0.0, 0.0]) * share * STORED * 1e9 * 2.0 / 0.01
    ends = 1e9 + np.cumsum(velocity * durations)
    traj = Trajectory(np.stack((np.append(1e9, ends[:-1]), ends), axis=1)[:, :, None], durations)
    assert judge(traj) == expected


@pytest.mark.parametrize("judge", (continuity, _continuity))
def test_parts_of_one_polynomial_are_continuous_in_all_derivatives(judge):
    """1 + (t - 1)^3, cut at 1."""
    cubic = np.array([[0.0, 1.0, 1.0, 1.0], [1.0, 1.0, 1.0, 2.0]])
    assert judge(Trajectory(cubic[:, :, None], [1.0, 1.0])) == 3


def test_constraints_of_several_kinds_give_the_least_margin():
    traj = minsnap.plan(CORNERS, DURATIONS, corridor=0.3)
    tube, round_tube = minsnap.Tube(0.5), minsnap.RoundTube(0.4)
    margin = minsnap.certify(traj, CORNERS, [tube, round_tube]).corridor_margin
    assert margin == min(minsnap.certify(traj, CORNERS, one).corridor_margin for one in (tube, round_tube))


def test_pieces_of_a_leg_belong_to_one_tube():
    traj = minsnap.plan(CORNERS, DURATIONS, corridor=0.3, pieces=3)
    certificate = minsnap.certify(traj, CORNERS, 0.3)
    assert certificate.ok
    assert certificate.nearest.leg in range(4)


@pytest.mark.parametrize(("ok", "word", "colour"), ((True, "all", GOOD), (False, "not all", BAD)))
def test_a_card_shows_what_was_found(ok, word, colour):
    path = minsnap.plan(CORNERS, DURATIONS)
    none = minsnap.certify(path, limits=minsnap.Limits(speed=4.0))
    norms = {"max_speed": 1.5, "max_acceleration": 2.5, "max_jerk": 3.5, "max_snap": 4.5}
    named = [
        ("max speed", "1.5 m/s"),
        ("max acceleration", "2.5 m/s²"),
        ("max jerk", "3.5 m/s³"),
        ("max snap", "4.5 m/s⁴"),
    ]
    always = [*named, ("continuous derivatives", "6"), *(used.fact for used in none.utilisation)]
    assert [fact for fact in replace(none, **norms)._facts() if fact[1]] == always
    places = {"nearest": Margin(0.25, 1, 2.5, "corridor"), "waypoint_error": 0.125, "waypoint_excess": 0.5}
    all_ = replace(none, ok=ok, corridor_margin=0.25, **places, **norms)
    where = [("corridor margin", "0.25 m, least on leg 1 at 2.5 s"), ("waypoint error", "0.125 m")]
    facts = [*where, ("outside of waypoints", "0.5 m"), *always]
    title = f"Certificate: {word} conditions hold"
    assert all_._repr_html_() == card(title, facts, path_drawings(path), good=ok)
    assert f'{colour}">{title}<' in all_._repr_html_()


def test_no_walls_no_margin():
    assert nearest_wall(minsnap.plan(CORNERS, DURATIONS), []) is None


@pytest.mark.parametrize(
    ("traj", "arguments", "error", "words"),
    (
        (lambda: minsnap.circle(2.0).sample(), (), InputError, "Trajectory"),
        (lambda: minsnap.plan(CORNERS, DURATIONS), (CORNERS[:3],), WaypointError, r"shape \(5, 3\)"),
        (lambda: minsnap.plan(CORNERS, DURATIONS), (np.zeros((5, 2)),), WaypointError, r"shape \(5, 3\)"),
        (lambda: minsnap.plan(CORNERS, DURATIONS), (CORNERS, [0.3, 0.3]), CorridorError, "4 legs"),
        (lambda: minsnap.plan(CORNERS, DURATIONS), (CORNERS, -1.0), CorridorError, "positive"),
    ),
)
def test_what_does_not_fit_is_refused(traj, arguments, error, words):
    with pytest.raises(error, match=words):
        minsnap.certify(traj(), *arguments)
