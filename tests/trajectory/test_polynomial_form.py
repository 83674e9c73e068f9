"""Shapes as polynomials: never farther than promised, and not much closer than promised either."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial

import minsnap
from minsnap.errors import InputError, ShapeError
from minsnap.trajectory.phase import _majorant, _spinning, _steady
from minsnap.trajectory.velocity_heading import VelocityHeading

SIZES = st.floats(0.05, 40.0)


@st.composite
def shapes(draw):
    law = {"period": draw(st.floats(0.5, 30.0)), "laps": draw(st.floats(0.2, 4.0))}
    law |= {
        "ramp": draw(st.just(0.0) | st.floats(1e-6, 1.0)) * np.pi * law["laps"],
        "center": draw(st.tuples(SIZES, SIZES)),
    }
    law["clockwise"] = draw(st.booleans())
    make = draw(st.sampled_from(["circle", "helix", "lemniscate"]))
    if make == "circle":
        return minsnap.circle(draw(SIZES), start_angle=draw(SIZES), **law)
    if make == "helix":
        return minsnap.helix(draw(SIZES), draw(st.floats(-3.0, 3.0)), **law)
    return minsnap.lemniscate(draw(SIZES), draw(SIZES), **law)


def farthest(path, curve, order=0, instants=3001):
    t = np.linspace(0.0, min(path.duration, curve.duration), instants)
    return np.linalg.norm(curve(t, order) - path(t, order), axis=1).max()


@pytest.mark.slow
@settings(deadline=None, max_examples=60)
@given(shapes(), st.sampled_from([1e-2, 1e-4, 1e-6, 1e-8]))
def test_no_instant_is_farther_than_the_error(path, error):
    curve = minsnap.as_polynomials(path, error)
    assert farthest(path, curve) <= error
    assert curve.duration == pytest.approx(path.duration, rel=1e-13)
    half = curve.durations.min() / 2.0
    for order, factor in ((1, 112.0), (2, 3360.0), (3, 26880.0)):
        rounding = 1e-11 * np.abs(path(np.linspace(0, path.duration, 99), order)).max()
        assert farthest(path, curve, order) <= factor * error / half**order + rounding, order


@pytest.mark.parametrize("make", [minsnap.circle, minsnap.helix, minsnap.lemniscate])
@pytest.mark.parametrize("error", [1e-3, 1e-6, 1e-9])
def test_pieces_are_not_wasted(make, error):
    """Three quarters of the pieces give ten times the error, so an error near the bound wastes few."""
    assert farthest(make(), minsnap.as_polynomials(make(), error), instants=30_001) > 0.02 * error


@pytest.mark.parametrize("pieces", [1, 3, 8])
@pytest.mark.parametrize("multiple", [1, 2])
def test_the_bound_of_the_eighth_derivative_holds(pieces, multiple):
    """Against the series of the exponential, multiplied out about instants of every piece."""
    law = minsnap.circle(period=5.0, ramp=3.0).law
    half, angle = 0.5 / pieces, 2.0 * law.ramp
    covered = Polynomial([0, 0, 0, 0, 0, 7, -14, 10, -2.5]) * angle
    for piece, bound in enumerate(_majorant(multiple * _spinning(law, pieces))):
        middles = 2 * half * (piece + np.array([0.02, 0.3, 0.5, 0.7, 0.98]))
        largest = max(abs(eighth_term(multiple * covered(Polynomial([middle, half])))) for middle in middles)
        assert 0.0 < largest <= bound


def eighth_term(phase):
    """Coefficient of x^8 in exp(i phase(x)): the sum of powers of the phase over factorials, cut after x^8."""
    steps = 1j * (phase - phase(0.0))
    power, series = Polynomial([1.0 + 0j]), 0.0
    for n in range(1, 9):
        power = (power * steps / n).cutdeg(8)
        series += power.coef[8] if len(power.coef) > 8 else 0.0
    return series


def test_the_bound_at_full_rate_is_the_derivative():
    law = minsnap.circle(period=5.0).law
    half = (law.angle - 2 * law.ramp) / 3 / 2
    assert _majorant(_steady(law, 3))[0] == pytest.approx(half**8 / 40320, rel=1e-10)


def test_knots_have_the_state_of_the_shape():
    path = minsnap.helix(laps=2.0, center=(3.0, -1.0))
    curve = minsnap.as_polynomials(path, 1e-4)
    for order in range(4):
        np.testing.assert_allclose(
            curve(curve.breaks, order), path(np.minimum(curve.breaks, path.duration), order), atol=1e-9
        )
    assert minsnap.certify(curve).continuity >= 3


def test_headings_follow_the_same_rule():
    for yaw in ("velocity", "tilt", 0.7):
        path = minsnap.circle(yaw=yaw)
        curve = minsnap.as_polynomials(path)
        t = np.linspace(0.0, curve.duration, 500)
        np.testing.assert_allclose(curve.yaw(t), path.yaw(t), atol=1e-4)
    assert minsnap.as_polynomials(minsnap.circle(yaw="velocity")).yaw.path.degree == 7
    assert isinstance(minsnap.as_polynomials(minsnap.circle(yaw="velocity")).yaw, VelocityHeading)


def test_a_trajectory_is_returned_as_it_is():
    line = minsnap.line(total_time=6.0)
    assert minsnap.as_polynomials(line) is line


def test_what_cannot_be_promised_is_refused():
    class Own(minsnap.Path):
        duration, dim = 1.0, 3

        def _evaluate(self, t, order):
            return np.zeros((len(t), 3))

    with pytest.raises(InputError, match="no polynomials of a proved error are known for a Own"):
        minsnap.as_polynomials(Own())
    for error in (0.0, -1.0, np.nan, "small"):
        with pytest.raises(InputError, match="must be a positive number \\[m\\]"):
            minsnap.as_polynomials(minsnap.circle(), error)
    with pytest.raises(ShapeError, match="not more than rounding"):
        minsnap.as_polynomials(minsnap.circle(), 1e-15)
    with pytest.raises(ShapeError, match="a spin-up of .* give ramp=0 or a longer one"):
        minsnap.as_polynomials(minsnap.circle(ramp=1e-30))
    with pytest.raises(ShapeError, match="more than 100000 polynomials"):
        minsnap.as_polynomials(minsnap.circle(laps=100_000.0), 1e-4)


def test_a_path_of_ones_own_may_set_its_yaw():
    class Own(minsnap.Path):
        duration, dim = 1.0, 3

        def __init__(self, yaw):
            self.yaw = yaw

        def _evaluate(self, t, order):
            return np.zeros((len(t), 3))

    assert Own(minsnap.circle(yaw=0.5).yaw).sample(2.0).yaw == pytest.approx([0.5, 0.5, 0.5])
