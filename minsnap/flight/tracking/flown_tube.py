"""A flight beside the tube of its control loop: whether it stayed in it, and how much of it it filled."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, OwnsArrays
from minsnap.files.formats import through
from minsnap.flight.tracking.comparison import position_at
from minsnap.flight.tracking.log_comparison import ComparedFlight
from minsnap.vehicle import Loop
from minsnap.vehicle_tube import VehicleTube, check_tracking, vehicle_tube


@dataclass(frozen=True, eq=False)
class FlownTube(OwnsArrays):
    """A flight and the tube of its loop.

    Parameters
    ----------
    tube : VehicleTube
        Of the setpoints that were flown, with the wind that was asked for.
    t : ndarray, shape (m,)
        Instants of the comparison, from the start of the plan [s].
    expected : ndarray, shape (m, dim)
        Where the loop flies without wind [m].
    away : ndarray, shape (m,)
        Distance of the vehicle from there [m].
    error : float
        Largest distance from the plan at the same instant [m].
    """

    tube: VehicleTube
    t: FloatArray
    expected: FloatArray
    away: FloatArray
    error: float

    @property
    def reach(self) -> float:
        """How far from the expected place the vehicle may be [m]."""
        return self.tube.widths.error + self.tube.flight.position_error

    @property
    def inside(self) -> bool:
        """Whether the vehicle stayed in the tube at all instants of the comparison."""
        return not self.tube.saturated and bool(self.away.max() <= self.reach)

    @property
    def sentence(self) -> str:
        """The result in words."""
        worst = float(self.away.max())
        if self.tube.saturated:
            return f"its loop saturates ({', '.join(self.tube.saturated)}): there is no tube to hold it against"
        where = f"{worst:.3f} m from where its loop flies in still air, at {self.t[self.away.argmax()]:.2f} s"
        allowed = f"the tube allows {self.reach:.3f} m in a wind that changes by {self.tube.wind:g} m/s"
        verdict = "it stayed in its tube" if self.inside else "it left its tube"
        return f"{verdict}: at most {where}, and {allowed}; {self.error:.3f} m of {self.tube.error:.3f} m from the plan"

    def as_dict(self) -> dict[str, Any]:
        """Return the figures as plain numbers, for JSON."""
        known = {"inside": self.inside, "away": float(self.away.max()), "reach": self.reach}
        return known | {"error": self.error, "tube": self.tube.error, "wind": self.tube.wind}


def hold_in_tube(one: ComparedFlight, loop: Loop, wind: float) -> FlownTube:
    """Hold a compared flight against the tube of a loop.

    Parameters
    ----------
    one : ComparedFlight
        Its reference, with velocities and accelerations where the file has them, is taken as the curve through its
        samples; how much earlier it was sent is the lead of the loop.
    loop : Loop
    wind : float
        Largest change of the wind [m/s].

    Raises
    ------
    VehicleError
        If the wind is malformed, or the reference is neither in the plane nor in space.
    """
    wanted, lead = one.reference, one.reference.lead if one.place is None else one.place.lead
    own = replace(loop, lead=lead) if lead else loop
    tube = vehicle_tube(own, check_tracking(own, wind), through(wanted))
    t = one.comparison.t - wanted.t[0]
    expected = tube.flight.at(t)
    flown = position_at(wanted, one.comparison.t) + one.comparison.error
    error = float(np.linalg.norm(one.comparison.error, axis=1).max())
    return FlownTube(tube, t, expected, np.linalg.norm(flown - expected, axis=1), error)
