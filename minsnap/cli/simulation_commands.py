"""The commands that simulate: a flight along any path, and a published experiment."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees
from pathlib import Path
from typing import Annotated, Any

import minsnap
import minsnap.flight
from minsnap.basics.messages import labelled
from minsnap.basics.storage.atomic import check_destination, refuse_source
from minsnap.cli import options
from minsnap.cli.app import command, tell
from minsnap.cli.options import SimulatedVehicle
from minsnap.cli.output import as_json, check_figure, on_terminal
from minsnap.errors import InputError


@dataclass(frozen=True)
class FlightFiles:
    """What is written of a flight."""

    output: Annotated[Path | None, "--output", "-o", "FILE", "CSV of what was flown, 50 rows per second."] = None
    log: Annotated[Path | None, "FILE", "The flight as PX4 would log it (.ulg), for fit."] = None
    plot: options.Plot = None
    view: options.View = None
    animate: Annotated[Path | None, "FILE", "Animation: .gif; .mp4, .webm with ffmpeg."] = None

    def check(self, source: Path) -> None:
        """Check all names before the simulation."""
        from minsnap.plot.animation import check_animation_name

        check_figure(self.plot, self.view if self.plot else None)
        if self.animate is not None:
            check_animation_name(self.animate, self.view or "xy")
        elif self.view is not None and self.plot is None:
            raise InputError(f"--view {self.view} is of a figure: give --plot or --animate with it")
        if self.output is not None and self.output.suffix.lower() != ".csv":
            raise InputError(f"{self.output} does not end in .csv: a flight is written as one")
        if self.log is not None and self.log.suffix.lower() != ".ulg":
            raise InputError(f"{self.log} does not end in .ulg: a log is written as PX4's")
        for written in filter(None, (self.output, self.log, self.plot, self.animate)):
            check_destination(written)
            refuse_source(written, source)

    def write(self, flight: minsnap.flight.Flight, shown: bool, around: dict[str, Any]) -> dict[str, str | None]:
        """Write what does not need the vehicle, figures with what is around the path, and return all names."""
        view = self.view or "xy"
        if self.output is not None:
            minsnap.write_csv(flight.at_rate(50.0), self.output)
        if self.plot is not None:
            from minsnap.flight.tracking.simulated_flights import compare_simulated
            from minsnap.flight.tracking.tracking_plot import plot_comparison

            minsnap.plot.save_figure(
                plot_comparison({"simulated": compare_simulated(flight)}, view, **around), self.plot
            )
        if self.animate is not None:
            film: dict[str, Any] = {"flight": flight.samples, "view": view, "progress": shown}
            minsnap.plot.animate_path(flight.reference, self.animate, **film, **around)
        named = {"log": self.log, "output": self.output, "plot": self.plot, "animation": self.animate}
        return {name: None if path is None else str(path) for name, path in named.items()}


@command()
def simulate(
    simulated: SimulatedVehicle,
    files: FlightFiles,
    file: Annotated[Path, "FILE", "Setpoint CSV, or any file of a path."],
    *,
    references: options.References = "acceleration",
    compensate: Annotated[bool, "Offset the vehicle's own drag."] = False,
    delay: Annotated[float, "S", "Time until a setpoint reaches the controller [s]."] = 0.0,
    frame: options.ReadFrame = None,
    json: options.Json = False,
) -> None:
    """Simulate a flight: tracking error, tilt and rotor thrusts.

    Of a plan in .json or .yaml that holds a corridor, obstacles or gates it says by how much the vehicle stayed inside.
    """
    from minsnap.cli.kept import flown_lines
    from minsnap.files import find_flown_margins, read_any
    from minsnap.files.formats import is_polynomials, read_polynomials
    from minsnap.flight.tracking.simulated_flights import flight_figures

    files.check(file)
    stored = read_polynomials(file) if frame is None and is_polynomials(file) else None
    path = read_any(file, frame) if stored is None else stored.trajectory
    if path.dim != 3:
        raise InputError(
            f"{file} has {path.dim} coordinates: a vehicle flies in three; plan it with z, a route from --start X Y Z "
            "to --goal X Y Z"
        )
    craft, shown = simulated.craft, on_terminal(json)
    flight = minsnap.flight.simulate(
        craft,
        simulated.pilot(references),
        path,
        setpoint_delay=delay,
        compensation=craft.drag if compensate else None,
        sensors=minsnap.flight.Sensors(noise=simulated.noise, seed=simulated.seed) if simulated.noise else None,
        wind=simulated.air,
        progress=shown,
    )
    if files.log is not None:
        from minsnap.files import write_ulog

        write_ulog(minsnap.flight.simulated_log(craft, flight, path, seed=simulated.seed), files.log)
    around = {} if stored is None else {name: part for name, part in stored.drawn.items() if name != "tolerance"}
    figures = flight_figures(flight, craft) | files.write(flight, shown, around)
    flown = None if stored is None else find_flown_margins(stored, flight.samples)
    if json:
        print(as_json(figures | ({} if flown is None else flown.figures())))
    else:
        print(_as_text(figures, [] if stored is None or flown is None else flown_lines(stored, flown)))


def _as_text(figures: dict[str, Any], kept: list[tuple[str, str]]) -> str:
    axes = ", ".join(f"{value:.3f}" for value in figures["rmse_axes"])
    lines = [
        ("duration", f"{figures['duration']:.6g} s"),
        ("tracking error", f"{figures['rmse']:.3f} m (rms; {axes} along x, y, z)"),
        ("largest error", f"{figures['max_error']:.3f} m, at {figures['max_error_instant']:.4g} s"),
        ("late by", f"{figures['delay']:.3f} s"),
        ("max speed", f"{figures['max_speed']:.4g} m/s"),
        ("max tilt", f"{degrees(figures['max_tilt']):.1f} degrees"),
        ("max rotor thrust", f"{figures['max_rotor_thrust']:.4g} of {figures['rotor_thrust_limit']:.4g} N"),
        ("saturated", f"{100.0 * figures['saturated']:.2f} % of the time"),
    ]
    lines += kept
    named = (("output", "written"), ("log", "logged"), ("plot", "drawn"), ("animation", "animated"))
    lines += [(label, figures[name]) for name, label in named if figures[name]]
    return labelled(lines)


@command()
def experiment(
    simulated: SimulatedVehicle,
    course: Annotated[str, "circle, line or rect."] = "circle",
    *,
    repeat: Annotated[int, "Repetitions of the course."] = 10,
    compensate: Annotated[str, "Drag compensation: off, on or both."] = "both",
    model: Annotated[
        list[str] | None, "What is compensated: published, consistent (f330 only) or exact; repeatable."
    ] = None,
    literal: Annotated[
        bool, "--literal/--smooth", "Start and repeat as published, or from rest, without jumps."
    ] = True,
    references: options.References = "velocity",
    rate: options.Rate = 20.0,
    pose_rate: Annotated[float, "HZ", "Poses per second."] = 50.0,
    delay: Annotated[float, "S", "Age of each pose, not compensated [s]."] = 0.0,
    output: Annotated[Path | None, "--output", "-o", "FOLDER", "Write reference and flights as CSV there."] = None,
    plot: options.Plot = None,
    view: options.View = None,
    json: options.Json = False,
) -> None:
    """Repeat a published experiment in simulation; deprecated, 0.3 is the last version that has it.

    Prints the tracking error with and without drag compensation.
    """
    from minsnap.flight.thesis.experiment import (
        experiment_dict,
        experiment_text,
        models_of,
        plot_experiment,
        run_experiment,
    )

    check_figure(plot, view)
    if plot is not None:
        check_destination(plot)
    craft = simulated.craft
    result = run_experiment(
        course,
        repeat,
        compensations=_compensations(compensate, model or list(models_of(craft))),
        literal=literal,
        vehicle=craft,
        controller=simulated.pilot(references),
        setpoint_rate=rate,
        sensors=minsnap.flight.Sensors(pose_rate, delay, simulated.noise, simulated.seed),
        wind=simulated.air,
        progress=on_terminal(json),
    )
    if output is not None:
        from minsnap.flight.thesis.experiment import write_flights

        write_flights(result, output)
    if plot is not None:
        minsnap.plot.save_figure(plot_experiment(result, view or "xy"), plot)
    tell("experiment is deprecated, and 0.3 is the last version that has it: it becomes a script of examples/")
    print(as_json(experiment_dict(result)) if json else experiment_text(result))


def _compensations(compensate: str, models: list[str]) -> list[str | None]:
    choices: dict[str, list[str | None]] = {"off": [None], "on": [*models], "both": [None, *models]}
    if compensate not in choices:
        raise InputError(f"--compensate is {compensate!r}: it must be one of {', '.join(choices)}")
    return choices[compensate]
