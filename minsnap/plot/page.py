"""Printable pages: one HTML file with a verdict, tables and figures inside."""

from __future__ import annotations

import io
import os
from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

from minsnap.basics.storage.atomic import atomic_write

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLE = """
body { font: 10pt/1.35 sans-serif; max-width: 190mm; margin: 8mm auto; color: #111; }
h1 { font-size: 16pt; margin: 0 0 2mm; } h2 { font-size: 12pt; margin: 5mm 0 1mm; border-bottom: 1px solid #999; }
.holds { background: #e3f4e3; border-left: 2mm solid #2a7d2a; padding: 2mm 3mm; }
.fails { background: #fbe3e3; border-left: 2mm solid #b00020; padding: 2mm 3mm; }
table { border-collapse: collapse; width: 100%; font-size: 9pt; page-break-inside: auto; }
tr { page-break-inside: avoid; } th, td { text-align: right; padding: 0.5mm 2mm; border-bottom: 1px solid #ddd; }
th:first-child, td:first-child { text-align: left; } td.hash { font: 7.5pt monospace; }
svg { width: 100%; height: auto; } .sign td { border: 0; padding-top: 12mm; text-align: left; }
@page { size: A4; margin: 12mm; }
"""


def write_page(path: str | os.PathLike[str], title: str, parts: Sequence[str], *, clobber: bool = True) -> None:
    """Write a page of HTML parts under a title, in one atomic step."""
    head = f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{escape(title)}</title>'
    with atomic_write(path, clobber=clobber) as file:
        file.write(f"{head}<style>{STYLE}</style><h1>{escape(title)}</h1>{''.join(parts)}</html>\n")


def verdict(good: bool, html: str) -> str:
    """Return the paragraph that says whether all is well."""
    return f'<p class="{"holds" if good else "fails"}">{html}</p>'


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table of texts under a heading; nothing without rows."""
    if not rows:
        return ""
    head = "".join(f"<th>{escape(name)}</th>" for name in columns) if any(columns) else ""
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<h2>{escape(title)}</h2><table>{f'<tr>{head}</tr>' if head else ''}{body}</table>"


def picture(figure: Figure) -> str:
    """Return a figure as SVG."""
    stream = io.StringIO()
    figure.savefig(stream, format="svg")
    drawn = stream.getvalue()
    return drawn[drawn.index("<svg") :]
