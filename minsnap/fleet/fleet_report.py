"""How a fleet was planned."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FleetReport:
    """How a fleet was planned.

    Parameters
    ----------
    method : {"single", "straight", "joint"}
        The plan of the only vehicle, straight lines with one common profile, or all curves together.
    duration : float
        Common flight time [s].
    bound : float
        No fleet with these limits is faster: the trapezoid of speed and acceleration of the slowest vehicle [s].
    slowest : int
        Which vehicle that is.
    alone : float
        The shortest time known for the slowest vehicle alone, with as many polynomials [s].
    pieces : int
        Polynomials per vehicle.
    tried : int
        How many times were tried.
    iterations : int
        Gauss-Newton steps in all.
    seconds : float
        Processor time [s].
    stopped : str
        Why the search ended early, such as ``"time_limit"``; empty if it ended by itself.
    """

    method: str
    duration: float
    bound: float
    slowest: int
    alone: float
    pieces: int
    tried: int
    iterations: int
    seconds: float
    stopped: str = ""
