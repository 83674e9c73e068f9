"""Pages to print as PDF, A4 upright, drawn by matplotlib: parts from above to below, heads of tables on every page."""

from __future__ import annotations

import io
from collections.abc import Sequence
from functools import cache
from typing import Any

from minsnap.basics.storage.atomic import write_file
from minsnap.basics.storage.text import FileName
from minsnap.plot.pages import SHORT, Drawing, Note, Part, Signature, Table, Verdict

PAPER, MARGIN = (8.27, 11.69), 0.6
"""Width and height of a page, and what is left free around it [in]."""

SIZE, LINE = 7.5, 0.155
"""Size of letters [pt], and height of a line [in]."""

GAP = 0.14
"""Between columns, and between parts [in]."""

KEPT = 3
"""Rows of a long table that stay with its head, at least."""

FINE = 220
"""Pixels an inch of figures."""

COLOURS = {True: "#e3f3e3", None: "#fdf1d0", False: "#f9dcdc"}
"""Behind the verdict."""


def write_pdf(path: FileName, title: str, parts: Sequence[Part], *, clobber: bool = True) -> None:
    """Write parts on pages under a title, in one atomic step."""
    from matplotlib.backends.backend_pdf import PdfPages

    book = _Book(title)
    for part in parts:
        book.put(part)
    stream = io.BytesIO()
    with PdfPages(stream, metadata={"CreationDate": None, "Title": title}) as pages:
        for number, page in enumerate(book.pages, 1):
            page.text(0.5, 0.35 / PAPER[1], f"{title}, page {number} of {len(book.pages)}", size=SIZE, ha="center")
            pages.savefig(page)
    write_file(path, stream.getvalue(), clobber=clobber)


