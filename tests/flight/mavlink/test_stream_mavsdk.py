"""MAVSDK, neither ours nor of pymavlink, as the autopilot that receives: a minute of setpoints, field by field."""

import json
import socket
import threading
import time

import numpy as np
import pytest
from clocks import PatientClock
from flying import Flight, excursion, patient_rules
from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.mavlink_direct.mavlink_direct import MavlinkDirect

from minsnap.files.frames import map_samples
from minsnap.flight.mavlink.link import open_link

NAMES = "x y z vx vy vz afx afy afz yaw yaw_rate".split()
BLIND = patient_rules(max_start_distance=np.inf, link_timeout=1e6, heartbeat_timeout=1e6)


class Receiver:
    """An autopilot component of MAVSDK that keeps every setpoint it is sent."""

    def __init__(self, kind):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.AUTOPILOT))
        assert self.mavsdk.add_any_connection(f"{kind}://127.0.0.1:{self.port}") == 0
        self.messages, self.direct = [], None
        self._thread = threading.Thread(target=self._subscribe, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._thread.join(10.0)
        if self.direct is not None:
            self.direct.destroy()
        self.mavsdk.destroy()

    def _subscribe(self):
        deadline = time.monotonic() + 120.0
        while not (systems := self.mavsdk.get_systems()) and time.monotonic() < deadline:
            time.sleep(0.005)
        self.direct = MavlinkDirect(systems[0])
        self.direct.subscribe_message("SET_POSITION_TARGET_LOCAL_NED", self._take)

    def _take(self, message, _):
        self.messages.append(json.loads(message.fields_json))

    def until(self, condition, timeout=300.0):
        deadline = time.monotonic() + timeout
        while not condition():
            assert time.monotonic() < deadline, f"{len(self.messages)} setpoints came"
            time.sleep(0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "rate", "factor"), [("udp", 50.0, 16.0), ("udp", 20.0, 32.0), ("tcp", 20.0, 32.0)])
def test_a_minute_arrives_at_mavsdk_whole_in_order_and_equal_to_float32(kind, rate, factor):
    samples, clock = excursion(60.0, rate), PatientClock(factor)
    ned = map_samples(samples, "enu", "ned")
    columns = [ned.position, ned.velocity, ned.acceleration, ned.yaw[:, None], ned.yaw_rate[:, None]]
    expected = np.hstack(columns).astype(np.float32)
    with Receiver(f"{kind}in") as receiver:
        link = open_link(f"{'udpout' if kind == 'udp' else 'tcp'}:127.0.0.1:{receiver.port}", clock)
        options = {"trigger": "now", "autopilot": "generic", "rules": BLIND, "wait": 300.0}
        with Flight(None, samples, clock, link, **options) as flight:
            receiver.until(lambda: "nobody follows any more: done" in flight.events)  # its motors stand still
            receiver.until(lambda: [np.float32(receiver.messages[-1][name]) for name in NAMES] == expected[-1].tolist())
    rows = np.array([[message[name] for name in NAMES] for message in receiver.messages], dtype=np.float32)
    moving = int(np.argmax((rows != rows[0]).any(axis=1)))
    assert np.array_equal(rows[moving - 1 : moving - 1 + len(expected)], expected)
    stamps = [message["time_boot_ms"] for message in receiver.messages]
    assert stamps == sorted(stamps)
    assert {(m["type_mask"], m["coordinate_frame"], m["target_system"]) for m in receiver.messages} == {(0, 1, 1)}
