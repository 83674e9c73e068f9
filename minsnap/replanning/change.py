"""What a replan answers."""

from __future__ import annotations

from dataclasses import dataclass

from minsnap.trajectory.trajectory import Trajectory


@dataclass(frozen=True, eq=False)
class Change:
    """A change of the plan that is being flown.

    Parameters
    ----------
    trajectory : Trajectory
        What to fly from the splice on; its time 0 is the splice.
    splice : float
        Instant at which it takes over, on the clock of the flown plan [s].
    stop : Trajectory or None
        From the state at the splice to hover, inside the corridor and the limits; its time 0 is the splice.
    kept : bool
        True: the trajectory is the rest of the flown plan.
    certified : bool
        Whether the trajectory is proved to be inside the walls ahead and the limits; false only for a rest that is kept
        because no certified curve was ready in time. Then fly ``stop``. A rest that is kept passes the waypoints where
        they were when it was planned.
    reason : str
        Why the rest was kept; empty where it was not.
    no_stop : str
        Why there is no stop; empty where there is one.
    limits_from : float
        Instant from which the trajectory keeps the limits [s]; 0 but for a state outside of them.
    inside_from : float
        Instant from which it is inside the corridor [s]; 0 but for a state outside of it.
    took : float
        Seconds that the answer took, on the replanner's clock.
    late : float
        Seconds by which it came after it was due; 0 where it came in time. A splice that has passed is not flown: hold
        or fly the stop before, and give a longer budget (``minsnap bench`` says which this machine needs).
    legs : int
        Legs of the flown plan that end before the splice: as many waypoints have been passed.
    """

    trajectory: Trajectory
    splice: float
    stop: Trajectory | None
    kept: bool
    certified: bool = True
    reason: str = ""
    no_stop: str = ""
    limits_from: float = 0.0
    inside_from: float = 0.0
    took: float = 0.0
    late: float = 0.0
    legs: int = 0
