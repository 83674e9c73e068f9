"""Every example runs, headless, and writes what it tells of."""

from __future__ import annotations

import json
import runpy
import sys
from pathlib import Path

import matplotlib
import pytest

FOLDER = Path(__file__).parents[1] / "examples"


@pytest.mark.slow
@pytest.mark.parametrize("script", sorted(FOLDER.glob("*.py")), ids=lambda script: script.stem)
def test_example_runs_and_writes_its_figure(script, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", [str(script), str(tmp_path)])
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(FOLDER))
    matplotlib.use("agg")
    runpy.run_path(str(script), run_name="__main__")
    assert [file for file in tmp_path.iterdir() if file.stat().st_size > 0]


NOTEBOOKS = {
    "first_flight": ("inside at every instant: True",),
    "lesson": ("margin -4.714 mm, inside: False", "cost  1557.006", "inside: True", "(proved: True)"),
}
"""What notebooks say, among other things."""


@pytest.mark.parametrize("notebook", sorted(FOLDER.glob("*.ipynb")), ids=lambda path: path.stem)
def test_notebook(notebook, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "__main__"}
    for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
        assert not cell.get("outputs"), "clear the outputs of a notebook before it is committed"
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), str(notebook), "exec"), names)
    told = capsys.readouterr().out
    assert [said for said in NOTEBOOKS[notebook.stem] if said not in told] == []
    if notebook.stem == "first_flight":
        assert (tmp_path / "first_flight.csv").stat().st_size > 0


def test_every_example_is_in_the_list():
    listed = (FOLDER / "README.md").read_text()
    assert [
        script.name for script in (*FOLDER.glob("*.py"), *FOLDER.glob("*.ipynb")) if f"`{script.name}`" not in listed
    ] == []
