"""Few polynomials for many samples: the distance that is stated holds, and no piece more than is needed."""

from __future__ import annotations

import numpy as np
import pytest

import minsnap
from minsnap.errors import InputError, UnprovedError
from minsnap.files.sample_fit import distance_between

PLAN = minsnap.plan([(0, 0, 1), (4, 1, 1), (5, 4, 2), (0, 3, 1)], total_time=12.0, yaw=[0, 1, 2, 8])
T = np.linspace(0.0, 12.0, 289)
FRAMES = PLAN(T)


def lines(t, at, position):
    """Positions of the straight lines between samples, at instants."""
    return np.column_stack([np.interp(at, t, axis) for axis in position.T])


@pytest.mark.parametrize("tolerance", [0.002, 0.01, 0.1])
@pytest.mark.parametrize("decimals", [3, 9])
def test_what_is_stated_holds_at_samples_and_between(tolerance, decimals):
    frames = FRAMES.round(decimals)
    fit = minsnap.fit_samples(T, frames, tolerance)
    curve = fit.trajectory
    assert np.linalg.norm(curve(np.minimum(T, curve.duration)) - frames, axis=1).max() <= fit.at_samples <= tolerance
    at = np.linspace(0.0, curve.duration, 20_001)
    apart = np.linalg.norm(curve(at) - lines(T, at, frames), axis=1).max()
    assert apart <= fit.between <= 1.2 * apart
    assert curve.duration == pytest.approx(12.0)
    for order in (1, 2, 3):
        assert np.abs(curve(0.0, order)).max() < 1e-7 and np.abs(curve(curve.duration, order)).max() < 1e-7
    assert minsnap.certify(curve).continuity >= 3


def test_a_plan_of_three_pieces_needs_three():
    """Its own knots are not on the grid of the search; a millimetre is little beside four metres."""
    fit = minsnap.fit_samples(T, FRAMES, 0.001)
    assert len(fit.trajectory.durations) <= 4
    assert len(minsnap.fit_samples(T, FRAMES, 10.0).trajectory.durations) == 1


def test_it_needs_no_more_pieces_than_an_even_least_squares_spline():
    """Scipy's, of the same degree and continuity with even knots, the ends free."""
    from scipy.interpolate import make_lsq_spline

    frames, tolerance = FRAMES.round(3), 0.004
    for pieces in range(1, 40):
        inner = np.repeat(np.linspace(0.0, 12.0, pieces + 1)[1:-1], 4)
        spline = make_lsq_spline(T, frames, np.r_[[0.0] * 8, inner, [12.0] * 8], k=7)
        if np.linalg.norm(spline(T) - frames, axis=1).max() <= tolerance:
            break
    assert len(minsnap.fit_samples(T, frames, tolerance, rest=False).trajectory.durations) <= pieces


def test_headings_are_kept_within_a_degree_through_whole_turns():
    yaw = np.angle(np.exp(1j * PLAN.yaw(T)))
    fit = minsnap.fit_samples(T, FRAMES, 0.01, yaw=yaw)
    curve = fit.trajectory
    turned = np.angle(np.exp(1j * (curve.yaw(np.minimum(T, curve.duration)) - yaw)))
    assert np.abs(turned).max() <= fit.turned + 1e-12 <= np.radians(1.0) + 1e-12
    still = minsnap.fit_samples(T, FRAMES, 0.01, yaw=np.full(len(T), 0.5))
    assert still.trajectory.yaw(3.0) == pytest.approx(0.5)


def test_it_does_not_swing_between_samples_to_rest_where_they_move():
    """Tiny pieces at the ends met every sample, and left the circle by 83 mm between them."""
    t = np.linspace(0.0, 3.0, 80)
    circle = np.column_stack([np.cos(5 * t), np.sin(5 * t), t])
    with pytest.raises(UnprovedError, match=r"do not rest at both ends; leave these free, rest=False \(--ends free\)"):
        minsnap.fit_samples(t, circle, 1e-4, most_pieces=10)
    fit = minsnap.fit_samples(t, circle, 1e-4, rest=False)
    at = np.linspace(0.0, 3.0, 5001)
    exact = np.column_stack([np.cos(5 * at), np.sin(5 * at), at])
    assert np.linalg.norm(fit.trajectory(np.minimum(at, fit.trajectory.duration)) - exact, axis=1).max() < 3e-4


def test_too_few_pieces_are_refused_with_what_they_reach():
    rng = np.random.default_rng(5)
    with pytest.raises(
        UnprovedError, match=r"31 pieces come within .* mm of the samples, not within 5 mm, farthest at"
    ):
        minsnap.fit_samples(T, FRAMES + rng.normal(0.0, 0.02, FRAMES.shape), 0.005, most_pieces=31)


def test_uneven_instants_plane_paths_and_two_samples():
    t = np.sort(np.random.default_rng(2).uniform(0.0, 12.0, 300))
    fit = minsnap.fit_samples(t + 1e6, PLAN(t)[:, :2], 0.01)
    assert fit.trajectory.dim == 2 and fit.trajectory.duration == pytest.approx(t[-1] - t[0], abs=1e-6)
    pair = minsnap.fit_samples([0.0, 2.0], [(0, 0, 0), (3, 0, 0)], 0.01)
    assert pair.at_samples < 1e-5 and len(pair.trajectory.durations) == 1


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"t": [0.0, 1.0, 1.0]}, "instant 2 is 1 s, not after the 1 s before it"),
        ({"t": [0.0, 1.0]}, "one row of coordinates for each instant"),
        ({"t": "no"}, "two or more finite numbers"),
        ({"position": [(0, 0), (1, float("nan")), (2, 0)]}, "position 1 is not finite"),
        ({"position": [1, 2, 3]}, "one row of coordinates"),
        ({"tolerance": 0.0}, "the tolerance"),
        ({"tolerance": "5mm"}, "the tolerance"),
        ({"yaw": [1.0]}, "one finite angle for each instant"),
        ({"rest": 1}, "rest is 1: it is True or False"),
        ({"most_pieces": 0}, "most_pieces is 0"),
    ],
)
def test_what_makes_no_sense_is_one_sentence(changed, said):
    asked = {"t": [0.0, 1.0, 2.0], "position": [(0, 0), (1, 0), (2, 0)], "tolerance": 0.01} | changed
    with pytest.raises(InputError, match=said):
        minsnap.fit_samples(**asked)


def test_the_bound_between_samples_is_that_of_each_part():
    fit = minsnap.fit_samples(T, FRAMES, 0.05)
    curve, t = fit.trajectory, np.minimum(T, fit.trajectory.duration)
    whole = distance_between(curve, t, FRAMES)
    moved = FRAMES.copy()
    moved[100] += (0.0, 0.0, 1.0)
    assert distance_between(curve, t, moved) > 0.9 and whole < 0.06
