"""Random questions for ``minsnap.plan``, of every kind of constraint: arguments by kind and seed."""

from __future__ import annotations

from typing import Any

import numpy as np
from problems import corridor

from minsnap import Ball, Boxes, Gate, HalfSpaces, Limits, Polytopes, Room, RoundTube, Tube

Asked = dict[str, Any]

STATES = ("velocity", "acceleration", "jerk", "snap", "crackle")


def legs(random, most=7, dims=(2, 3)):
    """Waypoints and durations: legs of 0.3 to 10 m in any direction or along axes, 0.2 to 5 m/s."""
    count, dim = int(random.integers(1, most + 1)), int(random.choice(dims))
    lengths = 10.0 ** random.uniform(-0.5, 1.0, count)
    directions = random.normal(size=(count, dim))
    if random.random() < 0.3:
        directions = np.eye(dim)[random.integers(dim, size=count)] * random.choice((-1.0, 1.0), size=(count, 1))
    steps = lengths[:, None] * directions / np.linalg.norm(directions, axis=1)[:, None]
    points = np.concatenate((np.zeros((1, dim)), np.cumsum(steps, axis=0))) + 10.0 * random.normal(size=dim)
    return {"waypoints": points, "durations": lengths * 10.0 ** random.uniform(-0.7, 0.7, count)}


def curve(random, asked, moving=0.15):
    """Add a degree, pieces, a continuity, and states at the ends and at a waypoint, each by chance."""
    degree = int(random.choice((3, 5, 7, 7, 7, 9, 11)))
    half, count = (degree + 1) // 2, len(asked["durations"])
    asked["degree"] = degree
    if random.random() < 0.25:
        asked["pieces"] = int(random.integers(2, 4))
    if random.random() < 0.2:
        asked["continuity"] = int(random.integers(half - 1, min(half + 2, degree)))
    speeds = np.linalg.norm(np.diff(asked["waypoints"], axis=0), axis=1) / asked["durations"]
    for where, leg in (("start", 0), ("end", -1)):
        if random.random() < moving:
            asked[where] = _state(random, half, asked, float(speeds[leg]))
    if count > 1 and random.random() < moving / 3.0:
        at = int(random.integers(1, count))
        asked["pins"] = {at: _state(random, half, asked, float(speeds[at]))}
    return asked


def _state(random, half, asked, speed):
    names = STATES[: min(half - 1, 1 + int(random.random() < 0.3))]
    dim, time = asked["waypoints"].shape[1], float(np.mean(asked["durations"]))
    return {name: speed * random.normal(size=dim) / time**order for order, name in enumerate(names)}


def tubes(random):
    """Narrow and wide, extreme legs, degree 7, from rest to rest."""
    points, durations, widths = corridor(random)
    return {"waypoints": points, "durations": durations, "corridor": widths}


def further_tubes(random):
    """Any degree, pieces, continuity and ends; one width, or one per leg, or one per leg and axis."""
    asked = curve(random, legs(random))
    count, dim = len(asked["durations"]), asked["waypoints"].shape[1]
    shape = ((), (count,), (count, dim))[int(random.integers(3))]
    return asked | {"corridor": 10.0 ** random.uniform(-2.0, 0.3, shape)}


def round_tubes(random):
    """Cylinders around the legs, of one radius or one per leg."""
    asked = curve(random, legs(random, 5))
    shape = ((), (len(asked["durations"]),))[int(random.integers(2))]
    return asked | {"corridor": RoundTube(10.0 ** random.uniform(-1.5, 0.3, shape))}


def boxes(random):
    """Boxes around the legs, with waypoints or from overlap to overlap."""
    asked = curve(random, legs(random))
    points = asked["waypoints"]
    low, high = np.minimum(points[:-1], points[1:]), np.maximum(points[:-1], points[1:])
    rooms = 10.0 ** random.uniform(-1.5, 0.3, (2, *low.shape))
    asked["corridor"] = Boxes(low - rooms[0], high + rooms[1])
    return _without_waypoints(random, asked)


