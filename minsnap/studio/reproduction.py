"""A request as Python and as a command line that give exactly the same plan."""

from __future__ import annotations

import shlex
from typing import Any

from minsnap.files.plan_request import PlanRequest
from minsnap.files.request_yaml import request_text

END = "END_OF_REQUEST"
"""The line that ends the text of the request in a shell."""


def as_python(request: PlanRequest) -> str:
    """Return a script that plans a request and leaves it in ``trajectory``; numbers are written exactly."""
    arguments = {
        "total_time": request.total_time,
        "durations": _list(request.durations),
        "limits": _limits(request),
        "corridor": _walls(request),
        "avoid": _avoided(request),
        "yaw": _list(request.yaw),
        "degree": request.degree if request.degree != 7 else None,
        "continuity": request.continuity,
        "pieces": repr(request.pieces) if request.pieces != 1 else None,
        "closed": True if request.closed else None,
    }
    lines = [f"    {name}={value}," for name, value in arguments.items() if value is not None]
    gates = {index: f"minsnap.Gate.polygon{tuple(gate)!r}" for index, *gate in request.openings}
    points = [f"    {gates.get(i, repr(point))}," for i, point in enumerate(request.waypoints)]
    head = ["import minsnap"] + (["from minsnap.vehicle import Quadrotor"] if request.rotors is not None else [])
    head += ["from minsnap.corridors.keep_out import named_obstacle"] if request.avoid else []
    return "\n".join(
        [*head, "", "waypoints = [", *points, "]", "trajectory = minsnap.plan(", "    waypoints,", *lines, ")", ""]
    )


def as_command(request: PlanRequest, output: str = "setpoints.csv") -> str:
    """Return shell commands that write the request to a file and plan it.

    Parameters
    ----------
    request : PlanRequest
    output : str
        Name of the file of setpoints; that of the request has the ending ``.yaml`` instead.
    """
    stem = output.removesuffix(".csv")
    file, target = shlex.quote(f"{stem}.yaml"), shlex.quote(f"{stem}.csv")
    frame = f" --frame {request.frame}" if request.frame != "enu" else ""
    return f"cat > {file} <<'{END}'\n{request_text(request)}{END}\nminsnap plan {file}{frame} -o {target}\n"


def _list(value: Any) -> str | None:
    if value is None:
        return None
    return repr(list(value)) if isinstance(value, tuple) else repr(value)


def _limits(request: PlanRequest) -> str | None:
    fields = ", ".join(f"{name}={value!r}" for name, value in request.limits)
    if request.rotors is None:
        return f"minsnap.Limits({fields})" if fields else None
    vehicle = f"Quadrotor.{request.vehicle}(), reserve={request.rotors!r}"
    return f"minsnap.Limits.of({vehicle}{', ' if fields else ''}{fields})"


def _avoided(request: PlanRequest) -> str | None:
    each = [f"named_obstacle({name!r}, {numbers!r})" for name, numbers in request.avoid]
    return f"[{', '.join(each)}]" if each else None


def _walls(request: PlanRequest) -> str | None:
    corridor = _corridor(request)
    if request.room is None:
        return corridor
    room = f"minsnap.Room{request.room!r}"
    return room if corridor is None else f"[{corridor}, {room}]"


def _corridor(request: PlanRequest) -> str | None:
    widths = request.corridor
    tube = None if widths is None else repr(widths[0] if len(set(widths)) == 1 else list(widths))
    if request.boxes is None:
        return tube
    lower, upper = (repr([corners[side] for corners in request.boxes]) for side in (0, 1))
    boxes = f"minsnap.Boxes({lower}, {upper})"
    return boxes if tube is None else f"[minsnap.Tube({list(widths or ())!r}), {boxes}]"
