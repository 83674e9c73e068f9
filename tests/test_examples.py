"""Every example runs, headless, and writes what it tells of."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import matplotlib
import pytest

FOLDER = Path(__file__).parents[1] / "examples"


@pytest.mark.parametrize("script", sorted(FOLDER.glob("*.py")), ids=lambda script: script.stem)
def test_example_runs_and_writes_its_figure(script, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", [str(script), str(tmp_path)])
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(FOLDER))
    matplotlib.use("agg")
    runpy.run_path(str(script), run_name="__main__")
    assert [file for file in tmp_path.iterdir() if file.stat().st_size > 0]


def test_every_example_is_in_the_list():
    listed = (FOLDER / "README.md").read_text()
    assert [script.name for script in FOLDER.glob("*.py") if f"`{script.name}`" not in listed] == []
