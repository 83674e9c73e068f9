"""Reports written as PDF or HTML."""

from __future__ import annotations

from collections.abc import Sequence

from minsnap.basics.storage.text import FileName
from minsnap.plot.figures import write_page
from minsnap.plot.pages import Part, check_page_name
from minsnap.plot.pdf_pages import write_pdf


def write_parts(path: FileName, title: str, parts: Sequence[Part], *, clobber: bool = True) -> None:
    """Write a page, as PDF or HTML by the ending of its name, in one atomic step."""
    if check_page_name(path) == ".pdf":
        write_pdf(path, title, parts, clobber=clobber)
    else:
        write_page(path, title, [part.html() for part in parts], clobber=clobber)
