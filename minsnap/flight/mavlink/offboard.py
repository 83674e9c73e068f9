"""The function that flies a path, samples or a setpoint file over MAVLink."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import Any

import numpy as np

from minsnap.errors import FlightError
from minsnap.files.consistency import ConsistencyReport, check_samples
from minsnap.files.setpoint_csv import frame_of
from minsnap.flight.mavlink.link import Link, open_link
from minsnap.flight.mavlink.observer import EventCallback, StatusCallback
from minsnap.flight.mavlink.schedule import Clock
from minsnap.flight.mavlink.setpoints import SetpointTable, tabulate
from minsnap.flight.mavlink.stream_options import StreamOptions, StreamReport
from minsnap.flight.mavlink.streaming import Streamer
from minsnap.trajectory.path import Path
from minsnap.trajectory.samples import Samples


def stream(
    source: Samples | Path | str | os.PathLike[str],
    connect: str | Link,
    options: StreamOptions | None = None,
    *,
    clock: Clock | None = None,
    on_event: EventCallback | None = None,
    on_status: StatusCallback | None = None,
    **changes: Any,
) -> StreamReport:
    """Fly a path, samples or a setpoint file over MAVLink.

    Parameters
    ----------
    source : Path, Samples or path of a setpoint CSV
        In z-up world axes; a file in its own.
    connect : str or Link
        A connection string (:func:`~minsnap.flight.mavlink.link_transport.open_transport`), or an open link, which
        stays open.
    options : StreamOptions, optional
        How; each of its fields is also a keyword.
    clock : Clock, optional
        Monotonic time by default; that of the link if ``connect`` is a link.
    on_event, on_status : callable, optional
        See :class:`~minsnap.flight.mavlink.streaming.Streamer`.

    Returns
    -------
    StreamReport

    Raises
    ------
    FlightError
        If the setpoints are not consistent, the start is too far, or a rule stopped the flight.
    LinkError
        If the port cannot be opened or no vehicle answers.
    ImportError
        If pymavlink is not installed.
    """
    options = replace(options or StreamOptions(), **changes)
    clock = clock or Clock()
    table = prepare(source, options)
    link = connect if isinstance(connect, Link) else open_link(connect, clock)
    try:
        return Streamer(table, link, options, clock, on_event, on_status).run()
    finally:
        if link is not connect:
            link.close()


def prepare(source: Samples | Path | str | os.PathLike[str], options: StreamOptions) -> SetpointTable:
    """Read and check what is to be flown, and tabulate it as setpoints.

    Raises
    ------
    FlightError
        If the samples are not consistent with themselves; says how.
    InputError
        If what is to be added to them cannot be.
    """
    samples, frame = sampled(source, options)
    report = check_samples(samples)
    if not report.ok:
        raise FlightError(f"not fit to fly: {report.problems[0]}")
    feed_forward = options.feed_forward
    sent = feed_forward.stated(samples)
    table = tabulate(sent, options.rate, options.fields, frame, options.laps)
    options.check_rate(table.rate)
    return replace(table, note="; ".join(filter(None, (feed_forward.describe(samples), _at_speed(samples, report)))))


def _at_speed(samples: Samples, report: ConsistencyReport) -> str:
    """Say that a path begins or ends at speed, where the vehicle is held at rest."""
    if samples.velocity is None:
        return ""
    speeds = np.linalg.norm(samples.velocity[[0, -1]], axis=1)
    ends = zip(("begins", "ends"), speeds, (report.starts_at_rest, report.ends_at_rest), strict=True)
    moving = [f"{verb} at {speed:.2g} m/s" for verb, speed, rest in ends if not rest]
    return f"the path {' and '.join(moving)}, where the vehicle is held at rest" if moving else ""


def sampled(source: Samples | Path | str | os.PathLike[str], options: StreamOptions) -> tuple[Samples, str]:
    """Return the source as samples in z-up world axes, and its frame."""
    rate = 20.0 if options.rate is None else options.rate
    if isinstance(source, Samples):
        return source, options.frame or "enu"
    if isinstance(source, Path):
        return source.sample(rate), options.frame or "enu"
    from minsnap.files.convert import read_samples

    return read_samples(source, options.frame, rate), frame_of(source, options.frame) or "enu"
