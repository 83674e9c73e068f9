"""Flying: frames, simulation, and the way from a file of setpoints to a vehicle in the air.

The names below are loaded when they are first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from minsnap.mavlink.link import open_link
    from minsnap.mavlink.offboard import stream
    from minsnap.mavlink.safety import SafetyRules
    from minsnap.mavlink.stream_options import StreamOptions, StreamReport, StreamStatus
    from minsnap.mavlink.streaming import Streamer
    from minsnap.mocap.relay import Relay, RelayReport
    from minsnap.mocap.sources import open_source
    from minsnap.simulation.closed_loop import simulate
    from minsnap.simulation.controllers.cascade import CascadeController
    from minsnap.simulation.controllers.controller import Controller
    from minsnap.simulation.controllers.feed_forward import drag_feed_forward
    from minsnap.simulation.controllers.geometric import GeometricController
    from minsnap.simulation.flight_record import Flight
    from minsnap.simulation.open_loop import simulate_open_loop
    from minsnap.simulation.sensors import Sensors
    from minsnap.simulation.wind import ConstantWind, DrydenWind
    from minsnap.thesis.experiment import Experiment, run_experiment
    from minsnap.thesis.experiment_course import Course, course
    from minsnap.thesis.experiment_plot import plot_experiment
    from minsnap.tracking.comparison import Comparison, compare
    from minsnap.tracking.tracking_plot import plot_tracking

_HOMES = {
    "minsnap.simulation.controllers.controller": ("Controller",),
    "minsnap.simulation.controllers.cascade": ("CascadeController",),
    "minsnap.simulation.controllers.feed_forward": ("drag_feed_forward",),
    "minsnap.simulation.controllers.geometric": ("GeometricController",),
    "minsnap.thesis.experiment": ("Experiment", "run_experiment"),
    "minsnap.thesis.experiment_course": ("Course", "course"),
    "minsnap.thesis.experiment_plot": ("plot_experiment",),
    "minsnap.mavlink.link": ("open_link",),
    "minsnap.mocap.sources": ("open_source",),
    "minsnap.mavlink.offboard": ("stream",),
    "minsnap.mavlink.stream_options": ("StreamOptions", "StreamReport", "StreamStatus"),
    "minsnap.mocap.relay": ("Relay", "RelayReport"),
    "minsnap.mavlink.safety": ("SafetyRules",),
    "minsnap.mavlink.streaming": ("Streamer",),
    "minsnap.simulation.closed_loop": ("simulate",),
    "minsnap.simulation.flight_record": ("Flight",),
    "minsnap.simulation.open_loop": ("simulate_open_loop",),
    "minsnap.simulation.sensors": ("Sensors",),
    "minsnap.tracking.comparison": ("Comparison", "compare"),
    "minsnap.tracking.tracking_plot": ("plot_tracking",),
    "minsnap.simulation.wind": ("ConstantWind", "DrydenWind"),
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
