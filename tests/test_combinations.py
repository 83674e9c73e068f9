"""Kept combinations of everything that a plan can be asked, judged by an oracle of benchmarks/ from control points."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.optimize
from combination_oracle import Judge, greatest, squared
from random_combinations import judged, outcome, planted, question

import minsnap
from minsnap.basics.deadline import WORK, Deadline
from minsnap.durations import timing
from minsnap.native.status import Status
from minsnap.optimisation import least_slacks, native_solve
from minsnap.optimisation.solve import Effort
from minsnap.trajectory.trajectory import as_plan

KEPT = (
    *[5, 6, 7, 9, 11, 13, 14, 15, 19, 21, 23, 24, 26, 29, 30, 32, 34, 37],
    *[40, 41, 42, 44, 48, 49, 51, 53, 57, 58, 59, 60, 62, 63, 65, 67, 70, 71],
    *[73, 74, 77, 81, 83, 85, 87, 88, 92, 93, 95, 96, 97, 98, 99, 102, 104, 107],
    *[109, 111, 112, 113, 116, 121, 123, 124, 125, 127, 128, 129, 133, 135, 138, 140, 141, 143],
    *[145, 148, 149, 150, 157, 160, 161, 162, 163, 164, 165, 167, 168, 126, 1284, 1295, 20342, 20589],
    *[400902, 401674, 1003973, 1101141, 100015307, 210001194, 380000088, 390010004],
)
"""Seeds: drawn ones that end quickly, and at the end those that once were wrong, took ten seconds or did not end."""

PLANTED = (
    *[100001, 100043, 100083, 100126, 100166, 100206, 100239, 100279, 100325, 100366, 100406, 100443],
    *[100479, 100518, 100562, 100603, 100643, 100688, 100730, 100776, 100817, 100857, 100895, 100937],
    *[100978, 101016, 101065, 101103, 101153, 101193, 101244, 101291, 101332, 101380, 101423, 101461],
    *[101519, 7006408, 7006775, 7007251, 7008043, 50004885],
)
"""Seeds of questions of which a plan is known; at the end those once refused, by proof or by the count of work."""


@pytest.mark.slow
@pytest.mark.parametrize("seed", KEPT)
def test_what_is_planned_is_right_and_what_is_refused_says_so(seed):
    _, kind, said, _ = outcome(seed)
    assert kind in ("planned", "proved", "unproved", "late", "solver"), said
    assert "last look" not in said


@pytest.mark.slow
@pytest.mark.parametrize("seed", [900043, 900253])
def test_searches_try_times_by_the_reference_where_the_native_core_does_not_take_the_problem(seed):
    """Cubics with a continuous acceleration, and a continuity below that of a piece."""
    _, kind, said, _ = outcome(seed)
    assert kind == "planned", said


@pytest.mark.slow
def test_a_total_is_searched_from_the_shortest_plan_where_legs_of_one_speed_leave_the_tube():
    """It was refused as a problem "that has a solution"."""
    _, kind, said, _ = outcome(401863)
    assert kind == "planned", said


@pytest.mark.slow
@pytest.mark.parametrize("seed", [320000120, 320000187, 320000213])
def test_a_total_longer_than_that_of_a_plan_has_one_too(seed):
    """A price of time did not reach the total, and two splits had no plan."""
    asked, _ = question(seed)
    asked.pop("search", None)
    shortest = minsnap.plan(**asked)
    path = minsnap.plan(**asked, total_time=1.01 * shortest.duration)
    assert path.duration == pytest.approx(1.01 * shortest.duration, rel=1e-9)
    assert seed != 320000120 or path.cost() <= 3e12  # 4.2e12 from the shortest plan alone, not between two


@pytest.mark.parametrize(("seed", "most"), [(470161244, 0.038), (470168555, 2.81), (470176434, 5.84)])
def test_what_a_derivative_limits_is_not_said_to_be_limited_by_nothing(seed, most):
    """A short lap ended its search early, and a turning yaw held two inside of their limits: no plan, for that."""
    asked, _ = question(seed)
    assert minsnap.plan(**asked | {"search": minsnap.Search()}).duration <= most


@pytest.mark.slow
def test_limits_that_a_search_tightened_are_no_room_inside_them():
    """It was taken for a path that nothing limits; three pieces flew 3.634 s."""
    asked, _ = question(460016750)
    assert minsnap.plan(**asked).duration <= 3.75


@pytest.mark.slow
def test_a_price_of_time_has_a_plan_where_limits_bound_nothing():
    """Cubics have no snap to be limited: in the durations that were tried, none was flown as fast as that allows."""
    _, kind, said, _ = outcome(490007964)
    assert kind == "planned", said


@pytest.mark.slow
def test_a_yaw_in_time_is_measured_again_where_a_curve_is_flown_more_slowly():
    """Rotors broke their limit on the slower curve; what was tried in its place takes 7.2 s."""
    asked, _ = question(401674)
    assert minsnap.plan(**asked | {"search": minsnap.Search()}).duration < 6.5


@pytest.mark.slow
@pytest.mark.parametrize("seed", [340002645, 340048612])
def test_a_yaw_in_time_is_measured_again_where_more_derivatives_join(seed):
    """The path was flown as fast as its rotors allow with the yaw of another pace, and refused at the last look."""
    _, kind, said, _ = outcome(seed)
    assert kind == "planned", said


@pytest.mark.slow
def test_a_price_whose_durations_have_a_curve_but_not_within_limits_is_refused_by_the_limit():
    """It was refused as a problem "that has a solution"."""
    _, kind, said, _ = outcome(340041288)
    assert kind == "solver"
    assert said.startswith("no plan that keeps the limits inside the corridor was found")
    assert "speed reaches" in said


@pytest.mark.slow
def test_what_a_question_without_end_does_is_bounded_by_what_it_is_worth(monkeypatch):
    """Slacks for a proof, a solve, slacks for the words of a refusal and another solve each had work of their own."""
    done, beyond, spend = [0.0], [], Deadline.spend

    def watched(solve, place):
        def asked_for(*asked):
            left = max(WORK.question - sum(done), 0.0)
            beyond.append(asked[place] * WORK.solve - left)
            return solve(*asked)

        return asked_for

    monkeypatch.setattr(Deadline, "spend", lambda own, work: (done.append(work), spend(own, work)))
    monkeypatch.setattr(native_solve, "solve_corridor", watched(native_solve.solve_corridor, 2))
    monkeypatch.setattr(least_slacks, "least_slack", watched(least_slacks.least_slack, 3))
    _, kind, said, _ = outcome(330019442)
    assert kind in ("late", "proved"), said
    assert len(beyond) >= 4 and max(beyond) <= 1e-9
    assert sum(done) <= 1.2 * WORK.question  # 4264 before; a solve ends after the round in which its work is done


@pytest.mark.slow
@pytest.mark.parametrize("seed", [247, 20474])
def test_limits_that_given_durations_cannot_keep_are_refused_with_a_proof_and_a_longer_time(seed):
    """Without and with equations of continuity, which hold between the walls of a proof."""
    asked, _ = question(seed)
    with pytest.raises(minsnap.InfeasibleError, match="times as long would do") as refused:
        minsnap.plan(**asked)
    assert refused.value.verify()
    assert minsnap.plan(**asked | {"durations": refused.value.stretch * asked["durations"]}).duration > 0.0


@pytest.mark.slow
def test_the_sign_of_slacks_is_proved_with_a_part_of_the_work_that_they_are_worth(monkeypatch):
    """The last stage went on until the curve kept the walls that had given way, and did all the work."""
    ended, solved = [], least_slacks.least_slack
    monkeypatch.setattr(least_slacks, "least_slack", lambda *asked: ended.append(solved(*asked)) or ended[-1])
    asked, _ = question(210001264)
    (walls,) = asked["corridor"]
    rounded = replace(walls, normal=walls.normal.round(12), offset=walls.offset.round(12))
    asked["corridor"] = rounded  # the same on every processor
    with pytest.raises(minsnap.InfeasibleError):
        minsnap.plan(**asked)
    assert ended
    assert all(one.status is Status.DONE for one in ended)


@pytest.mark.slow
def test_pivots_of_a_programme_of_slacks_end_with_the_work_of_the_question(monkeypatch):
    """The third of this one took 34,795 pivots, 13 s, and was counted as 0.6 s."""
    pivots, solved = [], scipy.optimize.linprog
    monkeypatch.setattr(
        scipy.optimize, "linprog", lambda *asked, **how: pivots.append(solved(*asked, **how)) or pivots[-1]
    )
    _, kind, said, _ = outcome(310004946)
    assert kind == "late", said
    assert 1000 < sum(one.nit for one in pivots) < 6000


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.3, 0.6, 0.8, 1.0, 3.0])
def test_what_moves_at_its_ends_has_a_plan_in_any_time_above_the_shortest(share):
    """It cannot be flown more slowly: durations of the shortest plan are lengthened, those of moving legs or not."""
    asked, _ = question(20000712)
    total = share * asked["total_time"]
    assert minsnap.plan(**asked | {"total_time": total}).duration == pytest.approx(total, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed", [60000209, 60000942, 60001157, 60001291, 60001799, 60000079, 60000207, 60002132, 60000311]
)
def test_what_was_refused_without_a_proof_has_a_plan(seed):
    """Times that leave room between walls are sought by least slacks, and three need as many pieces a leg.

    Of the last one the work was counted as ten times as much as it is.
    """
    _, kind, said, _ = outcome(seed)
    assert kind == "planned", said


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "longest"), [(7300530, 2.6), (7300658, 4.0), (7300723, 2.8)])
def test_a_search_waits_for_curves_that_fly_faster(seed, longest):
    """They took 2.88, 5.51 and 3.10 s where each problem of a search had 0.1 of its work."""
    asked, _ = question(seed)
    assert minsnap.plan(**asked).duration <= longest


@pytest.mark.slow
@pytest.mark.parametrize("seed", [101001782, 310003013])
def test_a_leg_whose_length_alone_is_too_much_is_refused_after_a_glance(monkeypatch, seed):
    """A whole attempt and least slacks took 3 of 3.6 s, and the proof 0.02 s."""
    solve, efforts = timing.solve, []

    def noted(task, *given, effort):
        efforts.extend([effort] * task.explains)
        return solve(task, *given, effort=effort)

    monkeypatch.setattr(timing, "solve", noted)
    monkeypatch.setattr(timing, "_explained", lambda *given: pytest.fail("slacks were asked"))
    _, kind, said, _ = outcome(seed)
    assert kind == "proved" and "its length alone needs" in said and "times as long would do" in said
    assert efforts == [Effort.GLANCE]


@pytest.mark.slow
@pytest.mark.parametrize("seed", PLANTED)
def test_what_has_a_plan_is_planned(seed):
    _, kind, said, _ = outcome(seed, planted)
    assert kind == "planned", said


def test_the_judge_sees_what_is_wrong():
    """A plan that the judge finds right is changed by a millionth, one thing after another."""
    asked, known = question(5)
    curve = minsnap.plan(**asked)
    assert not judged(asked, known, curve)
    points = np.array(curve.control_points)
    points[0, 1] += 1e-6 * np.abs(points).max()
    changed = as_plan(minsnap.Trajectory(points, curve.durations, pieces=curve.pieces), curve.report)
    assert judged(asked, known, changed)


def test_bounds_of_polynomials_are_those_of_fine_samples():
    draw, s = np.random.default_rng(1), np.linspace(0.0, 1.0, 2001)
    for _ in range(30):
        vectors = draw.normal(size=(6, 3))
        curve = sum(c[:, None] * v for c, v in zip(bernstein(5, s), vectors, strict=True))
        most = (curve**2).sum(axis=1).max()
        coefficients = squared(vectors.astype(np.longdouble))
        assert greatest(coefficients, most - 1e-4) is not None and greatest(coefficients, most + 1e-4) is None


def bernstein(degree, s):
    """Return the basis, (degree + 1, m)."""
    from math import comb

    return [comb(degree, j) * s**j * (1 - s) ** (degree - j) for j in range(degree + 1)]


def test_thrust_and_tilt_of_a_turn_are_those_of_a_circle():
    """A parabola's acceleration is constant: thrust and tilt follow from it and gravity."""
    points = np.array([[(0, 0, 0), (0, 0, 0), (1.0, 0, 0)]])
    judge = Judge(points, np.ones(1), 1)
    level = np.hypot(2.0, 9.81) / 9.81
    judge.flight({"max_thrust": level + 1e-6, "tilt": np.arctan2(2.0, 9.81) + 1e-6}, 9.81)
    assert not judge.wrong
    judge.flight({"max_thrust": level - 1e-6}, 9.81)
    judge.flight({"tilt": np.arctan2(2.0, 9.81) - 1e-6}, 9.81)
    assert len(judge.wrong) == 2
