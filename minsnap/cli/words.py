"""Sentences of the library in the words of the command line: its options instead of arguments of functions."""

from __future__ import annotations

import re

ARGUMENTS = {
    "align": "--align",
    "closed": "--closed",
    "continuity": "--continuity",
    "corridor": "--corridor",
    "degree": "--degree",
    "hold_below": "--hold-below",
    "limits": "a limit such as --max-speed",
    "pieces": "--pieces",
    "solver": "--solver",
    "split": "--split",
    "time_limit": "--time-limit",
    "time_weight": "--time-weight",
    "total_time": "--time",
    "yaw": "--yaw",
    "yaw_rate": "--yaw-rate",
}
"""Arguments of functions, and the options that stand for them."""

_GIVEN = re.compile(r"\b([a-z]+(?:_[a-z]+)*)=('[^']*'|[^\s,:;]*)")
_NAMED = re.compile(r"\b([a-z]+(?:_[a-z]+)+)\b")


def in_options(sentence: str) -> str:
    """Return a sentence with ``closed=True`` as ``--closed``, ``yaw='tilt'`` as ``--yaw tilt``, and so on.

    A word that is also plain English, such as "corridor", is left as it is where no value follows.
    """
    return _NAMED.sub(_option, _GIVEN.sub(_option_with_value, sentence))


def _option(match: re.Match[str]) -> str:
    return ARGUMENTS.get(match[1], match[1])


def _option_with_value(match: re.Match[str]) -> str:
    name, value = match[1], match[2].strip("'")
    if name not in ARGUMENTS:
        return match[0]
    return ARGUMENTS[name] if value in ("", "True") else f"{ARGUMENTS[name]} {value}"
