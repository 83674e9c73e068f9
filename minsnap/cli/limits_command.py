"""The command that makes limits of a path from an autopilot's own parameters."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Annotated

from minsnap.cli import options
from minsnap.cli.command import command
from minsnap.cli.options import vehicle_of
from minsnap.cli.summary import as_json


@command()
def limits(
    *,
    connect: options.Connect,
    drag: Annotated[float, "K", "Drag over mass of the vehicle [1/s]."] = 0.0,
    vehicle: options.OffsetVehicle = None,
    output: Annotated[Path | None, "--output", "-o", "FILE", "YAML to add waypoints to, for plan."] = None,
    autopilot: Annotated[str, "auto, px4 or ardupilot."] = "auto",
    wait: Annotated[float, "S", "For the vehicle's heartbeat."] = 30.0,
    json: options.Json = False,
) -> None:
    """Read what a vehicle can follow from its own parameters, and print it as limits of a plan.

    A tenth of everything is left to the controller, and what drag takes of the tilt (--vehicle as fit writes it, or
    --drag) is taken off the acceleration and the speed.
    """
    from minsnap.flight.mavlink.link import Clock, open_link
    from minsnap.flight.mavlink.parameters import PARAMETERS, Parameters, autopilot_limits
    from minsnap.flight.mavlink.vehicle_messages import get_autopilot

    lean, clock = drag if vehicle is None else _drag_of(vehicle), Clock()
    with closing(open_link(connect, clock)) as link:
        stack = get_autopilot(autopilot, link.wait_for_vehicle(wait)).name
        parameters = Parameters(link, clock).read(PARAMETERS.get(stack, ()))
    values = autopilot_limits(stack, {name: each.value for name, each in parameters.items()}, lean).given()
    text = "limits:\n" + "".join(f"  {name}: {value:g}\n" for name, value in values.items())
    if output is not None:
        from minsnap.basics.storage.atomic import atomic_write

        with atomic_write(output) as file:
            file.write(text)
    print(as_json(values) if json else text.rstrip())


def _drag_of(name: str) -> float:
    """Return the greatest level drag of a vehicle over its mass, at 1 m/s [1/s]."""
    import numpy as np

    craft = vehicle_of(name)
    force = craft.drag.force(np.eye(3)[:2])
    return float(np.abs(force).max()) / craft.mass
