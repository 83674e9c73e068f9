"""A request as Python and as a command line that give exactly the same plan."""

from __future__ import annotations

import shlex

from minsnap.files.request_yaml import request_text
from minsnap.planning.request import PLAIN, PlanRequest

END = "END_OF_REQUEST"
"""The line that ends the text of the request in a shell."""


def as_python(request: PlanRequest) -> str:
    """Return a script that plans a request and leaves it in ``trajectory``; numbers are written exactly."""
    own = {"limits": _limits(request), "corridor": _walls(request), "avoid": _avoided(request)}
    usual = vars(PlanRequest(request.waypoints))
    values = {n: repr(list(v) if isinstance(v, tuple) else v) for n, v in vars(request).items() if v != usual[n]}
    values |= {"search": f"minsnap.{request.search!r}"} if request.search else {}
    lines = [f"    {n}={value}," for n, value in (values | own).items() if value is not None and n not in PLAIN]
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
