"""Arguments of ``plan`` from the flat names of options, tables and files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from minsnap.basics.messages import shown
from minsnap.corridors.boxes import as_room
from minsnap.errors import YawError
from minsnap.time_allocation.search_options import Search
from minsnap.trajectory.velocity_heading import Velocity

SEARCH = tuple(field.name for field in fields(Search))
TURNING = tuple(field.name for field in fields(Velocity))


def plan_arguments(named: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments of ``plan``: search options, the room and the turning of a heading take their forms.

    Parameters
    ----------
    named : mapping
        Arguments of ``plan``; fields of ``Search`` and ``Velocity`` and ``room`` may stand beside them.

    Raises
    ------
    InputError
        If a value is malformed, or turning goes with another yaw than one along the velocity.
    """
    arguments = {name: value for name, value in named.items() if name not in (*SEARCH, *TURNING, "room")}
    search = {name: named[name] for name in SEARCH if named.get(name) is not None}
    turning = {name: named[name] for name in TURNING if named.get(name) is not None}
    if search:
        arguments["search"] = Search(**search)
    if turning:
        if not (isinstance(arguments.get("yaw"), str) and arguments["yaw"] == "velocity"):
            name, value = next(iter(turning.items()))
            raise YawError(f"{name}={shown(value)} is for a heading along the velocity: give yaw='velocity' with it")
        arguments["yaw"] = Velocity(**turning)
    room = as_room(named.get("room"))
    if room:
        corridor = arguments.get("corridor")
        arguments["corridor"] = room if corridor is None else [corridor, *room]
    return arguments
