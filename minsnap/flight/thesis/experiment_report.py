"""Text, figures, files and plain numbers of an experiment."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from minsnap.basics.storage.text_columns import aligned
from minsnap.flight.thesis.experiment import MEASURED, PUBLISHED_RMSE, Experiment, ExperimentRun
from minsnap.flight.tracking.tracking_plot import plot_tracking

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
    base = _baseline(experiment)
    with_models = [run for run in experiment.runs if run.compensation is not None]
    heads = ["axis"] + (["without"] if base else [])
    for run in with_models:
        heads += [f"with {run.compensation}"] + (["difference"] if base else [])
    rows = [heads]
    for index, axis in enumerate("XYZ"):
        row = [axis] + ([f"{base.whole.rmse[index]:.4f}"] if base else [])
        for run in with_models:
            value = run.whole.rmse[index]
            row += [f"{value:.4f}"] + ([f"{base.whole.rmse[index] - value:+.4f}"] if base else [])
        rows.append(row)
    return aligned(rows)


def _part_table(experiment: Experiment) -> list[str]:
    """Return one row per flight: 3-D error of the first repetition and of the others, delay, error in shape."""
    heads = ["compensation", *(label for _, label in _PARTS), "greatest", "delay [s]", "from the curve"]
    rows = [heads]
    for run in experiment.runs:
        parts = [f"{getattr(run, part).rmse_3d:.4f}" for part, _ in _PARTS]
        whole = [f"{run.whole.max_error:.4f}", f"{run.whole.delay:.3f}", f"{run.whole.path_rmse:.4f}"]
        rows.append([run.compensation or "none", *parts, *whole])
    return ["3-D error [m]: transient and steady state apart", aligned(rows)]


def _baseline(experiment: Experiment) -> ExperimentRun | None:
    return next((run for run in experiment.runs if run.compensation is None), None)


def write_flights(experiment: Experiment, folder: str | os.PathLike[str]) -> list[Path]:
    """Write the reference and every flight as CSV, which ``minsnap compare`` reads; return the files.

    Parameters
    ----------
    experiment : Experiment
    folder : str or path
        Made if it is not there.
    """
    from minsnap.files.setpoint_csv import write_csv

    home, name = Path(folder), experiment.course.name
    home.mkdir(parents=True, exist_ok=True)
    written = {home / f"{name}_reference.csv": experiment.course.samples}
    for run in experiment.runs:
        words = f"with_{run.compensation}" if run.compensation else "without_compensation"
        written[home / f"{name}_{words}.csv"] = run.flight.samples
    for file, samples in written.items():
        write_csv(samples, file)
    return list(written)


def experiment_dict(experiment: Experiment) -> dict[str, Any]:
    """Return the same as plain numbers, for JSON."""
    course = experiment.course
    runs = [
        {
            "compensation": run.compensation,
            "whole": run.whole.as_dict(),
            "transient": run.transient.as_dict(),
            "steady": run.steady.as_dict(),
            "saturated": float(run.flight.saturated.mean()),
        }
        for run in experiment.runs
    ]
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
