"""Flying: frames, simulation, and the way from a file of setpoints to a vehicle in the air.

The names below are loaded when they are first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from minsnap.flight.controller import Controller
    from minsnap.flight.controller_cascade import CascadeController
    from minsnap.flight.controller_feedforward import drag_feed_forward
    from minsnap.flight.controller_geometric import GeometricController
    from minsnap.flight.experiment import Experiment, run_experiment
    from minsnap.flight.experiment_course import Course, course
    from minsnap.flight.experiment_plot import plot_experiment
    from minsnap.flight.link import open_link
    from minsnap.flight.mocap import open_source
    from minsnap.flight.offboard import stream
    from minsnap.flight.options import StreamOptions, StreamReport, StreamStatus
    from minsnap.flight.relay import Relay, RelayReport
    from minsnap.flight.safety import SafetyRules
    from minsnap.flight.simulation import simulate
    from minsnap.flight.simulation_flight import Flight
    from minsnap.flight.simulation_open_loop import simulate_open_loop
    from minsnap.flight.simulation_sensors import Sensors
    from minsnap.flight.streaming import Streamer
    from minsnap.flight.tracking import Comparison, compare
    from minsnap.flight.tracking_plot import plot_tracking
    from minsnap.flight.wind import ConstantWind, DrydenWind

_HOMES = {
    "minsnap.flight.controller": ("Controller",),
    "minsnap.flight.controller_cascade": ("CascadeController",),
    "minsnap.flight.controller_feedforward": ("drag_feed_forward",),
    "minsnap.flight.controller_geometric": ("GeometricController",),
    "minsnap.flight.experiment": ("Experiment", "run_experiment"),
    "minsnap.flight.experiment_course": ("Course", "course"),
    "minsnap.flight.experiment_plot": ("plot_experiment",),
    "minsnap.flight.link": ("open_link",),
    "minsnap.flight.mocap": ("open_source",),
    "minsnap.flight.offboard": ("stream",),
    "minsnap.flight.options": ("StreamOptions", "StreamReport", "StreamStatus"),
    "minsnap.flight.relay": ("Relay", "RelayReport"),
    "minsnap.flight.safety": ("SafetyRules",),
    "minsnap.flight.streaming": ("Streamer",),
    "minsnap.flight.simulation": ("simulate",),
    "minsnap.flight.simulation_flight": ("Flight",),
    "minsnap.flight.simulation_open_loop": ("simulate_open_loop",),
    "minsnap.flight.simulation_sensors": ("Sensors",),
    "minsnap.flight.tracking": ("Comparison", "compare"),
    "minsnap.flight.tracking_plot": ("plot_tracking",),
    "minsnap.flight.wind": ("ConstantWind", "DrydenWind"),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "CascadeController",
    "Comparison",
    "ConstantWind",
    "Controller",
    "Course",
    "DrydenWind",
    "Experiment",
    "Flight",
    "GeometricController",
    "Relay",
    "RelayReport",
    "SafetyRules",
    "Sensors",
    "StreamOptions",
    "StreamReport",
    "StreamStatus",
    "Streamer",
    "compare",
    "course",
    "drag_feed_forward",
    "open_link",
    "open_source",
    "plot_experiment",
    "plot_tracking",
    "run_experiment",
    "simulate",
    "simulate_open_loop",
    "stream",
]


def __getattr__(name: str) -> Any:
    """Import a public name from its module the first time it is used (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module 'minsnap.flight' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOME[name]), name)
