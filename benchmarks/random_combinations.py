"""Random combinations of everything that ``plan`` can be asked: planned, refused with proof, unproved, or wrong.

    python benchmarks/random_combinations.py 1000 --seed 0 --processes 2

draws every option of every question, plans, and lets ``combination_oracle.py`` judge what comes back.  A question that
is wrong, ends in an error that is not the library's, or takes over two seconds of processor is printed by its seed.
Options that exclude each other are not drawn together.  Whether limits and walls leave room is left to chance, but for
``--planted``: there a curve is known that keeps everything, and to refuse is wrong.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections import Counter
from functools import partial
from multiprocessing import Pool
from pathlib import Path
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from combination_oracle import REAL, Judge

import minsnap
from minsnap import Ball, Boxes, Gate, HalfSpaces, Limits, LookAt, RoundTube, Search, Tube
from minsnap.vehicle import BodyDrag, Quadrotor

SLOW = 2.0
"""Processor time above which a question counts as slow [s]."""

NAMES = (None, "velocity", "acceleration", "jerk", "snap")
NORMS = {"speed": 1, "acceleration": 2, "jerk": 3, "snap": 4}
OUTCOMES = ("planned", "proved", "unproved", "refused", "solver", "late", "wrong", "foreign")


def question(seed):
    """Return the arguments of ``plan`` for a seed, and what the judge needs besides."""
    draw = np.random.default_rng(seed)
    chance = lambda share: bool(draw.random() < share)  # noqa: E731
    dim = int(draw.choice([1, 2, 3, 3, 3, 4, 5]))
    degree = int(draw.choice([3, 5, 7, 7, 7, 9, 11]))
    half, legs = (degree + 1) // 2, int(draw.integers(1, 6))
    legs = max(legs, 3) if dim > 3 else legs
    points = np.cumsum(draw.normal(size=(legs + 1, dim)) * np.exp(draw.normal() * 0.7), axis=0)
    closed = legs > 1 and chance(0.15)
    if closed:
        points[-1] = points[0]
    asked, known = {"degree": degree, "closed": closed}, {"dim": dim, "half": half, "points": points}
    asked["pieces"] = draw.choice(["auto", 1, 1, 1, 2, 3, 4, 6]).item()
    asked["pieces"] = asked["pieces"] if asked["pieces"] == "auto" else int(asked["pieces"])
    if chance(0.5):
        asked["continuity"] = int(draw.integers(1, max(2 * half - 1, 2)))
    timing = draw.choice(["durations", "total", "limits", "limits", "price", "total limits", "durations limits"])
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    pace = np.exp(draw.normal() * 0.5)
    search = {}
    if timing.startswith("durations"):
        asked["durations"] = (lengths * pace + 0.1) * np.exp(0.3 * draw.normal(size=legs))
    elif timing.startswith("total"):
        asked["total_time"] = float(1.5 * pace * lengths.sum() + 0.2)
    elif timing == "price":
        search["time_weight"] = float(np.exp(2 * draw.normal()))
    if "limits" in timing or (timing == "price" and chance(0.5)):
        asked["limits"], known["drag"] = drawn_limits(draw, chance, dim, lengths.mean())
        if timing == "limits" and chance(0.2):
            search["split"] = str(draw.choice(["distance", "optimal", "optimal"]))  # of three, as kept seeds were drawn
        elif timing == "limits" and chance(0.15):
            draw.choice([0, 1])
        if chance(0.3) and timing in ("limits", "durations limits"):
            search["time_limit"] = float(draw.choice([0.01, 0.1, 1.0]))
    ends = {}
    for end in ("start", "end"):
        if not closed and chance(0.3):
            orders = range(1, min(half, 4))
            ends[end] = {NAMES[p]: draw.normal(size=dim) * 0.5 for p in orders if chance(0.6)}
    asked |= ends
    if legs > 1 and half > 1 and chance(0.15):
        asked["pins"] = {int(draw.integers(1, legs)): {"velocity": draw.normal(size=dim) * 0.5}}
    passed = [("point", None)] * (legs + 1)
    if chance(0.2):
        radius = float(np.exp(draw.normal()) * 0.1)
        ball = chance(0.5)
        asked["waypoint_tolerance"] = Ball(radius) if ball else radius
        passed = [("ball" if ball else "box", radius) if 0 < k < legs else ("point", None) for k in range(legs + 1)]
    waypoints = list(points)
    if dim == 3 and legs > 1 and not closed and chance(0.15):
        k = int(draw.integers(1, legs))
        gate = Gate(points[k], points[k + 1] - points[k - 1], 1.0, 0.7)
        waypoints[k], passed[k] = gate, ("gate", gate)
    asked["waypoints"] = waypoints if any(isinstance(point, Gate) for point in waypoints) else points
    known["passed"] = passed
    constraints, known["walls"] = drawn_walls(draw, chance, points, dim)
    if constraints:
        asked["corridor"] = constraints if len(constraints) > 1 or chance(0.5) else constraints[0]
    heading = draw.choice(["none", "none", "number", "knots", "velocity", "tilt", "look", "function"])
    if heading == "number":
        asked["yaw"] = float(draw.normal())
    elif heading == "knots":
        asked["yaw"] = draw.normal(size=legs + 1)
    elif heading == "look":
        asked["yaw"] = LookAt(draw.normal(size=3 if dim == 3 else 2) * 9.0)
    elif heading == "function":
        asked["yaw"] = np.sin
    elif heading != "none":
        asked["yaw"] = str(heading)
    if search:
        asked["search"] = Search(**search)
    without_contradictions(asked, known)
    return asked, known


def without_contradictions(asked, known):
    """Change options that exclude each other, which ``plan`` refuses by an InputError."""
    half, dim, yaw, search = known["half"], known["dim"], asked.get("yaw"), asked.get("search")
    if "continuity" in asked:
        single = asked["pieces"] == 1 and not {"waypoint_tolerance"} & set(asked)
        single &= asked["waypoints"] is known["points"]
        asked["continuity"] = max(asked["continuity"], half - 2 if single else half - 1)
        if "durations" not in asked:
            asked["continuity"] = min(asked["continuity"], half - 1)
    if isinstance(yaw, np.ndarray):
        yaw[-1] = yaw[0] if asked["closed"] else yaw[-1]
    elif (dim not in (2, 3) and yaw == "tilt") or (dim == 1 and (yaw == "velocity" or isinstance(yaw, LookAt))):
        del asked["yaw"]
    elif asked["closed"] and yaw is np.sin:
        del asked["yaw"]
    if search is not None and {"start", "end", "pins"} & set(asked):
        kept = {"time_limit": search.time_limit, "time_weight": search.time_weight}
        asked["search"] = Search(**{name: value for name, value in kept.items() if value is not None})


def planted(seed):
    """Return the question of a seed with limits and walls changed such that a curve keeps all; None without a curve.

    The curve is the plan of the same waypoints, states and continuity at given durations without limits and walls.
    """
    asked, known = question(seed)
    draw, points, legs = np.random.default_rng([seed, 1]), known["points"], len(known["points"]) - 1
    kept = {name: asked[name] for name in ("degree", "closed", "continuity", "start", "end", "pins") if name in asked}
    pieces, lengths = (
        1 if asked["pieces"] == "auto" else asked["pieces"],
        np.linalg.norm(np.diff(points, axis=0), axis=1),
    )
    times = asked.get("durations", (lengths + 0.1) * np.exp(draw.normal() * 0.5 + 0.3 * draw.normal(size=legs)))
    if kept.get("continuity", known["half"]) < known["half"] - 1:
        del asked["continuity"], kept["continuity"]
    try:
        curve = minsnap.plan(points, durations=times, pieces=pieces, **kept)
    except minsnap.InfeasibleError:  # pins, and more continuity than the polynomials have room for
        del asked["pins"], kept["pins"]
        curve = minsnap.plan(points, durations=times, pieces=pieces, **kept)
    judge = Judge(curve.control_points, curve.durations, pieces)
    s = np.linspace(0, 1, 400).astype(REAL)
    values = {order: judge.values(order, s) for order in range(5)}
    room = lambda share=0.1: float(1.001 + share * np.exp(draw.normal()))  # noqa: E731
    if any(isinstance(one, Gate) for one in asked["waypoints"]):
        asked["waypoints"], known["passed"] = points, [("point", None)] * (legs + 1)
        asked.pop("waypoint_tolerance", None)
    if "total_time" in asked:
        asked["total_time"] = float(curve.duration)
    if asked.get("limits") is not None:
        asked["limits"], known["drag"] = room_for(asked["limits"], judge, values, room), (0.0, 0.0)
        search = asked.pop("search", None)
        if search is not None and search.time_weight is not None:
            asked["search"] = Search(time_weight=search.time_weight)
    told = []
    for kind, size in known["walls"]:
        by_leg = values[0].reshape(legs, -1, known["dim"])
        along = np.diff(points, axis=0) / lengths[:, None]
        offset = by_leg - points[:-1, None]
        offset = offset - (offset * along[:, None]).sum(axis=-1, keepdims=True) * along[:, None]
        if kind in ("tube", "round"):
            far = np.abs(offset) if kind == "tube" else np.sqrt((offset * offset).sum(axis=-1))
            width = np.array([float(far[leg].max()) * room() + 0.02 * lengths[leg] for leg in range(legs)])
            told.append((kind, width))
        elif kind == "boxes":
            lower, upper = by_leg.min(axis=1).astype(float), by_leg.max(axis=1).astype(float)
            margin = 0.02 * room() * (lengths[:, None] + upper - lower)
            told.append((kind, (lower - margin, upper + margin)))
        else:
            normal, _, order = size
            reach = values[order].reshape(-1, known["dim"]) @ normal
            told.append((kind, (normal, float(reach.max() + (room() - 1.0) * np.abs(reach).max() + 1e-3), order)))
    known["walls"] = told
    if told:
        make = {"tube": Tube, "round": RoundTube, "boxes": lambda both: Boxes(*both)}
        half_space = lambda given: HalfSpaces(given[0], given[1], order=given[2])  # noqa: E731
        asked["corridor"] = [make.get(kind, half_space)(size) for kind, size in told]
    return asked, known


def room_for(limits, judge, values, room):
    """Return limits of the same kinds that a curve keeps."""
    axis, bounds = limits.norm == "axis", {}
    size = lambda vectors: float(np.abs(vectors).max() if axis else np.sqrt((vectors**2).sum(axis=-1)).max())  # noqa: E731
    measures = {name: (lambda order=order: size(values[order])) for name, order in NORMS.items()}
    along = lambda vectors: float(np.sqrt((vectors[..., :2] ** 2).sum(axis=-1)).max())  # noqa: E731
    measures |= {"horizontal_speed": lambda: along(values[1]), "horizontal_acceleration": lambda: along(values[2])}
    measures |= {"climb_speed": lambda: float(values[1][..., 2].max())}
    measures |= {"descent_speed": lambda: float(-values[1][..., 2].min())}
    measures |= {"vertical_speed": lambda: float(np.abs(values[1][..., 2]).max())}
    measures |= {"vertical_acceleration": lambda: float(np.abs(values[2][..., 2]).max())}
    given = limits.given()
    for name in measures:
        if name in given:
            bounds[name] = max(measures[name](), 1e-3) * room(0.3)
    if {"max_thrust", "min_thrust", "tilt", "body_rate"} & set(given):
        flown = judge.flown(9.81)
        most = {name: max(float(flown[name]), 1e-3) * room(0.2) for name in ("tilt", "body_rate")}
        most |= {
            "max_thrust": float(flown["max_thrust"]) * room(0.2),
            "min_thrust": -float(flown["min_thrust"]) / room(0.2),
        }
        fits = {"tilt": most["tilt"] < 1.4, "body_rate": most["body_rate"] < 40, "max_thrust": most["max_thrust"] < 9}
        fits |= {"min_thrust": 0.01 < most["min_thrust"] < 0.99 and fits["tilt"]}
        bounds |= {name: value for name, value in most.items() if name in given and fits[name]}
    if not set(bounds) & set(NORMS):
        bounds["speed"] = max(measures["speed"](), 1e-3) * room(0.3)
    return Limits(**bounds, norm=limits.norm)


def drawn_limits(draw, chance, dim, length):
    """Return random limits, and the drag per mass that they include."""
    bounds = {}
    for name in ("speed", "acceleration", "jerk", "snap"):
        if chance(0.4):
            bounds[name] = float(np.exp(draw.normal() * 0.6) * 3.0 * NORMS[name] ** 2)
    if dim == 3 and chance(0.4):
        for name, typical in (
            ("horizontal_speed", 3.0),
            ("climb_speed", 2.0),
            ("descent_speed", 1.5),
            ("vertical_speed", 2.0),
            ("horizontal_acceleration", 5.0),
            ("vertical_acceleration", 4.0),
        ):
            if chance(0.25):
                bounds[name] = float(typical * np.exp(draw.normal() * 0.4))
    drag = (0.0, 0.0)
    if dim == 3 and chance(0.4):
        if chance(0.5):
            bounds["max_thrust"] = float(1.2 + draw.random() * 2)
        if chance(0.4):
            bounds["min_thrust"] = float(0.1 + draw.random() * 0.6)
        if chance(0.4):
            bounds["tilt"] = float(0.2 + draw.random())
        if chance(0.3):
            bounds["body_rate"] = float(1.0 + draw.random() * 6)
    if chance(0.1):
        bounds["yaw_rate"] = float(0.5 + draw.random() * 3)
    if not bounds or (len(bounds) == 1 and "yaw_rate" in bounds):
        bounds["speed"] = 3.0
    if dim == 3 and chance(0.15):
        across, along = float(draw.random() * 0.4), float(draw.random() * 0.2)
        inertia = (0.0163, 0.0179, 0.0293)
        model = BodyDrag((across, across, along))
        vehicle = Quadrotor(1.2, inertia, 0.19, 1e-6, 3e-8, 3800.0, 0.0, "x", drag=model)
        plain = {name: value for name, value in bounds.items() if name not in ("max_thrust", "min_thrust")}
        return Limits.of(vehicle, reserve=0.1, **plain), (across / 1.2, along / 1.2)
    return Limits(**bounds, norm="axis" if chance(0.25) else "euclidean"), drag


def drawn_walls(draw, chance, points, dim):
    """Return constraints, and what the judge is told of them: (kind, numbers)."""
    constraints, told = [], []
    legs = len(points) - 1
    if dim in (2, 3) and chance(0.35):
        widths = np.exp(draw.normal(size=legs) * 0.7) * 0.4
        if chance(0.25):
            constraints.append(RoundTube(widths))
            told.append(("round", widths))
        else:
            constraints.append(Tube(widths))
            told.append(("tube", widths))
    if dim in (2, 3) and chance(0.25):
        room = np.exp(draw.normal(size=(legs, 1)) * 0.5) * 0.5
        lower, upper = np.minimum(points[:-1], points[1:]) - room, np.maximum(points[:-1], points[1:]) + room
        constraints.append(Boxes(lower, upper))
        told.append(("boxes", (lower, upper)))
    for _ in range(int(draw.integers(0, 3)) if chance(0.4) else 0):
        order = int(draw.integers(0, 3))
        normal = draw.normal(size=dim)
        reach = float((points @ normal).max()) if order == 0 else 0.0
        offset = reach + float(np.exp(draw.normal() * 0.7)) * float(np.linalg.norm(normal)) * (1.0 + 2.0 * order)
        offset = -0.1 * offset if order and chance(0.04) else offset
        constraints.append(HalfSpaces(normal, offset, order=order))
        told.append(("half", (normal, offset, order)))
    return constraints, told


def judged(asked, known, curve):
    """Return what the oracle finds wrong with a curve."""
    judge = Judge(curve.control_points, curve.durations, curve.pieces)
    points, half = known["points"], known["half"]

    def outside(k, position):
        kind, size = known["passed"][k]
        offset = position - np.asarray(points[k], REAL)
        if kind == "ball":
            return np.sqrt((offset * offset).sum()) - REAL(size)
        if kind == "box":
            return np.abs(offset).max() - REAL(size)
        if kind == "gate":
            corners = np.asarray(size.corners, REAL)
            sides = (corners[1] - corners[0], corners[3] - corners[0])
            lengths = [np.sqrt((side * side).sum()) for side in sides]
            over = [abs(offset @ side) / length - length / 2 for side, length in zip(sides, lengths, strict=True)]
            normal = np.asarray(size.normal, REAL)
            return max(*over, abs(offset @ normal) / np.sqrt((normal * normal).sum()))
        return np.abs(offset).max()

    judge.knots(points, outside)
    judge.continuity(asked.get("continuity", max(half - 1, 0)), asked["closed"])
    last = len(points) - 1
    if not asked["closed"]:
        for waypoint, state in ((0, asked.get("start", {})), (last, asked.get("end", {}))):
            for order in range(1, half):
                judge.state(waypoint, order, state.get(NAMES[order] if order < 5 else "", np.zeros(known["dim"])))
    for waypoint, state in asked.get("pins", {}).items():
        judge.state(waypoint, 1, state["velocity"])
    for kind, told in known["walls"]:
        if kind == "tube":
            judge.tube(points, told)
        elif kind == "half":
            for leg in range(last):
                judge.planes("half-space", leg, [told[0]], [told[1]], told[2])
        elif kind == "boxes":
            for leg in range(last):
                axes = np.eye(known["dim"])
                judge.planes("box", leg, [*axes, *-axes], [*told[1][leg], *-told[0][leg]])
        else:
            for leg in range(last):
                round_tube(judge, leg, points, told[leg])
    times = asked.get("durations", asked.get("total_time"))
    if times is not None:
        own = np.diff(curve.leg_breaks) if np.ndim(times) else curve.duration
        if np.abs(np.subtract(own, times)).max() > 1e-8 * curve.duration:
            judge.wrong.append("other times")
    if asked.get("limits") is not None and curve.report.limits_from == 0.0:
        limited(judge, asked["limits"], known["drag"])
    return judge.wrong


def round_tube(judge, leg, points, radius):
    """Judge the distance to the line of a leg."""
    from combination_oracle import squared

    start = np.asarray(points[leg], REAL)
    along = np.asarray(points[leg + 1], REAL) - start
    along = along / np.sqrt((along * along).sum())
    pieces = list(judge.on_leg(leg))
    offset = judge.points[pieces] - start
    offset = offset - (offset @ along)[..., None] * along
    size = (np.abs(points).max() + radius) ** 2
    judge.beyond("round tube", pieces, [squared(row) for row in offset], REAL(radius) ** 2, REAL(size))


def limited(judge, limits, drag):
    """Judge the limits."""
    given = limits.given()
    for name, order in NORMS.items():
        if name in given:
            (judge.axis_bounds if limits.norm == "axis" else judge.norms)(name, order, given[name])
    for name, order in (("horizontal_speed", 1), ("horizontal_acceleration", 2)):
        if name in given:
            judge.norms(name, order, given[name], axes=[0, 1])
    for name, order, signs in (
        ("climb_speed", 1, (1,)),
        ("descent_speed", 1, (-1,)),
        ("vertical_speed", 1, (1, -1)),
        ("vertical_acceleration", 2, (1, -1)),
    ):
        if name in given:
            judge.axis_bounds(name, order, given[name], axes=[2], signs=signs)
    if {"max_thrust", "min_thrust", "tilt", "body_rate"} & set(given):
        judge.flight(given, limits.gravity, drag)


def limited_in_truth(asked, known):
    """Return whether the time is chosen, or limited: a derivative limits it where the one below it is continuous.

    Nothing limits a lap that may rest where it starts, within the tolerance of all waypoints.
    """
    search, joined = asked.get("search"), asked.get("continuity", known["half"] - 1)
    if "total_time" in asked or (search is not None and search.time_weight is not None):
        return True
    if asked["closed"] and "waypoint_tolerance" in asked and "pins" not in asked:
        kind, radius = known["passed"][1]
        away = np.linalg.norm(known["points"] - known["points"][0], np.inf if kind == "box" else 2, axis=1)
        if away.max() <= radius:
            return False
    given = {NORMS[name] for name in asked["limits"].given() if name in NORMS}
    return known["dim"] > 1 and any(order <= min(joined + 1, asked["degree"]) for order in given)


def outcome(seed, source=question):
    """Return what became of the question of a seed: its kind, a sentence, and processor time [s]."""
    asked, known = source(seed)
    began = process_time()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", minsnap.errors.MagnitudeWarning)
            curve = minsnap.plan(**asked)
        seconds = process_time() - began
        wrong = judged(asked, known, curve)
        return seed, "wrong" if wrong else "planned", "; ".join(wrong), seconds
    except minsnap.UnprovedError as error:
        kind, said = "unproved", str(error)
    except minsnap.InfeasibleError as error:
        kind, said = ("proved" if error.verify() and source is question else "wrong"), str(error)
    except minsnap.InputError as error:
        kind, said = "refused", f"{type(error).__name__}: {error}"
        if "nothing limits the time" in said and limited_in_truth(asked, known):
            kind = "wrong"
    except minsnap.SolverError as error:
        kind, said = ("late" if "time_limit" in str(error) else "solver"), str(error)
    except Exception as error:  # noqa: BLE001 - that is what is looked for
        kind, said = "foreign", f"{type(error).__name__}: {error}"
    return seed, kind, said, process_time() - began


def main():
    """Run, print what is to be looked at, and the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("count", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--planted", action="store_true", help="only questions of which a plan is known")
    parser.add_argument("--show", nargs="*", default=["wrong", "foreign"])
    chosen = parser.parse_args()
    kinds, times = Counter(), []
    seeds = range(chosen.seed, chosen.seed + chosen.count)
    with Pool(chosen.processes) as pool:
        asked = partial(outcome, source=planted if chosen.planted else question)
        for seed, kind, said, seconds in pool.imap_unordered(asked, seeds, chunksize=4):
            kinds[kind] += 1
            times.append(seconds)
            if kind in chosen.show or ("slow" in chosen.show and seconds > SLOW):
                print(seed, kind, f"{seconds:.2f} s", said, flush=True)
    print("| " + " | ".join(OUTCOMES) + " | over 2 s | median ms | p99 ms | most s |")
    figures = [str(kinds[kind]) for kind in OUTCOMES] + [str(sum(one > SLOW for one in times))]
    spread = np.percentile(times, [50, 99, 100])
    print("| " + " | ".join(figures) + f" | {1e3 * spread[0]:.1f} | {1e3 * spread[1]:.0f} | {spread[2]:.2f} |")


if __name__ == "__main__":
    main()
