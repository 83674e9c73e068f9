"""Limits of a vehicle on derivatives of its path, kept at every instant; ``basics/limit_kinds.py`` is their table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import degrees, pi, radians
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from minsnap.basics.arrays import GRAVITY, FloatArray, numbers, set_fields
from minsnap.basics.cached import cached_property
from minsnap.basics.checks import check_number, check_positive, has_method, is_number
from minsnap.basics.limit_kinds import KIND, KINDS, Kind
from minsnap.basics.messages import explains_names, shown
from minsnap.basics.warn import warn_caller
from minsnap.corridors.constraint import Walls
from minsnap.errors import LimitError, MagnitudeWarning
from minsnap.limits.measures import MEASURES, Extent, Motion
from minsnap.limits.utilisation import at_instant, measured, speed_of_legs
from minsnap.limits.vehicle_use import measure_vehicle, medium_of
from minsnap.trajectory.medium import Medium
from minsnap.trajectory.report import Utilisation
from minsnap.trajectory.trajectory import Trajectory, remembered

if TYPE_CHECKING:
    from minsnap.vehicle import Quadrotor

MOST_LEGS = 10_000_000
"""Legs of a question at most."""


@explains_names({"rates": "body_rate= or yaw_rate=", "thrust": "max_thrust=, a thrust-to-weight ratio"})
@dataclass(frozen=True)
class Limits:
    """Bounds of a path at every instant; None is no limit.

    Parameters
    ----------
    speed, acceleration, jerk, snap : float, optional
        Greatest norms of the derivatives [m/s], [m/s^2], [m/s^3], [m/s^4]. The speed may be a sequence, one of each
        leg; ``speed`` is then the greatest of them.
    norm : {"euclidean", "axis"}
        Whether these four bound the Euclidean norm or each world axis.
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
    leg_speeds : tuple of float
        Of each leg, where speed was a sequence [m/s]. Another speed scales them all.

    Raises
    ------
    LimitError
        If a limit is not a positive number, or cannot hold altitude.
    """

    speed: Any = None
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
    leg_speeds: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.norm, str) or self.norm not in ("euclidean", "axis"):
            raise LimitError(f"the norm of the limits is {shown(self.norm)}: use 'euclidean' or 'axis'")
        self._take_speeds()
        for kind in KINDS:
            value = getattr(self, kind.name, None)
            if value is not None:
                _check_limit(kind, value)
            if isinstance(value, np.generic):  # whose own arithmetic overflows early
                set_fields(self, **{kind.name: float(value)})
        set_fields(self, gravity=check_positive("gravity", self.gravity, "m/s²", LimitError))
        for kind in KINDS if type(self) is Limits else ():
            doubt = "" if (value := getattr(self, kind.name, None)) is None else kind.doubt(value)
            if doubt:
                warn_caller(doubt, MagnitudeWarning)

    def _take_speeds(self) -> None:
        """Keep a speed of each leg, which may be given as the speed, and scale those that were known to another one."""
        speeds, known = self.leg_speeds, self.speed
        listed = None if known is None or is_number(known) or isinstance(known, (str, bytes)) else numbers(known)
        if listed is not None and listed.ndim == 1:
            speeds = tuple(listed.tolist())
            if not speeds:
                raise LimitError("the speed is an empty sequence: give one speed, or one of each leg")
            for speed in speeds:
                _check_limit(KIND["speed"], speed)
            known = max(speeds)
        elif speeds and known is not None and is_number(known) and known != max(speeds):
            speeds = tuple(speed * float(known) / max(speeds) for speed in speeds)
        set_fields(self, speed=known, leg_speeds=() if known is None else speeds)

    def speeds_of(self, legs: int) -> FloatArray:
        """Return the speed of each leg (legs,) [m/s], infinite without one; parts of legs that were divided alike too.

        Raises
        ------
        LimitError
            If that is no number of legs, or as many as do not go with the speeds.
        """
        check_number("the number of legs", legs, 1, MOST_LEGS, f"give 1 to {MOST_LEGS:,}", LimitError, whole=True)
        count = len(self.leg_speeds)
        if not count:
            return np.full(legs, np.inf if self.speed is None else self.speed)
        if legs % count:
            raise LimitError(f"the limits have {count} speeds, one of each leg, and there are {legs} legs")
        return np.repeat(np.array(self.leg_speeds), legs // count)

    def named(self) -> dict[str, Any]:
        """Return the limits that are set, by name, as they were given: the speeds of all legs as a list."""
        return self.given() | ({"speed": list(self.leg_speeds)} if self.leg_speeds else {})

    @classmethod
    def of(cls, vehicle: Quadrotor | str, reserve: float = 0.1, **others: Any) -> Limits:
        """Return the limits of a vehicle's rotors, combined with other limits.

        Total thrust becomes a limit of its own, and each rotor's thrust is kept within its limits, torques and a
        ``BodyDrag`` of the vehicle included (:mod:`minsnap.limits.vehicle_use`), with bounds that interval arithmetic
        proves over all time. Drag of other kinds is left out.

        Parameters
        ----------
        vehicle : Quadrotor or str
            A vehicle, or the name of a preset: ``"crazyflie"``, ``"f330"``, ``"px4-sih"``.
        reserve : float
            Share of the rotors' room above and below hover that is left to feedback, in [0, 1).
        **others
            Further limits, such as ``speed=3.0`` or the ``body_rate`` that its controller can follow.

        Raises
        ------
        LimitError
            If the vehicle cannot hover, the reserve is out of its range, or another limit is malformed.
        """
        if isinstance(vehicle, str):
            from minsnap.vehicle.quadrotor import named_vehicle

            vehicle = named_vehicle(vehicle)
        if not has_method(vehicle, "max_thrust_to_weight"):
            raise LimitError(f"Limits.of takes a Quadrotor, not {type(vehicle).__name__}")
        _check_reserve(reserve)
        ratio = vehicle.max_thrust_to_weight
        if ratio <= 1.0:
            raise LimitError(f"the vehicle's rotors lift {ratio:.3f} of its weight: it cannot hover", smallest=1.0)
        least = 4.0 * vehicle.rotor_thrust_limits[0] / vehicle.weight
        thrusts = {"max_thrust": 1.0 + (1.0 - reserve) * (ratio - 1.0)}
        if least > 0.0:
            thrusts["min_thrust"] = 1.0 - (1.0 - reserve) * (1.0 - least)
        return VehicleLimits(**{**thrusts, **others}, gravity=vehicle.gravity, vehicle=vehicle, reserve=float(reserve))

    @classmethod
    def of_mass(
        cls,
        mass: float,
        max_thrust: float,
        *,
        min_thrust: float | None = None,
        reserve: float = 0.1,
        gravity: float = GRAVITY,
        **others: Any,
    ) -> Limits:
        """Return the limits of a vehicle of which mass, thrust and rates are known, as racers tell them.

        Thrust of all rotors together becomes a limit; single rotors, inertia and drag are left out (``Limits.of`` has
        them). Give the rates that its controller follows beside it.

        Parameters
        ----------
        mass : float
            [kg].
        max_thrust, min_thrust : float
            Of all rotors together [N].
        reserve : float
            Share of the thrust's room above and below hover that is left to feedback, in [0, 1).
        gravity : float
            [m/s^2].
        **others
            Further limits, such as ``body_rate=12`` [rad/s], ``yaw_rate``, ``tilt`` or ``speed``.

        Raises
        ------
        LimitError
            If a number is none, the thrust does not lift the mass, or another limit is malformed.
        """
        weight = check_positive("mass", mass, "kg", LimitError) * check_positive("gravity", gravity, "m/s²", LimitError)
        most = check_positive("max_thrust", max_thrust, "N", LimitError)
        _check_reserve(reserve)
        if most <= weight:
            raise LimitError(
                f"{most:g} N lift {most / weight:.3f} of the weight of {mass:g} kg: give the thrust of all rotors",
                smallest=weight,
            )
        thrusts = {"max_thrust": 1.0 + (1.0 - reserve) * (most / weight - 1.0)}
        if min_thrust is not None:
            least = check_positive("min_thrust", min_thrust, "N", LimitError)
            if least >= weight:
                raise LimitError(
                    f"min_thrust is {least:g} N, and the weight {weight:.4g} N: give less", smallest=weight
                )
            thrusts["min_thrust"] = 1.0 - (1.0 - reserve) * (1.0 - least / weight)
        return cls(**{**thrusts, **others}, gravity=gravity)

    @property
    def medium(self) -> Medium:
        """Gravity, and the drag that thrust, tilt and body rates include: none but a vehicle's."""
        return Medium(self.gravity)

    def given(self) -> dict[str, float]:
        """Return the limits that are set, by name."""
        return dict(self._given)

    @cached_property
    def _given(self) -> dict[str, float]:
        values = {kind.name: getattr(self, kind.name, None) for kind in KINDS}
        return {name: value for name, value in values.items() if value is not None}

    def utilisation(self, traj: Trajectory, proved: bool = True) -> tuple[Utilisation, ...]:
        """Return the exact utilisation of each limit over all time; 1 is fully used.

        The same trajectory is measured once.

        Parameters
        ----------
        traj : Trajectory
        proved : bool
            Whether uses between samples count, where limits are proved by bounds.

        Raises
        ------
        LimitError
            If a vertical or vehicle limit is set and the trajectory has no vertical coordinate.
        """
        what = "utilisation" if proved or type(self) is Limits else "estimated"
        return remembered(traj, what, self, lambda: self._used(traj, proved))

    def _used(self, traj: Trajectory, proved: bool) -> tuple[Utilisation, ...]:
        self.check_dim(traj.dim)
        return self._by_legs(traj, measured(self.given(), traj, self.norm, self.gravity))

    def _by_legs(self, traj: Trajectory, used: tuple[Utilisation, ...]) -> tuple[Utilisation, ...]:
        """Return the use of limits, that of the speed on the leg where it uses most of its own."""
        if not self.leg_speeds:
            return used
        each = speed_of_legs(traj, self.speeds_of(traj.legs), self.norm, self.gravity)
        return tuple(each if one.name == "speed" else one for one in used)

    def use_of_state(self, derivatives: Mapping[int, FloatArray], dim: int) -> tuple[Utilisation, ...]:
        """Return the utilisation of each limit by the state at a single instant.

        Parameters
        ----------
        derivatives : mapping of int to ndarray, shape (dim,)
            By order; those missing are zero.
        dim : int
        """
        state = Motion(lambda order: derivatives.get(order, np.zeros(dim)).reshape(1, dim), self.norm, self.medium)
        return at_instant(self.given(), state)

    def check_dim(self, dim: int) -> None:
        """Raise LimitError for limits that need three coordinates where there are others."""
        spatial = [name for name in self.given() if KIND[name].spatial]
        if spatial and dim != 3:
            raise LimitError(f"{spatial[0]} needs three coordinates, z up; the path has {dim}")

    def walls(self, waypoints: FloatArray) -> Sequence[Walls]:
        """Return the convex limits as sets that derivatives must stay in on every leg.

        A minimum thrust is replaced by a bound on its vertical part, which is sufficient; body and yaw rate are not
        convex: searches linearise them, and the time scale keeps them.
        """
        extent = Extent(len(waypoints) - 1, waypoints.shape[1])
        if extent not in self._known_walls:
            self._known_walls[extent] = self._walls(extent)
        return self._known_walls[extent]

    @cached_property
    def _known_walls(self) -> dict[Extent, tuple[Walls, ...]]:
        return {}

    def _walls(self, extent: Extent) -> tuple[Walls, ...]:
        self.check_dim(extent.dim)
        walls: list[Walls] = []
        for name, limit in self.given().items():
            kind = KIND[name]
            if kind.measure in MEASURES:
                measure = MEASURES[kind.measure]
                bound: Any = self.speeds_of(extent.legs) if name == "speed" and self.leg_speeds else limit
                walls += measure.walls(extent, bound, name, kind.order, self.norm, self.gravity)
        return tuple(walls)

    def necessary_walls(self, waypoints: FloatArray) -> Sequence[Walls]:
        """Return the walls that every curve within the limits keeps: what they refuse is refused with proof."""
        doubtful = ("max_thrust", "min_thrust", "tilt") if self.medium.drags else ("min_thrust",)
        return [wall for wall in self.walls(waypoints) if wall.name not in doubtful]


