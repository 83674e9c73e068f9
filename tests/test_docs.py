"""The documentation builds without a warning and names every public name."""

from __future__ import annotations

import ast
import importlib
import inspect
import pkgutil
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import minsnap

ROOT = Path(__file__).parents[1]


def build(place, *options):
    """Build the documentation; return what was said."""
    command = [sys.executable, "-m", "sphinx", "--keep-going", "-q", "-b", "html", "-d", str(place / "read"), *options]
    run = subprocess.run(command, cwd=place, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return run.stderr.splitlines()


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Return the folder of all pages as html, without the theme, which takes two thirds of the time."""
    place = tmp_path_factory.mktemp("documentation")
    for folder in ("docs", "examples"):
        shutil.copytree(ROOT / folder, place / folder, ignore=shutil.ignore_patterns("_build", "api", "out"))
    said = build(place, "-D", "html_theme=basic", "docs", "html")
    assert [line for line in said if "unsupported theme option" not in line] == []
    return place


@pytest.fixture(scope="module")
def pages(place):
    return place / "html"


@pytest.fixture(scope="module")
def published(place):
    """Return the folder of a few pages with their theme."""
    build(place, "docs", "published", "docs/index.rst", "docs/api.rst")
    return place / "published"


@pytest.mark.slow
def test_names_lead_to_their_pages(pages):
    assert 'href="api/minsnap.plan.html#minsnap.plan"' in (pages / "index.html").read_text()
    listed = (pages / "api.html").read_text()
    for name in minsnap.__all__:
        if isinstance(getattr(minsnap, name), (ModuleType, str)):
            continue
        assert f'href="api/minsnap.{name}.html#minsnap.{name}"' in listed, name
        assert (pages / "api" / f"minsnap.{name}.html").exists(), name


@pytest.mark.slow
def test_no_page_needs_a_network_or_shows_a_formula_raw(pages, published):
    for page in (*pages.rglob("*.html"), *published.rglob("*.html")):
        text = page.read_text()
        assert not re.search(r'<(?:script|link|img)[^>]*(?:src|href)="(?:https?:)?//', text), page
        assert "\\(" not in text.replace("\\(\\)", "") or "<math" in text, page
    assert (pages / "how_it_works.html").read_text().count("<math") > 5


@pytest.mark.slow
def test_every_example_has_a_page_with_its_code(pages):
    shown = (pages / "examples.html").read_text()
    for script in (ROOT / "examples").glob("*.py"):
        assert f'href="examples/{script.stem}.html"' in shown
        assert "def" in (pages / "examples" / f"{script.stem}.html").read_text()
    assert "–plot" not in (pages / "examples" / "mission.html").read_text()
    for figure in re.findall(r'src="_images/([^"]+)"', shown):
        assert (pages / "_images" / figure).exists(), figure


@pytest.mark.slow
def test_the_footer_names_year_and_holder(published):
    text = " ".join((published / "index.html").read_text().split())
    assert re.search(r"Copyright &#169; \d{4}, the minsnap maintainers", text)


def test_every_public_name_is_on_the_page_of_the_interface_and_can_be_had():
    page = (ROOT / "docs" / "api.rst").read_text()
    for name in minsnap.__all__:
        if isinstance(getattr(minsnap, name), (ModuleType, str)):
            continue
        assert f"   ~minsnap.{name}\n" in page, name
        assert getattr(minsnap, name) is not None
    assert set(minsnap.__all__) <= set(dir(minsnap))
    for name, kind in vars(minsnap.errors).items():
        if isinstance(kind, type) and kind.__module__ == minsnap.errors.__name__:
            assert f"   ~minsnap.{name}\n" in page or f"   ~minsnap.errors.{name}\n" in page, name


def test_type_checkers_see_the_public_names():
    tree = ast.parse((ROOT / "minsnap" / "__init__.pyi").read_text())
    seen = {
        alias.asname or alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert set(minsnap.__all__) == seen


STRICT = """
import numpy as np
import minsnap

corners = [(0, 0, 1), (8, 0, 1), (8, 4, 1)]
plan = minsnap.plan(corners, durations=[4, 2], corridor=0.3, yaw="velocity", solver="clarabel")
cost: float = plan.report.cost
speed: float = minsnap.certify(plan, corridor=0.3).max_speed
position: np.ndarray = plan.position(1.0)
minsnap.plan(np.array(corners), limits=minsnap.Limits(speed=3.0), pieces="auto", yaw=[0.0, 1.0, 2.0])
walls: type[minsnap.corridors.Walls] = minsnap.corridors.Walls
"""
WRONG = {"yaw": '"north"', "solver": '"clarabell"', "pieces": '"many"'}


@pytest.mark.slow
def test_a_users_script_passes_a_strict_type_checker_and_wrong_words_do_not(tmp_path):
    asked = [f"minsnap.plan(corners, [4, 2], {name}={word})" for name, word in WRONG.items()]
    (tmp_path / "script.py").write_text("\n".join([STRICT, *asked]) + "\n")
    command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path / "cache"), "script.py"]
    told = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False).stdout
    lines = {int(line.split(":")[1]) for line in told.splitlines() if ": error: " in line}
    first = len(STRICT.splitlines()) + 2
    assert lines == set(range(first, first + len(asked))), told


def test_type_checkers_let_lists_be_given_where_the_pages_say_array_like():
    """A dataclass whose field is an array takes nothing else for them, whatever its ``__post_init__`` converts."""
    page = (ROOT / "docs" / "api.rst").read_text()
    names = {*re.findall(r"~(minsnap\.[\w.]+)\n", page), "minsnap.vehicle.Surface"}
    names.remove("minsnap.vehicle.Quadrotor")  # only type checkers see its ``__init__``
    checked = 0
    for name in sorted(names):
        public = pkgutil.resolve_name(name)
        if isinstance(public, ModuleType) or (isinstance(public, type) and issubclass(public, Exception)):
            continue
        hints = inspect.signature(public).parameters
        for parameters, kind in re.findall(r"^(\w[\w, ]*) : (.*array_like.*)$", inspect.getdoc(public) or "", re.M):
            taken = [hints[parameter].annotation for parameter in parameters.split(", ") if parameter in hints]
            assert not any("FloatArray" in hint for hint in taken), (name, parameters, kind)
            checked += len(taken)
    assert checked > 50


def test_unknown_names_are_attribute_errors():
    with pytest.raises(AttributeError, match="minimum_crackle"):
        _ = minsnap.minimum_crackle


def test_importing_the_package_imports_nothing_heavy():
    code = "import minsnap, sys; print([m for m in ('numpy', 'scipy', 'matplotlib', 'qpsolvers') if m in sys.modules])"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


def test_packages_that_the_pages_name_come_with_the_root():
    code = "import minsnap; minsnap.shows.write_fleet, minsnap.fleet.line_distance, minsnap.plot.plot_path"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stderr == ""


@pytest.mark.parametrize(
    "page", ["README.md", "CHANGELOG.md", "CONTRIBUTING.md", "docs/dependencies.md", "docs/benchmarks.md"]
)
def test_links_within_the_repository_lead_somewhere(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    for target in re.findall(r"\]\((?!https?:)([^)#\s]+)", text):
        assert ((ROOT / page).parent / target).exists(), target


def test_names_that_left_the_root_say_where_they_are():
    for name, home in (
        ("plot_fleet", "plot"),
        ("Explorer", "routes"),
        ("FleetError", "errors"),
        ("Walls", "corridors"),
    ):
        with pytest.raises(AttributeError, match=f"it is minsnap.{home}.{name}"):
            getattr(minsnap, name)


def test_names_that_the_root_had_in_the_last_version_warn_at_the_users_line():
    for name, home in (("plot_path", minsnap.plot), ("read_map", minsnap.routes), ("TimingError", minsnap.errors)):
        with pytest.warns(DeprecationWarning, match=rf"0.3 is the last .*: write minsnap\.\w+\.{name}") as told:
            assert getattr(minsnap, name) is getattr(home, name)
        assert told[0].filename == __file__


def test_what_is_said_in_place_of_other_names_is_there():
    """One named a function by the module that it is in, which no import had loaded."""
    told = re.findall(r"minsnap((?:\.\w+)+)", "\n".join(minsnap._ELSEWHERE.values()))
    assert len(told) > 10
    for names in told:
        found = minsnap
        for name in names[1:].split("."):
            found = getattr(found, name)


def test_every_command_has_an_example_that_it_takes(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "_ext"))
    pages = importlib.import_module("command_pages")
    found = pages.commands()
    assert set(pages.EXAMPLES) == set(found)
    for name, command in found.items():
        asked = pages.EXAMPLES[name]
        assert asked.startswith(f"minsnap {name}")
        command.make_context(name, pages.arguments(asked))


def test_every_command_and_every_format_that_is_written_has_a_line_in_the_tables():
    from minsnap.cli.app import COMMANDS
    from minsnap.files.convert import file_formats

    commands = (ROOT / "docs" / "cli.rst").read_text(encoding="utf-8")
    assert [name for name in COMMANDS if not re.search(rf"^``[a-z|]*\b{name}\b", commands, re.M)] == []
    formats = (ROOT / "docs" / "formats.rst").read_text(encoding="utf-8")
    assert [name for name, kind in file_formats().items() if kind.write and f"``{name}``" not in formats] == []


def _public_names():
    """Return by which name users import each public object, by its identity."""
    rooms = [
        minsnap,
        *(importlib.import_module(f"minsnap.{m.name}") for m in pkgutil.iter_modules(minsnap.__path__) if m.ispkg),
    ]
    named = [
        (room, name) for room in rooms if room.__name__ != "minsnap.torch" for name in getattr(room, "__all__", ())
    ]
    return {id(getattr(room, name)): f"{room.__name__}.{name}" for room, name in reversed(named)}


def test_pages_name_what_users_import():
    """A function was named by an inner module, which no program is to import."""
    public, inner = _public_names(), []
    for page in sorted((ROOT / "docs").glob("*.rst")):
        for name in re.findall(r":(?:func|class):`~?(minsnap(?:\.\w+){3,})`", page.read_text(encoding="utf-8")):
            place, last = name.rsplit(".", 1)
            if place.rsplit(".", 1)[-1][0].isupper():
                continue  # a method of a class
            module = importlib.import_module(place)
            if not hasattr(module, "__path__") and id(getattr(module, last)) in public:
                inner.append(f"{page.name}: {name} is {public[id(getattr(module, last))]}")
    assert inner == []


@pytest.mark.parametrize("page", ["README.md", "docs/which_command.rst"])
def test_the_table_of_jobs_names_every_command(page):
    """But ``experiment``, which is deprecated."""
    from minsnap.cli.app import COMMANDS

    table = (ROOT / page).read_text(encoding="utf-8").partition("Which command for which job")[2].partition("\n## ")[0]
    named = {words.removeprefix("minsnap ").partition(" ")[0] for words in re.findall(r"``?([^`]+)``?", table)}
    assert set(COMMANDS) - named == {"experiment"}


def test_files_and_constants_that_pages_and_docstrings_name_are_there():
    known = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False).stdout.split()
    texts = [ROOT / name for name in known if name.endswith((".py", ".rst", ".md", ".hpp", ".cpp"))]
    text = "\n".join(path.read_text(encoding="utf-8") for path in texts if path.name != "CHANGELOG.md")
    named = set(re.findall(r"``?((?:[\w-]+/)+[\w-]+\.(?:py|cpp|hpp|rst|md|ipynb))``?", text))
    made = {"_datasheet/README.md", "docs/examples.rst", "docs/commands.rst", "docs/rooms.rst"}
    assert {name for name in named - made if not any(f"/{path}".endswith(f"/{name}") for path in known)} == set()
    modules: dict[str, str] = {}
    for path in texts:
        if path.suffix == ".py" and path.is_relative_to(ROOT / "minsnap"):
            modules[path.stem] = modules.get(path.stem, "") + path.read_text(encoding="utf-8")
    pages = "\n".join(path.read_text(encoding="utf-8") for path in texts if path.suffix == ".rst")
    constants = {
        (module, name) for module, name in re.findall(r"``(\w+)\.([A-Z][A-Z_]+)``", pages) if module in modules
    }
    assert constants
    assert {
        (m, name) for m, name in constants if not re.search(rf"^[^\n=]*\b{name}\b[^\n=]*=", modules[m], re.M)
    } == set()
