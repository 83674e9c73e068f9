"""A fixed set of plans and a digest of each: the same on every processor, with every choice of kernels.

``python tests/helpers/digest_plans.py`` prints them; with ``--write`` it stores them as what the tests compare with.
A change of what is stored is due to a change of method, and is named in the changelog.
"""

import hashlib
import json
import sys
from pathlib import Path

import numpy as np

import minsnap
from minsnap.vehicle import Quadrotor

STORED = Path(__file__).parents[1] / "plan_digests.json"

REFERENCE = [(0, 0, 1), (8, 0, 1), (8, 4, 1), (0, 4, 1), (0, 0, 1)]
TIMES = (4.1, 2.3, 3.7, 2.9)
BOXES = minsnap.Boxes([(-1, -1, 0), (6, -1, 0), (6, 2, 0)], [(9, 1, 2), (9, 5, 2), (9, 9, 3)])
THROUGH = [(0, 0, 1), (7.5, 0, 1), (7.5, 4, 1), (7, 8, 1.5)]
FACES = np.concatenate((np.eye(3), -np.eye(3)))


def polytopes():
    """The boxes as half-spaces."""
    return minsnap.Polytopes([(FACES, np.concatenate((b, -a))) for a, b in zip(BOXES.lower, BOXES.upper, strict=True)])


def chain(legs):
    """Waypoints and durations of a chain, drawn by integers alone."""
    number = np.arange(legs + 1)[:, None] * np.array([37, 53, 71]) % 101
    return number / 17.0 + np.arange(legs + 1)[:, None] * [1.5, 0.0, 0.0], 0.8 + number[1:, 0] / 61.0


def rectangle(**asked):
    """The rectangle, closed or not, with given durations unless others are asked for."""
    return lambda: minsnap.plan(REFERENCE, **{"durations": TIMES} | asked)


def along(points, durations, **asked):
    """Any other plan."""
    return lambda: minsnap.plan(points, durations, **asked)


GIVEN = {
    **{f"degree {n}": rectangle(degree=n) for n in (3, 5, 7, 9, 11)},
    **{f"tube, degree {n}": rectangle(degree=n, corridor=0.3) for n in (3, 5, 7, 9, 11)},
    "pins": rectangle(pins={2: {"velocity": (0.1, 1.0, 0.0)}}, start={"velocity": (0.7, 0, 0)}),
    "pins in a tube": rectangle(corridor=0.4, pins={2: {"velocity": (0.1, 0.5, 0.0)}}),
    "three pieces": rectangle(pieces=3, start={"velocity": (0.7, 0, 0)}),
    "lap": rectangle(closed=True),
    "lap in a tube": rectangle(closed=True, corridor=0.3),
    "tube, three pieces": rectangle(corridor=0.3, pieces=3),
    "round tube": rectangle(corridor=minsnap.RoundTube(0.3)),
    "narrow tube": rectangle(corridor=0.01),
    "room and tube": rectangle(corridor=[0.3, minsnap.Room((-0.2, -0.2, 0.8), (8.2, 4.2, 1.2))]),
    "spline": rectangle(continuity=6),
    "tube, continuity 4": rectangle(corridor=0.5, continuity=4, pieces=2),
    "tube, continuity 6": rectangle(corridor=0.5, continuity=6, pieces=3),
    "lap, continuity 5": rectangle(corridor=0.5, continuity=5, pieces=2, closed=True),
    "degree 11, continuity 9": rectangle(corridor=0.5, continuity=9, pieces=3, degree=11),
    "balls": rectangle(waypoint_tolerance=minsnap.Ball(0.2)),
    "balls at all waypoints": rectangle(waypoint_tolerance=minsnap.Ball(np.full(5, 0.2)), corridor=0.4),
    "balls in a tube": rectangle(waypoint_tolerance=minsnap.Ball(0.2), corridor=0.4),
    "boxes": along(THROUGH, (4.3, 2.7, 3.1), corridor=BOXES),
    "boxes, free waypoints": along(
        None, (4.3, 2.7, 3.1), corridor=BOXES, start={"position": (0, 0, 1)}, end={"position": (7, 8, 1.5)}
    ),
    "polytopes": along(THROUGH, (4.3, 2.7, 3.1), corridor=polytopes()),
    "1,000 legs": along(*chain(1000)),
    "200 legs in a tube": along(*chain(200), corridor=0.4),
    "best split": rectangle(durations=None, total_time=13.0),
    "best split in a tube": rectangle(durations=None, total_time=13.0, corridor=0.3),
}
"""Plans with durations or a total time given, which the native core answers alone."""

