"""Whether a tag is that of the version, and the changelog has it: ``python release/tag_check.py v0.3.0``.

Every other tag of the repository is looked for in the changelog too, with or without an argument.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def released(changelog: str) -> list[str]:
    """Return the versions that a changelog has with a date, newest first."""
    return re.findall(r"^## \[(\d[^\]]*)\] - \d{4}-\d\d-\d\d$", changelog, flags=re.MULTILINE)


def fault_of(tag: str, version: str, changelog: str) -> str:
    """Return what is wrong with the tag of a release, in a sentence; nothing where all is right."""
    if tag != f"v{version}":
        return f"the tag is {tag}, and the version in minsnap/basics/version.py {version}"
    newest = next(iter(released(changelog)), "none")
    return "" if newest == version else f"the newest version with a date in CHANGELOG.md is {newest}, not {version}"


def unknown_tags(tags: list[str], changelog: str) -> list[str]:
    """Return the tags of versions that a changelog does not have."""
    versions = released(changelog)
    return [tag for tag in tags if tag.removeprefix("v") not in versions]


def main(arguments: list[str]) -> None:
    """Check, and end with a sentence where something is wrong."""
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    source = (ROOT / "minsnap" / "basics" / "version.py").read_text(encoding="utf-8")
    (version,) = re.findall(r'^__version__ = "(.*)"$', source, flags=re.MULTILINE)
    listed = subprocess.run(["git", "tag", "--list", "v*"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    unknown = unknown_tags(listed.split(), changelog)
    faults = [fault_of(tag, version, changelog) for tag in arguments]
    faults += [f"CHANGELOG.md does not have {', '.join(unknown)}"] * bool(unknown)
    sys.exit(next(filter(None, faults), 0))


if __name__ == "__main__":
    main(sys.argv[1:])
