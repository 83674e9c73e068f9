"""Feed-forward in setpoints: drag compensated through the acceleration, response delay through a lead time.

A lead shifts the whole flight: the first setpoint is sent ``lead`` before the instant that it is planned for, so that a
path that begins at rest still does, and nothing of it is left out. Where the vehicle is to be at an instant is where
the setpoint sent ``lead`` before it was; every distance to the plan is measured there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from minsnap.basics.messages import shown
from minsnap.errors import InputError
from minsnap.flight.simulation.reference import drag_feed_forward
from minsnap.trajectory.samples import Samples
from minsnap.vehicle.quadrotor import Quadrotor

LONGEST_LEAD = 1.0
"""A lead beyond this is no delay of a vehicle that flies well [s]."""


@dataclass(frozen=True)
class FeedForward:
    """Drag and lead time to add to the setpoints of a file.

    Parameters
    ----------
    drag : float
        Deceleration by drag for each m/s of speed [1/s]: linear drag divided by mass.
    vehicle : Quadrotor or None
        A vehicle whose own drag is offset instead.
    lead : float
        How much earlier each setpoint is sent, to offset the delay of the vehicle's response [s].

    Raises
    ------
    InputError
        If the drag is negative or not finite, both are set, or the lead is not between 0 and 1 s.
    """

    drag: float = 0.0
    vehicle: Quadrotor | None = None
    lead: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.drag) and self.drag >= 0.0):
            raise InputError(f"the drag is {shown(self.drag)} 1/s: it must be 0 or more")
        if self.drag and self.vehicle is not None:
            raise InputError("a drag and a vehicle exclude each other, since the vehicle has its own drag: give one")
        if not 0.0 <= self.lead <= LONGEST_LEAD:
            raise InputError(f"the lead is {shown(self.lead)} s: it must be between 0 and {LONGEST_LEAD:g} s")

    @property
    def active(self) -> bool:
        """Whether anything is added."""
        return bool(self.drag) or self.vehicle is not None or bool(self.lead)

    def applied(self, samples: Samples) -> Samples:
        """Return the samples as they are sent: as stated, with the feed-forward added to the acceleration."""
        return self.stated(samples).commanded()

    def stated(self, samples: Samples) -> Samples:
        """Return the samples with what offsets drag stated as their feed-forward, and the lead stated as theirs.

        Parameters
        ----------
        samples : Samples
            Of three coordinates.

        Raises
        ------
        InputError
            If drag is to be offset and the samples have no velocity, or state their feed-forward or lead already.
        """
        if self.lead and samples.lead:
            raise InputError(f"the file states its lead already ({samples.lead:g} s): leave the lead out")
        return replace(self._compensated(samples), lead=samples.lead + self.lead) if self.active else samples

    def _compensated(self, samples: Samples) -> Samples:
        if not self.drag and self.vehicle is None:
            return samples
        if samples.feed_forward is not None:
            raise InputError("the file states its feed-forward already: leave the drag and the vehicle out")
        if samples.velocity is None:
            raise InputError("the file has no velocity, so its drag is not known")
        extra = self.drag * samples.velocity if self.vehicle is None else drag_feed_forward(self.vehicle, samples)
        return replace(samples, feed_forward=np.asarray(extra))

    def describe(self, samples: Samples) -> str:
        """Return a text that says what is added to samples."""
        parts = []
        feed_forward = self._compensated(samples).feed_forward
        if feed_forward is not None:
            most = float(np.linalg.norm(feed_forward, axis=1).max())
            parts.append(f"drag offset by up to {most:.2f} m/s²")
        if self.lead or samples.lead:
            parts.append(f"setpoints sent {1e3 * (self.lead or samples.lead):g} ms ahead")
        return " and ".join(parts)
