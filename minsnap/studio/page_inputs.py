"""Inputs of a page: values that browsers change, and that follow the document."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import Any, Protocol

import numpy as np

from minsnap.files import FileRequest

Change = Callable[[FileRequest], FileRequest]
"""Returns the document after an edit."""

ValueChange = Callable[[FileRequest, Any], FileRequest]
"""The same for the value of an input."""

Shown = Callable[[FileRequest], Any]
"""What an input shows of the document."""


class Viewed(Protocol):
    """A page that is looked at."""

    def frame(self) -> None:
        """See the whole scene."""

    def darken(self) -> None:
        """Make the page dark, or light again."""

    def attempt(self, act: Callable[[], None]) -> None:
        """Do something; what is refused is shown to the user."""


class Editor(Viewed, Protocol):
    """What the parts of a page edit with."""

    def edit(self, change: Change, subject: str = "", held: bool = False) -> None:
        """Edit the document; what is refused is shown to the user."""

    def pause(self) -> None:
        """End a drag."""

    def undo(self) -> None:
        """Take the last edit back."""

    def redo(self) -> None:
        """Do it again."""

    def later(self, act: Callable[[], None]) -> None:
        """Do something that takes long, without keeping the page waiting; what is refused is shown."""


def when_changed(handle: Any, act: Callable[[Any], None]) -> Any:
    """Call ``act`` with every value that a browser gives an input, or a group of buttons; return the input.

    Values that the program sets itself are not reported. The calls come from the event loop, in the order in which
    browsers sent them.
    """

    async def changed(event: Any) -> None:
        if event.client_id is not None:
            act(event.target.value)

    (handle.on_update if hasattr(handle, "on_update") else handle.on_click)(changed)
    return handle


def when_clicked(button: Any, act: Callable[[Any], None]) -> Any:
    """Call ``act`` with the browser's handle at every click of a button; return the button."""

    async def clicked(event: Any) -> None:
        if event.client is not None:
            act(event.client)

    button.on_click(clicked)
    return button


def when_dragged(
    handle: Any, editor: Editor, drag: Callable[[], None], hold: Callable[[bool], None] = lambda held: None
) -> None:
    """Call ``drag`` at every move of a handle in the scene, and ``hold`` when a hand takes it and lets it go."""

    async def moved(event: Any) -> None:
        if event.phase == "update":
            drag()
            return
        editor.pause()
        hold(event.phase == "start")

    handle.on_update(moved)


class DragHandles:
    """Handles of the scene that follow the document, but for those that a hand holds, and edit it.

    Drags end in the server's thread while plans are shown in others, one at a time under ``lock``. The end of a drag
    may not be told, such as that of a touch that is cancelled: an edit that moves the place otherwise ends it as well.

    Parameters
    ----------
    editor : Editor
        What drags edit.
    add : callable
        Adds the handle of a key at a place.
    edit : callable
        Returns what a key and the new place of its handle change, and the subject of that edit.
    """

    def __init__(
        self, editor: Editor, add: Callable[[Any, Any], Any], edit: Callable[[Any, Any], tuple[Change, str]]
    ) -> None:
        self._editor, self._add, self._edit = editor, add, edit
        self.lock = threading.RLock()
        self.handles: dict[Any, Any] = {}
        self._held: set[Any] = set()
        self._dragged: Any = None
        self._places: Mapping[Any, Any] = {}

    def show(self, places: Mapping[Any, Any]) -> None:
        """Have a handle for each key, at its place [m], and no others."""
        with self.lock:
            before, self._places = self._places, places
            for key in [key for key in self.handles if key not in places]:
                self.handles.pop(key).remove()
                self._held.discard(key)
            for key, place in places.items():
                if key != self._dragged and not np.array_equal(before.get(key, place), place):
                    self._held.discard(key)
                if key not in self.handles:
                    self.handles[key] = self._made(key, place)
                handle = self.handles[key]
                if key not in self._held and np.abs(np.asarray(handle.position) - place).max() > 1e-9:
                    handle.position = place

    def _made(self, key: Any, place: Any) -> Any:
        handle = self._add(key, place)

        def drag() -> None:
            change, subject = self._edit(key, tuple(float(value) for value in handle.position))
            self._dragged = key
            self._editor.edit(change, subject, held=True)
            self._dragged = None

        def hold(held: bool) -> None:
            with self.lock:
                (self._held.add if held else self._held.discard)(key)
                self.show(self._places)

        when_dragged(handle, self._editor, drag, hold)
        return handle


def when_triggered(command: Any, act: Callable[[], None]) -> None:
    """Call ``act`` when the key of a command is pressed."""

    async def triggered(event: Any) -> None:
        act()

    command.on_trigger(triggered)


def precise(handle: Any) -> Any:
    """Let a field of numbers take six decimals; return it. Viser takes those of its step: without any, 22.5 is 225."""
    if hasattr(handle, "precision"):
        handle.precision = 6
    return handle


