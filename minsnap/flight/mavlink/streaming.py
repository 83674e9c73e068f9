"""Stream the setpoints of a flight to a vehicle over MAVLink, on schedule and under the safety rules.

Follows the rules of PX4's offboard mode and of ArduPilot's guided mode in their manuals.
"""

from __future__ import annotations

import math
import threading
from dataclasses import replace

from minsnap.errors import FlightError, LinkError
from minsnap.flight.mavlink.link import Clock, CommonFlight, Link
from minsnap.flight.mavlink.observer import EventCallback, StatusCallback, StreamObserver
from minsnap.flight.mavlink.other_senders import OtherSenders
from minsnap.flight.mavlink.sender import SentSetpoint, open_sender, undisturbed
from minsnap.flight.mavlink.sequence import Conditions, Sequence, SetpointStep
from minsnap.flight.mavlink.setpoints import ChangingTable, SetpointTable, setpoint_message
from minsnap.flight.mavlink.start_gate import begins_on_ground
from minsnap.flight.mavlink.stream_options import STREAM, Phase, StreamOptions, StreamReport
from minsnap.flight.mavlink.vehicle_messages import (
    ARDUPILOT,
    Autopilot,
    Message,
    VehicleState,
    get_autopilot,
    rate_request,
)
from minsnap.replanning import Change
from minsnap.trajectory import Trajectory


