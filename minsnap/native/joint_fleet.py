"""The joint search of the native core for the curves of a fleet; it runs in a thread, so that it can be stopped."""

from __future__ import annotations

from collections.abc import Callable
from ctypes import byref, c_void_p
from dataclasses import dataclass
from threading import Thread
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.native.fleet_border import require
from minsnap.native.library import Entry
from minsnap.native.records import JointQuestion, JointRun

_BEGIN = Entry("minsnap_fleet_joint_begin", JointQuestion, c_void_p)
_RUN = Entry("minsnap_fleet_joint_run", c_void_p, JointRun)
_FORGET = Entry("minsnap_fleet_joint_forget", c_void_p)
_END = Entry("minsnap_fleet_joint_end", c_void_p)

ORDERS, KINDS = 4, 5
"""Limited derivatives, velocity to snap; and what is limited of each: three axes, the norm, the norm of x and y."""


@dataclass(frozen=True)
class Settings:
    """How one run of the joint search goes.

    Parameters
    ----------
    inflation : float
        Pairs are pushed to so many times their separation: what lies between samples takes the rest.
    smoothness : float
        Weight of the squared snap, in units of the acceleration limit.
    rho, tau : float
        Weight of the penalty, and below which violation it is soft, relatively.
    iterations, inner : int
        Most steps, and most steps of conjugate gradients in each.
    patience : int
        It ends after so many steps without progress.
    short_by, over_by : float
        It ends once separations are short by less, and limits exceeded by less, relatively.
    settle : bool
        Whether it goes on until the cost settles, too.
    """

    inflation: float = 1.004
    smoothness: float = 1e-5
    rho: float = 10.0
    tau: float = 0.02
    iterations: int = 80
    inner: int = 25
    patience: int = 17
    short_by: float = 1e-3
    over_by: float = 5e-3
    settle: bool = False


@dataclass(frozen=True)
class Outcome:
    """How a run ended: what is short and over, relatively, the value, and how many steps were taken."""

    short_by: float
    over_by: float
    value: float
    iterations: int


class FleetSearch:
    """A search for all curves at once, which keeps its multipliers from run to run.

    Parameters
    ----------
    radii : ndarray, shape (m,)
    limits : ndarray, shape (m, 4, 5)
        Of velocity to snap: three axes, the norm, the norm of x and y; infinite where there is none.
    room : ndarray, shape (m, pieces, 2, 3)
        Bounds of each piece [m]; infinite where there is none.
    free : ndarray, shape (m, pieces + 1, 4, 3)
        1 where an unknown is free, 0 where it is given.
    shares : ndarray, shape (pieces,)
        Of each piece in the flight time.
    obstacles : ndarray, shape (k, 13)
    samples : int
        Of each piece.
    downwash, length : float
        Length is the unit of distances from walls [m].
    threads : int
    """

    def __init__(
        self,
        radii: FloatArray,
        limits: FloatArray,
        room: FloatArray,
        free: FloatArray,
        shares: FloatArray,
        obstacles: FloatArray,
        samples: int,
        downwash: float,
        length: float,
        threads: int,
    ) -> None:
        self._search = c_void_p()
        arrays = {"radii": radii, "limits": limits, "room": room, "free": free, "shares": shares, "obstacle": obstacles}
        self._question = JointQuestion(  # whose arrays the search reads
            **{"vehicles": len(radii), "pieces": free.shape[1] - 1, "samples": samples, "obstacles": len(obstacles)},
            **{"downwash": downwash, "length": length, "threads": threads},
            **{name: np.ascontiguousarray(each) for name, each in arrays.items()},
        )
        require(_BEGIN, self._question, byref(self._search))
        self._shape = free.shape

    def __del__(self) -> None:
        if self._search:
            _END(self._search)

    def forget(self) -> None:
        """Drop all multipliers."""
        _FORGET(self._search)

    def run(
        self, curves: FloatArray, time: float, unit: float, settings: Settings, stopped: Callable[[], bool]
    ) -> Outcome:
        """Move the curves, (m, pieces + 1, 4, 3), in place.

        Parameters
        ----------
        curves : ndarray
            h^q times the derivatives at knots [m], h the mean duration of a piece.
        time : float
            Common flight time [s].
        unit : float
            Of acceleration, for the smoothness [m/s^2].
        settings : Settings
        stopped : callable
            Asked every now and then whether to end.

        Raises
        ------
        KeyboardInterrupt
            After the search has ended.
        """
        if curves.shape != self._shape or not curves.flags.c_contiguous:
            raise ValueError("the curves of a search are one contiguous array of its shape")
        stop, figures = np.zeros(1, dtype=np.int32), np.zeros(4)
        weight = settings.smoothness / (unit * (time / (curves.shape[1] - 1)) ** 2) ** 2
        known = vars(settings) | {"smoothness": weight, "time": time}
        run = JointRun(**known, curves=curves, stop=stop, found=figures)
        failed: list[BaseException] = []

        def work() -> None:
            try:
                require(_RUN, self._search, run)
            except BaseException as error:  # handed to the caller's thread
                failed.append(error)

        _wait(work, stop, stopped)
        if failed:
            raise failed[0]
        return Outcome(float(figures[0]), float(figures[1]), float(figures[2]), int(figures[3]))


def _wait(work: Callable[[], None], stop: np.ndarray[Any, Any], stopped: Callable[[], bool]) -> None:
    """Run in a thread, so that Ctrl-C and deadlines are seen meanwhile."""
    thread = Thread(target=work, daemon=True)
    thread.start()
    try:
        while thread.is_alive():
            thread.join(0.05)  # then look whether it is to stop
            if stopped():
                stop[0] = 1
    except KeyboardInterrupt:
        stop[0] = 1
        thread.join()
        raise
