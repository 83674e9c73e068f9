"""The command that relays motion-capture poses to an autopilot."""

from __future__ import annotations

import signal
import sys
from contextlib import closing
from typing import TYPE_CHECKING, Annotated

from minsnap.cli.command import command

if TYPE_CHECKING:
    from minsnap.flight.mocap import RelayReport


@command()
def relay(
    *,
    source: Annotated[str, "--from", "SOURCE", "natnet:SERVER[,LOCAL], udp:[HOST:]PORT or csv:FILE."],
    target: Annotated[str, "--to", "LINK", "MAVLink connection, as for stream."],
    message: Annotated[str, "vision (VISION_POSITION_ESTIMATE), odometry, odometry-mocap or mocap."] = "vision",
    frame: Annotated[str, "Of the source: optitrack, flu, enu …"] = "optitrack",
    rate: Annotated[float, "HZ", "Poses per second at most."] = 50.0,
    max_age: Annotated[float, "S", "Older poses are not sent."] = 0.1,
    body: Annotated[str | None, "Which body, where there are several."] = None,
) -> int:
    """Pass motion-capture poses on to an autopilot's estimator, until Ctrl-C or the end of a file.

    PX4's default estimator fuses vision and odometry; odometry-mocap (ODOMETRY as from motion capture) and mocap
    (ATT_POS_MOCAP) go to topics that it does not read. Rate and latency are printed once per second.
    """
    from minsnap.flight.mavlink.link import Clock, open_link
    from minsnap.flight.mocap import Relay, open_source

    clock = Clock()
    with closing(open_link(target, clock)) as link:
        with closing(open_source(source, body, clock)) as poses:
            runner = Relay(poses, link, clock, message, frame, rate, max_age)
            for number in (signal.SIGINT, signal.SIGTERM):
                signal.signal(number, lambda *_: runner.stop())
            report = runner.run(lambda so_far: print(_line(so_far), file=sys.stderr, flush=True))
    print(_line(report))
    return 0 if report.sent else 1


def _line(report: RelayReport) -> str:
    """Return a report in one line."""
    return (
        f"{report.sent} poses at {report.rate:.1f} Hz, {1e3 * report.latency:.1f} ms old (99 %: "
        f"{1e3 * report.latency_p99:.1f} ms), {report.stale} slots without a fresh one, {report.rejected} rejected"
    )
