"""Options that take a point of two or three coordinates."""

from __future__ import annotations

from typing import Any

from typer.core import TyperCommand

from minsnap.errors import InputError

POINT_OPTIONS = ("--start", "--goal")


class PointCommand(TyperCommand):
    """A command whose options ``--start`` and ``--goal`` take two or three numbers each."""

    def parse_args(self, context: Any, args: list[str]) -> list[str]:
        """Join the numbers after such an option to one text before the command reads them."""
        return super().parse_args(context, joined_points(args))


def joined_points(arguments: list[str]) -> list[str]:
    """Return the arguments with ``--start 1 -2`` written as ``--start=1,-2``."""
    joined: list[str] = []
    at = 0
    while at < len(arguments):
        word = arguments[at]
        at += 1
        count = 0
        while word in POINT_OPTIONS and at + count < len(arguments) and _is_number(arguments[at + count]):
            count += 1
        joined.append(f"{word}={','.join(arguments[at : at + count])}" if count else word)
        at += count
    return joined


def parse_point(option: str, text: str) -> tuple[float, ...]:
    """Return the coordinates of a point, two or three [m].

    Raises
    ------
    InputError
        If the text is not as many numbers.
    """
    words = text.split(",")
    if len(words) not in (2, 3) or not all(map(_is_number, words)):
        raise InputError(f"{option} is {text!r}: give X Y or X Y Z [m]")
    return tuple(map(float, words))


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
