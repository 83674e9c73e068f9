"""Check a bound of the flight time in exact rational arithmetic, from the stored numbers alone.

Nothing here is shared with the search or with ``CostateProof.seconds``.  Roots are bounded by rationals on the side
that can only make the bound smaller.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import isfinite

from minsnap.bounds.costate_proof import CostateProof
from minsnap.bounds.derivative_sets import DerivativeSet, GrowingSet, Sets
from minsnap.bounds.exact_numbers import Numbers, dot, exact, float_above, minus, root_above, root_below, tangent_above

WIDEST = Fraction(13, 10)
"""Half-angle above which a cone is not used [rad]."""


def proves(proof: CostateProof, seconds: float) -> bool:
    """Whether a costate proves that every flight takes at least so long [s]."""
    least = least_time_proved(proof)
    return least is not None and least >= Fraction(seconds)


def least_time_proved(proof: CostateProof) -> Fraction | None:
    """Return the time that a costate proves [s]; None where it proves nothing."""
    course, legs = proof.course, len(proof.grid)
    (_, points), parts, intervals = proof.grid.shape, proof.splits.shape[2] - 1, proof.latest.shape[1]
    shapes = {
        "costate": (legs, points, 3),
        "rate": (legs, 3),
        "splits": (legs, points - 1, parts + 1, max(len(proof.accelerations) - 1, 0), 3),
        "rate_splits": (legs, points - 1, max(len(proof.velocities) - 1, 0), 3),
        "latest": (2, intervals),
        "hovering": (2, intervals, (points - 1) * parts, 2, len(proof.growing), 3),
    }
    if any(getattr(proof, name).shape != shape for name, shape in shapes.items()) or not isfinite(proof.latest.sum()):
        return None
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
    # Each leg adds the least of (1 - a) T + b / T, where b is the product give or take the change. It is concave in b:
    # a line of the chord's slope that is not above it at either end of that interval is nowhere above it. Its height
    # in the middle is what counts.
    for leg in range(legs):
        lost = _lost(proof, leg, grid[leg], costate[leg], rates[leg])
        latest = _latest(proof, leg)
        rooms = None if latest is None else _rooms(proof, leg, grid[leg], costate[leg], latest)
        product = dot(rates[leg], minus(centers[leg + 1], centers[leg]))
        change = reach(regions[leg], rates[leg]) + reach(regions[leg + 1], rates[leg])
        if latest is None or rooms is None or lost is None or min(rooms) < 0 or product < change:
            return None
        chord = chords[leg]
        ends = ((product + change, -chord * change), (product - change, chord * change))
        total += min(_least(rooms, latest, value) + turned for value, turned in ends) - lost
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


def _least(rooms: Numbers, latest: Numbers, product: Fraction) -> Fraction:
    """Return a bound of (1 - a) T + b / T from below, where 1 - a is that of the interval of T."""
    found = []
    for begin, end, room in zip([Fraction(0), *latest], [*latest, None], rooms, strict=True):
        if begin and product <= room * begin**2:
            found.append(room * begin + product / begin)
        elif end and product >= room * end**2:
            found.append(room * end + product / end)
        else:
            found.append(2 * root_below(room * product))
    return min(found)


def _latest(proof: CostateProof, leg: int) -> Numbers | None:
    """Return the ends of the intervals of a leg's duration, but for the last; None where they do not rise."""
    known: list[Numbers] = [exact(proof.latest[end]) for end in _ends(proof, leg)]
    first = known[0] if known else []
    rising = all(a < b for a, b in zip([Fraction(0), *first], first, strict=False))
    return first if rising and all(other == first for other in known) else None


def _ends(proof: CostateProof, leg: int) -> list[int]:
    """Return which ends of the flight a leg has: 0 its start, 1 its end."""
    return [end for end in (0, 1) if leg == (0, len(proof.grid) - 1)[end]]


