"""A picture of a show as its audience sees it: each act, in the colours of its lights, on a dark sky."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.errors import FleetError
from minsnap.fleet import assign
from minsnap.plot.shown_figure import ShownFigure
from minsnap.plot.style import Axes, styled
from minsnap.shows.act_lights import Gradient
from minsnap.shows.act_moves import curves_of_moves
from minsnap.shows.acts import Act, Groups, Show
from minsnap.shows.frame_animation import Animation
from minsnap.shows.least_times import least_seconds

SKY, GROUND, WORDS = "#05070f", "#10141f", "#8a93a8"

GLOW = ((70.0, 0.10), (24.0, 0.3), (6.0, 1.0))
"""Sizes of the discs of a light [pt²], and how far each covers what is behind it."""

ACROSS = 4
"""Pictures beside each other."""

FAINT = 24.0
"""Level below which a light is drawn as a vehicle that is dark, of 255."""

AT_ONCE = 1.0
"""Acts of groups that are reached within this time are in one picture [s]."""

BAR = 0.3
"""Most that the scale bar takes of the width."""

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
    """Return a picture of each moment, in the first colours of its acts, and of an animation halfway.

    Groups that fly at once are in one picture, one for each time at which some of them are at an act. Without a plan
    these times are those of the least times of flights: they may be exchanged where they are near to each other.
    """
    pictures: list[Picture] = []
    for act in show.acts:
        if isinstance(act, Groups):
            pictures += _moments(act, pictures[-1] if pictures else None, show)
        else:
            pictures.append(_picture(act))
    return pictures


def _moments(groups: Groups, before: Picture | None, show: Show) -> list[Picture]:
    """Return a picture of all groups at each time when some reach an act, with those who are where they were before."""
    stays: list[Picture | None] = [None] * (len(groups.groups) + 1)
    if before is not None and len(before.points) >= len(groups.first):
        order = assign(groups.first, before.points, False)
        sizes = np.cumsum([len(group.acts[0].points) for group in groups.groups])
        members = [*np.split(order, sizes[:-1]), np.setdiff1d(np.arange(len(before.points)), order)]
        stays = [Picture("", before.points[own], before.colours[own]) for own in members]
    arrivals = [_arrivals(group.acts, show) for group in groups.groups]
    moments = [moment for moment, _ in at_once([(t, "") for each in arrivals for t in each.tolist()], AT_ONCE)]
    shown = [[_picture(act) for act in group.acts] for group in groups.groups]
    pictures = []
    for moment in moments:
        reached = [int(np.searchsorted(each, moment, side="right")) - 1 for each in arrivals]
        parts = [acts[i] if i >= 0 else stay for acts, i, stay in zip(shown, reached, stays, strict=False)]
        there = [part for part in [*parts, stays[-1]] if part is not None and len(part.points)]
        title = ", ".join(dict.fromkeys(part.title for part in there if part.title))
        points, colours = (np.concatenate(each) for each in zip(*((p.points, p.colours) for p in there), strict=True))
        pictures.append(Picture(title, points, colours))
    return pictures


def at_once(cues: Sequence[tuple[float, str]], within: float) -> list[tuple[float, str]]:
    """Return instants and names in the order of time, those within a time of the one before as one, the last [s]."""
    moments: list[tuple[float, str]] = []
    for instant, name in sorted(cues):
        if moments and instant - moments[-1][0] <= within:
            name = f"{moments.pop()[1]}, {name}"
        moments.append((instant, name))
    return moments


def _arrivals(acts: Sequence[Act], show: Show) -> FloatArray:
    """Return when acts of a group are reached at the earliest, from the first on where it has no time [s]."""
    arrivals, now, places = [], 0.0, acts[0].points
    for act in acts:
        now = now + (act.seconds or least_seconds(places, act.points, show.limits)) if act.at is None else act.at
        arrivals.append(now)
        now, places = now + act.lasts(curves_of_moves(act, show)), act.points
    return np.array(arrivals)


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
    seen, middle = _seen([picture.points for picture in pictures])
    reach = np.concatenate(seen)
    half = 0.55 * max(2.0 * float(np.abs(reach[:, 0] - middle).max()), float(reach[:, 1].max()), 1.0)
    grid = figure.subplots(rows, across, squeeze=False, sharex=True, sharey=True)
    for axes in grid.ravel()[len(pictures) :]:
        axes.set_axis_off()
    for axes, picture, places in zip(grid.ravel(), pictures, seen, strict=False):
        axes.set(xlim=(middle - half, middle + half), ylim=(-0.14 * half, 1.86 * half), aspect="equal", facecolor=SKY)
        axes.axhspan(-0.14 * half, 0.0, color=GROUND)
        _draw_bar(axes, middle, half)
        lit, colours = picture.colours.max(axis=1) >= FAINT, picture.colours / 255.0
        for size, cover in GLOW:
            axes.scatter(*places[lit].T, s=size, c=colours[lit], alpha=cover, linewidths=0.0)
        axes.scatter(*places[~lit].T, s=3.0, c=WORDS, alpha=0.4, linewidths=0.0)
        axes.set_title(picture.title, color=WORDS, fontsize=9)
        axes.grid(False)
        axes.tick_params(colors=WORDS, labelsize=7)
        for side in axes.spines.values():
            side.set_color(GROUND)
    for axes in grid[:, 0]:
        axes.set_ylabel("height [m]", color=WORDS, fontsize=8)
    for axes in grid.ravel()[max(len(pictures) - across, 0) : len(pictures)]:  # the lowest of each column
        axes.tick_params(labelbottom=True)
        axes.set_xlabel("x [m]", color=WORDS, fontsize=8)
    return figure


def _draw_bar(axes: Axes, middle: float, half: float) -> None:
    """Draw a bar of a round length on the ground, and say it."""
    most = BAR * 2.0 * half
    unit = 10.0 ** np.floor(np.log10(most))
    length = unit * max(step for step in (1.0, 2.0, 5.0) if step * unit <= most)
    right = middle + 0.95 * half
    axes.plot([right - length, right], [-0.07 * half] * 2, color=WORDS, linewidth=2.0, solid_capstyle="butt")
    beside = right - length - 0.04 * half
    axes.text(beside, -0.07 * half, f"{length:g} m", ha="right", va="center", color=WORDS, fontsize=7)


def _seen(acts: Sequence[FloatArray]) -> tuple[list[FloatArray], float]:
    """Return points as the audience sees them, in the upright plane through the middle of all acts, and that middle.

    Shapes (n, 2) [m]; the middle is an x.
    """
    points = np.concatenate(acts)
    middle, away = points.mean(axis=0), AWAY * max(float(np.ptp(points, axis=0).max()), 1.0)
    shares = [away / (away + each[:, 1:2] - middle[1]) for each in acts]
    places = [
        np.column_stack((middle[0] + share[:, 0] * (each[:, 0] - middle[0]), share[:, 0] * each[:, 2]))
        for each, share in zip(acts, shares, strict=True)
    ]
    return places, float(middle[0])