SPEEDY = minsnap.Limits(speed=3.0, acceleration=6.0)
WIDE = [(0, 0, 1, 0, 2), (8, 0, 1, 1, 2), (8, 4, 1, 2, 0), (0, 4, 1, 1, 1)]
CRAFT = Quadrotor.dji_f330()


def fast(limits=SPEEDY, pieces=1, **asked):
    """The rectangle within limits."""
    return lambda: minsnap.plan(REFERENCE, limits=limits, pieces=pieces, **asked)


WITHIN_LIMITS = {
    **{f"fastest, {n} pieces": fast(corridor=0.3, pieces=n) for n in (1, 3, "auto")},
    "fastest lap": fast(closed=True, corridor=0.3),
    "fastest from a moving start": fast(start={"velocity": (1.5, 0.2, 0.0)}, corridor=0.5),
    "body rate": fast(minsnap.Limits(speed=4.0, max_thrust=2.0, min_thrust=0.33, tilt=1.0, body_rate=2.1)),
    "rotors without spin": fast(minsnap.Limits.of(CRAFT), yaw="tilt", pieces=2),
    "rotors under a yaw": fast(minsnap.Limits.of(CRAFT), yaw=0.3),
    "rotors under a yaw that turns": fast(minsnap.Limits.of(CRAFT, speed=4.0), yaw=(0.0, 0.7, 1.5, 2.2, 3.0)),
    "view": fast(minsnap.Limits(speed=3.0, acceleration=6.0, yaw_rate=0.4), yaw=minsnap.LookAt((4.0, -0.5))),
    "heading": fast(minsnap.Limits(speed=4.0, acceleration=8.0, yaw_rate=2.0), yaw="velocity"),
    "total along the velocity": fast(
        minsnap.Limits(yaw_rate=0.3, acceleration=5.0, tilt=0.5), total_time=29.530840680468046, yaw="velocity"
    ),
    "yaw at waypoints": fast(minsnap.Limits(speed=3.0, yaw_rate=0.8), yaw=np.linspace(0.0, 2.0 * np.pi, 5)),
    **{f"fastest, degree {n}": fast(degree=n) for n in (3, 5, 9, 11)},
    "fastest, three pieces of degree 9": fast(degree=9, pieces=3),
    "fastest, five coordinates": lambda: minsnap.plan(WIDE, limits=SPEEDY, degree=9, pieces=1),
    "slanted gate": lambda: minsnap.plan(
        [(0, 0, 1), minsnap.Gate((4, 0, 1), (1.0, 1.0, 0.3), 1.2, 0.8), (8, 2, 1)], limits=SPEEDY, pieces=1
    ),
    "price": fast(corridor=0.3, search=minsnap.Search(time_weight=1000.0)),
    "total within limits": fast(corridor=0.3, total_time=11.5),
}
"""Plans within limits, all of which the native core searches for."""


SOFT = minsnap.Limits(speed=3.0, jerk=20.0)
SEARCHED = {
    "split, continuity 2": rectangle(durations=None, total_time=13.0, continuity=2),
    "priced lap through a pin": rectangle(
        durations=None, search=minsnap.Search(time_weight=30.0), closed=True, pins={2: {"velocity": (0.1, 1.0, 0.0)}}
    ),
    "price, degree 9": fast(corridor=0.5, degree=9, pieces=2, search=minsnap.Search(time_weight=100.0)),
    "scaled": fast(corridor=0.3, search=minsnap.Search(split="distance")),
    "jerk from a moving start": fast(SOFT, start={"velocity": (1.5, 0.2, 0.1)}, pieces=2),
}
"""Plans for whose times Python searches, in part or whole: with numbers rounded so that no library decides them."""


def digest(traj):
    """Sixteen letters for all that a plan decides."""
    parts = np.ascontiguousarray(traj.control_points), np.ascontiguousarray(traj.durations)
    return hashlib.sha256(b"".join((part + 0.0).tobytes() for part in parts)).hexdigest()[:16]


def digests():
    """Digest of each plan, by its name."""
    return {name: digest(ask()) for name, ask in (GIVEN | WITHIN_LIMITS | SEARCHED).items()}


if __name__ == "__main__":
    text = json.dumps(digests(), indent=1) + "\n"
    if "--write" in sys.argv:
        STORED.write_text(text, encoding="utf-8")
    print(text, end="")
