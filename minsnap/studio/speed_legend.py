"""The scale of speeds beside the scene."""

from __future__ import annotations

from typing import Any

from minsnap.studio.plan_drawing import SPEED_SCALE


class SpeedLegend:
    """A bar of the colours of the path, from rest to the greatest speed.

    Parameters
    ----------
    gui : viser.GuiApi
        Where it is added, in the present container.
    """

    def __init__(self, gui: Any) -> None:
        self._bar = gui.add_html(legend(0.0))

    def show(self, top: float) -> None:
        """Show the greatest speed [m/s]."""
        self._bar.content = legend(top)


def legend(top: float) -> str:
    """Return the bar with its numbers as HTML; ``top`` is the greatest speed [m/s]."""
    stops = ",".join(f"rgb({','.join(str(int(c)) for c in colour)})" for colour in SPEED_SCALE)
    numbers = "".join(f"<span>{share * top:.2f}</span>" for share in (0.0, 0.5, 1.0))
    bar = f'<div style="height:10px;border-radius:3px;background:linear-gradient(to right,{stops})"></div>'
    row = f'<div style="display:flex;justify-content:space-between;font-size:0.8em">{numbers}</div>'
    return f'<div style="padding:0.3em 0.8em"><span style="font-size:0.85em">speed [m/s]</span>{bar}{row}</div>'
