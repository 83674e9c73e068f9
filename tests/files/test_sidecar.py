"""The frame of a setpoint file stays with it."""

import json

import numpy as np
import pytest

import minsnap
from minsnap.errors import FileError, FrameError
from minsnap.files.sidecar import origin_of

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
    assert np.loadtxt(ned, delimiter=",", skiprows=1).shape == (71, 12), "other programs read it as it is"


def test_a_known_origin_stays_with_the_file(tmp_path):
    home = (47.3977, 8.5456, 488.0)
    minsnap.write_csv(PATH, tmp_path / "home.csv", origin=home)
    assert origin_of(tmp_path / "home.csv") == home and minsnap.read_csv(tmp_path / "home.csv", "enu").yaw is not None
    minsnap.write_csv(PATH, tmp_path / "home.csv")
    assert origin_of(tmp_path / "home.csv") is None and len(list(tmp_path.iterdir())) == 1


def test_another_frame_than_the_file_has_is_refused(ned):
    with pytest.raises(FrameError, match="ned.csv is in ned, as .*ned.csv.meta says, and was asked for in enu"):
        minsnap.read_csv(ned, "enu")


def test_a_file_without_a_note_is_in_the_frame_asked_for(ned):
    (ned.parent / "ned.csv.meta").unlink()
    assert minsnap.read_csv(ned, "ned").position[0] == pytest.approx([0, 0, 1])
    assert minsnap.read_csv(ned).position[0] == pytest.approx([0, 0, -1])


def test_a_file_in_enu_has_no_note_and_removes_an_older_one(ned):
    minsnap.write_csv(PATH, ned)
    assert [file.name for file in ned.parent.iterdir()] == ["ned.csv"]
    assert minsnap.read_csv(ned).position[0] == pytest.approx([0, 0, 1])


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
