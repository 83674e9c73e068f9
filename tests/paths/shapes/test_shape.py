"""Shapes as plans: certified, joined, and flown within limits."""

import numpy as np
import pytest

import minsnap
from minsnap import Limits
from minsnap.errors import InputError, ShapeError

LIMITS = Limits(speed=2.0, acceleration=1.5)
SHAPES = {
    "circle": lambda **more: minsnap.circle(radius=2.0, **more),
    "helix": lambda **more: minsnap.helix(radius=1.5, pitch=0.5, laps=2, **more),
    "lemniscate": lambda **more: minsnap.lemniscate(4.0, 2.0, **more),
}


@pytest.mark.parametrize("make", SHAPES.values(), ids=SHAPES)
@pytest.mark.parametrize("limits", [LIMITS, Limits(speed=1.0), Limits(tilt=0.3, yaw_rate=2.0)])
def test_a_shape_is_as_fast_as_its_limits_allow(make, limits):
    path = make(limits=limits, yaw="velocity")
    found = minsnap.certify(path, limits=limits)
    assert found.ok and max(used.fraction for used in found.utilisation) == pytest.approx(1.0, abs=1e-6)
    t = np.linspace(0.0, path.duration, 20_001)
    assert np.linalg.norm(path(t, 1), axis=1).max() == pytest.approx(found.max_speed, rel=1e-5)
    free = make()
    assert path(0.3 * path.duration) == pytest.approx(free(0.3 * free.duration), abs=1e-9)


def test_shapes_and_plans_are_joined_in_any_order():
    helix = SHAPES["helix"](limits=LIMITS)
    there = minsnap.plan([(0, 0, 1), helix(0.0)], limits=LIMITS)
    back = minsnap.plan([helix(helix.duration), (0, 0, 1)], limits=LIMITS)
    for whole in (there.then(helix).then(back), there.then(helix.then(back))):
        assert whole.duration == pytest.approx(there.duration + helix.duration + back.duration)
        found = minsnap.certify(whole, limits=LIMITS)
        assert found.ok and found.continuity >= 3
        t = there.duration + np.linspace(0.0, helix.duration, 500)
        assert whole(t) == pytest.approx(helix(np.minimum(t - there.duration, helix.duration)), abs=2e-6)


def test_a_pace_is_said_once():
    with pytest.raises(ShapeError, match="give no period and no speed"):
        minsnap.circle(limits=LIMITS, period=4.0)


def test_a_path_without_polynomials_says_so():
    class Sine(minsnap.Path):
        duration, dim = 1.0, 1

        def _evaluate(self, t, order):
            return np.sin(t + order * np.pi / 2.0)[:, None]

    for ask in (Sine().as_trajectory, lambda: minsnap.certify(Sine()), lambda: Sine().then(Sine())):
        with pytest.raises(InputError, match="no polynomials are known for a Sine"):
            ask()


@pytest.mark.parametrize("laps", [1.0, 2.3, 4.1, 9.7, 2.169])
def test_a_ramp_of_half_of_the_way_in_degrees_is_taken(laps):
    whole = minsnap.circle(laps=laps, ramp=np.radians(180.0 * laps))
    assert whole.law.spin_time == pytest.approx(whole.duration / 2)
    with pytest.raises(ShapeError, match="half of the way round"):
        minsnap.circle(laps=laps, ramp=np.radians(180.0 * laps) * (1.0 + 1e-14))
