"""The command that simulates a flight along any path."""

from __future__ import annotations

from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from minsnap.basics.storage.text_columns import labelled
from minsnap.cli import options
from minsnap.cli.command import command
from minsnap.cli.options import SimulatedVehicle
from minsnap.cli.output import check_figure, on_terminal
from minsnap.cli.summary import as_json
from minsnap.errors import InputError

if TYPE_CHECKING:
    from minsnap.flight.simulation.simulated_flight import Flight


@command()
def simulate(
    simulated: SimulatedVehicle,
    file: Annotated[Path, "FILE", "Setpoint CSV, or any file of a path."],
    *,
    references: options.References = "acceleration",
    compensate: Annotated[bool, "Offset the vehicle's own drag."] = False,
    delay: Annotated[float, "S", "Time until a setpoint reaches the controller [s]."] = 0.0,
    frame: options.ReadFrame = None,
    output: Annotated[Path | None, "--output", "-o", "FILE", "CSV of what was flown, 50 rows per second."] = None,
    log: Annotated[Path | None, "FILE", "The flight as PX4 would log it (.ulg), for fit."] = None,
    plot: options.Plot = None,
    view: options.View = None,
    animate: Annotated[Path | None, "FILE", "Animation: .gif, or .mp4 with ffmpeg."] = None,
    json: options.Json = False,
) -> None:
    """Simulate a flight along a path: how far the vehicle was from it, and what it took of the vehicle."""
    from minsnap.basics.storage.atomic import refuse_source
    from minsnap.files.convert import read_any
    from minsnap.flight.simulation.disturbances import Sensors
    from minsnap.flight.simulation.simulated_flight import simulate as fly
    from minsnap.flight.tracking.simulated_log import flight_figures

    check_figure(plot, view if plot else None)
    _check_files(output, log, plot, animate, view)
    for written in (output, log, plot, animate):
        refuse_source(written, file)
    path = read_any(file, frame)
    if path.dim != 3:
        raise InputError(f"{file} has {path.dim} coordinates: a vehicle flies in three; write it with an altitude")
    craft, shown = simulated.craft, on_terminal(json)
    flight = fly(
        craft,
        simulated.pilot(references),
        path,
        setpoint_delay=delay,
        compensation=craft.drag if compensate else None,
        sensors=Sensors(noise=simulated.noise, seed=simulated.seed) if simulated.noise else None,
        wind=simulated.air,
        progress=shown,
    )
    if log is not None:
        from minsnap.files.logs.ulog import write_ulog
        from minsnap.flight.tracking.simulated_log import simulated_log

        write_ulog(simulated_log(craft, flight, path, seed=simulated.seed), log)
    figures = flight_figures(flight, craft) | {"log": None if log is None else str(log)}
    figures |= _write(flight, output, plot, animate, view or "xy", shown)
    print(as_json(figures) if json else _as_text(figures))


def _check_files(
    output: Path | None, log: Path | None, plot: Path | None, animate: Path | None, view: str | None
) -> None:
    """Check the names of all files before the simulation."""
    from minsnap.basics.storage.atomic import check_destination
    from minsnap.plot.animation import check_animation_name

    if animate is not None:
        check_animation_name(animate, view or "xy")
    elif view is not None and plot is None:
        raise InputError(f"--view {view} is of a figure: give --plot or --animate with it")
    if output is not None and output.suffix.lower() != ".csv":
        raise InputError(f"{output} does not end in .csv: a flight is written as one")
    if log is not None and log.suffix.lower() != ".ulg":
        raise InputError(f"{log} does not end in .ulg: a log is written as PX4's")
    for written in (output, log, plot, animate):
        if written is not None:
            check_destination(written)


def _write(
    flight: Flight,
    output: Path | None,
    plot: Path | None,
    animate: Path | None,
    view: str,
    shown: bool,
) -> dict[str, str | None]:
    """Write the requested files; return their names."""
    if output is not None:
        from minsnap.files.setpoint_csv import write_csv

        write_csv(flight.at_rate(50.0), output)
    if plot is not None:
        from minsnap.flight.tracking.simulated_log import compared
        from minsnap.flight.tracking.tracking_plot import plot_comparison
        from minsnap.plot.figures import save_figure

        save_figure(plot_comparison({"simulated": compared(flight)}, view), plot)
    if animate is not None:
        from minsnap.plot.animation import animate_path

        animate_path(flight.reference, animate, flight=flight.samples, view=view, progress=shown)
    named = {"output": output, "plot": plot, "animation": animate}
    return {name: None if path is None else str(path) for name, path in named.items()}


def _as_text(figures: dict[str, Any]) -> str:
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
    named = (("output", "written"), ("log", "logged"), ("plot", "drawn"), ("animation", "animated"))
    lines += [(label, figures[name]) for name, label in named if figures[name]]
    return labelled(lines)
