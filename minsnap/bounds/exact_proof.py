"""Check a bound of the flight time in exact rational arithmetic, from the stored numbers alone.

Nothing here is shared with the search or with ``CostateProof.seconds``.  Roots are bounded by rationals on the side
that can only make the bound smaller.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from math import isqrt
from typing import Any

from minsnap.bounds.costate_proof import CostateProof
from minsnap.bounds.derivative_sets import DerivativeSet, Sets

Numbers = list[Fraction]

DIGITS = 80
"""Bits to which a root is bounded, beyond those of the number."""


def proves(proof: CostateProof, seconds: float) -> bool:
    """Whether a costate proves that every flight takes at least so long [s]."""
    least = least_time_proved(proof)
    return least is not None and least >= Fraction(seconds)


def least_time_proved(proof: CostateProof) -> Fraction | None:
    """Return the time that a costate proves [s]; None where it proves nothing."""
    course, legs = proof.course, len(proof.grid)
    costate, rates, grid = exact(proof.costate), exact(proof.rate), exact(proof.grid)
    # The formula of `costate_proof` holds only for a costate that is continuous, at the waypoints too.
    joints = [costate[leg][-1] == costate[leg + 1][0] for leg in range(legs - 1)]
    if not all(joints) or (course.closed and costate[-1][-1] != costate[0][0]) or legs != len(course.centers) - 1:
        return None
    if not proof.velocities:
        if len(grid[0]) != 2:
            return None
        rates = [minus(leg[0], leg[1]) for leg in costate]
    centers, chords, total = exact(course.centers), exact(proof.chords), Fraction(0)
    regions = list(zip(exact(course.rounds), exact(course.sides), strict=True))
    # Each leg adds 2 sqrt((1 - a) b), where b is the product give or take the change. A line of the chord's slope that
    # is not above the root at either end of that interval is nowhere above it: its height in the middle is what counts.
    for leg in range(legs):
        room, lost = _leg_sums(proof, leg, grid[leg], costate[leg], rates[leg])
        product = dot(rates[leg], minus(centers[leg + 1], centers[leg]))
        change = reach(regions[leg], rates[leg]) + reach(regions[leg + 1], rates[leg])
        if room is None or lost is None or room < 0 or product < change:
            return None
        chord = chords[leg]
        ends = ((product + change, -chord * change), (product - change, chord * change))
        total += min(2 * root_below(room * value) + turned for value, turned in ends) - lost
    # What the chords leave open, the place of each waypoint in its region, costs at most the region's reach along the
    # difference of the slopes of the legs beside it.
    turns = [[chord * x for x in rate] for chord, rate in zip(chords, rates, strict=True)]
    none = [Fraction(0)] * 3
    before, after = (turns[-1:], []) if course.closed else ([none], [none])
    for knot, (one, other) in enumerate(zip([*before, *turns], [*turns, *after], strict=False)):
        total -= reach(regions[knot], minus(other, one))
    if not course.closed:
        start, end = exact(course.ends)
        total += dot(costate[-1][-1], end) - dot(costate[0][0], start)
    return total


def _leg_sums(
    proof: CostateProof, leg: int, grid: Numbers, costate: list[Numbers], rate: Numbers
) -> tuple[Fraction | None, Fraction | None]:
    """Return what is left of 1, and the integral of the velocities' support; None where one is infinite."""
    shares, rate_shares = exact(proof.splits[leg]), exact(proof.rate_splits[leg])
    parts, room, lost = len(shares[0]) - 1, Fraction(1), Fraction(0)
    if grid[0] != 0 or grid[-1] != 1 or any(a >= b for a, b in zip(grid, grid[1:], strict=False)):
        return None, None
    # The costate is linear in a cell, and a support function is convex: the trapezoid rule is not below its integral.
    for cell, (low, high) in enumerate(zip(grid, grid[1:], strict=False)):
        first, last, width = costate[cell], costate[cell + 1], high - low
        for i in range(parts + 1):
            place = [(Fraction(parts - i) * a + i * b) / parts for a, b in zip(first, last, strict=True)]
            value = support(proof.accelerations, place, shares[cell][i])
            if value is None:
                return None, None
            room -= value * width / (parts * (1 if 0 < i < parts else 2))
        moved = [b - a + width * x for a, b, x in zip(first, last, rate, strict=True)]
        value = support(proof.velocities, moved, [[width * x for x in share] for share in rate_shares[cell]])
        if value is None:
            return None, None
        lost += value
    return room, lost


def support(sets: Sets, whole: Numbers, shares: list[Numbers]) -> Fraction | None:
    """Return a bound of the support of the intersection of sets along a vector; None for infinity."""
    if not sets:
        return Fraction(0)
    rest = [x - sum(parts) for x, *parts in zip(whole, *shares, strict=True)]
    values = [support_of(one, along) for one, along in zip(sets, [rest, *shares], strict=True)]
    return None if None in values else sum((value for value in values if value is not None), Fraction(0))


def support_of(one: DerivativeSet, along: Numbers) -> Fraction | None:
    """Return a bound of the support of one set."""
    value = dot([Fraction(x) for x in one.center], along)
    if one.height:
        aside = root_above(along[0] ** 2 + along[1] ** 2)
        return value + Fraction(one.height) * max(along[2] + Fraction(one.slope) * aside, Fraction(0))
    covered = {axis for axes, _ in one.balls for axis in axes}
    if any(x for axis, x in enumerate(along) if axis not in covered):
        return None
    norms = (Fraction(radius) * root_above(sum(along[axis] ** 2 for axis in axes)) for axes, radius in one.balls)
    return value + sum(norms)


def reach(region: tuple[list[Numbers], list[Numbers]], along: Numbers) -> Fraction:
    """Return a bound of how far a region reaches from its center along a vector."""
    rounds, sides = region
    return root_above(sum(dot(row, along) ** 2 for row in rounds)) + sum(abs(dot(side, along)) for side in sides)


def exact(values: Any) -> Any:
    """Return an array as lists of rationals."""
    listed = values.tolist() if hasattr(values, "tolist") else values
    return [exact(one) for one in listed] if isinstance(listed, list) else Fraction(listed)


def dot(one: Iterable[Fraction], other: Iterable[Fraction]) -> Fraction:
    """Return the product of two vectors."""
    return sum((a * b for a, b in zip(one, other, strict=True)), Fraction(0))


def minus(one: Sequence[Fraction], other: Sequence[Fraction]) -> Numbers:
    """Return the difference of two vectors."""
    return [a - b for a, b in zip(one, other, strict=True)]


def root_below(square: Fraction | int) -> Fraction:
    """Return a rational that is not more than a root."""
    number = Fraction(square)
    shift = max(DIGITS + (number.denominator.bit_length() - number.numerator.bit_length()) // 2, 0)
    return Fraction(isqrt((number.numerator << 2 * shift) // number.denominator), 1 << shift)


def root_above(square: Fraction | int) -> Fraction:
    """Return a rational that is not less than a root."""
    number = Fraction(square)
    if not number:
        return number
    shift = max(DIGITS + (number.denominator.bit_length() - number.numerator.bit_length()) // 2, 0)
    return Fraction(isqrt(-(-(number.numerator << 2 * shift) // number.denominator)) + 1, 1 << shift)
