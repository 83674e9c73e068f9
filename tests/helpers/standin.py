"""An autopilot that speaks real MAVLink through pymavlink's own connections, for tests without an aircraft.

It behaves as PX4 or ArduPilot were seen to where it matters to those who send setpoints: it follows them in one mode
only and enters that mode only while they stream. When they stop, PX4 leaves the mode after ``patience`` (its
COM_OF_LOSS_T; 1.06 s were recorded), by default for a return that climbs, and enters it again with the first setpoint
that comes back; ArduCopter stays in its mode, accelerates for ``guided_timeout`` (recorded: from 1.06 to 1.99 m/s in
3 s) and brakes, 6 m farther. Both are noted in ``failsafes``. ArduCopter refuses the first take-off with result 4.
Poses are put on the topics of PX4, of which its EKF2 fuses one: ``topics``, ``fused``.

As PX4 1.17 it refuses to send heartbeats more often and tells a mode at once where CURRENT_MODE is asked for, says what
it is asked for, and disarms itself ``disarms_after`` arming on the ground. As ArduCopter 4.7 it follows no setpoint on
the ground, where it stays until it is told to take off. The ground is where its estimate has it: ``floor``.
"""

import math
import os
import struct
import threading
import time

from clocks import enter, leave

os.environ["MAVLINK20"] = "1"

from pymavlink import mavutil  # noqa: E402

from minsnap.flight.mavlink.link import Clock  # noqa: E402

mavlink = mavutil.mavlink

POSCTL, OFFBOARD, LAND, RETURN = 3 << 16, 6 << 16, (4 << 16) | (6 << 24), (4 << 16) | (5 << 24)
GAINED, BRAKED = 0.31, 1.4  # of ArduCopter after a loss, until and after its timeout, as recorded [m/s^2]
COASTING = 0.3  # ArduCopter flies on by its last velocity after so long without a setpoint [s]
RETURN_HEIGHT = 14.0  # past which PX4's default return was seen to climb [m]
HOLD = (4 << 16) | (3 << 24)
LOITER, GUIDED, COPTER_LAND, COPTER_RTL, BRAKE = 5, 4, 9, 6, 17
LIFTED = 0.1  # height above the ground from which it flies [m]


class PointMass:
    """Follows a setpoint with its velocity as feed-forward; good enough where the flying is not the point."""

    def __init__(self, position=(0.0, 0.0, 0.0), lag=0.15):
        self.position, self.velocity, self.lag = list(position), [0.0, 0.0, 0.0], lag

    def drift(self, dt, rate=0.0):
        """Fly on with the speed changing at a rate [m/s^2], not below zero."""
        speed = math.hypot(*self.velocity)
        factor = max(0.0, 1.0 + rate * dt / speed) if speed > 1e-3 else 0.0
        for i in range(3):
            self.velocity[i] *= factor
            self.position[i] += self.velocity[i] * dt

    def climb(self, dt, rate=3.0):
        self.velocity = [0.0, 0.0, -rate]
        self.position[2] -= rate * dt

    def follow(self, setpoint, dt):
        gain = 1 - math.exp(-dt / self.lag)
        goal = (setpoint.x, setpoint.y, setpoint.z)
        speed = (setpoint.vx, setpoint.vy, setpoint.vz)
        for i in range(3):
            moved = speed[i] * dt + gain * (goal[i] - self.position[i])
            self.velocity[i] = moved / dt
            self.position[i] += moved

    def rest(self, dt):
        self.velocity = [0.0, 0.0, 0.0]

    def descend(self, dt, floor=0.0):
        self.position[2] = min(floor, self.position[2] + dt)