def _without_waypoints(random, asked):
    if random.random() < 0.4 and "pins" not in asked:
        points, asked["waypoints"] = asked["waypoints"], None
        for where, point in (("start", points[0]), ("end", points[-1])):
            asked[where] = asked.get(where, {}) | {"position": point}
    return asked


def polytopes(random):
    """Turned boxes around the legs, with some of their edges cut off."""
    asked = curve(random, legs(random, 5))
    points = asked["waypoints"]
    spaces = [_polytope(random, a, b) for a, b in zip(points[:-1], points[1:], strict=True)]
    asked["corridor"] = Polytopes(spaces)
    return _without_waypoints(random, asked)


def _polytope(random, start, end):
    normals = np.linalg.qr(random.normal(size=(len(start), len(start))))[0]
    rows = np.vstack((normals, -normals, random.normal(size=(int(random.integers(4)), len(start)))))
    rows /= np.linalg.norm(rows, axis=1)[:, None]
    return rows, np.maximum(rows @ start, rows @ end) + 10.0 ** random.uniform(-1.5, 0.3, len(rows))


def rooms(random):
    """A room around everything, open on some sides, with or without tubes."""
    asked = curve(random, legs(random))
    points = asked["waypoints"]
    low = points.min(axis=0) - 10.0 ** random.uniform(-2.0, 0.5, points.shape[1])
    high = points.max(axis=0) + 10.0 ** random.uniform(-2.0, 0.5, points.shape[1])
    asked["room"] = np.where(random.random(len(low)) < 0.2, -np.inf, low), high
    return asked | ({"corridor": 10.0 ** random.uniform(-1.0, 0.3)} if random.random() < 0.4 else {})


def half_spaces(random):
    """Planes beside all waypoints, or beside those of some legs."""
    asked = curve(random, legs(random))
    points = asked["waypoints"]
    normals = random.normal(size=(int(random.integers(1, 4)), points.shape[1]))
    lengths = np.linalg.norm(normals, axis=1)
    offsets = (normals @ points.T).max(axis=1) + lengths * 10.0 ** random.uniform(-2.0, 0.5, len(normals))
    some = tuple(range(0, len(points) - 1, 2)) if random.random() < 0.3 else None
    return asked | {"corridor": HalfSpaces(normals, offsets, some)}


def gates(random):
    """Openings at inner waypoints, some with a direction, some within a room."""
    asked = curve(random, legs(random, 5, (3,)))
    points = asked["waypoints"]
    passed = list(points)
    for inner in range(1, len(points) - 1):
        way = points[inner + 1] - points[inner - 1] + 0.3 * random.normal(size=3)
        if random.random() < 0.7 and inner not in asked.get("pins", {}):
            sides = 10.0 ** random.uniform(-1.0, 0.3, 2)
            passed[inner] = Gate(points[inner], way, *sides, crossing=int(random.integers(2)))
    if random.random() < 0.5:
        asked["room"] = points.min(axis=0) - 2.0, points.max(axis=0) + 2.0
    return asked | {"waypoints": passed}


def balls(random):
    """Waypoints passed within a distance, in tubes or free."""
    asked = curve(random, legs(random, 5))
    asked["waypoint_tolerance"] = Ball(10.0 ** random.uniform(-2.0, 0.0))
    return asked | ({"corridor": 10.0 ** random.uniform(-1.0, 0.3)} if random.random() < 0.5 else {})


def tolerances(random):
    """Boxes around waypoints, the ends' among them, in tubes, in boxes or free."""
    asked = curve(random, legs(random))
    shape = ((), (len(asked["waypoints"]),))[int(random.integers(2))]
    asked["waypoint_tolerance"] = 10.0 ** random.uniform(-2.0, 0.0, shape)
    return asked | ({"corridor": 10.0 ** random.uniform(-1.0, 0.3)} if random.random() < 0.6 else {})


def closed(random):
    """Laps: in tubes, in a room or free."""
    asked = legs(random, 6)
    points = asked["waypoints"]
    if len(points) < 4:
        return closed(random)
    points[-1] = points[0]
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    asked = {"waypoints": points, "durations": lengths * 10.0 ** random.uniform(-0.5, 0.5, len(lengths))}
    asked = curve(random, asked, 0.0) | {"closed": True}
    kind = int(random.integers(3))
    if kind == 0:
        asked["corridor"] = 10.0 ** random.uniform(-1.5, 0.3)
    elif kind == 1:
        asked["room"] = points.min(axis=0) - 1.0, points.max(axis=0) + 1.0
    return asked


