"""Animations of a path, and of a flight along it, as GIF or MP4."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_positive
from minsnap.basics.progress import told
from minsnap.basics.storage.atomic import atomic_write, check_destination
from minsnap.errors import FileError, InputError, TimingError
from minsnap.plot.geometry import check_view, fitting_size, plot_path, view_coordinates
from minsnap.plot.style import AXIS_STYLES, PATH_COLOUR
from minsnap.trajectory.path import Path
from minsnap.trajectory.samples import Samples

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ENDINGS = (".gif", ".mp4")

MOST_FRAMES = 3000
"""Pictures of one animation at most."""

TRAIL = 2.0
"""How long the trail behind the vehicle is [s]."""


def animate_path(
    path: Path | Samples,
    file: str | os.PathLike[str],
    *,
    flight: Samples | None = None,
    view: str = "xy",
    rate: float = 15.0,
    speed: float = 1.0,
    clobber: bool = True,
    progress: Callable[[float], None] | bool | None = None,
    title: str = "",
    **drawn: Any,
) -> None:
    """Write an animation: a point that moves along a path in its time, and one that a flight moved along.

    Parameters
    ----------
    path : Path or Samples
        dim 2 or 3.
    file : str or path
        ``.gif``, or ``.mp4`` where the program ffmpeg is installed.
    flight : Samples, optional
        What was flown along it.
    view : str
        ``"xy"``, ``"xz"`` or ``"yz"``.
    rate : float
        Pictures a second [Hz].
    speed : float
        How many times faster than in flight.
    clobber : bool
        False: a file that exists is an error.
    progress : callable, bool or None
        Called with the part that is done, 0 to 1; True shows a line on standard error.
    title : str
        Written before the time.
    **drawn
        What :func:`minsnap.plot.plot_path` is to draw too: ``corridor``, ``waypoints``.

    Raises
    ------
    InputError
        If the view is not plane.
    FileError
        If the ending is another, ffmpeg is needed and not found, or the file cannot be written.
    TimingError
        If rate or speed are not positive, or there would be more than 3000 pictures.
    """
    ending = check_animation_name(file, view)
    check_destination(file, clobber=clobber)
    instants = _instants(path.duration, rate, speed)
    moving = _Moving(path, flight, view, instants, title, drawn)
    with TemporaryDirectory() as folder, told(progress, "drawing", lambda line: line.show) as watch:
        place = FilePath(folder) / f"animation{ending}"
        moving.save(place, rate, watch)
        with atomic_write(file, "wb", clobber=clobber) as out:
            out.write(place.read_bytes())


def check_animation_name(file: str | os.PathLike[str], view: str = "xy") -> str:
    """Return the ending of an animation's name in lower case, or raise FileError if it cannot be written.

    A view in space is an InputError.
    """
    if check_view(view) == "3d":
        raise InputError("an animation is drawn in a plane: choose the view xy, xz or yz")
    ending = FilePath(file).suffix.lower()
    if ending not in ENDINGS:
        raise FileError(f"{file} does not end in {' or '.join(ENDINGS)}: an animation is written as one of these")
    if ending == ".mp4" and shutil.which("ffmpeg") is None:
        raise FileError(f"{file}: MP4 needs the program ffmpeg, which is not installed; write a .gif instead")
    return ending


def _instants(duration: float, rate: float, speed: float) -> FloatArray:
    for name, value in (("rate", rate), ("speed", speed)):
        check_positive(f"the {name} of an animation", value, "", TimingError)
    count = int(np.ceil(duration * rate / speed)) + 1
    if count > MOST_FRAMES:
        raise TimingError(
            f"the animation would have {count} pictures, at most {MOST_FRAMES} are made: raise speed or lower rate"
        )
    return np.asarray(np.minimum(np.arange(count) * speed / rate, duration))


class _Moving:
    """A figure whose points move."""

    def __init__(
        self,
        path: Path | Samples,
        flight: Samples | None,
        view: str,
        instants: FloatArray,
        title: str = "",
        drawn: Mapping[str, Any] | None = None,
    ) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        chosen = view_coordinates(view, path.dim)
        self.instants = instants
        self.curves = [_at(part, instants)[:, chosen] for part in (path, flight) if part is not None]
        self.figure: Figure = Figure(figsize=fitting_size(np.concatenate(self.curves)), layout="constrained")
        FigureCanvasAgg(self.figure)
        axes = self.figure.add_subplot()
        colours = [PATH_COLOUR, AXIS_STYLES[0]["color"]][: len(self.curves)]
        if flight is not None:
            axes.plot(*self.curves[1].T, color=colours[1], linewidth=1.0, alpha=0.7, label="flown")
        plot_path(path, axes, view=view, **(drawn or {}))
        self.trails: list[Any] = [axes.plot([], [], color=c, linewidth=3.5, alpha=0.6, zorder=8)[0] for c in colours]
        self.points: list[Any] = [axes.plot([], [], "o", color=c, markersize=9, zorder=9)[0] for c in colours]
        self.title = f"{title}  " if title else ""
        self.clock = axes.set_title(f"{self.title}0.0 s")
        self.figure.draw_without_rendering()
        self.figure.set_layout_engine("none")  # the layout of the first picture is that of all

    def show(self, index: int) -> list[Any]:
        """Move the points to an instant."""
        first = int(np.searchsorted(self.instants, self.instants[index] - TRAIL))
        for curve, trail, point in zip(self.curves, self.trails, self.points, strict=True):
            trail.set_data(*curve[first : index + 1].T)
            point.set_data(*curve[index : index + 1].T)
        self.clock.set_text(f"{self.title}{self.instants[index]:.1f} s")
        return [*self.trails, *self.points, self.clock]

    def save(self, file: FilePath, rate: float, progress: Callable[[float], None] | None) -> None:
        """Write all pictures."""
        from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter

        writer = PillowWriter(fps=rate) if file.suffix == ".gif" else FFMpegWriter(fps=rate)  # type: ignore[arg-type]
        animation = FuncAnimation(self.figure, self.show, frames=len(self.instants), blit=False)
        shown = progress or (lambda _: None)
        animation.save(str(file), writer=writer, dpi=80, progress_callback=lambda i, count: shown(i / count))


def _at(source: Path | Samples, instants: FloatArray) -> FloatArray:
    """Positions at instants, those between samples on straight lines."""
    if isinstance(source, Path):
        return source(np.minimum(instants, source.duration))
    t = source.t - source.t[0]
    return np.stack([np.interp(instants, t, column) for column in source.position.T], axis=-1)
