"""What a release says of itself: one version in every file, and a changelog that a user can read."""

import re
from pathlib import Path

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
    assert f"\nversion: {version}\n" in citation and f"\ndate-released: {date}\n" in citation


def test_a_version_has_at_most_40_entries_of_at_most_3_lines():
    for version, body in sections().items():
        entries = [entry for entry in re.split(r"^(?=- |### )", body, flags=re.MULTILINE) if entry.startswith("- ")]
        assert len(entries) <= 40, version
        assert not [entry for entry in entries if len(entry.strip().splitlines()) > 3], version