def limits(random):
    """Durations given and limits that may or may not be kept in them, in tubes or free."""
    asked = curve(random, legs(random, 4, (3,)), 0.0)
    for name in ("continuity", "pieces"):
        asked.pop(name, None)
    lengths = np.linalg.norm(np.diff(asked["waypoints"], axis=0), axis=1)
    speed, time = (lengths / asked["durations"]).max(), asked["durations"].min()
    asked["limits"] = _limits(random, float(speed), float(speed / time))
    return asked | ({"corridor": 10.0 ** random.uniform(-1.0, 0.3)} if random.random() < 0.5 else {})


def _limits(random, speed, acceleration):
    given = {"speed": speed * 10.0 ** random.uniform(0.2, 0.7)}
    if random.random() < 0.5:
        given["acceleration"] = acceleration * 10.0 ** random.uniform(0.6, 1.5)
    more = {"climb_speed": 2.0 * speed, "horizontal_speed": 2.0 * speed, "max_thrust": 3.0, "tilt": 1.0, "snap": 1e3}
    name = list(more)[int(random.integers(len(more)))]
    return Limits(**given, **({name: more[name]} if random.random() < 0.5 else {}))


def shortest(random):
    """Limits alone: the shortest time, in tubes, in boxes or free."""
    asked = legs(random, 4, (3,))
    points = asked["waypoints"]
    del asked["durations"]
    more = ({}, {"jerk": 60.0}, {"max_thrust": 1.8}, {"tilt": 0.6}, {"body_rate": 4.0}, {"horizontal_speed": 2.5})
    asked["limits"] = Limits(
        speed=random.uniform(2.0, 6.0), acceleration=random.uniform(3.0, 10.0), **more[int(random.integers(len(more)))]
    )
    kind = int(random.integers(3))
    if kind == 0:
        asked["corridor"] = Tube(random.uniform(0.1, 0.6))
    elif kind == 1:
        asked["corridor"] = Boxes(np.minimum(points[:-1], points[1:]) - 0.5, np.maximum(points[:-1], points[1:]) + 0.5)
    return asked


def split(random):
    """A total time, divided among the legs for the least cost, in tubes or free."""
    asked = curve(random, legs(random, 5), 0.0)
    asked = {name: value for name, value in asked.items() if name not in ("continuity", "pieces")}
    asked["total_time"] = float(asked.pop("durations").sum())
    return asked | ({"corridor": 10.0 ** random.uniform(-1.0, 0.0)} if random.random() < 0.5 else {})


KINDS = {
    "tubes": (tubes, 70.0),
    "further tubes": (further_tubes, 4.0),
    "boxes": (boxes, 5.0),
    "polytopes": (polytopes, 3.0),
    "rooms": (rooms, 4.0),
    "half-spaces": (half_spaces, 4.0),
    "tolerances": (tolerances, 3.0),
    "closed": (closed, 2.5),
    "round tubes": (round_tubes, 1.0),
    "gates": (gates, 1.0),
    "balls": (balls, 0.5),
    "limits": (limits, 0.5),
    "split": (split, 1.2),
    "shortest": (shortest, 0.3),
}
"""How each kind is drawn, and its share of all problems in per cent."""


def question(kind: str, seed: int) -> tuple[str, Asked]:
    """Return the kind and the arguments of ``plan``; the kind is drawn by the seed where it is "all"."""
    if kind == "all":
        shares = np.array([share for _, share in KINDS.values()])
        kind = str(np.random.default_rng((seed, 1)).choice(list(KINDS), p=shares / shares.sum()))
    asked = KINDS[kind][0](np.random.default_rng(seed))
    if "room" in asked:
        others = [asked["corridor"]] if "corridor" in asked else []
        asked["corridor"] = [*others, Room(*asked.pop("room"))]
    return kind, asked
