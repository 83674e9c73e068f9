"""The rooms of docs/architecture.rst: every import goes to a room above, and names are not used twice."""

import ast
import importlib
import re
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import library_alone
import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "minsnap"
FIRST_APPLICATION = "plot"
"""The first room of the table that is an application, as all below are."""

TABLE = ".. the order of imports\n\n::\n\n"


def table() -> list[str]:
    """Return the rooms in their order: the first word of every line of the table in docs/architecture.rst."""
    text = (ROOT / "docs" / "architecture.rst").read_text()
    lines = text[text.index(TABLE) + len(TABLE) :].split("\n\n", 1)[0].splitlines()
    return [line.split()[0] for line in lines if not line.startswith(10 * " ")]


def modules(package: Path) -> dict[str, Path]:
    """Return the modules of a package by name; a folder's name stands for its ``__init__``."""
    found = {}
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package.parent).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imported(path: Path, known: dict[str, Path]) -> set[str]:
    """Return the modules of the package that a file imports, for types and inside functions too."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            assert not node.level, f"{path}: relative import"
            found |= {f"{node.module}.{alias.name}" for alias in node.names} | {str(node.module)}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    found &= set(known)
    return {name for name in found if not any(other.startswith(f"{name}.") for other in found)}


def room_of(module: str) -> str:
    """Return the room of a module: the second part of its name, nothing for the package itself."""
    return module.split(".")[1] if "." in module else ""


def arrows_back(package: Path, order: list[str]) -> set[tuple[str, str]]:
    """Return the imports that go to a room below, or to the package itself."""
    known, place = modules(package), {room: index for index, room in enumerate(order)}
    pairs = {(name, target) for name, path in known.items() if "." in name for target in imported(path, known)}
    return {
        (name, target)
        for name, target in pairs
        if not room_of(target) or place[room_of(target)] > place.get(room_of(name), len(order))
    }


def inner_names(package: Path, applications: list[str]) -> set[tuple[str, str]]:
    """Return what applications import of rooms that are none, besides the names of these rooms' stubs.

    Every name is one that a user can import: ``from minsnap.files import read_any``, not from a module of the room.
    """
    found = set()
    for module, path in modules(package).items():
        if room_of(module) in applications:
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.ImportFrom) and room_of(f"{node.module}.") not in ("", *applications):
                    found |= {(module, f"{node.module}.{alias.name}") for alias in node.names}
                elif isinstance(node, ast.Import):
                    found |= {(module, alias.name) for alias in node.names if alias.name.startswith(f"{package.name}.")}
    public = {
        ".".join((*stub.parent.relative_to(package.parent).parts, name))
        for stub in package.rglob("__init__.pyi")
        for name in re.findall(r" as (\w+)$", stub.read_text(), flags=re.MULTILINE)
    }
    mine = {(module, name) for module, name in found if name.startswith(f"{package.name}.")}
    return {(module, name) for module, name in mine if name not in public}


def circle(package: Path) -> list[str]:
    """Return modules that import each other in a circle, or nothing."""
    known = modules(package)
    try:
        TopologicalSorter({name: imported(path, known) for name, path in known.items()}).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def names_used_twice(names: list[tuple[str, str]]) -> dict[str, list[str]]:
    """Return the names that stand in several places, with these places."""
    places: dict[str, list[str]] = {}
    for name, place in names:
        places.setdefault(name, []).append(place)
    return {name: where for name, where in places.items() if len(where) > 1}


def test_the_table_names_every_room_once():
    rooms = {room_of(name) for name in modules(PACKAGE)} - {"", "__main__"}
    assert sorted(table()) == sorted(rooms)


@pytest.mark.slow
def test_every_import_goes_to_a_room_above():
    assert arrows_back(PACKAGE, table()) == set()


@pytest.mark.slow
def test_applications_import_only_what_users_can_import():
    """Rooms of one module have no stub: all of ``errors``, and what the certificate and the tube name in the table."""
    rooms = table()
    whole = ("minsnap.basics.", "minsnap.errors.", "minsnap.certificate.", "minsnap.vehicle_tube.")
    found = inner_names(PACKAGE, rooms[rooms.index(FIRST_APPLICATION) :])
    assert {pair for pair in found if not pair[1].startswith(whole) and pair[1] != "minsnap.errors"} == set()


@pytest.mark.slow
def test_no_modules_import_each_other_in_a_circle():
    assert circle(PACKAGE) == []


def test_no_two_modules_share_a_name():
    names = [(path.stem, name) for name, path in modules(PACKAGE).items() if path.stem != "__init__"]
    assert names_used_twice(names) == {}


@pytest.mark.slow
def test_no_two_classes_share_a_name():
    names = [
        (node.name, module)
        for module, path in modules(PACKAGE).items()
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ClassDef)
    ]
    assert names_used_twice(names) == {}


def names_bound(body: list[ast.stmt]) -> list[str]:
    """Return the names that statements of a module bind, once for each time: constants, functions and classes."""
    targets = [t for node in body if isinstance(node, ast.Assign) for t in node.targets]
    targets += [node.target for node in body if isinstance(node, ast.AnnAssign)]
    names = [part.id for target in targets for part in ast.walk(target) if isinstance(part, ast.Name)]
    return names + [node.name for node in body if isinstance(node, (ast.FunctionDef, ast.ClassDef))]


@pytest.mark.slow
def test_no_module_binds_a_name_twice():
    """The second would hide the first without a word."""
    twice = {
        module: sorted({name for name in names if names.count(name) > 1})
        for module, path in modules(PACKAGE).items()
        for names in [names_bound(ast.parse(path.read_text()).body)]
        if len(set(names)) < len(names)
    }
    assert twice == {}


def test_a_name_that_is_bound_twice_is_found():
    assert sorted(names_bound(ast.parse("A, B = 1, 2\ndef f(): pass\nA = 3\n").body)) == ["A", "A", "B", "f"]


WAYS = (
    "from house.upper.first import x\n",
    "from house.upper import first\n",
    "import house.upper.first\n",
    "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from house.upper import first\n",
    "def work():\n    from house.upper.first import x\n    return x\n",
)


def built(house: Path, code: str) -> Path:
    """Return a house of two rooms, of which one has the code."""
    for room, text in (("lower", code), ("upper", "x = 1\n")):
        (house / room).mkdir(parents=True)
        (house / room / "__init__.py").touch()
        (house / room / "first.py").write_text(text)
    (house / "__init__.py").touch()
    return house


@pytest.mark.parametrize("code", WAYS)
def test_every_way_of_importing_is_seen(tmp_path, code):
    house = built(tmp_path / "house", code)
    found = {("house.lower.first", "house.upper.first")}
    assert arrows_back(house, ["lower", "upper"]) == found
    assert arrows_back(house, ["upper", "lower"]) == set()
    assert circle(house) == []
    (house / "upper" / "first.py").write_text("from house.lower.first import work\n")
    assert set(circle(house)) == {"house.lower.first", "house.upper.first"}


@pytest.mark.parametrize("code", WAYS)
def test_what_an_application_takes_from_inside_a_room_is_seen(tmp_path, code):
    house = built(tmp_path / "house", code)
    assert [name for _, name in inner_names(house, ["lower"])] != []
    (house / "upper" / "__init__.pyi").write_text("from .first import x as x\n")
    (house / "lower" / "first.py").write_text("from house.upper import x\n")
    assert inner_names(house, ["lower"]) == set() == inner_names(house, ["upper"])


def test_the_library_is_tested_without_all_applications():
    rooms = table()
    first = rooms.index(FIRST_APPLICATION)
    assert rooms[first:] == list(library_alone.APPLICATIONS)
    (tested,) = re.findall(r"^LIBRARY := ((?:.*\\\n)*.*)$", (ROOT / "Makefile").read_text(), flags=re.MULTILINE)
    folders = {name for name in tested.split() if "." not in name} - {"\\"}
    assert folders == {room for room in rooms[:first] if (ROOT / "tests" / room).is_dir()}


def test_no_public_name_is_also_that_of_a_module_beside_it():
    """Whichever is imported last would be what ``from minsnap.files import formats`` gives."""
    twice = [
        f"{stub.parent.name}.{name}"
        for stub in PACKAGE.rglob("__init__.pyi")
        for home, name in re.findall(r"^from (\S+) import \w+ as (\w+)$", stub.read_text(), flags=re.MULTILINE)
        if home != "." and ((stub.parent / name).is_dir() or (stub.parent / f"{name}.py").exists())
    ]
    assert twice == []


def test_every_public_name_of_a_room_says_what_it_is(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "_ext"))
    room_pages = importlib.import_module("room_pages")
    told = [
        (room, name, room_pages.sentence(name, module))
        for room, stub in room_pages.rooms().items()
        for name, module in room_pages.exported(stub)
    ]
    assert len(told) > 200 and [(room, name) for room, name, text in told if not text.endswith((".", ":"))] == []
