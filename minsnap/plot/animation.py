"""Animations of a path and of a flight along it, and of fleets: GIF by Pillow, MP4 and WebM by the program ffmpeg."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterator, Sequence
from itertools import chain
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray, NDArray, interpolated
from minsnap.basics.checks import check_positive
from minsnap.basics.progress import progress_line
from minsnap.basics.storage.atomic import check_destination, write_file
from minsnap.basics.storage.text import FileName
from minsnap.errors import FileError, InputError, TimingError
from minsnap.fleet import Fleet
from minsnap.plot.fleet_figures import VIEWS, legend_above, near_pairs, plot_fleet
from minsnap.plot.geometry import check_view, fitting_size, plot_path, view_coordinates
from minsnap.plot.style import AXIS_STYLES, PATH_COLOUR, Axes
from minsnap.trajectory import Path, Samples

ENDINGS = (".gif", ".mp4", ".webm")

Picture = NDArray[np.uint8]
"""Rows from the top, shape (height, width, 3): red, green, blue."""


def check_film_name(file: FileName) -> str:
    """Return the ending of a film's name in lower case, or raise FileError if it cannot be written."""
    ending = FilePath(file).suffix.lower()
    if ending not in ENDINGS:
        raise FileError(f"{file} does not end in {' or '.join(ENDINGS)}: an animation is written as one of these")
    if ending != ".gif" and shutil.which("ffmpeg") is None:
        name = ending[1:].upper().replace("WEBM", "WebM")
        raise FileError(f"{file}: {name} needs the program ffmpeg, which is not installed; write a .gif instead")
    return ending


def write_film(pictures: Iterator[Picture], file: FileName, rate: float, *, clobber: bool = True) -> None:
    """Write pictures as a film, in one step when the last one is there.

    Parameters
    ----------
    pictures : iterator of ndarray, shape (height, width, 3)
        At least one; all of one size.
    file : str or path
        ``.gif``; ``.mp4`` or ``.webm`` where ffmpeg is installed.
    rate : float
        Pictures a second [Hz].
    clobber : bool
        False: a file that exists is an error.

    Raises
    ------
    FileError
        If the ending is another, ffmpeg is not there or fails, or the file cannot be written.
    """
    ending = check_film_name(file)
    check_destination(file, clobber=clobber)
    with TemporaryDirectory() as folder:
        place = FilePath(folder) / f"film{ending}"
        (_write_gif if ending == ".gif" else _encode)(pictures, place, rate)
        write_file(file, place.read_bytes(), clobber=clobber)


def _write_gif(pictures: Iterator[Picture], place: FilePath, rate: float) -> None:
    from PIL import Image

    images = (Image.fromarray(picture) for picture in pictures)
    next(images).save(place, save_all=True, append_images=images, duration=1e3 / rate, loop=0)


def _encode(pictures: Iterator[Picture], place: FilePath, rate: float) -> None:
    """Hand raw pictures to ffmpeg; its codecs need even sides."""
    first = next(pictures)
    size = f"{first.shape[1]}x{first.shape[0]}"
    raw = ("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", f"{rate}", "-i", "-")
    made = ("-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", f"{place}")
    command = ("ffmpeg", "-y", "-loglevel", "error", *raw, *made)
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.DEVNULL) as encoder:
        assert encoder.stdin is not None
        try:
            for picture in chain((first,), pictures):
                encoder.stdin.write(picture.tobytes())
        except BrokenPipeError:
            pass  # it has ended: its status says so
        encoder.stdin.close()
    if encoder.returncode:
        raise FileError(f"ffmpeg could not write {place.suffix}: write a .gif instead")


MOST_FRAMES = 3000
"""Pictures of one animation at most."""

LONGEST = 30.0
"""A film of a fleet lasts no longer unless it is told how fast [s]."""

TRAIL = 2.0
"""How long the trail behind a vehicle is [s]."""

NEAR_COLOUR = "#e03131"
"""Colour of vehicles that come near each other."""


