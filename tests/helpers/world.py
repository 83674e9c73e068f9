"""The machine of a flight's phases without a link: a vehicle by itself, and flights of it slot by slot."""

from dataclasses import replace

from flying import excursion

from minsnap.flight.mavlink.sequence import Conditions, Sequence
from minsnap.flight.mavlink.setpoints import tabulate
from minsnap.flight.mavlink.stream_options import StreamOptions
from minsnap.flight.mavlink.vehicle_messages import AUTOPILOTS, VehicleState

RATE = 20.0
TABLE = tabulate(excursion(4.0))
PX4 = AUTOPILOTS["px4"]
OFFBOARD, POSCTL = 6 << 16, 3 << 16
HERE = VehicleState(1, 1, 12, 129, POSCTL, 0.0, 0.0, TABLE.start.position, (0.0, 0.0, 0.0), 0.0)


class World:
    """A vehicle that is where it should be unless an event moves it, and is heard unless one silences it."""

    def __init__(self):
        self.mode, self.heard, self.beats, self.away = POSCTL, True, True, False
        self.triggered, self.stops, self.slot, self.armed = False, 0, 0, True
        self.vehicle = HERE
        self.left_since = 0.0

    def happen(self, event):
        if event in ("offboard", "posctl"):
            self.mode = OFFBOARD if event == "offboard" else POSCTL
        self.heard = {"silent": False, "heard": True}.get(event, self.heard)
        self.beats = {"nobeat": False, "heard": True}.get(event, self.beats)
        self.away = {"away": True, "back": False}.get(event, self.away)
        self.armed = {"disarm": False, "arm": True}.get(event, self.armed)
        self.triggered |= event == "trigger"
        self.stops += event == "stop"
        self.slot += 7 * (event == "gap")

    def conditions(self, setpoint):
        self.slot += 1
        now = self.slot / RATE
        if self.heard:
            x, y, z = setpoint.position
            place = (x + 30.0 * self.away, y, z)
            self.vehicle = replace(self.vehicle, heard=now, position=place, positioned=now)
            if self.beats:
                base = 1 | (128 if self.armed else 0)
                self.vehicle = replace(self.vehicle, heartbeat=now, base_mode=base, custom_mode=self.mode)
        return Conditions(self.slot, now, self.vehicle, self.triggered, self.stops)


def fly(world, sequence, slots):
    for _ in range(slots):
        step = sequence.step(world.conditions(sequence.setpoint))
    return step


def ready(**options):
    world = World()
    sequence = Sequence(TABLE, PX4, StreamOptions(trigger=bool, **options), 0.0)
    world.happen("trigger")
    world.happen("offboard")
    return world, sequence
