"""Random questions, many, of every kind: all solved or refused rightly, none outside by any amount.

    python benchmarks/soak.py --problems 1000000 --kind all --workers 2 --resume soak.jsonl

Each question has its own seed, so that what is reported can be asked again:
``python benchmarks/soak.py --kind boxes --seed 1234 --problems 1``.  A refusal is right if a relaxation of the question
(``relaxation.py``) has no solution either; of the width or time that it names 1.001 times as much must do, and 0.97
times as much must not.  The status is 1 if anything was wrong.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
import warnings
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from math import perm
from pathlib import Path

import numpy as np
from random_plans import KINDS, STATES, question
from relaxation import Relaxation

import minsnap
from minsnap import Boxes, Polytopes, RoundTube, Tube
from minsnap.basics.checks import check_position
from minsnap.corridors.constraint import walls_of
from minsnap.corridors.given_waypoints import as_knots
from minsnap.corridors.knot_regions import place
from minsnap.corridors.tubes import as_constraints
from minsnap.errors import InfeasibleError, MinsnapError

BAR, CHUNK, LATE = 40, 100, 30.0
SOLVED, FALLBACK, REFUSED, PROVED = "solved", "solved after a fallback", "refused rightly", "refused, proved exactly"
RIGHT = (SOLVED, FALLBACK, REFUSED, PROVED)
PROOFS = 20
"""One in so many seeds has its refusal proved in exact rationals too, which takes seconds."""

INSTANTS = 24, 96, 384
"""Instants per piece of the relaxations that are tried in turn, until one has no solution."""

SLACK = 1e-6
"""Share of their widths by which walls must give way before a relaxation counts as infeasible."""


def ask(kind, seed):
    """Ask one question: its kind, what became of it, its margin [m], and the seconds of the processor."""
    kind, asked = question(kind, seed)
    began = time.process_time()
    try:
        traj = minsnap.plan(**asked)
    except InfeasibleError as error:
        took = time.process_time() - began
        return kind, _refusal(asked, error, seed % PROOFS == 0), np.nan, took
    except MinsnapError as error:
        return kind, f"failed: {type(error).__name__}: {_plain(error)}", np.nan, time.process_time() - began
    except Exception as error:  # whatever else comes out is a defect to be counted, not an end of the run
        return kind, f"crashed: {type(error).__name__}", np.nan, time.process_time() - began
    took = time.process_time() - began
    outcome, margin = _judged(asked, traj)
    return kind, outcome, margin, took


def _plain(error):
    """The sentence without its numbers."""
    return " ".join(word for word in str(error).split(":")[0].split() if not any(c.isdigit() for c in word))


def _constraints(asked):
    return as_constraints(asked.get("corridor"))


def _judged(asked, traj):
    certificate = minsnap.certify(
        traj,
        asked["waypoints"],
        _constraints(asked) or None,
        asked.get("limits"),
        asked.get("waypoint_tolerance", 0.0),
    )
    margin = np.inf if certificate.corridor_margin is None else certificate.corridor_margin
    if margin < 0.0:
        return "outside", margin
    if not certificate.ok or certificate.continuity < asked.get("continuity", traj.degree // 2):
        return "missed a waypoint, a limit or a derivative", margin
    if not _states_hold(asked, traj):
        return "missed a state", margin
    if "durations" in asked and not np.allclose(np.diff(traj.leg_breaks), asked["durations"], rtol=1e-12):
        return "other durations", margin
    if not _sampled(traj, certificate.walls, margin):
        return "the certificate is contradicted by samples", margin
    return FALLBACK if traj.report.fallback else SOLVED, margin


def _states_hold(asked, traj):
    """Whether the states asked for are flown, to the rounding of control points."""
    size = 1e3 * np.finfo(float).eps * np.abs(traj.control_points - traj.control_points[0, 0]).max()
    size += 8.0 * np.finfo(float).eps * np.abs(traj.control_points).max()
    states = {0: asked.get("start", {}), -1: asked.get("end", {}), **asked.get("pins", {})}
    for knot, state in states.items():
        for order, name in enumerate(STATES, 1):
            if name in state:
                time = np.diff(traj.breaks).min()
                rounding = size * perm(traj.degree, order) * (2.0 / time) ** order
                if np.abs(traj(traj.leg_breaks[knot], order) - state[name]).max() > rounding:
                    return False
    return True


def _sampled(traj, walls, margin):
    """Whether no sample is nearer to a wall than the margin says, but for the rounding of samples."""
    s = np.linspace(0.0, 1.0, 33)
    t = np.minimum(traj.breaks[:-1, None] + np.diff(traj.breaks)[:, None] * s, traj.breaks[1:, None])
    rounding = 1e-12 * np.abs(traj.control_points).max()
    values = traj(t)
    for wall in walls:
        cones = wall
        for piece in range(traj.pieces):
            least = cones.slack(values[cones.leg * traj.pieces + piece]).min(initial=np.inf)
            if least < margin - rounding:
                return False
    return True


def _refusal(asked, error, prove):
    """Whether a refusal is right, and what it names sufficient and necessary."""
    if "durations" not in asked:
        return "refused, not checked"
    share = _relaxed(asked)
    if share is None:
        return "refused, the relaxation was not solved"
    if share <= SLACK:
        return "refused, and the relaxation has a solution"
    outcome = PROVED if prove and error.verify() else REFUSED
    if error.smallest_width is not None:
        return _around(outcome, "width", lambda factor: _wider(asked, error, factor))
    if error.stretch is not None:
        return _around(
            outcome, "time", lambda f: asked | {"durations": np.asarray(asked["durations"]) * error.stretch * f}
        )
    return outcome


def _relaxed(asked):
    constraints = _constraints(asked)
    knots = as_knots(asked["waypoints"], asked.get("waypoint_tolerance"))
    ends = (check_position(asked.get(name), name)[0] for name in ("start", "end"))
    points = place(knots, constraints, *ends, asked.get("closed", False)).points
    if "limits" in asked:
        constraints = [*constraints, asked["limits"]]
    walls = walls_of(constraints, points)
    share = None
    for instants in INSTANTS:
        share = Relaxation(asked, walls, instants).least_share()
        if share is None or share > SLACK:
            break
    return share


def _around(outcome, what, changed):
    """Try 1.001 and 0.97 times the figure that is named."""
    if changed(1.0) is None:
        return outcome
    if not _fits(changed, 1.001):
        return f"refused, and the {what} named does not do"
    if changed(1.0)["waypoints"] is None:  # wider sets overlap in more, so that the figure is sufficient only
        return outcome
    return f"refused, and less than the {what} named does" if _fits(changed, 0.97) else outcome


def _fits(changed, factor):
    """Whether the question of that factor has a plan; boxes that are narrower may no longer overlap."""
    try:
        minsnap.plan(**changed(factor))
    except MinsnapError:
        return False
    return True


def _wider(asked, error, factor):
    """The question with the corridor that the refusal names, times a factor; None where several widths are named."""
    corridor, width, leg = asked.get("corridor"), error.smallest_width * factor, error.leg
    if "together with" in str(error) or corridor is None:
        return None
    everywhere = "for all legs" in str(error)
    if isinstance(corridor, float | np.ndarray):
        return asked | {"corridor": Tube(_changed(corridor, asked, width, leg, everywhere))}
    if isinstance(corridor, RoundTube):
        return asked | {"corridor": RoundTube(_changed(corridor.radius, asked, width, leg, everywhere))}
    if isinstance(corridor, Boxes):
        half = (corridor.upper - corridor.lower) / 2.0
        grow = half * (width / half[leg].max() - 1.0)
        grow = grow if everywhere else np.where(np.arange(len(half))[:, None] == leg, grow, 0.0)
        return asked | {"corridor": Boxes(corridor.lower - grow, corridor.upper + grow)}
    if isinstance(corridor, Polytopes) and asked["waypoints"] is not None:
        before = corridor.walls(np.asarray(asked["waypoints"]))[0]
        own = before.width[before.leg == leg][0]
        rows = [(A, b + (width - own) * (everywhere or i == leg)) for i, (A, b) in enumerate(corridor.half_spaces)]
        return asked | {"corridor": Polytopes(rows)}
    return None


def _changed(widths, asked, width, leg, everywhere):
    if everywhere or np.ndim(widths) == 0:
        return width
    changed, points = np.array(widths), np.asarray(asked["waypoints"], dtype=float)
    crossing = np.diff(points, axis=0)[leg] / np.linalg.norm(np.diff(points, axis=0)[leg])
    walled = np.abs(crossing) < 1.0 if changed[leg].ndim else ()  # a leg along an axis has no walls across that axis
    changed[leg] *= width / changed[leg][walled].max()
    return changed


def chunk(kind, first, count):
    """Ask questions with seeds that count up: numbers for the file of results, by kind."""
    warnings.simplefilter("ignore")
    told, odd = {}, []
    for seed in range(first, first + count):
        name, outcome, margin, took = ask(kind, seed)
        own = told.setdefault(name, {"outcomes": Counter(), "seconds": 0.0, "most": 0.0, "margin": None})
        own["outcomes"][outcome] += 1
        own["seconds"] += took
        own["most"] = max(own["most"], took)
        if np.isfinite(margin):
            own["margin"] = margin if own["margin"] is None else min(margin, own["margin"])
        if outcome not in RIGHT or took > LATE:
            odd.append((name, seed, outcome if outcome not in RIGHT else f"{outcome}, in {took:.0f} s"))
    return {"kind": kind, "first": first, "count": count, "told": told, "odd": odd}


def bar(done, count, began):
    """Draw how far it is on standard error, where that is a terminal."""
    if not sys.stderr.isatty():
        return
    share = done / count
    left = (time.perf_counter() - began) * (1.0 / share - 1.0)
    filled = "#" * round(BAR * share)
    print(f"\r[{filled:<{BAR}}] {done}/{count}, {left:.0f} s left ", end="", file=sys.stderr, flush=True)


def run(given):
    """Ask what the file of results does not have yet, and return all that is known."""
    known = [json.loads(line) for line in given.resume.read_text().splitlines()] if _exists(given.resume) else []
    have = {(entry["kind"], entry["first"], entry["count"]) for entry in known}
    last = given.seed + given.problems
    wanted = [(given.kind, first, min(CHUNK, last - first)) for first in range(given.seed, last, CHUNK)]
    done = [entry for entry in known if (entry["kind"], entry["first"], entry["count"]) in set(wanted)]
    began, asked = time.perf_counter(), 0
    with ProcessPoolExecutor(given.workers) as pool:
        waiting = [pool.submit(chunk, *part) for part in wanted if part not in have]
        for future in as_completed(waiting):
            if future.exception() is not None:
                pool.shutdown(cancel_futures=True)
            done.append(future.result())
            asked += 1
            bar(asked, len(waiting), began)
            if given.resume is not None:
                with given.resume.open("a") as file:
                    file.write(json.dumps(done[-1]) + "\n")
    return done


def _exists(path):
    return path is not None and path.exists()


def summary(done):
    """Print a table of outcomes by kind, and what is wrong; return how many that are."""
    heads = ("kind", "problems", *RIGHT, "wrong", "least margin, m", "mean ms", "most s")
    print("\n| " + " | ".join(heads) + " |\n" + "|---" * len(heads) + "|")
    total, wrong = Counter(), 0
    for kind in KINDS:
        parts = [entry["told"][kind] for entry in done if kind in entry["told"]]
        if not parts:
            continue
        outcomes = sum((Counter(part["outcomes"]) for part in parts), Counter())
        count, right = sum(outcomes.values()), [outcomes[name] for name in RIGHT]
        margins = [part["margin"] for part in parts if part["margin"] is not None]
        least = f"{min(margins):.2g}" if margins else ""
        mean = 1e3 * sum(part["seconds"] for part in parts) / count
        cells = [kind, count, *right, count - sum(right), least, f"{mean:.1f}"]
        print("| " + " | ".join(map(str, cells)) + f" | {max(part['most'] for part in parts):.2f} |")
        total += outcomes
        wrong += count - sum(right)
    for name, number in total.most_common():
        print(f"{number:8d} {name}")
    odd = sorted((tuple(line) for entry in done for line in entry["odd"]), key=lambda line: (line[2], line[0], line[1]))
    for kind, seed, outcome in odd[:400]:
        print(f"  --kind '{kind}' --seed {seed}: {outcome}")
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--problems", "--count", type=int, default=10_000)
    parser.add_argument("--kind", default="tubes", choices=("all", *KINDS))
    parser.add_argument("--seed", type=int, default=0, help="seed of the first; the next ones count up")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--resume", type=Path, help="file of results: what it has is not asked again")
    return 1 if summary(run(parser.parse_args())) else 0


if __name__ == "__main__":
    sys.exit(main())
