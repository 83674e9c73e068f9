"""Random fleets of 2 to 30 in rooms with obstacles, planned, and judged by an oracle that shares no code with them."""

import numpy as np
from oracles.fleet_bounds import faults

import minsnap
from minsnap.errors import UnprovedError

MAKE = {"cylinder": minsnap.Cylinder, "ellipsoid": minsnap.Ellipsoid, "cuboid": minsnap.Cuboid}


def random_fleet(seed):
    """Return what to ask of ``plan_fleet``, and the same as plain numbers for the oracle."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 31))
    size, downwash = 1.2 + 0.45 * count**0.5, float(rng.choice((1.0, 2.0, 3.0)))
    radii = rng.uniform(0.1, 0.2, count) if rng.random() < 0.5 else np.full(count, 0.15)
    per_axis = bool(rng.random() < 0.5)
    obstacles = [_obstacle(rng, size) for _ in range(rng.integers(0, 5))]
    avoid = [MAKE[kind](*numbers) for kind, *numbers in obstacles]
    apart = 2.0 * radii.max() + 0.02
    scale = [1.0, 1.0, 1.0 / downwash]

    def places():
        kept = []
        while len(kept) < count:
            point = rng.uniform((-size, -size, 0.5), (size, size, 2.0))
            clear = all(_clear(point, *each) for each in obstacles)
            if clear and all(np.linalg.norm((point - each) * scale) > apart for each in kept):
                kept.append(point)
        return kept

    room = ((-size - 0.3, -size - 0.3, 0.2), (size + 0.3, size + 0.3, 2.4))
    ways = np.stack((places(), places()), axis=1)
    limits = minsnap.Limits(speed=1.5, acceleration=3.0, norm="axis" if per_axis else "euclidean")
    separation = minsnap.Separation(radii=radii, downwash=downwash)
    asked = {"waypoints": ways, "limits": limits, "separation": separation, "room": room, "avoid": avoid}
    return asked, (ways, 1.5, 3.0, per_axis, radii, downwash, room, obstacles)


def _obstacle(rng, size):
    """Draw a pillar, an ellipsoid or a block."""
    center, kind = rng.uniform((-size, -size, 0.8), (size, size, 1.6)), str(rng.choice(list(MAKE)))
    if kind == "cylinder":
        return kind, center[:2], float(rng.uniform(0.1, 0.3))
    half = rng.uniform(0.1, 0.4, 3)
    return (kind, center, half) if kind == "ellipsoid" else (kind, center - half, center + half)


def _clear(point, kind, one, two):
    """Whether a place is outside of an obstacle by a little."""
    if kind == "cylinder":
        return np.hypot(*(point[:2] - one)) > two + 0.02
    if kind == "ellipsoid":
        return np.linalg.norm((point - one) / (two + 0.02)) > 1.0
    return bool(((point < one - 0.02) | (point > two + 0.02)).any())


def certified_or_refused(seed):
    """Return the fleet that is planned, or the sentence that refuses; what is planned must hold."""
    asked, plain = random_fleet(seed)
    try:
        fleet = minsnap.plan_fleet(**asked, threads=1)
    except UnprovedError as error:
        assert "\n" not in str(error)
        return str(error)
    assert faults(fleet, *plain) == [], seed
    return fleet
