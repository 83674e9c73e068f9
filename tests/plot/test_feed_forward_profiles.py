"""Profiles of setpoints that state their feed-forward."""

import numpy as np

import minsnap
from minsnap.flight.mavlink.setpoints import FeedForward


def test_the_commanded_acceleration_is_drawn_beside_that_of_the_motion():
    plain = minsnap.circle().sample(20.0)
    stated = FeedForward(drag=0.5).stated(plain)
    (axes,) = minsnap.plot.plot_profiles(stated, orders=(2,))
    assert len(axes.lines) == 6
    np.testing.assert_array_equal(axes.lines[3].get_ydata(), plain.acceleration[:, 0] + 0.5 * plain.velocity[:, 0])
    (axes,) = minsnap.plot.plot_profiles(plain, orders=(2,))
    assert len(axes.lines) == 3
