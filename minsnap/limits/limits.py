r"""Limits of a vehicle on the derivatives of its path, kept at every instant.

With gravity g up against :math:`e_3`, :math:`f = \ddot r + g e_3` is the thrust per mass (D. Mellinger and V. Kumar,
ICRA 2011): its norm over g is the thrust-to-weight ratio, its angle to the vertical the tilt, and
:math:`\|\dddot r \times f\| / \|f\|^2` the rate at which the thrust direction turns, the roll and pitch body rate.
All are polynomials or quotients of polynomials on every piece, so all maxima are exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from minsnap.arrays import GRAVITY, FloatArray
from minsnap.corridors.constraint import Balls, Faces, Walls
from minsnap.errors import LimitError
from minsnap.limits.utilisation import measure_all
from minsnap.trajectory.report import Utilisation
from minsnap.trajectory.trajectory import Trajectory

if TYPE_CHECKING:
    from minsnap.vehicle import Quadrotor

UPWARD = 0.999
"""Share of gravity by which a path with a limit on tilt may accelerate downwards: its thrust points up."""

ORDERS = {"speed": 1, "acceleration": 2, "jerk": 3, "snap": 4}
"""Limits on a norm, by the order of the derivative."""


@dataclass(frozen=True)
class Limits:
    """What a path must not exceed at any instant; None where there is no limit.

    Parameters
    ----------
    speed, acceleration, jerk, snap : float, optional
        Of the whole vector, in the norm chosen [m/s], [m/s^2], [m/s^3], [m/s^4].
    norm : {"euclidean", "axis"}
        Whether these four hold for the Euclidean norm or for each world axis.
    horizontal_speed, horizontal_acceleration : float, optional
        Euclidean, over x and y.
    climb_speed, descent_speed : float, optional
        Upwards and downwards, both positive [m/s].
    vertical_speed, vertical_acceleration : float, optional
        Both ways.
    max_thrust, min_thrust : float, optional
        Thrust-to-weight ratio; above and below 1.
    tilt : float, optional
        Largest angle between thrust and the vertical [rad], below pi/2.
    body_rate : float, optional
        Roll and pitch rate together [rad/s].
    yaw_rate : float, optional
        [rad/s].
    gravity : float
        [m/s^2].

    Raises
    ------
    LimitError
        If a limit is not a positive number, or cannot hold altitude.
    """

    speed: float | None = None
    acceleration: float | None = None
    jerk: float | None = None
    snap: float | None = None
    norm: Literal["euclidean", "axis"] = "euclidean"
    horizontal_speed: float | None = None
    horizontal_acceleration: float | None = None
    climb_speed: float | None = None
    descent_speed: float | None = None
    vertical_speed: float | None = None
    vertical_acceleration: float | None = None
    max_thrust: float | None = None
    min_thrust: float | None = None
    tilt: float | None = None
    body_rate: float | None = None
    yaw_rate: float | None = None
    gravity: float = GRAVITY

    def __post_init__(self) -> None:
        if self.norm not in ("euclidean", "axis"):
            raise LimitError(f"the norm of the limits is {self.norm!r}: use 'euclidean' or 'axis'")
        for name, value in self.given().items():
            _check(name, value)
        _check("gravity", self.gravity)
        self._check_hover()

    def _check_hover(self) -> None:
        if self.max_thrust is not None and self.max_thrust <= 1.0:
            raise LimitError(
                f"max_thrust is {self.max_thrust}, below hover: the thrust-to-weight ratio must exceed 1",
                smallest=1.0,
            )
        if self.min_thrust is not None and self.min_thrust >= 1.0:
            raise LimitError(f"min_thrust is {self.min_thrust}, above hover: it must be below 1", largest=1.0)
        if self.tilt is not None and self.tilt >= np.pi / 2.0:
            raise LimitError(
                f"tilt is {self.tilt} rad: no thrust holds altitude unless it is below pi/2 = {np.pi / 2.0:.4f} rad",
                largest=np.pi / 2.0,
            )

    @classmethod
    def of(cls, vehicle: Quadrotor, reserve: float = 0.1, **others: Any) -> Limits:
        """Return what a vehicle's rotors allow, beside other limits.

        Total thrust becomes a limit of its own, and each rotor's thrust is kept within its limits, torques included and
        drag left out, with bounds that interval arithmetic proves over all time.

        Parameters
        ----------
        vehicle : Quadrotor
        reserve : float
            Share of the rotors' room above and below hover that is left to feedback, in [0, 1).
        **others
            Further limits, such as ``speed=3.0`` or the ``body_rate`` that its controller can follow.

        Raises
        ------
        LimitError
            If the vehicle cannot hover, the reserve is out of its range, or another limit is malformed.
        """
        from minsnap.limits.vehicle_limits import limits_of

        return limits_of(vehicle, reserve, **others)

    def given(self) -> dict[str, float]:
        """Return the limits that are set, by name."""
        names = [entry.name for entry in fields(self) if entry.name not in ("norm", "gravity")]
        return {name: getattr(self, name) for name in names if getattr(self, name) is not None}

    def utilisation(self, traj: Trajectory) -> tuple[Utilisation, ...]:
        """Say how far each limit is used, exactly, over all time; 1 is fully used.

        Raises
        ------
        LimitError
            If a vertical or vehicle limit is set and the trajectory has no vertical coordinate.
        """
        self._check_dim(traj.dim)
        return measure_all(self, traj)

    def _check_dim(self, dim: int) -> None:
        spatial = [name for name in self.given() if name not in ORDERS and name != "yaw_rate"]
        if spatial and dim != 3:
            raise LimitError(f"{spatial[0]} needs three coordinates, z up; the path has {dim}")

    def walls(self, waypoints: FloatArray) -> Sequence[Walls]:
        """Return the convex limits as sets that derivatives must stay in on every leg.

        A minimum thrust enters as the vertical part of it, which is sufficient; body and yaw rate are not convex and
        are kept by the time scale.
        """
        legs, dim = len(waypoints) - 1, waypoints.shape[1]
        self._check_dim(dim)
        build = _WallBuilder(legs, dim)
        for name, order in ORDERS.items():
            build.norm(order, getattr(self, name), self.norm, name)
        for name, order in (("horizontal_speed", 1), ("horizontal_acceleration", 2)):
            build.ball(order, getattr(self, name), np.eye(2, 3), name)
        climb = _least(self.climb_speed, self.vertical_speed)
        build.vertical(1, -_least(self.descent_speed, self.vertical_speed), climb, self._vertical_name())
        vertical = _least(self.vertical_acceleration)
        build.vertical(2, -vertical, vertical, "vertical_acceleration")
        self._thrust_walls(build)
        return build.walls

    def _vertical_name(self) -> str:
        names = ("climb_speed", "descent_speed", "vertical_speed")
        return " and ".join(name for name in names if getattr(self, name) is not None)

    def _thrust_walls(self, build: _WallBuilder) -> None:
        hover = self.gravity
        if self.max_thrust is not None:
            build.ball(2, self.max_thrust * hover, np.eye(3), "max_thrust", anchor=(0.0, 0.0, -hover))
        if self.min_thrust is not None:
            build.vertical(2, (self.min_thrust - 1.0) * hover, np.inf, "min_thrust")
        if self.tilt is not None:
            slope = np.tan(self.tilt)
            build.vertical(2, -UPWARD * hover, np.inf, "tilt")
            build.ball(2, slope * hover, np.eye(2, 3), "tilt", slope=(0.0, 0.0, slope))


class _WallBuilder:
    """The same sets on every leg, collected."""

    def __init__(self, legs: int, dim: int) -> None:
        self.legs, self.dim = legs, dim
        self.walls: list[Walls] = []

    def norm(self, order: int, limit: float | None, norm: str, name: str) -> None:
        if limit is not None and norm == "euclidean":
            self.ball(order, limit, np.eye(self.dim), name)
        elif limit is not None:
            for axis in np.eye(self.dim):
                self._faces(order, axis, -limit, limit, name)

    def ball(
        self, order: int, radius: float | None, matrix: FloatArray, name: str, anchor: Any = None, slope: Any = None
    ) -> None:
        if radius is None:
            return
        spread = (self.legs, *matrix.shape)
        centre = np.zeros(self.dim) if anchor is None else np.array(anchor)
        tilt = None if slope is None else np.broadcast_to(np.array(slope), (self.legs, self.dim))
        points = np.broadcast_to(centre, (self.legs, self.dim))
        radii = np.full(self.legs, radius)
        self.walls.append(
            Balls(np.arange(self.legs), np.broadcast_to(matrix, spread), points, radii, order, name, tilt)
        )

    def vertical(self, order: int, lower: float, upper: float, name: str) -> None:
        if np.isfinite(lower) or np.isfinite(upper):
            self._faces(order, np.eye(self.dim)[-1], lower, upper, name)

    def _faces(self, order: int, normal: FloatArray, lower: float, upper: float, name: str) -> None:
        legs = self.legs
        width = min(abs(bound) for bound in (lower, upper) if np.isfinite(bound))
        zeros = np.zeros((legs, self.dim))
        bounds = (np.full(legs, lower), np.full(legs, upper), np.full(legs, width))
        self.walls.append(Faces(np.arange(legs), np.broadcast_to(normal, zeros.shape), zeros, *bounds, order, name))


def _least(*limits: float | None) -> float:
    return min((limit for limit in limits if limit is not None), default=np.inf)


def _check(name: str, value: Any) -> None:
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)):
        raise LimitError(f"the limit {name} is {value!r}: it must be a number")
    if not (np.isfinite(value) and value > 0.0):
        raise LimitError(f"the limit {name} is {value}: it must be positive and finite")
