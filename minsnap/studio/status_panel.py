"""The top of the panel, always visible: what the plan is, its certificate, what cannot be done, undo and redo."""

from __future__ import annotations

from math import degrees
from typing import Any

from minsnap.basics.limit_kinds import KIND
from minsnap.certificate import Certificate
from minsnap.studio.page_inputs import Editor, sentence, table
from minsnap.studio.workbench import BenchState

SEARCHING = "searching a better plan; the last good one is shown"


class StatusPanel:
    """Facts of the plan.

    Parameters
    ----------
    gui : viser.GuiApi
        Where it is added, in the present container.
    editor : Editor
        What undo and redo act on.
    """

    def __init__(self, gui: Any, editor: Editor) -> None:
        self._facts = gui.add_html("")
        self._told = gui.add_html(sentence(SEARCHING))
        self._message = gui.add_html("", visible=False)
        buttons = gui.add_button_group("Edits", ("Undo", "Redo"))

        async def act(event: Any) -> None:
            if event.client_id is not None:
                editor.attempt(editor.undo if event.target.value == "Undo" else editor.redo)

        buttons.on_click(act)

    def show(self, state: BenchState) -> None:
        """Show what holds of the plan, and what cannot be done."""
        if state.planned is not None:
            self._facts.content = table(facts(state))
        self._told.content = told(state)

    def say(self, text: str, kind: str = "refusal") -> None:
        """Show a sentence about the last request; nothing where it is empty."""
        self._message.content = sentence(text, kind)
        self._message.visible = bool(text)


def told(state: BenchState) -> str:
    """Return the line below the facts, as HTML: refusal, search, or that all holds."""
    if state.refusal:
        stays = " The last good plan is shown." if state.planned is not None else ""
        return sentence(f"{state.refusal[:1].upper()}{state.refusal[1:]}.{stays}", "refusal")
    if state.searching or state.planned is None:
        return sentence(SEARCHING)
    if state.planned.certificate.ok:
        return sentence(f"certified at every instant, planned in {state.planned.milliseconds:.0f} ms", "good")
    return sentence("the certificate does not hold: see its figures", "refusal")


def facts(state: BenchState) -> list[tuple[str, str]]:
    """Return names and values of the plan that is shown: time, cost, and the figures of its certificate."""
    assert state.planned is not None
    curve, holds = state.planned.trajectory, state.planned.certificate
    margin = "no corridor" if holds.corridor_margin is None else f"{holds.corridor_margin:.3g} m inside"
    return [
        ("duration", f"{curve.duration:.3f} s"),
        ("cost", f"{curve.cost():.6g} m²/s{_raised(2 * curve.cost_order - 1)}"),
        ("corridor margin", margin),
        ("greatest speed", f"{holds.max_speed:.3f} m/s"),
        ("greatest acceleration", f"{holds.max_acceleration:.3f} m/s²"),
        ("greatest jerk", f"{holds.max_jerk:.3f} m/s³"),
        *_uses(holds),
    ]


def _uses(holds: Certificate) -> list[tuple[str, str]]:
    """Return how far each limit is used."""
    rows = []
    for used in holds.utilisation:
        scale, unit = (degrees(1.0), "°") if KIND[used.name].degrees else (1.0, f" {KIND[used.name].unit}")
        shares = f"{100.0 * used.fraction:.1f} % of {scale * used.limit:.3g}{unit}"
        rows.append((KIND[used.name].label, f"{shares}, on leg {used.leg}"))
    return rows


def _raised(number: int) -> str:
    return str(number).translate(str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹"))
