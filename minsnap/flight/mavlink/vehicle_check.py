"""Check of a vehicle before a flight: its parameters and its state, against what is to be flown."""

from __future__ import annotations

from minsnap.flight.mavlink.autopilot import Autopilot
from minsnap.flight.mavlink.link import Link
from minsnap.flight.mavlink.parameters import Parameters
from minsnap.flight.mavlink.preflight import Finding, FlightNeeds, check_parameters, flight_needs, rule_parameters
from minsnap.flight.mavlink.schedule import Clock
from minsnap.flight.mavlink.vehicle_watch import VehicleWatch
from minsnap.trajectory.samples import Samples


def check_vehicle(
    link: Link, clock: Clock, autopilot: Autopilot, samples: Samples | None = None, frame: str = "ned"
) -> list[Finding]:
    """Read parameters and listen for three seconds; return one finding for each rule and each part of the state.

    Parameters
    ----------
    link : Link
        With a vehicle that has been heard.
    clock : Clock
        The same as the link's.
    autopilot : Autopilot
        Whose rules apply.
    samples : Samples, optional
        What is to be flown, in z-up world axes, with the feed-forward that is to be sent.
    frame : str
        The vehicle's local frame: ``ned`` or ``frd``.
    """
    watch = VehicleWatch(link, clock, frame)
    needs = FlightNeeds() if samples is None else flight_needs(samples)
    parameters = Parameters(link, clock, watch.take).read(rule_parameters(autopilot.name))
    watch.listen()
    return [*check_parameters(autopilot.name, parameters, needs), *watch.findings(autopilot, samples)]
