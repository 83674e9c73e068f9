"""How punctual streaming is: setpoints to a second process over loopback UDP, in real time, counted where they arrive.

Run it by hand: ``python benchmarks/bench_stream.py --rate 50 --seconds 60 --load 2``, where the load is so many busy
processes of stress-ng. It prints one line of JSON.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import platform
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection

import numpy as np

from minsnap import Samples
from minsnap.flight import SafetyRules, StreamStatus, stream

OFFBOARD, POSITION = 6 << 16, 3 << 16


def fly_in_place(rate: float, seconds: float) -> Samples:
    """Up and down by a few centimetres, so that every setpoint is another."""
    t = np.arange(round(rate * seconds) + 1) / rate
    w = 2 * np.pi * round(seconds) / seconds / 10
    up = np.array([0.0, 0.0, 0.05])
    return Samples(
        t,
        np.outer(1 - np.cos(w * t), up) + [0, 0, 1],
        np.outer(w * np.sin(w * t), up),
        np.outer(w**2 * np.cos(w * t), up),
        yaw=np.zeros_like(t),
        yaw_rate=np.zeros_like(t),
    )


def receive(pipe: Connection, count: int) -> None:
    """Be an autopilot in OFFBOARD at the start until enough setpoints have come, then leave it."""
    os.environ["MAVLINK20"] = "1"
    from pymavlink import mavutil

    link = mavutil.mavlink_connection("udpin:127.0.0.1:0", source_system=1, source_component=1)
    pipe.send(link.port.getsockname()[1])
    arrived: list[float] = []
    heights: list[float] = []
    mode, beat, place, done = OFFBOARD, 0.0, 0.0, float("inf")
    while time.monotonic() < done:
        link.select(0.005)
        while (message := link.recv_msg()) is not None:
            if message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
                arrived.append(time.monotonic())
                heights.append(message.z)
        now = time.monotonic()
        if len(arrived) >= count and mode == OFFBOARD:
            mode, done = POSITION, now + 3.0
        if now >= beat:
            link.mav.heartbeat_send(2, 12, 129, mode, 4)
            beat = now + 1.0
        if now >= place:
            link.mav.local_position_ned_send(0, 0, 0, heights[-1] if heights else -1.0, 0, 0, 0)
            place = now + 0.05
    pipe.send((arrived, heights))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rate", type=float, default=50.0)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--load", type=int, default=0, help="busy processes of stress-ng beside it")
    wanted = parser.parse_args()
    with busy(wanted.load):
        measure(wanted.rate, wanted.seconds, wanted.load)


@contextmanager
def busy(processes: int) -> Iterator[None]:
    """Keep so many processes busy."""
    if not processes:
        yield
        return
    load = subprocess.Popen(["stress-ng", "--cpu", str(processes), "--quiet"])
    try:
        yield
    finally:
        load.terminate()
        load.wait()


def measure(rate: float, seconds: float, load: int) -> None:
    """Fly and print what was measured."""
    samples = fly_in_place(rate, seconds)
    ours, theirs = multiprocessing.Pipe()
    hold = round(3.5 * rate)
    receiver = multiprocessing.Process(target=receive, args=(theirs, len(samples) + hold), daemon=True)
    receiver.start()
    steps: list[int] = []
    said: list[str] = []

    def note(status: StreamStatus) -> None:
        if status.index is not None:
            steps.append(status.index)

    connection, rules = f"udpout:127.0.0.1:{ours.recv()}", SafetyRules(abort_distance=9)
    report = stream(samples, connection, trigger="now", rules=rules, on_status=note, on_event=said.append)
    arrived, heights = ours.recv()
    gaps = np.diff(arrived) * rate
    flown = np.float32(-samples.position[steps, 2])
    first = int(np.argmax(np.float32(heights) != flown[0])) - 1
    equal = np.array_equal(np.float32(heights)[first : first + len(flown)], flown)
    schedule = report.schedule
    print(
        json.dumps(
            {
                "rate": rate,
                "seconds": seconds,
                "busy processes": load,
                "system load": os.getloadavg()[0],
                "sender": next((text for text in said if "thread" in text), "the interpreter"),
                "sent": schedule.sent,
                "arrived": len(arrived),
                "skipped": schedule.skipped,
                "what was sent arrived, equal and in order": bool(equal),
                "mean rate": schedule.rate,
                "lateness ms (median, p99, p99.9, worst)": [
                    round(1e3 * x, 3) for x in (schedule.median, schedule.p99, schedule.p999, schedule.worst)
                ],
                "gaps in steps (p1, p99, largest)": np.percentile(gaps, [1, 99, 100]).round(3).tolist(),
                "python": platform.python_version(),
                "cores": os.cpu_count(),
            }
        )
    )


if __name__ == "__main__":
    main()
