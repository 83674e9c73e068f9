"""A page of the names that programs on the library use, room by room, each with its first sentence."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from example_pages import write_page
from sphinx.application import Sphinx

import minsnap

PACKAGE = Path(minsnap.__file__).parent

HEAD = """Programs on the library
=======================

The figures, the shows, the flights, the datasets, the studio and the commands of minsnap are programs on its library.
They import only what a user can import too: the names below, and those of :doc:`api`. A test holds it. Each name is
imported from its room, as in ``from minsnap.files import read_any``. :doc:`upgrading` says how a name goes.
"""


def exported(stub: Path) -> Iterator[tuple[str, Path]]:
    """Yield the names of a stub in their order, each with the module or package that defines it."""
    for node in ast.parse(stub.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom):
            home = stub.parent.joinpath(*(node.module or "").split("."))
            for alias in node.names:
                inner = home if node.module else home / alias.name
                if not inner.is_dir():
                    yield alias.name, inner.with_suffix(".py")
                elif node.module:
                    yield alias.name, dict(exported(inner / "__init__.pyi"))[alias.name]
                else:
                    yield alias.name, inner / "__init__.py"


def sentence(name: str, module: Path) -> str:
    """Return the first paragraph that a module says of one of its names, or of itself; nothing where it says none."""
    tree = ast.parse(module.read_text(encoding="utf-8"))
    if name in (module.stem, module.parent.name):
        return _first(ast.get_docstring(tree) or "")
    for node, after in zip(tree.body, [*tree.body[1:], None], strict=True):
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == name:
            return _first(ast.get_docstring(node) or "")
        if name in _bound(node) and isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
            return _first(str(after.value.value))
        if isinstance(node, ast.ImportFrom) and name in [alias.asname for alias in node.names]:
            return sentence(name, PACKAGE.parent.joinpath(*str(node.module).split(".")).with_suffix(".py"))
    return ""


def _bound(node: ast.stmt) -> set[str]:
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    return {part.id for target in targets for part in ast.walk(target) if isinstance(part, ast.Name)}


def _first(text: str) -> str:
    return " ".join(re.sub(r":[a-z:]+:", "", text.split("\n\n")[0]).split())


def rooms() -> dict[str, Path]:
    """Return the packages that have a stub, by name."""
    stubs = sorted(PACKAGE.glob("*/**/__init__.pyi"))
    return {".".join(stub.parent.relative_to(PACKAGE).parts): stub for stub in stubs}


def section(room: str, stub: Path) -> str:
    """Return what the page says of a room."""
    title = f"minsnap.{room}"
    rows = "".join(f"   * - ``{name}``\n     - {sentence(name, module)}\n" for name, module in exported(stub))
    table = f".. list-table::\n   :widths: 28 72\n\n{rows}"
    return f"{title}\n{'-' * len(title)}\n\n{table}\n"


def write_rooms(app: Sphinx) -> None:
    """Write ``docs/rooms.rst``."""
    contents = "\n.. contents::\n   :local:\n   :depth: 1\n\n"
    text = HEAD + contents + "\n".join(section(room, stub) for room, stub in rooms().items())
    write_page(Path(app.srcdir) / "rooms.rst", text)


def setup(app: Sphinx) -> dict[str, Any]:
    """Write the page before Sphinx looks for it."""
    app.connect("builder-inited", write_rooms)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
