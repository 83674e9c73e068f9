"""The description of a file format, which all readers and writers use to find it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from minsnap.basics.storage.text import FileName
from minsnap.errors import FrameError
from minsnap.files.frames import get_frame
from minsnap.trajectory.samples import Samples
from minsnap.trajectory.trajectory import Trajectory

Content = Trajectory | Samples
"""What a file holds, in z-up world axes."""


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
        Whether ``read`` takes the frame as well, and ``write`` what else is known of a plan: waypoints, limits, …
    most_pieces : int or None
        Polynomials that it holds at most.
    leaves_out : tuple of str
        What it does not hold of samples and ``write`` does not name: their fields, ``t`` for a first instant but 0. By
        default what no polynomials hold.
    rounding : callable or None
        ``rounding(trajectory, step)``: what the format's rounding or low degree may do to a difference of two values a
        step apart, or None where numbers are read back exactly.
    """

    name: str
    holds: Literal["samples", "polynomials", "either"]
    endings: tuple[str, ...] = ()
    write: Callable[..., Any] | None = None
    reads: tuple[str, ...] = ()
    read: Callable[..., Content] | None = None
    recognises: Callable[[FileName], bool] | None = None
    frame: str = "enu"
    reads_frame: bool = False
    facts: bool = False
    most_pieces: int | None = None
    leaves_out: tuple[str, ...] = ("t", "jerk", "snap", "feed_forward", "lead")
    rounding: Callable[[Trajectory, float], float] | None = None

    def check_frame(self, frame: str) -> None:
        """Raise FrameError for a frame other than the default if this format has its own."""
        name = get_frame(frame).name
        if self.frame and name not in ("enu", self.frame):
            raise FrameError(f"{self.name} is written in {self.frame}, not in {name}: leave the frame out")
