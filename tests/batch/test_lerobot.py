"""Plans as LeRobot episodes: what each frame holds, and where the tables say that it lies."""

import json

import numpy as np
import pandas
import pytest
from batches import walks

from minsnap.batch import export_lerobot, run_batch, trajectory_of
from minsnap.batch.columns import parquet_writer, record_batch
from minsnap.batch.dataset_rows import planned_row, stopped_row
from minsnap.batch.folder import SPEC
from minsnap.errors import FileError, InputError


def plans(folder, rows, number=0):
    folder.mkdir(exist_ok=True)
    with open(folder / f"part-{number:05d}.parquet", "wb") as file:
        writer = parquet_writer(file, {})
        writer.write_batch(record_batch(rows))
        writer.close()


def test_episodes_are_the_plans(tmp_path):
    rows = [planned_row(walks(), number) for number in range(4)]
    failed = stopped_row(walks(), 9, "timeout", "slow")
    plans(tmp_path / "plans", [rows[0], failed, rows[1]])
    plans(tmp_path / "plans", rows[2:], 1)
    assert export_lerobot(tmp_path / "plans", tmp_path, fps=10) == 4
    info = json.loads((tmp_path / "meta/info.json").read_text())
    episodes = pandas.read_parquet(tmp_path / "meta/episodes")
    assert list(episodes["data/file_index"]) == [0, 0, 1, 1] and info["splits"] == {"train": "0:4"}
    frames = pandas.concat(
        pandas.read_parquet(tmp_path / info["data_path"].format(chunk_index=0, file_index=file)) for file in (0, 1)
    )
    assert len(frames) == info["total_frames"] and list(frames["index"]) == list(range(len(frames)))
    for number, episode in episodes.iterrows():
        own = frames.iloc[episode["dataset_from_index"] : episode["dataset_to_index"]]
        assert (own["episode_index"] == number).all() and own["timestamp"].to_numpy() == pytest.approx(
            np.arange(len(own)) / 10.0, abs=1e-6
        )
        curve, t = trajectory_of(rows[number]), np.arange(len(own)) / 10.0
        then = np.minimum(t + 0.1, curve.duration)
        state, action, ahead = (np.stack(own[name]) for name in list(info["features"])[:1] + ["action", AHEAD])
        assert state == pytest.approx(np.hstack([curve(t), curve(t, 1)]), abs=1e-5)
        assert action == pytest.approx(np.hstack([curve(then), curve(then, 1), curve(then, 2)]), abs=1e-4)
        waypoints = rows[number]["waypoints"]
        assert ahead[0] == pytest.approx(waypoints[1:3].ravel(), abs=1e-5)
        assert ahead[-1, 3:] == pytest.approx(waypoints[-1], abs=1e-5)
    stats = json.loads((tmp_path / "meta/stats.json").read_text())
    table = np.stack(frames["action"])
    assert stats["action"]["mean"] == pytest.approx(table.mean(axis=0), abs=1e-5)
    assert stats["action"]["std"] == pytest.approx(table.std(axis=0), abs=1e-5)


AHEAD = "observation.environment_state"


def test_tasks_are_indexed_by_their_sentence(tmp_path):
    plans(tmp_path / "plans", [planned_row(walks(), 0)])
    export_lerobot(tmp_path / "plans", tmp_path)
    assert pandas.read_parquet(tmp_path / "meta/tasks.parquet").index.tolist() == ["fly through the waypoints"]


def test_a_folder_holds_one_format(tmp_path):
    """The check was in the command alone."""
    plans(tmp_path / "plans", [planned_row(walks(), 0)])
    export_lerobot(tmp_path / "plans", tmp_path / "episodes")
    with pytest.raises(FileError, match="another format"):
        run_batch(walks(), tmp_path / "episodes", workers=1)
    (tmp_path / "plans" / SPEC).write_text("{}")
    with pytest.raises(FileError, match="another format"):
        export_lerobot(tmp_path / "plans", tmp_path / "plans")


def test_a_folder_that_cannot_be_written_to_is_a_sentence(tmp_path):
    """That of a complete batch on a disk that only reads was an OSError with the name of a file inside."""
    (tmp_path / SPEC).mkdir()
    with pytest.raises(FileError, match="is no folder that can be written to"):
        run_batch(walks(), tmp_path, workers=1)


def test_nothing_planned_is_no_dataset(tmp_path):
    plans(tmp_path / "plans", [stopped_row(walks(), 0, "timeout", "slow")])
    with pytest.raises(FileError, match="holds no plan"):
        export_lerobot(tmp_path / "plans", tmp_path)
    with pytest.raises(InputError, match="fps is 0.5"):
        export_lerobot(tmp_path / "plans", tmp_path, fps=0.5)
