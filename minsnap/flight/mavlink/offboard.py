"""The functions that fly a path, samples, a setpoint file or a whole fleet over MAVLink."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np

from minsnap.errors import FlightError, InputError
from minsnap.files.consistency import ConsistencyReport, check_samples
from minsnap.files.setpoint_csv import frame_of
from minsnap.flight.mavlink.link import Link, open_link
from minsnap.flight.mavlink.observer import EventCallback, StatusCallback
from minsnap.flight.mavlink.schedule import Clock, CommonFlight
from minsnap.flight.mavlink.sender import undisturbed
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
        A connection string (:func:`~minsnap.flight.mavlink._transports.open_transport`), or an open link, which
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


def stream_together(
    tables: Sequence[SetpointTable],
    links: Sequence[Link],
    options: Sequence[StreamOptions],
    names: Sequence[str],
    clock: Clock,
    on_event: Callable[[str], None] | None = None,
    on_status: StatusCallback | None = None,
    begun: Callable[[Callable[[], None]], None] = lambda stop: None,
) -> list[StreamReport | FlightError]:
    """Fly several vehicles, each over its own link, from one instant on; what stops one stops all where they are.

    Parameters
    ----------
    tables, links, options, names : sequence
        One each a vehicle; options with a callable trigger, the first of which lets all go.
    clock : Clock
        The same as the links'.
    on_event : callable, optional
        Told sentences, each begun by the vehicle's name, from several threads.
    on_status : callable, optional
        Called with the status of the first vehicle.
    begun : callable, optional
        Called with what stops all, before they fly.

    Returns
    -------
    list
        What each flight reports, or the error that ended it.

    Raises
    ------
    InputError
        If the rates differ.
    """
    rates = {table.rate for table in tables}
    if len(rates) > 1:
        raise InputError(f"the setpoints of a fleet have one rate, and these have {sorted(rates)}: give --rate")
    trigger = options[0].trigger
    common = CommonFlight(names, clock, rates.pop(), trigger if callable(trigger) else lambda: True)

    def said(name: str) -> Callable[[str], None] | None:
        return None if on_event is None else lambda text: on_event(f"{name}: {text}")

    flights = [
        Streamer(table, link, option, clock, said(name), None if k else on_status, common=(common, k))
        for k, (table, link, option, name) in enumerate(zip(tables, links, options, names, strict=True))
    ]

    def stop() -> None:
        for flight in flights:
            flight.stop()

    begun(stop)

    def fly(flight: Streamer, member: int) -> StreamReport | FlightError:
        try:
            return flight.run()
        except FlightError as error:
            common.tell(member, False, str(error))
            return error
        except BaseException as error:
            common.tell(member, False, str(error))
            raise

    with undisturbed(type(clock) is Clock) as granted, ThreadPoolExecutor(len(flights)) as pool:
        if granted and on_event is not None:
            on_event(granted)
        return [future.result() for future in [pool.submit(fly, flight, k) for k, flight in enumerate(flights)]]
