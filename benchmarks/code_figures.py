"""Figures of the code: rooms, files, lines, lengths of functions, constants, parameters and checks of a type.

``python -m benchmarks.code_figures [FOLDER]`` prints those of a tree with ``minsnap/``, for docs/architecture.rst.
"""

import ast
import io
import sys
import tokenize
from collections import Counter
from pathlib import Path
from statistics import median, quantiles

SILENT = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENCODING,
    tokenize.ENDMARKER,
}
BLOCK = 6
"""Lines of a block that stands in two places."""


def python_code(text: str) -> list[str]:
    """Return the lines of a module that hold code, without comments, blank lines and docstrings."""
    held = {
        row
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
        if token.type not in SILENT
        for row in range(token.start[0], token.end[0] + 1)
    }
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            held -= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return [line.strip() for row, line in enumerate(text.splitlines(), 1) if row in held]


def c_code(text: str) -> list[str]:
    """Return the lines of a C++ file that are neither blank nor a comment alone."""
    lines = (line.strip() for line in text.splitlines())
    return [line for line in lines if line and not line.startswith(("//", "/*", "*"))]


def twice(files: list[list[str]]) -> int:
    """Return how many pairs of places share a block of equal lines, imports and lone brackets left out."""
    places: Counter[tuple[str, ...]] = Counter()
    for lines in files:
        told = [line for line in lines if len(line) > 3 and not line.startswith(("import ", "from "))]
        runs = {tuple(told[k : k + BLOCK]) for k in range(len(told) - BLOCK + 1)}
        places.update(runs)
    return sum(count * (count - 1) // 2 for count in places.values())


def figures(root: Path) -> dict[str, str]:
    """Return each figure by its name."""
    package = root / "minsnap"
    texts = {path: path.read_text(encoding="utf-8") for path in sorted(package.rglob("*.py"))}
    trees = [ast.parse(text) for text in texts.values()]
    nodes = [node for tree in trees for node in ast.walk(tree)]
    functions = [node for node in nodes if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
    code = {path: python_code(text) for path, text in texts.items()}
    rows = {path: len(lines) for path, lines in code.items()}
    native = [c_code(path.read_text(encoding="utf-8")) for kind in ("*.cpp", "*.hpp") for path in package.rglob(kind)]
    bodies = sorted(len(python_code(ast.unparse(ast.Module(node.body, [])))) for node in functions)
    longest = quantiles(bodies, n=20)[-1], bodies[-1]
    widest = max(functions, key=lambda node: len(node.args.args) + len(node.args.kwonlyargs))
    rooms = {path.relative_to(package).parts[0].removesuffix(".py") for path in texts} - {"__init__", "__main__"}
    constants = [
        node
        for tree in trees
        for node in tree.body
        if isinstance(node, ast.Assign)
        and isinstance(node.targets[0], ast.Name)
        and node.targets[0].id.isupper()
        and any(isinstance(part, ast.Constant) and type(part.value) in (int, float) for part in ast.walk(node.value))
    ]
    checks = [node for node in nodes if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "isinstance"]
    return {
        "rooms": f"{len(rooms)}",
        "files of Python": f"{len(texts)}",
        "lines of code, Python and C++": f"{sum(rows.values())} and {sum(map(len, native))}",
        "lines of code in a file, median and most": f"{median(rows.values()):.0f} and {max(rows.values())}",
        "lines of a body, median, 95 % and most": f"{median(bodies):.0f}, {longest[0]:.0f}, {longest[1]}",
        "constants of modules that are numbers": f"{len(constants)}",
        "widest function": f"{widest.name}, {len(widest.args.args) + len(widest.args.kwonlyargs)}",
        "isinstance checks": f"{len(checks)}",
        f"blocks of {BLOCK} equal lines that stand twice": f"{twice([*code.values(), *native])}",
    }


if __name__ == "__main__":
    for name, value in figures(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[1]).items():
        print(f"{name:55} {value}")
