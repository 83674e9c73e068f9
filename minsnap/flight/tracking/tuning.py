r"""Flying the same plan again and again, each time with setpoints corrected by what the flight before missed.

With the setpoints :math:`u_k`, the error :math:`e_k = r - y_k` to the plan and the delay :math:`\tau`,

.. math:: u_{k+1}(t) = u_k(t) + Q\,L\,e_k(t + \tau),

the law of D. A. Bristow, M. Tharayil and A. G. Alleyne (A survey of iterative learning control, IEEE Control Systems
Magazine 26, 2006), Q a low-pass filter without phase. Velocity and acceleration of the setpoints are those of the
corrected position, so that they stay consistent.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray, interpolated
from minsnap.basics.checks import check_positive
from minsnap.basics.storage.text import FileName
from minsnap.errors import InputError
from minsnap.files.flights import load_log
from minsnap.flight.tracking.comparison import compare, jump_remarks, position_at
from minsnap.flight.tracking.log_comparison import ComparedFlight, compare_in_log
from minsnap.trajectory.samples import Samples, in_gaps


@dataclass(frozen=True)
class LearningSettings:
    """How much of an error is corrected.

    Parameters
    ----------
    gain : float
        L: share of the error that the next flight corrects; below 1 for errors that do not repeat.
    cutoff : float
        Of Q [Hz]: faster errors are left to the vehicle's own loops, which are slower than this.
    largest : float
        Largest correction of a setpoint's position [m]; what asks for more is no error of tracking.
    lost : float
        A place farther from the plan than this is none of a flight of it, but a wrong number in the log [m].
    ramp : float
        Over which corrections vanish at both ends, so that a path from rest to rest stays one [s].

    Raises
    ------
    InputError
        If one of them is not a positive number.
    """

    gain: float = 0.8
    cutoff: float = 0.6
    largest: float = 2.0
    lost: float = 50.0
    ramp: float = 1.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            check_positive(name, value, "", InputError)


def learned(
    plan: Samples, sent: Samples, flown: Samples, delay: float, settings: LearningSettings | None = None
) -> Samples:
    """Return the setpoints of the next flight.

    Parameters
    ----------
    plan : Samples
        What is to be flown, at equal steps, with velocity and acceleration.
    sent : Samples
        The setpoints of the last flight, at the same instants: the plan's at first.
    flown : Samples
        Positions of the last flight, on the clock of the plan.
    delay : float
        Of the vehicle's position after its setpoint [s].
    settings : LearningSettings, optional

    Returns
    -------
    Samples
        Those that were sent, corrected, but where samples of the flight are missing; heading and feed-forward are kept.

    Raises
    ------
    InputError
        If instants differ, derivatives are missing, or the delay is negative.
    """
    settings = settings or LearningSettings()
    if len(plan) != len(sent) or not np.allclose(plan.t, sent.t):
        raise InputError("the setpoints that were sent have other instants than the plan")
    if plan.velocity is None or plan.acceleration is None or sent.velocity is None or sent.acceleration is None:
        raise InputError("learning needs velocity and acceleration of the plan and of the setpoints")
    if not 0.0 <= delay < plan.duration:
        raise InputError(f"the delay is {delay} s: it must be 0 or more, and shorter than the plan")
    error = plan.position - position_at(flown, plan.t)
    error[in_gaps(plan.t, flown.t) | (plan.t < flown.t[0]) | (plan.t > flown.t[-1])] = 0.0
    error = _bounded(error, settings.largest / settings.gain)
    step = plan.duration / (len(plan) - 1)
    ahead = interpolated(plan.t + delay, plan.t, error)
    change = sent.position - plan.position + settings.gain * _smooth(ahead, step, settings.cutoff)
    change = _bounded(change, settings.largest) * _window(plan, settings.ramp)[:, None]
    speed = np.gradient(change, step, axis=0)
    push = np.gradient(speed, step, axis=0)
    moved: dict[str, Any] = {"position": plan.position + change, "velocity": plan.velocity + speed}
    return replace(sent, **moved, acceleration=plan.acceleration + push)


def _smooth(values: FloatArray, step: float, cutoff: float) -> FloatArray:
    """Filter by a Gaussian of half power at the cutoff, without phase; the ends are held."""
    from scipy.ndimage import gaussian_filter1d

    deviation = np.sqrt(np.log(2.0)) / (2.0 * np.pi * cutoff * step)
    return np.asarray(gaussian_filter1d(values, deviation, axis=0, mode="nearest"))


def _bounded(change: FloatArray, largest: float) -> FloatArray:
    length = np.linalg.norm(change, axis=1, keepdims=True)
    return np.asarray(change * np.minimum(1.0, largest / np.maximum(length, 1e-12)))


def _window(plan: Samples, ramp: float) -> FloatArray:
    """Return a share from 0 at both ends to 1, shape (m,), three times differentiable."""
    t = plan.t - plan.t[0]
    s = np.clip(np.minimum(t, plan.duration - t) / min(ramp, 0.5 * plan.duration), 0.0, 1.0)
    return np.asarray(s**4 * (35.0 - 84.0 * s + 70.0 * s**2 - 20.0 * s**3))


@dataclass(frozen=True, eq=False)
class TunedFlight:
    """A flight, and the setpoints of the next.

    Parameters
    ----------
    sent : Samples
        Its own setpoints.
    flown : ComparedFlight
        Compared with the plan.
    delay : float
        Of its position after its setpoints [s].
    next : Samples
        Its setpoints, corrected by what it missed.
    log : Path
        Where it was logged.
    """

    sent: Samples
    flown: ComparedFlight
    delay: float
    next: Samples
    log: Path

    @property
    def missed(self) -> float:
        """Root mean square of the distance to the plan [m]."""
        return self.flown.comparison.rmse_3d


def learn_from(plan: Samples, sent: Samples, log: FileName, settings: LearningSettings | None = None) -> TunedFlight:
    """Compare the last flight of a log with the plan, and correct what was sent.

    Parameters
    ----------
    plan, sent : Samples
        What was to be flown, and the setpoints that were sent for it, at the same instants.
    log : path
        A ULog, a dataflash log, or the log of a stream.
    settings : LearningSettings, optional

    Raises
    ------
    InputError
        If the file is no log, or the flight was stopped, lies elsewhere than the plan, or was nowhere near it once,
        or its logged position jumps.
    """
    last = compare_in_log(sent, *flight_in(log))[-1]
    if last.place is not None and (last.place.end is not None or last.place.shift.any()):
        raise InputError(f"{last.remarks()[0]}: tune learns from a whole flight where the plan lies")
    flown, delay = ComparedFlight(compare(plan, last.flight), plan, last.flight, last.place), last.comparison.delay
    settings = settings or LearningSettings()
    if flown.comparison.max_error > settings.lost:
        where = f"{flown.comparison.max_error:.3g} m from the plan at {flown.comparison.worst_instant:.2f} s"
        raise InputError(f"{log} has the vehicle {where}: a position in it is wrong")
    if jumps := jump_remarks(last.flight):
        raise InputError(f"{log}: {jumps[0]}, and tune would learn it")
    after = learned(plan, sent, last.flight, max(0.0, delay), settings)
    return TunedFlight(sent, flown, delay, after, Path(log))


def flight_in(log: FileName) -> tuple[Samples, Samples]:
    """Return the setpoints and the positions of a log; FileError or InputError where it does not have both."""
    read = load_log(log)
    if read is None or read.reference is None or read.flight is None:
        raise InputError(f"{log} is no log with setpoints and positions: give a .ulg, a .bin or a log of stream")
    return read.reference, read.flight


def tune_in_flight(
    plan: Samples,
    fly: Callable[[Samples, int], Path],
    flights: int,
    settings: LearningSettings | None = None,
    sent: Samples | None = None,
) -> list[TunedFlight]:
    """Fly a plan again and again, each time with what was learned; end where a flight missed more than the last.

    Parameters
    ----------
    plan : Samples
        What is to be flown.
    fly : callable
        Takes setpoints and the number of the flight from 1 on, flies them, and returns the log.
    flights : int
    settings : LearningSettings, optional
    sent : Samples, optional
        What is sent first, in place of the plan.
    """
    if flights < 1:
        raise InputError(f"flights is {flights}: fly at least once")
    flown: list[TunedFlight] = []
    sent = sent or plan
    for number in range(1, flights + 1):
        flown.append(learn_from(plan, sent, fly(sent, number), settings))
        if flown[-1].missed > flown[max(0, number - 2)].missed:
            break
        sent = flown[-1].next
    return flown


def best_to_fly(flown: list[TunedFlight]) -> Samples:
    """Return the setpoints of the next flight: learned from the last, or those of the best if that was not the last."""
    best = min(flown, key=lambda each: each.missed)
    return best.next if best is flown[-1] else best.sent
