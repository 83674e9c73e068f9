"""Flights that an autopilot begins with a take-off of its own, and when they join their file."""

from __future__ import annotations

import numpy as np

from minsnap.flight.mavlink.setpoints import ALLOWED
from minsnap.flight.mavlink.stream_options import STREAM
from minsnap.trajectory import Samples


def joins_at(reference: Samples) -> float:
    """Return when a flight joins its file that the autopilot began with its own take-off [s]; 0 where it has none.

    As ``stream`` lets ArduCopter take off: to half a metre, or half of the climb, and on the file from twice that on.

    Parameters
    ----------
    reference : Samples
        In z-up axes.
    """
    if reference.dim < 3:
        return 0.0
    risen = reference.position - reference.position[0]
    aside = np.linalg.norm(risen[:, :2], axis=1) > ALLOWED.upright
    straight = risen[: int(np.argmax(aside)) if aside.any() else len(risen), 2]
    climb = float(straight.max(initial=0.0))
    if climb < STREAM.least_climb:
        return 0.0
    height = 2.0 * min(STREAM.lift, climb / 2.0)
    return float(reference.t[int(np.argmax(straight >= height * (1.0 - 1e-9)))] - reference.t[0])
