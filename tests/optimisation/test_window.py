"""Late rounds of the Python core solve near new rows alone, and give away no more than is allowed."""

import numpy as np
import pytest
from scipy.sparse import csc_matrix

import minsnap
from minsnap.optimisation import axis_group, qp
from minsnap.optimisation.qp import Programme, Solution, solve_qp
from minsnap.optimisation.window import loss, solve_near


def winding(seed, legs=120):
    points = np.cumsum(np.random.default_rng(seed).uniform(-3.0, 3.0, (legs + 1, 3)), axis=0)
    return points, np.linalg.norm(np.diff(points, axis=0), axis=1)


def planned(monkeypatch, reach):
    """Costs of long corridors, and the numbers of unknowns that were solved for."""
    sizes, solved = [], qp._through_qpsolvers
    monkeypatch.setattr(axis_group, "REACH", reach)
    monkeypatch.setattr(qp, "_through_qpsolvers", lambda asked, name: sizes.append(len(asked.q)) or solved(asked, name))
    curves = [minsnap.plan(*winding(seed), corridor=0.2) for seed in (4, 5, 6)]
    monkeypatch.undo()
    assert all(curve.report.corridor_margin >= 0.0 and not curve.report.rungs for curve in curves)
    return [curve.cost() for curve in curves], sizes


def test_late_rounds_solve_for_few_unknowns_and_cost_the_same(monkeypatch):
    costs, sizes = planned(monkeypatch, 4)
    whole, all_sizes = planned(monkeypatch, 1000)
    assert min(all_sizes) == max(all_sizes) == max(sizes)
    assert 4 * min(sizes) < max(sizes)
    assert costs == pytest.approx(whole, rel=1e-7)


def chain(count):
    """A least-distance problem whose unknowns are coupled to their neighbours."""
    P = csc_matrix(np.eye(count) - 0.3 * (np.eye(count, k=1) + np.eye(count, k=-1)))
    return Programme(P, np.zeros(count), csc_matrix(-np.eye(count)[[5, 40]]), np.array([-1.0, -2.0]))


@pytest.mark.parametrize(("near", "good"), [(np.arange(25, 55), True), (np.arange(39, 42), False)])
def test_what_holding_the_other_unknowns_costs_decides(near, good):
    asked = chain(60)
    first = solve_qp(Programme(asked.P, asked.q, asked.G[:1], asked.h[:1]), "piqp")
    last = Solution(first.x, np.append(first.multipliers, 0.0), np.zeros(0), "piqp")
    found, best = solve_near(asked, last, near, np.full(2, 1e-6)), solve_qp(asked, "piqp")
    assert (found is not None) == good
    if good:
        assert found.x == pytest.approx(best.x, abs=1e-4) and found.multipliers == pytest.approx(
            best.multipliers, abs=1e-4
        )


def test_the_bound_of_what_is_lost_is_what_is_lost():
    """Where multipliers are those of the least, it is half the square of the distance in the Hessian."""
    asked = chain(60)
    best = solve_qp(asked, "piqp")
    off = 0.01 * np.random.default_rng(0).normal(size=60)
    moved = Solution(best.x + off, best.multipliers, np.zeros(0), "piqp")
    slack = float(best.multipliers @ (asked.h - asked.G @ moved.x))
    assert loss(asked, moved) == pytest.approx(0.5 * off @ (asked.P @ off) + slack, rel=1e-6)