class _Book:
    """Pages, and how far the last one is filled."""

    def __init__(self, title: str) -> None:
        self.pages: list[Any] = []
        self._turn()
        self._text(title, size=14.0, weight="bold")
        self._down(0.35)

    def put(self, part: Part) -> None:
        """Put a part below what is there, on another page where it does not fit."""
        if isinstance(part, Table):
            self._table(part)
        elif isinstance(part, Verdict):
            self._verdict(part)
        elif isinstance(part, Drawing):
            self._drawing(part)
        elif isinstance(part, Note):
            self._lines(part.text)
        elif isinstance(part, Signature):
            self._room(0.9)
            self._down(0.6)
            self._text("Name ________________________     Date ______________     Signature ________________________")
            self._down(LINE)

    def _turn(self) -> None:
        from matplotlib.figure import Figure

        self.pages.append(Figure(figsize=PAPER))
        self._top = PAPER[1] - MARGIN

    def _down(self, height: float) -> None:
        self._top -= height

    def _room(self, height: float) -> None:
        """Turn the page where less than a height is left of it [in]."""
        if self._top - height < MARGIN and self._top < PAPER[1] - MARGIN:
            self._turn()

    def _text(self, text: str, left: float = 0.0, **how: Any) -> None:
        x, y = (MARGIN + left) / PAPER[0], (self._top - 0.75 * LINE) / PAPER[1]
        self.pages[-1].text(x, y, text, **{"size": SIZE, "parse_math": False, **how})

    def _lines(self, text: str, **how: Any) -> None:
        for line in _wrapped(text, PAPER[0] - 2.0 * MARGIN):
            self._room(LINE)
            self._text(line, **how)
            self._down(LINE)
        self._down(GAP)

    def _verdict(self, part: Verdict) -> None:
        from matplotlib.patches import Rectangle

        wide = PAPER[0] - 2.0 * MARGIN - 2.0 * GAP
        said = _wrapped(part.words, wide)
        bold = [line for sentence in part.beyond for line in _wrapped(f"{sentence}.", 0.92 * wide)]
        height = LINE * (1.4 + len(said) + len(bold)) + 2.0 * GAP
        self._room(height)
        corner = (MARGIN / PAPER[0], (self._top - height) / PAPER[1])
        size = ((wide + 2.0 * GAP) / PAPER[0], height / PAPER[1])
        self.pages[-1].add_artist(
            Rectangle(corner, *size, facecolor=COLOURS[part.good], edgecolor="0.6", linewidth=0.5)
        )
        self._down(GAP)
        self._text(part.title, GAP, weight="bold", size=10.0)
        self._down(1.4 * LINE)
        for line, weight in [*((line, "normal") for line in said), *((line, "bold") for line in bold)]:
            self._text(line, GAP, weight=weight)
            self._down(LINE)
        self._down(2.0 * GAP)

    def _drawing(self, part: Drawing) -> None:
        from matplotlib.image import imread

        wide, high = part.figure.get_size_inches()
        room = PAPER[0] - 2.0 * MARGIN
        share = min(1.0, room / wide)
        stream = io.BytesIO()
        part.figure.savefig(stream, format="png", dpi=FINE * share)
        stream.seek(0)
        self._room(share * high)
        left, low = MARGIN / PAPER[0], (self._top - share * high) / PAPER[1]
        axes = self.pages[-1].add_axes((left, low, share * wide / PAPER[0], share * high / PAPER[1]))
        axes.imshow(imread(stream), aspect="auto", interpolation="none")
        axes.set_axis_off()
        self._down(share * high + GAP)

    def _table(self, part: Table) -> None:
        if not part.rows:
            return
        size = min(SIZE, SIZE * (PAPER[0] - 2.0 * MARGIN) / self._width(part))
        lefts = _lefts(part, size)
        kept = len(part.rows) if len(part.rows) <= SHORT else KEPT
        self._room(LINE * (1.5 + any(part.columns) + kept))
        self._text(part.title, weight="bold", size=9.5)
        self._down(1.5 * LINE)
        self._head(part, lefts, size)
        for row in part.rows:
            if self._top - LINE < MARGIN:
                self._turn()
                self._text(f"{part.title}, continued", weight="bold", size=9.5)
                self._down(1.5 * LINE)
                self._head(part, lefts, size)
            for left, cell in zip(lefts, row, strict=True):
                self._text(cell, left, size=size)
            self._down(LINE)
        self._down(GAP)

    def _width(self, part: Table) -> float:
        return _lefts(part, SIZE, end=True)[-1]

    def _head(self, part: Table, lefts: Sequence[float], size: float) -> None:
        from matplotlib.lines import Line2D

        if not any(part.columns):
            return
        for left, name in zip(lefts, part.columns, strict=True):
            self._text(name, left, size=size, weight="bold")
        self._down(LINE)
        y = (self._top + 0.005) / PAPER[1]
        ends = (MARGIN / PAPER[0], 1.0 - MARGIN / PAPER[0])
        self.pages[-1].add_artist(Line2D(ends, (y, y), color="0.6", linewidth=0.5))


def _lefts(part: Table, size: float, *, end: bool = False) -> list[float]:
    """Return where columns begin [in], with the end of the last one if asked."""
    columns = list(zip(*part.rows, strict=True))
    heads = [1.12 * _width_of(name, size) for name in part.columns]
    widths = [
        max(head, *(_width_of(cell, size) for cell in column)) for head, column in zip(heads, columns, strict=True)
    ]
    lefts = [0.0]
    for width in widths:
        lefts.append(lefts[-1] + width + GAP)
    return lefts if end else lefts[:-1]


def _wrapped(text: str, wide: float) -> list[str]:
    """Return the lines of a text that are not wider than that [in]."""
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and _width_of(longer, SIZE) > wide:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines


def _width_of(text: str, size: float) -> float:
    """Return the width of a text [in]."""
    return sum(map(_advance, text)) * size / 72.0


@cache
def _advance(letter: str) -> float:
    """Return the width of a letter, for its size."""
    from matplotlib.font_manager import FontProperties, findfont
    from matplotlib.ft2font import FT2Font

    font = FT2Font(findfont(FontProperties()))
    font.set_size(100.0, 72)
    return float(font.load_char(ord(letter)).linearHoriAdvance) / 65536.0 / 100.0
