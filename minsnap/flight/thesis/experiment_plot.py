"""The figure of an experiment: every flight of a course and its reference."""

from __future__ import annotations

from typing import TYPE_CHECKING

from minsnap.flight.thesis.experiment import Experiment
from minsnap.flight.thesis.experiment_report import TITLES
from minsnap.flight.tracking.tracking_plot import plot_tracking

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
