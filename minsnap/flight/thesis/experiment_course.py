"""The courses of the published experiment: hover, trigger, ten repetitions, as setpoints at 20 Hz."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from minsnap.basics.checks import is_whole
from minsnap.errors import InputError
from minsnap.trajectory.path import Path
from minsnap.trajectory.samples import Samples

HOVER = 5.0
"""Hover at the start of the course before the trigger [s]."""
HOLD = 2.0
"""Hold at its end [s]."""


@dataclass(frozen=True, eq=False)
class ExperimentCourse:
    """Setpoints of an experiment and its parts in time.

    Parameters
    ----------
    name : str
        What is flown: ``circle``, ``line`` or ``rect``.
    samples : Samples
        Setpoints from the hover to the hold.
    start, end : float
        First and last instant of the repetitions [s].
    settled : float
        End of the first repetition: the transient ends and the steady state begins [s].
    slowing : float
        Where the steady state ends: the last repetition, or the end of it where nothing slows down [s].
    repetitions : int
        How many.
    """

    name: str
    samples: Samples
    start: float
    end: float
    settled: float
    slowing: float
    repetitions: int


def course(name: str, repetitions: int = 10, *, literal: bool = True, rate: float = 20.0) -> ExperimentCourse:
    """Return a course of the published experiment.

    Parameters
    ----------
    name : {"circle", "line", "rect"}
        A circle of 3 m and 6 s a lap; a line of 7 m at y = 1; a rectangle of 6 m by 4 m in a corridor of 0.3 m.
    repetitions : int
        How often it is flown.
    literal : bool
        As in the thesis: the circle starts and ends at full speed, and the line jumps back to its start for each
        repetition. Otherwise the circle spins up from rest and down to rest, and the line is flown from rest to rest,
        there and back. The rectangle, from rest to rest corner by corner, is the same in both.
    rate : float
        Setpoints a second [Hz].

    Returns
    -------
    ExperimentCourse

    Raises
    ------
    InputError
        If the name is not known, or the repetitions are not a whole number from 1.
    """
    if name not in _COURSES:
        raise InputError(f"no course is called {name!r}: choose from {', '.join(_COURSES)}")
    if not is_whole(repetitions) or repetitions < 1:
        raise InputError(f"the repetitions are {repetitions!r}: give a whole number from 1")
    return _framed(name, _COURSES[name](repetitions, literal, rate), repetitions, name == "circle" and not literal)


def _circle(repetitions: int, literal: bool, rate: float) -> Samples:
    from minsnap.paths.shapes import circle

    if not literal:
        return circle(3.0, period=6.0, laps=repetitions, ramp=min(math.pi / 2.0, math.pi * repetitions)).sample(rate)
    return _repeated([circle(3.0, period=6.0, ramp=0.0)] * repetitions, rate, joined=True)


def _line(repetitions: int, literal: bool, rate: float) -> Samples:
    from minsnap.paths.shapes import line

    if literal:
        return _repeated([line(constant_speed=True)] * repetitions, rate, joined=False)
    ends = ((0.0, 1.0, 1.5), (7.0, 1.0, 1.5))
    there_and_back = (line(*ends, total_time=7.0), line(*reversed(ends), total_time=7.0))
    return _repeated([there_and_back[index % 2] for index in range(repetitions)], rate, joined=True)


def _rect(repetitions: int, literal: bool, rate: float) -> Samples:
    from minsnap.paths.shapes import rectangle

    once = rectangle(6.0, 4.0, corridor=0.3, durations=[6.0, 4.0, 6.0, 4.0])
    return _repeated([once] * repetitions, rate, joined=True)


_COURSES: dict[str, Callable[[int, bool, float], Samples]] = {"circle": _circle, "line": _line, "rect": _rect}


def _repeated(paths: list[Path], rate: float, joined: bool) -> Samples:
    """Return the samples of one path after the other; where they join, the end of one is the start of the next."""
    sampled = {id(path): path.sample(rate) for path in paths}
    parts = [sampled[id(path)] for path in paths]
    kept = [part[: len(part) - int(joined)] for part in parts[:-1]]
    return _joined([*kept, parts[-1]], rate)


def _joined(parts: list[Samples], rate: float) -> Samples:
    """Return samples one after the other on a uniform grid from 0."""
    names = ("position", "velocity", "acceleration", "jerk", "snap", "yaw", "yaw_rate")
    columns: dict[str, Any] = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    return Samples(np.arange(len(columns["position"])) / rate, **columns)


def _framed(name: str, flown: Samples, repetitions: int, slows: bool) -> ExperimentCourse:
    """Add the hover before and the hold after the repetitions."""
    rate = flown.rate
    hover, hold = _resting(flown, 0, round(HOVER * rate)), _resting(flown, -1, round(HOLD * rate))
    samples = _joined([hover, flown, hold], rate)
    start = len(hover) / rate
    end, each = start + flown.duration, flown.duration / repetitions
    settled = start + each if repetitions > 1 else end
    return ExperimentCourse(
        name, samples, start, end, settled, end - each if slows and repetitions > 2 else end, repetitions
    )


def _resting(samples: Samples, index: int, count: int) -> Samples:
    """Return a sample held at rest for a count of steps."""
    held = samples[np.full(count, index)]
    still = np.zeros((count, samples.dim))
    return replace(held, velocity=still, acceleration=still, jerk=still, snap=still, yaw_rate=np.zeros(count))