SCRIPT = r"""<style onload="
if (!window.readNumber) {
  window.readNumber = ({target: field, data: typed}) => {
    if (field.inputMode !== 'decimal' || typed?.length === 1) return;
    const text = field.value.trim().replace(',', '.').replace('\u2212', '-'), at = field.selectionStart;
    const read = /^[-+]?\d*\.?\d*$/.test(text) ? text : field.defaultValue;
    if (read === field.value) return;
    Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value').set.call(field, read);
    field.setSelectionRange(at, at);
  };
  for (const kind of ['input', 'change']) window.addEventListener(kind, readNumber, true);
  let reached = null;
  window.addEventListener('focusin', ({target}) => reached = target.matches('button:focus-visible') ? target : null);
  window.addEventListener('keydown', (event) => {
    if (event.key === ' ' && event.target === reached) event.stopPropagation();
  }, true);
}
">
p:has(> label) { letter-spacing: normal !important; overflow-wrap: break-word !important }
label > wbr { display: none }
[role=tab] { padding-left: 0.6em !important; padding-right: 0.6em !important }
@media (pointer: coarse) { button, input:not([type=checkbox]) { min-height: 2.4em } }
@media (max-width: 36em) {
  [style*="max-height: 60%"] { max-height: 45% !important }
  [style*="max-height: 60%"], [style*="max-height: 60%"] > div, [style*="max-height: 60%"] [style*="width: 20em"] {
    width: 100% !important
  }
}
</style>"""
"""Lets a page read 12,5 as 12.5, and leave a field as it was, by its ``defaultValue``, where other text is put in; and
lets the space bar press a button that the keyboard has reached. Labels are set as other text is and break between
words; buttons are as high as a finger needs where fingers press them; the sheet of a phone leaves the scene its half.

Viser drops what it cannot use: 12,5 was 125, and 1e1 was 11. Its keys come before those of buttons.
"""


def follow(handle: Any, value: Any) -> None:
    """Give an input the value of the document; a slider is made longer if it has to be, for pages stop at its ends."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        low, high = getattr(handle, "min", None), getattr(handle, "max", None)
        if high is not None and value > high:
            handle.max = 2.0 * value
        if low is not None and 0.0 < value < low:
            handle.min = value
    if handle.value != value:
        handle.value = value


class Inputs:
    """Inputs that edit the document and follow it.

    Parameters
    ----------
    gui : viser.GuiApi
        Where they are added, in the present container.
    editor : Editor
        What they edit.
    """

    def __init__(self, gui: Any, editor: Editor) -> None:
        self.gui, self.editor = gui, editor
        self.request: FileRequest | None = None
        self._bound: list[tuple[Any, Shown]] = []

    def edits(self, handle: Any, change: ValueChange, subject: str = "") -> Any:
        """Let an input edit the document with every value that a browser gives it; return the input."""
        act = lambda value: self.editor.edit(lambda request: change(request, value), subject)  # noqa: E731
        return when_changed(precise(handle), act)

    def bind(self, handle: Any, shown: Shown, change: ValueChange, subject: str = "") -> Any:
        """Let an input edit the document, and show what ``shown`` returns of it, hidden where that is None."""
        self._bound.append((handle, shown))
        return self.edits(handle, change, subject)

    def show(self, request: FileRequest | None = None) -> None:
        """Give all inputs the values of the document; without one, those of the last one anew."""
        self.request = request = request or self.request
        if request is None:
            return
        for handle, shown in self._bound:
            value = shown(request)
            handle.visible = value is not None
            if value is not None:
                follow(handle, value)


class InputRows:
    """A folder with one row of inputs for each entry of the document, hidden where there is none.

    Parameters
    ----------
    folder : viser.GuiFolderHandle
    add : callable
        Adds the row of an index and returns its handles; the first follows the entry.
    """

    def __init__(self, folder: Any, add: Callable[[int], tuple[Any, ...]]) -> None:
        self.folder, self._add = folder, add
        self.handles: list[tuple[Any, ...]] = []

    def show(self, values: Sequence[Any]) -> None:
        """Show as many rows as there are values, with these values."""
        self.folder.visible = bool(values)
        while len(self.handles) > len(values):
            for handle in self.handles.pop():
                handle.remove()
        with self.folder:
            while len(self.handles) < len(values):
                self.handles.append(self._add(len(self.handles)))
        for (handle, *_), value in zip(self.handles, values, strict=True):
            follow(handle, value)


def sentence(text: str, kind: str = "note") -> str:
    """Return text as HTML in which nothing is evaluated: in red for ``"refusal"``, grey for ``"note"``."""
    colour = {"refusal": "#c92a2a", "good": "#2b8a3e"}.get(kind, "#868e96")
    style = f"color:{colour};font-size:0.85em;padding:0 0.8em 0.3em;overflow-wrap:anywhere"
    return f'<div style="{style}">{escape(text)}</div>'


def table(rows: Sequence[tuple[str, str]]) -> str:
    """Return names and values as an HTML table."""
    cells = "".join(
        f'<tr><td style="color:#868e96;padding-right:0.6em">{escape(name)}</td><td>{escape(value)}</td></tr>'
        for name, value in rows
    )
    return f'<table style="font-size:0.85em;margin:0 0.5em;font-variant-numeric:tabular-nums">{cells}</table>'


def copyable(text: str) -> str:
    """Return text as HTML that copies itself as it is shown, and says whether it could."""
    copy = (
        "const text = this.nextElementSibling, said = text.nextElementSibling;"
        "navigator.clipboard?.writeText(text.textContent).then(() => said.textContent = 'copied');"
    )
    style = "white-space:pre-wrap;user-select:all;font-size:0.8em;max-height:20em;overflow:auto"
    told = '<div style="font-size:0.85em;color:#868e96">a click selects all of it, to copy</div>'
    return f'<style onload="{copy}"></style><pre style="{style}">{escape(text)}</pre>{told}'
