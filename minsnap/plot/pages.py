"""Parts of a page to print, which are written as HTML or as PDF: verdict, tables, notes, figures, a line to sign."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape

from minsnap.basics.storage.text import FileName
from minsnap.errors import FileError
from minsnap.plot.figures import picture, table, verdict
from minsnap.plot.style import Figure

SHORT = 14
"""Rows of a table that stays on one page."""


@dataclass(frozen=True)
class Verdict:
    """Whether all is well, or that something is beyond its limit (None), with what is found."""

    good: bool | None
    title: str
    words: str
    beyond: Sequence[str] = ()

    def html(self) -> str:
        """Return it as HTML."""
        more = "".join(f"<br><b>{escape(sentence)}.</b>" for sentence in self.beyond)
        return verdict(self.good, f"<b>{escape(self.title)}.</b> {escape(self.words)}{more}")


@dataclass(frozen=True)
class Table:
    """Texts in rows under a heading, the columns with names or without."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    hashes: bool = False

    def html(self) -> str:
        """Return it as HTML; nothing without rows. Heading and head stay with the rows."""
        kind = "whole" if len(self.rows) <= SHORT else "long"
        text = table(self.title, self.columns, self.rows)
        return f'<section class="{kind}{" hash" if self.hashes else ""}">{text}</section>' if text else ""


@dataclass(frozen=True)
class Note:
    """A paragraph."""

    text: str

    def html(self) -> str:
        """Return it as HTML."""
        return f"<p>{escape(self.text)}</p>"


@dataclass(frozen=True)
class Drawing:
    """A figure."""

    figure: Figure = field(repr=False)

    def html(self) -> str:
        """Return it as HTML."""
        return picture(self.figure)


@dataclass(frozen=True)
class Signature:
    """A line to sign."""

    def html(self) -> str:
        """Return it as HTML."""
        lines = ("Name ________________________", "Date ______________", "Signature ________________________")
        return f'<table class="sign"><tr>{"".join(f"<td>{line}</td>" for line in lines)}</tr></table>'


Part = Verdict | Table | Note | Drawing | Signature

ENDINGS = (".html", ".htm", ".pdf")
"""Of pages."""


def check_page_name(path: FileName) -> str:
    """Return the ending of a page's name in lower case, or raise FileError if it is not supported."""
    from pathlib import Path

    suffix = Path(path).suffix.lower()
    if suffix not in ENDINGS:
        raise FileError(f"{path} does not end in .html or .pdf: a report is written as one of these")
    return suffix
