"""Numeric constants of the core: each is in the documentation."""

import ast
import re
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "minsnap"
PAGE = PACKAGE.parent / "docs" / "constants.rst"
FOLDERS = ("polynomials/*.py", "corridors/*.py", "optimisation/*.py", "refusals/*.py")
CORE = ("basics/tolerances.py", "certificate.py", *FOLDERS)
APART = ("grid_", "given_", "occupancy_")
"""Modules that read what users give: maps and waypoints."""


def is_number(node):
    """Whether an expression is made of numbers and names alone, with at least one number."""
    kinds = (ast.Constant, ast.BinOp, ast.UnaryOp, ast.Name, ast.operator, ast.unaryop, ast.expr_context)
    parts = list(ast.walk(node))
    return all(isinstance(part, kinds) for part in parts) and any(
        isinstance(part, ast.Constant) and isinstance(part.value, int | float) for part in parts
    )


def constants(path):
    """Names in capitals to which a module gives a number."""
    for node in ast.parse(path.read_text()).body:
        if not isinstance(node, ast.Assign):
            continue
        target, value = node.targets[0], node.value
        several = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
        for name, given in zip(target.elts, value.elts, strict=True) if several else [(target, value)]:
            if isinstance(name, ast.Name) and name.id.isupper() and is_number(given):
                yield f"{path.stem}.{name.id}"


def test_the_documentation_has_every_numeric_constant_of_the_core():
    paths = [path for pattern in CORE for path in PACKAGE.glob(pattern) if not path.name.startswith(APART)]
    found = {name for path in paths for name in constants(path)}
    assert {"tolerances.GAP", "tolerances.EXACT", "reference_core.ROUNDS"} <= found
    assert found == set(re.findall(r"``(\w+\.[A-Z_]+)``", PAGE.read_text()))
