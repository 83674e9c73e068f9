"""Corridors of many legs: windows and tiles in the native core, open and closed, with waypoints fixed or free."""

import numpy as np
import pytest
from helpers.questions import real_cost, tube_planes, tube_question
from helpers.tasks import many_legs

import minsnap
from minsnap import Ball, Gate, RoundTube, Trajectory, certify
from minsnap.native import library
from minsnap.native.corridor import solve_corridor
from minsnap.native.status import Status
from minsnap.optimisation import native_solve

pytestmark = pytest.mark.skipif(library.core().library is None, reason="there is no native core")


def closed_legs(count, seed=0):
    """Points of a walk that ends where it begins, durations like its lengths, and half-widths."""
    points, durations, widths = many_legs(count, seed)
    points -= np.linspace(0.0, 1.0, count + 1)[:, None] * points[-1]
    points[-1] = points[0]
    return points, durations, widths


def gates_at(points, seed):
    """Half of the inner points as gates, slanted ones among them."""
    random = np.random.default_rng(seed)
    gates = [
        Gate(point, random.normal(size=3) if random.random() < 0.7 else np.eye(3)[1], *random.uniform(0.1, 0.3, 2))
        for point in points[1:-1]
    ]
    chosen = random.random(len(gates)) < 0.5
    return [points[0], *(gate if taken else gate.center for gate, taken in zip(gates, chosen, strict=True)), points[-1]]


def native_plan(monkeypatch, waypoints, tolerance=0.0, **asked):
    """The native core's plan, certified, the bound of its cost within the gap."""
    answers = []

    def noted(*known):
        answers.append(solve_corridor(*known))
        return answers[-1]

    monkeypatch.setattr(native_solve, "solve_corridor", noted)
    others = {"waypoint_tolerance": tolerance} if tolerance != 0.0 else {}
    found = minsnap.plan(waypoints, **asked, **others)
    assert found.report.core == "native", found.report.handed_over
    assert certify(found, waypoints, asked.get("corridor"), tolerance=tolerance).ok
    assert -1e-9 <= 1.0 - answers[-1].bound / answers[-1].cost <= 1e-6
    return found


@pytest.mark.parametrize(("half", "shared"), [(3, 2), (4, 3), (5, 4), (4, 2)])
def test_a_closed_lap_of_many_pieces_ends_in_the_state_in_which_it_starts(half, shared):
    points, durations, widths = closed_legs(130)
    answer = solve_corridor(tube_question(points, durations, widths, half=half, closed=True, continuity=shared))
    assert answer.status is Status.DONE
    assert 0.0 <= answer.cost - answer.bound <= 1e-6 * answer.cost
    lap = Trajectory(answer.points, durations)
    found = certify(lap, points, widths)
    assert found.ok and found.continuity == shared
    for order in range(shared + 1):
        unit = np.abs(lap(lap.breaks, order)).max()
        assert lap(lap.duration, order) == pytest.approx(lap(0.0, order), abs=1e-9 * unit)


@pytest.mark.parametrize("turn", [7, 50, 99])
def test_where_a_lap_begins_does_not_matter(turn):
    points, durations, widths = closed_legs(100, seed=2)
    one = solve_corridor(tube_question(points, durations, widths, closed=True))
    turned = np.concatenate((points[turn:-1], points[: turn + 1]))
    other = solve_corridor(tube_question(turned, np.roll(durations, -turn), np.roll(widths, -turn), closed=True))
    assert other.cost == pytest.approx(one.cost, rel=1.5e-6)
    assert other.points == pytest.approx(np.roll(one.points, -turn, axis=0), abs=1e-3)


