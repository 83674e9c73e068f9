"""The drag of a vehicle that its limits include: that of its body, with which motion is differentially flat."""

from __future__ import annotations

from typing import TYPE_CHECKING

from minsnap.trajectory.medium import Medium

if TYPE_CHECKING:
    from minsnap.vehicle import BodyDrag, Quadrotor


def flat_drag(vehicle: Quadrotor) -> BodyDrag:
    """Return a vehicle's drag if it is a BodyDrag, and none in place of any other model."""
    from minsnap.vehicle.drag import BodyDrag

    return vehicle.drag if isinstance(vehicle.drag, BodyDrag) else BodyDrag()


def lateral_alike(vehicle: Quadrotor) -> bool:
    """Whether the drag is the same along both lateral axes, so that the thrust axis does not depend on the yaw."""
    drag = flat_drag(vehicle)
    return bool(drag.linear[0] == drag.linear[1] and drag.quadratic[0] == drag.quadratic[1])


def medium_of(vehicle: Quadrotor) -> Medium:
    """Return gravity and drag per mass; lateral drag that is not the same along both axes is replaced by its mean."""
    drag = flat_drag(vehicle)
    across, more = [], []
    for values in (drag.linear / vehicle.mass, drag.quadratic / vehicle.mass):
        across.append(0.5 * float(values[0] + values[1]))
        more.append(float(values[2]) - across[-1])
    return Medium(vehicle.gravity, across[0], across[1], more[0], more[1])
