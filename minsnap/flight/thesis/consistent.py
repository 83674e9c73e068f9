"""Physically consistent drag of the F330's airframe and rotors, fitted to the published surfaces."""

from __future__ import annotations

from functools import cache

import numpy as np

from minsnap.flight.thesis.drag_fits import fit_consistent_drag
from minsnap.flight.thesis.published import PUBLISHED_PARASITIC, PUBLISHED_PROPELLER
from minsnap.vehicle.drag import BodyDrag, linear_rotor_drag

_PITCHES, _VELOCITIES = 41, 43
"""Grid of the refit: whole degrees and half metres per second."""


def consistent_parasitic_drag() -> BodyDrag:
    """Return the airframe's drag: odd in velocity, zero at rest, opposing motion.

    A body at pitch ``p`` in a wind of speed ``v`` meets it along x with ``v cos p`` and along z with ``v sin p``; the
    drag of :class:`BodyDrag` along the wind is then linear in its four coefficients. They are the non-negative least
    squares fit to the published surface on its whole measured range, 7 to 28 m/s and -20 to 20 degrees; along y the
    coefficients of x are used, as in the source.

    Returns
    -------
    BodyDrag
    """
    return _refit()[0]


def consistent_r_squared() -> float:
    """Return R^2 of the consistent model with respect to the published surface over its measured range."""
    return _refit()[1]


def consistent_rotor_drag() -> BodyDrag:
    """Return the linear drag of four rotors: the slope of the published propeller surface in velocity.

    The surface is negative at rest and at flown rotor speeds, where it contains a part of the thrust; its slope in
    velocity, 0.041432 N s/m per propeller at any pitch and rotor speed, is the part that opposes motion. It is
    used along x and y; along z, which the tests do not separate from thrust, there is none, as in Faessler 2018.

    Returns
    -------
    BodyDrag
    """
    slope = float(PUBLISHED_PROPELLER.coefficients[PUBLISHED_PROPELLER.exponents.index((0, 1, 0))])
    return linear_rotor_drag(4.0 * slope, 4.0 * slope)


@cache
def _refit() -> tuple[BodyDrag, float]:
    """Fit the consistent model to the published surface on a grid over its measured range."""
    low, high = PUBLISHED_PARASITIC.measured["pitch_deg"]
    slow, fast = PUBLISHED_PARASITIC.measured["velocity"]
    pitch, speed = np.meshgrid(np.linspace(low, high, _PITCHES), np.linspace(slow, fast, _VELOCITIES))
    drag = PUBLISHED_PARASITIC(pitch_deg=pitch, velocity=speed)
    return fit_consistent_drag({"pitch_deg": pitch, "velocity": speed, "drag": drag})
