"""File formats, recognised by the ending of the file or by name: their description, and conversion between them."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from minsnap.basics.checks import check_kind
from minsnap.basics.messages import shown
from minsnap.basics.storage.text import FileName
from minsnap.errors import FileError, FrameError
from minsnap.files.formats.pieces import polynomials_of, refit
from minsnap.files.frames import get_frame
from minsnap.files.sample_fit import fit_to
from minsnap.trajectory.path import Path as Curve
from minsnap.trajectory.phase import PhasePath
from minsnap.trajectory.samples import Samples
from minsnap.trajectory.trajectory import Trajectory, widest_step

Content = Trajectory | Samples
"""What a file holds, in z-up world axes."""

RATE = 20.0
"""Samples a second of a trajectory where a format or a command wants samples [Hz]."""

ORIGIN = "give the origin, latitude and longitude [degrees] and altitude [m] of (0, 0, 0) (--origin LAT LON ALT)"
"""What to give where a file has latitudes and longitudes."""

TORN = 1e-3
"""Step between two pieces that is no rounding [m]."""

RESOLUTION = 1e-3
"""What rounding to three decimals does to a difference [m, m/s, rad]."""


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
        Whether ``read`` takes the frame as well, and ``write`` what else is known of a plan: waypoints, limits, ….
    most_pieces : int or None
        Polynomials that it holds at most.
    leaves_out : tuple of str
        What it does not hold of samples and ``write`` does not name: their fields, ``t`` for a first instant but 0. By
        default what no polynomials hold.
    rounding : callable or None
        ``rounding(trajectory, step)``: what the format's rounding or low degree may do to a difference of two values a
        step apart, or None where numbers are read back exactly.
    read_rows : callable or None
        As ``read``, of samples whose instants need not increase; None where ``read`` is all there is.
    geodetic : bool
        Whether ``write`` takes the ``origin`` of the coordinates, and ``within`` which distance it stays of the path.
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
    read_rows: Callable[..., Samples] | None = None
    geodetic: bool = False

    def check_frame(self, frame: str) -> None:
        """Raise FrameError for a frame other than the default if this format has its own."""
        name = get_frame(frame).name
        if self.frame and name not in ("enu", self.frame):
            raise FrameError(f"{self.name} is written in {self.frame}, not in {name}: leave the frame out")


@cache
def file_formats() -> dict[str, Format]:
    """Return every format by name: those of setpoints and logs, and of each module of ``minsnap.files.formats``."""
    import minsnap.files.formats as folder

    names = [f"{folder.__name__}.{module.name}" for module in pkgutil.iter_modules(folder.__path__)]
    modules = map(importlib.import_module, ("minsnap.files.setpoint_csv", "minsnap.files.flights", *names))
    return {entry.name: entry for module in modules for entry in getattr(module, "FORMATS", ())}


def read_any(path: FileName, frame: str | None = None) -> Content:
    """Read a file of any known format, recognised by its ending and content.

    Parameters
    ----------
    path : str or path
        .csv (setpoints, or a Crazyflie's), .json, .yaml, .npz, .traj, .skyb, .parquet, .ulg or .bin.
    frame : str or None
        Of a setpoint CSV or a table; None: as it says itself, ENU unless it does.

    Returns
    -------
    Trajectory or Samples
        In z-up world axes.

    Raises
    ------
    FileError
        If the ending is not known or the file is bad.
    FrameError
        If a frame is given for a format that has its own, or one that the file contradicts.
    """
    chosen = _reader(path)
    assert chosen.read is not None
    if chosen.reads_frame:
        return chosen.read(path, frame)
    if frame is not None:
        raise FrameError(f"{path} holds {chosen.name}, which have their own axes: leave the frame {shown(frame)} out")
    return chosen.read(path)


def read_to_check(
    path: FileName,
    frame: str | None = None,
    columns: Mapping[str, str] | None = None,
    origin: Sequence[float] | None = None,
) -> Samples:
    """Read any file as :func:`read_samples` does, but samples as they are where their instants do not increase.

    ``columns`` and ``origin`` are those of a table of another program, as :func:`minsnap.read_csv` takes them.

    Raises
    ------
    FileError
        If the file is bad, or they are given for one whose columns are known.
    """
    rows = _reader(path).read_rows
    if rows is not None:
        return rows(path, frame, columns, origin)
    if columns or origin is not None:
        raise FileError(f"{path} is no table: names of columns and an origin are for tables of samples; leave them out")
    return read_samples(path, frame)


def torn(path: FileName) -> str | None:
    """Return a sentence on a step of a millimetre or more between two pieces of a file of polynomials, or None."""
    if _reader(path).read_rows is not None:
        return None
    content = read_any(path)
    step, instant, piece = widest_step(content) if isinstance(content, Trajectory) else (0.0, 0.0, 0)
    return None if step < TORN else f"piece {piece} ends {step:.3g} m from piece {piece + 1}, at {instant:.4g} s"


def frame_for(path: FileName, frame: str | None) -> str | None:
    """Return a frame that is for several files as it is for this one: None where its format has its own."""
    return frame if _reader(path).reads_frame else None


def _reader(path: FileName) -> Format:
    """Return the format of a file that is there."""
    ending = Path(path).suffix.lower()
    able = [entry for entry in file_formats().values() if ending in entry.reads]
    if not able:
        if Path(path).is_dir():
            raise FileError(f"{path} is a folder, and no file of a path: name one that is in it")
        if not ending and not Path(path).exists():
            raise FileError(f"{path} cannot be read: there is no such file or folder")
        known = dict.fromkeys(ending for entry in file_formats().values() for ending in entry.reads)
        raise FileError(f"{path} cannot be read by its ending: it must be one of {', '.join(known)}")
    able.sort(key=lambda entry: entry.recognises is None)
    return next((entry for entry in able if entry.recognises is None or entry.recognises(path)), able[-1])


def resolution_of(path: FileName) -> float:
    """Return the rounding error of a difference of two samples of a file [m, m/s, rad]; 0.001 at least."""
    chosen = _reader(path)
    if chosen.rounding is None:
        return RESOLUTION
    content = read_any(path)
    return max(RESOLUTION, chosen.rounding(content, 1.0 / RATE)) if isinstance(content, Trajectory) else RESOLUTION


def read_samples(path: FileName, frame: str | None = None, rate: float = RATE) -> Samples:
    """Read any file as :func:`read_any` does, polynomials sampled at a rate [Hz]."""
    return read_any(path, frame).sample(rate)


def write_any(
    content: Content | Curve,
    path: FileName,
    to: str | None = None,
    rate: float = RATE,
    frame: str = "enu",
    *,
    clobber: bool = True,
    facts: Mapping[str, Any] | None = None,
    tolerance: float | None = None,
    rest: bool = True,
    origin: Sequence[float] | None = None,
    within: float | None = None,
) -> tuple[str, str | None]:
    """Write a trajectory, another path or samples in a format.

    A path is sampled if the format holds samples. If it holds polynomials, a shape is written as polynomials of a
    proved error (:func:`minsnap.as_polynomials`), and samples are fitted with quintics, to one millimetre.

    With a tolerance, samples, or a path at the rate, become as few polynomials as pass within it of them
    (:func:`minsnap.fit_samples`), which are then written, or sampled, as the format asks.

    Parameters
    ----------
    content : Path or Samples
        In z-up world axes.
    path : str or path
        Destination.
    to : str or None
        A name of :func:`file_formats`; None goes by the ending.
    rate : float
        Samples per second of a path [Hz].
    frame : str
        Of setpoints and tables; the other formats have their own.
    clobber : bool
        False: a destination that exists is an error.
    facts : mapping, optional
        What formats of polynomials keep beside the curve: ``waypoints``, ``corridor``, ``limits``, ``command``.
    tolerance : float, optional
        Greatest distance of the polynomials from a sample [m].
    rest : bool
        Whether they begin and end at rest.
    origin : sequence of 3 float, optional
        Latitude, longitude [degrees] and altitude [m] of (0, 0, 0), for missions, which need it.
    within : float, optional
        How far the lines of a mission may be from the path [m].

    Returns
    -------
    name : str
        Of the format.
    lost : str or None
        A sentence on data that the format does not hold, all quantities of samples that are not zero included.

    Raises
    ------
    FileError
        If there is no such format, or it cannot hold this.
    """
    chosen = format_of(path, to)
    assert chosen.write is not None
    check_kind("what is written", content, (Samples, Curve), "a path or samples")
    note = _left_out(content, chosen) if isinstance(content, Samples) else None
    if tolerance is not None:
        fit = fit_to(content.sample(rate), tolerance, rest=rest, most_pieces=chosen.most_pieces)
        content, note = fit.trajectory, "; ".join(filter(None, (fit.sentence, note)))
    if isinstance(content, PhasePath) and chosen.holds != "samples":
        content, note = polynomials_of(content, chosen.most_pieces)
    elif chosen.holds == "samples" or not isinstance(content, Trajectory):
        content = content.sample(rate)
    if chosen.holds == "polynomials" and isinstance(content, Samples):
        content = refit(content, chosen.most_pieces)
    how = {"frame": frame} if not chosen.frame else dict(facts or {}) if chosen.facts else {}
    if chosen.geodetic:
        if origin is None:
            raise FileError(f"{path} holds latitudes and longitudes: {ORIGIN}")
        how |= {"origin": origin, "within": within}
    lost = chosen.write(content, path, clobber=clobber, **how)
    return chosen.name, "; ".join(sentence for sentence in (note, lost) if sentence) or None


def _left_out(samples: Samples, chosen: Format) -> str | None:
    """Return a sentence on what a format does not hold of samples, or None if it holds all."""
    first = float(samples.t[0]) if len(samples) else 0.0
    known: dict[str, Any] = samples.arrays() | {"t": first, "lead": samples.lead}
    words = {"t": f"the first instant ({first:g} s)", "lead": f"the lead ({samples.lead:g} s)"}
    names = [words.get(name, name.replace("_", "-")) for name in chosen.leaves_out if np.any(known.get(name, 0.0))]
    return f"left out: {', '.join(names)}" if names else None


def format_of(path: FileName, to: str | None = None) -> Format:
    """Return the output format of a file: the one named, or that of its ending.

    Raises
    ------
    FileError
        If there is none, or the ending is that of another format.
    """
    able = {name: entry for name, entry in file_formats().items() if entry.write is not None}
    if to is not None and not (isinstance(to, str) and to in able):
        raise FileError(f"no format is called {shown(to)}: choose one of {', '.join(able)}")
    ending = Path(path).suffix.lower()
    chosen = able[to] if to is not None else next((e for e in able.values() if ending in e.endings), None)
    if chosen is None:
        known = ", ".join(ending for entry in able.values() for ending in entry.endings)
        raise FileError(f"{path} cannot be written by its ending: use {known}, or name a format of {', '.join(able)}")
    other = next((e.name for e in able.values() if ending in e.endings), chosen.name)
    if other != chosen.name and chosen.endings and ending not in (*chosen.endings, *chosen.reads):
        raise FileError(f"{path} is named as {other} is and was to hold {chosen.name}: name it *{chosen.endings[0]}")
    return chosen
