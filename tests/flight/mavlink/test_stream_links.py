"""What arrives at the other end, over UDP and TCP, on good links and bad ones, and in the log after the worst."""

import csv
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from clocks import SharedClock
from flying import PATH, START, Flight, excursion, patient_rules
from proxy import Proxy
from standin import OFFBOARD, POSCTL, PointMass, StandIn

from minsnap import write_csv
from minsnap.errors import FileError, FlightError
from minsnap.files.frames import map_samples
from minsnap.flight.mavlink.link import open_link
from minsnap.flight.mavlink.observer import COLUMNS

LENIENT = patient_rules(link_timeout=1e6, heartbeat_timeout=1e6, abort_distance=50.0)


def float32_rows(samples):
    """Every field of every setpoint, as it must arrive: the file in NED, rounded to the wire's float32."""
    ned = map_samples(samples, "enu", "ned")
    columns = [ned.position, ned.velocity, ned.acceleration, ned.yaw[:, None], ned.yaw_rate[:, None]]
    return np.hstack(columns).astype(np.float32)


def received_rows(vehicle):
    names = "x y z vx vy vz afx afy afz yaw yaw_rate".split()
    return np.array([[getattr(m, name) for name in names] for _, m in vehicle.setpoints], dtype=np.float32)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "rate"), [("udp", 20.0), ("tcp", 50.0)])
def test_a_minute_arrives_whole_in_order_and_equal_to_float32(kind, rate):
    samples, clock = excursion(60.0, rate), SharedClock()
    own, end = ("udpin", "udpout") if kind == "udp" else ("tcpin", "tcp")
    with StandIn(f"{own}:127.0.0.1:0", clock=clock, body=PointMass(START), patience=1e6) as vehicle:
        link = open_link(f"{end}:127.0.0.1:{vehicle.port}", clock)
        vehicle.enter()
        with Flight(vehicle, samples, clock, link, trigger="now", rules=LENIENT) as flight:
            vehicle.until(lambda v: "holding the end" in flight.events, timeout=300.0)
    rows, expected = received_rows(vehicle), float32_rows(samples)
    moving = int(np.argmax((rows != rows[0]).any(axis=1)))
    assert moving >= 2 * rate
    assert np.array_equal(rows[moving - 1 : moving - 1 + len(expected)], expected)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["udp", "tcp"])
def test_a_receiver_killed_and_restarted_meets_a_hold(kind):
    clock = SharedClock()
    own, end = ("udpin", "udpout") if kind == "udp" else ("tcpin", "tcp")
    body = PointMass(START)
    with StandIn(f"{own}:127.0.0.1:0", clock=clock, body=body) as vehicle:
        port = vehicle.port
        link = open_link(f"{end}:127.0.0.1:{port}", clock)
        flight = Flight(vehicle, PATH, clock, link)
        vehicle.until(lambda v: "ready" in flight.events)
        vehicle.enter()
        vehicle.until(lambda v: flight.statuses[-1].elapsed > 1.5)
    with flight:
        while not any("silent" in event for event in flight.events):
            clock.wait(clock.now() + 0.01)
        with StandIn(f"{own}:127.0.0.1:{port}", clock=clock, body=body) as again:
            again.enter()
            time.sleep(0.6)  # a TCP client tries again after half a second of real time
            again.until(lambda v: len(v.setpoints) > 40)
            rows = received_rows(again)
            assert (rows == rows[0]).all() and not rows[:, 3:9].any()
            again.enter(POSCTL)
            with pytest.raises(FlightError, match="link was silent"):
                flight.result()


def through(proxy, vehicle, clock, **options):
    return Flight(vehicle, PATH, clock, open_link(f"udpout:127.0.0.1:{proxy.port}", clock), **options)


@pytest.mark.slow
def test_a_lossy_late_network_is_flown_through_in_order():
    clock = SharedClock()
    with StandIn(clock=clock, body=PointMass(START)) as vehicle:
        with Proxy(vehicle.port, clock, drop=0.1, delay=0.08) as proxy, through(proxy, vehicle, clock) as flight:
            vehicle.until(lambda v: "ready" in flight.events)
            vehicle.enter()
            vehicle.until(lambda v: "holding the end" in flight.events)
            vehicle.enter(POSCTL)
            assert flight.result().completed
    stamps = [m.time_boot_ms for _, m in vehicle.setpoints]
    assert stamps == sorted(stamps) and not vehicle.failsafes
    assert 0.8 < len(stamps) / (stamps[-1] / 50) < 0.97


