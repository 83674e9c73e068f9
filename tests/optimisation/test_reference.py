"""The reference: the optimum of programmes that share no code with it, few rows, what is tried where a solver fails."""

import numpy as np
import pytest
from hypothesis import given, settings
from oracles.sum_of_squares import enclosed, optimum
from programmes import change_daqp
from properties.strategies import corridors
from tasks import many_legs

import minsnap
from minsnap.optimisation import qp

CORNERS = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]
DURATIONS = [4.0, 2.0, 4.0, 2.0]
USUAL = {"lengths": (0.5, 8.0), "pace": 0.3}
"""Durations that differ by a factor of 60 at most."""


HARD = {
    "durations that differ by 50": {
        "waypoints": [
            (0.7261941877359195, 0.11723705501738464),
            (1.9661931880345551, 0.26476611914461906),
            (14.201310868817423, 0.4624099651718785),
            (12.945368180795809, 0.70263252509165),
        ],
        "durations": [1.793595420899849, 33.27237666881627, 0.6661909720176626],
        "corridor": [0.062287450387482526, 0.09245847738147248, 0.06869892241613214],
        "degree": 7,
    },
    "durations that differ by 300": {
        "waypoints": [
            (-1.6963665, 0.86436222),
            (-2.56954458, 0.37696092),
            (-12.09496851, -2.6670987),
            (-13.04434872, -2.981228),
            (-13.27992778, -2.77027183),
        ],
        "durations": [0.53691145, 30.1487113, 2.97073124, 0.10377659],
        "corridor": [0.02306549, 0.04848781, 0.05147743, 0.0281265],
        "degree": 5,
    },
}


