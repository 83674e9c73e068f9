"""What a show is: its acts, home, limits, and what is refused of it before anything is planned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.cached import cached_property
from minsnap.basics.checks import LONGEST
from minsnap.basics.tolerances import EXACT
from minsnap.errors import FleetError
from minsnap.fleet import Separation, table_of
from minsnap.limits import ORDINARY, Limits
from minsnap.shows.act_lights import Colour, LightChange
from minsnap.shows.climb_turns import ClimbTurns, turns_of
from minsnap.shows.energy import PowerModel
from minsnap.shows.formations import spacing_of
from minsnap.shows.frame_animation import Animation
from minsnap.shows.moves import Move
from minsnap.shows.site import Fence, ShowOrigin
from minsnap.trajectory import Trajectory

BUILT_UP = 1.0 / 3.0
"""Time in which a flight builds up its acceleration: what limits the jerk of a show that says none [s].

Without a limit a straight flight jumps from one acceleration to another, which no file of whole millimetres holds.
"""


@dataclass(frozen=True, eq=False)
class Act:
    """One formation of a show.

    Parameters
    ----------
    name : str
    points : ndarray, shape (points, 3)
        One for each vehicle, or fewer: the others wait above their homes [m].
    hold : float
        How long it stands [s].
    colour : tuple of int, ndarray of shape (points, 3), Gradient, or None
        Red, green, blue of all lamps, or of the lamp at each point, from 0 to 255; None: as before, or those of an
        animation.
    fade : bool
        The colour is reached during the flight there, else on arrival.
    moves : tuple of Move or Animation
        What the formation does after its hold, one after the other. The points of an act with an animation are where
        that begins.
    at : float or None
        When all have arrived, since the start of the show [s].
    seconds : float or None
        How long the flight there lasts [s]; with ``at``, all wait where they are until it must begin.
    delays : ndarray, shape (points,), or None
        How long after the first the vehicle leaves that flies to each point [s].
    lights : tuple of LightChange
        How colours change after the arrival.
    yaw : float, ndarray of shape (points,), or None
        Heading of all, or of the vehicle at each point [rad]; None: as before, and in the beginning 0.
    """

    name: str
    points: FloatArray
    hold: float = 3.0
    colour: Colour | None = None
    fade: bool = False
    moves: tuple[Move | Animation, ...] = ()
    at: float | None = None
    seconds: float | None = None
    delays: FloatArray | None = None
    lights: tuple[LightChange, ...] = ()
    yaw: float | FloatArray | None = None

    @property
    def animated(self) -> bool:
        """Whether its points are the beginning of an animation."""
        return bool(self.moves) and isinstance(self.moves[0], Animation)

    def lasts(self, moves: Sequence[Sequence[Trajectory]]) -> float:
        """Return how long its hold and the curves of its moves last [s]."""
        return self.hold + sum(max((curve.duration for curve in curves), default=0.0) for curves in moves)

    @property
    def changes(self) -> tuple[LightChange, ...]:
        """All changes of its colours, the first of them on arrival."""
        return (() if self.colour is None else (LightChange(0.0, self.colour, self.fade),)) + self.lights


@dataclass(frozen=True, eq=False)
class Group:
    """Vehicles that fly acts of their own, at their own times.

    Parameters
    ----------
    name : str
    acts : tuple of Act
        Each has as many points as there are vehicles in the group.
    """

    name: str
    acts: tuple[Act, ...]


@dataclass(frozen=True, eq=False)
class Groups:
    """Groups that fly at once, each its own acts; vehicles of none of them stay where they are.

    Who is in which group is decided by the least sum of squared ways to their first acts. The next act begins when the
    last group is done with its own.

    Parameters
    ----------
    name : str
    groups : tuple of Group
    """

    name: str
    groups: tuple[Group, ...]

    @property
    def first(self) -> FloatArray:
        """Points of the first acts of all groups, one group after the other, shape (points, 3) [m]."""
        return np.concatenate([group.acts[0].points for group in self.groups])

    @property
    def acts(self) -> tuple[Act, ...]:
        """All acts, one group after the other."""
        return tuple(act for group in self.groups for act in group.acts)


@dataclass(frozen=True, eq=False)
class Show:
    """What is to be flown.

    Parameters
    ----------
    home : ndarray, shape (vehicles, 3)
        Where each stands and lands [m]. Those beyond the most points of any act, the last ones, are reserves and stay
        on the ground.
    acts : tuple of Act or Groups
    separation : Separation
        Homes that are nearer to each other than it asks in flight, and not on the ground, are left in turn.
    limits : Limits
    take_off : float
        How far above home the vehicles climb straight [m].
    layers : int
        Number of heights, each the separation times the downwash above the one before, neighbours into other ones.
    land : str
        ``"own"``: each lands where it took off; ``"any"``: at any vehicle's place, where that is shorter.
    room : pair of corners or None
    seed : int
    smooth : bool
        Whether flights build up their acceleration in ``BUILT_UP`` where the limits name no jerk.
    climb_speed, descent_speed : float or None
        Of take-off and landing [m/s]; None: as the limits allow, or ``GENTLE`` in Skybrush's files.
    wait : float or None
        How long all stand on the ground before they climb [s]; None: none, or what Skybrush's firmware needs.
    environment : {"outdoor", "indoor"}
    origin : ShowOrigin or None
        Where on the earth it is flown.
    fence : Fence or None
        Walls that all stay inside of, by their margins.
    return_home : bool
        Whether all fly home before they land; else they land below the last act, at the height of the lowest home.
    layer : float or None
        Least height between groups that climb in turn [m]; None: as much as lets the first flight be straight.
    energy : PowerModel or None
        What power a vehicle takes, for the report.
    """

    home: FloatArray
    acts: tuple[Act | Groups, ...]
    separation: Separation
    limits: Limits
    take_off: float = 2.0
    room: tuple[FloatArray, FloatArray] | None = None
    seed: int = 0
    layers: int = 1
    land: str = "own"
    smooth: bool = True
    climb_speed: float | None = None
    descent_speed: float | None = None
    wait: float | None = None
    environment: str = "outdoor"
    origin: ShowOrigin | None = None
    fence: Fence | None = None
    return_home: bool = True
    layer: float | None = None
    energy: PowerModel | None = None

    @property
    def flown_limits(self) -> Limits:
        """Limits that flights are planned within."""
        if self.limits.jerk is not None or not self.smooth:
            return self.limits
        hardest = float(table_of(self.limits)[1].min())
        return replace(self.limits, jerk=(hardest if hardest < inf else ORDINARY["acceleration"]) / BUILT_UP)

    @cached_property
    def turns(self) -> ClimbTurns | None:
        """Which vehicles climb one after the other; None where all can climb at once."""
        return turns_of(self.home, self.separation, self.take_off, self.layer)

    @property
    def above(self) -> FloatArray:
        """Where the climb ends, shape (vehicles, 3) [m]."""
        places = self.home + (0.0, 0.0, self.take_off)
        if self.turns is not None:
            places[:, 2] = self.turns.tops
            return np.asarray(places)
        gap = self.separation.downwash * 2.0 * float(self.separation.radii_of(len(self.home)).max())
        places[:, 2] += gap * (np.arange(len(places)) % self.layers)
        return np.asarray(places)

    @property
    def formations(self) -> tuple[Act, ...]:
        """All acts, those of groups too, one group after the other."""
        return tuple(each for act in self.acts for each in (act.acts if isinstance(act, Groups) else (act,)))

    @property
    def flying(self) -> int:
        """How many vehicles leave the ground."""
        counts = [len(act.first if isinstance(act, Groups) else act.points) for act in self.acts]
        return max(counts, default=len(self.home))

    @property
    def reach(self) -> float:
        """Largest coordinate of any formation [m]."""
        points = [self.above, *(act.points for act in self.formations)]
        return float(max(np.abs(place).max() for place in points))

    def check(self) -> None:
        """Refuse limits that leave a climb free, and acts that do not fit, are below home, or stand too close."""
        self._check_times()
        if self.seed < 0:
            raise FleetError(f"seed is {self.seed}: give 0 or more")
        for name, speed in (("take_off", self.climb_speed), ("land", self.descent_speed)):
            if speed is not None and not 0.0 < speed < inf:
                raise FleetError(f"the speed of {name} is {speed}: give a positive number [m/s]")
        if not np.isfinite(table_of(self.limits)[:2, 2:4]).any():
            raise FleetError("nothing limits how fast vehicles climb: give limits such as {speed: 4, acceleration: 3}")
        if self.home.ndim != 2 or self.home.shape[1] != 3 or not len(self.home):
            raise FleetError(f"home has the shape {self.home.shape}: give (vehicles, 3)")
        acts = [(f"act {act.name!r}", act.points, act.animated) for act in self.formations]
        for name, points, animated in [("home", self.home, False), *acts]:
            if points.ndim != 2 or points.shape[1:] != (3,) or not 1 <= len(points) <= len(self.home):
                text = f"{name} has {len(points)} points, and home has {len(self.home)}"
                raise FleetError(f"{text}: give as many or fewer, each x, y and z")
            if not np.isfinite(points).all():
                raise FleetError(f"{name} has a point that is not finite")
            below = float(self.home[:, 2].min() - points[:, 2].min())
            if below > EXACT:
                raise FleetError(f"{name} is {below:g} m below the lowest home: raise it")
            if len(points) < 2 or animated:  # the animation itself says what goes
                continue
            least, pair = spacing_of(self.separation.flat(points))
            apart = self.separation.standing if name == "home" else self.separation.between(*pair)
            if least < apart:
                text = f"points {pair[0]} and {pair[1]} of {name} are {least:.3f} m apart, {apart - least:.3f} m less"
                give = f"make it {1.001 * apart / max(least, EXACT):.3g} times as large, or give it fewer vehicles"
                if name == "home" and self.separation.ground is None:
                    give += f", or say how near they may be on the ground (ground: {np.floor(100 * least) / 100:g})"
                give = give if least >= 0.01 else "move one of them"
                raise FleetError(f"{text} than the separation of {apart:g} m: {give}", pair=pair)
        for act in self.acts:
            if isinstance(act, Groups):
                self._check_groups(act)
        self._check_climb()
        self.check_inside()
        self._check_reserves()

    def _check_climb(self) -> None:
        """Refuse heights of a climb that are for homes which are near, or are not."""
        if self.turns is not None and self.layers > 1:
            raise FleetError(
                f"layers is {self.layers}, and homes are so near that they are left in turn, each group at a height of "
                "its own: leave layers out"
            )
        if self.turns is None and self.layer is not None:
            raise FleetError(
                f"the layer of take_off is {self.layer:g} m, and no homes are so near that they are left in turn: "
                "leave it out, or give layers: 2 for a climb that ends in two heights"
            )

    def _check_groups(self, act: Groups) -> None:
        """Refuse groups of more vehicles than there are, and acts with more or fewer points than their group."""
        if len(act.first) > len(self.home):
            text = f"the groups of {act.name!r} have {len(act.first)} vehicles, and home has {len(self.home)}"
            raise FleetError(f"{text}: give them fewer")
        for group in act.groups:
            count = len(group.acts[0].points)
            for each in group.acts:
                if len(each.points) != count:
                    text = f"group {group.name!r} has {count} vehicles, and its act {each.name!r} {len(each.points)}"
                    raise FleetError(f"{text} points: give it as many")

    def _check_reserves(self) -> None:
        """Refuse what is flown too low over vehicles that stay on the ground."""
        reserves, apart = self.home[self.flying :], self.separation.distance or 0.0
        if not len(reserves):
            return
        lowest = apart * self.separation.downwash
        if self.take_off < lowest:
            raise FleetError(
                f"take_off is {self.take_off:g} m, over {len(reserves)} vehicles that stay on the ground: climb to "
                f"{lowest:g} m or more"
            )
        for act in self.formations:
            both = self.separation.flat(np.concatenate((act.points, reserves)))
            away = np.linalg.norm(both[: len(act.points), None] - both[None, len(act.points) :], axis=2)
            if away.min() < apart:
                point, reserve = (int(i) for i in np.unravel_index(int(away.argmin()), away.shape))
                text = f"point {point} of act {act.name!r} is {away.min():.3f} m from vehicle {self.flying + reserve}"
                raise FleetError(f"{text}, which stays on the ground: raise the act")

    def check_inside(self) -> None:
        """Refuse homes, ends of the climb and points of acts outside of the room, or beyond margins of the fence."""
        if self.room is not None and not np.less(*self.room).all():
            raise FleetError("the first corner of the room is not below the second in x, y and z: exchange what is not")
        places = [("home", self.home), ("the end of take_off", self.above[: self.flying])]
        for name, points in (*places, *((f"act {act.name!r}", act.points) for act in self.formations)):
            if self.room is not None:
                out = np.maximum(self.room[0] - points, points - self.room[1]).max(axis=1)
                if out.max() > EXACT:
                    text = f"point {int(out.argmax())} of {name} is {out.max():.3g} m outside of the room"
                    raise FleetError(f"{text}: move it, or give it more room")
            away = np.zeros((1, 1)) if self.fence is None else self.fence.walls_of(points)
            if away.min() < -EXACT:
                point, wall = (int(i) for i in np.unravel_index(int(away.argmin()), away.shape))
                text = f"point {point} of {name} is {-away.min():.3g} m beyond the margin of wall {wall} of the fence"
                raise FleetError(f"{text}: move it, or make the fence larger")

    def _check_times(self) -> None:
        """Refuse times that are none, and acts at instants that do not ascend."""
        times = [
            ("take_off", self.take_off),
            ("the layer of take_off", self.layer or 0.0),
            ("the wait before take_off", self.wait or 0.0),
        ]
        for act in self.formations:
            times += [(f"hold of act {act.name!r}", act.hold), (f"at of act {act.name!r}", act.at or 0.0)]
            times.append((f"seconds of act {act.name!r}", 1.0 if act.seconds is None else act.seconds))
            if act.seconds == 0.0:
                raise FleetError(f"the flight to act {act.name!r} lasts 0 s: give it some")
            if act.delays is not None:
                if act.delays.shape != (len(act.points),):
                    text = f"act {act.name!r} has {len(act.delays)} delays for {len(act.points)} vehicles"
                    raise FleetError(f"{text}: give one for each, or how long after each the next leaves")
                times += [(f"a delay of act {act.name!r}", float(delay)) for delay in act.delays]
            times += [(f"a change of the lights of act {act.name!r}", change.after) for change in act.lights]
            if (np.diff([change.after for change in act.changes]) < 0.0).any():
                raise FleetError(f"the changes of the lights of act {act.name!r} are not in the order of their times")
            if act.yaw is not None and np.shape(act.yaw) not in ((), (len(act.points),)):
                raise FleetError(f"act {act.name!r} has {np.size(act.yaw)} headings: give one, or one for each point")
        for name, value in times:
            if not 0.0 <= value <= LONGEST:
                raise FleetError(f"{name} is {value}: give a number from 0 to {LONGEST:g}")
        _check_order(self.acts, None)


def _check_order(acts: Sequence[Act | Groups], before: Act | None) -> Act | None:
    """Refuse acts at instants that do not ascend, after another; return the last one that is at an instant."""
    for act in acts:
        if isinstance(act, Groups):
            last = [_check_order(group.acts, before) for group in act.groups]
            timed = [each for each in last if each is not None]
            before = max(timed, key=lambda each: each.at or 0.0, default=None)
        elif act.at is not None:
            if before is not None and act.at < (before.at or 0.0) + before.hold:
                text = f"act {act.name!r} is at {act.at:g} s, and act {before.name!r} lasts until"
                raise FleetError(f"{text} {(before.at or 0.0) + before.hold:g} s: acts are in the order of their times")
            before = act
    return before
