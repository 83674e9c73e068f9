"""Minimum-snap trajectories, certified inside their corridor at every instant.

The public names are loaded when they are first used, so that importing the package stays quick.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from minsnap.errors import MinsnapError

if TYPE_CHECKING:
    from minsnap.certificate import Certificate, certify
    from minsnap.corridors.boxes import Boxes
    from minsnap.corridors.gates import Ball, Gate
    from minsnap.corridors.occupancy_grid import corridor_from_grid
    from minsnap.corridors.polytopes import Polytopes
    from minsnap.corridors.room import HalfSpaces, Room
    from minsnap.corridors.tubes import RoundTube, Tube
    from minsnap.files.setpoint_csv import read_csv, write_csv
    from minsnap.files.waypoints import read_waypoints
    from minsnap.limits.limits import Limits
    from minsnap.optimisation.textbook_qp import FullProblem, build_qp
    from minsnap.planner import plan
    from minsnap.plot import plot_convergence, plot_overview, plot_path, plot_profiles, plot_utilisation
    from minsnap.shapes import circle, helix, lemniscate, line, rectangle
    from minsnap.trajectory.path import Path
    from minsnap.trajectory.samples import Samples
    from minsnap.trajectory.trajectory import Trajectory

_HOMES = {
    "minsnap.corridors.boxes": ("Boxes",),
    "minsnap.corridors.gates": ("Ball", "Gate"),
    "minsnap.certificate": ("Certificate", "certify"),
    "minsnap.corridors.tubes": ("RoundTube", "Tube"),
    "minsnap.files.setpoint_csv": ("read_csv", "write_csv"),
    "minsnap.files.waypoints": ("read_waypoints",),
    "minsnap.optimisation.textbook_qp": ("FullProblem", "build_qp"),
    "minsnap.corridors.occupancy_grid": ("corridor_from_grid",),
    "minsnap.limits.limits": ("Limits",),
    "minsnap.trajectory.path": ("Path",),
    "minsnap.planner": ("plan",),
    "minsnap.plot": ("plot_convergence", "plot_overview", "plot_path", "plot_profiles", "plot_utilisation"),
    "minsnap.corridors.polytopes": ("Polytopes",),
    "minsnap.corridors.room": ("HalfSpaces", "Room"),
    "minsnap.trajectory.samples": ("Samples",),
    "minsnap.shapes": ("circle", "helix", "lemniscate", "line", "rectangle"),
    "minsnap.trajectory.trajectory": ("Trajectory",),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "Ball",
    "Boxes",
    "Certificate",
    "FullProblem",
    "Gate",
    "HalfSpaces",
    "Limits",
    "MinsnapError",
    "Path",
    "Polytopes",
    "Room",
    "RoundTube",
    "Samples",
    "Trajectory",
    "Tube",
    "build_qp",
    "certify",
    "circle",
    "corridor_from_grid",
    "helix",
    "lemniscate",
    "line",
    "plan",
    "plot_convergence",
    "plot_overview",
    "plot_path",
    "plot_profiles",
    "plot_utilisation",
    "read_csv",
    "read_waypoints",
    "rectangle",
    "write_csv",
]


def __getattr__(name: str) -> Any:
    """Import a public name from its module the first time it is used (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module 'minsnap' has no attribute {name!r}")
    value = getattr(importlib.import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
