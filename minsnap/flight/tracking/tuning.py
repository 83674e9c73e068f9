r"""Flying the same plan again and again, each time with setpoints corrected by what the flight before missed.

With the setpoints :math:`u_k`, the error :math:`e_k = r - y_k` to the plan and the delay :math:`\tau`,

.. math:: u_{k+1} = r + Q\,(u_k - r + L\,e_k(t + \tau)),

the law of D. A. Bristow, M. Tharayil and A. G. Alleyne (A survey of iterative learning control, IEEE Control Systems
Magazine 26, 2006). Q acts on the whole correction and not on what is added: it is the smooth curve nearest to it that
begins and ends at rest and with which the setpoints keep their limits, found anew for each flight
(:mod:`minsnap.flight.tracking.bounded_spline`), as in A. P. Schoellig, F. L. Mueller and R. D'Andrea
(Optimization-based iterative learning for precise quadrocopter trajectory tracking, Autonomous Robots 33, 2012).
Velocity and acceleration of the setpoints are those of the corrected position, so that they stay consistent.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import interpolated
from minsnap.basics.checks import check_positive
from minsnap.basics.storage.text import FileName
from minsnap.errors import InputError
from minsnap.files import load_log
from minsnap.flight.tracking.bounded_spline import bounded_spline
from minsnap.flight.tracking.comparison import compare, jump_remarks, position_at
from minsnap.flight.tracking.log_comparison import ComparedFlight, compare_in_log
from minsnap.flight.tracking.setpoint_limits import setpoint_limits, within_ball
from minsnap.limits import Limits
from minsnap.trajectory import Samples, in_gaps


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
        Largest correction of a setpoint's position [m], or ``lags`` times what the plan's fastest part lags by, if
        that is more; what asks for more is no error of tracking.
    lags : float
    least : float
        Learning ends where a flight misses the plan by less than the one before it, but not by this share of it.
    lost : float
        A place farther from the plan than this is none of a flight of it, but a wrong number in the log [m].

    Raises
    ------
    InputError
        If one of them is not a positive number.
    """

    gain: float = 0.8
    cutoff: float = 0.8
    largest: float = 2.0
    lags: float = 1.5
    least: float = 0.02
    lost: float = 50.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            check_positive(name, value, "", InputError)


def learned(
    plan: Samples,
    sent: Samples,
    flown: Samples,
    delay: float,
    settings: LearningSettings | None = None,
    limits: Limits | None = None,
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
    limits : Limits, optional
        What the vehicle allows, in addition to half as much again as the plan asks for
        (:func:`~minsnap.flight.tracking.setpoint_limits.setpoint_limits`).

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
    fastest = float(np.linalg.norm(plan.velocity, axis=1).max())
    largest = max(settings.largest, settings.lags * delay * fastest)
    error = within_ball(error, np.full(len(plan), largest / settings.gain))
    wanted = sent.position - plan.position + settings.gain * interpolated(plan.t + delay, plan.t, error)
    bounds = setpoint_limits(plan, limits)
    change, speed, push, _ = bounded_spline(plan.t, wanted, bounds, largest, settings.cutoff)
    moved: dict[str, Any] = {"position": plan.position + change, "velocity": plan.velocity + speed}
    return replace(sent, **moved, acceleration=plan.acceleration + push, jerk=None, snap=None)


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


def learn_from(
    plan: Samples,
    sent: Samples,
    log: FileName,
    settings: LearningSettings | None = None,
    limits: Limits | None = None,
) -> TunedFlight:
    """Compare the last flight of a log with the plan, and correct what was sent.

    Parameters
    ----------
    plan, sent : Samples
        What was to be flown, and the setpoints that were sent for it, at the same instants.
    log : path
        A ULog, a dataflash log, or the log of a stream.
    settings : LearningSettings, optional
    limits : Limits, optional
        Of the vehicle, as for :func:`learned`.

    Raises
    ------
    InputError
        If the file is no log, or the flight was stopped, or was nowhere near the plan once, or its logged position
        jumps.
    """
    last = compare_in_log(sent, *flight_in(log))[-1]
    assert last.place is not None
    if last.place.end is not None:
        raise InputError(f"{last.remarks()[0]}: tune learns from a whole flight")
    flown, delay = ComparedFlight(compare(plan, last.flight), plan, last.flight, last.place), last.comparison.delay
    settings = settings or LearningSettings()
    if flown.comparison.max_error > settings.lost:
        where = f"{flown.comparison.max_error:.3g} m from the plan at {flown.comparison.worst_instant:.2f} s"
        raise InputError(f"{log} has the vehicle {where}: a position in it is wrong")
    if jumps := jump_remarks(last.flight):
        raise InputError(f"{log}: {jumps[0]}, and tune would learn it")
    after = learned(plan, sent, last.flight, max(0.0, delay), settings, limits)
    return TunedFlight(sent, flown, delay, after, Path(log))


def flight_in(log: FileName) -> tuple[Samples, Samples]:
    """Return the setpoints and the positions of a log; FileError or InputError where it does not have both."""
    read = load_log(log)
    if read is None or read.reference is None or read.flight is None:
        raise InputError(f"{log} is no log with setpoints and positions: give a .ulg, a .bin or a log of stream")
    return read.reference, read.flight


def helped(before: float, missed: float, settings: LearningSettings | None = None) -> bool:
    """Return whether a flight misses the plan [m] by enough less than the one before it for another to be worth it."""
    return missed < (1.0 - (settings or LearningSettings()).least) * before


def tune_in_flight(
    plan: Samples,
    fly: Callable[[Samples, int], Path],
    flights: int,
    settings: LearningSettings | None = None,
    sent: Samples | None = None,
    limits: Limits | None = None,
) -> list[TunedFlight]:
    """Fly a plan again and again, each time with what was learned; end where that no longer helps.

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
    limits : Limits, optional
        Of the vehicle, as for :func:`learned`.
    """
    if flights < 1:
        raise InputError(f"flights is {flights}: fly at least once")
    flown: list[TunedFlight] = []
    sent = sent or plan
    for number in range(1, flights + 1):
        flown.append(learn_from(plan, sent, fly(sent, number), settings, limits))
        if number > 1 and not helped(flown[-2].missed, flown[-1].missed, settings):
            break
        sent = flown[-1].next
    return flown


def best_to_fly(flown: list[TunedFlight], settings: LearningSettings | None = None) -> Samples:
    """Return the setpoints of the next flight: learned from the last while that helps, then those of the best."""
    helps = len(flown) < 2 or helped(flown[-2].missed, flown[-1].missed, settings)
    return flown[-1].next if helps else min(flown, key=lambda each: each.missed).sent