def animate_path(
    path: Path | Samples,
    file: FileName,
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
        ``.gif``, or ``.mp4`` or ``.webm`` where the program ffmpeg is installed.
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
        If the ending is another, ffmpeg is needed and missing, or the file cannot be written.
    TimingError
        If rate or speed are not positive, or there would be more than 3000 pictures.
    """
    check_animation_name(file, view)
    instants = _instants(path.duration, rate, speed)
    chosen = view_coordinates(view, path.dim)
    curves = np.stack([_at(part, instants)[:, chosen] for part in (path, flight) if part is not None])
    axes = _new_axes(fitting_size(curves.reshape(-1, 2)))
    colours = [PATH_COLOUR, AXIS_STYLES[0]["color"]][: len(curves)]
    if flight is not None:
        axes.plot(*curves[1].T, color=colours[1], linewidth=1.0, alpha=0.7, label="flown")
    plot_path(path, axes, view=view, **drawn)
    moving = FilmScene(axes, curves, instants, colours, title)
    write_film(moving.pictures(progress), file, rate, clobber=clobber)


def animate_fleet(
    fleet: Fleet,
    file: FileName,
    *,
    view: str = "xy",
    rate: float = 15.0,
    speed: float | None = None,
    clobber: bool = True,
    progress: Callable[[float], None] | bool | None = None,
    title: str = "",
) -> None:
    """Write an animation of a fleet; vehicles nearer than 1.25 times their separation are red, with a line between.

    Parameters
    ----------
    fleet : Fleet
        With the ``separation`` that it keeps, if pairs are to be shown.
    speed : float, optional
        How many times faster than in flight; 1 unless the film were longer than 30 s.
    file, view, rate, clobber, progress, title
        As :func:`animate_path` takes them.

    Raises
    ------
    FleetError
        If the fleet has no coordinate of the view.
    InputError, FileError, TimingError
        As :func:`animate_path`.
    """
    check_animation_name(file, view)
    instants = _instants(fleet.duration, rate, speed or max(1.0, fleet.duration / LONGEST))
    places = fleet(instants)
    curves = places[:, :, VIEWS[view]]
    axes = plot_fleet(fleet, view, _new_axes(fitting_size(curves.reshape(-1, 2))))
    axes.collections[0].set_alpha(0.3)
    axes.lines[0].set(markerfacecolor="none", markersize=6)
    apart = fleet.separation
    near = None if apart is None else [near_pairs(places[:, i], apart) for i in range(len(instants))]
    moving = FilmScene(axes, curves, instants, ["#1f2a44"] * len(fleet), title, near)
    moving.points.set_label("now")
    legend_above(axes)
    write_film(moving.pictures(progress), file, rate, clobber=clobber)


def check_animation_name(file: FileName, view: str = "xy") -> None:
    """Raise FileError if an animation of this name cannot be written, InputError if the view is in space."""
    if check_view(view) == "3d":
        raise InputError("an animation is drawn in a plane: choose the view xy, xz or yz")
    check_film_name(file)


def _instants(duration: float, rate: float, speed: float) -> FloatArray:
    for name, value in (("rate", rate), ("speed", speed)):
        check_positive(f"the {name} of an animation", value, "", TimingError)
    count = int(np.ceil(duration * rate / speed)) + 1
    if count > MOST_FRAMES:
        raise TimingError(
            f"the animation would have {count} pictures, at most {MOST_FRAMES} are made: raise speed or lower rate"
        )
    return np.asarray(np.minimum(np.arange(count) * speed / rate, duration))


def _new_axes(size: tuple[float, float]) -> Axes:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, dpi=80, layout="constrained")
    FigureCanvasAgg(figure)
    return figure.add_subplot()


ABOVE_LEGEND = 24.0
"""Distance of the title from the axes [points]: the legend is between them."""


class FilmScene:
    """Points that move over a figure, with trails behind them and lines between those that are near.

    Parameters
    ----------
    axes : Axes
        Everything that stands still, drawn.
    curves : ndarray, shape (points, n, 2)
        Where each is at the instants [m].
    instants : ndarray, shape (n,)
        [s].
    colours : sequence of str
        Of the points.
    title : str
        Written before the time.
    near : sequence of ndarray, shape (pairs, 2), optional
        Which points are near at each instant.
    """

    def __init__(
        self,
        axes: Axes,
        curves: FloatArray,
        instants: FloatArray,
        colours: Sequence[str],
        title: str = "",
        near: Sequence[IntArray] | None = None,
    ) -> None:
        from matplotlib.collections import LineCollection
        from matplotlib.colors import to_rgba_array

        self.curves, self.instants, self.near = curves, instants, near
        self.colours, self.red = to_rgba_array(colours), to_rgba_array(NEAR_COLOUR)[0]
        self.title = f"{title}  " if title else ""
        many = len(curves) > 2
        self.trails = LineCollection([], colors=self.colours, linewidths=1.5 if many else 3.5, alpha=0.6, zorder=8)
        self.lines = LineCollection([], colors=NEAR_COLOUR, linewidths=2.0, zorder=9)
        for lines in (self.trails, self.lines):
            axes.add_collection(lines, autolim=False)
        self.points = axes.scatter(curves[:, 0, 0], curves[:, 0, 1], s=16 if many else 81, c=self.colours, zorder=10)
        self.clock = axes.set_title(f"{self.title}0.0 s", loc="left", pad=ABOVE_LEGEND)
        self.artists: list[Any] = [self.trails, self.lines, self.points, self.clock]
        self.axes = axes

    def show(self, index: int) -> None:
        """Move the points to an instant."""
        first = int(np.searchsorted(self.instants, self.instants[index] - TRAIL))
        here, colours = self.curves[:, index], self.colours.copy()
        self.trails.set_segments(list(self.curves[:, first : index + 1]))
        self.points.set_offsets(here)
        if self.near is not None:
            self.lines.set_segments(list(here[self.near[index]]))
            colours[self.near[index].reshape(-1)] = self.red
            self.points.set_facecolor(list(map(tuple, colours)))
        self.clock.set_text(f"{self.title}{self.instants[index]:.1f} s")

    def pictures(self, progress: Callable[[float], None] | bool | None = None) -> Iterator[Picture]:
        """Yield the picture of each instant; what stands still is drawn once."""
        canvas: Any = self.axes.figure.canvas
        for artist in self.artists:
            artist.set_animated(True)
        canvas.draw()
        canvas.figure.set_layout_engine("none")  # the layout of the first picture is that of all
        still = canvas.copy_from_bbox(canvas.figure.bbox)
        with progress_line(progress, "drawing", lambda line: line.show) as watch:
            for index in range(len(self.instants)):
                if watch is not None:
                    watch(index / len(self.instants))
                self.show(index)
                canvas.restore_region(still)
                for artist in self.artists:
                    self.axes.draw_artist(artist)
                yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _at(source: Path | Samples, instants: FloatArray) -> FloatArray:
    """Positions at instants, those between samples on straight lines."""
    if isinstance(source, Path):
        return source(np.minimum(instants, source.duration))
    return interpolated(instants, source.t - source.t[0], source.position)
