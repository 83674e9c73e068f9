"""The command that repeats a published experiment in simulation."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from minsnap.cli import options
from minsnap.cli.command import command
from minsnap.cli.options import SimulatedVehicle
from minsnap.cli.output import check_figure, on_terminal
from minsnap.cli.summary import as_json
from minsnap.errors import InputError


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
    """Repeat a published experiment in simulation: tracking error with and without drag compensation."""
    from minsnap.basics.storage.atomic import check_destination
    from minsnap.flight.simulation.flight_inputs import Sensors
    from minsnap.flight.thesis.experiment import experiment_dict, experiment_text, models_of, run_experiment

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
        sensors=Sensors(pose_rate, delay, simulated.noise, simulated.seed),
        wind=simulated.air,
        progress=on_terminal(json),
    )
    if output is not None:
        from minsnap.flight.thesis.experiment import write_flights

        write_flights(result, output)
    if plot is not None:
        from minsnap.flight.thesis.experiment import plot_experiment
        from minsnap.plot.figures import save_figure

        save_figure(plot_experiment(result, view or "xy"), plot)
    print(as_json(experiment_dict(result)) if json else experiment_text(result))


def _compensations(compensate: str, models: list[str]) -> list[str | None]:
    choices: dict[str, list[str | None]] = {"off": [None], "on": [*models], "both": [None, *models]}
    if compensate not in choices:
        raise InputError(f"--compensate is {compensate!r}: it must be one of {', '.join(choices)}")
    return choices[compensate]