def test_a_lap_that_does_not_end_where_it_begins_is_not_solved_in_windows():
    points, durations, widths = many_legs(100)
    assert solve_corridor(tube_question(points, durations, widths, closed=True)).status is Status.UNSUPPORTED


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "corridor", "closed"),
    [
        *(("box", "none", False), ("box", "tube", True), ("box", "round", False)),
        *(("ball", "none", True), ("ball", "tube", False), ("ball", "round", True)),
        *(("gates", "none", False), ("gates", "tube", True), ("gates", "round", False)),
    ],
)
def test_free_waypoints_cost_what_they_cost_the_python_core(monkeypatch, kind, corridor, closed):
    seed = ["box", "ball", "gates"].index(kind)
    points, durations, widths = (closed_legs if closed else many_legs)(60 + 7 * seed, seed)
    asked = {"durations": durations, "closed": closed}
    if corridor != "none":
        asked["corridor"] = widths if corridor == "tube" else RoundTube(widths)
    waypoints = gates_at(points, seed) if kind == "gates" else points
    tolerance = {"box": 0.1, "ball": Ball(0.15), "gates": 0.0}[kind]
    fast = native_plan(monkeypatch, waypoints, tolerance, **asked)
    with library.using("python"):
        others = {"waypoint_tolerance": tolerance} if tolerance != 0.0 else {}
        slow = minsnap.plan(waypoints, **asked, **others)
    assert fast.cost() == pytest.approx(slow.cost(), rel=1.5e-6)


@pytest.mark.parametrize("kind", ["fixed", "box", "gates"])
def test_laps_of_a_thousand_legs(monkeypatch, kind):
    points, durations, widths = closed_legs(1000)
    waypoints = gates_at(points, 0) if kind == "gates" else points
    corridor = None if kind == "box" else widths
    native_plan(
        monkeypatch, waypoints, 0.1 if kind == "box" else 0.0, durations=durations, corridor=corridor, closed=True
    )


def test_many_waypoints_in_balls(monkeypatch):
    points, durations, _ = many_legs(300)
    native_plan(monkeypatch, points, Ball(0.1), durations=durations)


@pytest.mark.parametrize("seed", [10, 13, 77])
def test_what_is_felt_far_away_takes_longer_tiles(monkeypatch, seed):
    points, durations, widths = closed_legs(55, seed)
    native_plan(monkeypatch, points, Ball(0.25), durations=durations, corridor=widths, pieces=2, closed=True)


@pytest.mark.parametrize(("legs", "half"), [(49, 4), (130, 4), (1000, 4), (300, 3), (200, 5)])
def test_many_legs_are_solved_in_windows_and_bounded_as_a_whole(legs, half):
    points, durations, widths = many_legs(legs)
    answer = solve_corridor(tube_question(points, durations, widths, half=half))
    assert answer.status is Status.DONE
    assert 0.0 <= answer.cost - answer.bound <= 1e-6 * answer.cost
    found = certify(Trajectory(answer.points, durations), points, widths)
    assert found.ok and found.continuity >= half - 1


def test_windows_cost_what_the_whole_costs():
    points, durations, widths = many_legs(120, seed=4)
    answer = solve_corridor(tube_question(points, durations, widths))
    with library.using("python"):
        python = minsnap.plan(points, durations, corridor=widths)
    question = tube_question(points, durations, widths)
    assert real_cost(question, answer.cost) == pytest.approx(python.report.cost, rel=3e-6)
    assert real_cost(question, answer.bound) <= python.report.cost


def test_states_and_contacts_of_windows_are_those_of_the_whole_curve():
    points, durations, widths = many_legs(100, seed=1)
    question = tube_question(points, durations, widths)
    answer = solve_corridor(question)
    curve = Trajectory(answer.points, durations)
    for order in range(4):
        unit = question.length / question.time**order
        assert answer.knots[1:, order] * unit == pytest.approx(
            curve(curve.breaks[1:], order) - (points[1:] if order == 0 else 0.0), abs=1e-9 * unit
        )
    walls = tube_planes(points, widths).chosen(answer.wall)
    offset = curve(curve.breaks[walls.leg] + answer.s * durations[walls.leg]) - walls.anchor
    assert np.einsum("rd,rd->r", -walls.slope, offset) == pytest.approx(walls.radius, rel=1e-3)
