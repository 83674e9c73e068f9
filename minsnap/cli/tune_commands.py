"""The command that learns setpoints from flights: from the log of one, or flight after flight over MAVLink."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import minsnap
from minsnap.basics.storage.atomic import refuse_source
from minsnap.cli import options
from minsnap.cli.app import command, tell
from minsnap.cli.flight_commands import FlightOptions, fly
from minsnap.errors import FileError, FlightError, InputError, LinkError
from minsnap.flight.mavlink.vehicle_messages import PX4, get_autopilot

if TYPE_CHECKING:
    from minsnap.flight.mavlink.link import Clock
    from minsnap.flight.mavlink.stream_options import StreamOptions
    from minsnap.flight.tracking.tuning import LearningSettings, TunedFlight

_DISARMED = 60.0  # how long a vehicle may take to land and disarm, which closes its log [s]
_PARTS = 3  # logs of a flight that are fetched at most
_SAID, _LONG = 10.0, 60.0  # how often the progress of a download is said, and what is long for one [s]


@dataclass(frozen=True)
class Learning:
    """What setpoints are learned from, and within which bounds."""

    sent: Annotated[Path | None, "FILE", "What was sent in that flight; by default the plan."] = None
    gain: Annotated[float, "Share of the error that is corrected."] = 0.8
    limits: Annotated[
        Path | None, "FILE", "Limits of the vehicle, as limits -o writes them; else --connect asks it."
    ] = None

    def bounds(self) -> minsnap.Limits | None:
        """Return the limits of the file, if one is given."""
        from minsnap.files import read_limits

        return None if self.limits is None else read_limits(self.limits)


@command()
def tune(
    flying: FlightOptions,
    learning: Learning,
    plan: Annotated[Path, "PLAN", "Setpoint CSV of what is to be flown."],
    flight: Annotated[Path | None, "[FLIGHT]", "Log of a flight: .ulg, .bin, or of stream --log."] = None,
    *,
    output: Annotated[Path, "--output", "-o", "FILE", "Setpoint CSV of the next flight."] = Path("tuned.csv"),
    frame: options.ReadFrame = None,
    connect: Annotated[str | None, "LINK", options.LINKS] = None,
    flights: Annotated[int, "With --connect: how often to fly."] = 2,
    logs: Annotated[
        Path | None, "FOLDER", "Where the autopilot's logs appear; else fetched by MAVLink, PX4's at 7 kB/s."
    ] = None,
    report: options.FlightReport = None,
) -> None:
    """Write setpoints that correct the tracking error of a flight.

    The error of the flight is added to the setpoints, earlier by the delay, as a smooth curve within the limits of the
    vehicle, and within half as much again as the plan asks for. With --connect it flies the plan, fetches the log,
    corrects, flies again and compares. With a log it corrects from that flight; --sent names what was sent in it.
    Learning ends where a flight is no better than the one before. In simulation three flights reduced the error by 83
    to 94 %.
    """
    from minsnap.files import frame_of, read_csv
    from minsnap.flight.tracking.tuning import LearningSettings, learn_from, tune_in_flight

    if (flight is None) == (connect is None):
        raise InputError("give the log of a flight, or --connect to fly: one of them")
    for written in (output, report):
        refuse_source(written, plan, flight, learning.sent, learning.limits)
    files, axes = [learning.sent or plan], frame_of(plan, frame)
    wanted, before = read_csv(plan, frame), read_csv(files[0], frame)
    settings, bounds = LearningSettings(gain=learning.gain), learning.bounds()
    if flight is not None:
        flown = [learn_from(wanted, before, flight, settings, bounds)]
    else:
        assert connect is not None
        files = [Path(f"{output.with_suffix('')}-{number}.csv") for number in range(1, flights + 1)]
        for written in files:
            refuse_source(written, plan, learning.sent)
        pilot = _Pilot(connect, flying.settings(frame=axes), output, logs, flying.preflight)
        flown = tune_in_flight(wanted, pilot.fly, flights, settings, before, bounds or pilot.limits())
    if report is not None:
        _report(flown, report)
    _say(flown)
    end = _finish(flown, files, output, axes, settings)
    print(f"its delay was {flown[-1].delay:.2f} s; {end}")


def _report(flown: list[TunedFlight], report: Path) -> None:
    from minsnap.flight.tracking.tracking_plot import write_flight_page

    pages = {f"flight {number}": each.flown for number, each in enumerate(flown, 1)}
    logged = dict(zip(pages, [each.log for each in flown], strict=True))
    write_flight_page(pages, report, title="Flights of one plan, tuned", logs=logged)


def _say(flown: list[TunedFlight]) -> None:
    for number, each in enumerate(flown, 1):
        for remark in each.flown.remarks():
            tell(f"{each.log}: {remark}")
        which = "this flight" if len(flown) == 1 else f"flight {number}"
        greatest = each.flown.comparison.max_error
        print(f"{which} missed the plan by {each.missed:.3f} m (rms), {greatest:.3f} m at most")


def _finish(flown: list[TunedFlight], sent: list[Path], output: Path, axes: str, settings: LearningSettings) -> str:
    """Write what is to be flown next, with a note on the flight that it is from, and return a sentence on it.

    The note on what was sent in a flight by hand tells of the flight before.
    """
    from minsnap.files import learned_of, note_frame, read_csv, write_csv
    from minsnap.flight.tracking.tuning import helped

    missed, files = [each.missed for each in flown], list(sent)
    if len(flown) == 1 and (known := learned_of(sent[0])) is not None:
        missed, files = [known[0], *missed], [sent[0].parent / known[1], *files]
    helps = len(missed) < 2 or helped(missed[-2], missed[-1], settings)
    best = len(missed) - 1 if helps else missed.index(min(missed))
    setpoints = flown[-1].next if helps else read_csv(files[best], axes)
    write_csv(setpoints, output, frame=axes)
    name = os.path.relpath(files[best], output.parent)
    note_frame(output, axes, setpoints.rate, lead=setpoints.lead, learned=(missed[best], name))
    if helps:
        return f"{output} is for the next one"
    how = "more than" if missed[-1] > missed[-2] else "hardly less than"
    end = f"learning ends: it missed by {how} the {missed[-2]:.3f} m of the flight before"
    return f"{end}; {output} is {files[best].name}, the best that was flown"


def _told(clock: Clock) -> Callable[[float], None]:
    """Return what says how far the download of a log is, every ten seconds."""
    began = said = clock.now()

    def progress(share: float) -> None:
        nonlocal said
        now = clock.now()
        if now - said < _SAID or not 0.0 < share < 1.0:
            return
        said, left = now, (now - began) * (1.0 / share - 1.0)
        other = "; --logs FOLDER reads it where the autopilot writes it" if left > _LONG else ""
        tell(f"the log: {share:.0%} are here, {left / 60.0:.1f} min to go{other}")

    return progress


class _Pilot:
    """Flies setpoints and fetches the log of each flight; files are named after the output."""

    def __init__(self, connect: str, how: StreamOptions, output: Path, logs: Path | None, preflight: bool) -> None:
        self._connect, self._how, self._output = connect, how, output
        self._logs, self._preflight = logs, preflight
        if logs is not None:
            self._files()

    def fly(self, sent: minsnap.Samples, number: int) -> Path:
        """Fly, and return the autopilot's log, or that of the stream where there is none that can be read."""
        stem = self._output.with_suffix("")
        minsnap.write_csv(sent, f"{stem}-{number}.csv", frame=self._how.frame or "enu")
        own = Path(f"{stem}-{number}.log.csv")
        own.unlink(missing_ok=True)
        before = self._known()
        flown = fly(sent, self._connect, replace(self._how, log=own), self._preflight)
        if not flown.completed:
            raise FlightError(f"flight {number} was not completed: {flown.reason}", report=flown)
        try:
            fetched = self._fetched(before, f"{stem}-{number}") if self._logs is None else self._written(before)
            return self._of_flight(sent, fetched)
        except (LinkError, FileError, InputError, ImportError) as error:
            tell(f"the log of the stream is used, for {error}")
            return own

    @staticmethod
    def _of_flight(sent: minsnap.Samples, logs: Iterable[Path]) -> Path:
        """Return the first log with a whole flight of what was sent: an autopilot may close one as soon as it lands.

        Raises
        ------
        LinkError, FileError, InputError, ImportError
            What is wrong with the last, if there is none.
        """
        from minsnap.flight.tracking.log_comparison import compare_in_log
        from minsnap.flight.tracking.tuning import flight_in

        wrong: Exception = LinkError("there is no log of it")
        for log in logs:
            try:
                place = compare_in_log(sent, *flight_in(log))[-1].place
            except (FileError, InputError) as error:
                wrong = error
                continue
            if place is not None and place.end is None:
                return log
            wrong = InputError(f"{log} has a part of the flight alone")
        raise wrong

    def limits(self) -> minsnap.Limits | None:
        """Return the limits that the vehicle's parameters set; None, in a sentence, where it does not tell them."""
        from minsnap.flight.mavlink.link import Clock, open_link
        from minsnap.flight.mavlink.parameters import PARAMETERS, Parameters, autopilot_limits

        clock = Clock()
        with closing(open_link(self._connect, clock)) as link:
            stack = get_autopilot(self._how.autopilot, link.wait_for_vehicle(self._how.wait)).name
            values = Parameters(link, clock).read_known(PARAMETERS.get(stack, ()))
        try:
            return autopilot_limits(stack, {name: each.value for name, each in values.items()})
        except LinkError as error:
            tell(f"{error}: what is learned keeps to half as much again as the plan asks for")
            return None

    def _known(self) -> list[Any]:
        """Return what tells the logs that are there already: files as they are, or the vehicle's own entries."""
        from minsnap.flight.mavlink.link import Clock, open_link
        from minsnap.flight.mavlink.log_download import list_logs

        if self._logs is not None:
            return self._files()
        clock = Clock()
        with closing(open_link(self._connect, clock)) as link:
            link.wait_for_vehicle(self._how.wait)
            return list_logs(link, clock)

    def _files(self) -> list[tuple[int, int, Path]]:
        """Return when each of the autopilot's logs was written last, its size and its name."""
        assert self._logs is not None
        if not self._logs.is_dir():
            raise InputError(f"{self._logs} is no folder: --logs is that of the autopilot's logs")
        files = [(file.stat(), file) for file in self._logs.rglob("*") if file.suffix.lower() in (".ulg", ".bin")]
        return [(stat.st_mtime_ns, stat.st_size, file) for stat, file in files]

    def _written(self, before: list[Any]) -> list[Path]:
        """Return the files that were written during the flight, the newest first."""
        fresh = set(self._files()) - set(before)
        if not fresh:
            raise LinkError(f"nothing was written to a .ulg or .bin in {self._logs} during the flight")
        return [file for _, _, file in sorted(fresh, reverse=True)]

    def _fetched(self, before: list[Any], stem: str) -> Iterator[Path]:
        """Yield logs of the flight, the newest first, each fetched when it is asked for."""
        from minsnap.flight.mavlink.link import Clock, open_link
        from minsnap.flight.mavlink.log_download import download_log, fresh_logs

        clock = Clock()
        with closing(open_link(self._connect, clock)) as link:
            link.wait_for_vehicle(self._how.wait)
            tell("waiting for the vehicle to disarm, which closes its log")
            for _ in link.pump(clock.now() + _DISARMED):
                if not link.vehicle.armed:
                    break
            if link.vehicle.armed:
                raise LinkError("the vehicle is still armed, and its log is open")
            ending = ".ulg" if link.vehicle.autopilot == PX4 else ".bin"
            for index, entry in enumerate(fresh_logs(link, clock, before)[:_PARTS]):
                place = Path(f"{stem}{f'-part{index}' if index else ''}{ending}")
                download_log(link, clock, place, _told(clock), entry)
                yield place
