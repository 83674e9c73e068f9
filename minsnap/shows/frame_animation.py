"""Animations in shows: frames of every vehicle, flown on few polynomials that are proved to be near them.

An animation begins and ends at rest. Where its frames do not, time runs up to its pace in the beginning and down in the
end, along the same way. Frames that come too near or are too fast are answered with the size and the pace that go.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.cached import cached_property
from minsnap.basics.checks import check_positive
from minsnap.basics.tolerances import EXACT
from minsnap.errors import FleetError, MinsnapError
from minsnap.files import fit_samples
from minsnap.files.formats import Lights
from minsnap.fleet import Separation, certify_fleet, stretch_of
from minsnap.limits import Limits
from minsnap.shows.csv_show import Frames, faded
from minsnap.trajectory import Trajectory

TOLERANCE = 0.02
"""How far curves may be from the frames unless an animation says another [m]."""

EASE = 2.0
"""Time in which an animation that moves at an end gets up to its pace, and down from it [s]."""

KNOTS = 2001
"""Instants of the table that turns the time of frames into that of the flight."""


@dataclass(frozen=True, eq=False)
class Animation:
    """Frames of vehicles on one clock.

    Parameters
    ----------
    frames : Frames
    size, height : float, optional
        Largest extent of all frames, and height of their lowest point, as of any formation; by default as they are [m].
    slower : float
        How many times as long it lasts.
    tolerance : float
        How far a curve may be from a frame at its instant [m].
    turn : float
        About the vertical [rad].
    shift : array_like, shape (3,)
        [m].
    """

    frames: Frames
    size: float | None = None
    height: float | None = None
    slower: float = 1.0
    tolerance: float = TOLERANCE
    turn: float = 0.0
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name, value, unit in (
            ("size", self.size, "m"),
            ("slower", self.slower, ""),
            ("tolerance", self.tolerance, "m"),
        ):
            if value is not None:
                check_positive(f"{name} of an animation", value, unit, FleetError)

    @cached_property
    def extent(self) -> float:
        """Largest extent of all frames in the file [m]."""
        return float(np.ptp(np.concatenate(self.frames.positions), axis=0).max())

    @cached_property
    def places(self) -> tuple[FloatArray, ...]:
        """Positions of each vehicle where it is shown, shape (m, 3) [m]."""
        points = np.concatenate(self.frames.positions)
        low, high = points.min(axis=0), points.max(axis=0)
        middle = np.array([(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0, low[2]])
        scale = 1.0 if self.size is None else self.size / max(self.extent, 1e-300)
        about = middle.copy()
        if self.size is not None:
            about[:2] = 0.0  # as any formation, it is centered around the z axis
        about[2] = low[2] if self.height is None else self.height
        c, s = np.cos(self.turn), np.sin(self.turn)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        shift = np.array(self.shift)
        return tuple(((place - middle) * scale + about) @ turn.T + shift for place in self.frames.positions)

    @cached_property
    def start(self) -> FloatArray:
        """Where each vehicle begins, shape (vehicles, 3) [m]."""
        return np.stack([curve(0.0) for curve in self.curves])

    @cached_property
    def eased(self) -> tuple[bool, bool]:
        """Whether any vehicle moves at the first frame, and at the last: by more than half the tolerance in a step."""
        steps = [np.linalg.norm(np.diff(place, axis=0)[[0, -1]], axis=1) for place in self.places]
        first, last = np.stack(steps).max(axis=0).tolist()
        return first > 0.5 * self.tolerance, last > 0.5 * self.tolerance

    def flown_at(self, t: FloatArray) -> FloatArray:
        """Return when frames of instants [s] are flown [s]: later by what easing and a slower pace take."""
        end = max(float(instants[-1]) for instants in self.frames.instants)
        ramp = min(EASE / self.slower, 0.9 * end)
        u = np.linspace(0.0, 1.0, KNOTS)
        way = u**5 * (7.0 - 14.0 * u + 10.0 * u**2 - 2.5 * u**3)  # the integral of a rise of degree 7: 1/2 at the end
        seen, clock = (ramp * way, ramp * u) if self.eased[0] else (np.zeros(1), np.zeros(1))
        if self.eased[1]:
            last = end - ramp * way[::-1]
            lag = clock[-1] - seen[-1]
            seen = np.concatenate([seen[seen < last[0]], last])
            clock = np.concatenate([clock[: len(seen) - len(last)], last[0] + lag + ramp * u])
        else:
            seen, clock = np.append(seen, end), np.append(clock, end + clock[-1] - seen[-1])
        return np.asarray(np.interp(t, seen, clock) * self.slower)

    @cached_property
    def curves(self) -> tuple[Trajectory, ...]:
        """The curve of each vehicle, from rest to rest; a FleetError says which has none within the tolerance."""
        flown = []
        for name, instants, places in zip(self.frames.names, self.frames.instants, self.places, strict=True):
            try:
                flown.append(fit_samples(self.flown_at(instants), places, self.tolerance).trajectory)
            except MinsnapError as error:
                raise FleetError(f"no smooth curve was found for {name} of the animation: {error}") from error
        return tuple(flown)

    @property
    def duration(self) -> float:
        """How long it lasts [s]."""
        return max(curve.duration for curve in self.curves)

    def lights(self, vehicle: int) -> Lights | None:
        """Return the colours of a vehicle on the clock of the flight; None where the frames have none."""
        colours = self.frames.colours
        return None if colours is None else faded(self.flown_at(self.frames.instants[vehicle]), colours[vehicle])

    def refuse_dense_or_fast(self, name: str, separation: Separation, limits: Limits) -> None:
        """Raise FleetError where vehicles come too near or exceed the limits; says which size and pace do."""
        certificate = certify_fleet(list(self.curves), separation, limits)
        near, grown, said = certificate.closest, 1.0, []
        if near is not None and near.share < 1.0 - EXACT:
            grown = 1.005 * near.required / max(near.distance, 1e-3)
            pair = " and ".join(self.frames.names[i] for i in near.pair)
            apart = f"{near.distance:.3f} m of {near.required:g} m at {near.instant:.2f} s"
            size = self.extent if self.size is None else self.size
            said.append(f"{pair} come within {apart}: give it size: {ceil(100.0 * size * grown) / 100.0:g}")
        larger = [Trajectory(grown * curve.control_points, curve.durations) for curve in self.curves]
        uses = certify_fleet(larger, limits=limits).utilisation
        needed = stretch_of(uses)
        if needed > 1.0 + 1e-9:
            used = max(uses, key=lambda each: each.use.fraction)
            slower = ceil(1e3 * 1.002 * needed * self.slower) / 1e3
            where = " in that size" if said else ""
            said.append(
                f"{used.use.name} is {used.use.value:.3g} of {used.use.limit:g}{where}: give it slower: {slower:g}"
            )
        if said:
            raise FleetError(f"the animation of {name!r}: {'; '.join(said)}")
