"""The frame of a setpoint file stays with it."""

import csv
import json
import os

import numpy as np
import pytest

import minsnap
from minsnap.errors import FileError, FrameError, MinsnapError
from minsnap.files.convert import write_any
from minsnap.files.setpoint_csv import frame_of, origin_of

PATH = minsnap.plan([(0, 0, 1), (2, 0, 1), (2, 1, 1.5)], [2.0, 1.5], yaw=0.3)


@pytest.fixture
def ned(tmp_path):
    minsnap.write_csv(PATH, tmp_path / "ned.csv", frame="ned")
    return tmp_path / "ned.csv"


def test_a_ned_file_is_read_as_what_it_is(ned):
    expected = PATH.sample(20.0)
    for frame in (None, "ned"):
        found = minsnap.read_csv(ned, frame)
        assert (found.position == expected.position).all() and found.yaw == pytest.approx(expected.yaw)
    facts = json.loads((ned.parent / "ned.csv.meta").read_text())
    assert (facts["frame"], facts["units"], facts["rate"]) == ("ned", "m, s, rad", 20.0)
    assert np.loadtxt(ned, delimiter=",", skiprows=1).shape == (71, 13), "other programs read it as it is"


def test_a_known_origin_stays_with_the_file(tmp_path):
    home = (47.3977, 8.5456, 488.0)
    minsnap.write_csv(PATH, tmp_path / "home.csv", origin=home)
    assert origin_of(tmp_path / "home.csv") == home and minsnap.read_csv(tmp_path / "home.csv", "enu").yaw is not None
    minsnap.write_csv(PATH, tmp_path / "home.csv")
    assert origin_of(tmp_path / "home.csv") is None and len(list(tmp_path.iterdir())) == 1


def test_another_frame_than_the_file_has_is_refused(ned):
    with pytest.raises(FrameError, match="ned.csv is in ned, as its header says, not in enu"):
        minsnap.read_csv(ned, "enu")


def test_a_file_that_says_nothing_is_in_the_frame_asked_for(tmp_path):
    minsnap.write_csv(PATH, tmp_path / "enu.csv")
    assert minsnap.read_csv(tmp_path / "enu.csv", "frd").position[0] == pytest.approx([0, 0, -1])
    assert minsnap.read_csv(tmp_path / "enu.csv").position[0] == pytest.approx([0, 0, 1])


def test_a_file_in_enu_has_no_note_and_removes_an_older_one(ned):
    minsnap.write_csv(PATH, ned)
    assert [file.name for file in ned.parent.iterdir()] == ["ned.csv"]
    assert minsnap.read_csv(ned).position[0] == pytest.approx([0, 0, 1])


def test_a_crazyflie_file_of_the_same_name_removes_an_older_note(ned):
    """`check` refused what had just been written: it was not the file that the note was written for."""
    write_any(minsnap.line(), ned, "crazyflie")
    assert [file.name for file in ned.parent.iterdir()] == ["ned.csv"] and frame_of(ned) == "enu"


def test_a_note_on_another_file_is_refused(ned):
    ned.write_text(ned.read_text().replace("0.05,", "0.050,"))
    with pytest.raises(FileError, match="is not the file that .*ned.csv.meta was written for"):
        minsnap.read_csv(ned)


@pytest.mark.parametrize(
    "text", ["", "{}", '{"frame": "up", "crc32": 1}', "[" * 5000, '{"frame": "ned", "crc32": "x"}']
)
def test_a_damaged_note_is_refused(ned, text):
    (ned.parent / "ned.csv.meta").write_text(text)
    with pytest.raises(FileError, match="ned.csv.meta"):
        minsnap.read_csv(ned)


def test_arguments_in_the_wrong_order_are_named(tmp_path):
    with pytest.raises(FileError, match="takes a path or samples first and the file's name second, not 'a.csv'"):
        minsnap.write_csv("a.csv", PATH)


