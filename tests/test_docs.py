"""The documentation builds without a warning and names every public name."""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import minsnap

ROOT = Path(__file__).parents[1]


@pytest.mark.slow
def test_documentation_builds_without_a_warning(tmp_path):
    source = shutil.copytree(ROOT / "docs", tmp_path / "docs", ignore=shutil.ignore_patterns("_build", "api"))
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html"]
    run = subprocess.run([*command, str(source), str(tmp_path / "html")], capture_output=True, text=True, check=False)
    assert (run.returncode, run.stderr) == (0, "")
    assert (tmp_path / "html" / "api" / "generated" / "minsnap.shapes.curves.html").exists()


def test_every_public_name_is_on_the_page_of_the_interface_and_can_be_had():
    page = (ROOT / "docs" / "api.rst").read_text()
    for name in minsnap.__all__:
        assert f"   ~minsnap.{name}\n" in page, name
        assert getattr(minsnap, name) is not None
    assert set(minsnap.__all__) <= set(dir(minsnap))


def test_type_checkers_see_the_public_names():
    tree = ast.parse((ROOT / "minsnap" / "__init__.pyi").read_text())
    seen = {
        alias.asname or alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert set(minsnap.__all__) == seen


def test_unknown_names_are_attribute_errors():
    with pytest.raises(AttributeError, match="minimum_crackle"):
        _ = minsnap.minimum_crackle


def test_importing_the_package_imports_nothing_heavy():
    code = "import minsnap, sys; print([m for m in ('numpy', 'scipy', 'matplotlib', 'qpsolvers') if m in sys.modules])"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


@pytest.mark.parametrize(
    "page", ["README.md", "CHANGELOG.md", "CONTRIBUTING.md", "docs/dependencies.md", "docs/benchmarks.md"]
)
def test_links_within_the_repository_lead_somewhere(page):
    import re

    text = (ROOT / page).read_text(encoding="utf-8")
    for target in re.findall(r"\]\((?!https?:)([^)#\s]+)", text):
        assert ((ROOT / page).parent / target).exists(), target
