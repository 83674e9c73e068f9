"""Ranges from which a generator draws, and the seeds of problems: a problem depends on its number and nothing else."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.schema import NUMBER, WHOLE, Form, from_to


@dataclass(frozen=True)
class Range:
    """Numbers from low to high, all equally likely; one number where both are the same.

    Parameters
    ----------
    low, high : float
    """

    low: float
    high: float

    def draw(self, rng: np.random.Generator) -> float:
        """Return a number; takes one draw, also where there is only one number."""
        return float(rng.uniform(self.low, self.high))

    def draws(self, rng: np.random.Generator, count: int) -> FloatArray:
        """Return numbers (count,)."""
        return np.asarray(rng.uniform(self.low, self.high, count))

    def whole(self, rng: np.random.Generator) -> int:
        """Return a whole number, both ends among them."""
        return int(rng.integers(int(self.low), int(self.high), endpoint=True))

    def plain(self, whole: bool = False) -> Any:
        """Return it as a specification says it: a number, or a list of two."""
        low, high = (int(value) if whole else float(value) for value in (self.low, self.high))
        return low if low == high else [low, high]


def ranged(least: float, most: float, whole: bool = False) -> Form:
    """Return the form of a number or [low, high], ascending, from ``least`` to ``most``; read as a :class:`Range`."""
    number = from_to(WHOLE if whole else NUMBER, least, most)

    def ends(value: Any) -> list[Any]:
        return value if isinstance(value, list) else [value, value]

    def fits(value: Any) -> bool:
        low_high = ends(value)
        return len(low_high) == 2 and all(map(number.fits, low_high)) and bool(low_high[0] <= low_high[1])

    json = {"anyOf": [number.json, {"type": "array", "items": number.json, "minItems": 2, "maxItems": 2}]}
    kind = "a whole number" if whole else "a number"
    wording = f"{kind} or [low, high], from {least:g} to {most:g}"
    return Form(wording, fits, lambda where, value: Range(*ends(value)), json)


def seed_of(seed: int, number: int) -> int:
    """Return the seed of a problem, below 2^63: the same whoever plans it, and when."""
    return int(np.random.SeedSequence(seed, spawn_key=(number,)).generate_state(1, np.uint64)[0] >> np.uint64(1))


def draws_of(seed: int) -> np.random.Generator:
    """Return the random numbers of a problem with this seed."""
    return np.random.Generator(np.random.PCG64(seed))
