"""Minimum-snap trajectories, certified inside their corridor at every instant.

The public names are loaded when they are first used, so that importing the package stays quick.
"""

from typing import Any

import lazy_loader

_load, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

_HOMES = ("plot", "routes", "errors", "corridors", "replanning", "fleet", "shows", "paths.missions")
"""Where the names are that the root does not have."""

_MOVED = frozenset(
    """BatchError Change Constraint CorridorError DegreeError DivergenceError FileError FitError FlightError FrameError
    GridMap IntervalError LimitError LinkError MagnitudeWarning Mission OutsideRangeWarning Route ShapeError ThrustError
    TimingError UnknownSolverError VehicleError WaypointError YawError plan_through plot_convergence plot_heading
    plot_mission plot_overview plot_path plot_profiles plot_race plot_rotors plot_route plot_utilisation read_map
    """.split()
)
"""Names that version 0.2 had at the root: in 0.3 they are there with a warning."""

_ELSEWHERE = {
    "simulate": "minsnap.flight.simulate",
    "Quadrotor": "minsnap.vehicle.Quadrotor",
    **dict.fromkeys(("write_json", "write_yaml", "save", "write"), "plan.save('file.json')"),
    **dict.fromkeys(("read_json", "read_plan", "load", "read"), "minsnap.files.read_any('file.json')"),
    "Sphere": "minsnap.Ellipsoid(center, (r, r, r))",
    "Box": "minsnap.Cuboid(lower, upper) to avoid, minsnap.Room(lower, upper) to stay in",
    "Obstacle": "minsnap.Cylinder, minsnap.Ellipsoid or minsnap.Cuboid",
    "rect": "minsnap.rectangle",
    "eight": "minsnap.lemniscate",
    "generate": "minsnap.plan",
    **dict.fromkeys(("optimize", "optimise", "solve", "minimum_snap", "MinSnap"), "minsnap.plan"),
    "Waypoint": "a row of numbers: minsnap.plan([(0, 0, 1), (4, 0, 1)], …)",
    "check": "minsnap.certify",
    "validate": "minsnap.certify",
}
"""Names that one may look for, and what they are here."""


def __getattr__(name: str) -> Any:
    try:
        return _load(name)
    except AttributeError:
        from importlib import import_module

        if name in _ELSEWHERE:
            raise AttributeError(f"minsnap has no {name}: it is {_ELSEWHERE[name]}") from None
        for home in () if name.startswith("_") else _HOMES:
            module = import_module(f"minsnap.{home}")
            if name in getattr(module, "__all__", dir(module)):
                if name in _MOVED:
                    from minsnap.basics.warn import warn_deprecated

                    warn_deprecated(f"minsnap.{name}", f"minsnap.{home}.{name}", "0.3")
                    return getattr(module, name)
                raise AttributeError(f"minsnap has no {name}: it is minsnap.{home}.{name}") from None
        raise