def within_speeds(limits: Limits | None, speeds: FloatArray) -> Limits:
    """Return limits with a speed of each leg besides, (legs,) [m/s]: the smaller one holds."""
    if limits is None:
        return Limits(speed=speeds)
    check_limits(limits)
    both: dict[str, Any] = {"speed": np.minimum(speeds, limits.speeds_of(len(speeds))), "leg_speeds": ()}
    return replace(limits, **both)


def check_limits(limits: Any) -> None:
    """Raise LimitError for what are no Limits."""
    if not isinstance(limits, Limits):
        hint = ""
        if isinstance(limits, Mapping) and limits:
            hint = f": did you mean Limits({', '.join(f'{name}={shown(value)}' for name, value in limits.items())})?"
        raise LimitError(f"limits must be a Limits, not {type(limits).__name__}{hint}")


def check_one_speed(limits: Any, what: str) -> None:
    """Raise LimitError for what are no Limits, or have a speed of each leg where there is one for all."""
    check_limits(limits)
    if limits.leg_speeds:
        raise LimitError(f"{what} has one speed for all legs, not {len(limits.leg_speeds)}: give Limits(speed=3)")


def _check_reserve(reserve: Any) -> None:
    """Refuse a share of the rotors' room that is none."""
    if not (is_number(reserve) and 0.0 <= reserve < 1.0):
        raise LimitError(f"the reserve is {shown(reserve)}: it must be at least 0 and below 1")


