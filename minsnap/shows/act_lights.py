"""Lights of acts: one colour, one for each point, gradients that stand or run along an axis, and changes in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.files.formats import Lights

WHITE, BLACK = np.full(3, 255.0), np.zeros(3)


@dataclass(frozen=True, eq=False)
class Gradient:
    """Colours from one to another along an axis of a formation, which run along it if they have a period.

    Parameters
    ----------
    shares : ndarray, shape (points,)
        Where each point lies along the axis, from 0 to 1.
    ends : ndarray, shape (2, 3)
        Colours at 0 and 1, from 0 to 255.
    period : float or None
        Time in which the colours go to the other end and back [s]; None: they stand.
    """

    shares: FloatArray
    ends: FloatArray
    period: float | None = None

    def at(self, point: int, t: FloatArray) -> FloatArray:
        """Return the colour of a point at instants since the gradient began, shape (n, 3)."""
        phase = 0.5 * self.shares[point] - (0.0 if self.period is None else 1.0 / self.period) * t
        share = 2.0 * np.abs(phase - np.round(phase))
        return np.asarray(self.ends[0] + share[:, None] * (self.ends[1] - self.ends[0]))

    def turns(self, point: int, lasts: float) -> FloatArray:
        """Return the instants at which the colour of a point turns back, and the last one [s]."""
        if self.period is None or lasts <= 0.0:
            return np.zeros(0)
        half = 0.5 * self.period
        first = half * (self.shares[point] % 1.0)
        turns = first + half * np.arange(int(np.ceil(lasts / half)) + 1)
        return np.append(turns[(turns > 1e-6) & (turns < lasts - 1e-6)], lasts)


Colour = tuple[int, int, int] | FloatArray | Gradient
"""Red, green and blue of all, shape (3,), or of each point, shape (points, 3), or along an axis."""


@dataclass(frozen=True, eq=False)
class LightChange:
    """A change of the colours of an act.

    Parameters
    ----------
    after : float
        Since all have arrived [s].
    colour : as of an act
    fade : bool
        The colour is reached from the one before, else at that instant.
    """

    after: float
    colour: Colour
    fade: bool = True


@dataclass(frozen=True, eq=False)
class Shown:
    """What one vehicle shows in one act.

    Parameters
    ----------
    start, arrival, end : float
        When its flight there begins and ends, and when the act is over [s].
    point : int
        Which point of the act it is at; -1 for none: dark.
    changes : sequence of LightChange
        After the arrival.
    lamp : Lights, optional
        Colours of an animation, which begins at ``plays``, ``pace`` times as long.
    """

    start: float
    arrival: float
    end: float
    point: int
    changes: Sequence[LightChange] = field(default_factory=tuple)
    lamp: Lights | None = None
    plays: float = 0.0
    pace: float = 1.0


Key = tuple[float, FloatArray, bool]


def lights_of_acts(shown: Sequence[Shown], end: float) -> Lights:
    """Return the lights of a vehicle: white until the first act with a colour, dark after the landing at ``end``."""
    keys: list[Key] = [(0.0, WHITE, False)]
    for act in shown:
        if act.lamp is not None:
            instants = act.plays + act.pace * act.lamp.instants
            colours = act.lamp.colours if act.point >= 0 else np.zeros_like(act.lamp.colours)
            keys += list(zip(instants.tolist(), colours, act.lamp.fades.tolist(), strict=True))
        for number, change in enumerate(act.changes):
            if change.fade and number == 0:
                keys.append((act.start, keys[-1][1], False))
            until = act.changes[number + 1].after if number + 1 < len(act.changes) else act.end - act.arrival
            keys += [(act.arrival + t, colour, fade) for t, colour, fade in _keys(change, act.point, until)]
    keys.append((end, BLACK, False))
    instants = np.maximum.accumulate([key[0] for key in keys])
    return Lights(instants, np.stack([key[1] for key in keys]), np.array([key[2] for key in keys]))


def _keys(change: LightChange, point: int, until: float) -> list[Key]:
    """Return the instants since the arrival, colours and fades of one change, which holds until another."""
    colour = change.colour
    if point < 0:
        return [(change.after, BLACK, change.fade)]
    if not isinstance(colour, Gradient):
        own = np.asarray(colour, dtype=np.float64)
        return [(change.after, own if own.ndim == 1 else own[point], change.fade)]
    turns = colour.turns(point, until - change.after)
    rows = colour.at(point, np.append(0.0, turns))
    later = [(change.after + float(t), row, True) for t, row in zip(turns, rows[1:], strict=True)]
    return [(change.after, rows[0], change.fade), *later]
