"""Options of shows that are wrong are refused before anything is planned, and leave no folder."""

import socket
from pathlib import Path

import pytest

import minsnap.shows.show_course
from minsnap.cli.app import main

SHOW = """
vehicles: 4
separation: 1
limits: {speed: 3, acceleration: 2}
home: {grid: {spacing: 2}}
acts: [{formation: {circle: {radius: 3, height: 6}}}]
"""
NEAR = SHOW.replace("spacing: 2", "spacing: 0.8").replace("separation: 1", "separation: 1\nground: 0.5")
MANY = SHOW.replace("vehicles: 4", "vehicles: 256").replace("radius: 3", "radius: 90")


@pytest.fixture
def planned(tmp_path, monkeypatch):
    """Return the names of what is planned."""
    asked = []

    def plan_nothing(ways, *_, **__):
        asked.append(len(ways))
        raise AssertionError("planned")

    monkeypatch.setattr(minsnap.shows.show_course, "plan_fleet", plan_nothing)
    monkeypatch.chdir(tmp_path)
    for name, content in (("show.yaml", SHOW), ("near.yaml", NEAR), ("many.yaml", MANY)):
        Path(name).write_text(content)
    return asked


def refusal(capsys, *words):
    with pytest.raises(SystemExit) as left:
        main(list(words))
    said = capsys.readouterr().err
    assert left.value.code == 2, said
    return said


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ("--without 99", "there is no vehicle 99: they are 0 to 3"),
        ("--without=-1", "there is no vehicle -1"),
        ("--without 0,1,2,3", "all 4 vehicles are missing"),
        ("--without x", "give such as 17,18"),
        ("--to mp3", "'mp3' is none of csv"),
        ("--report r.doc", "r.doc does not end in .html or .pdf"),
        ("--report nowhere/r.html", "there is no folder"),
        ("--animate a.jpg", "a.jpg"),
        ("--preview p.doc", "p.doc does not end in"),
        ("--export e.mov", "e.mov does not end in"),
        ("--export e.kmz", "needs a place on the earth"),
        ("--export e.zip --export e.zip", "e.zip is to be written twice"),
        ("--report r.pdf --preview r.pdf", "r.pdf is to be written twice"),
        ("--separation 2", "--separation is of frames"),
        ("--report there/r.html --no-clobber", "r.html"),
        ("-o show.yaml", "show.yaml is a file"),
        ("-o show.yaml/sub", "is no folder that can be written to"),
        ("-o " + 300 * "x", "is no folder that can be written to"),
        ("-o new.skyc --to skyc", "would be a folder"),
        ("near.yaml --returns", "--returns needs homes"),
        ("many.yaml --to crazyswarm2", "256 vehicles: one radio network"),
    ],
)
def test_a_wrong_option_of_a_show_is_refused_before_anything_is_planned(planned, capsys, options, sentence):
    Path("there").mkdir()
    Path("there/r.html").write_text("mine")
    show, *words = options.split() if options.split()[0].endswith(".yaml") else ("show.yaml", *options.split())
    folder = [] if "-o" in words else ["-o", "there" if "--no-clobber" in words else "new"]
    before = sorted(Path().rglob("*"))
    assert sentence in refusal(capsys, "fleet", show, *words, *folder)
    assert sorted(Path().rglob("*")) == before
    assert not planned


def test_a_right_option_is_planned(planned):
    with pytest.raises(AssertionError, match="planned"):
        main(["fleet", "show.yaml", "-o", "new", "--without", "3"])
    assert planned


def test_a_wrong_option_of_the_studio_is_refused_before_the_show_is_planned(planned, capsys):
    pytest.importorskip("viser")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        for options, sentence in (
            ("--separation -1", "separation"),
            ("--downwash 0", "downwash"),
            ("--obstacles o.npz", "--obstacles: leave them out"),
            ("--clearance 1", "give --obstacles FILE with it"),
            (f"--port {taken.getsockname()[1]}", "port"),
        ):
            assert sentence in refusal(capsys, "studio", "show.yaml", "--no-browser", *options.split())
    assert not planned