def test_the_command_line_knows_the_frame(tmp_path, monkeypatch, capsys):
    from minsnap.cli import main

    monkeypatch.chdir(tmp_path)
    for arguments in ("rect --time 14 --frame ned -o r.csv", "convert r.csv again.csv", "check r.csv --json"):
        capsys.readouterr()
        with pytest.raises(SystemExit) as left:
            main(arguments.split())
        assert not left.value.code
    assert json.loads(capsys.readouterr().out)["frame"] == "ned"
    assert minsnap.read_csv("again.csv").position[0] == pytest.approx([-3.0, -2.0, 1.5])
    with pytest.raises(SystemExit) as left:
        main("check r.csv --frame enu".split())
    assert left.value.code == 2 and "r.csv is in ned" in capsys.readouterr().err


@pytest.mark.parametrize("frame", ["ned", "flu", "frd", "optitrack"])
def test_a_file_that_is_moved_without_its_note_keeps_its_frame(tmp_path, frame):
    curve = minsnap.plan([[0, 0, 1], [4, 0, 1], [4, 3, 2]], durations=[3, 3])
    minsnap.write_csv(curve, tmp_path / "a.csv", frame=frame)
    (tmp_path / "a.csv").rename(tmp_path / "moved.csv")
    assert np.allclose(minsnap.read_csv(tmp_path / "moved.csv").position, curve.sample().position, atol=1e-12)
    with pytest.raises(FrameError, match=f"moved.csv is in {frame}, as its header says, not in enu"):
        minsnap.read_csv(tmp_path / "moved.csv", "enu")


def test_the_frame_is_a_last_column_that_readers_by_name_do_not_notice(tmp_path):
    path = minsnap.circle(radius=2.0)
    minsnap.write_csv(path, tmp_path / "enu.csv")
    minsnap.write_csv(path, tmp_path / "ned.csv", frame="ned")
    with open(tmp_path / "ned.csv") as ned, open(tmp_path / "enu.csv") as enu:
        header = ned.readline()
        assert header == enu.readline().strip() + ",frame_ned\n"
    rows = np.loadtxt(tmp_path / "ned.csv", delimiter=",", skiprows=1)
    assert (rows[:, 12] == 1.0).all() and np.allclose(rows[:, 3], -1.5)
    with open(tmp_path / "ned.csv", newline="") as file:
        assert {float(row["z"]) for row in csv.DictReader(file)} == {-1.5}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("frame_ned", "frame_ned,frame_flu", "both say the frame"),
        (",1.0\n0.05", ",2.0\n0.05", "line 2: frame_ned says the frame of all rows, and is 1 in each"),
        ("frame_ned", "frame_nwu", "column 'frame_nwu' is not known"),
    ],
)
def test_a_malformed_column_of_the_frame_is_refused(tmp_path, old, new, said):
    minsnap.write_csv(minsnap.circle(radius=2.0), tmp_path / "a.csv", frame="ned")
    text = (tmp_path / "a.csv").read_text().replace(old, new, 1)
    text = text.replace(",1.0\n", ",1.0,1.0\n") if new.count("frame") == 2 else text
    (tmp_path / "b.csv").write_text(text)
    with pytest.raises(MinsnapError, match=said):
        minsnap.read_csv(tmp_path / "b.csv")


def test_a_file_below_ground_throughout_has_to_say_its_frame(tmp_path):
    (tmp_path / "a.csv").write_text("t,x,y,z\n0,1,2,-1.5\n1,1,2,-1.5\n")
    with pytest.raises(FrameError, match="lies below ground throughout .* and does not say its frame"):
        minsnap.read_csv(tmp_path / "a.csv")
    assert minsnap.read_csv(tmp_path / "a.csv", "ned").position[0].tolist() == [2.0, 1.0, 1.5]
    cellar = minsnap.read_csv(tmp_path / "a.csv", "enu")
    assert cellar.position[0].tolist() == [1.0, 2.0, -1.5]
    minsnap.write_csv(cellar, tmp_path / "cellar.csv")
    assert minsnap.read_csv(tmp_path / "cellar.csv").position[0].tolist() == [1.0, 2.0, -1.5]


def test_a_pipe_is_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(FileError, match=r"pipe.csv"):
        minsnap.read_csv(tmp_path / "pipe.csv")
