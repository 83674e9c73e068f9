"""The commands that read logs of flights: compare them with their reference, and fit a vehicle to them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import minsnap
import minsnap.flight
from minsnap.basics.storage.atomic import refuse_source
from minsnap.basics.storage.text import name_as_text
from minsnap.cli import options
from minsnap.cli.app import command, told_warnings
from minsnap.cli.file_commands import membership
from minsnap.cli.output import as_json, check_figure
from minsnap.errors import InputError

if TYPE_CHECKING:
    from minsnap.files import BagTopics, FlightLog
    from minsnap.flight.tracking.flown_tube import FlownTube
    from minsnap.flight.tracking.log_comparison import ComparedFlight


@dataclass(frozen=True)
class Matching:
    """How flights are set beside what they were to fly."""

    align: Annotated[
        bool, "For flights without setpoints: estimate the clocks' offset; the delay is then not measured."
    ] = False
    max_delay: Annotated[float, "S", "Longest delay looked for [s]."] = 2.0
    lead: options.FlownLead = None
    sent: Annotated[list[Path] | None, "FILE", "What was sent for REFERENCE, as tune wrote it; once a flight."] = None
    frame: options.ReadFrame = None
    columns: options.Columns = None
    join: Annotated[bool, "The flights are parts of one log, or of one vehicle: read them as one."] = False
    flight: Annotated[int | None, "N", "Which flight of a log with several, counted from 1."] = None
    topic: Annotated[str | None, "NAME", "Of a bag with several: the topic of the vehicle's positions."] = None
    setpoints: Annotated[str | None, "NAME", "Of a bag with several: the topic of its setpoints."] = None

    def compared(self, reference: Path, paths: list[Path]) -> dict[str, ComparedFlight]:
        """Read and compare all files; damage in a log is reported on standard error."""
        from minsnap.files import frame_for, is_bag, is_flight, load_reference, read_samples

        sent, flights_by_name = self.sent or [], dict[str, Any]()
        topics = self._topics()
        if topics.named and not any(map(is_bag, [reference, *paths])):
            raise InputError("--topic and --setpoints choose topics of a bag of ROS 2, and none is given")
        with told_warnings():
            read = load_reference if is_flight(reference) else read_samples
            frame = frame_for(reference, self.frame)
            wanted = load_reference(reference, frame, topics) if is_bag(reference) else read(reference, frame)
            wanted = wanted if self.lead is None else replace(wanted, lead=self.lead)
            if self.join:
                return self._of_parts(wanted, sent, paths, reference)
            if sent and len(sent) != len(paths):
                count = f"{len(sent)} times beside {len(paths)} flights"
                raise InputError(f"--sent stands {count}: write it once a flight, in their order")
            for index, path in enumerate(paths):
                commanded = read_samples(sent[index], frame_for(sent[index], self.frame)) if sent else None
                flights = self._chosen(self._flights(wanted, commanded, path, reference), path)
                flights_by_name |= _numbered(_name(path, paths), flights)
        return flights_by_name

    def _of_parts(
        self, wanted: minsnap.Samples, sent: list[Path], paths: list[Path], reference: Path
    ) -> dict[str, ComparedFlight]:
        """Return the flights of logs that are read as one."""
        from minsnap.files import frame_for, joined_logs, load_log, read_samples

        if len(sent) > 1 or len(paths) < 2 or reference in paths:
            raise InputError("--join reads two or more logs as one: give them after REFERENCE, and --sent once at most")
        topics = self._topics()
        logs = [load_log(path, topics) for path in paths]
        known = [log for log in logs if log is not None]
        if len(known) < len(logs):
            raise InputError(f"{paths[logs.index(None)]} is a table of samples: --join reads logs as one")
        log = joined_logs(known)
        commanded = read_samples(sent[0], frame_for(sent[0], self.frame)) if sent else None
        flights = self._chosen(self._in_log(wanted, commanded, log, paths[0]), paths[0])
        return _numbered(f"{_name(paths[0], paths)} and {len(paths) - 1} more", flights)

    def _topics(self) -> BagTopics:
        from minsnap.files import BagTopics

        return BagTopics(self.topic, self.setpoints)

    def _chosen(self, flights: list[ComparedFlight], path: Path) -> list[ComparedFlight]:
        """Return the flight of a file that ``--flight`` names, or all of them."""
        if self.flight is None:
            return flights
        if not 1 <= self.flight <= len(flights):
            began = [f"#{k} at {one.place.start:.1f} s" for k, one in enumerate(flights, 1) if one.place is not None]
            listed = f" ({', '.join(began)})" if began else ""
            raise InputError(f"--flight is {self.flight}: {path} holds {len(flights)} of the file{listed}")
        return [flights[self.flight - 1]]

    def _flights(
        self, wanted: minsnap.Samples, sent: minsnap.Samples | None, path: Path, reference: Path
    ) -> list[ComparedFlight]:
        """Return the flights of a file: those of a log at its own setpoints, the only one of a table of samples."""
        from minsnap.files import USUAL_TOPICS, is_bag, load_flight, load_log

        topics = self._topics() if is_bag(path) else USUAL_TOPICS
        log = None if path == reference else load_log(path, topics)
        if log is not None and log.flight is not None and (log.reference is not None or not self.align):
            return self._in_log(wanted, sent, log, path)
        return self._aligned(wanted, load_flight(path, self.frame, options.parse_named(self.columns), topics))

    def _in_log(
        self, wanted: minsnap.Samples, sent: minsnap.Samples | None, log: FlightLog, path: Path
    ) -> list[ComparedFlight]:
        """Return the flights of a log, at its own setpoints, or aligned."""
        from minsnap.flight.tracking.log_comparison import compare_in_log

        if log.flight is None:
            raise InputError(f"{path} holds no positions: log them")
        if log.reference is not None:
            planned = None if sent is None else wanted
            return compare_in_log(sent or wanted, log.reference, log.flight, self.max_delay, planned)
        if self.align:
            return self._aligned(wanted, log.flight)
        raise InputError(
            f"{path} holds no setpoints, so when the flight began is not known: log them, or give --align, "
            "which counts the vehicle's delay as part of the clocks' offset"
        )

    def _aligned(self, wanted: minsnap.Samples, flight: minsnap.Samples) -> list[ComparedFlight]:
        """Return a table of samples as one flight."""
        from minsnap.flight.tracking.comparison import moved
        from minsnap.flight.tracking.log_comparison import ComparedFlight

        comparison = minsnap.flight.compare(wanted, flight, align=self.align, max_delay=self.max_delay)
        return [ComparedFlight(comparison, wanted, moved(flight, comparison.offset))]


@command()
def compare(
    matching: Matching,
    reference: Annotated[Path, "REFERENCE", "Setpoint CSV, or a log to take it from."],
    flights: Annotated[
        list[Path], "FLIGHT...", "CSV, ULog (.ulg), dataflash (.bin), bag (.mcap, .db3, folder), log of a stream."
    ],
    *,
    waypoints: Annotated[Path | None, "FILE", "Waypoints of the corridor, as for plan."] = None,
    corridor: options.Corridor = None,
    max_speed: Annotated[float | None, "M/S", "Limit on speed to compare with."] = None,
    plot: options.Plot = None,
    view: options.View = None,
    report: options.FlightReport = None,
    tube: Annotated[str | None, "LOOP", "Hold flights against the tube of a loop: px4, ardupilot, YAML."] = None,
    wind: Annotated[float, "M/S", "With --tube: largest change of the wind [m/s]."] = 0.0,
    fit_loop: Annotated[
        Path | None, "FILE", "With --tube: write the loop with the lag and model error of a flight in still air."
    ] = None,
    json: options.Json = False,
) -> int:
    """Compare flights with their reference: tracking error, delay.

    Errors are per axis, along and across the path. In a log, a flight begins where its setpoints follow the reference:
    climb and landing do not count, and the vehicle's delay counts as an error. Setpoints that were sent ahead (--lead,
    or as the file or the log of the stream says) are compared at their planned instants. Of a plan in .json or .yaml
    the report has laps and gates, and figures what the plan keeps to. With --tube, exit status 1 if
    a flight left its tube.
    """
    from minsnap.basics.checks import check_positive
    from minsnap.files.formats import is_polynomials, read_polynomials
    from minsnap.flight.tracking.flown_tube import fit_loop as fitted_loop
    from minsnap.flight.tracking.flown_tube import hold_in_tube
    from minsnap.flight.tracking.tracking_plot import plot_comparison, write_flight_page

    options.check_corridor(corridor, waypoints)
    check_figure(plot, view)
    if max_speed is not None:
        check_positive("--max-speed", max_speed, "m/s", InputError)
    if fit_loop is not None and (tube is None or wind):
        raise InputError("--fit-loop is of a loop in still air: give --tube with it, and no --wind")
    if tube is None and wind:
        raise InputError(f"--wind {wind:g} is of a vehicle in its loop: give --tube px4 or another with it")
    loop = options.loop_of(tube, wind)
    stored = read_polynomials(reference) if matching.frame is None and is_polynomials(reference) else None
    refuse_source(fit_loop, reference, *flights, *matching.sent or ())
    compared = matching.compared(reference, flights)
    if fit_loop is not None and loop is not None:
        if len(compared) > 1:
            raise InputError(f"--fit-loop is of one flight, and {len(compared)} are given: choose one, with --flight N")
        loop = fitted_loop(next(iter(compared.values())), loop)
        loop.to_yaml(fit_loop)
    tubes = {} if loop is None else {name: hold_in_tube(one, loop, wind) for name, one in compared.items()}
    kept = {name: _kept(one.flight, waypoints, corridor, max_speed) for name, one in compared.items()}
    if plot is not None:
        around = {} if stored is None else {name: part for name, part in stored.drawn.items() if name != "tolerance"}
        minsnap.plot.save_figure(plot_comparison(compared, view or "xy", tubes=tubes, **around), plot)
    if report is not None:
        legs = None if waypoints is None else minsnap.read_waypoints(waypoints).points
        logs = {_name(path, flights): path for path in flights}
        write_flight_page(compared, report, logs=logs, waypoints=legs, tubes=tubes, plan=stored)
    _say(compared, kept, tubes, json)
    return 0 if all(each.inside for each in tubes.values()) else 1


def _kept(
    flight: minsnap.Samples, waypoints: Path | None, corridor: str | None, max_speed: float | None
) -> dict[str, Any]:
    """Return how a flight kept a corridor and a speed limit."""
    import numpy as np

    inside = membership(flight, waypoints, corridor)
    kept: dict[str, Any] = {} if inside is None else {"corridor_margin": inside.margin}
    if max_speed is not None and flight.velocity is not None:
        kept["max_speed"] = float(np.linalg.norm(flight.velocity, axis=1).max())
        kept["max_speed_allowed"] = max_speed
    return kept


def _numbered(name: str, flights: list[ComparedFlight]) -> dict[str, ComparedFlight]:
    """Return flights by the name of what they are in, with a number where it has several."""
    return {name + (f" #{number}" if len(flights) > 1 else ""): one for number, one in enumerate(flights, 1)}


def _name(path: Path, flights: list[Path]) -> str:
    """Return a file's name, with its folder if two files have the same name."""
    alike = [other for other in flights if other.name == path.name]
    return name_as_text(path.name if len(alike) == 1 else path)


