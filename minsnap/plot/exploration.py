"""Films of explorations: what is known at each instant, what is planned, and what was flown."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.checks import check_positive
from minsnap.basics.progress import progress_line
from minsnap.basics.storage.text import FileName
from minsnap.errors import InputError, TimingError
from minsnap.paths.routes import SeenSoFar
from minsnap.plot.animation import Picture, check_animation_name, write_film
from minsnap.plot.geometry import fitting_size
from minsnap.plot.style import PATH_COLOUR, Axes, styled

SHADES = ("#ced4da", "#ffffff", "#495057")
"""Of cells that are unknown, free and occupied."""

FLOWN_COLOUR = "#1971c2"

PLANNED = 200
"""Instants at which a plan is drawn."""


@styled
def animate_exploration(
    seen: Sequence[SeenSoFar],
    file: FileName,
    *,
    rate: float = 10.0,
    clobber: bool = True,
    progress: Callable[[float], None] | bool | None = None,
    title: str = "",
) -> None:
    """Write a film of an exploration from above: cells, the plan, and the path flown so far.

    Parameters
    ----------
    seen : sequence of SeenSoFar
        One a picture: ``Explorer.seen(plan)`` after each answer.
    file : str or path
        ``.gif``; ``.mp4`` or ``.webm`` where ffmpeg is installed.
    rate : float
        Pictures a second [Hz].
    clobber : bool
        False: a file that exists is an error.
    progress : callable, bool or None
        Called with the part that is done, 0 to 1; True shows a line on standard error.
    title : str
        Written above.

    Raises
    ------
    InputError
        If there is none.
    FileError
        If the ending is another, ffmpeg is needed and missing, or the file cannot be written.
    TimingError
        If the rate is not positive.
    """
    check_animation_name(file)
    check_positive("the rate of an animation", rate, "", TimingError)
    pictures = [each for each in seen if isinstance(each, SeenSoFar)]
    if not pictures or len(pictures) < len(seen):
        raise InputError("an exploration has one or more SeenSoFar, as Explorer.seen returns them: give these")
    write_film(_pictures(pictures, title, progress), file, rate, clobber=clobber)


def _pictures(seen: list[SeenSoFar], title: str, progress: Callable[[float], None] | bool | None) -> Iterator[Picture]:
    """Yield the picture of each instant."""
    from matplotlib.colors import ListedColormap

    last = max(seen, key=lambda each: each.states.size)
    low, high = (last.lower + last.size * np.array(last.states.shape) * end for end in (0, 1))
    low, high = np.minimum(low, last.goal)[:2], np.maximum(high, last.goal)[:2]
    axes = _axes(np.stack((low, high)))
    canvas: Any = axes.figure.canvas
    name = f"{title}, " if title else ""
    with progress_line(progress, "drawing", lambda line: line.show) as watch:
        for index, each in enumerate(seen):
            if watch is not None:
                watch(index / len(seen))
            axes.clear()
            states, end = _from_above(each.states), each.lower[:2] + each.size * np.array(each.states.shape[:2])
            extent = (each.lower[0], end[0], each.lower[1], end[1])
            shades: dict[str, Any] = {"cmap": ListedColormap(SHADES), "vmin": 0, "vmax": 2, "interpolation": "nearest"}
            axes.imshow(states.T, origin="lower", extent=extent, **shades)
            _draw_flight(axes, each, np.array([other.position[:2] for other in seen[: index + 1]]))
            axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x [m]", ylabel="y [m]")
            axes.set_facecolor(SHADES[0])
            axes.set_title(f"{name}{np.count_nonzero(each.states)} cells known", loc="left")
            canvas.draw()
            yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _draw_flight(axes: Axes, seen: SeenSoFar, flown: FloatArray) -> None:
    if seen.plan is not None:
        planned = seen.plan(np.linspace(0.0, seen.plan.duration, PLANNED))
        axes.plot(*planned[:, :2].T, color=PATH_COLOUR, linewidth=1.5, label="plan")
    axes.plot(*flown.T, color=FLOWN_COLOUR, linewidth=2.5, label="flown")
    axes.plot(*seen.position[:2], "o", color=FLOWN_COLOUR, markersize=7, label="_")
    axes.plot(*seen.goal[:2], "*", color="#e8590c", markersize=12, label="goal")
    axes.legend(loc="upper right")


def _from_above(states: IntArray) -> IntArray:
    """Return the states of columns of cells: occupied where one is."""
    return states if states.ndim == 2 else np.asarray(states.max(axis=2))


def _axes(corners: FloatArray) -> Axes:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=fitting_size(corners), dpi=80, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    return axes
