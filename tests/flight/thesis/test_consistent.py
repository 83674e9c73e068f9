"""The consistent drag: the numbers of the F330 are those that the published surfaces give."""

import numpy as np

from minsnap.flight.thesis import consistent_parasitic_drag, consistent_rotor_drag
from minsnap.vehicle import Quadrotor


def test_the_numbers_of_the_preset_are_those_of_the_fit():
    preset, derived = Quadrotor.dji_f330().drag, consistent_parasitic_drag() + consistent_rotor_drag()
    np.testing.assert_allclose(preset.linear, derived.linear, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(preset.quadratic, derived.quadratic, rtol=1e-9, atol=1e-12)


def test_the_f330_has_the_drag_of_its_airframe_and_of_its_rotors():
    air = np.random.default_rng(0).normal(size=(9, 3))
    whole = consistent_parasitic_drag() + consistent_rotor_drag()
    np.testing.assert_allclose(Quadrotor.dji_f330().drag.force(air), whole.force(air), rtol=1e-9)