def _say(
    compared: dict[str, ComparedFlight], kept: dict[str, dict[str, Any]], tubes: dict[str, FlownTube], json: bool
) -> None:
    if json:
        held = {name: {"tube": each.as_dict()} for name, each in tubes.items()}
        figures = {name: one.comparison.as_dict() | _place(one) | kept[name] for name, one in compared.items()}
        print(as_json({name: each | held.get(name, {}) for name, each in figures.items()}))
        return
    from minsnap.flight.tracking.comparison import comparison_text

    print(comparison_text({name: one.comparison for name, one in compared.items()}))
    for name, one in compared.items():
        for remark in [*one.remarks(), *_kept_in_words(kept[name])]:
            print(f"{name}: {remark}")
        if name in tubes:
            print(f"{name}: {tubes[name].sentence}")


def _place(one: ComparedFlight) -> dict[str, Any]:
    """Return the place of a flight in its log, with the remarks on it."""
    place = one.place
    where = {} if place is None else {"log_start": place.start, "clock_rate": place.rate, "shift": place.shift.tolist()}
    where |= {} if place is None or place.end is None else {"followed_until": place.end}
    return where | {"remarks": one.remarks()}


def _kept_in_words(kept: dict[str, Any]) -> list[str]:
    sentences = []
    if "corridor_margin" in kept:
        margin = kept["corridor_margin"]
        side = "inside" if margin >= 0 else "outside"
        sentences.append(f"{abs(margin):.3f} m {side} the corridor where it was worst")
    if "max_speed" in kept:
        sentences.append(f"at most {kept['max_speed']:.2f} m/s, {kept['max_speed_allowed']:g} m/s allowed")
    return sentences