def _rooms(proof: CostateProof, leg: int, grid: Numbers, costate: list[Numbers], latest: Numbers) -> Numbers | None:
    """Return what is left of 1 in each interval of the leg's duration; None where a support is infinite."""
    shares, parts = exact(proof.splits[leg]), len(proof.splits[leg][0]) - 1
    own = {end: exact(proof.hovering[end]) for end in _ends(proof, leg)}
    if grid[0] != 0 or grid[-1] != 1 or any(a >= b for a, b in zip(grid, grid[1:], strict=False)):
        return None
    rooms, values = [Fraction(1)] * (len(latest) + 1), list[Fraction | None]()
    # The costate is linear in a part of a cell, and a support function is convex: the trapezoid rule is not below its
    # integral. What a growing set shares is linear there too, and the set is that of the part's end.
    for part in range(parts * (len(grid) - 1)):
        cell, i = divmod(part, parts)
        sides, width = list(zip(costate[cell], costate[cell + 1], strict=True)), (grid[cell + 1] - grid[cell]) / parts
        places = [[(Fraction(parts - k) * a + k * b) / parts for a, b in sides] for k in (i, i + 1)]
        now = [(place, shares[cell][k]) for k, place in zip((i, i + 1), places, strict=True)]
        values = [values[1] if i else support(proof.accelerations, *now[0]), support(proof.accelerations, *now[1])]
        begins = grid[cell] + i * width
        for j in range(len(rooms)):
            both, sets = values, tuple[DerivativeSet, ...]()
            further: list[list[Numbers]] = [[], []]
            for end in own if j < len(latest) else ():
                time = latest[j] * (1 - begins if end else begins + width)
                for g, one in enumerate(proof.growing):
                    share = [own[end][j][part][side][g] for side in (0, 1)]
                    then = grown(one, time) if any(map(any, share)) and proof.course.calm[end] > one.power else None
                    if then is not None:
                        sets, further = (*sets, then), [[*more, x] for more, x in zip(further, share, strict=True)]
            if sets:
                whole = (*proof.accelerations, *sets)
                both = [support(whole, x, [*known, *more]) for (x, known), more in zip(now, further, strict=True)]
            for value in both:
                if value is None:
                    return None
                rooms[j] -= value * width / 2
    return rooms


def _lost(proof: CostateProof, leg: int, grid: Numbers, costate: list[Numbers], rate: Numbers) -> Fraction | None:
    """Return the integral of the velocities' support; None where it is infinite."""
    shares, lost = exact(proof.rate_splits[leg]), Fraction(0)
    for cell, (low, high) in enumerate(zip(grid, grid[1:], strict=False)):
        width = high - low
        moved = [b - a + width * x for a, b, x in zip(costate[cell], costate[cell + 1], rate, strict=True)]
        value = support(proof.velocities, moved, [[width * x for x in share] for share in shares[cell]])
        if value is None:
            return None
        lost += value
    return lost


def grown(one: GrowingSet, time: Fraction) -> DerivativeSet | None:
    """Return a set that has grown for a time [s], or a little larger; None where it bounds nothing."""
    size = Fraction(one.rate) * time**one.power / one.power
    if one.unit.height:
        return replace(one.unit, slope=float_above(tangent_above(size))) if size <= WIDEST else None
    balls = tuple((axes, float_above(Fraction(radius) * size)) for axes, radius in one.unit.balls)
    return replace(one.unit, balls=balls)


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
    covered = {axis for axes, _ in one.balls for axis in axes}
    if one.height:
        aside = root_above(along[0] ** 2 + along[1] ** 2)
        value += Fraction(one.height) * max(along[2] + Fraction(one.slope) * aside, Fraction(0))
    elif any(x for axis, x in enumerate(along) if axis not in covered):
        return None
    norms = (Fraction(radius) * root_above(sum(along[axis] ** 2 for axis in axes)) for axes, radius in one.balls)
    return value + sum(norms)


def reach(region: tuple[list[Numbers], list[Numbers]], along: Numbers) -> Fraction:
    """Return a bound of how far a region reaches from its center along a vector."""
    rounds, sides = region
    return root_above(sum(dot(row, along) ** 2 for row in rounds)) + sum(abs(dot(side, along)) for side in sides)
