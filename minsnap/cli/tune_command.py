"""The command that corrects setpoints by what flights of them missed: from a log, or flying them itself."""

from __future__ import annotations

import sys
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from minsnap.cli import options
from minsnap.cli.command import command
from minsnap.cli.flying import FlightOptions
from minsnap.errors import FlightError, InputError, LinkError

if TYPE_CHECKING:
    from minsnap.flight.mavlink.stream_options import StreamOptions
    from minsnap.trajectory.samples import Samples

_DISARMED = 60.0  # how long a vehicle may take to land and disarm, which closes its log [s]


@command()
def tune(
    flying: FlightOptions,
    plan: Annotated[Path, "PLAN", "Setpoint CSV of what is to be flown."],
    flight: Annotated[Path | None, "[FLIGHT]", "Log of a flight: .ulg, .bin, or of stream --log."] = None,
    *,
    output: Annotated[Path, "--output", "-o", "FILE", "Setpoint CSV of the next flight."] = Path("tuned.csv"),
    sent: Annotated[Path | None, "FILE", "What was sent in that flight; by default the plan."] = None,
    gain: Annotated[float, "Share of the error that is corrected."] = 0.8,
    frame: options.ReadFrame = None,
    connect: Annotated[str | None, "LINK", options.LINKS] = None,
    flights: Annotated[int, "With --connect: how often to fly."] = 2,
    logs: Annotated[Path | None, "FOLDER", "Where the autopilot's logs appear; else fetched by MAVLink."] = None,
    report: options.FlightReport = None,
) -> None:
    """Write setpoints whose flight misses the plan by less: what the last flight missed, filtered, is added earlier.

    With --connect it flies the plan, fetches the log, learns, flies again, and compares; with a log it learns from
    that flight, and the next one's with --sent. Three flights took 84 to 94 % off the error in simulation.
    """
    from minsnap.basics.storage.atomic import refuse_source
    from minsnap.files.setpoint_csv import frame_of, read_csv, write_csv
    from minsnap.flight.tracking.tracking_plot import write_flight_page
    from minsnap.flight.tracking.tuning import LearningSettings, best_to_fly, learn_from, tune_in_flight

    if (flight is None) == (connect is None):
        raise InputError("give the log of a flight, or --connect to fly: one of them")
    for written in (output, report):
        refuse_source(written, plan, flight, sent)
    wanted, before, axes = read_csv(plan, frame), read_csv(sent or plan, frame), frame_of(plan, frame)
    settings = LearningSettings(gain=gain)
    if flight is not None:
        flown = [learn_from(wanted, before, flight, settings)]
    else:
        assert connect is not None
        pilot = _Pilot(connect, flying.settings(frame=axes), output, logs, flying.preflight)
        flown = tune_in_flight(wanted, pilot.fly, flights, settings, before)
    write_csv(best_to_fly(flown), output, frame=axes)
    if report is not None:
        named = {f"flight {number}": each for number, each in enumerate(flown, 1)}
        pages = {name: each.flown for name, each in named.items()}
        logged = {name: each.log for name, each in named.items()}
        write_flight_page(pages, report, title="Flights of one plan, tuned", logs=logged)
    for number, each in enumerate(flown, 1):
        which = "this flight" if len(flown) == 1 else f"flight {number}"
        greatest = each.flown.comparison.max_error
        print(f"{which} missed the plan by {each.missed:.3f} m (rms), {greatest:.3f} m at most")
    print(f"its delay was {flown[-1].delay:.2f} s; {output} is for the next one")


class _Pilot:
    """Flies setpoints and fetches the log of each flight; files are named after the output."""

    def __init__(self, connect: str, how: StreamOptions, output: Path, logs: Path | None, preflight: bool) -> None:
        self._connect, self._how, self._output = connect, how, output
        self._logs, self._preflight = logs, preflight

    def fly(self, sent: Samples, number: int) -> Path:
        """Fly, and return the autopilot's log, or that of the stream where there is none."""
        from minsnap.cli.flying import fly
        from minsnap.files.setpoint_csv import write_csv

        stem = self._output.with_suffix("")
        write_csv(sent, f"{stem}-{number}.csv", frame=self._how.frame or "enu")
        own = Path(f"{stem}-{number}.log.csv")
        own.unlink(missing_ok=True)
        flown = fly(sent, self._connect, replace(self._how, log=own), None, None, self._preflight, None)
        if not flown.completed:
            raise FlightError(f"flight {number} was not completed: {flown.reason}", report=flown)
        try:
            return self._newest() if self._logs is not None else self._fetched(stem, number)
        except LinkError as error:
            print(f"minsnap: the log of the stream is used, for {error}", file=sys.stderr)
            return own

    def _newest(self) -> Path:
        assert self._logs is not None
        logs = [file for file in self._logs.rglob("*") if file.suffix.lower() in (".ulg", ".bin")]
        if not logs:
            raise InputError(f"{self._logs} holds no .ulg and no .bin: --logs is the folder of the autopilot's logs")
        return max(logs, key=lambda file: file.stat().st_mtime)

    def _fetched(self, stem: Path, number: int) -> Path:
        from minsnap.flight.mavlink.link import Clock, open_link
        from minsnap.flight.mavlink.parameters import download_log
        from minsnap.flight.mavlink.vehicle_messages import PX4

        clock = Clock()
        with closing(open_link(self._connect, clock)) as link:
            link.wait_for_vehicle(self._how.wait)
            print("minsnap: waiting for the vehicle to disarm, which closes its log", file=sys.stderr)
            deadline = clock.now() + _DISARMED
            while link.vehicle.armed and clock.now() < deadline:
                for _ in link.pump(clock.now() + 0.2):
                    pass
            if link.vehicle.armed:
                raise LinkError("the vehicle is still armed, and its log is open")
            place = Path(f"{stem}-{number}{'.ulg' if link.vehicle.autopilot == PX4 else '.bin'}")
            download_log(link, clock, place)
            return place
