"""Least distance by non-negative least squares: against DAQP, with guesses, with contradictions."""

import numpy as np
import pytest
import qpsolvers
from programmes import least_distance as programme

from minsnap.optimisation.least_distance import least_distance


@pytest.mark.parametrize("seed", range(5))
def test_it_is_the_point_that_daqp_finds(seed):
    _, q, G, h = programme(seed)
    q = q + np.linspace(-1.0, 1.0, len(q))
    x, multipliers, _ = least_distance(G, h, None, None, q, None)
    assert x == pytest.approx(qpsolvers.solve_qp(np.eye(len(q)), q, G, h, solver="daqp"), abs=1e-5)
    assert np.abs(x + q + G.T @ multipliers).max() <= 1e-12
    assert (G @ x - h).max() <= 1e-12


@pytest.mark.parametrize("right", (True, False))
def test_what_was_active_before_changes_nothing_but_the_time(right):
    _, q, G, h = programme(3)
    whole = least_distance(G, h, None, None, q, None)
    active = whole[1] > 0.0 if right else np.arange(len(h)) == np.argmin(whole[1])
    for guess in (active, active[: len(h) // 2], np.zeros(len(h), dtype=bool)):
        x, multipliers, _ = least_distance(G, h, None, None, q, guess)
        assert x == pytest.approx(whole[0], abs=1e-12)
        assert multipliers == pytest.approx(whole[1], abs=1e-9)


def test_nearly_dependent_rows_are_told_apart():
    # the corner of two lines that differ by 1e-7 in direction
    G = -np.array([[1.0, 1e-7], [1.0, -1e-7]])
    x, multipliers, _ = least_distance(G, np.array([-1.0, -1.0 - 1e-7]), None, None, np.zeros(2), None)
    assert (G @ x + [1.0, 1.0 + 1e-7]).max() <= 1e-15
    assert (multipliers >= 0.0).all()


def test_equalities_hold_and_contradictions_have_no_solution():
    A, b = np.array([[0.0, 1.0]]), np.array([2.0])
    G, h = np.array([[-1.0, 0.0]]), np.array([-3.0])
    x, multipliers, forces = least_distance(G, h, A, b, np.zeros(2), None)
    assert x == pytest.approx([3.0, 2.0])
    assert (multipliers[0], forces[0]) == pytest.approx((3.0, -2.0))
    assert least_distance(np.array([[1.0], [-1.0]]), np.array([-1.0, -1.0]), None, None, np.zeros(1), None) is None