@command()
def fit(
    files: Annotated[list[Path], "FILE...", "Logs of one vehicle (.ulg, .bin, of stream --log); a CSV with --form."],
    *,
    form: Annotated[
        str | None,
        "For a CSV with a header: thrust, torque (columns speed_rpm and thrust [N] or torque [N m]); "
        "parasitic, reduced, linear, propeller, consistent (columns pitch_deg, velocity [m/s], speed_rpm as the "
        "form needs, and drag [N]).",
    ] = None,
    output: Annotated[Path | None, "--output", "-o", "FILE", "Vehicle YAML with the drag of a flight."] = None,
    base: Annotated[Path | None, "FILE", "Vehicle YAML with all else; by default PX4's simulated quadrotor."] = None,
    mass: Annotated[float | None, "KG", "By default the base's."] = None,
    lead: options.FlownLead = None,
    plot: options.Plot = None,
    json: options.Json = False,
) -> None:
    """Fit drag, wind, hover throttle and delay to a flight.

    Several logs are read as one: parts of a flight, or flights in the same wind. Or, with --form, rotor coefficients or
    a drag surface are fitted to a table. Values have standard errors. Drag is per mass. -o
    writes a vehicle with that drag, which stream, plan and the shapes take as --vehicle.
    """
    if form is not None:
        if output is not None or base is not None or mass is not None:
            raise InputError("--output, --base and --mass are for logs of flights: leave them out with --form")
        if len(files) > 1:
            raise InputError(f"--form fits one table, and {len(files)} are given: give one")
        _fit_table(files[0], form, plot, json)
        return
    options.refuse_unwritten(output, base=base is not None, mass=mass is not None)
    from minsnap.flight.tracking.flight_fit import default_name, fit_flight
    from minsnap.vehicle import read_vehicle

    refuse_source(output, *files)
    refuse_source(plot, *files, base)
    flight_fit = fit_flight(files, lead)
    if plot is not None:
        minsnap.plot.save_figure(minsnap.flight.plot_flight_fit(flight_fit), plot)
    if output is not None:
        flight_fit.vehicle(None if base is None else read_vehicle(base), mass, default_name(files[0])).to_yaml(output)
    print(as_json(flight_fit.as_dict()) if json else flight_fit)


def _fit_table(file: Path, form: str, plot: Path | None, json: bool) -> None:
    from minsnap.flight.thesis.drag_fits import fit_table, plot_table_fit

    table_fit = fit_table(file, form)
    if plot is not None:
        minsnap.plot.save_figure(plot_table_fit(table_fit).figure, plot)
    print(as_json(table_fit.as_dict()) if json else table_fit)
