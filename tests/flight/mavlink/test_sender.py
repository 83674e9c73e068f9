"""Flights whose setpoints leave from a thread of their own, in real time, with the stand-in autopilot."""

import os
from socket import AF_INET, SOCK_DGRAM, socket

import numpy as np
import pytest
from flying import Flight, excursion, in_ned, stall_once
from pilot import sent, stands_still
from standin import OFFBOARD, POSCTL, PointMass, StandIn

from minsnap.errors import FlightError
from minsnap.flight.mavlink.link import Clock, open_link
from minsnap.flight.mavlink.offboard import prepare
from minsnap.flight.mavlink.sender import DirectSender, ThreadedSender, open_sender
from minsnap.flight.mavlink.sequence import SetpointStep
from minsnap.flight.mavlink.setpoints import Setpoint, setpoint_message
from minsnap.flight.mavlink.stream_options import SafetyRules
from minsnap.flight.mavlink.vehicle_messages import load_dialect
from minsnap.native.library import core, using

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(core().library is None, reason="the native core is not in use"),
]

SHORT = excursion(1.6, rate=50.0, reach=0.3)
AHEAD = 13
"""Setpoints that may be prepared: those of a quarter of a second."""

PATIENT = SafetyRules(settle_time=0.2, max_gap=0.5, link_timeout=5.0, heartbeat_timeout=10.0, abort_distance=5.0)


@pytest.fixture
def vehicle():
    with StandIn(body=PointMass(in_ned(SHORT.position[0])), beat_period=0.2) as standin:
        yield standin


def begun(flight, vehicle):
    vehicle.until(lambda v: "ready" in flight.events)
    vehicle.enter()
    vehicle.until(lambda v: any(status.index is not None for status in flight.statuses))


def rows_of(vehicle):
    return [(m.x, m.y, m.z, m.vx, m.vy, m.vz, m.afx, m.afy, m.afz, m.yaw, m.yaw_rate) for m in sent(vehicle)]


def test_a_flight_arrives_as_it_was_planned_and_says_how_it_was_sent(vehicle):
    with Flight(vehicle, SHORT, Clock(), rules=PATIENT) as flight:
        begun(flight, vehicle)
        vehicle.until(lambda v: "holding the end" in flight.events)
        vehicle.enter(POSCTL)
        report = flight.result()
        table = prepare(SHORT, flight.options)
    steps = [status.index for status in flight.statuses if status.index is not None]
    assert report.completed and report.flown == len(steps)
    assert steps == sorted(set(steps)) and steps[0] == 0
    flown = [tuple(np.float32(table.rows[step]).tolist()) for step in steps]
    arrived = rows_of(vehicle)
    first = arrived.index(flown[1]) - 1
    assert arrived[first : first + len(flown)] == flown
    assert sum("setpoints leave from a thread of their own" in event for event in flight.events) == 1


def test_setpoints_leave_while_the_rest_of_the_program_is_busy(vehicle):
    with Flight(vehicle, SHORT, Clock(), rules=PATIENT) as flight:
        flight.streamer._observer._on_status = stall_once(flight, 0.2, after=0.8)
        begun(flight, vehicle)
        vehicle.until(lambda v: "holding the end" in flight.events)
        vehicle.enter(POSCTL)
        assert flight.result().completed
    steps = [status.index for status in flight.statuses if status.index is not None]
    after = steps[next(k for k, step in enumerate(steps) if step / 50.0 > 0.8) :]
    assert len([step for step in after[:11] if step < after[0] + 11]) >= 6