@pytest.mark.slow
def test_a_cut_cable_stops_the_flight_and_a_mended_one_finds_a_hold():
    clock = SharedClock()
    with StandIn(clock=clock, body=PointMass(START)) as vehicle:
        with Proxy(vehicle.port, clock) as proxy, through(proxy, vehicle, clock) as flight:
            vehicle.until(lambda v: "ready" in flight.events)
            vehicle.enter()
            vehicle.until(lambda v: flight.statuses[-1].elapsed > 1.5)
            proxy.cut = True
            vehicle.until(lambda v: any("link was silent" in event for event in flight.events))
            vehicle.until(lambda v: v.failsafes)
            proxy.cut = False
            vehicle.until(lambda v: v.mode == OFFBOARD)
            assert flight.statuses[-1].phase.value == "holding", "the stream that is back meets no rest of the flight"
            vehicle.enter(POSCTL)
            with pytest.raises(FlightError, match="link was silent"):
                flight.result()


@pytest.mark.slow
def test_a_delay_longer_than_the_link_timeout_is_no_silence():
    """What is late is not silent; but the rules see the vehicle as it was: the abort distance has to allow for it."""
    clock = SharedClock()
    with StandIn(clock=clock, body=PointMass(START)) as vehicle:
        with Proxy(vehicle.port, clock, delay=1.2) as proxy, through(proxy, vehicle, clock) as flight:
            vehicle.until(lambda v: "ready" in flight.events)
            vehicle.enter()
            vehicle.until(lambda v: any("from its setpoint" in e or "holding the end" in e for e in flight.events))


def read_log(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_the_log_has_all_that_was_sent_and_what_came_back(tmp_path):
    clock, path = SharedClock(), tmp_path / "flight.csv"
    with StandIn(clock=clock, body=PointMass(START)) as vehicle:
        with Flight(vehicle, PATH, clock, log=path) as flight:
            vehicle.until(lambda v: "ready" in flight.events)
            vehicle.enter()
            vehicle.until(lambda v: "holding the end" in flight.events)
            vehicle.enter(POSCTL)
            report = flight.result()
    lines = read_log(path)
    assert tuple(lines[0]) == COLUMNS and lines[0]["text"] == "frame=ned"
    flown = [line for line in lines if line["kind"] == "setpoint" and line["index"]]
    rows = np.array([[float(line[name]) for name in COLUMNS[3:14]] for line in flown])
    steps = [int(line["index"]) for line in flown]
    assert np.array_equal(rows.astype(np.float32), float32_rows(PATH)[steps]) and len(flown) == report.flown
    assert steps == sorted(steps) and len(steps) + report.schedule.skipped >= len(PATH)
    kinds = {line["kind"] for line in lines}
    assert kinds == {"setpoint", "position", "heartbeat", "event"}
    assert {line["custom_mode"] for line in lines if line["kind"] == "heartbeat"} == {str(3 << 16), str(6 << 16)}
    with pytest.raises(FileError, match="logs are not replaced"):
        Flight(vehicle, PATH, clock, log=path, link=flight.link)


SCRIPT = """
import sys
import time
from minsnap.flight import stream
stream(sys.argv[1], sys.argv[2], trigger="now", log=sys.argv[3], on_event=lambda text: print(text, flush=True))
"""


@pytest.mark.slow
def test_a_log_is_complete_to_the_last_line_after_kill_9(tmp_path):
    source, path = tmp_path / "path.csv", tmp_path / "flight.csv"
    write_csv(PATH, source)
    with StandIn(body=PointMass(START)) as vehicle:
        vehicle.enter()
        command = [sys.executable, "-c", SCRIPT, source, f"udpout:127.0.0.1:{vehicle.port}", path]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
            vehicle.until(lambda v: len(v.setpoints) > 55)
            os.kill(process.pid, signal.SIGKILL)
        vehicle.until(lambda v: v.failsafes)
    assert path.read_bytes().endswith(b"\n")
    logged = [line for line in read_log(path) if line["kind"] == "setpoint"]
    assert len(logged) >= len(vehicle.setpoints) - 1
    assert all(None not in line.values() for line in read_log(path))