class StandIn:
    """The autopilot; a context manager that runs in a thread of its own."""

    def __init__(self, connection="udpin:127.0.0.1:0", autopilot="px4", clock=None, body=None, **settings):
        self.link = mavutil.mavlink_connection(connection, source_system=settings.pop("system", 1), source_component=1)
        self._time = clock or Clock()
        self.clock = self._time.now
        self.px4 = autopilot == "px4"
        self.kind = {"px4": 12, "ardupilot": 3, "generic": 0}[autopilot]
        modes = (OFFBOARD, POSCTL, LAND, RETURN) if self.px4 else (GUIDED, LOITER, COPTER_LAND, COPTER_RTL)
        self.following, self.other, self.landing, self.returning = modes
        self.body = body or PointMass()
        self.mode, self.armed, self.armed_at = self.other, True, -math.inf
        self.beats = self.positions = self.moves = True
        self.climbing_to = None
        self.setpoints, self.heard, self.commands, self.modes, self.failsafes = [], [], [], [], []
        self.position_rate, self.beat_period, self.patience = 20.0, 0.25, 1.0
        self.guided_timeout, self.refused_takeoffs, self.failed = 3.0, 0 if self.px4 else 1, False
        self.parameters, self.written = {}, []
        self.beats_on_request, self.refuses_arming, self.refuses_modes = False, "", False
        self.telemetry = []  # messages that go out with each heartbeat
        self.silent_unasked = False  # as ArduPilot on a port for a companion: nothing but heartbeats until asked
        self.asked = {}  # ids of messages that were asked for, and how often [s]
        self.floor, self.disarms_after = 0.0, 10.0  # of PX4 (COM_DISARM_PRFLT)
        self.grounded = None  # until it is known: a vehicle that is not armed stands on the ground
        self.shakes = 0.0  # how far the estimate wanders about the position [m]
        self.tells_modes = self.tells_targets = True  # where it is asked, which older ones are in vain
        self.told_mode, self.told_at = None, -math.inf
        self.logs, self.lost_pieces = [], set()  # bytes of each log; offsets that do not arrive when first asked for
        self.files, self.lost_parts = {}, set()  # by path; offsets in them that do not arrive when first sent
        self.held_back = 0.0  # how much later than it comes a setpoint is acted on [s]
        self.returns, self.topics, self.fused = False, [], 0
        self.last_setpoint, self.first_setpoint = -math.inf, math.inf
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        for name, value in settings.items():
            assert hasattr(self, name), name
            setattr(self, name, value)

    @property
    def port(self):
        listener = getattr(self.link, "listen", None) or self.link.port
        return listener.getsockname()[1]

    def __enter__(self):
        enter(self._time)
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._stop.set()
        while self._thread.is_alive():
            self._time.wait(self.clock() + 0.01, [])
        self.link.close()

    def until(self, condition, timeout=60.0):
        """Wait for something to be true of this autopilot, no longer than some seconds of real time."""
        deadline = time.monotonic() + timeout
        while not condition(self):
            if time.monotonic() > deadline:
                raise TimeoutError(f"mode {self.mode}, {len(self.setpoints)} setpoints, {self.commands}")
            self._time.wait(self.clock() + 0.01, [])

    def enter(self, mode=None):
        """Change the mode, as a pilot's switch does."""
        self.mode = self.following if mode is None else mode
        self.modes.append((self.clock(), self.mode))

    def _run(self):
        try:
            self._fly_on()
        finally:
            leave(self._time)

    def _fly_on(self):
        last = self.clock()
        beat = place = last
        while not self._stop.is_set():
            self._receive()
            now = self.clock()
            self._fly(now, now - last)
            last = now
            self._tell_mode(now)
            if now >= beat:
                beat = max(beat + self.beat_period, now)
                self._beat()
            if now >= place:
                place = max(place + 1 / self.position_rate, now)
                self._report(now)
            self._time.wait(now + 0.005, [self.link.fd])

    def _beat(self):
        if self.beats:
            base = 1 | (128 if self.armed else 0)
            self.link.mav.heartbeat_send(mavlink.MAV_TYPE_QUADROTOR, self.kind, base, self.mode, 4)
        for message in self.telemetry:
            if self._tells(message.id):
                self.link.mav.send(message)
        if self.beats:
            self._tell_state()

    def _tell_state(self):
        """Say whether it has landed, and what it is asked for, where that was asked for."""
        if mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE in self.asked:
            flies = mavlink.MAV_LANDED_STATE_IN_AIR if self.climbing_to is None else mavlink.MAV_LANDED_STATE_TAKEOFF
            self.link.mav.extended_sys_state_send(0, mavlink.MAV_LANDED_STATE_ON_GROUND if self.grounded else flies)
        asks = mavlink.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED in self.asked and self.mode == self.following
        if asks and self.climbing_to is not None:  # ArduCopter's own take-off has none, and it tells zeros
            self.link.mav.position_target_local_ned_send(0, 1, 0, *(0.0,) * 11)
        elif asks and self.tells_targets and self.armed and self.setpoints:
            m = self.setpoints[-1][1]
            moved = (m.x, m.y, m.z, m.vx, m.vy, m.vz, m.afx, m.afy, m.afz, m.yaw, m.yaw_rate)
            self.link.mav.position_target_local_ned_send(0, 1, 0, *moved)

    def _tell_mode(self, now):
        """Tell a mode that has changed, no more often than was asked for."""
        every = self.asked.get(mavlink.MAVLINK_MSG_ID_CURRENT_MODE, math.inf)
        if self.beats and self.tells_modes and self.px4 and self.mode != self.told_mode and now - self.told_at >= every:
            self.told_mode, self.told_at = self.mode, now
            self.link.mav.current_mode_send(0, self.mode, self.mode)

    def _tells(self, number):
        return number in self.asked or not self.silent_unasked

    def _report(self, now):
        if self.positions and self._tells(mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED):
            wander = [self.shakes * math.sin(2.0 * now + k) for k in range(3)]
            places = [place + off for place, off in zip(self.body.position, wander, strict=True)]
            where = (*places, *self.body.velocity)
            self.link.mav.local_position_ned_send(int(now * 1000) & 0xFFFFFFFF, *where)

    def _receive(self):
        while (message := self.link.recv_msg()) is not None:
            kind = message.get_type()
            self.heard.append((self.clock(), kind, message.get_srcSystem()))
            if kind == "SET_POSITION_TARGET_LOCAL_NED":
                self.setpoints.append((self.clock(), message))
                self.last_setpoint = self.clock()
                self._resume()
                self.first_setpoint = min(self.first_setpoint, self.clock())
            elif kind == "COMMAND_LONG":
                self._obey(message)
            elif kind in ("VISION_POSITION_ESTIMATE", "ODOMETRY", "ATT_POS_MOCAP"):
                self._estimate(message)
            elif kind in ("PARAM_REQUEST_READ", "PARAM_SET"):
                self._tell(message)
            elif kind == "LOG_REQUEST_LIST":
                for number, log in enumerate(self.logs):
                    self.link.mav.log_entry_send(number, len(self.logs), len(self.logs) - 1, 0, len(log))
            elif kind == "LOG_REQUEST_DATA":
                self._send_log(message)
            elif kind == "FILE_TRANSFER_PROTOCOL" and self.files:
                self._serve(bytes(message.payload))

    def _serve(self, raw):
        """Serve files as MAVLink's file transfer says: folders, and bursts of at most three parts."""
        number, session, opcode, size, _, _, _, offset = struct.unpack_from("<HBBBBBBI", raw)
        name = raw[12 : 12 + size].decode(errors="replace") if opcode in (3, 4) else ""

        def answer(kind, data, at=0, last=0):
            head = struct.pack("<HBBBBBBI", (number + 1) % 65536, 1, kind, len(data), opcode, last, 0, at)
            self.link.mav.file_transfer_protocol_send(0, 255, 0, list((head + data).ljust(251, b"\0")))

        if opcode == 3:
            inside = [path[len(name) + 1 :] for path in self.files if path.startswith(f"{name}/")]
            folders = sorted({f"D{path.split('/')[0]}" for path in inside if "/" in path})
            listed = folders + [f"F{path}\t{len(self.files[f'{name}/{path}'])}" for path in inside if "/" not in path]
            part = "".join(f"{entry}\0" for entry in listed[offset : offset + 2]).encode()
            answer(128 if part else 129, part or bytes([6]))
        elif opcode == 4:
            self.opened = self.files.get(name)
            answer(*((129, bytes([10])) if self.opened is None else (128, struct.pack("<I", len(self.opened)))))
        elif opcode == 15:
            starts = [at for at in range(offset, min(offset + 3 * 239, len(self.opened)), 239)]
            for at in starts:
                if at in self.lost_parts:
                    self.lost_parts.discard(at)
                    continue
                answer(128, self.opened[at : at + 239], at, int(at == starts[-1]))
        elif opcode == 1:
            answer(128, b"")

    def _send_log(self, asked):
        for start in range(asked.ofs, min(asked.ofs + asked.count, len(self.logs[asked.id])), 90):
            piece = self.logs[asked.id][start : start + 90]
            if start in self.lost_pieces:
                self.lost_pieces.discard(start)
                continue
            self.link.mav.log_data_send(asked.id, start, len(piece), list(piece.ljust(90, b"\0")))

    def _resume(self):
        """PX4 goes back into OFFBOARD when the stream that it lost comes back: no heartbeat shows that it was away."""
        if self.px4 and self.failed and self.mode in (self.other, self.returning):
            self.mode = self.following
        self.failed = False

    def _estimate(self, message):
        """PX4 puts poses on two topics, and its EKF2 reads but the visual one."""
        mocap = message.get_type() == "ATT_POS_MOCAP" or (
            message.get_type() == "ODOMETRY" and message.estimator_type == mavlink.MAV_ESTIMATOR_TYPE_MOCAP
        )
        self.topics.append("vehicle_mocap_odometry" if mocap else "vehicle_visual_odometry")
        self.fused += not mocap

    def _tell(self, message):
        """Answer for a parameter: an integer of PX4 comes as its bytes in the place of the float."""
        name = message.param_id.rstrip("\0")
        if name not in self.parameters:
            return
        bytewise = self.px4 and isinstance(self.parameters[name], int)
        if message.get_type() == "PARAM_SET":
            self.written.append(name)
            raw = struct.pack("<f", message.param_value)
            value = struct.unpack("<i", raw)[0] if bytewise else message.param_value
            self.parameters[name] = type(self.parameters[name])(value)
        value = self.parameters[name]
        kind = mavlink.MAV_PARAM_TYPE_INT32 if isinstance(value, int) else mavlink.MAV_PARAM_TYPE_REAL32
        sent = struct.unpack("<f", struct.pack("<i", value))[0] if bytewise else float(value)
        self.link.mav.param_value_send(name.encode(), sent, kind, len(self.parameters), 0)

    def _obey(self, message):
        self.commands.append((message.command, message.param1, message.param2, message.param7))
        accepted = True
        if message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            self.asked[int(message.param1)] = 1e-6 * message.param2
        if message.command == mavlink.MAV_CMD_DO_SET_MODE:
            wanted = int(message.param2) << 16 | int(message.param3) << 24 if self.px4 else int(message.param2)
            streaming = not self.px4 or self.clock() - self.first_setpoint > 1.0
            streaming = streaming and not self.refuses_modes
            accepted = wanted in (HOLD, BRAKE) or (wanted == self.following and streaming)
            self.mode = wanted if accepted else self.mode
        elif message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL and message.param1 == 0 and self.beats_on_request:
            self.beat_period = 1e-6 * message.param2
        elif message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL and message.param1 == 0 and self.px4:
            self.link.mav.command_ack_send(message.command, mavlink.MAV_RESULT_FAILED)
            return
        elif message.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM and self.refuses_arming:
            self.link.mav.statustext_send(mavlink.MAV_SEVERITY_CRITICAL, self.refuses_arming.encode())
            accepted = False
        elif message.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            self.armed, self.armed_at = message.param1 == 1, self.clock()
        elif message.command == mavlink.MAV_CMD_NAV_TAKEOFF and self.refused_takeoffs > 0:
            self.refused_takeoffs -= 1
            self.link.mav.command_ack_send(message.command, mavlink.MAV_RESULT_FAILED)
            return
        elif message.command == mavlink.MAV_CMD_NAV_TAKEOFF:
            self.climbing_to = self.floor - message.param7  # above home, where it was armed
        elif message.command == mavlink.MAV_CMD_NAV_LAND:
            self.mode = self.landing
        elif message.command == mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH:
            self.mode = self.returning
        self.link.mav.command_ack_send(message.command, 0 if accepted else 1)
        self._beat()

    def _fly(self, now, dt):
        if dt <= 0:
            return
        self._look_at_the_ground(now)
        if self.climbing_to is not None:
            self._climb(dt)
            return
        led = self.mode == self.following and self.armed and self.last_setpoint > self.armed_at
        if led and self.setpoints and self.moves and (self.px4 or not self.grounded):
            self._follow(now, dt)
        elif self.mode == self.landing:
            self.body.descend(dt, self.floor)
            self.armed = self.armed and self.body.position[2] < self.floor - 0.02
        elif self.mode == self.returning and self.failed and self.body.position[2] > -RETURN_HEIGHT:
            self.body.climb(dt)
        elif self.armed:
            self.body.rest(dt)

    def _look_at_the_ground(self, now):
        """PX4 knows by its height that it has left the ground, ArduCopter by its take-off."""
        height = self.floor - self.body.position[2]
        if not self.armed:
            self.grounded = True
        elif self.px4 or self.grounded is None:
            self.grounded = height < LIFTED
        armed_for = now - self.armed_at
        if self.px4 and self.armed and self.grounded and self.disarms_after < armed_for < math.inf:
            self.armed, self.failsafes = False, [*self.failsafes, "disarmed on the ground"]

    def _follow(self, now, dt):
        silence = now - self.last_setpoint
        if self.px4 or silence <= COASTING:
            self.body.follow(self._acted_on(now), dt)
        elif silence <= self.guided_timeout:
            self.body.drift(dt, GAINED)
        else:
            self.body.drift(dt, -BRAKED)
        if silence > self.patience and not self.failed:
            self.failsafes.append(now)
            self.failed = True
            self.mode = (self.returning if self.returns else self.other) if self.px4 else self.mode

    def _acted_on(self, now):
        come = [message for t, message in self.setpoints[-60:] if t <= now - self.held_back]
        return come[-1] if come else self.setpoints[0][1]

    def _climb(self, dt):
        """Take off at a metre per second; a setpoint on the way would stop it, as ArduPilot's would."""
        self.body.position[2] -= dt
        if self.body.position[2] <= self.climbing_to:
            self.climbing_to, self.grounded = None, False
        elif self.last_setpoint > self.armed_at and self.body.position[2] > self.climbing_to + 0.6:
            self.failsafes.append("take-off stopped")