def test_a_pause_beyond_the_allowed_one_ends_the_flight(vehicle):
    """What was prepared leaves, a quarter of a second of it; the rest of the flight never does."""
    vehicle.patience = 60.0
    with Flight(vehicle, SHORT, Clock(), rules=PATIENT) as flight:
        flight.streamer._observer._on_status = stall_once(flight, 1.4, after=0.8)
        begun(flight, vehicle)
        vehicle.until(lambda v: any("no setpoint left this program" in event for event in flight.events))
        count = len(vehicle.setpoints)
        vehicle.until(lambda v: len(v.setpoints) > count + 20)
        assert stands_still(sent(vehicle)[count + 2 :])
        vehicle.enter(POSCTL)
        with pytest.raises(FlightError, match="no setpoint left this program"):
            flight.result()
    steps = [status.index for status in flight.statuses if status.index is not None]
    assert max(steps) <= (0.8 + 0.25) * 50 + 5


def test_a_stopped_flight_holds_its_place(vehicle):
    with Flight(vehicle, SHORT, Clock(), rules=PATIENT) as flight:
        begun(flight, vehicle)
        vehicle.until(lambda v: any((s.index or 0) > 40 for s in flight.statuses))
        flight.stop()
        vehicle.until(lambda v: any("stopped by the user" in event for event in flight.events))
        prepared = len(vehicle.setpoints) + AHEAD
        vehicle.until(lambda v: len(v.setpoints) > prepared + 20)
        assert stands_still(sent(vehicle)[prepared:]) and vehicle.mode == OFFBOARD
        vehicle.enter(POSCTL)
        assert flight.result().reason == "stopped by the user"


def encode(step, milliseconds):
    return setpoint_message(step.setpoint, 0, NOBODY, milliseconds)


class NOBODY:
    system = component = 1


def replaced_in_time(port):
    """A sender that was supplied twice before its first slot was due; None where the machine was too late for that."""
    link, clock = open_link(f"udpout:127.0.0.1:{port}", Clock()), Clock()
    sender = ThreadedSender.open(link, 50.0, clock.now() + 0.3, 0.5, encode)
    flown, held = SetpointStep(Setpoint((1.0, 2.0, 3.0)), 0), SetpointStep(Setpoint((0.0, 0.0, 5.0)))
    sender.deliver(0, flown, lambda slot: flown)
    sender.deliver(0, held, lambda slot: held)
    if clock.now() < sender.departures.due:
        return sender, link
    sender.close()
    link.close()
    return None


def test_what_is_decided_later_replaces_what_was_prepared():
    with socket(AF_INET, SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(10.0)
        supplied = None
        while supplied is None:
            supplied = replaced_in_time(receiver.getsockname()[1])
        sender, link = supplied
        parser = load_dialect().MAVLink(None)
        arrived = [parser.decode(bytearray(receiver.recv(300))) for _ in range(AHEAD - 1)]
        sender.close()
        link.close()
    assert {(message.x, message.y, message.z) for message in arrived} == {(0.0, 0.0, 5.0)}


def test_who_sends():
    with_thread = open_link("udpout:127.0.0.1:9", Clock())
    sender = open_sender(with_thread, Clock(), 50.0, 0.5, encode)
    assert isinstance(sender, ThreadedSender) and with_thread.numbering is not None
    sender.deliver(0, SetpointStep(Setpoint((1.0, 2.0, 3.0))), lambda slot: SetpointStep(None))
    sender.close()
    assert with_thread.numbering is None
    with_thread.close()
    ours, theirs = os.openpty()
    serial = open_link(f"serial:{os.ttyname(theirs)}:57600", Clock())
    sender = open_sender(serial, Clock(), 50.0, 0.5, encode)
    assert isinstance(sender, ThreadedSender)
    sender.close()
    serial.close()
    os.close(ours)
    os.close(theirs)
    signed = open_link("udpout:127.0.0.1:9", Clock(), signing_key=bytes(32))
    unknown = open_link("udpin:127.0.0.1:0", Clock())
    for link in (signed, unknown):
        assert isinstance(open_sender(link, Clock(), 50.0, 0.5, encode), DirectSender)
        link.close()
    with using("python"):
        plain = open_link("udpout:127.0.0.1:9", Clock())
        assert isinstance(open_sender(plain, Clock(), 50.0, 0.5, encode), DirectSender)
        plain.close()
