import io

import pytest

from minsnap.cli.batch_commands import BatchLine


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def clock():
    return [100.0]


def line(stream, clock, found=0):
    made = BatchLine(1000, stream, lambda: clock[0])
    return made, made.begin(found)


def test_share_rate_time_left_and_failures(clock):
    """The start of the workers counted as time of the rows, which then seemed ten times as slow as they are."""
    made, add = line(io.StringIO(), clock, found=200)
    clock[0] += 60.0
    add({"done": 200})
    assert made.text() == "400 of 1000 problems"
    clock[0] += 10.0
    add({"done": 90, "timeout": 4})
    add({"infeasible": 6})
    assert made.text() == "500 of 1000 problems, 10 a second, 50 s left, 6 infeasible, 4 timeout"
    clock[0] += 4990.0
    assert "6 h 57 min left" in made.text() and "0.02 a second" in made.text()


def test_a_terminal_is_rewritten_in_place_and_cleared(clock, monkeypatch, capsys):
    monkeypatch.setattr("minsnap.basics.progress.DELAY", 0.0)
    monkeypatch.setenv("TERM", "xterm")
    made, add = line(Terminal(), clock)
    add({"done": 10})
    made.clear()
    shown = capsys.readouterr().err
    assert "batch" in shown and "10 of 1000" in shown and shown.endswith("\x1b[2K")


@pytest.mark.parametrize("stream", [io.StringIO(), Terminal()])
def test_elsewhere_and_on_a_dumb_terminal_there_is_a_line_every_half_a_minute(clock, monkeypatch, stream):
    monkeypatch.setenv("TERM", "dumb")
    made, add = line(stream, clock)
    for _ in range(70):
        clock[0] += 1.0
        add({"done": 1})
    made.clear()
    assert [text.split()[0] for text in stream.getvalue().splitlines()] == ["30", "60"]


def test_after_a_hundred_rows_it_says_once_how_long_all_will_take(clock):
    stream = io.StringIO()
    made, add = line(stream, clock)
    clock[0] += 20.0
    for _ in range(5):
        clock[0] += 5.0
        add({"done": 40})
    assert stream.getvalue().splitlines()[-1] == "about 2 min for 1000 problems, by the first 160"


def test_a_rate_that_no_episode_has_is_refused_before_anything_is_planned(call, tmp_path):
    (tmp_path / "walks.yaml").write_text("{generator: walks, count: 3}")
    done = call("batch", "walks.yaml", "-o", "walks", "--format", "lerobot", "--rate", "0")
    assert done.returncode == 2 and "--rate is 0: give a whole number of frames a second" in done.stderr
    assert not (tmp_path / "walks").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--rate", 20), "--rate 20 is of episodes: give --format lerobot with it"),
        (("--workers", 1, "--scheduler", "tcp://127.0.0.1:1"), "--workers are of this machine"),
    ],
)
def test_an_option_without_effect_is_refused(call, tmp_path, words, said):
    (tmp_path / "walks.yaml").write_text("{generator: walks, count: 3}")
    done = call("batch", "walks.yaml", "-o", "walks", *words)
    assert done.returncode == 2 and said in done.stderr and not (tmp_path / "walks").exists()


@pytest.mark.slow
def test_two_formats_of_a_dataset_are_not_mixed_in_a_folder(call, tmp_path):
    (tmp_path / "walks.yaml").write_text("{generator: walks, count: 3}")
    for first, other in (("parquet", "lerobot"), ("lerobot", "parquet")):
        asked = "batch", "walks.yaml", "--workers", "1", "-o", first, "--format"
        assert call(*asked, first).returncode == 0
        done = call(*asked, other)
        assert done.returncode == 2 and f"{first} holds a dataset of another format" in done.stderr
        assert call(*asked, first).returncode == 0
