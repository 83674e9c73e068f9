"""The optimum without walls against exact rationals, scipy's interpolating splines and dense algebra."""

import numpy as np
import pytest
from oracles.curves import jumps
from oracles.exact import Spline
from scipy.interpolate import BPoly, make_interp_spline

import minsnap
from minsnap.errors import DegreeError, SolverError

DEGREES = (3, 5, 7, 9, 11)


def random_question(seed, legs=(1, 6), dim=2, spread=0.5):
    random = np.random.default_rng(seed)
    count = int(random.integers(legs[0], legs[1] + 1))
    return random.normal(size=(count + 1, dim)), 10.0 ** random.uniform(-spread, spread, count)


def away_from(traj, points):
    """Largest distance of control points, in sizes of the curve."""
    return np.abs(traj.control_points - points).max() / np.abs(points).max()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("degree", DEGREES)
def test_it_is_the_exact_optimum(degree, seed):
    points, durations = random_question(seed)
    spline = Spline(points, durations, degree)
    traj = minsnap.plan(points, durations, degree=degree)
    assert away_from(traj, spline.points()) <= 1e-6
    assert traj.cost((degree + 1) // 2) == pytest.approx(spline.cost(), rel=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("degree", DEGREES)
def test_it_is_the_exact_optimum_with_durations_over_four_decades(degree, seed):
    points, durations = random_question(seed, legs=(3, 5), spread=2.0)
    spline = Spline(points, durations, degree)
    traj = minsnap.plan(points, durations, degree=degree)
    assert away_from(traj, spline.points()) <= 2e-6
    assert traj.cost((degree + 1) // 2) == pytest.approx(spline.cost(), rel=5e-6)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("degree", (5, 7, 9))
def test_states_and_pins_are_part_of_the_exact_optimum(degree, seed):
    points, durations = random_question(seed, legs=(3, 5))
    start, pin, end = np.random.default_rng(seed).normal(size=(3, 2))
    states = {0: {1: start}, 2: {1: pin, 2: -pin}, len(durations): {2: end}}
    spline = Spline(points, durations, degree, states)
    traj = minsnap.plan(
        points,
        durations,
        degree=degree,
        start={"velocity": start},
        end={"acceleration": end},
        pins={2: {"velocity": pin, "acceleration": -pin}},
    )
    assert away_from(traj, spline.points()) <= 1e-7
    assert traj.cost((degree + 1) // 2) == pytest.approx(spline.cost(), rel=1e-8)


@pytest.mark.parametrize("degree", DEGREES)
def test_it_is_the_interpolating_spline_of_scipy(degree):
    points, durations = random_question(11, legs=(10, 10), dim=3, spread=0.2)
    traj = minsnap.plan(points, durations, degree=degree)
    rest = [(order, np.zeros(3)) for order in range(1, (degree + 1) // 2)]
    spline = make_interp_spline(traj.breaks, points, k=degree, bc_type=(rest, rest))
    t = np.linspace(0.0, traj.duration, 501)
    assert np.abs(traj(t) - spline(t)).max() <= 1e-6 * np.abs(points).max()


@pytest.mark.parametrize("degree", DEGREES)
def test_one_leg_is_the_hermite_interpolant_of_its_ends(degree):
    half = (degree + 1) // 2
    names = ("velocity", "acceleration", "jerk", "snap", "crackle")[: half - 1]
    start, end = np.random.default_rng(1).normal(size=(2, half, 2))
    states = {
        "start": dict(zip(names, start[1:], strict=True)),
        "end": dict(zip(names, end[1:], strict=True)),
    }
    traj = minsnap.plan([start[0], end[0]], [1.7], degree=degree, **states)
    hermite = BPoly.from_derivatives([0.0, 1.7], [start, end])
    t = np.linspace(0.0, 1.7, 31)
    assert traj(t) == pytest.approx(hermite(t), abs=1e-10)


def test_a_closed_lap_is_the_limit_of_many_laps():
    points = np.array([(0, 0), (4, 0), (5, 3), (1, 4), (0, 0)], float)
    durations = np.array([2.0, 1.5, 2.5, 2.0])
    laps = 25
    many = minsnap.plan(np.concatenate((points[:1], *[points[1:]] * laps)), np.tile(durations, laps))
    closed = minsnap.plan(points, durations, closed=True)
    middle = (laps // 2) * 8.0
    t = np.linspace(0.0, 8.0, 81)
    for order in range(4):
        assert closed(t, order) == pytest.approx(many(middle + t, order), abs=1e-6 * 10.0**order)


def test_a_closed_lap_of_two_legs_is_not_pinned_to_rest():
    traj = minsnap.plan([(0, 0), (2, 1), (0, 0)], [1.0, 2.0], closed=True)
    assert (jumps(traj.then(traj), 6) <= 1e-7).all()
    assert np.abs(traj(0.0, 1)).max() > 1e-3


def test_a_lap_there_and_back_whose_seam_costs_nothing_is_planned():
    """Two cubics with continuous accelerations: no state of the seam is dearer than another."""
    lap = minsnap.plan([(0, 0), (2, 1), (0, 0)], [1.5, 1.5], closed=True, continuity=2)
    assert lap(1.5) == pytest.approx((2.0, 1.0)) and (jumps(lap.then(lap), 2) <= 1e-9).all()
    assert lap.cost() <= 1e-12


@pytest.mark.parametrize(("degree", "continuity"), ((5, 1), (7, 2), (9, 3), (11, 4)))
def test_less_continuity_costs_less_and_leaves_jumps(degree, continuity):
    points, durations = random_question(3, legs=(5, 5), spread=0.2)
    smooth = minsnap.plan(points, durations, degree=degree)
    loose = minsnap.plan(points, durations, continuity=continuity, degree=degree)
    half = (degree + 1) // 2
    assert loose.cost(half) < smooth.cost(half) * 0.999
    for order in range(continuity + 1):
        assert (jumps(loose, order) <= 1e-9).all()
    assert (jumps(loose, continuity + 1) > 1e-3).any()
    for order in range(1, half):
        assert np.abs(loose([0.0, loose.duration], order)).max() <= 1e-9 * np.abs(loose(durations[0] / 2, order)).max()


@pytest.mark.parametrize(("degree", "continuity"), ((5, 0), (7, 0), (7, 1), (9, 2), (11, 3)))
def test_continuity_that_leaves_the_curve_undetermined_is_refused(degree, continuity):
    points, durations = random_question(3, legs=(5, 5))
    with pytest.raises(DegreeError, match="continuity"):
        minsnap.plan(points, durations, degree=degree, continuity=continuity)


@pytest.mark.parametrize(
    "freedom",
    ({"pieces": 2}, {"pieces": "auto"}, {"waypoint_tolerance": 0.1}, {"waypoint_tolerance": minsnap.Ball(0.1)}),
)
@pytest.mark.parametrize(("degree", "continuity"), ((3, 0), (5, 1), (7, 2), (9, 3), (11, 4)))
def test_jumps_where_positions_are_free_are_refused(degree, continuity, freedom):
    """Polynomials of degree k - 1 cost nothing: with jumps at free positions there are many such curves."""
    points, durations = random_question(3, legs=(5, 5))
    timing = {"limits": minsnap.Limits(speed=3.0)} if freedom.get("pieces") == "auto" else {"durations": durations}
    sentence = f"continuity {continuity} at degree {degree} .* use continuity {continuity + 1}, or pieces=1 and no"
    for corridor in (None, 0.5):
        with pytest.raises(DegreeError, match=sentence):
            minsnap.plan(points, degree=degree, continuity=continuity, corridor=corridor, **timing, **freedom)


@pytest.mark.parametrize("continuity", (4, 5, 6))
def test_more_continuity_than_needed_is_there_anyway(continuity):
    points, durations = random_question(4, legs=(5, 5))
    traj = minsnap.plan(points, durations, continuity=continuity)
    assert traj.cost() == pytest.approx(minsnap.plan(points, durations).cost(), rel=1e-12)


@pytest.mark.parametrize("continuity", (4, 5))
def test_continuity_above_three_holds_at_pins_too(continuity):
    points, durations = random_question(5, legs=(4, 4), spread=0.2)
    traj = minsnap.plan(points, durations, continuity=continuity, pins={2: {"velocity": (0.3, -0.2)}})
    assert traj(traj.breaks[2], 1) == pytest.approx([0.3, -0.2], abs=1e-9)
    for order in range(continuity + 1):
        assert (jumps(traj, order) <= 1e-6).all(), order


def test_ten_thousand_legs_are_solved_to_rounding():
    random = np.random.default_rng(6)
    points, durations = np.cumsum(random.normal(size=(10_001, 3)), axis=0), random.uniform(0.5, 2.0, 10_000)
    traj = minsnap.plan(points, durations)
    assert (traj(traj.breaks[:-1]) == points[:-1]).all()
    for order in range(7):
        assert jumps(traj, order).max() <= 1e-9


def test_it_is_quick_to_say_when_precision_ends():
    with pytest.raises(SolverError, match="singular to working precision"):
        minsnap.plan(np.random.default_rng(0).normal(size=(6, 1)), [1e-6, 1e6, 1e-6, 1e6, 1e-6], degree=11)


@pytest.mark.parametrize("total", (1e-3, 1.0, 1e5))
@pytest.mark.parametrize("size", (1e-6, 1.0, 1e6))
def test_from_a_millisecond_to_a_day_from_micrometres_to_megametres(total, size):
    points, shares = random_question(7, legs=(5, 5), dim=3, spread=0.2)
    durations = shares / shares.sum()
    traj = minsnap.plan(size * points, total * durations)
    unit = minsnap.plan(points, durations)
    assert traj(np.linspace(0.0, 1.0, 51) * traj.duration) / size == pytest.approx(
        unit(np.linspace(0.0, 1.0, 51) * unit.duration), abs=1e-9
    )
    assert traj.cost() == pytest.approx(unit.cost() * size**2 / total**7, rel=1e-9)


def test_far_from_the_origin_nothing_is_lost_but_rounding():
    points, durations = random_question(8, legs=(5, 5), dim=3, spread=0.2)
    far = minsnap.plan(points + 1e6, durations)
    near = minsnap.plan(points, durations)
    t = np.linspace(0.0, near.duration, 51)
    assert far(t) - 1e6 == pytest.approx(near(t), abs=1e-8)
    assert far.report.cost == pytest.approx(near.report.cost, rel=1e-8)


def test_a_leg_without_length_is_a_hold_in_place():
    traj = minsnap.plan([(0, 0), (3, 0), (3, 0), (3, 4)], [2.0, 1.0, 2.0])
    assert (traj(traj.breaks) == [(0, 0), (3, 0), (3, 0), (3, 4)]).all()
    assert (jumps(traj, 3) <= 1e-9).all() and traj(np.linspace(2.0, 3.0, 9)) == pytest.approx(np.tile((3, 0), (9, 1)))
