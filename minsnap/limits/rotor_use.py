"""Utilisation of the thrust range of each rotor of a vehicle, certified over all time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.arrays import FloatArray
from minsnap.errors import LimitError
from minsnap.limits.rotor_bounds import Part, axis_ranges, heading_ranges, rotor_ranges
from minsnap.polynomials.bernstein import differentiate, multiply, subdivide
from minsnap.polynomials.intervals import Interval
from minsnap.trajectory.heading import ConstantHeading, RemappedHeading
from minsnap.trajectory.planned_heading import PlannedHeading
from minsnap.trajectory.report import Utilisation
from minsnap.trajectory.tilt_heading import TiltHeading

if TYPE_CHECKING:
    from minsnap.trajectory.trajectory import Trajectory
    from minsnap.vehicle import Quadrotor

GRID = 256
"""Samples of a piece from which the largest thrust is taken."""

MARGIN = 5e-4
"""Share added to it, below which interval bounds prove that all thrusts stay."""

ROUNDS, PARTS, MOST = 9, 4, 400_000
"""How often, into how many parts, and up to how many parts in all a piece is divided for the proof."""


def measure_rotors(vehicle: Quadrotor, reserve: float, traj: Trajectory) -> list[Utilisation]:
    """Return the utilisation of the rotors' thrust range above and below hover.

    Raises
    ------
    LimitError
        If the heading follows from the tilt at another gravity than the vehicle's: no attitude has both.
    """
    if isinstance(traj.yaw, TiltHeading) and traj.yaw.gravity != vehicle.gravity:
        raise LimitError(
            f"the heading follows from the tilt at a gravity of {traj.yaw.gravity:g} m/s^2, the vehicle's is "
            f"{vehicle.gravity:g} m/s^2: plan with the vehicle's, or give the heading the same"
        )
    hover, (least, most) = vehicle.hover_thrust, vehicle.rotor_thrust_limits
    found = RotorBound(vehicle, traj).run()
    return [
        _used(traj, "rotor_thrust", hover + (1.0 - reserve) * (most - hover), 1.0, hover, found[0]),
        _used(traj, "min_rotor_thrust", hover - (1.0 - reserve) * (hover - least), -1.0, hover, found[1]),
    ]


Found = tuple[float, float, str]
"""Largest departure from hover to one side [N], instant [s], method."""


def _used(traj: Trajectory, name: str, limit: float, side: float, hover: float, found: Found) -> Utilisation:
    excess, instant, method = found
    breaks = traj.leg_breaks
    leg = int(np.clip(np.searchsorted(breaks, instant, side="right") - 1, 0, len(breaks) - 2))
    fraction = max(excess, 0.0) / abs(limit - hover)
    return Utilisation(name, hover + side * excess, limit, fraction, leg, instant, method)


class RotorBound:
    """Largest deviations of the rotors' thrusts from hover, sampled and then proved."""

    def __init__(self, vehicle: Quadrotor, traj: Trajectory) -> None:
        self.vehicle, self.traj = vehicle, traj
        self.yaw, self.turns = traj.yaw, _yaw_jerk(traj.yaw)
        self.hover = vehicle.hover_thrust

    def run(self) -> list[Found]:
        """Return the deviations upwards and downwards."""
        t, departures = self.sampled()
        best = departures.argmax(axis=1)
        values = departures.max(axis=1) + MARGIN * self.hover
        method = "sampled"
        if (self._spinless or np.isfinite(self.turns)) and np.isfinite(values).all():
            values, method = self._proved(values), "interval"
        return [(float(value), float(t[i]), method) for value, i in zip(values, best, strict=True)]

    @property
    def _spinless(self) -> bool:
        return isinstance(self.yaw, TiltHeading)

    def sampled(self) -> tuple[FloatArray, FloatArray]:
        """Return many instants (m,) [s] and the largest deviations upwards and downwards there, (2, m) [N]."""
        from minsnap.vehicle import BodyDrag, flatness_of

        inner = np.linspace(0.0, 1.0, GRID, endpoint=False)
        grid = self.traj.breaks[:-1, None] + self.traj.durations[:, None] * inner
        t = np.append(grid.reshape(-1), self.traj.duration)
        speed = flatness_of(self.vehicle, self.traj, t, drag=BodyDrag()).rotor_speed
        thrust = self.vehicle.thrust_coefficient * speed * np.abs(speed)
        return t, np.array([thrust.max(axis=1) - self.hover, self.hover - thrust.min(axis=1)])

    def _proved(self, values: FloatArray) -> FloatArray:
        """Return the values raised until interval bounds prove them."""
        points, start, width = self._pieces()
        for level in range(ROUNDS):
            departures = self._bounds(points, start, width)
            open_ = (departures > values[:, None]).any(axis=0)
            if not open_.any():
                return values
            parts = PARTS if level else 8 * PARTS
            if open_.sum() * parts > MOST or level == ROUNDS - 1:
                break
            points, start, width = _divided(points[open_], start[open_], width[open_], parts)
        return np.asarray(np.maximum(values, departures.max(axis=1)))

    def _pieces(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Control points of force, jerk and snap (pieces, 9, n), begin and length of the pieces [s]."""
        control, durations = self.traj.control_points, self.traj.durations
        size = max(control.shape[1] - 2, 1)
        orders = []
        for order in (2, 3, 4):
            points = differentiate(control, order) / durations[:, None, None] ** order
            if order == 2:
                points = points + np.array([0.0, 0.0, self.vehicle.gravity])
            orders.append(_elevated(points, size))
        return np.concatenate(orders, axis=1), self.traj.breaks[:-1], durations

    def _bounds(self, points: FloatArray, start: FloatArray, width: FloatArray) -> FloatArray:
        """Upper bounds of the deviations from hover upwards and downwards, shape (2, parts)."""
        low, high = points.min(axis=2), points.max(axis=2)
        ranges = [Interval(low[:, i], high[:, i]) for i in range(9)]
        with np.errstate(all="ignore"):
            rotors = rotor_ranges(self.vehicle, self._part(ranges, start + 0.5 * width, 0.5 * width))
        above = np.max([rotor.high for rotor in rotors], axis=0) - self.hover
        below = self.hover - np.min([rotor.low for rotor in rotors], axis=0)
        return np.where(np.isnan([above, below]), np.inf, [above, below])

    def _part(self, ranges: list[Interval], middle: FloatArray, half: FloatArray) -> Part:
        """Ranges of the motion with those of the heading."""
        force, jerk, snap = tuple(ranges[:3]), tuple(ranges[3:6]), tuple(ranges[6:])
        if not self._spinless:
            heading = heading_ranges(*self._yaw_ranges(middle, half))
            return Part(force, jerk, snap, heading)  # type: ignore[arg-type]
        x, y = axis_ranges(force, jerk, self.yaw.axes(middle)[:2], half)  # type: ignore[arg-type,attr-defined]
        return Part(force, jerk, snap, (x, y, x), True)  # type: ignore[arg-type]

    def _yaw_ranges(self, middle: FloatArray, half: FloatArray) -> tuple[Interval, Interval, Interval]:
        """Ranges of yaw and its derivatives around the middle of each part, from a bound of the third one."""
        spread, ranges = self.turns + np.zeros(len(half)), []
        for order in (2, 1, 0):
            value = self.yaw(middle, order)
            ranges.append(Interval(value - half * spread, value + half * spread))
            spread = np.abs(value) + half * spread
        return ranges[2], ranges[1], ranges[0]


def _elevated(points: FloatArray, size: int) -> FloatArray:
    """Each coordinate with ``size`` control points: (m, n + 1, 3) to (m, 3, size)."""
    rows = points.transpose(0, 2, 1).reshape(-1, points.shape[1])
    raised = multiply(rows, np.ones((len(rows), size - points.shape[1] + 1)))
    return np.asarray(raised.reshape(len(points), 3, size))


def _divided(
    points: FloatArray, start: FloatArray, width: FloatArray, parts: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    count, rows, size = points.shape
    finer = subdivide(points.reshape(-1, size), parts).reshape(count, rows, parts, size).transpose(0, 2, 1, 3)
    begins = start[:, None] + width[:, None] * np.arange(parts) / parts
    return finer.reshape(-1, rows, size), begins.reshape(-1), np.repeat(width / parts, parts)


def _yaw_jerk(heading: Any) -> float:
    """Largest third derivative of a yaw that is a polynomial on each leg [rad/s^3]; infinite for any other."""
    if isinstance(heading, ConstantHeading):
        return 0.0
    if isinstance(heading, RemappedHeading):
        return _yaw_jerk(heading.heading) * abs(heading.rate) ** 3
    return float(heading.trajectory.max_norm(3)[0]) if isinstance(heading, PlannedHeading) else float(np.inf)
