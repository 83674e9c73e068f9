"""Comparison of the flights in a log with a setpoint file, each while the setpoints in the log follow it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from minsnap.flight.tracking.comparison import MAX_DELAY, Comparison, compare
from minsnap.flight.tracking.log_flights import LogFlight, find_flights
from minsnap.trajectory.samples import Samples

OFFSET_NOTED = 1.0
"""Constant offset from which on a comparison says more of origin and frame than of tracking [m]."""


@dataclass(frozen=True, eq=False)
class ComparedFlight:
    """Comparison of one flight with its file.

    Parameters
    ----------
    comparison : Comparison
        Over the flight alone; lateness counts as error, and its delay is that of the vehicle.
    reference, flight : Samples
        What was to be flown, where it was flown, and what was flown, both in the file's time.
    place : LogFlight or None
        Where in the log it is; None for a flight that is not from a log.
    """

    comparison: Comparison
    reference: Samples
    flight: Samples
    place: LogFlight | None = None

    @property
    def whole(self) -> float:
        """Duration of the file [s]."""
        return self.reference.duration

    def remarks(self) -> list[str]:
        """Return warnings about the validity of the figures, one sentence per warning."""
        sentences = []
        if self.place is not None and self.place.lead:
            sentences.append(
                f"its setpoints were sent {self.place.lead:g} s ahead, and each instant is compared with its plan"
            )
        if self.place is not None and self.place.end is not None:
            part = f"the first {self.place.end:.2f} s of {self.whole:.2f} s ({100 * self.place.end / self.whole:.0f} %)"
            sentences.append(f"its setpoints follow the file for {part}: that part is compared")
        if self.place is not None and self.place.shift.any():
            shift = ", ".join(f"{value:.2f}" for value in self.place.shift)
            sentences.append(f"it was flown ({shift}) m from where the file lies, and is compared there")
        if self.place is not None and abs(self.place.rate - 1.0) > 1e-3:
            drift = 100 * abs(self.place.rate - 1.0)
            sentences.append(f"the log's clock runs {drift:.1f} % {self._pace()}: flown times are those of the file")
        offset = self.comparison.constant_offset
        if float(np.linalg.norm(offset)) > OFFSET_NOTED:
            words = ", ".join(f"{value:.2f}" for value in offset)
            sentences.append(f"the whole flight lies ({words}) m from its reference: do origin and frame agree?")
        return sentences

    def _pace(self) -> str:
        return "slow" if self.place is not None and self.place.rate > 1.0 else "fast"


def compare_in_log(
    reference: Samples,
    setpoints: Samples,
    flown: Samples,
    max_delay: float = MAX_DELAY,
    planned: Samples | None = None,
) -> list[ComparedFlight]:
    """Find every flight of a file in a log and compare it with the file.

    Parameters
    ----------
    reference : Samples
        The file. The flight is compared with what it plans for each instant: its rows are sent its lead before, or
        that of the setpoints where the log states one.
    setpoints, flown : Samples
        What the log says was asked for, and where the vehicle was, in the same world axes and on the log's clock.
    max_delay : float
        Longest delay that is looked for [s].
    planned : Samples, optional
        What the file was sent for, at the same instants, if it is not the plan itself: corrected by ``tune``.

    Raises
    ------
    InputError
        If the log's setpoints nowhere follow the file, or positions are missing there.
    """
    compared, lead = [], setpoints.lead or reference.lead
    reference, planned = replace(reference, lead=0.0), None if planned is None else replace(planned, lead=0.0)
    for match in find_flights(reference, setpoints):
        place = replace(match, start=match.start + lead / match.rate, lead=lead)
        there, flight = place.moved(planned or reference), place.in_time_of_file(flown, reference.duration)
        compared.append(ComparedFlight(compare(there, flight, max_delay=max_delay), there, flight, place))
    return compared
