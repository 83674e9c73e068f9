"""A picture of a show as its audience sees it: each act, in the colours of its lights, on a dark sky."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import FleetError
from minsnap.plot.shown_figure import ShownFigure
from minsnap.plot.style import styled
from minsnap.shows.act_lights import Gradient
from minsnap.shows.acts import Act, Show
from minsnap.shows.frame_animation import Animation

SKY, GROUND, WORDS = "#05070f", "#10141f", "#8a93a8"

GLOW = ((70.0, 0.10), (24.0, 0.3), (6.0, 1.0))
"""Sizes of the discs of a light [pt²], and how far each covers what is behind it."""

ACROSS = 4
"""Pictures beside each other."""

FAINT = 24.0
"""Level below which a light is drawn as a vehicle that is dark, of 255."""

AWAY = 3.0
"""How many times the largest extent of all acts the audience is away from their middle."""

WHITE = np.full(3, 255.0)


@dataclass(frozen=True, eq=False)
class Picture:
    """What is seen of one act.

    Parameters
    ----------
    title : str
    points, colours : ndarray, shape (points, 3)
        [m], and from 0 to 255.
    """

    title: str
    points: FloatArray
    colours: FloatArray


def pictures_of(show: Show) -> list[Picture]:
    """Return a picture of each act on arrival, in its first colours, and of an animation halfway."""
    return [_picture(act) for act in show.formations]


def _picture(act: Act) -> Picture:
    played = next((move for move in act.moves if isinstance(move, Animation)), None)
    points, title = act.points, act.name
    if played is not None:
        half = [len(places) // 2 for places in played.places]
        points = np.stack([places[i] for places, i in zip(played.places, half, strict=True)])
        title = f"{act.name}, halfway"
        own = played.frames.colours
        if own is not None and not act.changes:
            return Picture(title, points, np.stack([colours[i] for colours, i in zip(own, half, strict=True)]))
    colour = act.changes[0].colour if act.changes else WHITE
    if isinstance(colour, Gradient):
        return Picture(title, points, np.concatenate([colour.at(i, np.zeros(1)) for i in range(len(points))]))
    return Picture(title, points, np.broadcast_to(np.asarray(colour, dtype=np.float64), points.shape))


@styled
def draw_preview(pictures: Sequence[Picture]) -> ShownFigure:
    """Draw what the audience sees of each act, all in one scale.

    It stands on the ground at negative y and looks along y: x is to the right.

    Raises
    ------
    FleetError
        If there are no acts.
    """
    if not pictures:
        raise FleetError("a show without acts has no picture: give it acts")
    rows, across = ceil(len(pictures) / ACROSS), min(len(pictures), ACROSS)
    figure = ShownFigure(figsize=(3.4 * across, 3.1 * rows), layout="constrained", facecolor=SKY)
    seen = _seen([picture.points for picture in pictures])
    reach = np.concatenate(seen)
    half = 0.55 * max(2.0 * float(np.abs(reach[:, 0]).max()), float(reach[:, 1].max()), 1.0)
    grid = figure.subplots(rows, across, squeeze=False).ravel()
    for axes in grid:
        axes.set_axis_off()
    for axes, picture, places in zip(grid, pictures, seen, strict=False):
        axes.set(xlim=(-half, half), ylim=(-0.1 * half, 1.9 * half), aspect="equal")
        axes.axhspan(-0.1 * half, 0.0, color=GROUND)
        lit, colours = picture.colours.max(axis=1) >= FAINT, picture.colours / 255.0
        for size, cover in GLOW:
            axes.scatter(*places[lit].T, s=size, c=colours[lit], alpha=cover, linewidths=0.0)
        axes.scatter(*places[~lit].T, s=3.0, c=WORDS, alpha=0.4, linewidths=0.0)
        axes.set_title(picture.title, color=WORDS, fontsize=9)
    return figure


def _seen(acts: Sequence[FloatArray]) -> list[FloatArray]:
    """Return points as the audience sees them, in the upright plane through the middle of all acts, shape (n, 2)."""
    points = np.concatenate(acts)
    middle, away = points.mean(axis=0), AWAY * max(float(np.ptp(points, axis=0).max()), 1.0)
    shares = [away / (away + each[:, 1:2] - middle[1]) for each in acts]
    places = [np.column_stack((each[:, 0] - middle[0], each[:, 2])) for each in acts]
    return [place * share for place, share in zip(places, shares, strict=True)]
