"""Flying the same plan again and again, each time with setpoints corrected by what the flight before missed."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from minsnap.errors import InputError
from minsnap.files.flights import load_log
from minsnap.flight.tracking.comparison import compare
from minsnap.flight.tracking.learning import LearningSettings, learned
from minsnap.flight.tracking.log_comparison import ComparedFlight, compare_in_log
from minsnap.trajectory.samples import Samples


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
    plan: Samples, sent: Samples, log: str | os.PathLike[str], settings: LearningSettings | None = None
) -> TunedFlight:
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
        If the file is no log, or the flight was stopped or lies elsewhere than the plan.
    """
    log_read = load_log(log)
    if log_read is None or log_read.reference is None or log_read.flight is None:
        raise InputError(f"{log} is no log with setpoints and positions: give a .ulg, a .bin or a log of stream")
    last = compare_in_log(sent, log_read.reference, log_read.flight)[-1]
    if last.place is not None and (last.place.end is not None or last.place.shift.any()):
        raise InputError(f"{last.remarks()[0]}: tune learns from a whole flight where the plan lies")
    delay = last.comparison.delay
    after = learned(plan, sent, last.flight, max(0.0, delay), settings)
    flown = ComparedFlight(compare(plan, last.flight), plan, last.flight, last.place)
    return TunedFlight(sent, flown, delay, after, Path(log))


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
