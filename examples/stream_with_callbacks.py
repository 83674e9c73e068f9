"""A flight over MAVLink from Python, against a receiver in the same program that stands in for the autopilot.

The receiver says that it is PX4, in OFFBOARD, wherever the last setpoint was; when the end is held it leaves the
mode, as a pilot would, and the flight is over. The log is a CSV that is whole up to its last line whatever happens.
"""

import os
import sys
import threading
import time
from pathlib import Path

import minsnap
from minsnap.flight import SafetyRules, StreamStatus, stream

OFFBOARD, POSITION = 6 << 16, 3 << 16


class Receiver(threading.Thread):
    """The least that a vehicle says: heartbeats and positions, from a place [m] (NED) on; ``path`` is where it was."""

    def __init__(self, place):
        super().__init__(daemon=True)
        os.environ["MAVLINK20"] = "1"
        from pymavlink import mavutil

        self.link = mavutil.mavlink_connection("udpin:127.0.0.1:0", source_system=1, source_component=1)
        self.port = self.link.port.getsockname()[1]
        self.mode, self.place, self.running, self.path = OFFBOARD, place, True, []

    def run(self):
        """Answer until told to stop."""
        while self.running:
            while (message := self.link.recv_msg()) is not None:
                if message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
                    self.place = (message.x, message.y, message.z)
                    self.path.append(self.place)
            self.link.mav.heartbeat_send(2, 12, 129, self.mode, 4)
            self.link.mav.local_position_ned_send(0, *self.place, 0, 0, 0)
            time.sleep(0.02)
        self.link.close()


def main(folder: Path) -> None:
    """Fly a metre forward, telling where it is on the way."""
    receiver = Receiver((0.0, 0.0, -1.0))
    receiver.start()
    reached = [0]

    def on_status(status: StreamStatus) -> None:
        quarter = round(4 * status.elapsed / status.duration)
        if quarter > reached[0]:
            reached[0] = quarter
            print(f"{status.elapsed:.1f} s: {status.setpoint.position}")
        if status.phase.value == "holding":
            receiver.mode = POSITION

    path = minsnap.plan([(0, 0, 1), (0.5, 0.2, 1.2), (1, 0, 1)], total_time=2.0)
    folder.mkdir(parents=True, exist_ok=True)
    log = folder / "stream.csv"
    log.unlink(missing_ok=True)
    report = stream(
        path,
        f"udpout:127.0.0.1:{receiver.port}",
        rate=50.0,
        trigger="now",
        rules=SafetyRules(abort_distance=0.5),
        delay=0.1,
        log=log,
        on_event=print,
        on_status=on_status,
    )
    receiver.running = False
    receiver.join()
    print(f"{report.flown} setpoints flown, {report.schedule.skipped} left out, fields {', '.join(report.fields)}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
