"""The published experiment in simulation: courses flown with and without compensation of drag, in the thesis' tables.

A course is hover, then its repetitions as setpoints at 20 Hz, then a hold (Tables 1 to 3 of the thesis).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from minsnap.basics.checks import check_number
from minsnap.basics.messages import aligned
from minsnap.basics.progress import progress_line
from minsnap.basics.storage.atomic import make_folder
from minsnap.basics.storage.text import FileName
from minsnap.errors import InputError, VehicleError
from minsnap.flight.simulation.controllers import CascadeController, Controller
from minsnap.flight.simulation.flight_inputs import Sensors, Wind, reference_states
from minsnap.flight.simulation.simulated_flight import STEP, Flight, simulate
from minsnap.flight.thesis.drag_fits import consistent_parasitic_drag, published_drag
from minsnap.flight.tracking.comparison import Comparison, compare
from minsnap.flight.tracking.tracking_plot import plot_tracking
from minsnap.plot.style import Figure
from minsnap.trajectory import Path, Samples
from minsnap.vehicle import Drag, Quadrotor, check_rotor_limits

HOVER = 5.0
"""Hover at the start of the course before the trigger [s]."""
HOLD = 2.0
"""Hold at its end [s]."""
COURSES = ("circle", "line", "rect")


@dataclass(frozen=True, eq=False)
class ExperimentCourse:
    """Setpoints of an experiment and its parts in time.

    Parameters
    ----------
    name : str
        What is flown: ``circle``, ``line`` or ``rect``.
    samples : Samples
        Setpoints from the hover to the hold.
    start, end : float
        First and last instant of the repetitions [s].
    settled : float
        End of the first repetition: the transient ends and the steady state begins [s].
    slowing : float
        Where the steady state ends: the last repetition, or the end of it where nothing slows down [s].
    repetitions : int
        How many.
    """

    name: str
    samples: Samples
    start: float
    end: float
    settled: float
    slowing: float
    repetitions: int


def course(name: str, repetitions: int = 10, *, literal: bool = True, rate: float = 20.0) -> ExperimentCourse:
    """Return a course of the published experiment.

    Parameters
    ----------
    name : {"circle", "line", "rect"}
        A circle of 3 m and 6 s a lap; a line of 7 m at y = 1; a rectangle of 6 m by 4 m in a corridor of 0.3 m.
    repetitions : int
        How often it is flown.
    literal : bool
        As in the thesis: the circle starts and ends at full speed, and the line jumps back to its start for each
        repetition. Otherwise the circle spins up from rest and down to rest, and the line is flown from rest to rest,
        there and back. The rectangle, from rest to rest corner by corner, is the same in both.
    rate : float
        Setpoints a second [Hz].

    Returns
    -------
    ExperimentCourse

    Raises
    ------
    InputError
        If the name is not known, or the repetitions are not a whole number from 1.
    """
    if not isinstance(name, str) or name not in COURSES:
        raise InputError(f"no course is called {name!r}: choose from {', '.join(COURSES)}")
    check_number("repetitions", repetitions, 1, math.inf, "give a whole number from 1", whole=True)
    return _framed(name, _flown(name, repetitions, literal, rate), repetitions, name == "circle" and not literal)


def _flown(name: str, repetitions: int, literal: bool, rate: float) -> Samples:
    """Return the samples of the repetitions."""
    from minsnap.paths import circle, line, rectangle

    if name == "circle" and not literal:
        return circle(3.0, period=6.0, laps=repetitions, ramp=min(math.pi / 2.0, math.pi * repetitions)).sample(rate)
    if name == "line" and literal:
        return _repeated([line(constant_speed=True)] * repetitions, rate, joined=False)
    if name == "line":
        ends = ((0.0, 1.0, 1.5), (7.0, 1.0, 1.5))
        there_and_back: list[Path] = [line(*ends, total_time=7.0), line(*reversed(ends), total_time=7.0)]
        return _repeated([there_and_back[index % 2] for index in range(repetitions)], rate, joined=True)
    if name == "circle":
        return _repeated([circle(3.0, period=6.0, ramp=0.0)] * repetitions, rate, joined=True)
    once = rectangle(6.0, 4.0, corridor=0.3, durations=[6.0, 4.0, 6.0, 4.0])
    return _repeated([once] * repetitions, rate, joined=True)


def _repeated(paths: list[Path], rate: float, joined: bool) -> Samples:
    """Return the samples of one path after the other; where they join, the end of one is the start of the next."""
    parts = [path.sample(rate) for path in paths]
    kept = [part[: len(part) - int(joined)] for part in parts[:-1]]
    return _joined([*kept, parts[-1]], rate)


def _joined(parts: list[Samples], rate: float) -> Samples:
    """Return samples one after the other on a uniform grid from 0."""
    arrays = zip(*(part.arrays().values() for part in parts), strict=True)
    joined: dict[str, Any] = dict(zip(parts[0].arrays(), map(np.concatenate, arrays), strict=True))
    return Samples(**joined | {"t": np.arange(len(joined["t"])) / rate})


def _framed(name: str, flown: Samples, repetitions: int, slows: bool) -> ExperimentCourse:
    """Add the hover before and the hold after the repetitions."""
    rate = flown.rate
    hover, hold = _resting(flown, 0, round(HOVER * rate)), _resting(flown, -1, round(HOLD * rate))
    samples = _joined([hover, flown, hold], rate)
    start = len(hover) / rate
    end, each = start + flown.duration, flown.duration / repetitions
    settled = start + each if repetitions > 1 else end
    slowing = end - each if slows and repetitions > 2 else end
    return ExperimentCourse(name, samples, start, end, settled, slowing, repetitions)


def _resting(samples: Samples, index: int, count: int) -> Samples:
    """Return a sample held at rest for a count of steps."""
    held = samples[np.full(count, index)]
    still = np.zeros((count, samples.dim))
    return replace(held, velocity=still, acceleration=still, jerk=still, snap=still, yaw_rate=np.zeros(count))


MODELS = ("published", "consistent", "exact")
"""Models that compensation may use: the published linear fit, the consistent airframe model, the simulated drag."""

MEASURED = "DJI F330"
"""Name of the vehicle that the first two models were measured on; they are of no other."""

PUBLISHED_RMSE: dict[str, dict[str, tuple[float, float]]] = {
    "line": {"x": (1.4862, 0.8179), "y": (0.1051, 0.1174)},
    "circle": {"x": (1.0801, 0.5990), "y": (1.0933, 0.6617)},
    "rect": {"x": (0.9118, 1.0369), "y": (1.0042, 1.0593)},
}
"""Tables 1 to 3 of the thesis: RMSE of an axis without and with compensation, as flown [m]."""


@dataclass(frozen=True, eq=False)
class ExperimentRun:
    """One flight of a course.

    Parameters
    ----------
    compensation : str or None
        Which of :data:`MODELS` was offset; None is no compensation.
    flight : Flight
        From the hover to the hold.
    whole, transient, steady : Comparison
        All repetitions, the first one, and those after it less the last where that slows down; the delay is of all.
    """

    compensation: str | None
    flight: Flight
    whole: Comparison
    transient: Comparison
    steady: Comparison


@dataclass(frozen=True, eq=False)
class Experiment:
    """A course and its flights.

    Parameters
    ----------
    course : ExperimentCourse
    runs : tuple of ExperimentRun
        Without compensation first, where it was flown.
    vehicle : Quadrotor
        What flew.
    """

    course: ExperimentCourse
    runs: tuple[ExperimentRun, ...]
    vehicle: Quadrotor

    def run(self, compensation: str | None) -> ExperimentRun:
        """Return the flight with a compensation, or raise InputError if there is none."""
        for run in self.runs:
            if run.compensation == compensation:
                return run
        raise InputError(f"nothing was flown with compensation {compensation!r}")


def models_of(vehicle: Quadrotor) -> tuple[str, ...]:
    """Return the models that are compensated unless others are named: measured ones of the F330, else its own drag."""
    return ("published", "consistent") if vehicle.name == MEASURED else ("exact",)


def drag_model(name: str, vehicle: Quadrotor) -> Drag:
    """Return one of :data:`MODELS`; the exact one is the vehicle's own.

    Raises
    ------
    VehicleError
        If the name is not known, or the model was measured on another vehicle.
    """
    if name not in MODELS:
        raise VehicleError(f"no model of compensation is called {name!r}: choose from {', '.join(MODELS)}")
    if name == "exact":
        return vehicle.drag
    if vehicle.name != MEASURED:
        other = vehicle.name or "this vehicle"
        raise VehicleError(f"the {name} model was measured on the {MEASURED}, not on {other}: use 'exact'")
    return consistent_parasitic_drag() if name == "consistent" else published_drag("linear")


def run_experiment(
    name: str = "circle",
    repetitions: int = 10,
    *,
    compensations: Sequence[str | None] | None = None,
    literal: bool = True,
    vehicle: Quadrotor | None = None,
    controller: Controller | None = None,
    setpoint_rate: float = 20.0,
    sensors: Sensors | None = None,
    wind: Wind | None = None,
    step: float = STEP,
    progress: Callable[[float], None] | bool | None = None,
) -> Experiment:
    """Simulate a published course once per compensation, under equal conditions.

    Parameters
    ----------
    name : {"circle", "line", "rect"}
        The course, see :func:`course`.
    repetitions : int
        Ten in the thesis.
    compensations : sequence of str or None, optional
        Which of :data:`MODELS` to offset in each flight; None among them flies without. By default, None and those
        of :func:`models_of`.
    literal : bool
        Start and repeat as in the thesis; otherwise from rest and without jumps.
    vehicle : Quadrotor or None
        By default the thesis's DJI F330.
    controller : Controller or None
        By default PX4's cascade, following position and velocity.
    setpoint_rate : float
        20 Hz in the thesis.
    sensors : Sensors or None
        By default poses at 50 Hz without delay or noise.
    wind : Wind or None
        By default still air.
    step : float
        Of the simulation [s].
    progress : callable, bool or None
        Called with the part that is done, 0 to 1; True shows a line on standard error.

    Returns
    -------
    Experiment

    Raises
    ------
    InputError
        If a course, compensation or repetition is not known.
    ThrustError
        If the course asks the rotors for more than they can give, drag aside; says when and by how much.
    DivergenceError
        If a flight diverges.
    """
    craft = Quadrotor.dji_f330() if vehicle is None else vehicle
    compensations = (None, *models_of(craft)) if compensations is None else compensations
    if not compensations:
        raise InputError("there is nothing to fly: give at least one compensation, or None for a flight without")
    flown = course(name, repetitions, literal=literal, rate=setpoint_rate)
    check_rotor_limits(craft, reference_states(craft, flown.samples, None), flown.samples.t)
    models = [None if compensation is None else drag_model(compensation, craft) for compensation in compensations]
    pilot = CascadeController(references="velocity") if controller is None else controller
    how: dict[str, Any] = {"sensors": sensors, "wind": wind, "step": step}
    runs = []
    with progress_line(progress, "flying", lambda line: line.show) as watch:
        for index, compensation in enumerate(compensations):
            share = None if watch is None else partial(_told, watch, index, len(compensations))
            flight = simulate(craft, pilot, flown.samples, compensation=models[index], progress=share, **how)
            runs.append(_run(flown, compensation, flight))
    return Experiment(flown, tuple(runs), craft)


def _told(progress: Callable[[float], None], index: int, count: int, share: float) -> None:
    """Tell the progress of one of several equal parts."""
    progress((index + share) / count)


def _run(flown: ExperimentCourse, compensation: str | None, flight: Flight) -> ExperimentRun:
    whole = compare(flown.samples, flight.samples).within(flown.start, flown.end)
    transient = whole.within(flown.start, flown.settled)
    steady = whole.within(flown.settled, flown.slowing) if flown.slowing > flown.settled else transient
    return ExperimentRun(compensation, flight, whole, transient, steady)


TITLES = {"line": "straight lines", "circle": "circular trajectories", "rect": "rectangular trajectories"}
"""What the tables of the thesis call the courses."""

_PARTS = (("transient", "first repetition"), ("steady", "after it"))


def experiment_text(experiment: Experiment) -> str:
    """Return the tables: error per axis without and with compensation, then transient, steady state and delay."""
    course = experiment.course
    title = f"Root mean squared error in tracking of {course.repetitions} {TITLES[course.name]} [m]"
    tables = [title, _axis_table(experiment), "", *_part_table(experiment)]
    if experiment.vehicle.name != MEASURED:
        return "\n".join(tables)
    flown = PUBLISHED_RMSE[course.name]
    words = [f"{axis} {without:.4f} → {offset:.4f}" for axis, (without, offset) in flown.items()]
    return "\n".join([*tables, "", f"flown in the thesis, without → with: {', '.join(words)}"])


def _axis_table(experiment: Experiment) -> str:
    """Return rows x, y, z: error without compensation, and per model the error with it and the difference."""
    base = next((run for run in experiment.runs if run.compensation is None), None)
    columns = [["axis", *"XYZ"]]
    if base is not None:
        columns.append(["without", *(f"{value:.4f}" for value in base.whole.rmse)])
    for run in experiment.runs:
        if run.compensation is not None:
            columns.append([f"with {run.compensation}", *(f"{value:.4f}" for value in run.whole.rmse)])
            if base is not None:
                columns.append(["difference", *(f"{value:+.4f}" for value in base.whole.rmse - run.whole.rmse)])
    return aligned([list(row) for row in zip(*columns, strict=True)])


def _part_table(experiment: Experiment) -> list[str]:
    """Return one row per flight: 3-D error of the first repetition and of the others, delay, error in shape."""
    heads = ["compensation", *(label for _, label in _PARTS), "greatest", "delay [s]", "from the curve"]
    rows = [heads]
    for run in experiment.runs:
        parts = [f"{getattr(run, part).rmse_3d:.4f}" for part, _ in _PARTS]
        whole = [f"{run.whole.max_error:.4f}", f"{run.whole.delay:.3f}", f"{run.whole.path_rmse:.4f}"]
        rows.append([run.compensation or "none", *parts, *whole])
    return ["3-D error [m]: transient and steady state apart", aligned(rows)]


def write_flights(experiment: Experiment, folder: FileName) -> list[FilePath]:
    """Write the reference and every flight as CSV, which ``minsnap compare`` reads; return the files.

    Parameters
    ----------
    experiment : Experiment
    folder : str or path
        Made if it is not there.
    """
    from minsnap.files import write_csv

    home, name = make_folder(folder), experiment.course.name
    written = {home / f"{name}_reference.csv": experiment.course.samples}
    for run in experiment.runs:
        words = f"with_{run.compensation}" if run.compensation else "without_compensation"
        written[home / f"{name}_{words}.csv"] = run.flight.samples
    for file, samples in written.items():
        write_csv(samples, file)
    return list(written)


def experiment_dict(experiment: Experiment) -> dict[str, Any]:
    """Return the same as plain numbers, for JSON."""
    course, runs = experiment.course, []
    for run in experiment.runs:
        parts = {part: getattr(run, part).as_dict() for part in ("whole", "transient", "steady")}
        runs.append({"compensation": run.compensation, **parts, "saturated": float(run.flight.saturated.mean())})
    thesis = PUBLISHED_RMSE[course.name] if experiment.vehicle.name == MEASURED else None
    return {"course": course.name, "repetitions": course.repetitions, "runs": runs, "thesis": thesis}


def plot_experiment(experiment: Experiment, view: str = "xy") -> Figure:
    """Draw the planar view and the position and velocity profiles of all flights.

    Parameters
    ----------
    experiment : Experiment
    view : str
        ``"xy"``, ``"xz"``, ``"yz"`` or ``"3d"``.

    Returns
    -------
    matplotlib.figure.Figure
    """
    flights = {
        f"with {run.compensation}" if run.compensation else "without compensation": run.flight.samples
        for run in experiment.runs
    }
    title = f"{experiment.course.repetitions} {TITLES[experiment.course.name]}, in simulation"
    return plot_tracking(experiment.course.samples, flights, title, view)
