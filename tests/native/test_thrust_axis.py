"""Peaks of thrust, tilt and body rate: the native core finds those of the reference."""

import numpy as np
import pytest

import minsnap
from minsnap.limits import measures
from minsnap.limits.limits import Limits
from minsnap.native.library import using
from minsnap.native.thrust_axis import thrust_peaks
from minsnap.trajectory.trajectory import Trajectory

LIMITS = Limits(max_thrust=1.5, min_thrust=0.5, tilt=0.5, body_rate=2.0)
MEASURES = ("thrust", "least_thrust", "tilt", "body_rate")


@pytest.mark.parametrize("degree", [3, 5, 7, 9, 11])
@pytest.mark.parametrize("slower", [0.4, 1.0, 5.0])
def test_native_peaks_are_those_of_the_reference(degree, slower):
    points = np.random.default_rng(degree).normal(size=(6, 3))
    path = minsnap.plan(points, durations=slower * np.array([1.0, 0.7, 1.3, 1.0, 2.0]), degree=degree)
    native = LIMITS.utilisation(path)
    with using("python"):
        expected = LIMITS.utilisation(path.stretched(1.0))
    for ours, theirs in zip(native, expected, strict=True):
        assert ours.value == pytest.approx(theirs.value, rel=1e-11), ours.name


@pytest.mark.parametrize(("fall", "known"), [(0.0, set(MEASURES)), (9.80665, set()), (20.0, set())])
def test_a_thrust_without_direction_is_left_to_the_reference(fall, known):
    """In free fall, or upside down, no quotient of polynomials says how the thrust is tilted, nor how it turns."""
    parabola = np.zeros((1, 3, 3))
    parabola[0, 2, 2] = -0.5 * fall
    assert set(thrust_peaks(parabola, np.ones(1), 9.80665, MEASURES)) == known


@pytest.mark.parametrize("core", ["native", "python"])
@pytest.mark.parametrize("seed", [2, 11, 21, 30, 58])
def test_the_peak_of_a_path_is_that_of_one_of_its_pieces(seed, core):
    """However much faster the others are: rounding of large accelerations hides no small one."""
    draw = np.random.default_rng(seed)
    points = draw.normal(size=(12, 6, 3)) * 10.0 ** draw.uniform(-1.0, 7.0, (12, 1, 1))
    limits = Limits(body_rate=2.0)
    with using(core):
        (whole,) = limits.utilisation(Trajectory(points, np.ones(12)))
        alone = [limits.utilisation(Trajectory(piece[None], np.ones(1)))[0].value for piece in points]
    assert whole.value == pytest.approx(max(alone), rel=1e-8)


@pytest.mark.parametrize("least", [1e-3, 1e-5, 1e-7])
def test_a_thrust_that_nearly_vanishes_for_an_instant_turns_and_tilts_as_it_does(least):
    """Over weight (least, 0, 2 s - 1), and (3 least, 0, (2 s - 1)^2 + least): rounding elsewhere hides neither."""
    turning, tilting = np.zeros((1, 4, 3)), np.zeros((1, 5, 3))
    turning[0, :, 0], turning[0, :, 2] = least * np.array([0, 0, 1, 3]) / 6, np.array([0, 0, -2, -4]) / 6
    tilting[0, :, 0], tilting[0, :, 2] = least * np.array([0, 0, 1, 3, 6]) / 4, np.array([0, 0, 0, -2, -4]) / 12
    tilting[0, :, 2] += least * np.array([0, 0, 1, 3, 6]) / 12
    native = thrust_peaks(turning, np.ones(1), 1.0, ["body_rate"])["body_rate"]
    motion = measures.exact_motion(Trajectory(turning, np.ones(1)), "euclidean", 1.0)
    reference = measures.MEASURES["body_rate"].largest(motion, 0)
    for value, _, s in (native, reference):
        assert (value, s) == (pytest.approx(2.0 / least, rel=1e-8), pytest.approx(0.5, abs=least))
    value, _, s = thrust_peaks(tilting, np.ones(1), 1.0, ["tilt"])["tilt"]
    assert np.tan(value) == pytest.approx(3.0, rel=1e-6)
