"""A goal that moves is followed over MAVLink: 20 setpoints a second, up to 50 replans, against a receiver.

The receiver is that of ``stream_with_callbacks.py``, wherever the last setpoint was. A second thread replans from what
is flown, and hands each change to the stream, which takes it over at its splice and refuses what comes late. The budget
of a replan begins at 20 ms and grows where the machine needs more.

``python examples/follow_a_moving_goal.py [FOLDER [SECONDS]]``: five seconds unless given, 600 for ten minutes.
"""

import sys
import threading
import time
from pathlib import Path

import numpy as np
from stream_with_callbacks import POSITION, Receiver

import minsnap
from minsnap.errors import MinsnapError
from minsnap.flight.mavlink import SafetyRules, Streamer, StreamOptions, open_link
from minsnap.flight.mavlink.link import Clock
from minsnap.flight.mavlink.offboard import prepare

LIMITS = minsnap.Limits(speed=1.5, acceleration=3.0)
ROOM = minsnap.Room((-5.0, -5.0, 0.5), (5.0, 5.0, 3.0))
LEAST, MOST = 0.02, 0.2


def goal_at(t: float) -> np.ndarray:
    """Return a point on a circle of 2 m, at 0.8 m/s, around the height of 1.5 m."""
    return np.array([2.0 * np.cos(0.4 * t + 2.0), 2.0 * np.sin(0.4 * t + 2.0), 1.5 + 0.3 * np.sin(t)])


def follow(streamer: Streamer, flown: minsnap.Trajectory, seconds: float, counts: dict[str, int]) -> None:
    """Replan from what is flown, again and again, until the time is over or the flight is."""
    replanner = minsnap.Replanner(LIMITS, room=ROOM)
    while streamer.now is None:
        time.sleep(LEAST)
    began, budget = time.monotonic(), LEAST
    while time.monotonic() - began < seconds and (now := streamer.now) is not None:
        if now < 0.0:  # the last change has not begun yet
            time.sleep(-now)
            continue
        kind = "new"
        try:
            change = replanner.replan(flown, now, goal_at(time.monotonic() - began)[None], budget)
            flown = streamer.change(change)
            kind = "kept" if change.kept else "new"
        except MinsnapError:
            kind = "refused"
        counts[kind] += 1
        budget = max(LEAST, 0.9 * budget) if kind == "new" else min(MOST, 1.5 * budget)


def main(folder: Path, seconds: float) -> None:
    """Fly after the goal, then hold, and write the setpoints that arrived."""
    receiver, clock = Receiver((0.0, 2.0, -1.5)), Clock()
    receiver.start()
    first = minsnap.plan([(2.0, 0.0, 1.5), goal_at(0.0)], limits=LIMITS, corridor=ROOM, pieces=1)
    options = StreamOptions(rate=20.0, trigger="now", rules=SafetyRules(abort_distance=1.0), delay=0.1)
    counts = {"new": 0, "kept": 0, "refused": 0}

    def on_status(status):
        if status.phase.value == "holding":
            receiver.mode = POSITION

    link = open_link(f"udpout:127.0.0.1:{receiver.port}", clock)
    streamer = Streamer(prepare(first, options), link, options, clock, print, on_status)
    follower = threading.Thread(target=follow, args=(streamer, first, seconds, counts))
    follower.start()
    report = streamer.run()
    follower.join()
    link.close()
    receiver.running = False
    receiver.join()
    folder.mkdir(parents=True, exist_ok=True)
    np.savetxt(folder / "followed.csv", np.array(receiver.path), delimiter=",", header="x,y,z (NED)")
    jump = np.abs(np.diff(np.array(receiver.path), axis=0)).max()
    print(f"{report.flown} setpoints flown; {counts}; largest step between setpoints {jump:.3f} m")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"), float(sys.argv[2]) if len(sys.argv) > 2 else 5.0)
