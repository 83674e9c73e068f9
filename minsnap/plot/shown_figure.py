"""A figure that a notebook shows by itself, without pyplot; imports matplotlib, so import it where a figure is made."""

from __future__ import annotations

from io import BytesIO

from matplotlib.figure import Figure

NOTEBOOK_DPI = 144
"""Twice as fine as a notebook's page, for screens of two pixels a point."""


class ShownFigure(Figure):
    """A matplotlib figure that no window shows and that a notebook draws as PNG where it is the value of a cell."""

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """Return the figure as PNG, with the size at which a page shows it [px]."""
        file = BytesIO()
        self.savefig(file, format="png", dpi=NOTEBOOK_DPI)
        width, height = (round(72.0 * inches) for inches in self.get_size_inches())
        return file.getvalue(), {"width": width, "height": height}
