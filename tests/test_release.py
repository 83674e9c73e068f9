"""What a release says of itself: one version in every file, and a changelog that a user can read."""

import ast
import importlib
import json
import re
from pathlib import Path

import yaml
from packaging.specifiers import SpecifierSet

import minsnap

ROOT = Path(__file__).parents[1]


def sections() -> dict[str, str]:
    """Return the versions of the changelog, newest first, with the text of each."""
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    parts = re.split(r"^## \[(.+?)\](.*)$", text, flags=re.MULTILINE)[1:]
    return {name + date: body for name, date, body in zip(parts[::3], parts[1::3], parts[2::3], strict=True)}


def test_every_file_names_the_version_of_the_package():
    unreleased, newest = list(sections())[:2]
    assert unreleased == "Unreleased"
    assert re.fullmatch(re.escape(minsnap.__version__) + r" - \d{4}-\d\d-\d\d", newest)
    version, date = newest.split(" - ")
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\n  version: {version}\n" in (ROOT / "recipe" / "recipe.yaml").read_text(encoding="utf-8")
    for package in (ROOT / "ros").glob("*/package.xml"):
        assert f"<version>{version}</version>" in package.read_text(encoding="utf-8"), package
    for package in ("docs/play/package.json", "recipe/vcpkg/minsnap/vcpkg.json"):
        assert json.loads((ROOT / package).read_text(encoding="utf-8"))["version"] == version, package
    assert f'version="{version}"' in (ROOT / "ros/minsnap_ros/setup.py").read_text(encoding="utf-8")
    assert f"\nversion: {version}\n" in citation and f"\ndate-released: {date}\n" in citation


def test_the_conda_recipe_asks_for_what_pip_does():
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    (asked,) = re.findall(r"^dependencies = (\[.*?^\])", project, flags=re.MULTILINE | re.DOTALL)
    recipe = yaml.safe_load((ROOT / "recipe" / "recipe.yaml").read_text(encoding="utf-8"))
    conda = {line.replace(" ", "").replace("matplotlib-base", "matplotlib") for line in recipe["requirements"]["run"]}
    assert conda - {"python>=${{python_min}}"} == set(ast.literal_eval(asked))


def test_what_the_workflows_make_can_be_made():
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), flags=re.MULTILINE)
    used = [(ROOT / ".ci" / "run").read_text(encoding="utf-8")]
    used += [path.read_text(encoding="utf-8") for path in sorted((ROOT / ".github" / "workflows").glob("*.yml"))]
    wanted = re.findall(r"(?:^|run: |; then )make ([a-z-]+)", "\n".join(used), flags=re.MULTILINE)
    assert len(wanted) >= 8 and set(wanted) <= set(targets)


def test_ros_2_installs_as_its_page_says():
    """Of the NumPy of Humble, of Jazzy and of today the page and the package together take that of Jazzy."""
    page = (ROOT / "ros/minsnap_ros/README.md").read_text(encoding="utf-8")
    asked = set(re.findall(r'pip install \.\./\.\. "numpy(.*?)"', page))
    needed = re.findall(r'^    "numpy(.*?)"', (ROOT / "pyproject.toml").read_text(encoding="utf-8"), flags=re.MULTILINE)
    together = SpecifierSet(",".join([*asked, *needed]))
    assert asked and needed and list(together.filter(["1.21.5", "1.26.4", "2.2.0"])) == ["1.26.4"]


def test_a_tag_that_is_not_of_the_version_or_the_changelog_is_refused(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "release"))
    check = importlib.import_module("tag_check")
    changelog = "# Changelog\n\n## [Unreleased]\n\n## [0.3.0] - 2026-12-01\n\n## [0.2.0] - 2026-11-22\n"
    assert check.fault_of("v0.3.0", "0.3.0", changelog) == ""
    assert "the tag is v0.3.1" in check.fault_of("v0.3.1", "0.3.0", changelog)
    assert "is 0.3.0, not 0.4.0" in check.fault_of("v0.4.0", "0.4.0", changelog)
    assert "is none, not 0.4.0" in check.fault_of("v0.4.0", "0.4.0", "## [Unreleased]\n")
    assert check.unknown_tags(["v0.2.0", "v0.2.1"], changelog) == ["v0.2.1"]
    assert check.released((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"))[0] == minsnap.__version__


def test_actions_are_pinned_by_digest():
    used = [
        line.partition("uses: ")[2]
        for path in sorted((ROOT / ".github" / "workflows").glob("*.yml"))
        for line in path.read_text(encoding="utf-8").splitlines()
        if "uses: " in line and "uses: ./" not in line
    ]
    assert used and [action for action in used if not re.fullmatch(r"[\w./-]+@[0-9a-f]{40} # v\d\S*", action)] == []
