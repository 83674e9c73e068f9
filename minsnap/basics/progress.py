"""A line with a bar on standard error while something takes long."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from inspect import Parameter, signature
from time import monotonic
from typing import TYPE_CHECKING, Any, TextIO, TypeVar

from minsnap.basics.messages import shown
from minsnap.errors import InputError

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress

Callback = TypeVar("Callback", bound=Callable[..., None])
Step = TypeVar("Step")

DELAY, INTERVAL = 0.5, 0.2
"""Time before the first line, so that what is quick shows none, and least time between two [s]."""


def rewritable(stream: TextIO) -> bool:
    """Whether a line can be rewritten in place: on a terminal, unless it is a dumb one."""
    return stream.isatty() and os.environ.get("TERM") not in ("dumb", "unknown")


class ProgressLine:
    """A line with a label, a bar and a text, rewritten in place.

    Parameters
    ----------
    label : str
        What is done.
    """

    def __init__(self, label: str) -> None:
        self._label, self._due = label, monotonic() + DELAY
        self._drawn: RichProgress | None = None

    def show(self, share: float | None, text: str = "") -> None:
        """Show the share that is done, 0 to 1 (None: nobody knows), unless another was shown very recently."""
        if monotonic() < self._due:
            return
        self._due = monotonic() + INTERVAL
        if self._drawn is None:
            self._drawn = _begin(self._label)
        self._drawn.update(self._drawn.task_ids[0], total=None if share is None else 1.0, completed=share, text=text)
        self._drawn.refresh()

    def clear(self) -> None:
        """Remove the line."""
        if self._drawn is not None:
            self._drawn.stop()


def _begin(label: str) -> RichProgress:
    """Draw the line; rich is imported only here, since that takes longer than a short command."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    # Not as a widget in notebooks, which would need another package.
    console = Console(stderr=True, force_terminal=True, force_jupyter=False)
    columns = TextColumn("{task.description}"), BarColumn(24), TextColumn("{task.fields[text]}", markup=False)
    kept: dict[str, Any] = {"redirect_stdout": False, "redirect_stderr": False}
    drawn = Progress(*columns, console=console, auto_refresh=False, transient=True, **kept)
    drawn.start()
    drawn.add_task(label, text="")
    return drawn


def of_steps(
    progress: Callable[[Step], None] | bool | None, step: Callable[..., Step], called: str
) -> Callable[..., None] | bool | None:
    """Return what is to be called with the values of a step, from what is called with a step.

    A function of as many values is called with them for one version more, with a warning.
    """
    if progress is None or isinstance(progress, bool) or not callable(progress):
        return progress
    if _values_of(progress) > 1:
        from minsnap.basics.warn import warn_deprecated

        warn_deprecated(f"{called}(progress=) with a function of several numbers", "a function of one step", "0.3")
        return progress
    return lambda *values: progress(step(*values))


def _values_of(called: Callable[..., None]) -> int:
    """Return how many values a function has to be called with; one where that is not known."""
    try:
        parameters = signature(called).parameters.values()
    except (TypeError, ValueError):
        return 1
    needed = (Parameter.POSITIONAL_ONLY, Parameter.POSITIONAL_OR_KEYWORD)
    return sum(one.kind in needed and one.default is Parameter.empty for one in parameters)


@contextmanager
def progress_line(
    progress: Callback | bool | None, label: str, callback: Callable[[ProgressLine], Callback]
) -> Iterator[Callback | None]:
    """Yield what is to be called with the progress: for True what shows it in a line, which is removed at the end."""
    if not isinstance(progress, bool):
        if progress is not None and not callable(progress):
            raise InputError(f"progress is {shown(progress)}: give True, or what is called with every step")
        yield progress
        return
    line = ProgressLine(label)
    try:
        yield callback(line) if progress else None
    finally:
        line.clear()