class Streamer:
    """One flight over one link.

    Parameters
    ----------
    table : SetpointTable
        What to fly.
    link : Link
        To whom.
    options : StreamOptions
        How.
    clock : Clock
        The same as the link's.
    on_event : callable, optional
        Told of everything worth a sentence, as text.
    on_status : callable, optional
        Called with a :class:`~minsnap.flight.mavlink.stream_options.StreamStatus` after every slot. An exception in a
        callback stops the flight like a broken rule and is raised at the end.
    common : (CommonFlight, int), optional
        What it tells the other flights of a fleet, and which of them it is
        (:mod:`minsnap.flight.mavlink.link`).
    """

    def __init__(
        self,
        table: SetpointTable,
        link: Link,
        options: StreamOptions,
        clock: Clock,
        on_event: EventCallback | None = None,
        on_status: StatusCallback | None = None,
        common: tuple[CommonFlight, int] | None = None,
    ) -> None:
        options.check_rate(table.rate)
        self._first = table
        self._table = ChangingTable(table, options.feed_forward, options.stays)
        self._link, self._options, self._clock, self._common = link, options, clock, common
        self._changing = threading.Lock()
        self._observer = StreamObserver(self._table, options, clock.now(), on_event, on_status)
        self._stops = 0
        self._triggered = not callable(options.trigger)
        self._failures: list[Exception] = []
        self._sequence: Sequence | None = None
        self._said = self._hidden = self._left = self._beside = self._wide = False
        self._lift: float | None = None
        self._others = OtherSenders()
        self._foreign: str | None = None

    def stop(self) -> None:
        """Request a stop, from any thread or signal handler.

        The first time stops the flight and holds until the vehicle has left the mode; the second time ends at once.
        """
        self._stops += 1

    def finish(self) -> None:
        """End a flight that stays (``StreamOptions.stays``) at the end of what is flown, from any thread."""
        self._table.stays = False

    @property
    def began(self) -> float:
        """Instant of the flight at which the trajectory flown now has its time 0 [s]."""
        return self._table.began

    @property
    def now(self) -> float | None:
        """Instant on the clock of the trajectory that is flown now [s]; None unless it is flying.

        From any thread; its time 0 is that of the first setpoint, or of the splice of the last change, before which it
        is negative.
        """
        first = self.first
        return None if first is None else max(self._clock.now() - first, 0.0) - self._table.began

    @property
    def first(self) -> float | None:
        """When the first setpoint of the flight was due, on the clock [s]; None unless it is flying."""
        sequence = self._sequence
        slot = None if sequence is None else sequence.first_slot
        return None if slot is None else self._sender.departures.instant(slot)

    def change(self, change: Change) -> Trajectory:
        """Fly a change from its splice on, from any thread: its trajectory if that is certified, else its stop.

        The rules of safety are the same before and after. A setpoint of the first step after the splice may have been
        decided before: both trajectories are equal up to the jerk there, so that they hardly differ yet.

        Parameters
        ----------
        change : Change
            Of the trajectory that is flown now; its splice is on that clock (:attr:`now`).

        Returns
        -------
        Trajectory
            What is flown from then on, to replan from.

        Raises
        ------
        FlightError
            If the vehicle is not flying, the change does not begin where the setpoints are at its splice, or it has
            neither a certified trajectory nor a stop.
        TimingError
            If the splice has passed, by how much, or lies beyond the end of the flight.
        """
        chosen = change.trajectory if change.certified else change.stop
        if chosen is None:
            raise FlightError(f"the change is not certified and has no stop ({change.no_stop}): hold, or land")
        first = self.first
        if first is None:
            raise FlightError("the vehicle is not flying this stream, so there is nothing to change")
        exchange = self._table.prepare(chosen, change.splice)
        with self._changing:
            self._table.exchange(exchange, self._clock.now() - first)
        return chosen

    def run(self) -> StreamReport:
        """Fly, and return when no vehicle follows our setpoints.

        Raises
        ------
        LinkError
            If no vehicle answers.
        FlightError
            If the flight was refused, or stopped by a rule; ``.report`` says how far it had come.
        """
        try:
            autopilot = self._meet()
            self._check_start(autopilot)
            self._stand_apart()
            with undisturbed(type(self._clock) is Clock, within=self._common is not None) as granted:
                if granted and self._common is None:
                    self._say(granted)
                self._fly(autopilot)
        finally:
            self._observer.close()
        return self._conclude()

    def _say(self, text: str) -> None:
        self._observer.say(self._clock.now(), text)

    def _meet(self) -> Autopilot:
        """Wait for the vehicle and its position; send only heartbeats and the request for the position."""
        options = self._options
        vehicle = self._link.wait_for_vehicle(options.wait, lambda: self._stops > 0)
        autopilot = get_autopilot(options.autopilot, vehicle)
        self._say(f"system {vehicle.system} answers ({autopilot.name}, {self._link.address})")
        if options.trigger == "mode" and autopilot.main_mode is None:
            raise LinkError("the vehicle's modes are not known, so entering one cannot be the trigger: use another")
        self._link.send(rate_request(vehicle, "HEARTBEAT", STREAM.heartbeat_rate))
        if vehicle.autopilot != ARDUPILOT:  # which sends its heartbeats as often, and has no such message
            self._link.send(rate_request(vehicle, "CURRENT_MODE", STREAM.mode_rate))
        for name in ("EXTENDED_SYS_STATE", "POSITION_TARGET_LOCAL_NED"):
            self._link.send(rate_request(vehicle, name, STREAM.state_rate))
        self._link.send(rate_request(vehicle, "LOCAL_POSITION_NED", STREAM.position_rate))
        self._wait_for_position(vehicle)
        self._expect_lag(autopilot)
        self._suit(autopilot)
        return autopilot

    def _suit(self, autopilot: Autopilot) -> None:
        """Leave out what makes this autopilot worse, and say so."""
        if not autopilot.thrust and self._table.fly_motion_alone():
            self._say(
                "ArduPilot takes the acceleration of a setpoint for motion, not for thrust, and offsets drag itself: "
                "the feed-forward is left out"
            )
        if self._table.lead > 2.0 * autopilot.delay and self._options.delay is None:
            self._say(
                f"the lead of {self._table.lead:g} s is more than the usual delay here ({autopilot.delay:g} s): the "
                "vehicle may run ahead; fit its delay to a flight of it, and give that as --delay too"
            )

    def _expect_lag(self, autopilot: Autopilot) -> None:
        """Choose an abort distance that the expected lag fits into, or refuse one that would stop the flight."""
        options, table = self._options, self._first
        craft = options.feed_forward.vehicle
        usual = autopilot.delay if craft is None or not craft.delay else craft.delay
        delay = max(0.0, (usual if options.delay is None else options.delay) - table.lead)
        speed = max(table.speed, options.fastest)
        lag = STREAM.bends * speed * delay
        rules = options.rules.fitting(lag)
        refusal = rules.lag_refusal(speed, delay)
        if refusal is not None:
            raise FlightError(f"{refusal}; nothing was sent")
        self._options = replace(options, rules=rules)
        allowed = f"{rules.farthest:.1f} m from the plan are allowed"
        self._say(f"{allowed}: it will lag {lag:.1f} m in bends at {speed:.1f} m/s ({delay:.2g} s)")

    def _wait_for_position(self, vehicle: VehicleState) -> None:
        """Wait for the first position, which a vehicle that has just booted does not report for a while."""
        blind = math.isinf(self._options.rules.max_start_distance)
        deadline = self._clock.now() + (STREAM.blind_wait if blind else self._options.wait)
        request = self._clock.now()
        while self._link.vehicle.position is None and self._clock.now() < deadline and not self._stops:
            if self._clock.now() >= request:
                self._link.send(rate_request(vehicle, "LOCAL_POSITION_NED", STREAM.position_rate))
                request += STREAM.blind_wait
            self._listen(min(deadline, self._clock.now() + 0.1))

    def _check_start(self, autopilot: Autopilot) -> None:
        """Check the start before sending."""
        options, vehicle = self._options, self._link.vehicle
        if self._table.missing:
            has = ", ".join(self._table.fields)
            self._say(f"the source has no {', '.join(self._table.missing)}: streaming {has}")
        self._refuse_beside_others(autopilot)
        self._find_ground(autopilot)
        if options.relative:
            if vehicle.position is None:
                raise FlightError("the vehicle does not report LOCAL_POSITION_NED: the flight cannot start where it is")
            return
        beneath = options.arm or self._lift is not None
        refusal = self._options.rules.start_refusal(vehicle, self._table.start.position, beneath)
        if refusal is not None:
            advice = "" if vehicle.position is None else ": bring it there, or start where it is (--origin current)"
            raise FlightError(f"{refusal}{advice}; nothing was sent")

    def _stand_apart(self) -> None:
        """Wait until all vehicles of a fleet have told where they stand, and refuse ways that are not apart."""
        place = self._link.vehicle.position
        if self._common is None or place is None or self._options.relative:
            return
        common, member = self._common
        common.stand(member, place)
        while not (common.judged or common.reason is not None or self._stops):
            self._listen(self._clock.now() + 0.1)
        if common.reason is not None:
            raise FlightError(f"{common.reason}; nothing was sent")

    def _refuse_beside_others(self, autopilot: Autopilot) -> None:
        """Refuse a vehicle that is in its mode by the setpoints of another program: it would follow both."""
        if math.isinf(autopilot.loss_time) or not autopilot.follows(self._link.vehicle):
            return
        began = self._clock.now()
        self._listen(began + 2.0 / STREAM.state_rate)
        vehicle = self._link.vehicle
        if vehicle.armed and autopilot.follows(vehicle) and vehicle.targeted > began:
            kept = f"it is in {autopilot.mode}, where nothing but a stream keeps it"
            raise FlightError(f"another program sends setpoints to this vehicle: {kept}; nothing was sent")

    def _find_ground(self, autopilot: Autopilot) -> None:
        """Let a flight that begins on the ground begin where the vehicle says that is, and say so."""
        vehicle, table, options = self._link.vehicle, self._table, self._options
        if not begins_on_ground(table, vehicle):
            if options.relative_height and options.arm:
                refused = "the vehicle's height is no origin for a path that does not climb first, from the ground"
                raise FlightError(f"{refused}: leave the height or --arm out; nothing was sent")
            return
        assert vehicle.position is not None
        off = table.start.position[2] - vehicle.position[2]
        where = f"the flight begins on the ground, which the vehicle has at {-vehicle.position[2]:.2f} m"
        moved = f"{where}: it is flown {abs(off):.2f} m {'higher' if off > 0.0 else 'lower'} than the file lies"
        self._say(moved if abs(off) >= 0.01 else where)
        self._lift = 0.0
        if autopilot.takes_off:
            if not options.arm:
                follows = f"on the ground {autopilot.name} follows no setpoints"
                raise FlightError(f"{follows}: give --arm, or begin in the air; nothing was sent")
            self._lift = min(STREAM.lift, table.climb / 2.0)
            table.begin_lifted(self._lift)
            self._say(
                f"it takes off by itself, to {self._lift:.2g} m, and joins the path in the next {self._lift:.2g} m"
            )

    def _fly(self, autopilot: Autopilot) -> None:
        """Serve slots until the flight is over; after an exception the flight stops and the hold continues."""
        here = self._link.vehicle.position if self._options.relative or self._lift is not None else None
        self._sequence = Sequence(self._table, autopilot, self._options, self._clock.now(), here, self._lift)
        self._autopilot, self._remind_at = autopilot, math.inf
        if self._table.note:
            self._say(self._table.note)
        self._say(f"streaming the start at {self._table.rate:g} Hz")
        aligned = float if self._common is None else self._common[0].aligned
        how = (self._link, self._clock, self._table.rate, self._options.rules.max_gap, self._message)
        self._sender = open_sender(*how, aligned)
        try:
            while not self._is_over(self._sequence):
                pass
        finally:
            left = self._sender.close()  # which stops sending
            try:
                self._tell(left, self._sequence)
            except Exception as error:
                self._failures.append(error)

    def _is_over(self, sequence: Sequence) -> bool:
        """Serve one slot, also after an exception; return whether it was the last."""
        # Nothing ends the loop but the sequence: a vehicle without setpoints leaves its mode in the air.
        try:
            return self._slot(sequence)
        except KeyboardInterrupt:
            self.stop()
        except Exception as error:
            self._fail(error, sequence)
        return False

    def _slot(self, sequence: Sequence) -> bool:
        """Receive until a slot is due and serve it; return whether the flight is over."""
        self._listen(self._sender.decisions.due)
        conditions = self._conditions(sequence, self._sender.late(self._clock.now()))
        with self._changing:
            step = sequence.step(conditions)
        if self._common is not None:
            stopped = None if sequence.completed else sequence.reason
            self._common[0].tell(self._common[1], sequence.ready, stopped, sequence.prepared)
        if step is None:
            self._observer.announce(conditions.now, sequence)
            self._say_what_is_left(conditions)
            return True
        for command in step.commands:
            self._link.send(command)
        self._observer.announce(conditions.now, sequence)
        self._say_what_is_hidden(conditions.vehicle, sequence)
        self._say_who_else_sends(conditions, sequence)
        foreseen = sequence.foreseen if step.setpoint is not None else lambda slot: SetpointStep(None)
        self._tell(self._sender.deliver(conditions.slot, step, foreseen), sequence)
        if self._sender.note is not None and not self._said:
            self._said = True
            self._say(self._sender.note)
        self._remind(conditions, sequence)
        self._say_how_it_hovers(sequence)
        return False

    def _message(self, step: SetpointStep, milliseconds: int) -> Message:
        assert step.setpoint is not None
        return setpoint_message(step.setpoint, self._table.mask, self._link.vehicle, milliseconds)

    def _tell(self, sent: list[SentSetpoint], sequence: Sequence) -> None:
        for each in sent:
            setpoint = each.step.setpoint
            if setpoint is None:
                self._others.silent()
            else:
                self._others.sent(each.time, setpoint.position, math.hypot(*setpoint.velocity))
            self._observer.sent(each.time, each.step, each.lateness, sequence, self._link.vehicle)

    def _say_what_is_hidden(self, vehicle: VehicleState, sequence: Sequence) -> None:
        """Report once that modes are seen rarely, where the vehicle does not send its heartbeat more often."""
        if sequence.phase is not Phase.FLYING or self._hidden:
            return
        self._hidden = True
        if STREAM.seen < vehicle.beat < math.inf and math.isinf(vehicle.mode_told):
            self._say(f"the vehicle tells its mode every {vehicle.beat:.1f} s: one chosen for less is not seen")

    def _say_who_else_sends(self, at: Conditions, sequence: Sequence) -> None:
        """Report once that another program sends during a hold, which goes on: both would leave the vehicle."""
        if at.foreign is not None and sequence.phase is Phase.HOLDING and not self._beside:
            self._beside = True
            self._say(f"{at.foreign}, while it is held here")

    def _say_how_it_hovers(self, sequence: Sequence) -> None:
        """Report once that the flight begins with a hover that is wider than it should be."""
        if sequence.phase is not Phase.READY or self._wide:
            return
        near, _ = sequence.gate
        if near > self._options.rules.settled_distance:
            self._wide = True
            self._say(f"the vehicle hovers no nearer to its start than {near:.2f} m: the flight begins within that")

    def _remind(self, at: Conditions, sequence: Sequence) -> None:
        """Report periodically what a waiting flight waits for."""
        waiting = self._waiting_for(at, sequence)
        if waiting is None:
            self._remind_at = math.inf
        elif math.isinf(self._remind_at):
            self._remind_at = at.now + STREAM.first_reminder
        elif at.now >= self._remind_at:
            self._remind_at += STREAM.reminder
            self._say(waiting)

    def _waiting_for(self, at: Conditions, sequence: Sequence) -> str | None:
        if sequence.phase is Phase.HOLDING:
            return f"holding: {sequence.hold_ends(at)}"
        released = at.triggered or self._common is not None
        if sequence.phase is not Phase.READY or not released or not self._autopilot.follows(at.vehicle):
            return None
        reason = sequence.waits_for(at.vehicle)
        return None if reason is None else f"waiting: {reason}"

    def _say_what_is_left(self, at: Conditions) -> None:
        """Report the state of a vehicle that still follows setpoints at the end, and what its failsafe will do."""
        if not self._autopilot.follows(at.vehicle):
            return
        if self._sequence is not None and not self._sequence.led:
            self._say(f"this stream never led the vehicle, which is in {self._autopilot.mode}: it is left as it is")
            return
        height = "" if at.vehicle.height is None else f", {at.vehicle.height:.1f} m high"
        armed = "armed" if at.vehicle.armed else "not armed"
        state = f"the vehicle is left {armed}, in {self._autopilot.mode}{height}"
        self._say(f"{state}; {self._autopilot.after_loss}" if at.vehicle.armed else state)

    def _listen(self, until: float) -> None:
        for message in self._link.pump(until):
            vehicle = self._link.vehicle
            self._observer.heard(self._clock.now(), message, vehicle, self._sequence)
            if self._sequence is not None:
                follows = self._autopilot.follows(vehicle)
                self._left |= not follows
                self._foreign = self._others.heard(vehicle, follows) or self._foreign

    def _conditions(self, sequence: Sequence, late: float = 0.0) -> Conditions:
        now, common, trigger = self._clock.now(), self._common, self._options.trigger
        slot = self._sender.decisions.take(now)
        if common is None and not self._triggered and callable(trigger) and sequence.phase is Phase.READY:
            self._triggered = bool(trigger())
        triggered = common is None and self._triggered
        due = self._sender.departures.instant(slot)
        at = Conditions(slot, now, self._link.vehicle, triggered, self._stops, late, due=due)
        at = replace(at, may_arm=self._triggered, left=self._left, foreign=self._foreign)
        self._left, self._foreign = False, None
        return at if common is None else self._together(sequence, common[0], at)

    def _together(self, sequence: Sequence, common: CommonFlight, at: Conditions) -> Conditions:
        """Return the conditions of a flight that begins with others, stopped where one of them is."""
        at = replace(at, may_arm=common.released)
        if common.reason is not None and sequence.phase in (Phase.PRESTREAM, Phase.READY, Phase.FLYING):
            sequence.abort(common.reason, at)
        if common.begin is None:
            return at
        begin = round((common.begin - self._sender.departures.start) * self._table.rate)
        return replace(at, begin=begin, triggered=at.slot >= begin)

    def _fail(self, error: Exception, sequence: Sequence) -> None:
        """Stop and hold after an exception of this program; use neither callbacks nor log from now on."""
        self._failures.append(error)
        self._observer.silence()
        if len(self._failures) > STREAM.give_up:
            raise error
        self._triggered = True
        if sequence.phase is not Phase.HOLDING:
            sequence.abort(f"an error here: {error}", self._conditions(sequence))

    def _conclude(self) -> StreamReport:
        if self._failures:
            raise self._failures[0]
        report = self._report()
        if self._sequence is not None and self._sequence.gave_up:
            silence = f"the vehicle has been silent for {self._options.give_up:g} s, so the hold was given up"
            raise FlightError(silence if report.reason is None else f"{report.reason}; {silence}", report=report)
        if not report.completed and not self._stops:
            raise FlightError(f"the flight was stopped: {report.reason}", report=report)
        return report

    def _report(self) -> StreamReport:
        rmse, worst = self._observer.tracking() or (None, None)
        return StreamReport(
            completed=self._sequence is not None and self._sequence.completed,
            reason=None if self._sequence is None else self._sequence.reason,
            fields=self._table.fields,
            missing=self._table.missing,
            schedule=self._sender.departures.lateness(),
            flown=self._observer.flown,
            rmse=rmse,
            worst_error=worst,
            ignored=sum(self._link.ignored.values()),
            refused=self._link.refused,
        )
