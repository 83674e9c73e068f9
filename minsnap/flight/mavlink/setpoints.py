"""Setpoints for SET_POSITION_TARGET_LOCAL_NED: rows in the vehicle's z-down frame, with what offsets drag and delay.

Drag is offset through the acceleration. A lead, which offsets the delay, shifts the whole flight: the first setpoint is
sent ``lead`` before the instant that it is planned for, so that a path that begins at rest still does, and nothing of
it is left out. Where the vehicle is to be at an instant is where the setpoint sent ``lead`` before it was; every
distance to the plan is measured there.

Setpoints change while they are flown: from a splice on they are those of another trajectory.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import takewhile
from typing import Any, ClassVar

import numpy as np

from minsnap.basics.arrays import FloatArray, OwnsArrays, interpolated
from minsnap.basics.checks import check_number
from minsnap.basics.messages import shown
from minsnap.errors import FlightError, InputError, TimingError
from minsnap.files import get_frame, map_samples, map_vectors
from minsnap.flight.mavlink.link import check_setpoint_rate
from minsnap.flight.mavlink.vehicle_messages import Message, Vector, VehicleState, load_dialect
from minsnap.flight.simulation.flight_inputs import drag_feed_forward
from minsnap.trajectory import Samples, Trajectory, sample_times, wrap
from minsnap.vehicle import Quadrotor


@dataclass(frozen=True)
class SetpointSettings:
    """What is no lead, and what is no joint of changes or of laps.

    Parameters
    ----------
    lead : float
        A lead beyond this is no delay of a vehicle that flies well [s].
    distance : float
        Greatest distance between the start of a change and the setpoint at that instant [m].
    jump : float
        By how much the velocity that it begins with may differ from theirs, and that of a lap's end from its start's
        [m/s].
    gap : float
        Greatest distance between the end of a lap and its start [m].
    upright : float
        Way aside up to which a climb is straight [m].
    turn : float
        Greatest angle between their headings, but for whole turns [rad]: 3 degrees, which a vehicle that turns at
        1 rad/s covers in the 50 ms between two setpoints.
    """

    lead: float = 1.0
    distance: float = 0.02
    jump: float = 0.1
    gap: float = 0.01
    upright: float = 0.1
    turn: float = 0.05


ALLOWED = SetpointSettings()


@dataclass(frozen=True)
class FeedForward:
    """Drag and lead time to add to the setpoints of a file.

    Parameters
    ----------
    drag : float
        Deceleration by drag for each m/s of speed [1/s]: linear drag divided by mass.
    vehicle : Quadrotor or None
        A vehicle whose own drag is offset instead.
    lead : float
        How much earlier each setpoint is sent, to offset the delay of the vehicle's response [s].

    Raises
    ------
    InputError
        If the drag is negative or not finite, both are set, or the lead is not between 0 and 1 s.
    """

    drag: float = 0.0
    vehicle: Quadrotor | None = None
    lead: float = 0.0

    def __post_init__(self) -> None:
        check_number("the drag", self.drag, 0.0, math.inf, "it must be 0 or more", unit="1/s")
        if self.drag and self.vehicle is not None:
            raise InputError("a drag and a vehicle exclude each other, since the vehicle has its own drag: give one")
        check_number("the lead", self.lead, 0.0, ALLOWED.lead, f"it must be between 0 and {ALLOWED.lead:g} s", unit="s")

    @property
    def active(self) -> bool:
        """Whether anything is added."""
        return bool(self.drag) or self.vehicle is not None or bool(self.lead)

    def applied(self, samples: Samples) -> Samples:
        """Return the samples as they are sent: as stated, with the feed-forward added to the acceleration."""
        return self.stated(samples).commanded()

    def stated(self, samples: Samples) -> Samples:
        """Return samples in space with what offsets drag stated as their feed-forward, and the lead stated as theirs.

        Raises
        ------
        InputError
            If drag is to be offset and the samples have no velocity, or state their feed-forward or lead already.
        """
        if self.lead and samples.lead:
            raise InputError(f"the file states its lead already ({samples.lead:g} s): leave the lead out")
        return replace(self._compensated(samples), lead=samples.lead + self.lead) if self.active else samples

    def _compensated(self, samples: Samples) -> Samples:
        if not self.drag and self.vehicle is None:
            return samples
        if samples.feed_forward is not None:
            raise InputError("the file states its feed-forward already: leave the drag and the vehicle out")
        if samples.velocity is None:
            raise InputError("the file has no velocity, so its drag is not known")
        extra = self.drag * samples.velocity if self.vehicle is None else drag_feed_forward(self.vehicle, samples)
        return replace(samples, feed_forward=np.asarray(extra))

    def describe(self, samples: Samples) -> str:
        """Return a text that says what is added to samples."""
        parts = []
        feed_forward = self._compensated(samples).feed_forward
        if feed_forward is not None:
            most = float(np.linalg.norm(feed_forward, axis=1).max())
            parts.append(f"drag offset by up to {most:.2f} m/s²")
        if self.lead or samples.lead:
            parts.append(f"setpoints sent {1e3 * (self.lead or samples.lead):g} ms ahead")
        return " and ".join(parts)


FIELDS = {"position": 0b111, "velocity": 0b111 << 3, "acceleration": 0b111 << 6, "yaw": 1 << 10, "yaw_rate": 1 << 11}
"""What a setpoint can hold, and the bits of the type mask that say to ignore it (MAVLink, POSITION_TARGET_TYPEMASK)."""


@dataclass(frozen=True)
class Setpoint:
    """One setpoint in the vehicle's local z-down frame; ignored fields are 0.

    Parameters
    ----------
    position, velocity, acceleration : tuple of 3
        [m], [m/s], [m/s^2].
    yaw, yaw_rate : float
        In [-pi, pi] [rad], [rad/s].
    """

    position: Vector
    velocity: Vector = (0.0, 0.0, 0.0)
    acceleration: Vector = (0.0, 0.0, 0.0)
    yaw: float = 0.0
    yaw_rate: float = 0.0

    @property
    def numbers(self) -> tuple[float, ...]:
        """Position, velocity, acceleration, yaw and its rate in one row."""
        return (*self.position, *self.velocity, *self.acceleration, self.yaw, self.yaw_rate)

    def held(self, position: Vector | None = None) -> Setpoint:
        """Return the setpoint at rest at this or another position, with the same heading."""
        return Setpoint(self.position if position is None else position, yaw=self.yaw)

    def shifted(self, offset: Vector) -> Setpoint:
        """Return the setpoint with its position moved."""
        x, y, z = (a + b for a, b in zip(self.position, offset, strict=True))
        return replace(self, position=(x, y, z))


def type_mask(fields: Sequence[str]) -> int:
    """Return the ignore bits for a setpoint that holds these fields."""
    return sum(bits for name, bits in FIELDS.items() if name not in fields)


def setpoint_message(setpoint: Setpoint, mask: int, vehicle: VehicleState, milliseconds: int) -> Message:
    """SET_POSITION_TARGET_LOCAL_NED to the vehicle."""
    dialect, now = load_dialect(), milliseconds & 0xFFFFFFFF
    to = (vehicle.system, vehicle.component, dialect.MAV_FRAME_LOCAL_NED)
    return dialect.MAVLink_set_position_target_local_ned_message(now, *to, mask, *setpoint.numbers)


@dataclass(frozen=True, eq=False)
class SetpointTable(OwnsArrays):
    """The setpoints of a flight, one row per step.

    Parameters
    ----------
    rows : ndarray, shape (m, 11)
        Position, velocity, acceleration, yaw, yaw rate in the vehicle's z-down frame; fields not held are 0.
    rate : float
        Rows per second [Hz].
    fields : tuple of str
        What is held, in the order of :data:`FIELDS`.
    missing : tuple of str
        What was requested and the source does not have.
    laps : int
        How often the rows are flown; the last row of a lap is the first of the next.
    note : str
        What is added to the source's setpoints, and how fast they begin and end, in words.
    frame : str
        The vehicle's frame: ``ned`` or ``frd``.
    lead : float
        How much earlier than planned each row is sent [s].
    added : ndarray, shape (m, 3), or None
        What of the acceleration is no motion but thrust, to offset drag [m/s^2].
    began : float
        Instant of the flight at which the trajectory flown now has its time 0 [s].
    """

    rows: FloatArray
    rate: float
    fields: tuple[str, ...]
    missing: tuple[str, ...] = ()
    laps: int = 1
    note: str = ""
    frame: str = "ned"
    lead: float = 0.0
    added: FloatArray | None = None
    began: float = 0.0
    stays: ClassVar[bool] = False

    def motion(self) -> SetpointTable:
        """Return the table of the motion alone, without what is added to offset drag."""
        if self.added is None:
            return self
        rows = self.rows.copy()
        rows[:, 6:9] -= self.added
        return replace(self, rows=rows, added=None)

    def __len__(self) -> int:
        return (len(self.rows) - 1) * self.laps + 1

    @property
    def mask(self) -> int:
        """The type mask of every row."""
        return type_mask(self.fields)

    @property
    def start(self) -> Setpoint:
        """The setpoint at rest at the first row's position and heading."""
        return self[0].held()

    def __getitem__(self, index: int) -> Setpoint:
        """Return the setpoint of a step; beyond the last it is the last."""
        lap = len(self.rows) - 1
        row = self.rows[-1 if index >= lap * self.laps else index % lap].tolist()
        return Setpoint(tuple(row[0:3]), tuple(row[3:6]), tuple(row[6:9]), row[9], row[10])

    @property
    def speed(self) -> float:
        """Greatest speed from row to row [m/s]."""
        return float(np.linalg.norm(np.diff(self.rows[:, :3], axis=0), axis=1).max(initial=0.0)) * self.rate

    @property
    def climb(self) -> float:
        """How high the path climbs straight up before it goes anywhere else [m]; 0 where it does not."""
        away = np.linalg.norm(self.rows[:, :2] - self.rows[0, :2], axis=1) > ALLOWED.upright
        straight = self.rows[: int(np.argmax(away)) if away.any() else len(self.rows), 2]
        return max(0.0, float(straight[0] - straight[-1] if away.any() else straight[0] - straight.min()))

    def lifted(self, height: float) -> SetpointTable:
        """Return the table begun so much higher, at most half of its climb [m], and as it was from twice that on.

        With the height L of the lift, T the time at which the climb has reached 2 L, and S the quintic from 0 to 1 with
        two derivatives of 0 at both ends, L (1 - S(t / T)) is added to the height.
        """
        rows = self.rows.copy()
        steps = int(np.argmax(rows[0, 2] - rows[:, 2] >= 2.0 * height * (1.0 - 1e-9)))
        time = steps / self.rate
        rise, slope, bend = _quintic(np.minimum(np.arange(len(rows)) / max(steps, 1), 1.0))
        rows[:, 2] -= height * (1.0 - rise)
        rows[:, 5] += height * slope / time * ("velocity" in self.fields)
        rows[:, 8] += height * bend / time**2 * ("acceleration" in self.fields)
        return replace(self, rows=rows)

    def planned(self, step: float) -> Vector:
        """Return where the vehicle is to be while a step is sent: where the step sent ``lead`` before is [m]."""
        at = max(step - self.lead * self.rate, 0.0)
        before, after = self[int(at)].position, self[int(at) + 1].position
        x, y, z = (a + (at - int(at)) * (b - a) for a, b in zip(before, after, strict=True))
        return x, y, z


