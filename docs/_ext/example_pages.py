"""A page for each example, title, story, figure and code, and one that shows them all."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

FOLDER = Path(__file__).parents[2] / "examples"
"""Where the examples are; the docstring of each begins with ``Title: a sentence.`` or with its title alone."""


def story(script: Path) -> tuple[str, str]:
    """Return the title of an example and the text of its docstring, the title left out.

    The title is the first line up to a colon, or all of it. What is indented after a colon is a command.
    """
    text = ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or ""
    first, _, rest = text.partition("\n")
    title, _, sentence = first.partition(": ")
    if not title:
        raise ValueError(f"{script}: the docstring does not begin with a title")
    body = re.sub(r"(?<!:):\n\n(?= {4})", "::\n\n", rest)
    return title.rstrip("."), f"{sentence[:1].upper()}{sentence[1:]}\n{body}".strip()


def page(script: Path, figure: Path | None) -> str:
    """Return the page of an example."""
    title, text = story(script)
    picture = "" if figure is None else f".. image:: /images/{figure.name}\n   :alt: {title}\n\n"
    run = f"``python examples/{script.name}`` writes its files into ``out/``:\n\n"
    code = f".. literalinclude:: ../../examples/{script.name}\n   :language: python\n"
    return f"{title}\n{'=' * len(title)}\n\n{text}\n\n{picture}{run}{code}"


def card(script: Path, figure: Path | None) -> str:
    """Return an example's place on the page of all examples."""
    title, _ = story(script)
    image = "" if figure is None else f'<img src="_images/{figure.name}" alt="" loading="lazy">'
    return f'   <a class="example" href="examples/{script.stem}.html">{image}<span>{title}</span></a>\n'


def gallery(name: str, scripts: list[Path], figures: dict[Path, Path]) -> str:
    """Return a section with the cards of some examples."""
    cards = "".join(card(script, figures.get(script)) for script in scripts)
    return f'{name}\n{"-" * len(name)}\n\n.. raw:: html\n\n   <div class="examples">\n{cards}   </div>\n\n'


def write_pages(app: Sphinx) -> None:
    """Write the pages of all examples into ``docs/examples`` and ``docs/examples.rst``."""
    source = Path(app.srcdir)
    scripts = sorted(FOLDER.glob("*.py"))
    figures = {s: f for s in scripts if (f := source / "images" / f"{s.stem}.png").exists()}
    (source / "examples").mkdir(exist_ok=True)
    for script in scripts:
        write_page(source / "examples" / f"{script.stem}.rst", page(script, figures.get(script)))
    jobs = (FOLDER / "README.md").read_text(encoding="utf-8").split("## More")[0]
    first = sorted((script for script in scripts if script.name in jobs), key=lambda script: jobs.index(script.name))
    more = [script for script in scripts if script not in first]
    groups = {
        "Twelve jobs": first,
        "More": [script for script in more if script in figures],
        "Without a figure": [script for script in more if script not in figures],
    }
    listed = "".join(f"   examples/{script.stem}\n" for script in scripts)
    write_page(
        source / "examples.rst",
        "Examples\n========\n\nEach is one short story with a figure or a file.\n\n"
        + "".join(gallery(name, group, figures) for name, group in groups.items())
        + f".. toctree::\n   :hidden:\n\n{listed}",
    )


def write_page(path: Path, text: str) -> None:
    """Write a page unless it is the same, so that nothing is built again for nothing."""
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def setup(app: Sphinx) -> dict[str, Any]:
    """Write the pages before Sphinx looks for them."""
    app.connect("builder-inited", write_pages)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
