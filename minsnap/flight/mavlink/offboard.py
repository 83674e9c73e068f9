"""Flights of a path, samples, a file or a whole fleet over MAVLink, and orders to a flight, as lines of JSON.

Orders are new goals, gates and stops, each planned from what is flown, and answered.
``{"goal": [x, y, z]}`` or ``{"waypoints": [...]}``, points and gates as in a course file, are all that is still to be
flown; ``"yaw"`` beside them is one heading for each [rad]. ``"stop"`` leads to hover by the certified stop,
``"finish"`` ends the flight at the end of what is flown. An ``"id"`` comes back with the answer.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, numbers
from minsnap.basics.messages import finite, shown
from minsnap.basics.storage.text import FileName
from minsnap.corridors import Gate, Room, center_of, gate_passages
from minsnap.errors import FlightError, InputError, MinsnapError, TimingError
from minsnap.files import ConsistencyReport, check_samples, frame_of, in_space, map_samples
from minsnap.fleet import Separation
from minsnap.flight.mavlink.changed_flight import BUDGETS, ChangeableFlight, ChangedFlight
from minsnap.flight.mavlink.fleet_ways import judge_of_ways
from minsnap.flight.mavlink.link import Clock, CommonFlight, Link, open_link
from minsnap.flight.mavlink.observer import EventCallback, StatusCallback
from minsnap.flight.mavlink.sender import undisturbed
from minsnap.flight.mavlink.setpoints import SetpointTable, tabulate
from minsnap.flight.mavlink.stream_options import StreamOptions, StreamReport
from minsnap.flight.mavlink.streaming import Streamer
from minsnap.limits import Limits
from minsnap.paths.missions import stop_of
from minsnap.replanning import Change, Replanner
from minsnap.trajectory import Path, Samples, Trajectory


def stream(
    source: Samples | Path | FileName,
    connect: str | Link,
    options: StreamOptions | None = None,
    *,
    clock: Clock | None = None,
    on_event: EventCallback | None = None,
    on_status: StatusCallback | None = None,
    **changes: Any,
) -> StreamReport:
    """Fly a path, samples or a setpoint file over MAVLink.

    Parameters
    ----------
    source : Path, Samples or path of a setpoint CSV
        In z-up world axes; a file in its own.
    connect : str or Link
        A connection string (:func:`~minsnap.flight.mavlink._transports.open_transport`), or an open link, which
        stays open.
    options : StreamOptions, optional
        How; each of its fields is also a keyword.
    clock : Clock, optional
        Monotonic time by default; that of the link if ``connect`` is a link.
    on_event, on_status : callable, optional
        See :class:`~minsnap.flight.mavlink.streaming.Streamer`.

    Returns
    -------
    StreamReport

    Raises
    ------
    FlightError
        If the setpoints are not consistent, the start is too far, or a rule stopped the flight.
    LinkError
        If the port cannot be opened or no vehicle answers.
    ImportError
        If pymavlink is not installed.
    """
    options = replace(options or StreamOptions(), **changes)
    clock = clock or Clock()
    table = prepare(source, options)
    link = connect if isinstance(connect, Link) else open_link(connect, clock)
    try:
        return Streamer(table, link, options, clock, on_event, on_status).run()
    finally:
        if link is not connect:
            link.close()


def prepare(source: Samples | Path | FileName, options: StreamOptions) -> SetpointTable:
    """Read and check what is to be flown, and tabulate it as setpoints.

    Raises
    ------
    FlightError
        If the samples are not consistent with themselves; says how.
    InputError
        If what is to be added to them cannot be.
    """
    samples, frame = sampled(source, options)
    report = check_samples(map_samples(in_space(samples), "enu", frame))  # faults are of the columns of the file
    if not report.ok:
        raise FlightError(f"not fit to fly: {report.problems[0]}")
    table = tabulate(options.feed_forward.stated(samples), options.rate, options.fields, frame, options.laps)
    options.check_rate(table.rate)
    notes = (*report.notes, options.feed_forward.describe(samples), _at_speed(samples, report))
    return replace(table, note="; ".join(filter(None, notes)))


def _at_speed(samples: Samples, report: ConsistencyReport) -> str:
    """Say that a path begins or ends at speed, where the vehicle is held at rest."""
    if samples.velocity is None:
        return ""
    speeds = np.linalg.norm(samples.velocity[[0, -1]], axis=1)
    ends = zip(("begins", "ends"), speeds, (report.starts_at_rest, report.ends_at_rest), strict=True)
    moving = [f"{verb} at {speed:.2g} m/s" for verb, speed, rest in ends if not rest]
    return f"the path {' and '.join(moving)}, where the vehicle is held at rest" if moving else ""


def sampled(source: Samples | Path | FileName, options: StreamOptions) -> tuple[Samples, str]:
    """Return the source as samples in z-up world axes, and its frame."""
    rate = 20.0 if options.rate is None else options.rate
    if isinstance(source, (Samples, Path)):
        return source.sample(rate), options.frame or "enu"
    from minsnap.files import frame_for, read_samples

    own = frame_for(source, options.frame)  # of other formats it is the vehicle's alone
    return read_samples(source, own, rate), frame_of(source, options.frame) or "enu"


def stream_together(
    tables: Sequence[SetpointTable],
    links: Sequence[Link],
    options: Sequence[StreamOptions],
    names: Sequence[str],
    clock: Clock,
    on_event: Callable[[str], None] | None = None,
    on_status: StatusCallback | None = None,
    begun: Callable[[Callable[[], None]], None] = lambda stop: None,
    separation: Separation | None = None,
) -> list[StreamReport | FlightError]:
    """Fly several vehicles, each over its own link, from one instant on; what stops one stops all where they are.

    Nothing is sent before all have told where they stand, and their ways to the starts are proved apart.

    Parameters
    ----------
    tables, links, options, names : sequence
        One each a vehicle; options with a callable trigger, the first of which lets all go.
    clock : Clock
        The same as the links'.
    on_event : callable, optional
        Told sentences, each begun by the vehicle's name, from several threads.
    on_status : callable, optional
        Called with the status of the first vehicle.
    begun : callable, optional
        Called with what stops all, before they fly.
    separation : Separation, optional
        How far apart all must be on their ways to their starts, and as they land; not asked of flights that begin where
        their vehicles are, each in a frame of its own.

    Returns
    -------
    list
        What each flight reports, or the error that ended it.

    Raises
    ------
    InputError
        If the rates differ.
    """
    rates = {table.rate for table in tables}
    if len(rates) > 1:
        raise InputError(f"the setpoints of a fleet have one rate, and these have {sorted(rates)}: give --rate")
    trigger = options[0].trigger
    judge = judge_of_ways(separation, tables, names, land=options[0].land)
    common = CommonFlight(names, clock, rates.pop(), trigger if callable(trigger) else lambda: True, links, judge)

    def said(name: str) -> Callable[[str], None] | None:
        return None if on_event is None else lambda text: on_event(f"{name}: {text}")

    flights = [
        Streamer(table, link, option, clock, said(name), None if k else on_status, common=(common, k))
        for k, (table, link, option, name) in enumerate(zip(tables, links, options, names, strict=True))
    ]

    def stop() -> None:
        for flight in flights:
            flight.stop()

    begun(stop)

    def fly(flight: Streamer, member: int) -> StreamReport | FlightError:
        try:
            return flight.run()
        except BaseException as error:
            common.tell(member, False, str(error))
            if isinstance(error, FlightError):
                return error
            raise

    with undisturbed(type(clock) is Clock) as granted, ThreadPoolExecutor(len(flights)) as pool:
        if granted and on_event is not None:
            on_event(granted)
        return [future.result() for future in [pool.submit(fly, flight, k) for k, flight in enumerate(flights)]]


PASSED_WITHIN = 1e-6
"""How near a plan passes what was ordered, where it was followed [m]."""

SHORT = ("stop", "finish")
"""Orders that are one word."""

KINDS = ("goal", "waypoints", *SHORT)
"""All orders."""

_WANTED = "give one of goal, waypoints, stop and finish; id beside it, and yaw beside goal or waypoints"


class Orders(ChangedFlight):
    """Plans what is ordered and hands it to the flight.

    Parameters
    ----------
    flight : ChangeableFlight
        That flies ``flown``.
    flown : Trajectory
        What is flown at first.
    limits : Limits
        Which all changes keep.
    room : Room, optional
        Which all changes stay in.
    replanner : Replanner, optional
        In place of one with these limits and this room.
    """

    def __init__(
        self,
        flight: ChangeableFlight,
        flown: Trajectory,
        limits: Limits,
        room: Room | None = None,
        replanner: Replanner | None = None,
    ) -> None:
        super().__init__(flight, flown, limits)
        self._replanner = replanner or Replanner(limits, room=room)

    def answers(self, lines: Sequence[str]) -> Iterator[str]:
        """Answer lines one after the other."""
        return map(self.answer, lines)

    def quiet(self) -> str | None:
        """Nothing is to be done while nothing is ordered."""
        return None

    def ended(self) -> None:
        """End the flight where its plan does, for no more orders come."""
        self._flight.finish()

    def answer(self, line: str) -> str:
        """Follow the order of a line and return the answer to it, a line of JSON.

        Whatever is wrong with an order is an answer too, so that the next one is read.

        Raises
        ------
        EOFError, OSError
            If the flight is over and cannot be reached any more.
        """
        named: dict[str, Any] = {}
        try:
            order = _order_of(line)
            named = _named(order)
            reply = {"ok": True, **self._followed(_kind_of(order), order)}
        except (EOFError, OSError):
            raise
        except Exception as error:
            reply = {"ok": False, "error": str(error)}
        return json.dumps({**named, **finite(reply)}, allow_nan=False)  # null for what is not finite, as JSON has none

    def _followed(self, kind: str, order: dict[str, Any]) -> dict[str, Any]:
        if kind == "finish":
            self._flight.finish()
            return {"finish": True}
        if kind == "stop":
            return self._stopped()
        ways = _ways(order)
        places = [place for way in ways for place in way]
        points = np.array(list(map(center_of, places)))
        yaw = None if "yaw" not in order else _headings(order["yaw"], ways)
        return self._changed(points, yaw, [place for place in places if isinstance(place, Gate)])

    def _stopped(self) -> dict[str, Any]:
        """Fly the certified stop; where there is none, hold."""
        now = self._now()
        if now > self._flown.duration - BUDGETS[0]:
            return {"duration": 0.0, "note": "it comes to rest here"}
        try:
            change = self._planned(self._stop_from)
        except MinsnapError as error:
            self._flight.stop()
            return {
                "duration": 0.0,
                "certified": False,
                "flown": False,
                "note": f"held, for there is no certified stop: {error}",
            }
        return self._told(change)

    def _stop_from(self, now: float, budget: float) -> Change:
        knots = self._flown.leg_breaks
        ahead = knots[knots > now + budget]
        change = self._replanner.replan(self._flown, now, self._flown(ahead), budget)
        if change.stop is None:
            raise FlightError(change.no_stop)
        return replace(change, trajectory=change.stop, certified=True, kept=False)

    def _changed(self, points: FloatArray, yaw: Any, gates: Sequence[Gate]) -> dict[str, Any]:
        def plan(now: float, budget: float) -> Change:
            change = self._replanner.replan(self._flown, now, points, budget, yaw=yaw)
            if change.certified and not _passes(change.trajectory, points):
                raise TimingError(change.reason)
            _refuse_backwards(change.trajectory, gates)
            return change

        change = self._planned(plan)
        passages = gate_passages(change.trajectory, gates)
        return {**self._told(change), **({"gates": [vars(each) for each in passages]} if gates else {})}


def _order_of(line: str) -> dict[str, Any]:
    try:
        order = json.loads(line)
    except (ValueError, RecursionError):
        order = line.strip()
    order = {order: True} if isinstance(order, str) else order
    if not isinstance(order, dict):
        raise InputError(f"the order is {shown(order)}: {_WANTED}")
    return order


def _named(order: dict[str, Any]) -> dict[str, Any]:
    """Return the id of an order, if it has one, for the answer."""
    named = {"id": order["id"]} if "id" in order else {}
    try:
        json.dumps(named, allow_nan=False)
    except (ValueError, RecursionError):
        raise InputError("the id is no value that JSON can write: give a text or a number") from None
    return named


def _kind_of(order: dict[str, Any]) -> str:
    """Return which order it is, or raise InputError if it is none, or several in one."""
    kinds = [name for name in KINDS if name in order]
    beside = {"id"} if set(kinds) & set(SHORT) else {"id", "yaw"}
    if len(kinds) != 1 or not set(order) <= {*kinds, *beside}:
        raise InputError(f"the order is {shown(order)}: {_WANTED}")
    if kinds[0] in SHORT and order[kinds[0]] is not True:
        raise InputError(f"{kinds[0]} is {shown(order[kinds[0]])}: give true, or the word alone")
    return kinds[0]


def _ways(order: dict[str, Any]) -> list[list[Any]]:
    """Return the place of each entry, in the order of the flight; a gate that is passed straight has points around."""
    entries = [order["goal"]] if "goal" in order else order["waypoints"]
    if not isinstance(entries, list) or not entries:
        raise InputError(f"waypoints are {shown(entries)}: give a list of points and gates, one at least")
    ways: list[list[Any]] = []
    for index, entry in enumerate(entries):
        stop = stop_of(f"waypoint {index}", entry)
        if stop.straight and stop.gate is not None:
            step = stop.gate.crossing * stop.straight * stop.gate.normal
            ways.append([stop.center - step, stop.place, stop.center + step])
        else:
            ways.append([stop.place])
    return ways


def _headings(yaw: Any, ways: Sequence[Sequence[Any]]) -> Any:
    """Return the heading at each place, from one for each entry."""
    angles = numbers(yaw)
    given = None if angles is None else np.atleast_1d(angles)
    if given is None or given.shape != (len(ways),):
        raise InputError(f"yaw is {shown(yaw)}: give one angle [rad] for each of the {len(ways)} waypoints")
    return np.repeat(given, [len(way) for way in ways])


def _passes(curve: Trajectory, points: FloatArray) -> bool:
    knots = curve(curve.leg_breaks[1:])[-len(points) :]
    return len(knots) == len(points) and bool((np.linalg.norm(knots - points, axis=1) < PASSED_WITHIN).all())


def _refuse_backwards(curve: Trajectory, gates: Sequence[Gate]) -> None:
    for passage in gate_passages(curve, gates):
        gate = gates[passage.gate]
        if gate.crossing * float(curve(passage.instant, 1) @ gate.normal) < -PASSED_WITHIN:
            raise InputError(f"gate {passage.gate} would be passed backwards: give it straight, or points around it")