def _check_limit(kind: Kind, limit: float) -> None:
    """Raise LimitError unless a limit is a positive number with which a vehicle can hold its altitude."""
    check_positive(f"the limit {kind.name}", limit, kind.unit, LimitError)
    if limit <= kind.above:
        bounds, what = {"smallest": kind.above}, f"above {kind.above:g}"
    elif limit >= kind.below:
        meant = f"; {limit:g} degrees are {radians(limit):.4g} rad" if kind.degrees and limit > 2.0 * pi else ""
        bounds, what = {"largest": kind.below}, f"below {_told(kind, kind.below)}{meant}"
    else:
        return
    said = _told(kind, limit)
    raise LimitError(f"{kind.name} is {said}: no vehicle holds altitude unless it is {what}", **bounds)


def _told(kind: Kind, limit: float) -> str:
    """Return a limit with its unit; an angle in degrees, too, which commands and pages take."""
    return f"{limit:.4g} {kind.unit}" + (f" ({degrees(limit):.4g} degrees)" if kind.degrees else "")


@dataclass(frozen=True)
class VehicleLimits(Limits):
    """Limits derived from a vehicle, combined with others; made by :meth:`Limits.of`.

    Parameters
    ----------
    vehicle : Quadrotor
        Its rotors' thrusts are kept within their limits; with its drag.
    reserve : float
        Share of the rotors' room above and below hover that is left to feedback, in [0, 1).
    """

    vehicle: Any = None
    reserve: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.vehicle is not None and self.gravity != self.vehicle.gravity:
            own = f"{self.vehicle.gravity:g} m/s² of its vehicle"
            raise LimitError(f"gravity={self.gravity:g} of the limits is not the {own}: give Limits.of one with that")

    def _used(self, traj: Trajectory, proved: bool) -> tuple[Utilisation, ...]:
        """Return the utilisation of each limit, and of each side of the rotors' thrust limits.

        The rotors' ``method`` is ``"interval"`` where interval bounds prove that no thrust goes beyond the value given
        (1e-4 above the largest of many samples), ``"sampled"`` where the yaw is along the velocity, or the drag
        differs along the body's lateral axes. A heading from the tilt is proved as well. With drag the total thrust,
        the tilt and the body rate are measured in the same way.
        """
        self.check_dim(traj.dim)
        bounds = self.given()
        own = measure_vehicle(self.vehicle, self.reserve, bounds, traj, proved)
        others = {name: limit for name, limit in bounds.items() if name not in own}
        used = {entry.name: entry for entry in measured(others, traj, self.norm, self.gravity)} | own
        return self._by_legs(traj, tuple(used[kind.name] for kind in KINDS if kind.name in used))

    @cached_property
    def medium(self) -> Medium:
        """Gravity, and the drag of the vehicle that its limits include."""
        return medium_of(self.vehicle)
