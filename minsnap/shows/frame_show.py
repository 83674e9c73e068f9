"""Shows that are frames alone: what another program has planned from the first instant to the last, made certain."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from minsnap.basics.storage.text import FileName, name_as_text
from minsnap.files.formats import Lights
from minsnap.fleet import Fleet, Separation
from minsnap.limits import Limits
from minsnap.shows.acts import Act, Show
from minsnap.shows.csv_show import read_frames
from minsnap.shows.frame_animation import TOLERANCE, Animation
from minsnap.shows.show import FlownShow
from minsnap.shows.timeline import Stage
from minsnap.trajectory import Trajectory


def is_frames(path: FileName) -> bool:
    """Whether a path is a zip, or a folder with CSV files in it."""
    place = Path(path)
    return place.suffix.lower() == ".zip" or (place.is_dir() and any(place.glob("*.csv")))


def show_of_frames(
    path: FileName, separation: Separation, limits: Limits, tolerance: float = TOLERANCE, slower: float = 1.0
) -> tuple[Show, FlownShow]:
    """Return the show that frames are, and its smooth curves, each within a tolerance of its frames [m].

    It lasts ``slower`` times as long as they do.

    Raises
    ------
    FileError
        If there are no frames.
    FleetError
        If they come nearer than the separation or exceed the limits; says which size and pace would do.
    """
    animation, name = Animation(read_frames(path), slower=slower, tolerance=tolerance), name_as_text(Path(path).stem)
    animation.refuse_dense_or_fast(name, separation, limits)
    end = animation.duration
    curves = tuple(_until(curve, end) for curve in animation.curves)
    lights = tuple(animation.lights(i) or _white(end) for i in range(len(curves)))
    names = animation.frames.names
    fleet = Fleet(curves, names if len(set(names)) == len(names) else None, separation)
    ends = (Stage("start", 0.0, 0.0, 0.0, "frames"), Stage("end", end, end, end, "frames"))
    stages = (ends[0], Stage(name, 0.0, 0.0, end, "frames"), ends[1])
    act = Act(name, animation.start, moves=(animation,), hold=0.0)
    show = Show(animation.start, (act,), separation, limits, take_off=0.0, return_home=False)
    return show, FlownShow(fleet, lights, stages)


def _white(end: float) -> Lights:
    return Lights(np.array([0.0, end]), np.array([[255.0] * 3, [0.0] * 3]), np.zeros(2, dtype=bool))


def _until(curve: Trajectory, end: float) -> Trajectory:
    """Return a curve that waits at its end until an instant [s]."""
    left = end - curve.duration
    if left <= 1e-9:
        return curve
    wait = np.tile(curve.control_points[-1:, -1:], (1, 8, 1))
    return Trajectory(np.concatenate((curve.control_points, wait)), np.append(curve.durations, left))
