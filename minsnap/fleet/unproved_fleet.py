"""The error of a search without a fleet: what it reached, which pair presses, and what more or less would do."""

from __future__ import annotations

from dataclasses import replace

from minsnap.errors import UnprovedError
from minsnap.fleet.fleet_certificate import certify_fleet
from minsnap.fleet.fleet_task import FleetTask
from minsnap.fleet.time_search import FINE, FIRST, TimeSearch, TimeTried, flown

LONGER, NEARER = (1.25, 1.6, 2.0), (0.9, 0.75, 0.5)
"""Shares of the time, and of the separation, that are tried after a failed search, to say what would do."""


def unproved_fleet(search: TimeSearch, when: str, seed: int) -> UnprovedError:
    """Say what was reached in the longest time that was tried, which pair presses, and what more or less would do."""
    tried = search.nearest
    if tried is None:
        return UnprovedError("no fleet was found, as the search ended before it began: give a longer time_limit")
    task, flew = search.task, flown(tried.curves[: len(search.task)], tried.time)
    certificate = certify_fleet(flew, task.separation, avoid=task.avoid or None)
    text = f"no fleet was found that is apart at every instant{when}"
    if certificate.clearances is not None and certificate.clearances.min() < 0.0:
        vehicle = int(certificate.clearances.argmin())
        text += (
            f": in {tried.time:.4g} s vehicle {vehicle} was {-certificate.clearances[vehicle]:.3g} m inside an obstacle"
        )
    elif certificate.pair is not None and not certificate.ok:
        one, two = certificate.pair
        text += (
            f": in {tried.time:.4g} s vehicles {one} and {two} came as near as {certificate.least_distance:.3g} m at "
        )
        text += f"{certificate.instant:.4g} s, {certificate.nearest[0].share:.0%} of their separation"
    elif tried.outcome.over_by > 0.0:
        text += f": in {tried.time:.4g} s limits or walls were exceeded by {tried.outcome.over_by:.1%}"
    did = [] if search.stopped() else [*_longer(search, tried, seed), *_nearer(search, tried, seed)]
    advice = "give more time, more room, less separation, more pieces, or another seed"
    return UnprovedError(f"{text}; {' and '.join(did) + ': ' if did else ''}{advice}")


def _longer(search: TimeSearch, tried: TimeTried, seed: int) -> list[str]:
    """Return which time did, if one of a few longer ones does."""
    for more in LONGER:
        if _does(search, search.task, more * tried.time, seed):
            return [f"{more * tried.time:.4g} s did"]
    return []


def _nearer(search: TimeSearch, tried: TimeTried, seed: int) -> list[str]:
    """Return which share of the separation did in the same time, if one of a few does."""
    apart = search.task.separation
    for share in NEARER:
        if apart and _does(search, replace(search.task, separation=apart.scaled(share)), tried.time, seed):
            return [f"{share:.0%} of the separation did"]
    return []


def _does(search: TimeSearch, task: FleetTask, time: float, seed: int) -> bool:
    other = TimeSearch(task, search.pieces, search.threads, search.stopped)
    return other.attempt(other.search_of(FINE), other.opening(seed, 0, time), time, FIRST).certified is not None
