"""The description of a file format, which all readers and writers use to find it."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from minsnap.trajectory.samples import Samples
from minsnap.trajectory.trajectory import Trajectory

Content = Trajectory | Samples
"""What a file holds, in z-up world axes."""

PathLike = str | os.PathLike[str]


@dataclass(frozen=True)
class Writing:
    """Options for writing a file.

    Parameters
    ----------
    frame : str
        Axes of the formats that have a choice.
    clobber : bool
        False: a destination that exists is an error.
    facts : mapping
        What is known of a plan besides its curve, for formats that keep it: ``waypoints``, ``corridor``, ``limits``,
        ``command``.
    """

    frame: str = "enu"
    clobber: bool = True
    facts: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Format:
    """One file format. A module of ``minsnap.files.formats`` adds formats by defining ``FORMATS``.

    Parameters
    ----------
    name : str
        As in ``minsnap convert --to NAME``.
    holds : {"samples", "polynomials", "either"}
        What is passed to ``write``.
    endings : tuple of str
        Endings that mean this format when a file is written; none where only its name chooses it.
    write : callable or None
        ``write(content, path, clobber=)``; returns a sentence on what was lost, or None.
    reads : tuple of str
        Endings of the files that ``read`` takes.
    read : callable or None
        ``read(path)``.
    recognises : callable or None
        Whether a file with such an ending is of this format; None: any is that no other recognises.
    frame : str
        Axes that it is written in; empty where they are chosen, so that ``write`` takes ``frame`` too.
    reads_frame, facts : bool
        Whether ``read`` takes the frame as well, and ``write`` the facts of :class:`Writing`.
    most_pieces : int or None
        Polynomials that it holds at most.
    rounding : callable or None
        ``rounding(trajectory, step)``: what the format's rounding may do to a difference of two values a step apart, or
        None where numbers are read back exactly.
    """

    name: str
    holds: Literal["samples", "polynomials", "either"]
    endings: tuple[str, ...] = ()
    write: Callable[..., Any] | None = None
    reads: tuple[str, ...] = ()
    read: Callable[..., Content] | None = None
    recognises: Callable[[PathLike], bool] | None = None
    frame: str = "enu"
    reads_frame: bool = False
    facts: bool = False
    most_pieces: int | None = None
    rounding: Callable[[Trajectory, float], float] | None = None