def _quintic(u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the quintic from 0 to 1 that is flat at both ends, and its two derivatives."""
    return u**3 * (10.0 - 15.0 * u + 6.0 * u**2), 30.0 * (u * (1.0 - u)) ** 2, 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u)


def tabulate(
    samples: Samples, rate: float | None = None, fields: Sequence[str] | None = None, frame: str = "ned", laps: int = 1
) -> SetpointTable:
    """Convert samples to a table of setpoints.

    Parameters
    ----------
    samples : Samples
        Three coordinates, in z-up world axes; feed-forward is added to the acceleration.
    rate : float or None
        Setpoints a second [Hz]; None and the samples' own rate send each sample as it is, another rate interpolates
        with all the derivatives there are.
    fields : sequence of str or None
        Which of position, velocity, acceleration, yaw and yaw_rate to send; None for all there are.
    frame : str
        The vehicle's local frame: ``ned`` where the world's x is east, ``frd`` where it is the room's forward.
    laps : int
        How often to fly it; more than once needs an end that is the start.

    Raises
    ------
    InputError, TimingError, FrameError
        If a field does not exist, positions are left out, acceleration goes without velocity, the rate is not positive,
        or laps do not close: in position, in velocity, and in the yaw that is sent, but for whole turns.
    """
    wanted = _check_fields(fields)
    frame = vehicle_frame(frame)
    stated = _resampled(map_samples(samples, "enu", frame), rate)
    flown = stated.commanded()
    known = tuple(name for name in wanted if getattr(flown, name) is not None)
    held = known if "velocity" in known else tuple(name for name in known if name != "acceleration")
    missing = tuple(name for name in wanted if name not in (known if fields is None else held))
    _check_laps(flown, laps, turns="yaw" in held)
    rows = np.concatenate([_column(flown, name, name in held) for name in FIELDS], axis=1)
    feed_forward = stated.feed_forward if "acceleration" in held else None
    rate = samples.rate if rate is None else float(rate)
    return SetpointTable(rows, rate, held, missing, laps, frame=frame, lead=samples.lead, added=feed_forward)


def _check_fields(fields: Sequence[str] | None) -> tuple[str, ...]:
    """Return the fields in their order, or raise an error that names the impossible one."""
    if fields is None:
        return tuple(FIELDS)
    unknown = [name for name in fields if name not in FIELDS]
    if unknown:
        raise InputError(f"no setpoint field is called {shown(unknown[0])}: choose from {', '.join(FIELDS)}")
    if "position" not in fields:
        raise InputError("position must be among the fields: holding and every safety rule need it")
    if "acceleration" in fields and "velocity" not in fields:
        raise InputError("acceleration without velocity is not followed by the autopilots: add velocity to the fields")
    return tuple(name for name in FIELDS if name in fields)


def vehicle_frame(name: str) -> str:
    """Return the z-down frame that belongs to a frame: ``ned`` for enu and ned, ``frd`` for those of a room."""
    return "ned" if get_frame(name).name in ("enu", "ned") else "frd"


def _column(samples: Samples, name: str, held: bool) -> FloatArray:
    """One field as columns; headings are wrapped into [-pi, pi], which is what PX4's message asks for."""
    values = getattr(samples, name)
    width = 1 if name.startswith("yaw") else 3
    if not held or values is None:
        return np.zeros((len(samples), width))
    if name == "yaw":
        values = np.where(np.abs(values) <= math.pi, values, wrap(values))
    return np.asarray(values, dtype=np.float64).reshape(len(samples), width)


def _check_laps(samples: Samples, laps: int, turns: bool) -> None:
    """Refuse laps whose end is not their start, in place, velocity and, where ``turns``, heading."""
    if laps < 1:
        raise InputError(f"laps is {laps}: it must be 1 or more")
    if laps == 1:
        return
    gap = math.dist(samples.position[0], samples.position[-1])
    if gap > ALLOWED.gap:
        raise InputError(f"the end is {gap:.3g} m from the start: only a path that closes can be flown {laps} times")
    if samples.velocity is not None and math.dist(samples.velocity[0], samples.velocity[-1]) > ALLOWED.jump:
        raise InputError(f"the end is not at the start's velocity: it cannot be flown {laps} times without a jerk")
    turn = math.remainder(samples.yaw[-1] - samples.yaw[0], math.tau) if turns and samples.yaw is not None else 0.0
    if abs(turn) > ALLOWED.turn:
        text = f"the heading at the end is {abs(turn):.3g} rad from that at the start: it cannot be flown {laps} times"
        raise InputError(f"{text} without a jerk; close it, or leave yaw out of the fields")


def _resampled(samples: Samples, rate: float | None) -> Samples:
    """Return the samples at another rate, by Hermite interpolation of position and its derivatives."""
    if rate is None or abs(samples.rate - check_setpoint_rate(rate)) <= 1e-6 * rate:
        return samples
    from scipy.interpolate import BPoly

    grid = sample_times(samples.duration, rate)
    inside = np.minimum(samples.t[0] + grid, samples.t[-1])
    quantities: dict[str, Any] = {}
    for names in HERMITE:
        known = list(takewhile(lambda name: getattr(samples, name) is not None, names))
        if known:
            states = list(zip(*(getattr(samples, name) for name in known), strict=True))
            curve = BPoly.from_derivatives(samples.t, states)
            quantities |= {name: curve(inside, order) for order, name in enumerate(known)}
    if samples.feed_forward is not None:
        quantities["feed_forward"] = interpolated(inside, samples.t, samples.feed_forward)
    return Samples(grid, **quantities, lead=samples.lead)


HERMITE = (("position", "velocity", "acceleration"), ("yaw", "yaw_rate"))
"""Quantities, each with the derivatives that it is interpolated with."""

NOTHING = FeedForward()
"""Adds nothing to setpoints."""


Exchange = tuple[SetpointTable, SetpointTable]
"""What was flown when an exchange was prepared, and what is to be flown."""


class ChangingTable:
    """A table of setpoints whose rest can be exchanged.

    It is read like a :class:`~minsnap.flight.mavlink.setpoints.SetpointTable`; one assignment exchanges everything: a
    reader never sees half of a change.

    Parameters
    ----------
    table : SetpointTable
        What is flown at first.
    added : FeedForward
        What is added to the setpoints.
    stays : bool
        Whether the flight stays at the end of what is flown, for changes to come. It may be set to False in flight.
    """

    def __init__(self, table: SetpointTable, feed_forward: FeedForward = NOTHING, stays: bool = False) -> None:
        self._flown, self._added, self.stays = table, feed_forward, stays
        self.rate, self.fields, self.missing, self.mask = table.rate, table.fields, table.missing, table.mask
        self.start, self.note, self.frame, self.lead = table.start, table.note, table.frame, table.lead

    def __len__(self) -> int:
        return len(self._flown)

    def __getitem__(self, index: int) -> Setpoint:
        """Return the setpoint of a step; beyond the last it is the last, at rest."""
        table = self._flown
        return table[index] if index < len(table) else table[index].held()

    def fly_motion_alone(self) -> bool:
        """Leave out what is added to offset drag, before the flight; return whether there was any."""
        before = self._flown
        self._flown, self._added = before.motion(), NOTHING
        return before.added is not None

    @property
    def climb(self) -> float:
        """How high the path climbs straight up first [m]."""
        return self._flown.climb

    def begin_lifted(self, height: float) -> None:
        """Begin so much higher, before the flight (:meth:`SetpointTable.lifted`).

        Raises
        ------
        InputError
            If several laps are flown.
        """
        if self._flown.laps > 1:
            raise InputError(
                f"{self._flown.laps} laps that each begin on the ground: ArduPilot takes off once, fly one"
            )
        self._flown = self._flown.lifted(height)
        self.start = self._flown.start

    def planned(self, step: float) -> Vector:
        """Return where the vehicle is to be while a step is sent [m]."""
        return self._flown.planned(step)

    @property
    def began(self) -> float:
        """Instant of the flight at which the trajectory flown now had its time 0 [s]."""
        return self._flown.began

    def prepare(self, trajectory: Trajectory, splice: float) -> Exchange:
        """Make the setpoints of a trajectory from a splice on.

        Parameters
        ----------
        trajectory : Trajectory
            Its time 0 is the splice.
        splice : float
            On the clock of the trajectory that is flown now [s].

        Raises
        ------
        TimingError
            If the splice lies beyond the end of what is flown.
        FlightError
            If the trajectory does not begin where the setpoints are at the splice.
        InputError
            If it has other coordinates, or several laps are flown.
        """
        table, at = self._flown, self._flown.began + splice
        self._check(table, trajectory, at)
        first = max(math.ceil(at * self.rate - 1e-9), 0)
        rows = self._rows(trajectory, first / self.rate - at)
        kept = table.rows[np.minimum(np.arange(first), len(table.rows) - 1)]
        return table, replace(table, rows=np.concatenate((kept, rows)), began=at)

    def exchange(self, exchange: Exchange, elapsed: float) -> None:
        """Fly what was prepared, from its splice on; ``elapsed`` is the time of the flight now [s].

        Raises
        ------
        TimingError
            If the splice has passed.
        FlightError
            If something else is flown since it was prepared.
        """
        before, after = exchange
        late = elapsed - after.began
        if late > 0.0:
            when = f"at {after.began:.6g} s of the flight, {late:.3g} s ago"
            raise TimingError(f"the change takes over {when}: it is too late")
        if before is not self._flown:
            raise FlightError("another change was taken over meanwhile: replan from what is flown now")
        self._flown = after

    def _rows(self, trajectory: Trajectory, begin: float) -> FloatArray:
        """Rows of the setpoints from an instant of a trajectory on, its end state last."""
        steps = max(math.ceil((trajectory.duration - begin) * self.rate - 1e-9), 1)
        t = np.arange(steps + 1) / self.rate
        inside = np.clip(begin + t, 0.0, trajectory.duration)
        motion: dict[str, Any] = {name: trajectory(inside, order) for order, name in enumerate(HERMITE[0])}
        samples = Samples(t, **motion, yaw=trajectory.yaw(inside), yaw_rate=trajectory.yaw(inside, 1))
        return tabulate(self._added.applied(samples), None, self.fields, self.frame).rows

    def _check(self, table: SetpointTable, trajectory: Trajectory, at: float) -> None:
        if table.laps > 1:
            raise InputError(f"{table.laps} laps are flown: a flight that changes has one")
        if trajectory.dim != 3:
            raise InputError(f"a vehicle flies in three coordinates, this trajectory has {trajectory.dim}")
        end = (len(table) - 1) / self.rate
        if at > end + 1.0 / self.rate and not self.stays:
            raise TimingError(f"the change takes over at {at:.6g} s, after the flight ends at {end:.6g} s: plan anew")
        self._check_joint(table, trajectory, at)

    def _check_joint(self, table: SetpointTable, trajectory: Trajectory, at: float) -> None:
        """Compare the start of a trajectory with the setpoints there, between two steps by their derivatives."""
        step = math.floor(at * self.rate + 1e-9)
        setpoints = [table[step + k] for k in (0, 1)]
        (a, b), (u, v) = np.array([s.position for s in setpoints]), np.array([s.velocity for s in setpoints])
        share = at * self.rate - step
        position = _hermite(a, b, u / self.rate, v / self.rate, share)
        velocity = u + share * (v - u)
        begin, speed = map_vectors([trajectory(0.0), trajectory(0.0, 1)], "enu", self.frame)
        gap, jump = float(np.linalg.norm(begin - position)), float(np.linalg.norm(speed - velocity))
        if gap > ALLOWED.distance:
            wrong = f"{gap:.3g} m from the setpoint at its splice"
        elif "velocity" in self.fields and jump > ALLOWED.jump:
            wrong = f"{jump:.3g} m/s off the velocity flown then"
        else:
            return
        raise FlightError(f"the change begins {wrong}: replan from what is flown")


def _hermite(a: FloatArray, b: FloatArray, u: FloatArray, v: FloatArray, s: float) -> FloatArray:
    """Position between two, with their derivatives over the step; SciPy's takes too long to import in flight."""
    cubic = (2 * s**3 - 3 * s**2 + 1) * a + (s**3 - 2 * s**2 + s) * u + (3 * s**2 - 2 * s**3) * b + (s**3 - s**2) * v
    return np.asarray(cubic)


Setpoints = SetpointTable | ChangingTable
"""What a stream flies, whether it can change or not."""
