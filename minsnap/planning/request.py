"""The question of a plan as one value, which ``plan`` makes of its arguments, and a file of what it says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, Literal

from minsnap.basics.arrays import ArrayLike
from minsnap.basics.messages import shown
from minsnap.corridors.constraint import Constraint
from minsnap.corridors.gates import Ball
from minsnap.corridors.keep_out import Avoided
from minsnap.corridors.tubes import Sampled
from minsnap.durations.search_options import Search
from minsnap.errors import YawError
from minsnap.trajectory.planned_heading import Yaw
from minsnap.trajectory.velocity_heading import Velocity

if TYPE_CHECKING:
    from minsnap.limits.limits import Limits
    from minsnap.optimisation.qp import Solver
    from minsnap.vehicle.loop import Loop

Places = ArrayLike | Sequence[object] | None
"""Waypoints, gates among them, or None where the corridor says where the curve passes."""

Walled = ArrayLike | Constraint | Sequence[object] | None
"""Half-widths [m], a constraint, or several."""

State = Mapping[str, ArrayLike]
"""Derivatives of the position by name, such as ``velocity`` [m/s]."""

SEARCH = tuple(field.name for field in fields(Search))
TURNING = tuple(field.name for field in fields(Velocity))


@dataclass(frozen=True, eq=False, kw_only=True)
class PlanRequest:
    """The question of :func:`minsnap.plan`: its arguments, as it takes them, all but ``progress``."""

    waypoints: Places
    durations: ArrayLike | None = None
    total_time: float | None = None
    limits: Limits | None = None
    corridor: Walled | Sampled = None
    continuity: int | None = None
    degree: int = 7
    yaw: Yaw = None
    start: State | None = None
    end: State | None = None
    closed: bool = False
    solver: Solver = "auto"
    pins: Mapping[int, State] | None = None
    pieces: int | Literal["auto"] | None = None
    waypoint_tolerance: ArrayLike | Ball | None = None
    search: Search | None = None
    avoid: Sequence[Avoided] = ()
    tracking: Loop | None = None
    wind: float | None = None

    @property
    def polynomials(self) -> int | Literal["auto"]:
        """Polynomials per leg: as asked, else "auto" where limits choose the time, and one elsewhere.

        Continuity below k - 1 is that of legs of one polynomial.
        """
        if self.pieces is not None:
            return self.pieces
        priced = self.search is not None and self.search.time_weight is not None
        timed = self.durations is not None or self.total_time is not None or priced
        smooth = self.continuity is None or self.continuity >= self.degree // 2
        return "auto" if self.limits is not None and smooth and not timed else 1

    def changed(self, **named: Any) -> PlanRequest:
        """Return the request with other fields, those of ``Search`` and ``Velocity`` among them by their own names.

        Raises
        ------
        InputError
            If a value is malformed, or turning goes with another yaw than one along the velocity.
        """
        return replace(self, **plan_arguments({"yaw": self.yaw} | (vars(self.search) if self.search else {}) | named))

    def within(self, *walls: Constraint) -> PlanRequest:
        """Return the request with more walls."""
        return replace(self, corridor=with_walls(self.corridor, *walls))

    def arguments(self) -> dict[str, Any]:
        """Return the waypoints, or None, and the other arguments of ``plan`` that are set."""
        values = vars(self) | {"avoid": self.avoid or None}
        return {name: value for name, value in values.items() if value is not None or name == "waypoints"}


def plan_arguments(named: Mapping[str, Any]) -> dict[str, Any]:
    """Return arguments of ``plan`` from flat names: the options of a search and the turning of a heading are grouped.

    Raises
    ------
    InputError
        If a value is malformed, or turning goes with another yaw than one along the velocity.
    """
    arguments = {name: value for name, value in named.items() if name not in (*SEARCH, *TURNING)}
    search, turning = ({n: named[n] for n in names if named.get(n) is not None} for names in (SEARCH, TURNING))
    if search:
        arguments["search"] = Search(**search)
    if turning:
        if not (isinstance(arguments.get("yaw"), str) and arguments["yaw"] == "velocity"):
            name, value = next(iter(turning.items()))
            raise YawError(f"{name}={shown(value)} is for a heading along the velocity: give yaw='velocity' with it")
        arguments["yaw"] = Velocity(**turning)
    return arguments


def with_walls(corridor: Any, *walls: Any) -> Any:
    """Return a corridor with more walls, as ``plan`` takes it."""
    if not walls:
        return corridor
    if isinstance(corridor, Sampled):
        return replace(corridor, corridor=with_walls(corridor.corridor, *walls))
    parts = [*([] if corridor is None else [corridor]), *walls]
    return parts if len(parts) > 1 else parts[0]
