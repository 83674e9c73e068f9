"""What the file of a show says twice and differently, or says without effect, told before anything is planned."""

from __future__ import annotations

from typing import Any

from minsnap.errors import FileError


def refuse_contradictions(content: dict[str, Any]) -> None:
    """Raise FileError for the first two entries of a show, as they were read, that do not go together."""
    vehicles = content["vehicles"]
    if not content.get("return_home", True) and content.get("land") is not None:
        land = content["land"]
        if land == "any" or (isinstance(land, dict) and "place" in land):
            raise FileError("with return_home: false all land below the last act: leave out at whose home they land")
    for number, entry in enumerate(content["acts"], 1):
        if "groups" in entry:
            _check_groups(entry, f"act {number}", vehicles)
        else:
            _check_act(entry, f"act {number}", vehicles)


def _check_groups(content: dict[str, Any], where: str, vehicles: int) -> None:
    names = [group["name"] for group in content["groups"] if "name" in group]
    twice = [name for i, name in enumerate(names) if name in names[:i]]
    if twice:
        raise FileError(f"two groups of {where} are called {twice[0]!r}: give each a name of its own")
    for number, group in enumerate(content["groups"], 1):
        name, count = group.get("name", f"group {number}"), group["vehicles"]
        if not 1 <= count <= vehicles:
            raise FileError(f"{name} of {where} has {count} vehicles: give a number from 1 to {vehicles}")
        for i, entry in enumerate(group["acts"], 1):
            if entry.get("vehicles", count) != count:
                text = f"act {i} of {name} of {where} has {entry['vehicles']} vehicles, and the group {count}"
                raise FileError(f"{text}: an act of a group has all of them, so leave the number out")
            _check_act(entry, f"act {i} of {name} of {where}", count)


def _check_act(content: dict[str, Any], where: str, vehicles: int) -> None:
    """Refuse numbers of vehicles that are not there, and entries that have no effect without others."""
    count = content.get("vehicles")
    if not content.get("name", where).strip():
        raise FileError(f"the name of {where} is empty: give it one, or leave it out")
    if count is not None and not 1 <= count <= vehicles:
        raise FileError(f"{where} has {count} vehicles, and there are {vehicles}: give a number from 1 to {vehicles}")
    if "fade" in content and "colour" not in content:
        raise FileError(f"{where} has fade and no colour to which it leads: give a colour, or leave fade out")
    text = content.get("formation", {}).get("text", {})
    if "font" in text and text.get("outlines") is False:
        raise FileError(f"the text of {where} has a font, of which only outlines are there: leave out outlines: false")
    for move in content.get("moves", ()):
        if not {"turn", "scale", "along"} & set(move):
            raise FileError(f"a move of {where} moves nothing: give it a turn, a scale or a way along points")