@pytest.mark.slow
@settings(max_examples=40)
@given(corridors(legs=(1, 4), dims=(2, 3), degrees=(3, 5, 7), **USUAL))
def test_the_optimum_is_that_of_the_sum_of_squares(asked):
    traj = minsnap.plan(**asked)
    best = optimum(asked["waypoints"], asked["durations"], asked["corridor"], degree=asked["degree"])
    assert best * (1.0 - 1e-6) <= traj.cost((asked["degree"] + 1) // 2) <= best * (1.0 + 1e-5)


def test_the_optimum_of_a_round_tube_between_legs_of_very_different_durations():
    points = [(0.29, 0.03, 0.55), (0.66, 0.89, 0.89), (-7.25, 6.39, 3.60), (-7.86, 7.05, 4.02)]
    durations, radius = [0.68, 19.4, 0.64], [0.94, 0.60, 0.87]
    cost = minsnap.plan(points, durations, corridor=minsnap.RoundTube(radius)).cost()
    assert cost == pytest.approx(optimum(points, durations, radius=radius), rel=1e-5)


@pytest.mark.parametrize("name", HARD)
def test_the_optimum_of_hard_questions_is_that_of_the_sum_of_squares(name):
    asked = HARD[name]
    best = optimum(asked["waypoints"], asked["durations"], asked["corridor"], degree=asked["degree"])
    assert minsnap.plan(**asked).cost((asked["degree"] + 1) // 2) == pytest.approx(best, rel=1e-5)


@settings(max_examples=6)
@given(corridors(legs=(1, 3), dims=(2, 2), degrees=(3, 5, 7), **USUAL))
def test_the_optimum_of_a_round_tube_is_that_of_the_sum_of_squares(asked):
    radius = asked.pop("corridor")
    traj = minsnap.plan(**asked, corridor=minsnap.RoundTube(radius))
    best = optimum(asked["waypoints"], asked["durations"], radius=radius, degree=asked["degree"])
    assert best * (1.0 - 1e-6) <= traj.cost((asked["degree"] + 1) // 2) <= best * (1.0 + 1e-5)


@pytest.mark.slow
@settings(max_examples=15)
@given(corridors(legs=(2, 3), dims=(2, 3), degrees=(5, 7)))
def test_the_optimum_with_free_waypoints_is_that_of_the_sum_of_squares(asked):
    box = 0.5 * float(asked["corridor"].min())
    traj = minsnap.plan(**asked, waypoint_tolerance=box)
    question = asked["waypoints"], asked["durations"], asked["corridor"]
    least, most = enclosed(*question, tolerance=box, degree=asked["degree"])
    half = (asked["degree"] + 1) // 2
    cost, pinned = traj.cost(half), minsnap.plan(**asked).cost(half)
    # the oracle counts in units of the pinned cost
    assert least * (1.0 - 1e-6) - 1e-6 * pinned <= cost <= most * (1.0 + 1e-4) + 1e-6 * pinned
    assert cost <= pinned * (1.0 + 1e-5)
    assert np.abs(traj(traj.leg_breaks) - asked["waypoints"]).max() <= box * (1.0 + 1e-9) + 1e-12


@pytest.mark.parametrize("samples", (1, 3, 8, 20))
def test_samples_alone_cost_less_and_stick_out(samples):
    sampled = minsnap.plan(CORNERS, DURATIONS, corridor=minsnap.Sampled(0.3, samples))
    certain = minsnap.plan(CORNERS, DURATIONS, corridor=0.3)
    assert sampled.cost() < certain.cost()
    assert sampled.report.corridor_margin < 0.0
    s = np.arange(1, samples + 1) / (samples + 1)
    t = sampled.breaks[:-1, None] + sampled.durations[:, None] * s
    offset = sampled(t)
    assert np.abs(offset[0, :, 1]).max() <= 0.3 + 1e-9
    assert np.abs(offset[1, :, 0] - 8.0).max() <= 0.3 + 1e-9


def test_few_rows_are_needed():
    report = minsnap.plan(CORNERS, DURATIONS, corridor=0.3).report
    assert 0 < report.rows <= 120
    assert 1 < report.rounds <= 15


def test_a_corridor_that_is_wide_enough_needs_no_programme():
    report = minsnap.plan(CORNERS, DURATIONS, corridor=50.0).report
    assert (report.solver, report.rounds, report.rows) == ("banded", 0, 0)


def test_axes_that_no_wall_couples_do_not_move_each_other():
    flat = minsnap.plan(CORNERS, DURATIONS, corridor=0.3)
    bent = np.array(CORNERS, float)
    bent[:, 2] += (0.0, 0.05, 0.1, 0.05, 0.0)
    t = np.linspace(0.0, 12.0, 50)
    assert np.abs(flat(t)[:, 2] - 1.0).max() <= 1e-14
    assert minsnap.plan(bent, DURATIONS, corridor=0.3)(t)[:, 2].max() > 1.0


@pytest.mark.slow
@pytest.mark.parametrize("count", (12, 60, 120))
def test_many_legs_are_inside_and_match_a_finely_sampled_programme(count):
    points, durations, widths = many_legs(count)
    traj = minsnap.plan(points, durations, corridor=widths)
    assert minsnap.certify(traj, points, widths).ok
    sampled = minsnap.plan(points, durations, corridor=minsnap.Sampled(widths, 60))
    assert sampled.cost() * (1.0 - 1e-6) <= traj.cost() <= sampled.cost() * (1.0 + 2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("solver", ("piqp", "clarabel"))
def test_large_problems_do_not_depend_on_the_solver(solver):
    points, durations, widths = many_legs(120, seed=1)
    one = minsnap.plan(points, durations, corridor=widths)
    other = minsnap.plan(points, durations, corridor=widths, solver=solver)
    assert other.cost() == pytest.approx(one.cost(), rel=1e-5)


def test_a_hair_s_breadth_and_a_hall():
    points, durations, _ = many_legs(6, seed=2)
    widths = np.array([1e-4, 3.0, 1e-3, 1.0, 1e-2, 0.3])
    traj = minsnap.plan(points, durations, corridor=widths)
    assert minsnap.certify(traj, points, widths).ok
    assert traj.cost() <= optimum(points, durations, widths) * (1.0 + 1e-5)


@pytest.mark.slow
@settings(max_examples=20)
@given(corridors(legs=(1, 4), dims=(2, 3), degrees=(5, 7), **USUAL))
def test_four_solvers_find_the_same_optimum(asked):
    half = (asked["degree"] + 1) // 2
    costs = {name: minsnap.plan(**asked, solver=name).cost(half) for name in ("daqp", "piqp", "clarabel")}
    assert max(costs.values()) <= min(costs.values()) * (1.0 + 1e-5), costs


@pytest.mark.parametrize(("degree", "continuity"), ((3, 2), (7, 4)))
def test_one_leg_has_no_knots_to_be_continuous_at(degree, continuity):
    traj = minsnap.plan([(0.0, 0.0), (1.0, 1.0)], [1.0], corridor=0.5, degree=degree, continuity=continuity)
    assert traj(0.5) == pytest.approx([0.5, 0.5])


@pytest.mark.parametrize("legs", (1, 3))
def test_ends_and_all_waypoints_may_move(legs):
    points, durations, _ = many_legs(legs)
    traj = minsnap.plan(points, durations, waypoint_tolerance=np.full(legs + 1, 0.1), degree=3)
    assert traj.cost(2) < minsnap.plan(points, durations, degree=3).cost(2)


@pytest.mark.parametrize("seed", range(4))
def test_ends_that_may_move_never_cost_more_than_pinned_ones(seed):
    points, durations, widths = many_legs(7, seed)
    room = np.full(8, 0.05)
    free = minsnap.plan(points, durations, corridor=widths + 0.1, waypoint_tolerance=room)
    room[[0, -1]] = 0.0
    pinned = minsnap.plan(points, durations, corridor=widths + 0.1, waypoint_tolerance=room)
    assert free.cost() <= pinned.cost() * (1.0 + 1e-5)
    assert free.cost() >= 0.1 * pinned.cost()


def test_walls_move_inwards_until_answers_that_are_off_are_inside(monkeypatch):
    """Answers are short of their rows by a thousandth of the way from the optimum without walls."""
    best = minsnap.plan(CORNERS, DURATIONS, corridor=0.3).cost()
    monkeypatch.setattr(qp, "_holds", lambda *asked: True)
    change_daqp(monkeypatch, lambda x: x * (1.0 - 1e-3))
    traj = minsnap.plan(CORNERS, DURATIONS, corridor=0.3)
    assert minsnap.certify(traj, CORNERS, 0.3).corridor_margin >= 0.0
    assert best * (1.0 - 1e-5) <= traj.cost() <= 1.1 * best


def test_where_stops_do_not_keep_pins_the_curve_of_most_room_is_blended(monkeypatch):
    start = {"velocity": (1.0, 0.2, 0.0)}
    best = minsnap.plan(CORNERS, DURATIONS, corridor=0.3, start=start).cost()
    change_daqp(monkeypatch, lambda x: None)
    monkeypatch.setitem(qp.TOLERANCES["clarabel"], "max_iter", 3)
    traj = minsnap.plan(CORNERS, DURATIONS, corridor=0.3, start=start)
    assert traj.report.rungs[-1] == "blend"
    assert minsnap.certify(traj, CORNERS, 0.3).corridor_margin >= 0.0
    assert traj(0.0, order=1) == pytest.approx(start["velocity"])
    assert traj.cost() >= best * (1.0 - 1e-5)


def test_a_curve_that_slides_along_a_wall_loses_what_is_only_rounding():
    room = minsnap.Room((-50.0, 0.0), (50.0, 2.0))
    traj = minsnap.plan([(0.0, 0.0), (2.0, 0.0), (5.0, 0.0)], [2.0, 3.0], corridor=room)
    assert traj.report.corridor_margin == 0.0
    assert np.abs(traj(np.linspace(0.0, 5.0, 50))[:, 1]).max() == 0.0
