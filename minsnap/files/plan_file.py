"""A stored plan: the curve with all that it was to keep, certified again, and a flight along it against the same."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import inf
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.cached import cached_property
from minsnap.basics.tolerances import EXACT
from minsnap.certificate import Certificate, certify
from minsnap.corridors.gates import Ball, Gate
from minsnap.corridors.given_waypoints import without_gates
from minsnap.corridors.keep_out import Avoided
from minsnap.corridors.passages import GatePassage, gate_passages
from minsnap.limits.limits import Limits
from minsnap.trajectory.samples import VECTORS
from minsnap.trajectory.trajectory import Trajectory

if TYPE_CHECKING:
    from minsnap.vehicle.loop import Loop
    from minsnap.vehicle_tube import VehicleTube

PASSED, PINNED = 1e-7, 1e-6
"""By how much the margin of a gate may be missed [m]; a pinned derivative, of its largest value."""


class PassedStop(NamedTuple):
    """A stop of a course: where it is, and the radius of the ball or half-width of the box around it [m]."""

    position: FloatArray
    ball: float = 0.0
    box: float = 0.0

    def missed(self, places: FloatArray) -> float:
        """Return by how much the nearest of some places (n, dim) is outside of it, 0 or less inside [m]."""
        apart = np.abs(places - self.position)
        if self.box:
            return float((apart - self.box).max(axis=1).min())
        return float(np.linalg.norm(apart, axis=1).min() - self.ball)


@dataclass(frozen=True, eq=False)
class PlanFile:
    """The content of a file of polynomials.

    Parameters
    ----------
    trajectory : Trajectory
    waypoints : array_like, shape (n, dim), sequence with Gates among them, or None
        [m].
    corridor : Constraint, list of them, or None
    limits : Limits or None
    command : tuple of str
        The command line that wrote it; empty for a file written from Python.
    made_by : str
        Program and version.
    certificate : mapping
        What held when it was written.
    gates : mapping of int to Gate
        By their numbers.
    avoid : tuple of Obstacle
        What the curve keeps out of.
    tolerance : float, array_like, Ball or None
        How far from the waypoints it may pass, as ``waypoint_tolerance`` of ``plan``.
    pins : mapping of int to mapping
        Derivatives at waypoints by their names, those of both ends among them.
    stops : tuple of PassedStop
        Of a course, which has no waypoints: each is passed where legs meet. Gates have the numbers of stops.
    """

    trajectory: Trajectory
    waypoints: Any = None
    corridor: Any = None
    limits: Limits | None = None
    command: tuple[str, ...] = ()
    made_by: str = ""
    certificate: Mapping[str, Any] | None = None
    gates: Mapping[int, Gate] = field(default_factory=dict)
    avoid: tuple[Avoided, ...] = ()
    tolerance: Any = None
    pins: Mapping[int, Mapping[str, Any]] = field(default_factory=dict)
    stops: tuple[PassedStop, ...] = ()

    @property
    def places(self) -> Any:
        """Waypoints with the gates in their places, where these are their centers; else as they are."""
        if self.waypoints is None or not self.gates:
            return self.waypoints
        points: list[Any] = list(self.points)
        near = EXACT * (1.0 + np.abs(self.points).max())
        centers = {number: gate.center for number, gate in self.gates.items() if number < len(points)}
        if any(len(at) != len(points[n]) or np.abs(points[n] - at).max() > near for n, at in centers.items()):
            return self.waypoints  # of stops of a course, or where the curve passes
        return [self.gates.get(number, point) for number, point in enumerate(points)]

    @property
    def points(self) -> FloatArray:
        """The waypoints, of gates their centers, of a plan without any where its legs meet, shape (n, dim) [m]."""
        if self.waypoints is None:
            return self.trajectory(self.trajectory.leg_breaks)
        return np.asarray(without_gates(self.waypoints)[0], dtype=np.float64)

    @property
    def drawn(self) -> dict[str, Any]:
        """What figures of the plan show beside its curve, as :func:`minsnap.plot.plot_path` takes it."""
        how = {"corridor": self.corridor, "waypoints": self.places, "tolerance": self.tolerance}
        if self.stops:  # whose walls are on other legs than those between them
            places = [self.gates.get(number, stop.position) for number, stop in enumerate(self.stops)]
            balls = [0.0 if number in self.gates else stop.ball for number, stop in enumerate(self.stops)]
            how = {"waypoints": places, "tolerance": Ball(balls) if any(balls) else None}
        return how | {"avoid": self.avoid}

    @cached_property
    def proof(self) -> Certificate:
        """What holds of the plan, proved anew."""
        allowed = 0.0 if self.tolerance is None else self.tolerance
        return certify(self.trajectory, self.places, self.corridor, self.limits, allowed, avoid=self.avoid)

    def in_loop(self, loop: Loop, wind: float) -> VehicleTube:
        """Return the tube of a vehicle in its control loop, which must keep what the plan keeps.

        Parameters
        ----------
        loop : Loop
        wind : float
            Largest change of the wind [m/s].

        Raises
        ------
        VehicleError
            If the wind is malformed.
        """
        from minsnap.vehicle_tube import check_dimensions, check_tracking, vehicle_tube

        proof, instants = self.proof, self.trajectory.leg_breaks
        check_dimensions(self.trajectory)
        passed = [(int(np.abs(instants - each.instant).argmin()), self.gates[each.gate]) for each in self.passages]
        kept = proof.walls, dict(passed), self.avoid, self.limits
        return vehicle_tube(loop, check_tracking(loop, wind), self.trajectory, *kept)

    @cached_property
    def passages(self) -> tuple[GatePassage, ...]:
        """When, how fast and how far from its edges each gate is passed."""
        return gate_passages(self.trajectory, self.gates)

    @cached_property
    def rounding(self) -> float:
        """Difference of positions that counts as none [m]."""
        return float(EXACT * np.abs(self.trajectory.control_points).max())

    def certified(self) -> tuple[Certificate, list[str]]:
        """Certify the plan anew: the certificate, and a sentence for all that it keeps less than its file says."""
        found = (*self._walls_left(), *self._waypoints_missed(), *self._gates_missed(), *self._pins_missed())
        return self.proof, [*found, *self._limits_exceeded()]

    def _said(self, name: str, otherwise: float) -> float:
        """Return what the file's certificate says; what it does not say binds nothing."""
        value = (self.certificate or {}).get(name)
        return otherwise if value is None else float(value)

    def _walls_left(self) -> Iterator[str]:
        margin, near, tiny = self.proof.corridor_margin, self.proof.nearest_obstacle, self.rounding
        if margin is not None and margin < min(0.0, self._said("corridor_margin", 0.0) - tiny):
            yield f"the plan leaves its corridor: its exact margin is {margin:.3g} m"
        if near is not None and near.value < min(-EXACT, self._said("obstacle_margin", 0.0) - tiny):
            yield f"the plan is {near.inside}"

    def _waypoints_missed(self) -> Iterator[str]:
        proof, tiny = self.proof, self.rounding
        said = self._said("waypoint_error", inf)
        if proof.waypoint_error is not None and proof.waypoint_error > said + tiny:
            yield f"the plan misses a waypoint by {proof.waypoint_error:.3g} m, and its file says {said:.3g} m"
        regions = self.tolerance is not None or self.places is not self.waypoints
        if regions and (proof.waypoint_excess or 0.0) > tiny:
            yield f"the plan passes {proof.waypoint_excess:.3g} m outside of the tolerance or the gate of a waypoint"
        knots = self.trajectory(self.trajectory.leg_breaks)
        for number, stop in enumerate(self.stops):
            if number not in self.gates and stop.missed(knots) > max(tiny, PASSED):
                yield f"the plan misses waypoint {number} by {stop.missed(knots):.3g} m"
        smooth, expected = proof.continuity, int(self._said("continuity", -1))
        if smooth < expected:
            yield f"the plan has {smooth} continuous derivatives, and its file says {expected}"

    def _gates_missed(self) -> Iterator[str]:
        said = [passed["gate"] for passed in (self.certificate or {}).get("gates", ())]
        for number, gate in self.gates.items():
            own = [passed for passed in self.passages if passed.gate == number]
            through = [passed for passed in own if self._is_along(gate, passed.instant)]
            if not through or len(own) < said.count(number):
                against = "against its direction" if own and not through else f"{len(own)} times"
                yield f"the plan passes gate {number} {against}"
                continue
            widest = sorted((passed.clearance for passed in through), reverse=True)
            nearest = widest[: max(said.count(number), 1)][-1]
            if nearest < gate.margin - max(self.rounding, PASSED):
                where = f"gate {number} {nearest:.3g} m from its edge"
                yield f"the plan passes {where}, and its margin is {gate.margin:g} m"

    def _is_along(self, gate: Gate, instant: float) -> bool:
        """Whether a gate is passed in its direction, if it has one."""
        velocity = self.trajectory(instant, 1)
        return float(gate.crossing * (velocity @ gate.normal)) >= -EXACT * self.proof.max_speed

    def _pins_missed(self) -> Iterator[str]:
        instants = self.trajectory.leg_breaks
        for knot, state in self.pins.items():
            for name, wanted in state.items():
                order = VECTORS.index(name)
                apart = float(np.abs(self.trajectory(instants[knot], order) - np.asarray(wanted)).max())
                if apart > PINNED * max(1.0, self.trajectory.max_norm(order)[0]):
                    yield f"the plan has another {name} than its file says at waypoint {knot}: {apart:.3g} apart"

    def _limits_exceeded(self) -> Iterator[str]:
        said = {str(used["name"]): float(used["fraction"]) for used in (self.certificate or {}).get("limits", ())}
        for used in self.proof.utilisation:
            if not used.kept and used.fraction > (1.0 + EXACT) * said.get(used.name, 1.0):
                most = f"{used.value:.6g} of {used.limit:.6g}"
                yield f"the plan exceeds its limit {used.name}: {most} on leg {used.leg} at {used.instant:.4g} s"
        for quantity, unit in (("speed", "m/s"), ("acceleration", "m/s^2"), ("jerk", "m/s^3")):
            most, expected = getattr(self.proof, f"max_{quantity}"), self._said(f"max_{quantity}", inf)
            if most > expected * (1.0 + 1e-6) + self.rounding:
                yield f"the plan reaches {most:.6g} {unit}, and its file says {expected:.6g}"
