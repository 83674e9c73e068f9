"""Published missions of several vehicles, written out from their facts, with the best flight time that was published.

Sources: qwerty35/swarm_simulator (RBP), qwerty35/lsc_planner (LSC), carlosluis/multiagent_planning (DMPC), ZJU-FAST-Lab
(EGO-Swarm) and utiasDSL/AMSwarm. ``fleets/`` has the starts and goals of DMPC's 200 vehicles, one row a vehicle.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from minsnap import Cylinder, Limits, Separation, assign
from minsnap.fleet.first_guess import uniform

TABLES = Path(__file__).parent / "fleets"
PILLARS = (
    (-0.441, -1.518), (-1.359, 1.535), (0.424, 1.006), (0.029, -0.829), (-1.562, -1.624), (-1.135, -1.179),
    (1.139, -0.309), (-0.046, 1.452), (-0.003, -0.128), (-1.146, 0.370), (-0.708, 1.038), (0.264, -1.560),
    (0.744, 0.370), (0.840, -1.030), (-0.644, -0.701), (1.310, -1.497),
)  # fmt: skip
AMONG_PILLARS = (
    (1.759, 0.773, -1.787, -0.065), (-0.142, -1.836, -1.765, -0.404), (0.307, 1.834, 1.759, 0.773),
    (-1.765, -0.404, -0.142, -1.836), (1.748, 1.770, 1.727, 0.434), (1.727, 0.434, 1.748, 1.770),
    (-1.071, -0.097, 0.680, -1.826), (0.680, -1.826, 0.307, 1.834), (-1.819, 0.550, -1.819, 0.550),
    (-1.787, -0.065, -1.071, -0.097),
)  # fmt: skip


@dataclass(frozen=True)
class FleetMission:
    """A mission: what ``plan_fleet`` is asked, and the flight time that was published [s], None where none was."""

    name: str
    ways: np.ndarray
    limits: Limits
    separation: Separation
    published: float | None = None
    more: dict[str, Any] = field(default_factory=dict)

    @property
    def asked(self) -> dict[str, Any]:
        """The arguments of ``plan_fleet``."""
        return {"waypoints": self.ways, "limits": self.limits, "separation": self.separation, **self.more}


def axis(speed, acceleration, **others):
    """Return limits that hold for each axis."""
    return Limits(speed=speed, acceleration=acceleration, norm="axis", **others)


def square(step):
    """Return ways across a square of half-width 4 m from its perimeter, a vehicle every so many metres."""
    side = np.arange(-4.0, 4.0, step)
    edge = np.full(len(side), 4.0)
    places = [(side, -edge), (edge, side), (-side, edge), (-edge, -side)]
    starts = np.concatenate([np.column_stack((x, y, np.ones(len(side)))) for x, y in places])
    return np.stack((starts, starts * [-1.0, -1.0, 1.0]), axis=1)


def circle(count, radius):
    """Return ways across a circle, each vehicle to its antipode."""
    angle = 2.0 * np.pi * np.arange(count) / count
    starts = np.column_stack((radius * np.cos(angle), radius * np.sin(angle), np.ones(count)))
    return np.stack((starts, starts * [-1.0, -1.0, 1.0]), axis=1)


def table(name):
    """Return the ways of a table of starts and goals."""
    return np.loadtxt(TABLES / f"{name}.csv", delimiter=",", skiprows=1).reshape(-1, 2, 3)


def at_random():
    """Return the ways of LSC's 30 missions of 60 vehicles (missions/empty/60agents of lsc_planner), (30, 60, 2, 3).

    They are what MATLAB draws after its start: MT19937 with the seed 5489, of which five numbers were drawn before,
    places nearer than 0.5 m to one before (heights halved) were dropped, and five digits were written.
    """
    numbers = np.random.RandomState(5489).random_sample(218291)[5:].reshape(-1, 3)
    drawn, ways = iter(numbers * [3.0, 3.0, 2.0] + [-1.5, -1.5, 0.2]), []
    while len(ways) < 60:
        kept = np.empty((0, 3))
        while len(kept) < 60:
            place = next(drawn)
            if (((kept - place) * [1.0, 1.0, 0.5]) ** 2).sum(axis=1).min(initial=1.0) >= 0.25:
                kept = np.vstack((kept, place))
        ways.append(kept)
    written = [float(f"{number:.5g}") for number in np.ravel(ways)]
    return np.reshape(written, (30, 2, 60, 3)).transpose(0, 2, 1, 3)


def show(assigned):
    """Return a show of 1,000: from a grid of 1.5 m on the ground to places at random, at least 1.5 m apart."""
    grid = 1.5 * np.stack(np.meshgrid(np.arange(32.0), np.arange(32.0), indexing="ij"), axis=-1).reshape(-1, 2)[:1000]
    starts = np.column_stack((grid - 23.25, np.zeros(1000)))
    goals: list[np.ndarray] = []
    for place in uniform(60000, 7).reshape(-1, 3) * [20.0, 20.0, 10.0] + [0.0, 0.0, 30.0]:
        if not goals or ((np.array(goals) - place) ** 2).sum(axis=1).min() >= 2.25:
            goals.append(place)
        if len(goals) == 1000:
            break
    ends = np.array(goals)
    return np.stack((starts, ends[assign(starts, ends)] if assigned else ends), axis=1)


def missions():
    """Return every mission by its name."""
    crazyflie, room = Separation(0.3, downwash=2.0), {"room": ((-5, -5, 0.3), (5, 5, 2.5))}
    low = {"room": ((-5, -5, 0), (5, 5, 2.5))}
    small = {"room": ((-1.5, -1.5, 0.2), (1.5, 1.5, 2.2))}
    cube = {"room": ((-2.5, -2.5, 0.2), (2.5, 2.5, 5.2))}
    pillars = {"room": ((-2, -2, 0.1), (2, 2, 2.2)), "avoid": [Cylinder(place, 0.13) for place in PILLARS]}
    among = np.array([[(a, b, 0.5), (c, d, 0.5)] for a, b, c, d in AMONG_PILLARS])
    four = np.array([(-1, -1, 1, 1), (1, 1, -1, -1), (-1, 1, 1, -1), (0, 0, -1, 1)], dtype=float).reshape(-1, 2, 2)
    four = np.concatenate((four, np.ones((4, 2, 1))), axis=2)
    lsc = axis(1.0, 2.0, vertical_acceleration=1.0)
    every = [
        FleetMission("RBP, 64 across a square", square(0.5), axis(1.7, 6.2), crazyflie, 16.4, room),
        FleetMission("LSC, 16 across a square", square(2.0), axis(1.0, 2.0), crazyflie, 21.8, low),
        *(
            FleetMission(f"LSC, 60 at random, {i}", ways, lsc, crazyflie, None, small)
            for i, ways in enumerate(at_random(), 1)
        ),
        FleetMission(
            "DMPC, 200 at random", table("dmpc200"), axis(2.0, 1.0), Separation(0.35, downwash=2.0), 16.4, cube
        ),
        FleetMission(
            "AMSwarm, 10 among 16 pillars", among, axis(1.5, 2.8), Separation(0.2, downwash=2.0), 6.3, pillars
        ),
        FleetMission("DMPC, 4", four, Limits(acceleration=1.0, norm="axis"), crazyflie),
        FleetMission("EGO-Swarm, 10 across a circle", circle(10, 12.0), Limits(1.5, 6.0, 20.0), Separation(0.5)),
        FleetMission("LSC, 20 across a circle", circle(20, 8.0), axis(1.0, 2.0), crazyflie),
        FleetMission("show of 1,000, assigned", show(True), Limits(8.0, 4.0), Separation(1.0)),
        FleetMission("show of 1,000, at random", show(False), Limits(8.0, 4.0), Separation(1.0)),
    ]
    return {mission.name: mission for mission in every}
