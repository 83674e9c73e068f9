"""Minimum-snap trajectories, certified inside their corridor at every instant.

The public names are loaded when they are first used, so that importing the package stays quick.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from minsnap.errors import MinsnapError

if TYPE_CHECKING:
    from minsnap.boxes import Boxes
    from minsnap.certificate import Certificate, certify
    from minsnap.corridor import RoundTube, Tube
    from minsnap.files.setpoints import read_csv, write_csv
    from minsnap.files.waypoints import read_waypoints
    from minsnap.full_problem import FullProblem, build_qp
    from minsnap.grid import corridor_from_grid
    from minsnap.limits import Limits
    from minsnap.path import Path
    from minsnap.planner import plan
    from minsnap.plot import plot_convergence, plot_overview, plot_path, plot_profiles, plot_utilisation
    from minsnap.polytopes import Polytopes
    from minsnap.room import HalfSpaces, Room
    from minsnap.samples import Samples
    from minsnap.shapes import circle, helix, lemniscate, line, rectangle
    from minsnap.trajectory import Trajectory

_HOMES = {
    "minsnap.boxes": ("Boxes",),
    "minsnap.certificate": ("Certificate", "certify"),
    "minsnap.corridor": ("RoundTube", "Tube"),
    "minsnap.files.setpoints": ("read_csv", "write_csv"),
    "minsnap.files.waypoints": ("read_waypoints",),
    "minsnap.full_problem": ("FullProblem", "build_qp"),
    "minsnap.grid": ("corridor_from_grid",),
    "minsnap.limits": ("Limits",),
    "minsnap.path": ("Path",),
    "minsnap.planner": ("plan",),
    "minsnap.plot": ("plot_convergence", "plot_overview", "plot_path", "plot_profiles", "plot_utilisation"),
    "minsnap.polytopes": ("Polytopes",),
    "minsnap.room": ("HalfSpaces", "Room"),
    "minsnap.samples": ("Samples",),
    "minsnap.shapes": ("circle", "helix", "lemniscate", "line", "rectangle"),
    "minsnap.trajectory": ("Trajectory",),
}
_HOME = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "Boxes",
    "Certificate",
    "FullProblem",
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
