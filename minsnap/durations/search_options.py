"""How durations are searched for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from minsnap.basics.arrays import set_fields
from minsnap.basics.checks import check_positive, check_words
from minsnap.basics.messages import explains_names, shown
from minsnap.errors import InputError, TimingError

WORDS = {
    "split": ("optimal", "distance"),
    "on_interrupt": ("raise", "return"),
}
"""The words that an option can have."""

ENFORCE = "nothing in its place, since limits hold at every instant, or split='distance' to scale time alone"
"""What was how limits are kept."""


@explains_names({"enforce": ENFORCE})
@dataclass(frozen=True)
class Search:
    """How durations are searched for, where a plan chooses them.

    Parameters
    ----------
    split : {"optimal", "distance"}
        How the time is divided among the legs: for the least cost (with limits alone: for the least time), or in
        proportion to their lengths (with limits alone: a plan without them, flown as fast as they allow). Only
        ``"optimal"`` goes with given durations and with ``time_weight``.
    time_weight : float, optional
        Minimise cost + time_weight * time over the durations (Richter et al. 2013), instead of fixing a total.
    time_limit : float, optional
        Seconds after which planning ends: for given durations with a certified plan that may cost more than the least
        or with a SolverError (checked after every round of the exchange); for the shortest time within limits with
        the best certified plan found so far. It ends the search for a proof of a refusal too. Without it the work is
        counted, and ends after some two seconds for up to five legs. Not with a total time or ``time_weight`` alone.
    on_interrupt : {"raise", "return"}
        What Ctrl-C does during a search: raise KeyboardInterrupt, or end it with the best plan found so far, certified
        like any other (``report.interrupted`` says so).

    Raises
    ------
    TimingError
        If a word is not one of these, or a number is not positive.
    """

    split: str = "optimal"
    time_weight: float | None = None
    time_limit: float | None = None
    on_interrupt: str = "raise"

    def __post_init__(self) -> None:
        check_words(split=self.split, on_interrupt=self.on_interrupt)
        for name, allowed in WORDS.items():
            value = getattr(self, name)
            if value is not None and not (isinstance(value, str) and value in allowed):
                *others, last = map(repr, allowed)
                raise TimingError(f"{name} is {shown(value)}: use {', '.join(others)} or {last}")
        for name, unit in (("time_weight", "cost per second"), ("time_limit", "s")):
            if getattr(self, name) is not None:
                set_fields(self, **{name: check_positive(name, getattr(self, name), unit, TimingError)})


USUAL = Search()
"""The search by default."""


def check_search(search: object) -> Search:
    """Return how to search; raise InputError if it is no ``Search``."""
    if search is None:
        return USUAL
    if not isinstance(search, Search):
        raise InputError(f"search must be a Search, such as Search(split='distance'), not {type(search).__name__}")
    return search


def is_priced(options: Mapping[str, object]) -> bool:
    """Whether the search among arguments of ``plan`` has a price of time."""
    search = options.get("search")
    return isinstance(search, Search) and search.time_weight is not None
