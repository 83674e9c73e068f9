"""The phases of a flight as a state machine, without access to clock, sockets or files.

In every state it returns a setpoint until the vehicle has left the mode in which it follows setpoints.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from minsnap.flight.mavlink.setpoints import Setpoint, Setpoints
from minsnap.flight.mavlink.start_gate import Hover
from minsnap.flight.mavlink.stream_options import STREAM, Phase, StreamOptions
from minsnap.flight.mavlink.vehicle_messages import Autopilot, Message, Vector, VehicleState, command


@dataclass(frozen=True)
class Conditions:
    """The inputs of a sequence, once per slot.

    Parameters
    ----------
    slot : int
        Number of the slot; missed slots are missing.
    now : float
        [s]
    vehicle : VehicleState
        What the vehicle last said.
    triggered : bool
        True once the flight may begin.
    stops : int
        How often the user has pressed Ctrl-C.
    gap : float
        Time since the slot before this was served [s].
    begin : int or None
        Slot of the first setpoint of the flight, where several flights begin together; None: the one that is served.
    may_arm : bool
        True once a vehicle that begins on the ground may be armed: it does not stand there armed for long.
    left : bool
        Whether it was outside of its mode since the slot before, however briefly.
    foreign : str or None
        What another program asks of the vehicle, in words.
    due : float or None
        When the setpoint of the slot is to leave [s]; None: now.
    """

    slot: int
    now: float
    vehicle: VehicleState
    triggered: bool = True
    stops: int = 0
    gap: float = 0.0
    begin: int | None = None
    may_arm: bool = True
    left: bool = False
    foreign: str | None = None
    due: float | None = None


@dataclass(frozen=True)
class SetpointStep:
    """What is to be sent in a slot.

    Parameters
    ----------
    setpoint : Setpoint or None
        None while an autopilot takes off by itself.
    index : int or None
        Which step of the table it is; None before and after the flight.
    commands : tuple of messages
        To send as well.
    """

    setpoint: Setpoint | None
    index: int | None = None
    commands: tuple[Message, ...] = ()


class Sequence:
    """The phases of one flight.

    Parameters
    ----------
    table : SetpointTable or ChangingTable
        What to fly.
    autopilot : Autopilot
        Whose conventions apply.
    options : StreamOptions
        What begins and ends the flight, and when to stop; a flight that the mode begins, and that does not arm, begins
        when the vehicle enters it, having been outside it before.
    start : float
        When streaming begins [s].
    here : tuple of 3, or None
        Where the vehicle is, for a flight relative to that; it is updated until the vehicle enters the mode.
    lift : float or None
        Of a flight that begins on the ground, whose height is that of the vehicle until it is armed: how high above it
        the autopilot takes off by itself first [m], 0 for one that does not. None: it begins where the table does.

    Attributes
    ----------
    setpoint : Setpoint
        What is sent now.
    ready : bool
        Whether the flight waits for nothing but its trigger.
    prepared : bool
        Whether it waits for nothing but its trigger and, on the ground, its arming.
    led : bool
        Whether the vehicle has followed this stream.
    planned : tuple of 3
        Where the vehicle is to be when the setpoint leaves [m]: of setpoints sent ahead, where the one sent that much
        before is.
    planned_at : float or None
        When that is [s]; None before the flight.
    """

    def __init__(
        self,
        table: Setpoints,
        autopilot: Autopilot,
        options: StreamOptions,
        start: float,
        here: Vector | None = None,
        lift: float | None = None,
    ) -> None:
        self._table, self._autopilot, self._options, self._rules = table, autopilot, options, options.rules
        self._lift, self._hover, self._may_arm = lift, Hover(), lift is None
        self._prestream_end = start + options.prestream
        self._on_entry, self._relative = options.trigger == "mode" and not options.arm, here is not None
        self.phase = Phase.PRESTREAM
        self.reason: str | None = None
        self.completed = self.aborted = self.gave_up = self.led = self.ready = self.prepared = False
        self._lost_at: float | None = None
        self.planned_at: float | None = None
        self._arm_sent = -math.inf
        self._arm_by: float | None = None
        self._lacking: list[str] | None = None
        self._first_slot = 0
        self._was_outside = self._was_disarmed = False
        self._outside_since: float | None = None
        self._settled_since: float | None = None
        self._waited_since: float | None = None
        self._foreign: str | None = None
        self._stands = False
        self._ground: float | None = None
        self._next_command = start
        self._start_here(table.start.position if here is None else here)

    def _start_here(self, place: Vector) -> None:
        first = self._table.start
        above = (*place[:2], place[2] - (self._lift or 0.0))
        self.offset = self._options.offset(first.position, above, self._lift is not None)
        self.setpoint = first.shifted(self.offset)
        self.planned: Vector = self.setpoint.position

    @property
    def first_slot(self) -> int | None:
        """Slot of the flight's first setpoint; None unless it is flying."""
        return self._first_slot if self.phase is Phase.FLYING else None

    def step(self, at: Conditions) -> SetpointStep | None:
        """Return the setpoint and commands of this slot, or None once the flight has ended and sending must stop."""
        self._watch_mode(at)
        self.led |= self._leads(at.vehicle)
        self._foreign = at.foreign or self._foreign
        if at.may_arm and not self._may_arm:
            self._may_arm, self._next_command = True, at.now
        if at.stops and self.phase is not Phase.HOLDING:
            self._end("stopped by the user", at, where_it_is=False)
        self._watch_gap(at)
        if self.phase in (Phase.PRESTREAM, Phase.READY):
            self._watch_start(at)
            self._watch_hover(at)
            settled = self._autopilot.follows(at.vehicle) and self.waits_for(at.vehicle) is None
            self._settled_since = (self._settled_since or at.now) if settled else None
        if self.phase is Phase.READY:
            self._consider_start(at)
            self._watch_patience(at)
        if self.phase is Phase.FLYING:
            self._advance(at)
        if self.phase is Phase.HOLDING and self._may_leave(at):
            self.phase = Phase.DONE
        return None if self.phase is Phase.DONE else self._answer(at)

    def foreseen(self, slot: int) -> SetpointStep:
        """Return the setpoint of a later slot if nothing happens until then; without commands."""
        if self.phase is not Phase.FLYING:
            return SetpointStep(None if self._lost_at is not None else self.setpoint)
        index = slot - self._first_slot
        setpoint = self._table[index].shifted(self.offset)
        return SetpointStep(setpoint.held()) if self._is_over(index) else SetpointStep(setpoint, index)

    def _is_over(self, index: int) -> bool:
        return index >= len(self._table) and not self._table.stays

    def hold(self, reason: str | None, at: Conditions, where_it_is: bool = True) -> None:
        """Stop and hold: at the vehicle's position if it was reported recently, else at the last setpoint."""
        fresh = where_it_is and at.vehicle.position is not None and at.now - at.vehicle.positioned <= STREAM.fresh
        self.setpoint = self.setpoint.held(at.vehicle.position if fresh else None)
        self.planned = self.setpoint.position
        self.phase, self.reason = Phase.HOLDING, reason

    def abort(self, reason: str, at: Conditions) -> None:
        """Hold because a rule is broken; if no vehicle follows the setpoints yet, the flight ends."""
        self.aborted = True
        self._end(reason, at)

    def _end(self, reason: str, at: Conditions, where_it_is: bool = True) -> None:
        self._stands = at.vehicle.landed
        led = self._leads(at.vehicle) and not self._on_the_ground(at)
        self.hold(reason, at, where_it_is)
        if not led:
            self.phase = Phase.DONE

    def _leads(self, vehicle: VehicleState) -> bool:
        """Return whether the vehicle follows our setpoints: flying, or in its mode or armed since the stream began."""
        began_here = self._was_outside or (self._was_disarmed and vehicle.armed)
        return self.phase is Phase.FLYING or (began_here and self._autopilot.follows(vehicle))

    def _on_the_ground(self, at: Conditions) -> bool:
        """Return whether its motors stand still, by a heartbeat later than the last command to arm: nothing is held."""
        fresh = at.now - at.vehicle.heartbeat <= self._rules.heartbeat_timeout
        return fresh and not at.vehicle.armed and at.vehicle.heartbeat > self._arm_sent + STREAM.takes_effect

    def _watch_gap(self, at: Conditions) -> None:
        """After a pause of this program, abandon the flight and hold the vehicle at its current position."""
        reason = self._rules.stall(at.gap)
        if reason is None or self.phase not in (Phase.FLYING, Phase.HOLDING):
            return
        if at.gap > self._autopilot.loss_time:
            self._lost_at = at.now
        if self.phase is Phase.FLYING:
            self.abort(reason, at)
        else:
            self.hold(self.reason, at)

    def _watch_mode(self, at: Conditions) -> None:
        self._was_disarmed |= at.vehicle.disarmed
        if self._autopilot.follows(at.vehicle):
            self._outside_since = None
        elif self._outside_since is None:
            self._was_outside, self._outside_since = True, at.now

    def _watch_start(self, at: Conditions) -> None:
        """Move a relative start with the vehicle, and refuse a vehicle that is too far from a fixed start."""
        if at.vehicle.disarmed and at.vehicle.position is not None:
            self._ground = at.vehicle.position[2]
        moves = at.vehicle.disarmed if self._lift is not None else not self._autopilot.follows(at.vehicle)
        if (self._relative or self._lift is not None) and at.vehicle.position is not None and moves:
            self._start_here(at.vehicle.position)
        beneath = self._options.arm or self._lift is not None
        refusal = self._rules.start_refusal(at.vehicle, self.setpoint.position, on_the_ground=beneath)
        if refusal is not None or at.foreign is not None:
            self.abort(refusal or str(at.foreign), at)
        elif self.phase is Phase.PRESTREAM and at.now >= self._prestream_end:
            self.phase = Phase.READY

    def _watch_hover(self, at: Conditions) -> None:
        if self._autopilot.follows(at.vehicle) and at.vehicle.armed:
            self._hover.see(at.now, at.vehicle)
        else:
            self._hover.forget()

    def _watch_patience(self, at: Conditions) -> None:
        """End what waits in the air, or armed on the ground, for a start that the vehicle does not come to."""
        reason = self.waits_for(at.vehicle)
        waits = at.triggered and self._autopilot.follows(at.vehicle) and at.vehicle.armed and reason is not None
        self._waited_since = (self._waited_since or at.now) if waits and self.phase is Phase.READY else None
        if self._waited_since is not None and at.now - self._waited_since > self._options.wait:
            self.abort(f"the vehicle was not at its start within {self._options.wait:g} s: {reason}", at)

    def _consider_start(self, at: Conditions) -> None:
        """Begin the flight when all conditions hold; what was brought about for it and is lost again ends it."""
        entered = self._was_outside or not self._on_entry
        self.ready = entered and self._autopilot.follows(at.vehicle) and self._is_there(at)
        arms_last = self._options.arm and self._lift is not None and not self._may_arm
        self.prepared = self.ready or (arms_last and self._autopilot.follows(at.vehicle))
        lost = self._lost_again(at.vehicle)
        if self._may_arm and self._arm_by is None:
            self._arm_by = at.now + self._options.wait
        if self._options.arm and lost:
            self.aborted = True
            self.hold(lost[0], at)
        elif self._options.arm and at.now > (self._arm_by or math.inf) and not self.ready:
            self.abort(f"the vehicle was not armed, in its mode and at the start in time: {self._missing(at)}", at)
        elif at.triggered and self.ready:
            self.phase, self._first_slot = Phase.FLYING, at.slot if at.begin is None else at.begin
        elif at.triggered and at.begin is not None:
            self.abort("it was no longer ready at its start when all began", at)

    def _lost_again(self, vehicle: VehicleState) -> list[str]:
        """Return what of mode and arming the vehicle has had since it is ready, and has no longer."""
        losses = self._autopilot.losses(vehicle)
        self._lacking = [lost for lost in losses if self._lacking is None or lost in self._lacking]
        return [lost for lost in losses if lost not in self._lacking]

    def _missing(self, at: Conditions) -> str:
        """Return the condition that a start with arming still waits for."""
        if at.vehicle.refusal is not None:
            failed = "".join(f"; {check}" for check in at.vehicle.arming.failed)
            reasons = "".join(f'; it says "{text}"' for text in at.vehicle.warnings)
            return f"it refused {at.vehicle.refusal}{failed}{reasons}"
        if not self._autopilot.follows(at.vehicle):
            return f"it is not in {self._autopilot.mode}"
        return self.waits_for(at.vehicle) or ("it came to it too late" if at.vehicle.armed else "it is not armed")

    def waits_for(self, vehicle: VehicleState) -> str | None:
        """Return the reason why the flight of a vehicle in its mode does not begin yet, or None."""
        if vehicle.disarmed:
            return "the vehicle is not armed"
        if self._lift == 0.0:  # it stands on the ground, whatever its estimate does
            return None
        return self._rules.unsettled(vehicle, self.setpoint.position, self.gate)

    @property
    def gate(self) -> tuple[float, float]:
        """Within which distance of its start [m] and below which speed [m/s] the vehicle may begin the flight."""
        return self._hover.gate(self._rules, self.setpoint.position)

    def _is_there(self, at: Conditions) -> bool:
        """Return whether the vehicle is armed and at rest at the start, for long enough, and has taken off for it."""
        ready = not self._options.arm or (at.vehicle.armed and not self._takes_off_alone(at.vehicle))
        time = 0.0 if math.isinf(self._rules.max_start_distance) else self._rules.settle_time
        return ready and self._settled_since is not None and at.now - self._settled_since >= time

    def _advance(self, at: Conditions) -> None:
        """Advance to the setpoint due now, unless a rule is broken or the end is reached."""
        index = at.slot - self._first_slot
        landed = self._has_landed(at.vehicle, index)
        reason = (
            None if landed else self._rules.breach(at.now, at.vehicle, self.planned, self._autopilot, self.planned_at)
        )
        reason = reason or at.foreign or (f"the vehicle left {self._autopilot.mode}" if at.left and index > 0 else None)
        if reason is not None:
            self.abort(reason, at)
            return
        self.setpoint = self._table[index].shifted(self.offset)
        self.planned = self.setpoint.held(self._table.planned(index)).shifted(self.offset).position
        self.planned_at = at.now if at.due is None else at.due
        if landed or self._is_over(index):
            self.completed = True
            self.hold(None, at, where_it_is=False)

    def _has_landed(self, vehicle: VehicleState, index: int) -> bool:
        """Return whether a vehicle disarmed itself where the plan ends: it rests there, and the rest is no way."""
        if not vehicle.disarmed:
            return False
        rest = [self._table[k].shifted(self.offset).position for k in range(index, max(index + 1, len(self._table)))]
        near = all(math.dist(place, rest[-1]) <= self._rules.settled_distance for place in rest)
        return near and self._rules.unsettled(vehicle, rest[-1]) is None

    def _may_leave(self, at: Conditions) -> bool:
        """Return whether sending may stop: the vehicle left the mode or is silent, or the user stopped twice."""
        silence = at.now - at.vehicle.heard
        lost = self._autopilot.main_mode is None or silence > self._rules.heartbeat_timeout
        if at.stops >= 2 or (at.stops and lost) or self._on_the_ground(at):
            return True
        if self._taken(at):
            if self.aborted:
                mode = self._autopilot.mode_name(at.vehicle)
                self.reason = f"{self.reason}; {mode} has the vehicle, and it is left to it"
            return True
        if silence > self._options.give_up:
            self.gave_up = True
            return True
        return self._outside_since is not None and at.now - self._outside_since >= STREAM.linger

    def _taken(self, at: Conditions) -> bool:
        """Return whether the autopilot flies by itself, which setpoints that go on would take it from.

        After a pause that it takes for a loss, only a heartbeat of afterwards tells; nothing is sent until it comes.
        """
        if self._lost_at is not None and at.vehicle.heartbeat <= self._lost_at + STREAM.takes_effect:
            return False
        lost, self._lost_at = self._lost_at is not None, None
        if lost and self._autopilot.follows(at.vehicle):
            self.hold(self.reason, at)
        return self._autopilot.acts_alone(at.vehicle) or (lost and not self._autopilot.follows(at.vehicle))

    def hold_ends(self, at: Conditions) -> str:
        """Return the sentence that says how a hold ends."""
        command = self._wanted_command(at.vehicle)
        descent = "" if command is None else f"it was told to {self.after_stop}; "
        other = "" if self._foreign is None else f"{self._foreign}; "
        refusal = at.vehicle.refusal
        own_refusal = command is not None and refusal is not None and refusal.command == command.command
        refused = f"it refuses {refusal}; " if own_refusal else ""
        return (
            f"{other}{descent}{refused}it ends when the vehicle leaves {self._autopilot.mode}, or with a second Ctrl-C"
        )

    def _answer(self, at: Conditions) -> SetpointStep:
        index = at.slot - self._first_slot if self.phase is Phase.FLYING else None
        commands = self._commands(at)
        silent = self._lost_at is not None or (self.phase is Phase.READY and self._takes_off_alone(at.vehicle))
        return SetpointStep(None if silent else self.setpoint, index, commands)

    def _takes_off_alone(self, vehicle: VehicleState) -> bool:
        """Return whether the autopilot performs its own take-off, which setpoints would interrupt."""
        room = STREAM.climbed if self._lift is None else self._lift / 2.0
        below = vehicle.position is None or vehicle.position[2] - self.setpoint.position[2] > room
        if self._lift is not None and vehicle.taking_off is not None:
            below = vehicle.taking_off
        return self._options.arm and self._autopilot.takes_off and below

    def _commands(self, at: Conditions) -> tuple[Message, ...]:
        """Return the command due now; a command is repeated every second until its effect is observed."""
        command = self._wanted_command(at.vehicle)
        if command is None or at.now < self._next_command:
            return ()
        self._next_command = at.now + STREAM.retry
        if self.phase is Phase.READY and not at.vehicle.armed:
            self._arm_sent = at.now
        return (command,)

    def _wanted_command(self, vehicle: VehicleState) -> Message | None:
        following = self._autopilot.follows(vehicle)
        if self.phase is Phase.HOLDING and following:
            return self._way_down(vehicle)
        if self.phase is not Phase.READY or not self._options.arm:
            return None
        if not following:
            return command(vehicle, "MAV_CMD_DO_SET_MODE", 1.0, float(self._autopilot.main_mode or 0))
        if not vehicle.armed:
            return command(vehicle, "MAV_CMD_COMPONENT_ARM_DISARM", 1.0) if self._may_arm else None
        if self._takes_off_alone(vehicle):
            above_home = (self._ground or 0.0) - self.setpoint.position[2]  # home is where it was armed
            return command(vehicle, "MAV_CMD_NAV_TAKEOFF", *(0.0,) * 6, above_home)
        return None

    @property
    def after_stop(self) -> str:
        """What a vehicle that is held is told to do by itself, in words; empty where it is held until it is taken."""
        if self.completed:
            return "land" if self._options.land else ""
        way = self._options.after_stop if self.aborted else "hold"
        if way == "hand-back" and self._stands:
            way = "land"  # armed on the ground: so it disarms itself
        hover = self._autopilot.hold
        back = "" if hover is None else f"hover by itself, in {hover[0]}"
        return {"hold": "", "land": "land", "rtl": "return to launch", "hand-back": back}[way]

    def _way_down(self, vehicle: VehicleState) -> Message | None:
        """Return the command that ends a hold, if one was requested; after a stop by the user there is none."""
        hover, told = self._autopilot.hold, self.after_stop
        if told == "land":
            return command(vehicle, "MAV_CMD_NAV_LAND")
        if told == "return to launch":
            return command(vehicle, "MAV_CMD_NAV_RETURN_TO_LAUNCH")
        return command(vehicle, "MAV_CMD_DO_SET_MODE", 1.0, *hover[1:]) if told and hover is not None else None
